/* SPDX-License-Identifier: MIT */
/* Child programs: starting, ending, and reading their last output. */
#include "lib/process.h"
#include "lib/stream.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/pidfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

#define TRY_AGAIN_STATUS 75     /* exit status of our programs for a failure that may pass */
#define FIRST_SIGNAL_STATUS 128 /* 128 + signal; ssh: 255 */
#define ARGUMENTS_MAX 560       /* enough for a picture of many parts */
#define CHILD_SOCKET 3

static bool is_program(const char *folder, size_t folder_bytes, const char *name, char *path, size_t path_bytes)
{
    const int length = snprintf(path, path_bytes, "%.*s/%s", (int)folder_bytes, folder, name);
    return length > 0 && (size_t)length < path_bytes && access(path, X_OK) == 0;
}

bool fl_find_program(const char *name, char *path, size_t path_bytes, struct fl_error *error)
{
    const char *chosen = getenv("FARLIGHT_LIBEXEC");
    if (chosen && is_program(chosen, strlen(chosen), name, path, path_bytes))
        return true;
    char self[4096];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);
    if (length > 0) {
        self[length] = '\0';
        const char *slash = strrchr(self, '/');
        if (slash && is_program(self, (size_t)(slash - self), name, path, path_bytes))
            return true;
    }
    const char *at = getenv("PATH");
    while (at && *at != '\0') {
        const size_t folder_bytes = strcspn(at, ":");
        if (folder_bytes > 0 && is_program(at, folder_bytes, name, path, path_bytes))
            return true;
        at += folder_bytes + (at[folder_bytes] == ':');
    }
    fl_error_set(error, FL_ERROR_FILE, name, "this program, a part of farlight, is not installed");
    return fl_error_remedy(
        error, "put it into this program's folder or into PATH, or name its folder in FARLIGHT_LIBEXEC");
}

/* Gives the child these descriptors and no other, as our own parent may have left some open. */
static bool wire(posix_spawn_file_actions_t *actions, enum fl_wiring wiring, const struct fl_process *process,
                 int socket_fd)
{
    const int talk_fd = process->talk_fd, input_fd = process->input_fd;
    if (wiring == FL_WIRING_STANDARD)
        return posix_spawn_file_actions_adddup2(actions, socket_fd, STDIN_FILENO) == 0 &&
               posix_spawn_file_actions_adddup2(actions, socket_fd, STDOUT_FILENO) == 0 &&
               posix_spawn_file_actions_addclosefrom_np(actions, CHILD_SOCKET) == 0;
    /* talk_fd and socket_fd were moved above 3, since descriptors of ours may be 0 to 3 themselves and would be
     * overwritten. input_fd was not moved, so it is duplicated first. */
    const int has_input = input_fd > 0
                              ? posix_spawn_file_actions_adddup2(actions, input_fd, STDIN_FILENO)
                              : posix_spawn_file_actions_addopen(actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    return has_input == 0 && posix_spawn_file_actions_adddup2(actions, talk_fd, STDOUT_FILENO) == 0 &&
           posix_spawn_file_actions_adddup2(actions, talk_fd, STDERR_FILENO) == 0 &&
           posix_spawn_file_actions_adddup2(actions, socket_fd, CHILD_SOCKET) == 0 &&
           posix_spawn_file_actions_addclosefrom_np(actions, CHILD_SOCKET + 1) == 0;
}

/* A child that needs no terminal starts in a process group of its own: Ctrl-C is for us, and we end the child
 * properly. Signals that we handle get their default in the child. Signals that were ignored when we were
 * started, as by nohup, stay ignored, except the one with which we end the child. */
static bool set_attributes(posix_spawnattr_t *attributes, enum fl_wiring wiring)
{
    sigset_t none, reset;
    sigemptyset(&none);
    sigemptyset(&reset);
    sigaddset(&reset, SIGPIPE);
    sigaddset(&reset, SIGTERM);
    int flags = POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF;
    if (wiring == FL_WIRING_DESCRIPTOR)
        flags |= POSIX_SPAWN_SETPGROUP;
    return posix_spawnattr_setsigmask(attributes, &none) == 0 &&
           posix_spawnattr_setsigdefault(attributes, &reset) == 0 &&
           posix_spawnattr_setflags(attributes, (short)flags) == 0;
}

/* Variables for a program that reads other people's files: the language of messages, the time zone, where
 * libraries lie, and settings of the C library and of sanitizers. A name that ends with * stands for all with
 * this prefix. */
static const char *const passed_names[] = {"PATH",
                                           "LANG",
                                           "LANGUAGE",
                                           "LC_*",
                                           "TZ",
                                           "TZDIR",
                                           "LD_*",
                                           "GLIBC_*",
                                           "GCOV_*",
                                           "LLVM_PROFILE_FILE",
                                           "ASAN_OPTIONS",
                                           "LSAN_OPTIONS",
                                           "UBSAN_OPTIONS",
                                           "FARLIGHT_UNCONFINED"};

static bool is_passed(const char *variable)
{
    for (size_t i = 0; i < sizeof(passed_names) / sizeof(passed_names[0]); i++) {
        const char *name = passed_names[i];
        const size_t bytes = strcspn(name, "*");
        if (strncmp(variable, name, bytes) == 0 && (name[bytes] == '*' || variable[bytes] == '='))
            return true;
    }
    return false;
}

/* Selects the environment of a child: a program that reads other people's files must not see tokens and
 * passwords. A program with large arrays also gets a setting that glibc reads at its start: each page of 4 KB
 * costs a fault, and faults were a fifth of an import's time. NULL: no memory. */
static char **make_environment(const struct fl_process *process)
{
    size_t count = 0;
    while (environ[count])
        count++;
    char **made = malloc((count + 2) * sizeof(*made));
    if (!made)
        return NULL;
    count = 0;
    for (char **variable = environ; *variable; variable++)
        if (process->keeps_environment || is_passed(*variable))
            made[count++] = *variable;
    if (process->has_large_arrays && !getenv("GLIBC_TUNABLES"))
        made[count++] = (char *)(uintptr_t) "GLIBC_TUNABLES=glibc.malloc.hugetlb=1";
    made[count] = NULL;
    return made;
}

static int spawn(struct fl_process *process, const char *path, char *const *argv, enum fl_wiring wiring,
                 int socket_fd)
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    char **environment = make_environment(process);
    int failure = environment ? posix_spawn_file_actions_init(&actions) : ENOMEM;
    if (failure != 0) {
        free(environment);
        return failure;
    }
    failure = posix_spawnattr_init(&attributes);
    if (failure == 0) {
        if (!wire(&actions, wiring, process, socket_fd) || !set_attributes(&attributes, wiring))
            failure = ENOMEM;
        else
            failure = posix_spawn(&process->pid, path, &actions, &attributes, argv, environment);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&actions);
    free(environment);
    return failure;
}

/* Moves a descriptor above those that become the child's. */
static int lift(int fd)
{
    if (fd < 0 || fd > CHILD_SOCKET)
        return fd;
    const int lifted = fcntl(fd, F_DUPFD_CLOEXEC, CHILD_SOCKET + 1);
    close(fd);
    return lifted;
}

static size_t fill_arguments(char *argv[ARGUMENTS_MAX], const char *path, enum fl_wiring wiring,
                             const char *const *arguments)
{
    size_t count = 0;
    argv[count++] =
        (char *)(uintptr_t)path; /* exec takes char *const * for historical reasons and writes nothing */
    if (wiring == FL_WIRING_DESCRIPTOR) {
        argv[count++] = (char *)(uintptr_t) "--fd";
        argv[count++] = (char *)(uintptr_t) "3";
    }
    for (; *arguments && count + 1 < ARGUMENTS_MAX; arguments++)
        argv[count++] = (char *)(uintptr_t)*arguments;
    argv[count] = NULL;
    return count;
}

bool fl_process_start(struct fl_process *process, const char *name, enum fl_wiring wiring,
                      const char *const *arguments, int *socket_fd, struct fl_error *error)
{
    *process = (struct fl_process){.talk_fd = -1,
                                   .input_fd = process->input_fd,
                                   .has_large_arrays = process->has_large_arrays,
                                   .keeps_environment = process->keeps_environment};
    snprintf(process->name, sizeof(process->name), "%s", name);
    char path[4096];
    if (!fl_find_program(name, path, sizeof(path), error))
        return false;
    char *argv[ARGUMENTS_MAX];
    fill_arguments(argv, path, wiring, arguments);
    int pair[2] = {-1, -1};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) < 0)
        return fl_error_set(error, FL_ERROR_SYSTEM, name, "cannot be started: %s", strerror(errno));
    int failure = 0;
    pair[1] = lift(pair[1]);
    if (pair[1] < 0)
        failure = errno;
    if (failure == 0 && wiring == FL_WIRING_DESCRIPTOR) {
        process->talk_fd = lift(memfd_create("farlight-talk", MFD_CLOEXEC));
        if (process->talk_fd < 0)
            failure = errno;
    }
    if (failure == 0)
        failure = spawn(process, path, argv, wiring, pair[1]);
    if (pair[1] >= 0)
        close(pair[1]);
    if (failure != 0) {
        close(pair[0]);
        if (process->talk_fd >= 0)
            close(process->talk_fd);
        *process = (struct fl_process){.talk_fd = -1};
        return fl_error_set(error, FL_ERROR_SYSTEM, path, "cannot be started: %s", strerror(failure));
    }
    *socket_fd = pair[0];
    return true;
}

bool fl_process_has_ended(const struct fl_process *process, unsigned timeout_ms)
{
    const uint64_t deadline_ns = monotonic_now_ns() + timeout_ms * 1000000ull;
    const int fd = pidfd_open(process->pid, 0);
    bool ended = false;
    for (;;) {
        siginfo_t info = {0};
        ended = waitid(P_PID, (id_t)process->pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0;
        const uint64_t now_ns = monotonic_now_ns();
        if (ended || now_ns >= deadline_ns)
            break;
        /* Without a pidfd (an old kernel) the loop polls every 5 ms. */
        struct pollfd polled = {.fd = fd, .events = POLLIN};
        const int left_ms = (int)((deadline_ns - now_ns) / 1000000) + 1;
        poll(&polled, 1, fd >= 0 || left_ms < 5 ? left_ms : 5);
    }
    if (fd >= 0)
        close(fd);
    return ended;
}

void fl_process_kill(struct fl_process *process)
{
    if (process->pid > 0)
        kill(process->pid, SIGKILL);
}

int fl_process_end(struct fl_process *process, unsigned grace_ms)
{
    int status = 0;
    if (process->pid > 0) {
        if (!fl_process_has_ended(process, grace_ms))
            kill(process->pid, SIGTERM);
        if (!fl_process_has_ended(process, 2000))
            kill(process->pid, SIGKILL);
        while (waitpid(process->pid, &status, 0) < 0 && errno == EINTR)
            continue;
    }
    if (process->talk_fd >= 0)
        close(process->talk_fd);
    process->pid = 0;
    process->talk_fd = -1;
    return status;
}

/* Start of the line that ends before `end`. */
static size_t line_start(const char *text, size_t end)
{
    while (end > 0 && text[end - 1] != '\n')
        end--;
    return end;
}

/* Length of the prefix "NAME: ", with which our programs begin their errors; 0: the line has another. */
static size_t name_bytes(const char *name, const char *line, size_t bytes)
{
    const size_t count = strlen(name);
    return bytes > count + 2 && memcmp(line, name, count) == 0 && line[count] == ':' ? count + 2 : 0;
}

/* Copies the last non-empty line of the child's log. Lines with the program's name in front are an error and
 * its remedy: they are copied together, without the name. */
static void last_lines(const struct fl_process *process, char *words, size_t words_bytes)
{
    char tail[2049];
    const int fd = process->talk_fd;
    words[0] = '\0';
    const off_t size = fd >= 0 ? lseek(fd, 0, SEEK_END) : 0;
    if (size <= 0)
        return;
    const off_t most = sizeof(tail) - 1, from = size > most ? size - most : 0;
    const ssize_t got = pread(fd, tail, sizeof(tail) - 1, from);
    size_t end = got > 0 ? (size_t)got : 0;
    tail[end] = '\0';
    while (end > 0 && (tail[end - 1] == '\n' || tail[end - 1] == ' '))
        end--;
    size_t start = line_start(tail, end);
    if (end - start >= 5 && memcmp(tail + start, "READY", 5) == 0) /* output of a daemon that starts */
        return;
    for (size_t before = start; before > 0 && name_bytes(process->name, tail + start, end - start) > 0;) {
        before = line_start(tail, before - 1);
        if (name_bytes(process->name, tail + before, start - before) == 0)
            break;
        start = before;
    }
    size_t used = 0;
    while (start < end && used < words_bytes) {
        size_t bytes = strcspn(tail + start, "\n");
        bytes = bytes < end - start ? bytes : end - start;
        const size_t skipped = name_bytes(process->name, tail + start, bytes);
        const int written = snprintf(words + used, words_bytes - used, "%s%.*s", used > 0 ? "; " : "",
                                     (int)(bytes - skipped), tail + start + skipped);
        used += written > 0 ? (size_t)written : words_bytes;
        start += bytes + 1;
    }
}

bool fl_process_has_refused(const struct fl_process *process)
{
    siginfo_t info = {0};
    return process->pid > 0 && waitid(P_PID, (id_t)process->pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid != 0 && info.si_code == CLD_EXITED && info.si_status > 0 &&
           info.si_status < FIRST_SIGNAL_STATUS && info.si_status != TRY_AGAIN_STATUS;
}

void fl_process_last_words(struct fl_process *process, unsigned grace_ms, char *text, size_t text_bytes)
{
    char line[400], how[80] = "";
    last_lines(process, line, sizeof(line));
    if (process->pid > 0 && fl_process_has_ended(process, grace_ms)) {
        siginfo_t info = {0};
        waitid(P_PID, (id_t)process->pid, &info, WEXITED | WNOHANG | WNOWAIT);
        last_lines(process, line, sizeof(line));
        if (info.si_code == CLD_EXITED)
            snprintf(how, sizeof(how), "%s ended with status %d", process->name, info.si_status);
        else
            snprintf(how, sizeof(how), "%s was ended by signal %d", process->name, info.si_status);
    }
    snprintf(text, text_bytes, "%s%s%s", how, how[0] != '\0' && line[0] != '\0' ? ": " : "", line);
}

bool fl_process_find_line(const struct fl_process *process, const char *start, size_t index, char *text,
                          size_t text_bytes)
{
    char talk[8192];
    const ssize_t got = process->talk_fd >= 0 ? pread(process->talk_fd, talk, sizeof(talk) - 1, 0) : 0;
    char *rest = talk;
    talk[got > 0 ? got : 0] = '\0';
    for (char *line; (line = strsep(&rest, "\n"));) {
        if (strncmp(line, start, strlen(start)) != 0 || !rest || index-- > 0)
            continue;
        snprintf(text, text_bytes, "%s", line + strlen(start));
        return true;
    }
    return false;
}
