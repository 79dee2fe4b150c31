/* SPDX-License-Identifier: MIT */
/* Every check for every tracer of the table, and that the table has them all. */
#include "tests/tracers/contract.h"

#define ROWS_MAX 64
#define CHECKS_MAX 64
#define TESTS_MAX 2048
#define TRACER_NUMBERS_MAX 256

static const struct tracer_row *rows[ROWS_MAX];
static const struct check *checks[CHECKS_MAX];
static size_t row_count, check_count;

void tracer_rows_add(const struct tracer_row *added, size_t count)
{
    for (size_t i = 0; i < count && row_count < ROWS_MAX; i++)
        rows[row_count++] = &added[i];
}

void check_add(const struct check *check)
{
    if (check_count < CHECKS_MAX)
        checks[check_count++] = check;
}

static const struct tracer_row *row_of(unsigned number)
{
    for (size_t i = 0; i < row_count; i++)
        if (rows[i]->number == number && !rows[i]->is_form)
            return rows[i];
    return NULL;
}

static void every_tracer_has_a_row_that_says_what_it_is(void **state)
{
    (void)state;
    for (unsigned number = 0; number < TRACER_NUMBERS_MAX; number++) {
        const struct tracer_impl *impl = tracer_impl_by_number(number);
        if (!impl)
            continue;
        const struct tracer_row *row = row_of(number);
        if (!row)
            fail_msg("the tracer %s has no row in tests/tracers", impl->name);
        assert_string_equal(row->name, impl->name);
        assert_int_equal(row->refuses_motion != NULL, impl->still);
        assert_int_equal(row->sampled.reason != NULL, row->sampled.resolution > 0);
        assert_int_equal(row->seen.layers > 0, (impl->depends_on & CHANGED_VIEW) != 0);
        assert_int_equal(row->seen.reason != NULL, row->seen.layers > 0);
    }
}

static void the_build_leaves_this_tracer_out(void **state)
{
    const struct contract_case *of = *state;
    struct error error = {0};
    tracer_find(of->tracer->number, "tracer", &error);
    printf("skipped: %s\n", error.text);
    skip();
}

static struct CMUnitTest tests[TESTS_MAX];
static struct contract_case cases[TESTS_MAX];
static char names[TESTS_MAX][160];
static size_t test_count;

static void add_test(const char *row, const char *name, const char *scene, CMUnitTestFunction run,
                     struct contract_case of)
{
    if (test_count == TESTS_MAX) {
        fprintf(stderr, "more than %d tests\n", TESTS_MAX);
        exit(1);
    }
    size_t n = test_count++;
    cases[n] = of;
    snprintf(names[n], sizeof(names[n]), "%s: %s%s%s", row, name, scene ? ": " : "", scene ? scene : "");
    tests[n] = (struct CMUnitTest){.name = names[n], .test_func = run, .initial_state = &cases[n]};
}

static void add_tests_of(const struct tracer_row *row)
{
    if (!tracer_impl_by_number(row->number)) {
        add_test(row->name, "the build leaves this tracer out", NULL, the_build_leaves_this_tracer_out,
                 (struct contract_case){row, NULL});
        return;
    }
    for (size_t c = 0; c < check_count; c++) {
        const struct check *check = checks[c];
        if ((row->is_form && !(check->scope & CHECK_FORMS)) ||
            (row->sampled.coarse && (check->scope & CHECK_SURFACES)) ||
            (row->sampled.own_way && (check->scope & CHECK_BESIDE)))
            continue;
        if (!(check->scope & CHECK_EACH_SCENE))
            add_test(row->name, check->name, NULL, check->run, (struct contract_case){row, NULL});
        for (size_t s = 0; (check->scope & CHECK_EACH_SCENE) && s < scene_row_count; s++) {
            const struct scene_row *scene = &scene_rows[s];
            const unsigned phases = row->sampled.resolution ? scene->phases_sampled : scene->phases;
            if ((scene->pose_count > 1 && row->refuses_motion) ||
                (scene->is_finer_than_cells && row->sampled.resolution) ||
                (scene->is_tinted && row->sampled.coarse) || (phases == 0 && !getenv("FARLIGHT_TEST_LONG")))
                continue;
            add_test(row->name, check->name, scene->name, check->run, (struct contract_case){row, scene});
        }
    }
}

static int list_rows(void)
{
    puts("the table");
    for (size_t r = 0; r < row_count; r++)
        puts(rows[r]->name);
    return 0;
}

/* A part of tests' names may be given; --list says by what rows they begin. */
int main(int argc, char **argv)
{
    struct error error = {0};
    if (argc > 1 && strcmp(argv[1], "--list") == 0)
        return list_rows();
    add_test("the table", "every tracer has a row that says what it is", NULL,
             every_tracer_has_a_row_that_says_what_it_is, (struct contract_case){0});
    add_test("the table", "what a view sees is what brute force counts", NULL,
             what_a_view_sees_is_what_brute_force_counts, (struct contract_case){0});
    for (size_t r = 0; r < row_count; r++)
        add_tests_of(rows[r]);
    if (argc > 1) {
        size_t kept = 0;
        for (size_t i = 0; i < test_count; i++)
            if (strstr(tests[i].name, argv[1]))
                tests[kept++] = tests[i];
        test_count = kept;
    }
    /* LLVM's optimizer would take longer than all of these small waves. */
    setenv("GALLIVM_PERF", "nopt", 0);
    device = gpu_device_create(&(struct gpu_options){.index = -1, .debug = true}, &error);
    if (!device) {
        printf("SKIP: no OpenGL device: %s\n", error.text);
        return 0;
    }
    int failures = _cmocka_run_group_tests("tracer contract", tests, test_count, NULL, NULL);
    gpu_device_destroy(device);
    return failures;
}
