/* SPDX-License-Identifier: MIT */
/* Tests register themselves; harness/main.c runs them, each file in a process of its own.
 *
 *     ALL_TESTS(open_device, close_device)   once, before the first and after the last test of the file
 *     EACH_TEST(clear, NULL)                 before and after each TEST of the file
 *     TEST(a_truncated_header_is_refused)
 *     {
 *         ...                                with cmocka's assertions and its `void **state`
 *     }
 *     TEST_WITH(a_full_disk_is_reported, make_folder, remove_folder)   in place of what EACH_TEST says
 *     TEST_LONG(every_material_keeps_its_energy)   skipped but for FARLIGHT_TEST_LONG, which `make test-all` sets
 *
 * Functions before and after are cmocka's: int f(void **state). NULL: none. */
#ifndef FARLIGHT_TESTS_TEST_H
#define FARLIGHT_TESTS_TEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum test_kind {
    TEST_PLAIN = 0,
    TEST_HAS_OWN_FIXTURE = 1, /* in place of EACH_TEST's */
    TEST_IS_LONG = 2,         /* adds breadth for its time: left to `make test-all` */
};

/* `test` is copied; its name must last until the process ends. `kind`: of enum test_kind, or both. */
void test_register(const char *file, const struct CMUnitTest *test, unsigned kind);
void test_register_each(const char *file, CMFixtureFunction set_up, CMFixtureFunction tear_down);
void test_register_all(const char *file, CMFixtureFunction set_up, CMFixtureFunction tear_down);

/* In the set-up of ALL_TESTS, in place of a failure: every test of the file counts as skipped. */
void test_skip_file(const char *format, ...) __attribute__((format(printf, 1, 2)));

#define TEST_REGISTER_(name, set_up, tear_down, kind)                                                             \
    static void name(void **state);                                                                               \
    __attribute__((constructor)) static void register_##name(void)                                                \
    {                                                                                                             \
        test_register(__FILE__, &(struct CMUnitTest){#name, name, set_up, tear_down, NULL}, kind);                \
    }                                                                                                             \
    static void name(__attribute__((unused)) void **state)
#define TEST(name) TEST_REGISTER_(name, NULL, NULL, TEST_PLAIN)
#define TEST_LONG(name) TEST_REGISTER_(name, NULL, NULL, TEST_IS_LONG)
#define TEST_WITH(name, set_up, tear_down) TEST_REGISTER_(name, set_up, tear_down, TEST_HAS_OWN_FIXTURE)
#define EACH_TEST(set_up, tear_down)                                                                              \
    __attribute__((constructor)) static void set_each_test(void)                                                  \
    {                                                                                                             \
        test_register_each(__FILE__, set_up, tear_down);                                                          \
    }
#define ALL_TESTS(set_up, tear_down)                                                                              \
    __attribute__((constructor)) static void set_all_tests(void)                                                  \
    {                                                                                                             \
        test_register_all(__FILE__, set_up, tear_down);                                                           \
    }

#endif
