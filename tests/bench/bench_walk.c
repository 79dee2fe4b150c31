/* SPDX-License-Identifier: MIT */
/* A walk of which pictures come seldom and late: what is made of each key picture until the next one has come, by
 * bench_warps.h, beside true pictures of where the camera is by then. There is no link and no daemon: keys are of
 * the cameras that a viewer would have asked for, with the margin, the depths and the hidden layer that it asks
 * for, and have the age that they would have.
 *
 * Prints one JSON object: {"scene", "triangles", "device", "software", "width", "height", "seconds", "keys_per_s",
 * "round_trip_ms", "at_s": [of each picture], "age_ms": [since its key was asked for], "part": [of the walk, by
 * number], "methods": [{"name", "layers", "psnr_db": [of each picture], "unseen": [a share of it], "cpu_ns": [of
 * making it], "build_ns": [of what serves all pictures of its key]}]}. Exit status: 1 failed, 2 usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_camera.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_warps.h"

#include "viewer/plan.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] = "usage: bench walk --model FILE [options]\n"
                            "  --size WxH       default 1280x720\n"
                            "  --seconds N      of the walk; default 12\n"
                            "  --keys N         key pictures a second; default 5\n"
                            "  --round-trip MS  from asking for a key to having it; default 100\n"
                            "  --every N        of the pictures at 60 Hz each N-th is compared; default 11\n"
                            "  --true-samples N of the true pictures; default 4\n"
                            "  --pictures DIR   all pictures go there too, with what is not seen in red\n";

#define HERTZ 60u /* of the hand, and of the display */
#define NS_PER_STEP (UINT64_C(1000000000) / HERTZ)
/* As the viewer asks for it (client/viewer/viewer_local.c). */
#define MARGIN_SHARE 0.1f
#define HIDDEN_LAYERS 1u
#define LAYERS (1 + HIDDEN_LAYERS)
#define PARTS 4u

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    uint32_t width, height, seconds, keys, round_trip_ms, every, true_samples;
    const char *pictures;
    struct viewer_camera *path;  /* of each step */
    struct viewer_camera *asked; /* of each key */
    struct warp_view view;       /* its layers point to .. */
    uint32_t *colours[LAYERS];
    float *w[LAYERS];
    uint32_t *truth;
    struct warp_picture picture;
    json_t *at_s, *age_ms, *part, *psnr_db[WARP_METHODS], *unseen[WARP_METHODS], *cpu_ns[WARP_METHODS],
        *build_ns[WARP_METHODS];
};

static uint32_t steps_of(const struct bench *bench)
{
    return bench->seconds * HERTZ;
}

/* ---- the walk ---- */

/* What the hand of bench_warp.py does in a step, which is an event of the viewer (client/viewer/input.c). */
#define STEP_SPEED (1.0 / 3)

static uint32_t part_of(const struct bench *bench, uint32_t step)
{
    return step * PARTS / steps_of(bench);
}

/* Where the camera is at each step, and which one is asked for with each key: where it will be when that comes. */
static void walk(struct bench *bench)
{
    struct plan_motion motion = {0};
    struct viewer_camera camera = bench_camera_first(&bench->scene);
    for (uint32_t step = 0; step < steps_of(bench); step++) {
        const uint64_t now_ns = (step + 1) * NS_PER_STEP;
        if (step > 0)
            bench_camera_move(&camera, part_of(bench, step), STEP_SPEED);
        bench->path[step] = camera;
        plan_motion_add(&motion, &camera, now_ns);
        struct viewer_camera *asked = &bench->asked[step * bench->keys / HERTZ];
        if (step % (HERTZ / bench->keys) == 0) {
            *asked = camera;
            plan_motion_predict(&motion, now_ns, bench->round_trip_ms * UINT64_C(1000000), asked);
        }
    }
}

/* ---- rendered pictures ---- */

static struct frame_camera camera_of(const struct viewer_camera *from, float share)
{
    struct frame_camera camera = {.fov_y = (float)(2 * atan(tan(from->fov_y / 2) * (double)share))};
    camera_pose(from, camera.world_from_view);
    return camera;
}

static bool render(struct bench *bench, const struct frame_request *request, struct frame_result *result,
                   struct error *error)
{
    if (!frame_begin(bench->renderer, bench->scene.loaded.scene, NULL, request, error))
        return false;
    enum frame_progress progress;
    while ((progress = frame_step(bench->renderer, result, error)) == FRAME_MORE)
        continue;
    return progress == FRAME_DONE;
}

static bool render_truth(struct bench *bench, uint32_t step, struct error *error)
{
    const struct frame_request request = {.width = bench->width,
                                          .height = bench->height,
                                          .samples = bench->true_samples,
                                          .integrator = INTEGRATOR_RAYCAST,
                                          .layer_opacity = 1,
                                          .camera = camera_of(&bench->path[step], 1),
                                          .tracer = TRACER_BVH};
    struct frame_result result = {0};
    if (!render(bench, &request, &result, error))
        return false;
    memcpy(bench->truth, result.pixels, (size_t)bench->width * bench->height * sizeof(*bench->truth));
    frame_result_finish(&result);
    return true;
}

static bool render_layer(struct bench *bench, uint32_t layer, struct error *error)
{
    const struct warp_view *view = &bench->view;
    const uint32_t count = view->key_width * view->key_height;
    const struct frame_request request = {.width = view->key_width,
                                          .height = view->key_height,
                                          .samples = 1,
                                          .integrator = INTEGRATOR_RAYCAST,
                                          .layer_opacity = 1,
                                          .camera = view->from,
                                          .tracer = TRACER_BVH,
                                          .attachments = 1u << ATTACHMENT_DEPTH,
                                          .hidden_layer = layer,
                                          .hidden_radius = layer > 0 ? view->radius : 0};
    struct frame_result result = {0};
    if (!render(bench, &request, &result, error))
        return false;
    const float *depths = (const float *)(const void *)frame_result_attachment(&result, ATTACHMENT_DEPTH);
    memcpy(bench->colours[layer], result.pixels, count * sizeof(*bench->colours[layer]));
    for (uint32_t i = 0; i < count; i++)
        bench->w[layer][i] = depths[i] > 0 ? 1 / depths[i] : 0;
    frame_result_finish(&result);
    return true;
}

static bool render_key(struct bench *bench, uint32_t key, struct error *error)
{
    const struct viewer_camera *camera = &bench->asked[key];
    bench->view.from = camera_of(camera, (float)bench->view.key_height / (float)bench->height);
    bench->view.radius = (float)(PLAN_RADIUS_SHARE * camera_distance(camera));
    for (uint32_t layer = 0; layer < LAYERS; layer++)
        if (!render_layer(bench, layer, error))
            return false;
    return true;
}

/* ---- what is made ---- */

static void write_picture(const struct bench *bench, uint32_t step, const char *name, const uint32_t *colours,
                          const uint8_t *seen)
{
    char path[512];
    snprintf(path, sizeof(path), "%s/%04u-%s.ppm", bench->pictures, step, name);
    if (!warp_write(path, bench->width, bench->height, colours, seen))
        fprintf(stderr, "bench walk: %s cannot be written\n", path);
}

static void note(struct bench *bench, uint32_t step, enum warp_method method)
{
    const struct warp_picture *picture = &bench->picture;
    const uint32_t count = bench->width * bench->height;
    uint32_t unseen = 0;
    for (uint32_t i = 0; i < count; i++)
        unseen += !picture->seen[i];
    json_array_append_new(bench->psnr_db[method],
                          bench_decibels(warp_psnr_db(picture->colours, bench->truth, NULL, count)));
    json_array_append_new(bench->unseen[method], json_real((double)unseen / count));
    json_array_append_new(bench->cpu_ns[method], json_integer((json_int_t)picture->processor_ns));
    json_array_append_new(bench->build_ns[method], json_integer((json_int_t)picture->build_ns));
    if (bench->pictures)
        write_picture(bench, step, warp_method_names[method], picture->colours, picture->seen);
}

static bool compare(struct bench *bench, uint32_t step, struct error *error)
{
    if (!render_truth(bench, step, error))
        return false;
    bench->view.to = camera_of(&bench->path[step], 1);
    if (bench->pictures)
        write_picture(bench, step, "true", bench->truth, NULL);
    for (enum warp_method method = 0; method < WARP_METHODS; method++) {
        if (!warp_picture_make(&bench->picture, &bench->view, method))
            return error_set(error, ERROR_INVALID, "--model", "no picture can be made of it");
        note(bench, step, method);
    }
    return true;
}

/* The newest key that has come by a step; the first one is there from the beginning. */
static uint32_t key_at(const struct bench *bench, uint32_t step)
{
    const uint32_t late = bench->round_trip_ms * HERTZ / 1000;
    return step < late ? 0 : (step - late) * bench->keys / HERTZ;
}

static bool compare_at(struct bench *bench, uint32_t step, uint32_t key, struct error *error)
{
    const uint32_t asked = key * (HERTZ / bench->keys);
    json_array_append_new(bench->at_s, json_real((double)step / HERTZ));
    json_array_append_new(bench->age_ms, json_real(1e3 * (step - asked) / HERTZ));
    json_array_append_new(bench->part, json_integer(part_of(bench, step)));
    return compare(bench, step, error);
}

static bool run(struct bench *bench, struct error *error)
{
    uint32_t shown = UINT32_MAX;
    walk(bench);
    for (uint32_t step = bench->every; step < steps_of(bench); step += bench->every) {
        const uint32_t key = key_at(bench, step);
        if (key != shown && !render_key(bench, key, error))
            return false;
        shown = key;
        if (!compare_at(bench, step, key, error))
            return false;
    }
    return gpu_check(bench->device, "bench", error);
}

/* ---- in and out ---- */

static bool reserve(struct bench *bench, struct error *error)
{
    struct warp_view *view = &bench->view;
    *view = (struct warp_view){.width = bench->width, .height = bench->height, .layer_count = LAYERS};
    view->key_width = bench->width + 2 * (uint32_t)(MARGIN_SHARE * (float)bench->width);
    view->key_height = bench->height + 2 * (uint32_t)(MARGIN_SHARE * (float)bench->height);
    const uint32_t count = view->key_width * view->key_height;
    bool done = warp_picture_init(&bench->picture, bench->width, bench->height, count);
    for (uint32_t layer = 0; layer < LAYERS; layer++) {
        bench->colours[layer] = calloc(count, sizeof(*bench->colours[layer]));
        bench->w[layer] = calloc(count, sizeof(*bench->w[layer]));
        view->layers[layer] = (struct warp_layer){bench->colours[layer], bench->w[layer], NULL};
        done = done && bench->colours[layer] && bench->w[layer];
    }
    bench->truth = calloc((size_t)bench->width * bench->height, sizeof(*bench->truth));
    bench->path = calloc(steps_of(bench), sizeof(*bench->path));
    bench->asked = calloc((size_t)bench->seconds * bench->keys, sizeof(*bench->asked));
    if (done && bench->truth && bench->path && bench->asked)
        return true;
    return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the pictures");
}

static bool prepare(struct bench *bench, struct error *error)
{
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    bench->at_s = json_array();
    bench->age_ms = json_array();
    bench->part = json_array();
    for (enum warp_method method = 0; method < WARP_METHODS; method++) {
        bench->psnr_db[method] = json_array();
        bench->unseen[method] = json_array();
        bench->cpu_ns[method] = json_array();
        bench->build_ns[method] = json_array();
    }
    if (!reserve(bench, error) || !bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error))
        return false;
    bench->shared = frame_scene_create(bench->device, error);
    bench->renderer = bench->shared ? frame_renderer_create(bench->shared, error) : NULL;
    return bench->renderer != NULL;
}

static bool print(const struct bench *bench)
{
    json_t *methods = json_array();
    for (enum warp_method method = 0; method < WARP_METHODS; method++) {
        const bool takes_first = method <= WARP_ITERATIVE;
        json_array_append_new(methods,
                              json_pack("{s:s, s:i, s:O, s:O, s:O, s:O}", "name", warp_method_names[method],
                                        "layers", takes_first ? 1 : (int)LAYERS, "psnr_db", bench->psnr_db[method],
                                        "unseen", bench->unseen[method], "cpu_ns", bench->cpu_ns[method],
                                        "build_ns", bench->build_ns[method]));
    }
    json_t *measured = json_pack("{s:i, s:i, s:i, s:i, s:i, s:O, s:O, s:O, s:o}", "width", (int)bench->width,
                                 "height", (int)bench->height, "seconds", (int)bench->seconds, "keys_per_s",
                                 (int)bench->keys, "round_trip_ms", (int)bench->round_trip_ms, "at_s", bench->at_s,
                                 "age_ms", bench->age_ms, "part", bench->part, "methods", methods);
    return bench_scene_print(&bench->scene, &bench->scene_options, bench->device, measured);
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    switch (option) {
    case 'p':
        bench->pictures = text;
        return true;
    case 's':
        return bench_parse_size(text, &bench->width, &bench->height);
    case 'S':
        return bench_parse_number(text, 1, 3600, &bench->seconds);
    case 'k':
        return bench_parse_number(text, 1, HERTZ, &bench->keys) && HERTZ % bench->keys == 0;
    case 'R':
        return bench_parse_number(text, 0, 1000, &bench->round_trip_ms);
    case 'n':
        return bench_parse_number(text, 1, HERTZ, &bench->every);
    case 't':
        return bench_parse_number(text, 1, 64, &bench->true_samples);
    default:
        return bench_parse_scene(option, text, &bench->scene_options);
    }
}

static bool parse(struct bench *bench, int argc, char **argv)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'},        {"size", 1, NULL, 's'},       {"seconds", 1, NULL, 'S'},
        {"keys", 1, NULL, 'k'},         {"round-trip", 1, NULL, 'R'}, {"every", 1, NULL, 'n'},
        {"true-samples", 1, NULL, 't'}, {"pictures", 1, NULL, 'p'},   {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.width = 1280,
                            .height = 720,
                            .seconds = 12,
                            .keys = 5,
                            .round_trip_ms = 100,
                            .every = 11,
                            .true_samples = 4};
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    return bench->scene_options.model != NULL && optind == argc;
}

static void finish(struct bench *bench)
{
    json_decref(bench->at_s);
    json_decref(bench->age_ms);
    json_decref(bench->part);
    for (enum warp_method method = 0; method < WARP_METHODS; method++) {
        json_decref(bench->psnr_db[method]);
        json_decref(bench->unseen[method]);
        json_decref(bench->cpu_ns[method]);
        json_decref(bench->build_ns[method]);
    }
    for (uint32_t layer = 0; layer < LAYERS; layer++) {
        free(bench->colours[layer]);
        free(bench->w[layer]);
    }
    free(bench->truth);
    free(bench->path);
    free(bench->asked);
    warp_picture_finish(&bench->picture);
    frame_renderer_destroy(bench->renderer);
    frame_scene_destroy(bench->shared);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

BENCH_ON_DEVICE(walk, prepare(&bench, &error) && run(&bench, &error))
