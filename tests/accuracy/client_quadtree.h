/* SPDX-License-Identifier: MIT */
/* Layers for both sides that build quadtrees over them: the daemon's shaders and client/warp. */
#ifndef FARLIGHT_TESTS_CLIENT_QUADTREE_H
#define FARLIGHT_TESTS_CLIENT_QUADTREE_H

#include "tests/fixtures/load_model.h"
#include "tests/unit/trace/quadtree/layers.h"

#include "render/frame/frame.h"
#include "trace/quadtree/faces.h"
#include "trace/quadtree/layers.h"
#include "warp/warp.h"
#include "tests/fixtures/framing.h"

#include <unistd.h>

/* Size of the key view and of the eyes' pictures: tiles of 8x8 and more than one part, with a remainder; a
 * place fits into the 8 bits of a colour. */
#define WIDTH 240u
#define HEIGHT 184u
#define COUNT (WIDTH * HEIGHT)
#define LAYERS 2u
#define FOV 0.9f
#define PIXELS 0.25f
/* Metres; of the carousel, of which the eye is away by a share of its diagonal, a share of that, as viewers choose
 * it. */
#define MADE_UP_RADIUS 0.15f
#define AWAY 0.1f
#define RADIUS_SHARE 0.1f
/* Blue of a texel: its layer, or the environment. */
#define LAYER_COLOUR 80u
#define SKY_COLOUR 240u

/* Both sides, with the layers that both have. */
struct sides {
    struct layers daemon;
    struct quadtree_layers drawing;
    float radius; /* radius of the bound, metres */
    struct fl_warp_key key;
    struct fl_warp *client;
    float w[LAYERS][COUNT];
    uint32_t colours[LAYERS][COUNT];
    uint32_t seen[COUNT]; /* the client's picture for an eye */
    uint8_t mask[COUNT];
    vec4 found[COUNT]; /* and the daemon, likewise in rows */
};

/* ---- the daemon's side ---- */

/* Gives nodes.comp its input: the leaves of the nodes that were read back, without flags. */
static inline void give_planes(struct sides *sides, uint32_t slice)
{
    const uint32_t texels = sides->daemon.store.uniforms.padded_width * sides->daemon.store.uniforms.padded_height;
    uint32_t count, *planes = malloc(texels * 2 * sizeof(*planes));
    const uint32_t *nodes = fl_warp_nodes(sides->client, slice, &count);
    assert_true(nodes && count >= texels);
    for (uint32_t i = 0; i < 2 * texels; i++)
        planes[i] = nodes[i] & (i % 2 ? UINT32_MAX : ~1u);
    gpu_buffer_write(device, &sides->daemon.build.planes, 0, planes, texels * 2 * sizeof(*planes));
    free(planes);
}

/* Over its own leaves, or over those of the client. */
static inline void build_by_daemon(struct sides *sides, bool of_client)
{
    struct error error = {0};
    struct layers *daemon = &sides->daemon;
    struct quadtree_store *store = &daemon->store;
    const size_t bytes = quadtree_nodes_count(&store->uniforms) * sizeof(*daemon->nodes);
    expect_ok(
        gpu_buffer_upload(device, &store->uniform_buffer, &store->uniforms, sizeof(store->uniforms), &error) &&
            quadtree_nodes_begin(&daemon->build, store, &error),
        &error);
    enum tracer_progress progress = TRACER_MORE;
    while (progress == TRACER_MORE) {
        const uint32_t stage = daemon->build.stage; /* leaves and level 1 of each slice, then the other levels */
        if (of_client && stage < 2 * LAYERS && stage % 2 == 0) {
            give_planes(sides, stage / 2);
            daemon->build.stage++;
        }
        progress = quadtree_nodes_step(&daemon->build, store, &daemon->gpu, &error);
    }
    expect_ok(progress == TRACER_DONE && gpu_check(device, "nodes", &error), &error);
    free(daemon->nodes);
    daemon->nodes = malloc(bytes);
    gpu_buffer_read(device, &store->nodes, 0, daemon->nodes, bytes);
}

/* ---- the client's side ---- */

static inline uint32_t place_colour(uint32_t layer, uint32_t i, float w)
{
    const uint32_t blue = layer == 0 && w == 0 ? SKY_COLOUR : layer * LAYER_COLOUR;
    return i % WIDTH | i / WIDTH << 8 | blue << 16 | 0xff000000u;
}

/* Builds with the view, unit and bound of the store, to the bit. */
static inline void build_by_client(struct sides *sides)
{
    struct quadtree_uniforms *u = &sides->daemon.store.uniforms;
    struct fl_warp_error error = {0};
    struct fl_warp_key *key = &sides->key;
    *key = (struct fl_warp_key){.width = WIDTH,
                                .height = HEIGHT,
                                .camera.fov_y = FOV,
                                .unit = u->depths[0],
                                .radius = sides->radius,
                                .pixels = PIXELS,
                                .layer_count = LAYERS};
    const struct raster_camera face = quadtree_face_camera(u, 0);
    memcpy(key->camera.world_from_view, face.world_from_view, sizeof(face.world_from_view));
    for (uint32_t l = 0; l < LAYERS; l++) {
        for (uint32_t i = 0; i < COUNT; i++)
            sides->colours[l][i] = place_colour(l, i, sides->w[l][i]);
        key->layers[l] = (struct fl_warp_layer){sides->colours[l], sides->w[l], NULL};
    }
    u->bounds[0] = key->unit * PIXELS / (0.5f * (float)HEIGHT / tanf(0.5f * FOV) * sides->radius);
    u->bounds[3] = sides->radius / key->unit;
    sides->client = fl_warp_create(2, &error);
    if (!sides->client || !fl_warp_set_key(sides->client, key, &error))
        fail_msg("%s: %s", error.field, error.text);
}

/* ---- layers ---- */

static inline struct sides *sides_create(const struct scene *scene, float radius)
{
    struct error error = {0};
    struct scene_changes changes;
    struct sides *sides = calloc(1, sizeof(*sides));
    assert_non_null(sides);
    sides->radius = radius;
    sides->daemon.memory_before_bytes = device->memory_used_bytes;
    sides->daemon.store.device = device;
    gpu_scene_init(&sides->daemon.gpu, device);
    if (scene)
        expect_ok(gpu_scene_update(&sides->daemon.gpu, scene, NULL, &changes, NULL, &error), &error);
    return sides;
}

static inline void sides_destroy(struct sides *sides)
{
    fl_warp_destroy(sides->client);
    quadtree_layers_finish(&sides->drawing);
    layers_finish(&sides->daemon);
    free(sides);
}

static inline double focal(void)
{
    return 0.5 * HEIGHT / tan(0.5 * (double)FOV);
}

/* A wall and a floor, a board before them, waves, a hole that shows the environment, and leaves of a tree. */
static inline float front_w(uint32_t x, uint32_t y, uint64_t *seed)
{
    const double wall = 0.11 + 1e-4 * x - 2e-4 * y, floor_w = 0.0033 * y - 0.3, far = fmax(wall, floor_w);
    if (x >= 150 && x < 190 && y >= 20 && y < 60)
        return 0;
    if (x >= 40 && x < 101 && y >= 30 && y < 150)
        return (float)(0.45 + 8e-4 * x + 1e-4 * y);
    if (x >= 110 && x < 140 && y >= 60 && y < 120)
        return (float)(0.3 + 0.02 * sin(x * 0.3) * cos(y * 0.2));
    if (x >= 195 && x < 230 && y >= 60 && y < 100)
        return test_random(seed) & 1 ? (float)far : test_uniform(seed, 0.3f, 0.5f);
    return (float)far;
}

/* Behind the board lies what is beside it; behind all else nothing is known. */
static inline float behind_w(uint32_t x, uint32_t y)
{
    const double wall = 0.11 + 1e-4 * x - 2e-4 * y, floor_w = 0.0033 * y - 0.3;
    return x >= 40 && x < 101 && y >= 30 && y < 150 ? (float)fmax(wall, floor_w) : 0;
}

static inline struct sides *made_up(void)
{
    const struct layers_view view = {.width = WIDTH,
                                     .height = HEIGHT,
                                     .faces = 1,
                                     .layers = LAYERS,
                                     .focal = focal(),
                                     .near = 1, /* the unit */
                                     .far = 1000,
                                     .pixels = (double)PIXELS,
                                     .radius = (double)MADE_UP_RADIUS};
    struct error error = {0};
    struct sides *sides = sides_create(NULL, MADE_UP_RADIUS);
    struct quadtree_store *store = &sides->daemon.store;
    uint64_t seed = 41;
    store->uniforms = uniforms_of(&view);
    store->uniforms.depths[3] = 0.05f;
    store->uniforms.eye_world[3] = MADE_UP_RADIUS;
    expect_ok(gpu_texture_reserve_array(device, &store->visible, GL_RG32UI, store->uniforms.padded_width,
                                        store->uniforms.padded_height, LAYERS, &error),
              &error);
    for (uint32_t i = 0; i < COUNT; i++) {
        sides->w[0][i] = front_w(i % WIDTH, i / WIDTH, &seed);
        sides->w[1][i] = behind_w(i % WIDTH, i / WIDTH);
    }
    build_by_client(sides);
    return sides;
}

/* The bundled scenes are made beside the program of the tests. */
static inline void load_bundled(struct loaded_model *model, const char *name)
{
    char self[400], command[1024], path[512], folder[] = "/tmp/farlight-scenes-XXXXXX";
    struct error error = {0};
    const ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);
    assert_true(length > 0 && mkdtemp(folder));
    self[length] = '\0';
    *strrchr(self, '/') = '\0';
    snprintf(command, sizeof(command), "'%s/../tools/make_scenes' %s", self, folder);
    assert_int_equal(system(command), 0);
    snprintf(path, sizeof(path), "%s/%s", folder, name);
    expect_ok(load_model(model, path, &error), &error);
    snprintf(command, sizeof(command), "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}

/* Renders the carousel for the daemon, layer by layer, with nodes of its own; the client gets the w of its
 * leaves. */
static inline struct sides *rendered(const struct scene *scene)
{
    struct error error = {0};
    struct sides *sides = sides_create(scene, 0);
    struct layers *daemon = &sides->daemon;
    const struct gpu_scene *gpu = &daemon->gpu;
    struct frame_camera camera;
    frame_camera_auto(&camera, &usual_framing, gpu->lower_world, gpu->upper_world, (float)WIDTH / (float)HEIGHT);
    for (int i = 0; i < 3; i++)
        camera.world_from_view[4 * i + 3] = (gpu->lower_world[i] + gpu->upper_world[i]) / 2 +
                                            AWAY * gpu->diagonal * camera.world_from_view[4 * i + 2];
    sides->radius = RADIUS_SHARE * AWAY * gpu->diagonal;
    const struct quadtree_settings settings = {.layers = LAYERS,
                                               .faces = QUADTREE_FACES_VIEW,
                                               .hits = QUADTREE_HITS_PLANE,
                                               .pixels = PIXELS,
                                               .radius = sides->radius};
    /* There is a margin of one texel at the least. */
    struct trace_view view = {.fov_y = 2 * atanf(tanf(0.5f * FOV) * (float)(HEIGHT - 2) / (float)HEIGHT),
                              .width = WIDTH - 2,
                              .height = HEIGHT - 2};
    memcpy(view.world_from_view, camera.world_from_view, sizeof(view.world_from_view));
    expect_ok(quadtree_store_place(&daemon->store, &daemon->gpu, &view, &settings, &error) &&
                  quadtree_layers_begin(&sides->drawing, &daemon->store, &error),
              &error);
    gpu_scene_bind(&daemon->gpu);
    enum tracer_progress progress;
    do
        progress = quadtree_layers_step(&sides->drawing, &daemon->gpu, true, &error);
    while (progress == TRACER_MORE);
    expect_ok(progress == TRACER_DONE, &error);
    assert_true(daemon->store.uniforms.width == WIDTH && daemon->store.uniforms.height == HEIGHT);
    build_by_daemon(sides, false);
    for (uint32_t l = 0; l < LAYERS; l++)
        for (uint32_t i = 0; i < COUNT; i++)
            sides->w[l][i] = (float)tree_plane_of(node_at(daemon, l, 0, i % WIDTH, i / WIDTH)).w;
    build_by_client(sides);
    return sides;
}

#endif
