/* SPDX-License-Identifier: MIT */
/* The sandbox of helper programs: limits, Landlock, seccomp. */
#include "sandbox.h"

#include "protocol/common/landlock.h"
#include "protocol/sanitized.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#define DEFAULT_ADDRESS_SPACE_BYTES (8ULL << 30)
#define UNCONFINED "FARLIGHT_UNCONFINED" /* environment variable */

static bool set_limit(int resource, uint64_t value)
{
    struct rlimit limit;

    if (getrlimit((__rlimit_resource_t)resource, &limit) != 0)
        return false;
    if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < value)
        value = limit.rlim_cur; /* keeps a tighter limit of the user's */
    limit.rlim_cur = limit.rlim_max = (rlim_t)value;
    return setrlimit((__rlimit_resource_t)resource, &limit) == 0;
}

static bool set_limits(const struct sandbox_options *options)
{
    uint64_t address_space = options->address_space_bytes;

    if (address_space == 0)
        address_space = DEFAULT_ADDRESS_SPACE_BYTES;
    if (!SANITIZED && !set_limit(RLIMIT_AS, address_space))
        return false;
    if (options->cpu_seconds != 0 && !set_limit(RLIMIT_CPU, options->cpu_seconds))
        return false;
    signal(SIGXFSZ, SIG_IGN); /* a write beyond the limit then fails instead of ending the process */
    /* A sanitizer's report goes to standard error, which may be a file. */
    return set_limit(RLIMIT_CORE, 0) && (SANITIZED || set_limit(RLIMIT_FSIZE, options->file_bytes));
}

static bool is_alone(char *reason, size_t reason_bytes)
{
    const unsigned threads = landlock_thread_count();

    if (threads == 0)
        snprintf(reason, reason_bytes, "cannot count the threads of this process: /proc/self/task: %s",
                 strerror(errno));
    else if (threads > 1)
        snprintf(reason, reason_bytes,
                 "this process has %u threads, and Landlock would bind one: a library has started threads before",
                 threads);
    return threads == 1;
}

/* ---- Landlock ---- */

/* Grants rights to a folder. A missing folder is no error here: opening a file in it reports that. */
static bool allow_folder(int ruleset, const char *folder, uint64_t rights)
{
    const int fd = open(folder, O_PATH | O_CLOEXEC | O_DIRECTORY);
    const bool allowed = fd < 0 || landlock_allow(ruleset, fd, rights);

    if (fd >= 0)
        close(fd);
    return allowed;
}

static bool allow_folders(int ruleset, const struct sandbox_options *options, uint64_t handled)
{
    /* Paths that the dynamic linker, the C library and the plug-in search of image readers may still open. */
    static const char *const system_folders[] = {"/usr/lib", "/usr/lib64", "/lib", "/lib64",
                                                 "/sys/devices/system/cpu"};
    const uint64_t read_rights = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
    uint64_t write_rights =
        read_rights | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_TRUNCATE;

    if (options->allow_rename)
        write_rights |= LANDLOCK_ACCESS_FS_REMOVE_FILE;
    write_rights &= handled;
    for (size_t i = 0; i < sizeof(system_folders) / sizeof(system_folders[0]); i++)
        if (!allow_folder(ruleset, system_folders[i], read_rights))
            return false;
    if (SANITIZED && !allow_folder(ruleset, "/proc", read_rights)) /* the leak sanitizer lists threads there */
        return false;
    for (size_t i = 0; i < options->read_folder_count; i++)
        if (options->read_folders[i] && !allow_folder(ruleset, options->read_folders[i], read_rights))
            return false;
    for (size_t i = 0; i < options->write_folder_count; i++)
        if (options->write_folders[i] && !allow_folder(ruleset, options->write_folders[i], write_rights))
            return false;
    return true;
}

/* -1: the kernel has no Landlock; 0: failed; 1: in force */
static int enter_landlock(const struct sandbox_options *options)
{
    uint64_t handled;
    const int ruleset = landlock_create(&handled);
    bool entered;

    if (handled == 0)
        return -1;
    if (ruleset < 0)
        return 0;
    entered = allow_folders(ruleset, options, handled) && landlock_enforce(ruleset);
    close(ruleset);
    return entered ? 1 : 0;
}

/* ---- seccomp ---- */

static const char *const allowed_calls[] = {
    /* Memory, threads, time. */
    "brk", "munmap", "mremap", "madvise", "futex", "set_robust_list", "rseq", "set_tid_address", "sched_yield",
    "sched_getaffinity", "getcpu", "clock_gettime", "clock_getres", "gettimeofday", "time", "nanosleep",
    "clock_nanosleep", "restart_syscall", "arch_prctl", "membarrier",
    /* descriptors */
    "read", "readv", "pread64", "write", "writev", "pwrite64", "close", "lseek", "fstat", "newfstatat", "stat",
    "lstat", "statx", "open", "openat", "openat2", "access", "faccessat", "faccessat2", "readlink", "readlinkat",
    "getdents64", "dup", "poll", "ppoll", "sendto", "sendmsg", "recvfrom", "recvmsg", "shutdown", "fadvise64",
    "getcwd", "statfs", "fstatfs", "select", "pselect6",
    /* The process itself. */
    "exit", "exit_group", "rt_sigprocmask", "rt_sigreturn", "sigaltstack", "getpid", "gettid", "getuid", "geteuid",
    "getgid", "getegid", "getppid", "getrandom", "sysinfo", "uname", "getrusage", "times", "getrlimit"};
static const char *const write_calls[] = {"fsync", "fdatasync", "ftruncate", "fallocate", "fchmod", "umask"};
static const char *const rename_calls[] = {"rename", "renameat", "renameat2", "unlink", "unlinkat", "linkat"};

static bool allow_calls(scmp_filter_ctx filter, const char *const *names, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        int number = seccomp_syscall_resolve_name(names[i]);

        /* Not every architecture and version of libseccomp knows every name. */
        if (number != __NR_SCMP_ERROR && number >= 0 && seccomp_rule_add(filter, SCMP_ACT_ALLOW, number, 0) != 0)
            return false;
    }
    return true;
}

/* Allows a call if the bits of `mask` of an argument have this value. */
static bool allow_masked(scmp_filter_ctx filter, int number, unsigned argument, uint64_t mask, uint64_t value)
{
    const struct scmp_arg_cmp is_value = {
        .arg = argument, .op = SCMP_CMP_MASKED_EQ, .datum_a = mask, .datum_b = value};

    return seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, number, 1, &is_value) == 0;
}

static bool allow_with_argument(scmp_filter_ctx filter, int number, unsigned argument, uint64_t value)
{
    const struct scmp_arg_cmp is_value = {.arg = argument, .op = SCMP_CMP_EQ, .datum_a = value, .datum_b = 0};

    return seccomp_rule_add_array(filter, SCMP_ACT_ALLOW, number, 1, &is_value) == 0;
}

/* Forbids memory that is both writable and executable; code comes from files alone, as the dynamic linker maps
 * it. */
static bool allow_memory(scmp_filter_ctx filter)
{
    return allow_masked(filter, SCMP_SYS(mmap), 2, PROT_EXEC, 0) &&
           allow_masked(filter, SCMP_SYS(mmap), 2, PROT_WRITE | PROT_EXEC, PROT_EXEC) &&
           allow_masked(filter, SCMP_SYS(mprotect), 2, PROT_EXEC, 0);
}

/* Allows threads, but no processes and no namespaces. The flags of clone3 lie in memory, where no filter sees
 * them, so it is refused and the C library falls back to clone. Signals reach only threads of this process,
 * which are all bound: abort() uses tgkill. Signal handlers can be read but not changed. */
static bool allow_threads(scmp_filter_ctx filter)
{
    const uint64_t of_threads = CLONE_VM | CLONE_SIGHAND | CLONE_THREAD;
    const uint64_t of_others = CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER |
                               CLONE_NEWPID | CLONE_NEWNET | CLONE_VFORK | CLONE_PTRACE;

    return allow_masked(filter, SCMP_SYS(clone), 0, of_threads | of_others, of_threads) &&
           seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0) == 0 &&
           allow_with_argument(filter, SCMP_SYS(tgkill), 0, (uint64_t)getpid()) &&
           allow_with_argument(filter, SCMP_SYS(rt_sigaction), 1, 0);
}

/* Restricts fcntl and ioctl to the requests of a reader of files, so that no descriptor gains abilities. */
static bool allow_arguments(scmp_filter_ctx filter)
{
    static const unsigned fcntl_commands[] = {F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_DUPFD_CLOEXEC};
    static const unsigned long ioctl_requests[] = {TCGETS, FIONREAD};

    for (size_t i = 0; i < sizeof(fcntl_commands) / sizeof(fcntl_commands[0]); i++)
        if (!allow_with_argument(filter, SCMP_SYS(fcntl), 1, fcntl_commands[i]))
            return false;
    for (size_t i = 0; i < sizeof(ioctl_requests) / sizeof(ioctl_requests[0]); i++)
        if (!allow_with_argument(filter, SCMP_SYS(ioctl), 1, ioctl_requests[i]))
            return false;
    /* Limits can be read but not changed. */
    return allow_with_argument(filter, SCMP_SYS(prlimit64), 2, 0);
}

/* Enters the filter. Other calls fail with EPERM instead of ending the process, so that a library that makes an
 * unusual call handles the error and the import ends with a message. */
static bool enter_seccomp(const struct sandbox_options *options)
{
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    bool entered;

    if (!filter)
        return false;
    entered = allow_calls(filter, allowed_calls, sizeof(allowed_calls) / sizeof(allowed_calls[0])) &&
              allow_arguments(filter) && allow_memory(filter) && allow_threads(filter);
    if (entered && options->write_folder_count > 0)
        entered = allow_calls(filter, write_calls, sizeof(write_calls) / sizeof(write_calls[0]));
    if (entered && options->allow_rename)
        entered = allow_calls(filter, rename_calls, sizeof(rename_calls) / sizeof(rename_calls[0]));
    entered = entered && seccomp_load(filter) == 0;
    seccomp_release(filter);
    return entered;
}

static bool may_be_unconfined(void)
{
    const char *said = getenv(UNCONFINED);

    return said && strcmp(said, "1") == 0;
}

bool sandbox_enter(const struct sandbox_options *options, char *reason, size_t reason_bytes)
{
    int landlock;

    if (reason_bytes > 0)
        reason[0] = '\0';
    if (!is_alone(reason, reason_bytes))
        return false;
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || !set_limits(options)) {
        snprintf(reason, reason_bytes, "cannot set resource limits: %s", strerror(errno));
        return false;
    }
    landlock = enter_landlock(options);
    if (landlock < 0 && !may_be_unconfined()) {
        snprintf(
            reason, reason_bytes,
            "this kernel has no Landlock, so nothing confines which files are read and written; set " UNCONFINED
            "=1 to accept that");
        return false;
    }
    if (landlock == 0) {
        snprintf(reason, reason_bytes, "Landlock refused the rules: %s", strerror(errno));
        return false;
    }
    if (!SANITIZED && !enter_seccomp(options)) {
        snprintf(reason, reason_bytes, "the system call filter could not be loaded");
        return false;
    }
    if (landlock < 0)
        snprintf(reason, reason_bytes,
                 "this kernel has no Landlock: reading is not confined to the model's folder");
    return true;
}
