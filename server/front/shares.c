/* SPDX-License-Identifier: MIT */
/* Weights of workers, as control groups or as niceness. */
#include "front/shares.h"

#include "base/log.h"
#include "net/auth.h"
#include "net/readers.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- weights ----------------------------------------------------------------------------------------- */

static bool add(struct shares *shares, char *text, const char *field, struct error *error)
{
    char *equals = strrchr(text, '='), *end = NULL;
    const unsigned long weight = equals ? strtoul(equals + 1, &end, 10) : 0;
    if (!equals || *end || weight < 1 || weight > SHARES_WEIGHT_MAX)
        return error_set(error, ERROR_INVALID, field, "\"%s\" is no NAME=WEIGHT with a weight of 1 to %u", text,
                         SHARES_WEIGHT_MAX);
    *equals = '\0';
    if (strcmp(text, "keys") == 0) {
        shares->of_keys = (uint32_t)weight;
        return true;
    }
    if (strcmp(text, "networks") == 0) {
        shares->of_networks = (uint32_t)weight;
        return true;
    }
    if (shares->count == SHARES_MAX)
        return error_set(error, ERROR_INVALID, field, "more than %d users", SHARES_MAX);
    if (!readers_parse_user(text, &shares->users[shares->count].user))
        return error_set(error, ERROR_INVALID, field, "there is no user \"%s\"", text);
    shares->users[shares->count++].weight = (uint32_t)weight;
    return true;
}

bool shares_parse(struct shares *shares, const char *text, const char *field, struct error *error)
{
    *shares = (struct shares){.of_keys = SHARES_DEFAULT_WEIGHT, .of_networks = SHARES_DEFAULT_WEIGHT};
    char *copy = strdup(text), *rest = copy;
    bool ok = copy || error_set(error, ERROR_OUT_OF_MEMORY, field, "no memory");
    for (char *one; ok && (one = strsep(&rest, " \t"));)
        ok = !one[0] || add(shares, one, field, error);
    free(copy);
    return ok;
}

uint32_t shares_weight(const struct shares *shares, uint64_t owner)
{
    if (owner & AUTH_OWNER_KEY)
        return shares->of_keys;
    if (owner > UINT32_MAX)
        return shares->of_networks;
    for (size_t i = 0; i < shares->count; i++) {
        if (shares->users[i].user == owner)
            return shares->users[i].weight;
    }
    return SHARES_DEFAULT_WEIGHT;
}

/* ---- control groups ---------------------------------------------------------------------------------- */

static bool write_word(const char *folder, const char *file, const char *word)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof(path), "%s/%s", folder, file) >= (int)sizeof(path))
        return false;
    FILE *stream = fopen(path, "we");
    if (!stream)
        return false;
    const bool written = fputs(word, stream) >= 0;
    return fclose(stream) == 0 && written;
}

static bool write_number(const char *folder, const char *file, int64_t number)
{
    char text[24];
    snprintf(text, sizeof(text), "%" PRId64, number);
    return write_word(folder, file, text);
}

static bool read_line(const char *folder, const char *file, char *line, size_t line_bytes)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof(path), "%s/%s", folder, file) >= (int)sizeof(path))
        return false;
    FILE *stream = fopen(path, "re");
    const bool is_read = stream && fgets(line, (int)line_bytes, stream);
    if (stream)
        fclose(stream);
    if (is_read)
        line[strcspn(line, "\n")] = '\0';
    return is_read;
}

/* The folder of this process's group of version 2. */
static bool find_group(char *folder, size_t folder_bytes, const char *groups_file, const char *root)
{
    char line[PATH_MAX];
    bool found = false;
    FILE *file = fopen(groups_file, "re");
    while (file && !found && fgets(line, sizeof(line), file)) {
        line[strcspn(line, "\n")] = '\0';
        found = strncmp(line, "0::/", 4) == 0 &&
                (size_t)snprintf(folder, folder_bytes, "%s%s", root, line + 3) < folder_bytes;
    }
    if (file)
        fclose(file);
    return found;
}

/* A group with processes has no groups below it that share its time, so the daemon must be the only one there. */
static bool is_alone(const char *folder)
{
    char path[PATH_MAX], line[32];
    unsigned count = 0;
    bool is_there = false;
    if (snprintf(path, sizeof(path), "%s/cgroup.procs", folder) >= (int)sizeof(path))
        return false;
    FILE *file = fopen(path, "re");
    for (; file && fgets(line, sizeof(line), file); count++)
        is_there = is_there || atoi(line) == getpid();
    if (file)
        fclose(file);
    return is_there && count == 1;
}

static bool has_cpu(const char *folder)
{
    char line[1024], *rest = line;
    bool has = false;
    if (!read_line(folder, "cgroup.controllers", line, sizeof(line)))
        return false;
    for (const char *word; (word = strsep(&rest, " "));)
        has = has || strcmp(word, "cpu") == 0;
    return has;
}

static bool make_group(char path[PATH_MAX], const struct share_groups *groups, const char *name)
{
    return snprintf(path, PATH_MAX, "%s/%s", groups->folder, name) < PATH_MAX &&
           (mkdir(path, 0755) == 0 || errno == EEXIST);
}

void share_groups_begin(struct share_groups *groups, const char *groups_file, const char *root)
{
    char own[PATH_MAX];
    char *folder = groups->folder;
    const bool is_ours = find_group(folder, sizeof(groups->folder), groups_file, root) && has_cpu(folder) &&
                         is_alone(folder) && access(folder, W_OK) == 0;
    if (!is_ours) {
        folder[0] = '\0';
        return;
    }
    if (make_group(own, groups, "front") && write_number(own, "cgroup.procs", getpid()) &&
        write_word(folder, "cgroup.subtree_control", "+cpu"))
        return;
    log_write(LOG_WARNING, "front", "workers have no control groups: %s: %s", folder, strerror(errno));
    folder[0] = '\0';
}

static void worker_group(char name[32], uint32_t worker)
{
    snprintf(name, 32, "worker-%" PRIu32, worker);
}

/* A level of niceness is a factor of 1.25 in processor time, and each thread has its own (sched(7)). The kernel
 * may share between sessions first (autogroups), which have a niceness, too. */
static void set_niceness(pid_t pid, uint32_t weight)
{
    char process[32], tasks[40];
    const int level = (int)lround(log((double)SHARES_DEFAULT_WEIGHT / weight) / log(1.25));
    const int niceness = level < -20 ? -20 : level > 19 ? 19 : level;
    if (niceness == 0)
        return;
    snprintf(process, sizeof(process), "/proc/%d", (int)pid);
    snprintf(tasks, sizeof(tasks), "%s/task", process);
    bool is_set = true;
    DIR *folder = opendir(tasks);
    for (const struct dirent *task; folder && (task = readdir(folder));) {
        const int thread = atoi(task->d_name);
        is_set = thread <= 0 || (setpriority(PRIO_PROCESS, (id_t)thread, niceness) == 0 && is_set);
    }
    if (folder)
        closedir(folder);
    if (!is_set)
        log_write(LOG_WARNING, "front", "process %d does not get niceness %d: %s", (int)pid, niceness,
                  strerror(errno));
    (void)write_number(process, "autogroup", niceness);
}

void share_groups_apply(const struct share_groups *groups, uint32_t worker, pid_t pid, uint32_t weight)
{
    char name[32], group[PATH_MAX];
    worker_group(name, worker);
    if (groups->folder[0] && make_group(group, groups, name) && write_number(group, "cpu.weight", weight) &&
        write_number(group, "cgroup.procs", pid))
        return;
    set_niceness(pid, weight);
}

void share_groups_end(const struct share_groups *groups, uint32_t worker)
{
    char name[32], group[PATH_MAX];
    worker_group(name, worker);
    if (groups->folder[0] && snprintf(group, sizeof(group), "%s/%s", groups->folder, name) < (int)sizeof(group))
        (void)rmdir(group);
}
