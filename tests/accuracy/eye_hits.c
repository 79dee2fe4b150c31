/* SPDX-License-Identifier: MIT */
/* The short way from eyes to the layers of a view (tracer_eye_hits) beside the rays that take the long one: both
 * find the same, of eyes round the view, turned from it, and several in one picture. */
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/device.h"

#include "gpu_scene/scene.h"
#include "shared/eye_hit.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/raster/view.h"
#include "trace/tracer.h"

#define SIDE 128u
#define PIXELS (SIDE * SIDE)
#define FOV 1.05f
#define RADIUS 0.15f
#define LAYERS 3u
/* Outlines in the pictures are no longer than 16 sides. */
#define OUTLINES 16.0

/* Allowed differences of both ways. They begin in other nodes and round differently, by some 1e-5 of the
 * picture: 1e-3 of a texel; and each may be off by the bound. Along outlines, where they differ by that,
 * another surface is hit. */
struct slack {
    float bound_pixels; /* bound of the structure */
    double texels, share;
};
#define ROUNDING 2e-3
static const struct slack slacks[] = {
    {1e-3f, 2 * 1e-3 + 0.01, 2 * OUTLINES *ROUNDING / SIDE},
    {0.25f, 2 * 0.25 + 0.01, 2 * OUTLINES * 0.25 / SIDE},
};

struct room {
    struct gpu_scene gpu;
    struct trace_view view;
    struct frame_uniforms frame;
    struct gpu_buffer uniforms, rays, answers, found;
    struct ray host_rays[PIXELS];
    struct hit hits[PIXELS];
    vec4 eye_hits[PIXELS];
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

ALL_TESTS(open_device, close_device)

/* ---- scenes ---- */

/* Things before one another, and nothing beside them. */
static struct scene *scene_of_things(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float m[12];
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 3, 12, 1.0f, 11);
    for (uint32_t i = 0; i < 3; i++) {
        test_transform(m, 1, 1, 1, 1, 0.5f * (float)i, 0.6f * (float)i - 0.6f, 0.3f * (float)i, -1.5f * (float)i);
        test_node(&edits, 20 + i, 0, NODE_MESH, 3, m);
    }
    test_commit(&edits);
    return edits.scene;
}

static struct room *room_create(const struct scene *scene)
{
    struct room *room = calloc(1, sizeof(*room));
    struct scene_changes changes;
    struct error error = {0};
    assert_non_null(room);
    room->view = (struct trace_view){.world_from_view = {1, 0, 0, 0.1f, 0, 1, 0, 0.2f, 0, 0, 1, 4},
                                     .fov_y = FOV,
                                     .width = SIDE,
                                     .height = SIDE};
    gpu_scene_init(&room->gpu, device);
    expect_ok(gpu_scene_update(&room->gpu, scene, NULL, &changes, NULL, &error) &&
                  gpu_buffer_reserve(device, &room->answers, sizeof(room->hits), &error) &&
                  gpu_buffer_reserve(device, &room->found, sizeof(room->eye_hits), &error),
              &error);
    return room;
}

static void room_destroy(struct room *room)
{
    struct gpu_buffer *buffers[] = {&room->uniforms, &room->rays, &room->answers, &room->found};
    for (size_t i = 0; i < sizeof(buffers) / sizeof(buffers[0]); i++)
        gpu_buffer_finish(device, buffers[i]);
    gpu_scene_finish(&room->gpu);
    free(room);
}

/* ---- eyes ---- */

/* An eye at this distance from the view's, turned about the vertical; in a picture of several views across
 * and down. */
struct eye {
    float aside[3], turn;
    uint32_t views;
    float baseline;
};

static void look_through(struct room *room, const struct eye *eye)
{
    const float c = cosf(eye->turn), s = sinf(eye->turn), extent = tanf(FOV / 2);
    struct raster_camera camera = {.world_from_view = {c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0},
                                   .extent = {extent, extent},
                                   .width = SIDE / eye->views,
                                   .height = SIDE / eye->views};
    struct frame_uniforms *frame = &room->frame;
    for (int i = 0; i < 3; i++)
        camera.world_from_view[4 * i + 3] = room->view.world_from_view[4 * i + 3] + eye->aside[i];
    *frame = (struct frame_uniforms){0};
    raster_camera_fill(frame, &camera);
    frame->width = frame->height = SIDE;
    frame->tiles_across = SIDE / 8;
    frame->eye_steps[0] = eye->baseline;
    frame->eye_steps[3] = -eye->baseline;
    frame->eyes_middle[0] = frame->eyes_middle[1] = (float)(eye->views - 1) / 2;
}

/* Ray of a pixel of the picture, numbered as in shaders/common/slots.glsl. */
static struct ray ray_of(const struct frame_uniforms *frame, uint32_t slot)
{
    const uint32_t tile = slot / 64, m = slot % 64;
    const uint32_t x = tile % frame->tiles_across * 8 + ((m & 1) | (m >> 1 & 2) | (m >> 2 & 4));
    const uint32_t y = tile / frame->tiles_across * 8 + ((m >> 1 & 1) | (m >> 2 & 2) | (m >> 3 & 4));
    const float width = (float)frame->view_width, height = (float)frame->view_height;
    const float across = (float)(x / frame->view_width) - frame->eyes_middle[0];
    const float down = (float)(y / frame->view_height) - frame->eyes_middle[1];
    const float eye[2] = {across * frame->eye_steps[0], down * frame->eye_steps[3]};
    const float towards[3] = {frame->extent_near[0] * (2 * ((float)(x % frame->view_width) + 0.5f) / width - 1),
                              -frame->extent_near[1] * (2 * ((float)(y % frame->view_height) + 0.5f) / height - 1),
                              -1};
    struct ray ray = {.direction_t_max = {0, 0, 0, 1e6f}};
    for (int i = 0; i < 3; i++) {
        const float *row = frame->world_from_view[i];
        ray.origin_t_min[i] = row[3] + row[0] * eye[0] + row[1] * eye[1];
        ray.direction_t_max[i] = row[0] * towards[0] + row[1] * towards[1] + row[2] * towards[2];
    }
    return ray;
}

static void trace_rays(struct room *room, struct tracer *tracer)
{
    struct error error = {0};
    for (uint32_t i = 0; i < PIXELS; i++)
        room->host_rays[i] = ray_of(&room->frame, i);
    expect_ok(gpu_buffer_upload(device, &room->rays, room->host_rays, sizeof(room->host_rays), &error), &error);
    const struct wave wave = {
        .kind = WAVE_CLOSEST, .ray_count = PIXELS, .rays = &room->rays, .hits = &room->answers};
    gpu_scene_bind(&room->gpu);
    expect_ok(tracer_intersect(tracer, &room->gpu, &wave, &error), &error);
    gpu_buffer_read(device, &room->answers, 0, room->hits, sizeof(room->hits));
}

static void find_eyes(struct room *room, struct tracer *tracer, struct structure_rows *rows)
{
    struct error error = {0};
    struct trace_state *state = trace_state_create(tracer->impl, device, &tracer->options, &error);
    const struct eye_rays eyes = {.frame = &room->frame, .slot_count = PIXELS, .hits = &room->found};
    expect_ok(state != NULL, &error);
    expect_ok(gpu_buffer_upload(device, &room->uniforms, &room->frame, sizeof(room->frame), &error), &error);
    gpu_scene_bind(&room->gpu);
    gpu_buffer_bind_uniform(&room->uniforms, UNIFORM_FRAME);
    assert_true(tracer_finds_eyes(tracer, &room->gpu, &room->frame));
    expect_ok(tracer_eye_hits(tracer, &room->gpu, state, &eyes, &error), &error);
    gpu_buffer_read(device, &room->found, 0, room->eye_hits, sizeof(room->eye_hits));
    *rows = (struct structure_rows){0};
    expect_ok(trace_state_copy_counts(state, &error) && trace_state_report(state, rows, &error), &error);
    trace_state_destroy(state);
}

static struct tracer *bring(struct room *room, uint32_t layers, float bound_pixels)
{
    struct error error = {0};
    const struct tracer_options options = {.quadtree = {.layers = layers,
                                                        .faces = QUADTREE_FACES_VIEW,
                                                        .pixels = bound_pixels,
                                                        .radius = RADIUS,
                                                        .hits = QUADTREE_HITS_PLANE}};
    struct tracer *tracer = tracer_create(tracer_impl_by_number(TRACER_QUADTREE), device, &options, &error);
    expect_ok(tracer != NULL, &error);
    const struct tracer_update update = {.changed = CHANGED_ALL, .view = &room->view};
    expect_ok(tracer_update(tracer, &room->gpu, &update, &error), &error);
    return tracer;
}

/* ---- comparing ---- */

/* Between a place of a layer and where a ray's hit lies in it, texels. */
static double texels_apart(const struct trace_view *texels, const struct ray *ray, float distance,
                           const vec4 found)
{
    const double scale = texels->height / 2.0 / tan((double)texels->fov_y / 2);
    double p[3];
    for (int i = 0; i < 3; i++)
        p[i] = (double)ray->origin_t_min[i] + (double)distance * (double)ray->direction_t_max[i] -
               (double)texels->world_from_view[4 * i + 3];
    const double x = texels->width / 2.0 - scale * p[0] / p[2], y = texels->height / 2.0 + scale * p[1] / p[2];
    return fmax(fabs(x - (double)found[0]), fabs(y - (double)found[1]));
}

/* A guess is one where the layer shows nothing too, which the long way leaves out (render/gather_views.comp). */
static bool is_same(const struct trace_view *texels, const struct ray *ray, const struct hit *hit,
                    const vec4 found, double texels_max)
{
    const uint32_t bits = (uint32_t)found[3], layer = bits & EYE_LAYER_MASK;
    const uint32_t hit_layer = (hit->material & HIT_LAYER_MASK) >> HIT_LAYER_SHIFT;
    const bool is_hit = hit->distance >= 0, is_unknown = hit->material & HIT_UNKNOWN;
    if (!(bits & EYE_UNKNOWN) == is_unknown)
        return false;
    if (!is_hit)
        return is_unknown || layer == 0;
    return layer == hit_layer && texels_apart(texels, ray, hit->distance, found) <= texels_max;
}

static double share_of_same(const struct room *room, const struct tracer *tracer, double texels_max)
{
    struct trace_view texels;
    uint32_t layers, same = 0;
    assert_true(tracer->impl->texel_view(tracer, &texels, &layers));
    for (uint32_t i = 0; i < PIXELS; i++)
        same += is_same(&texels, &room->host_rays[i], &room->hits[i], room->eye_hits[i], texels_max);
    return (double)same / PIXELS;
}

static double row_of(const struct structure_rows *rows, const char *name)
{
    for (uint32_t i = 0; i < rows->count; i++)
        if (strstr(rows->rows[i].name, name))
            return (double)rows->rows[i].measure;
    fail_msg("there is no row %s", name);
    return 0;
}

static void expect_counts(const struct room *room, const struct structure_rows *rows)
{
    uint32_t unknown = 0;
    for (uint32_t i = 0; i < PIXELS; i++)
        unknown += ((uint32_t)room->eye_hits[i][3] & EYE_UNKNOWN) != 0;
    const double told = row_of(rows, "unknown_behind") + row_of(rows, "unknown_outside");
    if (!(fabs(told - (double)unknown / PIXELS) < 1e-6))
        fail_msg("%.5f are told to be unknown, of %.5f", told, (double)unknown / PIXELS);
    assert_true(unknown > 0);
}

TEST(the_short_way_of_eyes_finds_what_their_rays_do)
{
    static const struct eye eyes[] = {
        {{0.08f, 0.03f, 0.05f}, 0, 1, 0},      /* ahead */
        {{-0.05f, 0.02f, -0.1f}, 0.15f, 1, 0}, /* back, and turned */
        {{0, 0, 0.02f}, 0, 2, 0.15f},          /* four in a picture */
    };
    (void)state;
    if (!tracer_impl_by_number(TRACER_QUADTREE)) {
        printf("skipped: the build leaves the tracer out\n");
        skip();
    }
    struct scene *scene = scene_of_things();
    struct room *room = room_create(scene);
    for (uint32_t layers = 1; layers <= LAYERS; layers++)
        for (size_t k = 0; k < sizeof(slacks) / sizeof(slacks[0]); k++) {
            struct tracer *tracer = bring(room, layers, slacks[k].bound_pixels);
            for (size_t i = 0; i < sizeof(eyes) / sizeof(eyes[0]); i++) {
                struct structure_rows rows;
                look_through(room, &eyes[i]);
                trace_rays(room, tracer);
                find_eyes(room, tracer, &rows);
                const double same = share_of_same(room, tracer, slacks[k].texels);
                printf("%u layers, bound %g, eye %zu: %.3f %% are the same\n", layers,
                       (double)slacks[k].bound_pixels, i, 100 * same);
                if (!(same >= 1 - slacks[k].share))
                    fail_msg("%.3f %%, of at least %.3f %%", 100 * same, 100 * (1 - slacks[k].share));
                expect_counts(room, &rows);
            }
            tracer_destroy(tracer);
        }
    room_destroy(room);
    scene_destroy(scene);
}

TEST(eyes_that_need_rays_have_no_short_way)
{
    static const struct eye beside = {{0.01f, 0, 0}, 0, 1, 0}, turned = {{0.01f, 0, 0}, 1.3f, 1, 0},
                            far = {{1, 0, 0}, 0, 1, 0};
    (void)state;
    if (!tracer_impl_by_number(TRACER_QUADTREE)) {
        printf("skipped: the build leaves the tracer out\n");
        skip();
    }
    struct scene *scene = scene_of_things();
    struct room *room = room_create(scene);
    struct tracer *tracer = bring(room, 1, 0.25f);
    look_through(room, &beside);
    assert_true(tracer_finds_eyes(tracer, &room->gpu, &room->frame));
    room->frame.lens[0] = 0.01f;
    assert_false(tracer_finds_eyes(tracer, &room->gpu, &room->frame));
    look_through(room, &turned);
    assert_false(tracer_finds_eyes(tracer, &room->gpu, &room->frame));
    look_through(room, &far);
    assert_false(tracer_finds_eyes(tracer, &room->gpu, &room->frame));
    look_through(room, &beside);
    room->frame.extent_near[3] = 1; /* orthographic */
    assert_false(tracer_finds_eyes(tracer, &room->gpu, &room->frame));
    tracer_destroy(tracer);
    room_destroy(room);
    scene_destroy(scene);
}
