/* SPDX-License-Identifier: MIT */
/* Key files, who has which key, and wrong keys by where they come from. */
#include <stddef.h>
#include <stdint.h>

#include "net/attempts.h"
#include "net/auth.h"
#include "protocol/sealed/key.h"
#include "protocol/sealed/secret.h"
#include "tests/harness/test.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- files --------------------------------------------------------------------------------------------- */

static char folder[64], path[96], other_path[96];

static int make_folder(void **state)
{
    (void)state;
    const char *base = getenv("TMPDIR");
    snprintf(folder, sizeof(folder), "%.40s/farlight-XXXXXX", base ? base : P_tmpdir);
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof(path), "%s/key", folder);
    snprintf(other_path, sizeof(other_path), "%s/other", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(path);
    unlink(other_path);
    rmdir(folder);
    return 0;
}

static void write_file(const char *name, size_t bytes, mode_t mode)
{
    char data[100];
    memset(data, 7, sizeof(data));
    unlink(name);
    int fd = open(name, O_WRONLY | O_CREAT | O_EXCL, 0600);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, data, bytes), bytes);
    assert_int_equal(fchmod(fd, mode), 0);
    close(fd);
}

TEST_WITH(a_key_is_made_for_its_owner_alone_and_never_over_another, make_folder, remove_folder)
{
    struct sealed_key key, again;
    struct decode_error error = {0};
    struct stat status;
    mode_t mask = umask(0);
    assert_true(sealed_key_create(path, &error));
    umask(mask);
    assert_int_equal(stat(path, &status), 0);
    assert_int_equal(status.st_mode & 07777, 0600);
    assert_int_equal(status.st_size, SEALED_KEY_BYTES);
    assert_true(sealed_key_read(&key, path, &error));
    assert_false(sealed_key_create(path, &error));
    assert_non_null(strstr(error.text, "left alone"));
    assert_true(sealed_key_read(&again, path, &error));
    assert_memory_equal(&key, &again, sizeof(key));
    /* Nor through a link that leads nowhere yet. */
    assert_int_equal(symlink("/nowhere/key", other_path), 0);
    assert_false(sealed_key_create(other_path, &error));
    unlink(other_path);
    assert_true(sealed_key_create(other_path, &error));
    assert_true(sealed_key_read(&again, other_path, &error));
    assert_memory_not_equal(&key, &again, sizeof(key));
}

TEST_WITH(what_is_no_key_file_is_refused_by_its_reason, make_folder, remove_folder)
{
    static const struct {
        size_t bytes;
        mode_t mode;
        enum protocol_error_code code;
        const char *what;
    } cases[] = {
        {32, 0640, PROTOCOL_ERROR_DENIED, "mode 0640"}, {32, 0604, PROTOCOL_ERROR_DENIED, "open to others"},
        {32, 0602, PROTOCOL_ERROR_DENIED, "chmod 600"}, {31, 0600, PROTOCOL_ERROR_INVALID, "31 bytes"},
        {33, 0600, PROTOCOL_ERROR_INVALID, "33 bytes"}, {0, 0600, PROTOCOL_ERROR_INVALID, "0 bytes"},
    };
    struct sealed_key key, none = {0};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct decode_error error = {0};
        write_file(path, cases[i].bytes, cases[i].mode);
        assert_false(sealed_key_read(&key, path, &error));
        assert_int_equal(error.code, cases[i].code);
        assert_string_equal(error.field, path);
        assert_non_null(strstr(error.text, cases[i].what));
        assert_memory_equal(&key, &none, sizeof(key));
    }
    struct decode_error error = {0};
    write_file(path, 32, 0400);
    assert_true(sealed_key_read(&key, path, &error));
    assert_false(sealed_key_read(&key, folder, &error));
    error = (struct decode_error){0};
    assert_false(sealed_key_read(&key, other_path, &error));
    assert_int_equal(error.code, PROTOCOL_ERROR_INVALID);
    /* Nobody writes to the pipe: that must not be waited for. */
    error = (struct decode_error){0};
    assert_int_equal(mkfifo(other_path, 0600), 0);
    assert_false(sealed_key_read(&key, other_path, &error));
    assert_non_null(strstr(error.text, "is not a regular file"));
}

TEST_WITH(a_key_file_of_another_user_is_refused, make_folder, remove_folder)
{
    struct sealed_key key;
    struct decode_error error = {0};
    write_file(path, 32, 0600);
    if (chown(path, geteuid() + 1, (gid_t)-1) != 0) {
        print_message("skipped: only root can give a file away\n");
        skip();
    }
    assert_false(sealed_key_read(&key, path, &error));
    assert_int_equal(error.code, PROTOCOL_ERROR_DENIED);
    assert_non_null(strstr(error.text, "another user"));
}

TEST_WITH(the_daemon_reads_its_keys_and_refuses_two_equal_ones, make_folder, remove_folder)
{
    struct auth_keys *keys;
    struct error error = {0};
    struct decode_error why = {0};
    assert_true(sealed_key_create(path, &why));
    assert_true(sealed_key_create(other_path, &why));
    assert_true(auth_read_keys(&keys, "", "", &error));
    assert_null(keys);
    assert_true(auth_read_keys(&keys, "", other_path, &error));
    assert_int_equal(keys->count, 1);
    assert_true(keys->read_only[0]);
    auth_keys_unref(keys);
    assert_true(auth_read_keys(&keys, path, other_path, &error));
    assert_int_equal(keys->count, 2);
    assert_false(keys->read_only[0]);
    assert_true(keys->read_only[1]);
    auth_keys_unref(keys);
    assert_false(auth_read_keys(&keys, path, path, &error));
    assert_non_null(strstr(error.text, "same key"));
    error = (struct error){0};
    assert_false(auth_read_keys(&keys, "/nowhere/key", "", &error));
    assert_string_equal(error.field, "/nowhere/key");
    assert_non_null(strstr(error.remedy, "farlight key"));
}

/* The flags of the mapping at an address, as the kernel shows them. */
static void mapping_flags(const void *at, char flags[512])
{
    FILE *file = fopen("/proc/self/smaps", "r");
    char line[512];
    bool is_here = false;
    unsigned long begin, end;
    assert_non_null(file);
    flags[0] = '\0';
    while (fgets(line, sizeof(line), file)) {
        if (sscanf(line, "%lx-%lx ", &begin, &end) == 2)
            is_here = (uintptr_t)at >= begin && (uintptr_t)at < end;
        else if (is_here && strncmp(line, "VmFlags:", 8) == 0)
            memcpy(flags, line, sizeof(line));
    }
    fclose(file);
}

TEST_WITH(keys_are_locked_and_left_out_of_dumps_by_the_daemon_and_its_links, make_folder, remove_folder)
{
    struct auth_keys *keys;
    struct error error = {0};
    struct decode_error why = {0};
    char flags[512];
    assert_true(sealed_key_create(path, &why));
    assert_int_equal(prctl(PR_SET_DUMPABLE, 1, 0, 0, 0), 0);
    assert_true(auth_read_keys(&keys, path, "", &error));
#ifndef __SANITIZE_ADDRESS__
    assert_int_equal(prctl(PR_GET_DUMPABLE, 0, 0, 0, 0), 0);
#endif
    struct sealed *sealed = sealed_client(&keys->keys[0]);
    assert_non_null(sealed);
    const void *const secrets[] = {keys, sealed};
    for (size_t i = 0; i < 2; i++) {
        mapping_flags(secrets[i], flags);
        assert_non_null(strstr(flags, " dd"));
#ifndef __SANITIZE_ADDRESS__ /* which locks nothing, and says that it has */
        if (secret_is_locked(keys, sizeof(*keys)))
            assert_non_null(strstr(flags, " lo"));
#endif
    }
    sealed_destroy(sealed);
    auth_keys_unref(auth_keys_ref(keys));
    assert_int_equal(keys->count, 1);
    auth_keys_unref(keys);
}

TEST(a_key_is_still_the_daemons_if_it_allows_the_same)
{
    const struct auth_keys before = {
        .keys = {{.bytes = "one"}, {.bytes = "two"}}, .read_only = {false, true}, .count = 2};
    const struct auth_keys after = {
        .keys = {{.bytes = "two"}, {.bytes = "new"}}, .read_only = {false, true}, .count = 2};
    const struct auth_key_numbers before_numbers = auth_keys_numbers(&before),
                                  after_numbers = auth_keys_numbers(&after), none = auth_keys_numbers(NULL);
    struct auth_identity identity = {.name = "tcp:10.0.0.7:40312"};
    for (size_t i = 0; i < 2; i++) {
        auth_identify_by_key(&identity, &before, i);
        assert_true(auth_numbers_have(&before_numbers, &identity));
        assert_false(auth_numbers_have(&after_numbers, &identity)); /* gone, or now with other rights */
        assert_false(auth_numbers_have(&none, &identity));
    }
}

/* ---- who comes from where ------------------------------------------------------------------------------ */

static struct address parsed(const char *text)
{
    struct address address;
    struct error error = {0};
    if (!address_parse(&address, text, &error))
        fail_msg("%s: %s", text, error.text);
    return address;
}

TEST(only_connections_within_loopback_to_a_daemon_without_keys_need_no_key)
{
    static const struct {
        const char *own, *peer;
        bool needed, needed_with_keys;
    } cases[] = {
        {"unix:/a", "unix:/b", false, false},
        {"tcp:127.0.0.1:1", "tcp:127.0.0.1:2", false, true},
        {"tcp:[::1]:1", "tcp:[::1]:2", false, true},
        {"tcp:0.0.0.0:1", "tcp:127.0.0.1:2", true, true}, /* other clients there need a key as well */
        {"tcp:10.0.0.1:1", "tcp:10.0.0.1:2", true, true},
        {"tcp:127.0.0.1:1", "tcp:10.0.0.7:2", true, true},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct address own = parsed(cases[i].own), peer = parsed(cases[i].peer);
        assert_int_equal(auth_needs_key(&own, &peer, NULL), cases[i].needed);
        assert_int_equal(auth_needs_key(&own, &peer, &(struct auth_keys){0}), cases[i].needed_with_keys);
    }
    struct auth_identity identity;
    struct error error = {0};
    struct address peer = parsed("tcp:10.0.0.7:2");
    assert_false(auth_identify(&identity, -1, &peer, false, &error));
    assert_int_equal(error.kind, ERROR_DENIED);
    assert_true(auth_identify(&identity, -1, &peer, true, &error));
    assert_false(identity.known);
}

TEST(a_key_names_its_holder)
{
    const struct auth_keys keys = {
        .keys = {{.bytes = "one"}, {.bytes = "two"}}, .read_only = {false, true}, .count = 2};
    uint64_t numbers[2];
    for (size_t i = 0; i < 2; i++) {
        struct auth_identity identity = {.name = "tcp:10.0.0.7:40312"};
        auth_identify_by_key(&identity, &keys, i);
        assert_true(identity.known && identity.has_key && !identity.has_user);
        assert_int_equal(identity.read_only, i == 1);
        assert_string_equal(identity.name,
                            i == 0 ? "key, tcp:10.0.0.7:40312" : "reader's key, tcp:10.0.0.7:40312");
        numbers[i] = identity.key;
    }
    assert_int_not_equal(numbers[0], numbers[1]);
}

TEST(networks_are_what_one_holder_has)
{
    static const struct {
        const char *a, *b;
        bool same;
    } cases[] = {
        {"tcp:10.0.0.7:1", "tcp:10.0.0.7:2", true},
        {"tcp:10.0.0.7:1", "tcp:10.0.0.8:1", false},
        {"tcp:10.0.0.7:1", "tcp:[::ffff:10.0.0.7]:1", true},
        {"tcp:[2001:db8:1:2::7]:1", "tcp:[2001:db8:1:2:3:4:5:6]:1", true},
        {"tcp:[2001:db8:1:2::7]:1", "tcp:[2001:db8:1:3::7]:1", false},
        {"tcp:10.0.0.7:1", "unix:/a", false},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct address a = parsed(cases[i].a), b = parsed(cases[i].b);
        if ((address_network(&a) == address_network(&b)) != cases[i].same)
            fail_msg("%s and %s", cases[i].a, cases[i].b);
    }
}

/* ---- handshakes ---------------------------------------------------------------------------------------- */

#define SECOND_NS UINT64_C(1000000000)

TEST(handshakes_beyond_the_rate_wait_for_their_turn)
{
    static struct attempts attempts;
    const uint64_t now_ns = 10 * SECOND_NS;
    memset(&attempts, 0, sizeof(attempts));
    for (int i = 0; i < 4; i++)
        assert_int_equal(attempts_wait_ns(&attempts, 77, 4, now_ns), 0);
    assert_int_equal(attempts_wait_ns(&attempts, 77, 4, now_ns), SECOND_NS / 4);
    assert_int_equal(attempts_wait_ns(&attempts, 78, 4, now_ns), 0);
    assert_int_equal(attempts_wait_ns(&attempts, 77, 4, now_ns + SECOND_NS / 4 - 1), 1);
    assert_int_equal(attempts_wait_ns(&attempts, 77, 4, now_ns + SECOND_NS / 4), 0);
    assert_int_equal(attempts_wait_ns(&attempts, 77, 4, now_ns + SECOND_NS / 4), SECOND_NS / 4);
    /* Those that did not begin have not been counted. */
    for (int i = 0; i < 4; i++)
        assert_int_equal(attempts_wait_ns(&attempts, 77, 4, 2 * now_ns), 0);
    assert_int_equal(attempts_wait_ns(&attempts, 77, 4, 2 * now_ns), SECOND_NS / 4);
}

TEST(of_too_many_networks_the_quietest_is_forgotten)
{
    static struct attempts attempts;
    memset(&attempts, 0, sizeof(attempts));
    for (uint64_t network = 1; network <= ATTEMPTS_NETWORKS; network++)
        assert_int_equal(attempts_wait_ns(&attempts, network, 1, network), 0);
    assert_int_equal(attempts_wait_ns(&attempts, 1, 1, 2 * SECOND_NS), 0);
    assert_int_equal(attempts_wait_ns(&attempts, 9999, 1, 2 * SECOND_NS), 0); /* in the place of 2 */
    assert_true(attempts_wait_ns(&attempts, 1, 1, 2 * SECOND_NS) > 0);
    assert_true(attempts_wait_ns(&attempts, 9999, 1, 2 * SECOND_NS) > 0);
    assert_true(attempts_wait_ns(&attempts, 3, 1, 4) > 0);
    assert_int_equal(attempts_wait_ns(&attempts, 2, 1, 4), 0);
}
