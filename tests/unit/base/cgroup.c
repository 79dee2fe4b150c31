/* SPDX-License-Identifier: MIT */
/* Memory limits of control groups, from files of both versions. */
#include "base/cgroup.h"
#include "base/host.h"
#include "tests/harness/test.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define NONE UINT64_MAX

static char root[] = "/tmp/farlight-cgroup-XXXXXX";

static int make_root(void **state)
{
    (void)state;
    strcpy(root + sizeof(root) - 7, "XXXXXX");
    return mkdtemp(root) ? 0 : -1;
}

static int remove_one(const char *path, const struct stat *status, int flag, struct FTW *walk)
{
    (void)status;
    (void)flag;
    (void)walk;
    return remove(path);
}

static int remove_root(void **state)
{
    (void)state;
    return nftw(root, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

EACH_TEST(make_root, remove_root)

/* Makes the folders on the way to the file, too. */
static void write_file(const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof(path), "%s/%s", root, name);
    for (char *slash = path + strlen(root); (slash = strchr(slash + 1, '/'));) {
        *slash = '\0';
        mkdir(path, 0700);
        *slash = '/';
    }
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static uint64_t limit_of(const char *groups)
{
    char path[256];
    write_file("self", groups);
    snprintf(path, sizeof(path), "%s/self", root);
    return cgroup_memory_limit_bytes(path, root);
}

TEST(the_lowest_limit_up_the_tree_counts)
{
    write_file("a/b/c/memory.max", "max\n");
    write_file("a/b/memory.max", "8000000\n");
    write_file("a/memory.max", "9000000\n");
    assert_int_equal(limit_of("0::/a/b/c\n"), 8000000);
    write_file("a/memory.max", "7000000\n");
    assert_int_equal(limit_of("0::/a/b/c\n"), 7000000);
    assert_int_equal(limit_of("0::/a/bb\n"), 7000000);
    assert_int_equal(limit_of("0::/other\n"), NONE);
}

TEST(a_limit_that_slows_counts_as_one_that_ends)
{
    write_file("a/memory.max", "8000000\n");
    write_file("a/memory.high", "6000000\n");
    assert_int_equal(limit_of("0::/a\n"), 6000000);
    write_file("a/memory.high", "max\n");
    assert_int_equal(limit_of("0::/a\n"), 8000000);
}

TEST(a_container_sees_its_own_group_where_the_mount_begins)
{
    write_file("memory.max", "5000000\n");
    assert_int_equal(limit_of("0::/\n"), 5000000);
    assert_int_equal(limit_of("0::/docker/0123\n"), 5000000);
}

TEST(version_1_is_read_where_its_controller_is)
{
    write_file("memory/a/memory.limit_in_bytes", "4000000\n");
    write_file("memory/memory.limit_in_bytes", "9223372036854771712\n");
    write_file("a/memory.max", "1\n");
    assert_int_equal(limit_of("9:cpu,cpuacct:/a\n4:memory:/a\n"), 4000000);
    assert_int_equal(limit_of("4:hugetlb,memory:/a\n"), 4000000);
    assert_int_equal(limit_of("4:memory,hugetlb:/none\n"), UINT64_C(9223372036854771712));
    assert_int_equal(limit_of("9:cpu:/a\n5:memories:/a\n1:name=systemd:/a\n"), NONE);
}

TEST(what_is_no_limit_is_passed_over)
{
    static const char *const contents[] = {
        "", "\n", "max", "-1\n", "abc\n", "12 34\n", "99999999999999999999999\n"};
    for (size_t i = 0; i < sizeof(contents) / sizeof(contents[0]); i++) {
        write_file("a/memory.max", contents[i]);
        assert_int_equal(limit_of("0::/a\n"), NONE);
    }
    write_file("a/memory.max", "77");
    assert_int_equal(limit_of("0::/a"), 77);
    assert_int_equal(limit_of(""), NONE);
    assert_int_equal(limit_of("garbage\n0:\n::\n"), NONE);
    assert_int_equal(cgroup_memory_limit_bytes("/nonexistent", root), NONE);
}

TEST(the_memory_of_this_process_is_what_its_host_and_its_groups_leave)
{
    const uint64_t group_bytes = cgroup_memory_limit_bytes("/proc/self/cgroup", "/sys/fs/cgroup");
    const uint64_t host_bytes = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGESIZE);
    assert_int_equal(host_memory_bytes(), group_bytes < host_bytes ? group_bytes : host_bytes);
}
