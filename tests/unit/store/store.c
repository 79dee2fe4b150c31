/* SPDX-License-Identifier: MIT */
/* Records and blobs in a folder: what was written comes back, what was tampered with does not. */
#include "store/store.h"

#include "base/log.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define LIMIT_BYTES ((uint64_t)1 << 20)
#define PATH_BYTES 512

static char folder[PATH_BYTES], store_folder[PATH_BYTES + 8];
static struct store *store; /* open, with LIMIT_BYTES */

static void close_store(void)
{
    store_close(store);
    store = NULL;
}

/* Again, as the next process does. */
static void open_store(uint64_t limit_bytes)
{
    struct error error = {0};
    close_store();
    store = store_open(store_folder, limit_bytes, &error);
    if (!store)
        fail_msg("%s: %s", error.field, error.text);
}

static int make_folder(void **state)
{
    (void)state;
    log_set_level(LOG_ERROR); /* records that are removed on purpose */
    snprintf(folder, sizeof(folder), "/tmp/farlight-store-XXXXXX");
    assert_non_null(mkdtemp(folder));
    snprintf(store_folder, sizeof(store_folder), "%s/store", folder);
    open_store(LIMIT_BYTES);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    char command[PATH_BYTES + 16];
    close_store();
    snprintf(command, sizeof(command), "rm -r %s", folder);
    assert_int_equal(system(command), 0);
    return 0;
}
EACH_TEST(make_folder, remove_folder)

static struct blob *blob_of(uint8_t fill, size_t size_bytes)
{
    struct blob *blob = blob_create(size_bytes);
    assert_non_null(blob);
    memset(blob->data, fill, size_bytes);
    blob_hash(blob->hash, blob->data, size_bytes);
    return blob;
}

/* A record that consists of its name and names one blob, or none where `fill` is 0. */
static bool put(uint8_t name, uint64_t owner, uint8_t fill, size_t size_bytes, struct error *error)
{
    uint8_t content[] = {name, 1, 2, 3};
    struct blob *blobs[2];
    struct store_record record = {.owner = owner, .content = content, .content_bytes = sizeof(content)};
    memset(record.name, name, sizeof(record.name));
    if (fill) {
        blobs[0] = blobs[1] = blob_of(fill, size_bytes); /* twice: it counts once */
        record.blobs = blobs;
        record.blob_count = 2;
    }
    bool done = store_put(store, &record, NULL, error);
    if (fill)
        blob_unref(blobs[0]);
    return done;
}

static void expect_put(uint8_t name, uint64_t owner, uint8_t fill, size_t size_bytes)
{
    struct error error = {0};
    if (!put(name, owner, fill, size_bytes, &error))
        fail_msg("%s", error.text);
}

/* The names of the records, each as its first byte, in order. */
static void expect_names(const char *expected)
{
    size_t count;
    uint8_t(*names)[STORE_NAME_BYTES] = store_names(store, &count);
    assert_non_null(names);
    assert_int_equal(count, strlen(expected));
    for (size_t i = 0; i < count; i++)
        assert_int_equal(names[i][0], expected[i]);
    free(names);
}

static size_t count_files(const char *of)
{
    char path[PATH_BYTES + 32];
    snprintf(path, sizeof(path), "%s/%s", store_folder, of);
    DIR *entries = opendir(path);
    assert_non_null(entries);
    size_t count = 0;
    for (const struct dirent *entry; (entry = readdir(entries));)
        count += entry->d_name[0] != '.';
    closedir(entries);
    return count;
}

/* Path of the only file there, but for what a test has put beside it. */
static void path_of_first(const char *of, char path[PATH_BYTES * 2])
{
    char of_path[PATH_BYTES + 32];
    snprintf(of_path, sizeof(of_path), "%s/%s", store_folder, of);
    DIR *entries = opendir(of_path);
    assert_non_null(entries);
    const struct dirent *entry;
    while ((entry = readdir(entries)) && entry->d_name[0] == '.')
        continue;
    assert_non_null(entry);
    snprintf(path, PATH_BYTES * 2, "%s/%s", of_path, entry->d_name);
    closedir(entries);
}

/* From the end if negative. */
static void change_byte(const char *path, int at)
{
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    assert_int_equal(fseek(file, at, at < 0 ? SEEK_END : SEEK_SET), 0);
    int before = fgetc(file);
    assert_int_equal(fseek(file, -1, SEEK_CUR), 0);
    assert_true(fputc(before ^ 1, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static bool try_record(uint8_t name, struct store_record *record)
{
    uint8_t bytes[STORE_NAME_BYTES];
    struct error error = {0};
    memset(bytes, name, sizeof(bytes));
    return store_try(store, bytes, record, &error);
}

TEST(a_record_and_its_blobs_come_back_in_another_process)
{
    expect_put('a', 7, 1, 1000);
    open_store(LIMIT_BYTES);
    expect_names("a");
    struct store_record record;
    assert_true(try_record('a', &record));
    assert_int_equal(record.owner, 7);
    assert_int_equal(record.content_bytes, 4);
    assert_memory_equal(record.content, "a\1\2\3", 4);
    store_record_finish(&record);
    struct blob *expected = blob_of(1, 1000);
    struct error error = {0};
    struct blob *read = store_read_blob(store, expected->hash, 1000, &error);
    assert_non_null(read);
    assert_memory_equal(read->data, expected->data, 1000);
    blob_unref(read);
    assert_null(store_read_blob(store, expected->hash, 999, &error));
    blob_unref(expected);
}

TEST(blobs_go_with_the_last_record_that_names_them)
{
    const uint8_t a[STORE_NAME_BYTES] = "aaaaaaaaaaaaaaaa", b[STORE_NAME_BYTES] = "bbbbbbbbbbbbbbbb";
    expect_put('a', 1, 1, 1000);
    expect_put('b', 1, 1, 1000);
    assert_int_equal(count_files("blobs"), 1);
    store_remove(store, a);
    assert_int_equal(count_files("blobs"), 1);
    expect_put('b', 1, 2, 2000); /* replaced, and with it the blob */
    assert_int_equal(count_files("blobs"), 1);
    assert_int_equal(count_files("scenes"), 1);
    store_remove(store, b);
    assert_int_equal(count_files("blobs"), 0);
    assert_int_equal(count_files("scenes"), 0);
}

TEST(who_has_most_gives_way_with_what_was_written_first)
{
    open_store(100000);
    expect_put('a', 1, 1, 20000);
    expect_put('b', 2, 2, 20000);
    expect_put('c', 2, 3, 20000);
    expect_put('d', 2, 4, 20000);
    expect_put('e', 1, 5, 30000);
    expect_names("acde");
    /* A scene that is too large alone evicts no other; its predecessor is outdated. */
    struct error error = {0};
    assert_false(put('c', 2, 6, 100000, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    expect_names("ade");
    assert_int_equal(count_files("blobs"), 3);
    open_store(60000); /* less from now on */
    expect_names("de");
}

TEST(what_was_tampered_with_is_removed)
{
    static const int places[] = {3, 20, 60, -1, -30};
    for (size_t i = 0; i < sizeof(places) / sizeof(places[0]); i++) {
        char path[PATH_BYTES * 2];
        expect_put('a', 1, 1, 1000);
        close_store();
        path_of_first("scenes", path);
        change_byte(path, places[i]);
        open_store(LIMIT_BYTES);
        expect_names("");
        assert_int_equal(count_files("scenes"), 0);
        assert_int_equal(count_files("blobs"), 0);
    }
}

TEST(a_blob_that_was_tampered_with_is_not_read)
{
    char path[PATH_BYTES * 2];
    expect_put('a', 1, 1, 1000);
    path_of_first("blobs", path);
    change_byte(path, 0);
    struct blob *blob = blob_of(1, 1000);
    struct error error = {0};
    assert_null(store_read_blob(store, blob->hash, 1000, &error));
    assert_int_equal(error.kind, ERROR_HASH_MISMATCH);
    close_store();
    assert_int_equal(truncate(path, 500), 0); /* nor is its record found */
    open_store(LIMIT_BYTES);
    expect_names("");
    blob_unref(blob);
}

static void write_file(const char *name)
{
    char path[PATH_BYTES * 2];
    snprintf(path, sizeof(path), "%s/%s", store_folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("farlight scene 1 and what is none", file);
    fclose(file);
}

TEST(files_that_are_no_records_are_removed_and_links_not_followed)
{
    char path[PATH_BYTES * 2], link_path[PATH_BYTES * 2];
    expect_put('a', 1, 1, 1000);
    close_store();
    path_of_first("scenes", path); /* which would be valid under another name, too */
    snprintf(link_path, sizeof(link_path), "%s/scenes/ffffffffffffffffffffffffffffffff", store_folder);
    assert_int_equal(symlink(path, link_path), 0);
    write_file("scenes/0123456789abcdef0123456789abcdef");
    write_file("scenes/0123456789abcdef0123456789abcdef.new");
    write_file("scenes/-");
    write_file("blobs/x");
    open_store(LIMIT_BYTES);
    expect_names("a");
    assert_int_equal(count_files("scenes"), 1);
    assert_int_equal(count_files("blobs"), 1);
}

TEST(a_record_on_which_the_process_ended_is_left_out)
{
    const uint8_t b[STORE_NAME_BYTES] = "bbbbbbbbbbbbbbbb";
    struct store_record record;
    expect_put('a', 1, 1, 1000);
    expect_put('b', 1, 2, 1000);
    assert_true(try_record('b', &record));
    store_record_finish(&record);
    store_tried(store, b);
    assert_true(try_record('a', &record));
    store_record_finish(&record);
    open_store(LIMIT_BYTES);
    expect_names("b");
}

TEST(a_folder_belongs_to_one_daemon_and_one_user)
{
    struct error error = {0};
    assert_null(store_open(store_folder, LIMIT_BYTES, &error));
    assert_string_equal(error.text, "another daemon uses the folder");
    close_store();
    error = (struct error){0};
    assert_int_equal(chmod(store_folder, 0750), 0);
    assert_null(store_open(store_folder, LIMIT_BYTES, &error));
    assert_int_equal(error.kind, ERROR_DENIED);
    error = (struct error){0};
    assert_null(store_open("/nowhere/at/all", LIMIT_BYTES, &error));
    assert_int_equal(error.kind, ERROR_INVALID);
}

TEST(an_abandoned_record_leaves_nothing_and_its_predecessor_stays)
{
    expect_put('a', 1, 1, 1000);
    atomic_bool abandoned = true;
    struct blob *blob = blob_of(2, 1000);
    uint8_t content = 0;
    struct store_record record = {.content = &content, .content_bytes = 1, .blobs = &blob, .blob_count = 1};
    memset(record.name, 'a', sizeof(record.name));
    struct error error = {0};
    assert_false(store_put(store, &record, &abandoned, &error));
    assert_int_equal(error.kind, ERROR_CANCELLED);
    blob_unref(blob);
    expect_names("a");
    assert_int_equal(count_files("blobs"), 1);
    assert_int_equal(count_files("scenes"), 1);
}
