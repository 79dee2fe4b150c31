/* SPDX-License-Identifier: MIT */
/* Addresses and names of the page (client/web/address.h). */
#include "tests/harness/test.h"
#include "web/address.h"

static struct web_address read(const char *text)
{
    struct web_address address;
    struct fl_error error = {0};
    if (!web_address_read(text, &address, &error))
        fail_msg("%s: %s", text, error.text);
    return address;
}

TEST(addresses_are_read_with_what_they_mean)
{
    struct web_address address = read("127.0.0.1:8080");
    assert_string_equal(address.host, "127.0.0.1");
    assert_int_equal(address.port, 8080);
    assert_true(address.is_loopback && !address.is_v6 && !address.is_any);
    address = read("localhost:0");
    assert_string_equal(address.host, "127.0.0.1");
    address = read("[::1]:65535");
    assert_string_equal(address.host, "::1");
    assert_true(address.is_loopback && address.is_v6 && !address.is_any);
    address = read("[::]:1");
    assert_true(address.is_any && address.is_v6 && !address.is_loopback);
    address = read("0.0.0.0:1");
    assert_true(address.is_any && !address.is_v6 && !address.is_loopback);
    assert_false(read("192.168.0.1:1").is_loopback);
    assert_true(read("127.9.9.9:1").is_loopback);
}

TEST(what_is_no_address_is_refused)
{
    static const char *const wrong[] = {"",
                                        "8080",
                                        "127.0.0.1",
                                        "127.0.0.1:",
                                        "127.0.0.1:x",
                                        "127.0.0.1:65536",
                                        "127.0.0.1:-1",
                                        "127.0.0.1: 1",
                                        "::1:8080",
                                        "[::1]",
                                        "[::1]8080",
                                        "[::1:8080",
                                        "[]:80",
                                        "[127.0.0.1]:80",
                                        "name:80",
                                        "127.1:80",
                                        "256.0.0.1:80",
                                        "[fe80::1%eth0]:80",
                                        "[::ffff:127.0.0.1]:80"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        struct web_address address;
        struct fl_error error = {0};
        if (web_address_read(wrong[i], &address, &error))
            fail_msg("'%s' was taken", wrong[i]);
        assert_string_equal(error.field, "--listen");
    }
}

TEST(only_our_own_names_are_answered)
{
    static const char *const names[] = {"View.example"};
    static const char *const ours[] = {"127.0.0.1:8080", "127.0.0.1",    "[::1]:80",
                                       "[::1]",          "localhost:1",  "LOCALHOST",
                                       "192.168.0.7:1",  "view.example", "view.EXAMPLE:443"};
    static const char *const others[] = {"",
                                         "evil.example",
                                         "evil.example:8080",
                                         "localhost.evil.example",
                                         "view.example.evil",
                                         "127.0.0.1.evil:80",
                                         "127.0.0.1:80:80",
                                         "[::1",
                                         "[evil]",
                                         "[localhost]",
                                         "localhost:x",
                                         "view.example:99999",
                                         "[::1]evil",
                                         "::1",
                                         "127.1"};
    for (size_t i = 0; i < sizeof(ours) / sizeof(ours[0]); i++)
        if (!web_host_is_ours(ours[i], names, 1))
            fail_msg("'%s' is not answered", ours[i]);
    for (size_t i = 0; i < sizeof(others) / sizeof(others[0]); i++)
        if (web_host_is_ours(others[i], names, 1))
            fail_msg("'%s' is answered", others[i]);
    assert_false(web_host_is_ours("view.example", NULL, 0));
}
