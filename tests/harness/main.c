/* SPDX-License-Identifier: MIT */
/* Runs the tests that registered themselves. Usage: PROGRAM [--list] [FILE[:TEST] ..]
 * FILE and TEST are parts of names; without any, all tests run. --list prints 'FILE TEST' for each, with ' long'
 * behind those that are skipped unless FARLIGHT_TEST_LONG is set. More than one file: each in a child process, so
 * that one that crashes takes no other along. */
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

struct test_file {
    char name[96]; /* its path below tests/, without the ending */
    struct CMUnitTest *tests;
    unsigned *kinds; /* enum test_kind of each test */
    size_t count;
    CMFixtureFunction set_up, tear_down;           /* once */
    CMFixtureFunction each_set_up, each_tear_down; /* for tests without fixtures of their own */
};

static struct test_file *files;
static size_t file_count;
static struct test_file *running;
static char skip_reason[512];

static void *grown(void *data, size_t bytes)
{
    data = realloc(data, bytes);
    if (!data)
        abort();
    return data;
}

static struct test_file *file_named(const char *path)
{
    char name[sizeof(files->name)];
    const char *begin = strncmp(path, "tests/", 6) == 0 ? path + 6 : path;
    snprintf(name, sizeof(name), "%.*s", (int)strcspn(begin, "."), begin);
    for (size_t i = 0; i < file_count; i++)
        if (strcmp(files[i].name, name) == 0)
            return &files[i];
    files = grown(files, (file_count + 1) * sizeof(*files));
    struct test_file *file = &files[file_count++];
    *file = (struct test_file){0};
    memcpy(file->name, name, sizeof(name));
    return file;
}

void test_register(const char *path, const struct CMUnitTest *test, unsigned kind)
{
    struct test_file *file = file_named(path);
    file->tests = grown(file->tests, (file->count + 1) * sizeof(*file->tests));
    file->kinds = grown(file->kinds, (file->count + 1) * sizeof(*file->kinds));
    file->tests[file->count] = *test;
    file->kinds[file->count++] = kind;
}

void test_register_each(const char *path, CMFixtureFunction set_up, CMFixtureFunction tear_down)
{
    struct test_file *file = file_named(path);
    file->each_set_up = set_up;
    file->each_tear_down = tear_down;
}

void test_register_all(const char *path, CMFixtureFunction set_up, CMFixtureFunction tear_down)
{
    struct test_file *file = file_named(path);
    file->set_up = set_up;
    file->tear_down = tear_down;
}

void test_skip_file(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(skip_reason, sizeof(skip_reason), format, arguments);
    va_end(arguments);
}

static void skipped(void **state)
{
    (void)state;
    skip();
}

static void left_out(void **state)
{
    printf("skipped: left to make test-all\n");
    skipped(state);
}

/* cmocka cannot skip a group, but asks for each test's functions only when its turn comes. */
static int begin_file(void **state)
{
    const int status = running->set_up ? running->set_up(state) : 0;
    if (skip_reason[0]) {
        printf("skipped: %s\n", skip_reason);
        for (size_t i = 0; i < running->count; i++)
            running->tests[i] = (struct CMUnitTest){.name = running->tests[i].name, .test_func = skipped};
    }
    return status;
}

static int end_file(void **state)
{
    return running->tear_down && !skip_reason[0] ? running->tear_down(state) : 0;
}

/* Keeps the test of that name, or else those whose names contain `part`. */
static void keep_named(struct test_file *file, const char *part)
{
    size_t kept = 0;
    bool is_whole = false;
    for (size_t i = 0; i < file->count; i++)
        is_whole = is_whole || strcmp(file->tests[i].name, part) == 0;
    for (size_t i = 0; i < file->count; i++) {
        if (is_whole ? strcmp(file->tests[i].name, part) != 0 : !strstr(file->tests[i].name, part))
            continue;
        file->kinds[kept] = file->kinds[i];
        file->tests[kept++] = file->tests[i];
    }
    file->count = kept;
}

/* The number of tests that failed. */
static int run_file(struct test_file *file)
{
    const bool leaves_out = !getenv("FARLIGHT_TEST_LONG");
    for (size_t i = 0; i < file->count; i++) {
        struct CMUnitTest *test = &file->tests[i];
        if (leaves_out && (file->kinds[i] & TEST_IS_LONG)) {
            *test = (struct CMUnitTest){.name = test->name, .test_func = left_out};
        } else if (!(file->kinds[i] & TEST_HAS_OWN_FIXTURE)) {
            test->setup_func = file->each_set_up;
            test->teardown_func = file->each_tear_down;
        }
    }
    running = file;
    return _cmocka_run_group_tests(file->name, file->tests, file->count, begin_file, end_file);
}

static bool run_in_child(struct test_file *file)
{
    const pid_t child = fork();
    if (child == 0)
        exit(run_file(file) != 0);
    int status = 1;
    if (child < 0 || waitpid(child, &status, 0) != child || status != 0)
        printf("%s: status %d\n", file->name, status);
    return status == 0;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct test_file *)a)->name, ((const struct test_file *)b)->name);
}

/* Asked for by its whole name, a file whose name contains that name is not. */
static bool is_named(const struct test_file *file, const char *part)
{
    for (size_t i = 0; i < file_count; i++)
        if (strcmp(files[i].name, part) == 0)
            return strcmp(file->name, part) == 0;
    return strstr(file->name, part);
}

static bool is_asked(struct test_file *file, char **filters, int filter_count)
{
    bool asked = filter_count == 0;
    for (int i = 0; i < filter_count; i++) {
        char part[256];
        const size_t length = strcspn(filters[i], ":");
        snprintf(part, sizeof(part), "%.*s", (int)length, filters[i]);
        if (!is_named(file, part))
            continue;
        asked = true;
        if (filters[i][length])
            keep_named(file, filters[i] + length + 1);
    }
    return asked && file->count > 0;
}

int main(int argc, char **argv)
{
    const bool lists = argc > 1 && strcmp(argv[1], "--list") == 0;
    size_t asked = 0;
    /* LLVM's optimizer takes longer than the small pictures of tests that are not long. */
    if (!getenv("FARLIGHT_TEST_LONG"))
        setenv("GALLIVM_PERF", "nopt", 0);
    setvbuf(stdout, NULL, _IOLBF, 0); /* in order with what goes to stderr */
    qsort(files, file_count, sizeof(*files), by_name);
    for (size_t i = 0; i < file_count; i++)
        if (is_asked(&files[i], argv + 1 + lists, argc - 1 - lists)) {
            const struct test_file file = files[asked];
            files[asked++] = files[i];
            files[i] = file;
        }
    if (lists) {
        for (size_t i = 0; i < asked; i++)
            for (size_t t = 0; t < files[i].count; t++)
                printf("%s %s%s\n", files[i].name, files[i].tests[t].name,
                       files[i].kinds[t] & TEST_IS_LONG ? " long" : "");
        return 0;
    }
    if (asked == 0)
        fprintf(stderr, "no such test; --list names them\n");
    if (asked == 1)
        return run_file(&files[0]) != 0;
    bool passed = asked > 0;
    for (size_t i = 0; i < asked; i++)
        passed = run_in_child(&files[i]) && passed;
    return passed ? 0 : 1;
}
