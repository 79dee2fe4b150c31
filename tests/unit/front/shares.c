/* SPDX-License-Identifier: MIT */
/* Weights of users, and control groups of workers, in a made folder. */
#include "front/shares.h"

#include "net/auth.h"
#include "tests/harness/test.h"

#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- weights ---- */

TEST(weights_are_those_of_users_keys_and_networks)
{
    struct shares shares;
    struct error error = {0};
    assert_true(shares_parse(&shares, " root=400  1000=50 keys=200\tnetworks=1", "weights", &error));
    assert_int_equal(shares_weight(&shares, 0), 400);
    assert_int_equal(shares_weight(&shares, 1000), 50);
    assert_int_equal(shares_weight(&shares, 1001), SHARES_DEFAULT_WEIGHT);
    assert_int_equal(shares_weight(&shares, AUTH_OWNER_KEY | 1000), 200);
    assert_int_equal(shares_weight(&shares, UINT64_C(1) << 62), 1);
    assert_true(shares_parse(&shares, "", "weights", &error));
    assert_int_equal(shares_weight(&shares, AUTH_OWNER_KEY), SHARES_DEFAULT_WEIGHT);
}

TEST(what_is_no_weight_is_refused)
{
    static const char *const wrong[] = {"root",    "root=",   "root=0", "root=10001",
                                        "root=-1", "root=1x", "=5",     "no-such-user-here=5"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        struct shares shares;
        struct error error = {0};
        if (shares_parse(&shares, wrong[i], "server.weights", &error))
            fail_msg("\"%s\" is accepted", wrong[i]);
        assert_string_equal(error.field, "server.weights");
    }
}

/* ---- groups: plain files in place of the kernel's ---- */

static char root[] = "/tmp/farlight-shares-XXXXXX";

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

static void path_of(char path[128], const char *name)
{
    snprintf(path, 128, "%s/%s", root, name);
}

static void write_file(const char *name, const char *text)
{
    char path[128];
    path_of(path, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static void expect_file(const char *name, const char *wanted)
{
    char path[128], text[64] = "";
    path_of(path, name);
    FILE *file = fopen(path, "r");
    if (!file)
        fail_msg("%s is missing", name);
    (void)!fgets(text, sizeof(text), file);
    fclose(file);
    assert_string_equal(text, wanted);
}

/* A group `daemon` with these processes and controllers. */
static void begin(struct share_groups *groups, const char *processes, const char *controllers)
{
    char path[128], self[128];
    path_of(path, "daemon");
    mkdir(path, 0700);
    write_file("daemon/cgroup.procs", processes);
    write_file("daemon/cgroup.controllers", controllers);
    write_file("daemon/cgroup.subtree_control", "");
    write_file("self", "3:cpu:/elsewhere\n0::/daemon\n");
    path_of(self, "self");
    share_groups_begin(groups, self, root);
}

TEST_WITH(a_worker_has_a_group_with_its_weight, make_root, remove_root)
{
    struct share_groups groups;
    char own[32], path[128];
    snprintf(own, sizeof(own), "%d\n", getpid());
    begin(&groups, own, "memory cpu pids\n");
    snprintf(own, sizeof(own), "%d", getpid());
    expect_file("daemon/front/cgroup.procs", own);
    expect_file("daemon/cgroup.subtree_control", "+cpu");
    share_groups_apply(&groups, 7, 1234, 400);
    expect_file("daemon/worker-7/cpu.weight", "400");
    expect_file("daemon/worker-7/cgroup.procs", "1234");
    /* The kernel's files go with their group. */
    path_of(path, "daemon/worker-7/cpu.weight");
    unlink(path);
    path_of(path, "daemon/worker-7/cgroup.procs");
    unlink(path);
    share_groups_end(&groups, 7);
    path_of(path, "daemon/worker-7");
    assert_int_not_equal(access(path, F_OK), 0);
}

TEST_WITH(a_group_that_is_not_the_daemons_alone_is_left_as_it_is, make_root, remove_root)
{
    struct share_groups groups;
    char processes[64], path[128];
    snprintf(processes, sizeof(processes), "1\n%d\n", getpid());
    begin(&groups, processes, "cpu\n");
    assert_string_equal(groups.folder, "");
    snprintf(processes, sizeof(processes), "%d\n", getpid());
    begin(&groups, processes, "cpuset memory\n"); /* another controller than cpu */
    assert_string_equal(groups.folder, "");
    path_of(path, "daemon/front");
    assert_int_not_equal(access(path, F_OK), 0);
}

TEST(without_groups_a_lower_weight_is_a_higher_niceness)
{
    const struct share_groups groups = {.folder = ""};
    const int before = getpriority(PRIO_PROCESS, 0);
    share_groups_apply(&groups, 1, getpid(), SHARES_DEFAULT_WEIGHT);
    assert_int_equal(getpriority(PRIO_PROCESS, 0), before);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        pause();
        _exit(0);
    }
    /* A fifth of the time: ln 5 / ln 1.25 = 7.2 levels. */
    share_groups_apply(&groups, 1, child, SHARES_DEFAULT_WEIGHT / 5);
    const int niceness = getpriority(PRIO_PROCESS, (id_t)child);
    kill(child, SIGKILL);
    waitpid(child, NULL, 0);
    assert_int_equal(niceness, 7);
}
