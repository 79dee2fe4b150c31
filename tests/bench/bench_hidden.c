/* SPDX-License-Identifier: MIT */
/* What a client that makes its own views costs the daemon beside a picture, and what it gains: the margin, the
 * depths, and a picture of what is hidden, whole and at half the size in each direction. Prints one JSON object:
 * {"scene", "triangles", "device", "software", "width", "height", "costs": [{"name", "cpu_ns"}], "moves":
 * [{"name", "views": [{"name", "psnr_db", "unseen"}]}]}. Times are of the processor, all threads of the process,
 * one a run; the contenders take turns, and each run is of another camera, so that nothing is kept. Views are made
 * by client/warp from raycast pictures without a margin. Exit status: 1 failed, 2 usage. */
#include "tests/bench/bench.h"
#include "encode/depth.h"
#include "encode/encoder.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_warps.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] = "usage: bench hidden --model FILE | --family TRIANGLES [options]\n"
                            "  --size WxH      multiples of 8; default 1280x720\n"
                            "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]\n"
                            "  --runs N        after one warm-up; default 5, at most 64\n";

#define MARGIN 0.1f
#define RADIUS 0.15f
#define PIXELS 0.25f
#define STEP_M 0.001f /* between the cameras of two runs */

struct contender {
    const char *name;
    bool margin, depth;
    uint32_t hidden_layer, divisor;
};

static const struct contender contenders[] = {
    {"picture", false, false, 0, 1},
    {"with depth", false, true, 0, 1},
    {"with margin and depth", true, true, 0, 1},
    {"hidden", true, true, 1, 1},
    {"hidden, half", true, true, 1, 2},
};
#define CONTENDERS (sizeof(contenders) / sizeof(contenders[0]))

static const float moves[][3] = {{0.065f, 0.0f, 0.0f}, {0.15f, 0.0f, 0.05f}};
#define MOVES (sizeof(moves) / sizeof(moves[0]))

#define WITH_MARGIN 2u /* of them */

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    uint32_t width, height, runs;
    struct bench_runs costs[CONTENDERS], coding; /* of the depths with a margin */
};

/* ---- pictures ---- */

static void add_margin(struct frame_request *request)
{
    const uint32_t across = (uint32_t)(MARGIN * (float)request->width);
    const uint32_t down = (uint32_t)(MARGIN * (float)request->height);
    const float growth = (float)(request->height + 2 * down) / (float)request->height;
    request->camera.fov_y = 2.0f * atanf(growth * tanf(request->camera.fov_y / 2.0f));
    request->width += 2 * across;
    request->height += 2 * down;
}

static bool render(struct bench *bench, const struct contender *what, const struct frame_camera *camera,
                   struct frame_result *result, struct error *error)
{
    struct frame_request request = {.width = bench->width / what->divisor,
                                    .height = bench->height / what->divisor,
                                    .samples = 1,
                                    .depth = 1,
                                    .camera = *camera,
                                    .tracer = TRACER_BVH,
                                    .integrator = INTEGRATOR_RAYCAST,
                                    .hidden_layer = what->hidden_layer,
                                    .hidden_radius = RADIUS,
                                    .attachments = what->depth ? 1u << ATTACHMENT_DEPTH : 0};
    if (what->margin)
        add_margin(&request);
    if (!frame_begin(bench->renderer, bench->scene.loaded.scene, NULL, &request, error))
        return false;
    enum frame_progress progress;
    while ((progress = frame_step(bench->renderer, result, error)) == FRAME_MORE)
        continue;
    return progress == FRAME_DONE;
}

/* As they travel. */
static bool code_depths(struct bench *bench, const struct frame_result *result, const struct frame_camera *camera,
                        bool is_noted, struct error *error)
{
    const struct depth_picture depths = {
        .depths = (const float *)(const void *)frame_result_attachment(result, ATTACHMENT_DEPTH),
        .width = result->width,
        .height = result->height,
        .fov_y = camera->fov_y,
        .pixels = PIXELS,
        .radius = RADIUS};
    const uint64_t begin_ns = bench_processor_ns();
    uint16_t *rounded = NULL;
    uint8_t *encoded = NULL;
    size_t bytes = 0;
    float step;
    bool good = depth_round(&depths, &rounded, &step, error);
    if (good && rounded) {
        const struct picture picture = {.width = result->width,
                                        .height = result->height,
                                        .bytes_per_pixel = sizeof(*rounded),
                                        .pixels = (const uint8_t *)rounded};
        good = encoder_encode(ENCODING_PREDICTED, &picture, 1, &encoded, &bytes, error);
    }
    if (is_noted)
        bench_add(&bench->coding, bench_processor_ns() - begin_ns);
    free(rounded);
    free(encoded);
    return good;
}

static bool measure_costs(struct bench *bench, struct error *error)
{
    for (unsigned run = 0; run <= bench->runs; run++)
        for (size_t i = 0; i < CONTENDERS; i++) {
            const float way[3] = {STEP_M * (float)(run * CONTENDERS + i), 0.0f, 0.0f};
            const struct frame_camera camera = bench_moved(&bench->scene.camera, way);
            struct frame_result result = {0};
            const uint64_t begin_ns = bench_processor_ns();
            if (!render(bench, &contenders[i], &camera, &result, error))
                return false;
            if (run > 0)
                bench_add(&bench->costs[i], bench_processor_ns() - begin_ns);
            const bool good = i != WITH_MARGIN || code_depths(bench, &result, &camera, run > 0, error);
            frame_result_finish(&result);
            if (!good)
                return false;
        }
    return true;
}

static json_t *costs_json(const struct bench *bench)
{
    json_t *costs = json_array();
    for (size_t i = 0; i < CONTENDERS; i++)
        json_array_append_new(costs, json_pack("{s:s, s:o}", "name", contenders[i].name, "cpu_ns",
                                               bench_times_json(&bench->costs[i])));
    json_array_append_new(
        costs, json_pack("{s:s, s:o}", "name", "coding of depths", "cpu_ns", bench_times_json(&bench->coding)));
    return costs;
}

/* ---- views ---- */

struct texels {
    uint32_t *colours;
    float *w;
};

/* Each pixel stands for those that it covers. */
static bool take(struct bench *bench, const struct contender *what, const struct frame_camera *camera,
                 struct texels *to, struct error *error)
{
    struct frame_result result = {0};
    if (!render(bench, what, camera, &result, error))
        return false;
    const uint32_t *colours = (const uint32_t *)(const void *)result.pixels;
    const float *depths = (const float *)(const void *)frame_result_attachment(&result, ATTACHMENT_DEPTH);
    for (uint32_t y = 0; y < bench->height; y++)
        for (uint32_t x = 0; x < bench->width; x++) {
            const size_t at = (size_t)y * bench->width + x;
            const size_t from = (size_t)(y / what->divisor) * result.width + x / what->divisor;
            to->colours[at] = colours[from];
            to->w[at] = depths && depths[from] > 0.0f ? 1.0f / depths[from] : 0.0f;
        }
    frame_result_finish(&result);
    return true;
}

static void note_view(const struct bench *bench, json_t *views, const char *name,
                      const struct warp_picture *picture, const struct texels *truth)
{
    const uint32_t count = bench->width * bench->height;
    uint32_t unseen = 0;
    for (uint32_t i = 0; i < count; i++)
        unseen += !picture->seen[i];
    json_array_append_new(views,
                          json_pack("{s:s, s:o, s:f}", "name", name, "psnr_db",
                                    bench_decibels(warp_psnr_db(picture->colours, truth->colours, NULL, count)),
                                    "unseen", (double)unseen / count));
}

static const struct contender kinds[] = {
    {"no hidden layer", false, true, 0, 1}, {"hidden", false, true, 1, 1}, {"hidden, half", false, true, 1, 2}};
#define KINDS (sizeof(kinds) / sizeof(kinds[0]))

static bool make_views(struct bench *bench, const float way[3], struct texels texels[KINDS + 1],
                       struct warp_picture *picture, json_t *views, struct error *error)
{
    const struct frame_camera to = bench_moved(&bench->scene.camera, way);
    if (!take(bench, &kinds[0], &to, &texels[KINDS], error))
        return false;
    for (size_t i = 0; i < KINDS; i++) {
        const struct warp_view view = {
            .width = bench->width,
            .height = bench->height,
            .from = bench->scene.camera,
            .to = to,
            .layer_count = i > 0 ? 2 : 1,
            .layers = {{texels[0].colours, texels[0].w, NULL}, {texels[i].colours, texels[i].w, NULL}},
        };
        if (!warp_picture_make(picture, &view, WARP_QUADTREE))
            return error_set(error, ERROR_INVALID, "moves", "no view can be made of it");
        note_view(bench, views, kinds[i].name, picture, &texels[KINDS]);
    }
    return true;
}

static bool measure_views(struct bench *bench, json_t *told, struct error *error)
{
    const size_t count = (size_t)bench->width * bench->height;
    struct texels texels[KINDS + 1] = {{0}};
    struct warp_picture picture = {0};
    bool good = warp_picture_init(&picture, bench->width, bench->height, (uint32_t)count);
    for (size_t i = 0; i <= KINDS; i++) {
        texels[i] = (struct texels){calloc(count, sizeof(uint32_t)), calloc(count, sizeof(float))};
        good &= texels[i].colours && texels[i].w;
    }
    good = good || error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the pictures");
    for (size_t i = 0; good && i < KINDS; i++)
        good = take(bench, &kinds[i], &bench->scene.camera, &texels[i], error);
    for (size_t i = 0; good && i < MOVES; i++) {
        char name[96];
        json_t *views = json_array();
        good = make_views(bench, moves[i], texels, &picture, views, error);
        snprintf(name, sizeof(name), "%g,%g,%g", (double)moves[i][0], (double)moves[i][1], (double)moves[i][2]);
        json_array_append_new(told, json_pack("{s:s, s:o}", "name", name, "views", views));
    }
    for (size_t i = 0; i <= KINDS; i++) {
        free(texels[i].colours);
        free(texels[i].w);
    }
    warp_picture_finish(&picture);
    return good;
}

/* ---- in and out ---- */

static bool parse_option(struct bench *bench, int option, const char *text)
{
    switch (option) {
    case 's':
        return bench_parse_size(text, &bench->width, &bench->height);
    case 'r':
        return bench_parse_number(text, 1, BENCH_RUNS_MAX, &bench->runs);
    default:
        return bench_parse_scene(option, text, &bench->scene_options);
    }
}

static bool parse(struct bench *bench, int argc, char **argv)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'}, {"family", 1, NULL, 'f'},  {"size", 1, NULL, 's'},
        {"eye", 1, NULL, 'e'},   {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},   {"runs", 1, NULL, 'r'},    {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.width = 1280, .height = 720, .runs = 5};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    return (bench->scene_options.model != NULL) != (bench->scene_options.family_triangles > 0) && optind == argc;
}

static bool prepare(struct bench *bench, struct error *error)
{
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    if (!bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error))
        return false;
    bench->shared = frame_scene_create(bench->device, error);
    bench->renderer = bench->shared ? frame_renderer_create(bench->shared, error) : NULL;
    return bench->renderer;
}

BENCH(hidden)
{
    struct bench bench;
    struct error error = {0};
    if (!parse(&bench, argc, argv)) {
        fputs(usage, stderr);
        return 2;
    }
    json_t *told = json_array();
    bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    bool ok = bench.device && prepare(&bench, &error) && measure_costs(&bench, &error) &&
              measure_views(&bench, told, &error) && gpu_check(bench.device, "bench", &error);
    if (!ok)
        fprintf(stderr, "bench hidden: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    ok = ok && bench_scene_print(&bench.scene, &bench.scene_options, bench.device,
                                 json_pack("{s:i, s:i, s:o, s:O}", "width", (int)bench.width, "height",
                                           (int)bench.height, "costs", costs_json(&bench), "moves", told));
    json_decref(told);
    if (!bench.device)
        return 1;
    frame_renderer_destroy(bench.renderer);
    frame_scene_destroy(bench.shared);
    bench_scene_finish(&bench.scene);
    gpu_device_destroy(bench.device);
    return ok ? 0 : 1;
}
