/* SPDX-License-Identifier: MIT */
/* Sandbox of a process that serves clients: Landlock and seccomp. */
#include "base/confinement.h"

#include "protocol/common/landlock.h"
#include "protocol/sanitized.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#define PATHS_MAX 128

struct confinement {
    struct {
        int fd;
        bool is_folder;
        enum confined_access access;
    } paths[PATHS_MAX];
    size_t count;
    bool is_incomplete; /* there was no room for a path */
};

struct confinement *confinement_create(void)
{
    return calloc(1, sizeof(struct confinement));
}

void confinement_allow(struct confinement *confinement, enum confined_access access, const char *path)
{
    struct stat status;
    const int fd = open(path, O_PATH | O_CLOEXEC);
    if (fd < 0)
        return;
    if (confinement->count == PATHS_MAX || fstat(fd, &status) != 0) {
        confinement->is_incomplete = true;
        close(fd);
        return;
    }
    confinement->paths[confinement->count].fd = fd;
    confinement->paths[confinement->count].is_folder = S_ISDIR(status.st_mode);
    confinement->paths[confinement->count++].access = access;
}

void confinement_destroy(struct confinement *confinement)
{
    if (!confinement)
        return;
    for (size_t i = 0; i < confinement->count; i++)
        close(confinement->paths[i].fd);
    free(confinement);
}

/* ---- Landlock ---------------------------------------------------------------------------------------- */

static bool is_alone(struct error *error)
{
    const unsigned threads = landlock_thread_count();
    if (threads == 0)
        return error_set(error, ERROR_INTERNAL, "sandbox", "/proc/self/task: %s", strerror(errno));
    return threads == 1 ||
           error_set(error, ERROR_INTERNAL, "sandbox", "the process has %u threads already", threads);
}

static uint64_t rights_of(enum confined_access access, bool is_folder)
{
    const uint64_t reading = LANDLOCK_ACCESS_FS_READ_FILE;
    const uint64_t writing = reading | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_TRUNCATE;
    const uint64_t of_folders = is_folder ? LANDLOCK_ACCESS_FS_READ_DIR : 0;
    const uint64_t changing = LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_MAKE_DIR |
                              LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                              LANDLOCK_ACCESS_FS_REFER;
    switch (access) {
    case CONFINED_READ:
        return reading | of_folders;
    case CONFINED_DEVICE:
        return writing | of_folders | LANDLOCK_ACCESS_FS_IOCTL_DEV;
    case CONFINED_WRITE:
        break;
    }
    return writing | of_folders | (is_folder ? changing : 0);
}

static bool add_rules(const struct confinement *confinement, int ruleset, uint64_t handled)
{
    bool ok = true;
    for (size_t i = 0; ok && i < confinement->count; i++)
        ok = landlock_allow(ruleset, confinement->paths[i].fd,
                            rights_of(confinement->paths[i].access, confinement->paths[i].is_folder) & handled);
    return ok;
}

static bool enter_landlock(const struct confinement *confinement, bool *has_files, struct error *error)
{
    uint64_t handled;
    const int ruleset = landlock_create(&handled);
    *has_files = handled != 0;
    const bool ok = !*has_files ||
                    (ruleset >= 0 && add_rules(confinement, ruleset, handled) && landlock_enforce(ruleset)) ||
                    error_set(error, ERROR_INTERNAL, "sandbox", "Landlock refused the rules: %s", strerror(errno));
    if (ruleset >= 0)
        close(ruleset);
    return ok;
}

/* ---- seccomp ----------------------------------------------------------------------------------------- */

/* The filter denies these calls and allows all others: drivers do not document the calls that they make. */
static const char *const denied[] = {
    /* Network, including sockets that clients are connected to. */
    "connect", "bind", "listen", "accept", "accept4", "io_uring_setup",
    /* Other programs and processes. */
    "execve", "execveat", "process_vm_readv", "process_vm_writev", "process_madvise", "pidfd_getfd",
    "pidfd_send_signal", "kcmp", "tkill", "rt_sigqueueinfo",
    /* System. */
    "bpf", "perf_event_open", "userfaultfd", "keyctl", "add_key", "request_key", "mount", "umount2", "pivot_root",
    "chroot", "setns", "unshare", "open_by_handle_at", "init_module", "finit_module", "delete_module",
    "kexec_load", "kexec_file_load", "reboot", "swapon", "swapoff", "acct", "quotactl", "settimeofday",
    "clock_settime", "adjtimex", "clock_adjtime", "sethostname", "setdomainname", "iopl", "ioperm", "mknod",
    "mknodat", "move_mount", "open_tree", "fsopen", "fsmount"};

static bool deny(scmp_filter_ctx filter, const char *name, unsigned count, const struct scmp_arg_cmp *argument)
{
    const int number = seccomp_syscall_resolve_name(name);
    /* Some architectures and versions of libseccomp lack a name. */
    return number == __NR_SCMP_ERROR || number < 0 ||
           seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EPERM), number, count, argument) == 0;
}

/* Denies sockets, except Unix ones, which drivers make for their services though they cannot connect, and netlink,
 * by which the kernel reports devices. */
static bool deny_sockets(scmp_filter_ctx filter)
{
    for (uint64_t family = AF_UNIX + 1; family <= AF_NETLINK; family++) {
        const struct scmp_arg_cmp is_family = {.arg = 0, .op = SCMP_CMP_EQ, .datum_a = family};
        if (family != AF_NETLINK && !deny(filter, "socket", 1, &is_family))
            return false;
    }
    const struct scmp_arg_cmp is_beyond = {.arg = 0, .op = SCMP_CMP_GT, .datum_a = AF_NETLINK};
    return deny(filter, "socket", 1, &is_beyond);
}

/* Denies signals to other processes; abort() signals its own thread by tgkill(). */
static bool deny_signals(scmp_filter_ctx filter)
{
    static const char *const calls[] = {"kill", "tgkill", "rt_tgsigqueueinfo"};
    const struct scmp_arg_cmp is_other = {.arg = 0, .op = SCMP_CMP_NE, .datum_a = (uint64_t)getpid()};
    bool ok = true;
    for (size_t i = 0; i < sizeof(calls) / sizeof(calls[0]); i++)
        ok = ok && deny(filter, calls[i], 1, &is_other);
    return ok;
}

static bool enter_seccomp(struct error *error)
{
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    bool ok =
        filter && deny_sockets(filter) && deny_signals(filter) && (SANITIZED || deny(filter, "ptrace", 0, NULL));
    for (size_t i = 0; ok && i < sizeof(denied) / sizeof(denied[0]); i++)
        ok = deny(filter, denied[i], 0, NULL);
    ok = ok && seccomp_load(filter) == 0;
    seccomp_release(filter);
    return ok || error_set(error, ERROR_INTERNAL, "sandbox", "the filter of system calls was refused");
}

bool confinement_enter(const struct confinement *confinement, bool *has_files, struct error *error)
{
    if (confinement->is_incomplete)
        return error_set(error, ERROR_LIMIT, "sandbox", "more than %d paths", PATHS_MAX);
    if (!is_alone(error))
        return false;
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0)
        return error_set(error, ERROR_INTERNAL, "sandbox", "no_new_privs: %s", strerror(errno));
    return enter_landlock(confinement, has_files, error) && enter_seccomp(error);
}
