/* SPDX-License-Identifier: MIT */
/* Inputs may come from a stranger: each fault ends in an error that names it, and changes nothing. */
#include "tests/unit/warp/views.h"

#include <float.h>
#include <limits.h>

static void set_texels(void)
{
    for (uint32_t l = 0; l < FL_WARP_LAYERS_MAX; l++)
        for (uint32_t i = 0; i < COUNT; i++) {
            key_w[l][i] = 0.25f + 0.001f * (float)(i % 40);
            key_colours[l][i] = i;
        }
}

static void expect_refused(bool done, struct fl_warp_error *error, const char *field)
{
    assert_false(done);
    assert_int_equal(error->code, FL_WARP_ERROR_ARGUMENT);
    assert_string_equal(error->field, field);
    assert_true(error->text[0] != 0);
    *error = (struct fl_warp_error){0};
}

TEST(threads_have_a_limit)
{
    struct fl_warp_error error = {0};
    expect_refused(fl_warp_create(0, &error) != NULL, &error, "threads");
    expect_refused(fl_warp_create(FL_WARP_THREADS_MAX + 1, &error) != NULL, &error, "threads");
    assert_true(!fl_warp_create(0, NULL));
    fl_warp_destroy(NULL);
}

TEST(a_context_without_a_key_view_makes_nothing)
{
    struct fl_warp_error error = {0};
    struct fl_warp *warp = fl_warp_create(1, &error);
    static struct made made;
    struct fl_warp_picture picture = {.colours = made.colours, .mask = made.mask};
    const struct fl_warp_view view = view_of(camera_turned(0, 0), FL_WARP_TREE);
    const struct fl_warp_part part = {.width = 1, .height = 1, .texels = {key_colours[0], key_w[0], NULL}};
    uint32_t count;
    expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "view");
    expect_refused(fl_warp_update(warp, &part, &error), &error, "part");
    assert_true(!fl_warp_nodes(warp, 0, &count));
    fl_warp_destroy(warp);
}

static const float no_numbers[] = {NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX};
#define NO_NUMBERS (sizeof(no_numbers) / sizeof(no_numbers[0]))

static void expect_no_key(struct fl_warp *warp, const struct fl_warp_key *key, const char *field)
{
    struct fl_warp_error error = {0};
    expect_refused(fl_warp_set_key(warp, key, &error), &error, field);
}

TEST(a_key_view_that_cannot_be_is_refused_and_the_old_one_stays)
{
    static struct made before, after;
    set_texels();
    const struct fl_warp_key good = key_of(3);
    struct fl_warp *warp = warp_with(1, &good);
    const struct fl_warp_view view = view_of(camera_at(0.05, 0, 0), FL_WARP_TREE);
    make(warp, &view, &before);
    for (size_t i = 0; i < NO_NUMBERS; i++) {
        const float wrong = no_numbers[i];
        struct fl_warp_key key = good;
        key.unit = wrong;
        expect_no_key(warp, &key, "unit");
        key = good;
        key.w_error = wrong;
        expect_no_key(warp, &key, "w_error");
        key = good;
        key.radius = wrong;
        expect_no_key(warp, &key, "radius");
        key = good;
        key.pixels = wrong;
        expect_no_key(warp, &key, "pixels");
        key = good;
        key.camera.fov_y = wrong;
        expect_no_key(warp, &key, "camera.fov_y");
        for (int k = 0; k < 12; k++) {
            key = good;
            key.camera.world_from_view[k] = wrong;
            expect_no_key(warp, &key, "camera.world_from_view");
        }
        for (uint32_t l = 0; l < 3; l++) {
            const uint32_t at[] = {0, COUNT - 1, 12345};
            for (int k = 0; k < 3; k++) {
                const float saved = key_w[l][at[k]];
                key_w[l][at[k]] = wrong;
                expect_no_key(warp, &good, "w");
                key_w[l][at[k]] = -1e-30f;
                expect_no_key(warp, &good, "w");
                key_w[l][at[k]] = saved;
            }
        }
    }
    static const uint32_t sizes[][2] = {{0, 1},
                                        {1, 0},
                                        {FL_WARP_SIDE_MAX + 1, 1},
                                        {1, FL_WARP_SIDE_MAX + 1},
                                        {0x10000, 0x10000},
                                        {FL_WARP_SIDE_MAX, FL_WARP_TEXELS_MAX / FL_WARP_SIDE_MAX + 1}};
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        struct fl_warp_key key = good;
        key.width = sizes[i][0];
        key.height = sizes[i][1];
        expect_no_key(warp, &key, "size");
    }
    struct fl_warp_key key = good;
    key.radius = 0;
    expect_no_key(warp, &key, "radius");
    key = good;
    key.layer_count = 0;
    expect_no_key(warp, &key, "layer_count");
    key.layer_count = FL_WARP_LAYERS_MAX + 1;
    expect_no_key(warp, &key, "layer_count");
    key = good;
    key.layers[2].w = NULL;
    expect_no_key(warp, &key, "layers");
    key = good;
    key.layers[1].colours = NULL;
    expect_no_key(warp, &key, "layers");
    key = good;
    for (int k = 0; k < 3; k++)
        key.camera.world_from_view[4 * k] = key.camera.world_from_view[4 * k + 1];
    expect_no_key(warp, &key, "camera.world_from_view");
    make(warp, &view, &after);
    assert_memory_equal(before.colours, after.colours, sizeof(before.colours));
    fl_warp_destroy(warp);
}

TEST(a_part_beyond_the_layer_is_refused_and_changes_nothing)
{
    static struct made before, after;
    set_texels();
    const struct fl_warp_key key = key_of(2);
    struct fl_warp *warp = warp_with(1, &key);
    struct fl_warp_error error = {0};
    const struct fl_warp_view view = view_of(camera_at(0.05, 0, 0), FL_WARP_TREE);
    make(warp, &view, &before);
    static const struct fl_warp_part wrong[] = {
        {.x = WIDTH, .width = 1, .height = 1},
        {.y = HEIGHT, .width = 1, .height = 1},
        {.x = 1, .width = WIDTH, .height = 1},
        {.y = 1, .width = 1, .height = HEIGHT},
        {.width = 0, .height = 1},
        {.width = 1, .height = 0},
        {.x = 7, .width = UINT32_MAX - 6, .height = 1},
        {.x = UINT32_MAX, .width = 2, .height = 1},
    };
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        struct fl_warp_part part = wrong[i];
        part.texels = (struct fl_warp_layer){key_colours[0], key_w[0], NULL};
        expect_refused(fl_warp_update(warp, &part, &error), &error, "part");
    }
    struct fl_warp_part part = {.layer = 2, .width = 1, .height = 1, .texels = {key_colours[0], key_w[0], NULL}};
    expect_refused(fl_warp_update(warp, &part, &error), &error, "layer");
    part = (struct fl_warp_part){.width = 2, .height = 2};
    expect_refused(fl_warp_update(warp, &part, &error), &error, "texels");
    static const uint32_t colours[4] = {1, 2, 3, 4};
    static const float w[4] = {0.5f, 0.5f, 0.5f, NAN};
    part.texels = (struct fl_warp_layer){colours, w, NULL};
    expect_refused(fl_warp_update(warp, &part, &error), &error, "w");
    make(warp, &view, &after);
    assert_memory_equal(before.colours, after.colours, sizeof(before.colours));
    fl_warp_destroy(warp);
}

TEST(a_view_that_cannot_be_is_refused)
{
    static struct made made;
    set_texels();
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    struct fl_warp_error error = {0};
    struct fl_warp_picture picture = {.colours = made.colours, .mask = made.mask};
    const struct fl_warp_view good = view_of(key.camera, FL_WARP_TREE);
    struct fl_warp_view view = good;
    view.width = 0;
    expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "size");
    view = good;
    view.height = FL_WARP_SIDE_MAX + 1;
    expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "size");
    view = good;
    view.quality = 7;
    expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "quality");
    view = good;
    view.holes = 7;
    expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "holes");
    for (size_t i = 0; i < NO_NUMBERS; i++) {
        view = good;
        view.camera.world_from_view[(5 * i + 3) % 12] = no_numbers[i];
        expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "camera.world_from_view");
        view = good;
        view.camera.fov_y = no_numbers[i];
        expect_refused(fl_warp_make(warp, &view, &picture, &error), &error, "camera.fov_y");
    }
    picture.mask = NULL;
    expect_refused(fl_warp_make(warp, &good, &picture, &error), &error, "picture");
    fl_warp_destroy(warp);
}

/* Counter of one thread, which each question lowers. */
struct patience {
    int *questions;
};

static bool is_out_of_patience(const void *context)
{
    const struct patience *patience = context;
    return (*patience->questions)-- == 0;
}

TEST(a_view_that_is_given_up_says_so_and_the_next_one_is_whole)
{
    static struct made whole, again;
    set_texels();
    const struct fl_warp_key key = key_of(1);
    struct fl_warp *warp = warp_with(1, &key);
    struct fl_warp_view view = view_of(camera_at(0.02, 0, 0), FL_WARP_TREE);
    make(warp, &view, &whole);
    view.is_given_up = is_out_of_patience;
    for (int asked = 0; asked < 3; asked++) {
        int questions = asked;
        const struct patience patience = {&questions};
        struct fl_warp_picture picture = {.colours = again.colours, .mask = again.mask};
        struct fl_warp_error error = {0};
        view.given_up_context = &patience;
        assert_false(fl_warp_make(warp, &view, &picture, &error));
        assert_int_equal(error.code, FL_WARP_ERROR_GIVEN_UP);
        assert_int_equal(questions, -1); /* no further question */
    }
    int questions = INT_MAX;
    view.given_up_context = &(const struct patience){&questions};
    make(warp, &view, &again);
    assert_memory_equal(whole.colours, again.colours, sizeof(whole.colours));
    fl_warp_destroy(warp);
}

/* Any camera, however far away or turned, and any depths: all pixels are written, and no index leaves its array
 * (the sanitizers see that). */
TEST(any_camera_gives_a_whole_picture)
{
    static struct made made;
    uint64_t seed = 31;
    for (uint32_t l = 0; l < FL_WARP_LAYERS_MAX; l++)
        for (uint32_t i = 0; i < COUNT; i++)
            key_w[l][i] = (float)pow(10, uniform(&seed, -30, 9));
    const struct fl_warp_key key = key_of(3);
    struct fl_warp *warp = warp_with(1, &key);
    for (int round = 0; round < 200; round++) {
        const double far = pow(10, uniform(&seed, -6, 9));
        struct fl_warp_view view = view_of(camera_turned(uniform(&seed, -4, 4), uniform(&seed, -2, 2)), round & 1);
        view.width = 64;
        view.height = 40;
        view.camera.fov_y = (float)uniform(&seed, 0.001, 3);
        for (int k = 3; k < 12; k += 4)
            view.camera.world_from_view[k] = (float)uniform(&seed, -far, far);
        memset(made.mask, 99, sizeof(made.mask));
        make(warp, &view, &made);
        uint32_t counts[3] = {0};
        for (uint32_t i = 0; i < view.width * view.height; i++) {
            assert_in_range(made.mask[i], 0, FL_WARP_OUTSIDE);
            counts[made.mask[i]]++;
        }
        assert_float_equal(made.counts.outside, (float)counts[FL_WARP_OUTSIDE] / (64 * 40), 1e-6);
    }
    fl_warp_destroy(warp);
}
