/* SPDX-License-Identifier: MIT */
/* Programs on the disk: only complete, own and requested ones come back, and no more than the limit stays. */
#include "gpu/binary_cache.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define BYTES 1000u

static char folder[4096], home[] = "/tmp/farlight-binaries-XXXXXX";
static struct gpu_binary_cache *cache;

static int make_home(void **state)
{
    (void)state;
    assert_non_null(mkdtemp(home));
    snprintf(folder, sizeof(folder), "%s/farlight", home);
    return setenv("XDG_CACHE_HOME", home, 1);
}

static void empty_folder(void)
{
    DIR *list = opendir(folder);
    for (struct dirent *entry; list && (entry = readdir(list));)
        if (entry->d_name[0] != '.')
            (void)unlinkat(dirfd(list), entry->d_name, 0);
    if (list)
        closedir(list);
    (void)rmdir(folder);
}

static int remove_home(void **state)
{
    (void)state;
    empty_folder();
    return rmdir(home);
}

static int open_empty(void **state)
{
    (void)state;
    empty_folder();
    cache = gpu_binary_cache_open(0);
    assert_non_null(cache);
    return 0;
}

static int close_cache(void **state)
{
    (void)state;
    gpu_binary_cache_close(cache);
    return 0;
}

ALL_TESTS(make_home, remove_home)
EACH_TEST(open_empty, close_cache)

static const struct gpu_binary_key key = {1, 2};

static void write_binary(struct gpu_binary_cache *to, uint64_t number, unsigned char byte)
{
    unsigned char bytes[BYTES];
    memset(bytes, byte, sizeof(bytes));
    gpu_binary_write(to, &(struct gpu_binary_key){number, 2}, &(struct gpu_binary){7, BYTES, bytes});
}

static void path_of(char path[4200], uint64_t number)
{
    snprintf(path, 4200, "%s/%016x%016llx.program", folder, 2, (unsigned long long)number);
}

/* Its first byte; -1: there is none. */
static int read_binary(uint64_t number)
{
    struct gpu_binary binary;
    if (!gpu_binary_read(cache, &(struct gpu_binary_key){number, 2}, &binary))
        return -1;
    assert_int_equal(binary.format, 7);
    assert_int_equal(binary.size_bytes, BYTES);
    int byte = *(unsigned char *)binary.data;
    gpu_binary_finish(&binary);
    return byte;
}

static unsigned count_files(void)
{
    unsigned count = 0;
    DIR *list = opendir(folder);
    for (struct dirent *entry; list && (entry = readdir(list));)
        count += entry->d_name[0] != '.';
    closedir(list);
    return count;
}

/* The file is ignored, and replaced by the next one that is written. */
static void assert_is_as_good_as_none(void)
{
    assert_int_equal(read_binary(1), -1);
    write_binary(cache, 1, 9);
    assert_int_equal(read_binary(1), 9);
}

TEST(a_binary_comes_back_under_its_own_key_alone)
{
    assert_false(gpu_binary_is_there(cache, &key));
    write_binary(cache, 1, 5);
    assert_true(gpu_binary_is_there(cache, &key));
    assert_int_equal(read_binary(1), 5);
    assert_int_equal(read_binary(3), -1);
    assert_int_equal(count_files(), 1);
}

TEST(nobody_else_may_read_or_enter)
{
    char path[4200];
    struct stat found;
    write_binary(cache, 1, 5);
    path_of(path, 1);
    assert_int_equal(stat(path, &found), 0);
    assert_int_equal(found.st_mode & 0777, 0600);
    assert_int_equal(stat(folder, &found), 0);
    assert_int_equal(found.st_mode & 0777, 0700);
}

TEST(a_folder_that_others_may_write_to_is_not_used)
{
    assert_int_equal(chmod(folder, 0770), 0);
    assert_null(gpu_binary_cache_open(0));
    assert_int_equal(chmod(folder, 0755), 0);
    struct gpu_binary_cache *other = gpu_binary_cache_open(0);
    struct stat found;
    assert_non_null(other);
    assert_int_equal(stat(folder, &found), 0);
    assert_int_equal(found.st_mode & 0777, 0700);
    gpu_binary_cache_close(other);
}

TEST(a_file_that_was_cut_short_is_as_good_as_none)
{
    char path[4200];
    path_of(path, 1);
    for (off_t length = 0; length < (off_t)BYTES + 40; length += 37) {
        write_binary(cache, 1, 5);
        assert_int_equal(truncate(path, length), 0);
        assert_is_as_good_as_none();
    }
}

TEST(a_file_of_which_a_byte_has_changed_is_as_good_as_none)
{
    char path[4200];
    struct stat found;
    path_of(path, 1);
    write_binary(cache, 1, 5);
    assert_int_equal(stat(path, &found), 0);
    for (off_t at = 0; at < found.st_size; at += at < 48 ? 1 : 50) {
        if (at >= 8 && at < 12)
            continue; /* the format, which the driver judges */
        write_binary(cache, 1, 5);
        int file = open(path, O_WRONLY | O_CLOEXEC);
        assert_int_equal(pwrite(file, "\xee", 1, at), 1);
        close(file);
        assert_is_as_good_as_none();
    }
}

TEST(a_file_under_the_name_of_another_is_as_good_as_none)
{
    char path[4200], other[4200];
    path_of(path, 1);
    path_of(other, 3);
    write_binary(cache, 3, 5);
    assert_int_equal(rename(other, path), 0);
    assert_is_as_good_as_none();
}

TEST(a_link_is_as_good_as_none_and_what_it_names_stays)
{
    char path[4200], other[4200];
    path_of(path, 1);
    path_of(other, 3);
    write_binary(cache, 1, 5);
    assert_int_equal(rename(path, other), 0);
    assert_int_equal(symlink(other, path), 0);
    assert_is_as_good_as_none();
    struct stat found;
    assert_int_equal(lstat(path, &found), 0);
    assert_true(S_ISREG(found.st_mode));
    assert_int_equal(stat(other, &found), 0);
}

TEST(a_pipe_is_as_good_as_none_and_nobody_waits)
{
    char path[4200];
    path_of(path, 1);
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_is_as_good_as_none();
}

TEST(a_file_of_another_owner_is_as_good_as_none)
{
    char path[4200];
    path_of(path, 1);
    write_binary(cache, 1, 5);
    if (chown(path, 65534, 65534) != 0)
        skip(); /* only root can give a file away */
    assert_is_as_good_as_none();
}

TEST(what_was_used_longest_ago_goes_first_beyond_the_limit)
{
    char path[4200];
    struct gpu_binary_cache *small = gpu_binary_cache_open(10 * (BYTES + 48));
    for (uint64_t number = 1; number <= 10; number++) {
        write_binary(cache, number, (unsigned char)number);
        path_of(path, number);
        const struct timespec long_ago[2] = {{1000000 + (time_t)number, 0}, {1000000 + (time_t)number, 0}};
        assert_int_equal(utimensat(AT_FDCWD, path, long_ago, 0), 0);
    }
    assert_int_equal(read_binary(1), 1); /* and is the last one from now on */
    write_binary(small, 11, 11);
    gpu_binary_cache_close(small);
    assert_int_equal(read_binary(2), -1);
    assert_int_equal(read_binary(1), 1);
    for (uint64_t number = 3; number <= 11; number++)
        assert_int_equal(read_binary(number), (int)number);
}

TEST(what_a_process_left_unfinished_is_removed_once_it_is_old)
{
    char old[4200], young[4200];
    const struct timespec long_ago[2] = {{1000000, 0}, {1000000, 0}};
    snprintf(old, sizeof(old), "%s/1-2-3.fresh", folder);
    snprintf(young, sizeof(young), "%s/1-2-4.fresh", folder);
    close(open(old, O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
    close(open(young, O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
    assert_int_equal(utimensat(AT_FDCWD, old, long_ago, 0), 0);
    struct gpu_binary_cache *small = gpu_binary_cache_open(1 << 20);
    write_binary(small, 1, 5);
    gpu_binary_cache_close(small);
    assert_int_equal(access(old, F_OK), -1);
    assert_int_equal(access(young, F_OK), 0);
}

TEST(nowhere_to_keep_anything_is_no_error)
{
    struct gpu_binary binary;
    setenv("XDG_CACHE_HOME", "/dev/null", 1);
    assert_null(gpu_binary_cache_open(0));
    setenv("XDG_CACHE_HOME", home, 1);
    assert_false(gpu_binary_is_there(NULL, &key));
    assert_false(gpu_binary_read(NULL, &key, &binary));
    write_binary(NULL, 1, 5);
}
