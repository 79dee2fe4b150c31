/* SPDX-License-Identifier: MIT */
/* Layers, rectangles of them and cameras of any bytes: each call is refused with an error that says why, or does
 * what it says. All pixels are written, the shares are theirs, and a structure that was brought up to date is the
 * one that is built anew. Input: bytes that are taken one after another; missing ones are 0. */
#include "tests/fuzz/fuzz.h"

#include "warp/warp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SIDE_MAX 200u /* texels, so that there is more than one part */
#define PIXELS_MAX 40u
#define CALLS_MAX 6
#define UNWRITTEN 99

static uint32_t colours[FL_WARP_LAYERS_MAX][SIDE_MAX * SIDE_MAX], part_colours[SIDE_MAX * SIDE_MAX];
static float w[FL_WARP_LAYERS_MAX][SIDE_MAX * SIDE_MAX], part_w[SIDE_MAX * SIDE_MAX];
static uint8_t sticking[SIDE_MAX * SIDE_MAX]; /* shares for any layer, and for parts */

struct input {
    const uint8_t *next, *end;
};

static unsigned take(struct input *input)
{
    return input->next < input->end ? *input->next++ : 0;
}

/* Any bits, or a number that is likely to be taken. */
static float take_float(struct input *input, float scale)
{
    const unsigned how = take(input);
    uint32_t bits = 0;
    float value;
    if (how < 250)
        return scale * ((float)how - 20) / 100; /* mostly positive: depths must be */
    for (int i = 0; i < 4; i++)
        bits = bits << 8 | take(input);
    memcpy(&value, &bits, sizeof(value));
    return value;
}

static struct fl_warp_camera take_camera(struct input *input)
{
    const float turn = take_float(input, 1), c = cosf(turn), s = sinf(turn);
    const float rows[12] = {c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0};
    struct fl_warp_camera camera;
    memcpy(camera.world_from_view, rows, sizeof(rows));
    for (int k = 3; k < 12; k += 4)
        camera.world_from_view[k] = take_float(input, 0.2f);
    if (take(input) == 255)
        camera.world_from_view[take(input) % 12] = take_float(input, 1);
    camera.fov_y = 1.2f + take_float(input, 1);
    return camera;
}

/* Runs of texels that have the same depth, or a slope. */
static void take_texels(struct input *input, uint32_t count, uint32_t *texel_colours, float *texel_w)
{
    float value = 0, slope = 0;
    for (uint32_t i = 0, run = 0; i < count; i++, value = slope == 0 ? value : fmaxf(value + slope, 0)) {
        if (run-- == 0) {
            run = take(input) * 4;
            value = take_float(input, 1);
            value = run == 1020 ? value : fabsf(value);
            slope = take(input) % 8 == 0 ? 0 : take_float(input, 0.01f);
        }
        texel_w[i] = value;
        texel_colours[i] = i * 2654435761u;
    }
}

static void require_reason(bool done, const struct fl_warp_error *error)
{
    FUZZ_REQUIRE(done || (error->code == FL_WARP_ERROR_ARGUMENT && error->field[0] && error->text[0]));
}

static void make_view(struct fl_warp *warp, struct input *input)
{
    static uint32_t made[PIXELS_MAX * PIXELS_MAX];
    static uint8_t mask[PIXELS_MAX * PIXELS_MAX], sticks[PIXELS_MAX * PIXELS_MAX];
    struct fl_warp_picture picture = {.colours = made, .mask = mask, .sticking = sticks};
    struct fl_warp_error error = {0};
    const struct fl_warp_view view = {.width = take(input) % PIXELS_MAX,
                                      .height = take(input) % PIXELS_MAX,
                                      .camera = take_camera(input),
                                      .quality = take(input) % 3,
                                      .holes = take(input) % 3};
    uint32_t known = 0, sticking_sum = 0;
    memset(mask, UNWRITTEN, sizeof(mask));
    const bool done = fl_warp_make(warp, &view, &picture, &error);
    require_reason(done, &error);
    for (uint32_t i = 0; i < sizeof(mask); i++) {
        FUZZ_REQUIRE(done && i < view.width * view.height ? mask[i] <= FL_WARP_OUTSIDE : mask[i] == UNWRITTEN);
        known += mask[i] == FL_WARP_KNOWN;
        if (mask[i] <= FL_WARP_OUTSIDE) {
            FUZZ_REQUIRE(mask[i] == FL_WARP_KNOWN || sticks[i] == 0);
            sticking_sum += sticks[i];
        }
    }
    const double pixels = (double)view.width * view.height;
    FUZZ_REQUIRE(!done || (picture.counts.known == (float)((double)known / pixels) &&
                           picture.counts.sticking == (float)((double)sticking_sum / (255 * pixels))));
}

/* Accepted input is also in `key`. */
static void update(struct fl_warp *warp, struct input *input, const struct fl_warp_key *key)
{
    struct fl_warp_error error = {0};
    const struct fl_warp_part part = {.layer = take(input) % 4,
                                      .x = take(input),
                                      .y = take(input),
                                      .width = take(input) % (SIDE_MAX + 1),
                                      .height = take(input) % (SIDE_MAX + 1),
                                      .texels = {part_colours, part_w, take(input) & 1 ? sticking : NULL}};
    take_texels(input, part.width * part.height, part_colours, part_w);
    const bool done = fl_warp_update(warp, &part, &error);
    require_reason(done, &error);
    for (uint32_t y = 0; done && y < part.height; y++) {
        const size_t to = (size_t)(part.y + y) * key->width + part.x, from = (size_t)y * part.width;
        memcpy(colours[part.layer] + to, part_colours + from, part.width * sizeof(colours[0][0]));
        memcpy(w[part.layer] + to, part_w + from, part.width * sizeof(w[0][0]));
    }
}

static void require_same_nodes(const struct fl_warp *warp, const struct fl_warp_key *key)
{
    struct fl_warp *anew = fl_warp_create(1, NULL);
    FUZZ_REQUIRE(anew && fl_warp_set_key(anew, key, NULL));
    for (uint32_t l = 0; l < key->layer_count; l++) {
        uint32_t a, b;
        const uint32_t *nodes = fl_warp_nodes(warp, l, &a), *of_anew = fl_warp_nodes(anew, l, &b);
        FUZZ_REQUIRE(a == b && memcmp(nodes, of_anew, (size_t)a * 2 * sizeof(*nodes)) == 0);
    }
    fl_warp_destroy(anew);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct input input = {data, data + size};
    struct fl_warp_error error = {0};
    struct fl_warp *warp = fl_warp_create(1, &error);
    FUZZ_REQUIRE(warp);
    struct fl_warp_key key = {.width = take(&input) % (SIDE_MAX + 1),
                              .height = take(&input) % (SIDE_MAX + 1),
                              .camera = take_camera(&input),
                              .unit = take(&input) & 1 ? take_float(&input, 1) : 0,
                              .w_error = take(&input) & 1 ? take_float(&input, 0.01f) : 0,
                              .radius = 0.2f + take_float(&input, 0.2f),
                              .pixels = 0.5f + take_float(&input, 0.5f),
                              .layer_count = take(&input) % 5};
    for (uint32_t i = 0; i < SIDE_MAX * SIDE_MAX; i++)
        sticking[i] = (uint8_t)i;
    for (uint32_t l = 0; l < FL_WARP_LAYERS_MAX; l++) {
        take_texels(&input, key.width * key.height, colours[l], w[l]);
        key.layers[l] = (struct fl_warp_layer){colours[l], w[l], l & 1 ? sticking : NULL};
    }
    const bool is_set = fl_warp_set_key(warp, &key, &error);
    require_reason(is_set, &error);
    for (int i = 0; i < CALLS_MAX && input.next < input.end; i++)
        if (take(&input) & 1)
            update(warp, &input, &key);
        else
            make_view(warp, &input);
    if (is_set)
        require_same_nodes(warp, &key);
    fl_warp_destroy(warp);
    return 0;
}
