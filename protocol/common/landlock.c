/* SPDX-License-Identifier: MIT */
/* System calls of Landlock, which the C library does not wrap. */
#include "landlock.h"

#include <dirent.h>
#include <stddef.h>
#include <sys/syscall.h>
#include <unistd.h>

#define ACCESS_NET 3ULL /* LANDLOCK_ACCESS_NET_BIND_TCP and _CONNECT_TCP, ABI 4 */
#define SCOPES 3ULL     /* LANDLOCK_SCOPE_ABSTRACT_UNIX_SOCKET and _SIGNAL, ABI 6 */

/* struct landlock_ruleset_attr in ABI 6; an older kernel reads its first members. */
struct ruleset_attributes {
    uint64_t handled_access_fs, handled_access_net, scoped;
};

unsigned landlock_thread_count(void)
{
    DIR *tasks = opendir("/proc/self/task");
    unsigned count = 0;
    if (!tasks)
        return 0;
    for (const struct dirent *task; (task = readdir(tasks));)
        count += task->d_name[0] != '.';
    closedir(tasks);
    return count;
}

static uint64_t file_rights_of(long abi)
{
    uint64_t rights = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1; /* ABI 1: execute .. make_sym */
    if (abi >= 2)
        rights |= LANDLOCK_ACCESS_FS_REFER;
    if (abi >= 3)
        rights |= LANDLOCK_ACCESS_FS_TRUNCATE;
    if (abi >= 5)
        rights |= LANDLOCK_ACCESS_FS_IOCTL_DEV;
    return rights;
}

int landlock_create(uint64_t *file_rights)
{
    const long abi = syscall(SYS_landlock_create_ruleset, NULL, 0, LANDLOCK_CREATE_RULESET_VERSION);
    *file_rights = abi >= 1 ? file_rights_of(abi) : 0;
    if (abi < 1)
        return -1;
    const struct ruleset_attributes attributes = {
        .handled_access_fs = *file_rights,
        .handled_access_net = abi >= 4 ? ACCESS_NET : 0,
        .scoped = abi >= 6 ? SCOPES : 0,
    };
    const size_t bytes = abi >= 6   ? sizeof(attributes)
                         : abi >= 4 ? offsetof(struct ruleset_attributes, scoped)
                                    : sizeof(attributes.handled_access_fs);
    return (int)syscall(SYS_landlock_create_ruleset, &attributes, bytes, 0);
}

bool landlock_allow(int ruleset, int fd, uint64_t rights)
{
    const struct landlock_path_beneath_attr rule = {.allowed_access = rights, .parent_fd = fd};
    return syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
}

bool landlock_enforce(int ruleset)
{
    return syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
}
