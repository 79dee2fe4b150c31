/* SPDX-License-Identifier: MIT */
/* Abilities of a helper program that an attacker runs. Each attempt is made by a process of its own, in the
 * sandbox. */
#include "helper/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <seccomp.h>
#include <semaphore.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/harness/test.h"

#define PAGE_BYTES 4096
#define NOT_ENTERED 99

#if defined(__SANITIZE_ADDRESS__)
#define FILTERED 0 /* sanitizers need calls that the filter forbids */
#else
#define FILTERED 1
#endif

/* ---- attempts: 0, or the error ---- */

static int map(int protection)
{
    void *page = mmap(NULL, PAGE_BYTES, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return page == MAP_FAILED ? errno : 0;
}

static int map_writable(void)
{
    return map(PROT_READ | PROT_WRITE);
}

static int map_executable(void)
{
    return map(PROT_READ | PROT_EXEC);
}

static int map_both(void)
{
    return map(PROT_READ | PROT_WRITE | PROT_EXEC);
}

static int protect(int protection)
{
    void *page = mmap(NULL, PAGE_BYTES, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return page == MAP_FAILED || mprotect(page, PAGE_BYTES, protection) != 0 ? errno : 0;
}

static int make_read_only(void)
{
    return protect(PROT_READ);
}

static int make_executable(void)
{
    return protect(PROT_READ | PROT_EXEC);
}

static int make_both(void)
{
    return protect(PROT_READ | PROT_WRITE | PROT_EXEC);
}

static int make_executable_with_key(void)
{
    void *page = mmap(NULL, PAGE_BYTES, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return syscall(SYS_pkey_mprotect, page, PAGE_BYTES, PROT_READ | PROT_EXEC, -1) != 0 ? errno : 0;
}

static int signal_itself(void)
{
    return syscall(SYS_tgkill, getpid(), syscall(SYS_gettid), 0) != 0 ? errno : 0;
}

static int signal_parent(void)
{
    return syscall(SYS_tgkill, getppid(), getppid(), 0) != 0 ? errno : 0;
}

static int queue_signal_for_itself(void)
{
    siginfo_t info = {.si_code = SI_QUEUE};
    return syscall(SYS_rt_tgsigqueueinfo, getpid(), syscall(SYS_gettid), SIGUSR1, &info) != 0 ? errno : 0;
}

static void handle(int number)
{
    (void)number;
}

static int set_handler(void)
{
    const struct sigaction action = {.sa_handler = handle};
    return sigaction(SIGUSR1, &action, NULL) != 0 ? errno : 0;
}

static int ask_for_handler(void)
{
    struct sigaction action;
    return sigaction(SIGUSR1, NULL, &action) != 0 ? errno : 0;
}

static int open_file(void)
{
    return open("/etc/passwd", O_RDONLY | O_CLOEXEC) < 0 ? errno : 0;
}

static void *open_in_thread(void *failure)
{
    *(int *)failure = open_file();
    return NULL;
}

/* The file's error, after the thread was started and has ended. */
static int open_file_in_thread(void)
{
    pthread_t thread;
    int opened = 0;
    int failure = pthread_create(&thread, NULL, open_in_thread, &opened);
    if (failure == 0)
        failure = pthread_join(thread, NULL);
    return failure != 0 ? failure : opened;
}

static int start_process(void)
{
    const long made = syscall(SYS_clone, SIGCHLD, NULL, NULL, NULL, 0L);
    if (made == 0)
        _exit(0);
    return made < 0 ? errno : 0;
}

static int start_process_with_clone3(void)
{
    uint64_t arguments[8] = {0};
    const long made = syscall(SYS_clone3, arguments, sizeof(arguments));
    if (made == 0)
        _exit(0);
    return made < 0 ? errno : 0;
}

static const struct {
    const char *name;
    int (*attempt)(void);
    int expected;
} attempts[] = {
    {"map writable memory", map_writable, 0},
    {"map executable memory", map_executable, 0},
    {"map memory that is both", map_both, EPERM},
    {"make memory read-only", make_read_only, 0},
    {"make memory executable", make_executable, EPERM},
    {"make memory both", make_both, EPERM},
    {"make memory executable with a key", make_executable_with_key, EPERM},
    {"signal itself", signal_itself, 0},
    {"signal the parent", signal_parent, EPERM},
    {"queue a signal for itself", queue_signal_for_itself, EPERM},
    {"set a signal's handler", set_handler, EPERM},
    {"ask for a signal's handler", ask_for_handler, 0},
    {"open a file", open_file, EACCES},
    {"open a file in a thread", open_file_in_thread, EACCES},
    {"start a process", start_process, EPERM},
    {"start a process with clone3", start_process_with_clone3, ENOSYS},
};

/* The exit status of a process that enters the sandbox and makes the attempt. */
static int result_of(int (*attempt)(void))
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const struct sandbox_options options = {0};
        char reason[256];
        _exit(sandbox_enter(&options, reason, sizeof(reason)) ? attempt() : NOT_ENTERED);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

TEST(only_threads_and_memory_that_is_not_both_are_to_be_had)
{
    if (!FILTERED) {
        print_message("skipped: sanitizers do not run within the sandbox's filter\n");
        skip();
    }
    for (size_t i = 0; i < sizeof(attempts) / sizeof(attempts[0]); i++) {
        const int result = result_of(attempts[i].attempt);
        if (result != attempts[i].expected)
            fail_msg("%s: %d in place of %d", attempts[i].name, result, attempts[i].expected);
    }
}

/* The library's abort() raises the signal by tgkill, and sets its handler where that fails. */
TEST(a_failed_assertion_still_ends_the_process)
{
    int status = 0;
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const struct sandbox_options options = {0};
        char reason[256];
        if (!sandbox_enter(&options, reason, sizeof(reason)))
            _exit(NOT_ENTERED);
        abort();
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status));
    assert_int_equal(WTERMSIG(status), SIGABRT);
}

/* ---- threads of before ---- */

static sem_t never;

static void *wait_for_ever(void *context)
{
    sem_wait(&never);
    return context;
}

/* Landlock would not bind the first thread, which code in the second one reaches. */
TEST(a_process_with_a_second_thread_is_refused)
{
    int status = 0;
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const struct sandbox_options options = {0};
        char reason[256];
        pthread_t thread;
        sem_init(&never, 0, 0);
        if (pthread_create(&thread, NULL, wait_for_ever, NULL) != 0)
            _exit(NOT_ENTERED);
        if (sandbox_enter(&options, reason, sizeof(reason)))
            _exit(1);
        _exit(strstr(reason, "2 threads") && open_file() == 0 ? 0 : 2); /* no right is lost */
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

/* ---- kernels without Landlock ---- */

/* 0: entered without a word; 1: refused, and says what to do; 2: entered, and says what is missing; else:
 * something else */
static int enter_without_landlock(const char *accepted)
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const struct sandbox_options options = {0};
        char reason[256];
        scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
        if (!filter ||
            seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(landlock_create_ruleset), 0) != 0 ||
            seccomp_load(filter) != 0)
            _exit(NOT_ENTERED);
        unsetenv("FARLIGHT_UNCONFINED");
        if (accepted)
            setenv("FARLIGHT_UNCONFINED", accepted, 1);
        if (!sandbox_enter(&options, reason, sizeof(reason)))
            _exit(strstr(reason, "no Landlock") && strstr(reason, "FARLIGHT_UNCONFINED=1") ? 1 : 3);
        _exit(strstr(reason, "no Landlock") ? 2 : 0);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

TEST(without_landlock_nothing_runs_unless_that_is_accepted)
{
    assert_int_equal(enter_without_landlock(NULL), 1);
    assert_int_equal(enter_without_landlock("0"), 1);
    assert_int_equal(enter_without_landlock("1"), 2);
}
