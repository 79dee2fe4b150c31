/* SPDX-License-Identifier: MIT */
/* Abilities of a process that serves when a client runs code in it. Each attempt is made by a process of its
 * own, confined to two folders. */
#include "base/confinement.h"

#include "tests/harness/test.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define NOT_ENTERED 99
#define NO_LANDLOCK 98

static char folder[] = "/tmp/farlight-confinement-XXXXXX";
static char readable[64], writable[64], outside[64];

static void make_file(const char *path)
{
    const int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    assert_true(fd >= 0);
    close(fd);
}

static int begin(void **state)
{
    (void)state;
    char path[96];
    strcpy(folder + sizeof(folder) - 7, "XXXXXX");
    assert_non_null(mkdtemp(folder));
    snprintf(readable, sizeof(readable), "%s/readable", folder);
    snprintf(writable, sizeof(writable), "%s/writable", folder);
    snprintf(outside, sizeof(outside), "%s/outside", folder);
    assert_int_equal(mkdir(readable, 0700), 0);
    assert_int_equal(mkdir(writable, 0700), 0);
    snprintf(path, sizeof(path), "%s/file", readable);
    make_file(path);
    make_file(outside);
    return 0;
}

static int end(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof(command), "rm -r %s", folder);
    return system(command);
}

EACH_TEST(begin, end)

/* ---- attempts: 0, or the error ---- */

static int try_open(const char *place, const char *name, int flags)
{
    char path[96];
    snprintf(path, sizeof(path), "%s%s", place, name);
    return open(path, flags | O_CLOEXEC, 0600) < 0 ? errno : 0;
}

static int read_inside(void)
{
    return try_open(readable, "/file", O_RDONLY);
}

static int write_what_is_to_be_read(void)
{
    return try_open(readable, "/file", O_WRONLY);
}

static int write_inside(void)
{
    char from[96], to[96];
    snprintf(from, sizeof(from), "%s/a", writable);
    snprintf(to, sizeof(to), "%s/b", writable);
    const int failure = try_open(writable, "/a", O_WRONLY | O_CREAT);
    return failure ? failure : rename(from, to) != 0 || unlink(to) != 0 ? errno : 0;
}

static int read_outside(void)
{
    return try_open(outside, "", O_RDONLY);
}

static void *read_in_thread(void *failure)
{
    *(int *)failure = read_outside();
    return NULL;
}

static int read_outside_in_thread(void)
{
    pthread_t thread;
    int got = 0, failure = pthread_create(&thread, NULL, read_in_thread, &got);
    if (failure == 0)
        failure = pthread_join(thread, NULL);
    return failure ? failure : got;
}

static int make_outside(void)
{
    return try_open(folder, "/new", O_WRONLY | O_CREAT);
}

static int open_internet_socket(void)
{
    return socket(AF_INET, SOCK_STREAM, 0) < 0 ? errno : 0;
}

static int open_packet_socket(void)
{
    return socket(AF_PACKET, SOCK_DGRAM, 0) < 0 ? errno : 0;
}

static int open_unix_socket(void)
{
    return socket(AF_UNIX, SOCK_STREAM, 0) < 0 ? errno : 0;
}

static int connected[2]; /* sockets from before the confinement */

static int connect_anew(void)
{
    const struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(9)};
    return connect(connected[0], (const struct sockaddr *)&address, sizeof(address)) != 0 ? errno : 0;
}

static int speak_to_a_client(void)
{
    return send(connected[0], "a", 1, 0) != 1 ? errno : 0;
}

static int run_a_program(void)
{
    char *const arguments[] = {"true", NULL};
    execv("/bin/true", arguments);
    return errno;
}

static int signal_parent(void)
{
    return kill(getppid(), 0) != 0 ? errno : 0;
}

static int trace_parent(void)
{
    return ptrace(PTRACE_SEIZE, getppid(), NULL, NULL) != 0 ? errno : 0;
}

static int compile_code(void)
{
    void *page = mmap(NULL, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return page == MAP_FAILED ? errno : 0;
}

/* The leak sanitizer needs ptrace(), so that Landlock alone keeps other processes from it. */
#if defined(__SANITIZE_ADDRESS__)
#define LANDLOCK_DENIES_TRACES true
#else
#define LANDLOCK_DENIES_TRACES false
#endif

static const struct {
    const char *name;
    int (*attempt)(void);
    int expected;
    bool needs_landlock;
} attempts[] = {
    {"read in a folder for reading", read_inside, 0, false},
    {"write in a folder for reading", write_what_is_to_be_read, EACCES, true},
    {"make, rename and remove in a folder for writing", write_inside, 0, false},
    {"read elsewhere", read_outside, EACCES, true},
    {"read elsewhere in a thread", read_outside_in_thread, EACCES, true},
    {"make a file elsewhere", make_outside, EACCES, true},
    {"open an internet socket", open_internet_socket, EPERM, false},
    {"open a packet socket", open_packet_socket, EPERM, false},
    {"open a Unix socket", open_unix_socket, 0, false},
    {"connect a socket of before", connect_anew, EPERM, false},
    {"speak over a socket of before", speak_to_a_client, 0, false},
    {"run a program", run_a_program, EPERM, false},
    {"signal the parent", signal_parent, EPERM, false},
    {"trace the parent", trace_parent, EPERM, LANDLOCK_DENIES_TRACES},
    {"compile code", compile_code, 0, false},
};

/* The exit status of a process that is confined and makes the attempt. */
static int result_of(int (*attempt)(void), bool needs_landlock)
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        struct error error = {0};
        bool has_files;
        struct confinement *confinement = confinement_create();
        confinement_allow(confinement, CONFINED_READ, readable);
        confinement_allow(confinement, CONFINED_READ, "/nothing/is/here");
        confinement_allow(confinement, CONFINED_WRITE, writable);
        if (!confinement_enter(confinement, &has_files, &error))
            _exit(NOT_ENTERED);
        _exit(needs_landlock && !has_files ? NO_LANDLOCK : attempt());
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

TEST(a_confined_process_has_its_folders_and_its_clients_and_nothing_else)
{
    bool has_landlock = true;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, connected), 0);
    for (size_t i = 0; i < sizeof(attempts) / sizeof(attempts[0]); i++) {
        const int result = result_of(attempts[i].attempt, attempts[i].needs_landlock);
        if (result == NO_LANDLOCK)
            has_landlock = false;
        else if (result != attempts[i].expected)
            fail_msg("%s: %d in place of %d", attempts[i].name, result, attempts[i].expected);
    }
    close(connected[0]);
    close(connected[1]);
    if (!has_landlock)
        print_message("this kernel has no Landlock: which files are opened was not tested\n");
}

static void *wait_for_ever(void *unused)
{
    pause();
    return unused;
}

TEST(a_process_with_a_second_thread_is_not_confined_in_vain)
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        pthread_t thread;
        struct error error = {0};
        bool has_files;
        struct confinement *confinement = confinement_create();
        const bool is_refused = pthread_create(&thread, NULL, wait_for_ever, NULL) == 0 &&
                                !confinement_enter(confinement, &has_files, &error) &&
                                strstr(error.text, "threads");
        _exit(!is_refused);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}
