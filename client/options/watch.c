/* SPDX-License-Identifier: MIT */
/* Watching of files. */
#include "watch.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <unistd.h>

#define CHECK_NS 1000000000ull /* interval of checks without a report */
#define SETTLE_NS                                                                                                 \
    150000000ull /* exporters write a file in one go, and the files of a model shortly after each other */
#define WAIT_MS 50u
#define FOLDER_EVENTS                                                                                             \
    (IN_CLOSE_WRITE | IN_MODIFY | IN_MOVED_TO | IN_MOVED_FROM | IN_CREATE | IN_DELETE | IN_ATTRIB | IN_ONLYDIR)

static bool cli_watch_begin(struct cli_watch *watch, struct fl_error *error)
{
    watch->fd = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    return watch->fd >= 0 || fl_error_set(error, FL_ERROR_SYSTEM, "--watch", "inotify_init1: %s", strerror(errno));
}

static struct stat state_of(const char *path)
{
    struct stat now = {0};
    if (stat(path, &now) < 0)
        return (struct stat){0};
    return now;
}

static bool is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_size == b->st_size &&
           a->st_mtim.tv_sec == b->st_mtim.tv_sec && a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

bool cli_watch_add(struct cli_watch *watch, const char *path, struct fl_error *error)
{
    char folder[PATH_MAX];
    for (size_t i = 0; i < watch->count; i++)
        if (strcmp(watch->files[i].path, path) == 0)
            return true;
    if (watch->count == watch->capacity) {
        const size_t more = watch->capacity * 2 + 16;
        struct cli_watched *grown = realloc(watch->files, more * sizeof(*grown));
        if (!grown)
            return fl_error_set(error, FL_ERROR_MEMORY, "--watch", "out of memory");
        watch->files = grown;
        watch->capacity = more;
    }
    struct cli_watched *file = &watch->files[watch->count];
    *file = (struct cli_watched){.path = strdup(path), .seen = state_of(path)};
    if (!file->path)
        return fl_error_set(error, FL_ERROR_MEMORY, "--watch", "out of memory");
    watch->count++;
    /* A folder that cannot be watched is checked at intervals. */
    const char *slash = strrchr(path, '/');
    const size_t length = !slash ? 1 : slash == path ? 1 : (size_t)(slash - path);
    if (length < sizeof(folder)) {
        snprintf(folder, sizeof(folder), "%.*s", (int)length, slash ? path : ".");
        inotify_add_watch(watch->fd, folder, FOLDER_EVENTS);
    }
    return true;
}

bool cli_watch_begin_models(struct cli_watch *watch, const struct fl_model *models, size_t count,
                            const char *environment, struct fl_error *error)
{
    bool is_good = cli_watch_begin(watch, error) && (!environment || cli_watch_add(watch, environment, error));
    for (size_t i = 0; is_good && i < count; i++)
        is_good = cli_watch_add(watch, models[i].path, error);
    return is_good;
}

bool cli_watch_scene(struct cli_watch *watch, const struct fl_scene *scene, struct fl_error *error)
{
    const char *path = NULL;
    for (size_t i = 0; (path = fl_scene_file(scene, i)); i++)
        if (!cli_watch_add(watch, path, error))
            return false;
    return true;
}

static bool take_reports(const struct cli_watch *watch)
{
    char reports[4096];
    bool any = false;
    while (read(watch->fd, reports, sizeof(reports)) > 0)
        any = true;
    return any;
}

/* Checks all files; true if one has changed, whose new state is then recorded. */
static bool check_all(struct cli_watch *watch)
{
    bool any = false;
    for (size_t i = 0; i < watch->count; i++) {
        const struct stat now = state_of(watch->files[i].path);
        any = any || !is_same(&now, &watch->files[i].seen);
        watch->files[i].seen = now;
    }
    return any;
}

bool cli_watch_has_changed(struct cli_watch *watch, uint64_t now_ns)
{
    if (take_reports(watch) || now_ns >= watch->check_ns) {
        if (check_all(watch))
            watch->changed_ns = now_ns;
        watch->check_ns = now_ns + (watch->changed_ns > 0 ? SETTLE_NS : CHECK_NS);
    }
    if (watch->changed_ns == 0 || now_ns - watch->changed_ns < SETTLE_NS)
        return false;
    const bool has_settled = !check_all(watch);
    watch->changed_ns = has_settled ? 0 : now_ns;
    return has_settled;
}

bool cli_watch_wait(struct cli_watch *watch, struct fl_connection *connection, struct fl_error *error)
{
    while (!cli_watch_has_changed(watch, monotonic_now_ns()))
        if (!fl_connection_wait(connection, WAIT_MS, error))
            return false;
    return true;
}

void cli_watch_end(struct cli_watch *watch)
{
    for (size_t i = 0; i < watch->count; i++)
        free(watch->files[i].path);
    free(watch->files);
    if (watch->fd > 0)
        close(watch->fd);
    *watch = (struct cli_watch){0};
}

bool cli_watch_can_edit_again(const struct fl_assignment *edits, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (edits[i].way != FL_ASSIGN)
            return false;
    return true;
}
