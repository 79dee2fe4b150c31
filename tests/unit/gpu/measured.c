/* SPDX-License-Identifier: MIT */
/* Measurements of a device are there again at the next start, and are not used for another driver. */
#include <stddef.h>
#include <stdint.h>

#include "gpu/device.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/farlight-measured-XXXXXX";

/* The only file in the cache; empty: there is none. */
static void find_file(char path[4096])
{
    char cache[2048];
    path[0] = '\0';
    snprintf(cache, sizeof(cache), "%s/farlight", folder);
    DIR *list = opendir(cache);
    for (struct dirent *entry; list && (entry = readdir(list));)
        if (entry->d_name[0] != '.')
            snprintf(path, 4096, "%s/%s", cache, entry->d_name);
    if (list)
        closedir(list);
}

static int make_folder(void **state)
{
    (void)state;
    assert_non_null(mkdtemp(folder));
    return setenv("XDG_CACHE_HOME", folder, 1);
}

static int remove_folder(void **state)
{
    char path[4096];
    (void)state;
    find_file(path);
    (void)unlink(path);
    snprintf(path, sizeof(path), "%s/farlight", folder);
    (void)rmdir(path);
    return rmdir(folder);
}

ALL_TESTS(make_folder, remove_folder)

static const struct gpu_device_info gpu = {.name = "A GPU", .vendor = "its maker", .version = "4.5 of today"};
static const struct gpu_measured found = {.known = true, .traced_from = {1.5f, 0.25f}, .nodes_of_eight = true};

TEST(what_was_measured_is_there_at_the_next_start)
{
    struct gpu_measured back;
    assert_false(gpu_measured_load(&gpu, &back));
    assert_false(back.known);
    assert_true(gpu_measured_store(&gpu, &found));
    assert_true(gpu_measured_load(&gpu, &back));
    assert_true(back.known);
    assert_true(back.traced_from[0] == found.traced_from[0] && back.traced_from[1] == found.traced_from[1]);
    assert_true(back.nodes_of_eight);
}

TEST(another_driver_version_is_another_device)
{
    struct gpu_measured back;
    struct gpu_device_info newer = gpu;
    assert_true(gpu_measured_store(&gpu, &found));
    strcpy(newer.version, "4.5 of tomorrow");
    assert_false(gpu_measured_load(&newer, &back));
    assert_false(back.known);
}

TEST(software_gl_has_a_rule_whatever_was_measured)
{
    struct gpu_measured back;
    struct gpu_device_info software = gpu;
    assert_true(gpu_measured_store(&gpu, &found));
    software.software = true;
    assert_true(gpu_measured_load(&software, &back));
    assert_false(gpu_measured_traces(&back, false, 99999, 1000)); /* so few take no time either way */
    assert_false(gpu_measured_traces(&back, false, 100000, 200000));
    assert_true(gpu_measured_traces(&back, false, 100000, 100000));
    assert_false(back.nodes_of_eight);
}

TEST(a_file_that_is_cut_or_makes_no_sense_is_as_good_as_none)
{
    static const char *const contents[] = {
        "", "first hits are traced from ",
        "first hits are traced from 1 primitives a pixel on, from 1 with several samples\n",
        "first hits are traced from nan primitives a pixel on, from 1 with several samples\n",
        "first hits are traced from -1 primitives a pixel on, from 1 with several samples\n"};
    for (size_t i = 0; i < sizeof(contents) / sizeof(contents[0]); i++) {
        char path[4096];
        struct gpu_measured back;
        assert_true(gpu_measured_store(&gpu, &found));
        find_file(path);
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        fputs(contents[i], file);
        fclose(file);
        assert_false(gpu_measured_load(&gpu, &back));
        assert_false(back.known);
    }
}

TEST(a_cache_that_cannot_be_written_is_told)
{
    assert_int_equal(setenv("XDG_CACHE_HOME", "/proc/none", 1), 0);
    assert_false(gpu_measured_store(&gpu, &found));
    assert_int_equal(setenv("XDG_CACHE_HOME", folder, 1), 0);
}

TEST(first_hits_are_traced_from_that_many_primitives_a_pixel_on)
{
    const struct gpu_measured unknown = {0};
    assert_false(gpu_measured_traces(&found, false, 149, 100));
    assert_true(gpu_measured_traces(&found, false, 150, 100));
    assert_false(gpu_measured_traces(&found, true, 24, 100));
    assert_true(gpu_measured_traces(&found, true, 25, 100));
    assert_false(gpu_measured_traces(&unknown, true, 1000000, 1));
}
