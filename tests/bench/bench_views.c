/* SPDX-License-Identifier: MIT */
/* Pictures of other eyes, made of one picture with depths: by the tracer `quadtree` and by bench_warps.h, beside
 * true pictures. Prints one JSON object: {"scene", "triangles", "device", "software", "width", "height", "key_ns",
 * "moves":
 * [{"name", "true_ns", "sticking": {"share", "correlation", "bins": [{"pixels", "rms"}]}, "methods": [{"name",
 * "layers", "psnr_db", "seen_psnr_db", "unseen", "cpu_ns", "build_ns"}]}]}. `sticking`: of the picture by
 * client/warp how much of it follows the eye, how its pixels' shares and their errors correlate, and of shares
 * from 0 to 1 in BINS steps how many of the seen pixels have them and their error in levels of 255. `unseen` is a
 * share of the pixels; times are of the processor, all threads of the process, one a run: key_ns and true_ns of a
 * whole picture by `bvh`, cpu_ns of making a picture of it, build_ns of the structure that serves all pictures of
 * a key view, where there is one. Exit status: 1 failed, 2 usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_warps.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] = "usage: bench views --model FILE | --family TRIANGLES [options]\n"
                            "  --move R,U,A    metres that the eye moves right, up and ahead; may be repeated;\n"
                            "                  default 0.065,0,0 and 0.15,0,0.05\n"
                            "  --size WxH      multiples of 8; default 1280x720\n"
                            "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]\n"
                            "  --pictures DIR  all pictures go there too, with what is not seen in red\n"
                            "  --runs N        after one warm-up; default 3, at most 64\n";

#define MOVES_MAX 8u
#define RADIUS 0.15f /* metres, of the bound: the usual one */
#define BINS 5u

struct move {
    float way[3]; /* right, up, ahead */
    struct bench_runs true_times;
    uint32_t *truth;
    json_t *methods, *sticking;
};

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    uint32_t width, height, runs, move_count;
    const char *pictures;
    struct bench_runs key_times;
    uint32_t *key;
    float *w;
    uint8_t *sticking;
    struct move moves[MOVES_MAX];
    struct warp_picture picture;
};

/* ---- true pictures ---- */

static bool render(struct bench *bench, const struct frame_camera *camera, struct frame_result *result,
                   struct error *error)
{
    const struct frame_request request = {.width = bench->width,
                                          .height = bench->height,
                                          .samples = 1,
                                          .depth = 4,
                                          .camera = *camera,
                                          .tracer = TRACER_BVH,
                                          .attachments = 1u << ATTACHMENT_DEPTH | 1u << ATTACHMENT_STICKING};
    if (!frame_begin(bench->renderer, bench->scene.loaded.scene, NULL, &request, error))
        return false;
    enum frame_progress progress;
    while ((progress = frame_step(bench->renderer, result, error)) == FRAME_MORE)
        continue;
    return progress == FRAME_DONE;
}

/* Colours, and w and what sticks where that is asked for; the first run is a warm-up. */
static bool render_runs(struct bench *bench, const struct frame_camera *camera, uint32_t *colours, float *w,
                        uint8_t *sticking, struct bench_runs *times, struct error *error)
{
    const uint32_t count = bench->width * bench->height;
    for (unsigned run = 0; run <= bench->runs; run++) {
        struct frame_result result = {0};
        const uint64_t start_ns = bench_processor_ns();
        if (!render(bench, camera, &result, error))
            return false;
        if (run > 0)
            bench_add(times, bench_processor_ns() - start_ns);
        memcpy(colours, result.pixels, count * sizeof(*colours));
        if (w)
            memcpy(w, frame_result_attachment(&result, ATTACHMENT_DEPTH), count * sizeof(*w));
        for (uint32_t i = 0; sticking && i < count; i++)
            sticking[i] = frame_result_attachment(&result, ATTACHMENT_STICKING)[4 * (size_t)i];
        frame_result_finish(&result);
    }
    for (uint32_t i = 0; w && i < count; i++)
        w[i] = w[i] > 0 ? 1 / w[i] : 0;
    return true;
}

static bool prepare(struct bench *bench, struct error *error)
{
    const size_t count = (size_t)bench->width * bench->height;
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    if (!bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error))
        return false;
    bench->shared = frame_scene_create(bench->device, error);
    bench->renderer = bench->shared ? frame_renderer_create(bench->shared, error) : NULL;
    bench->key = calloc(count, sizeof(*bench->key));
    bench->w = calloc(count, sizeof(*bench->w));
    bench->sticking = calloc(count, sizeof(*bench->sticking));
    if (!bench->key || !bench->w || !bench->sticking ||
        !warp_picture_init(&bench->picture, bench->width, bench->height, (uint32_t)count))
        return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the pictures");
    return bench->renderer && render_runs(bench, &bench->scene.camera, bench->key, bench->w, bench->sticking,
                                          &bench->key_times, error);
}

/* ---- what is made ---- */

static void write_picture(const struct bench *bench, uint32_t move, const char *name, const uint32_t *colours,
                          const uint8_t *seen)
{
    char path[512];
    snprintf(path, sizeof(path), "%s/%u-%s.ppm", bench->pictures, move, name);
    if (!warp_write(path, bench->width, bench->height, colours, seen))
        fprintf(stderr, "bench views: %s cannot be written\n", path);
}

/* Of a pixel: the sum of the channels' squared differences. */
static double squares_of(uint32_t a, uint32_t b)
{
    double sum = 0;
    for (int shift = 0; shift < 24; shift += 8) {
        const double difference = (double)(a >> shift & 255) - (double)(b >> shift & 255);
        sum += difference * difference;
    }
    return sum;
}

static json_t *sticking_json(const struct bench *bench, const struct move *move)
{
    const struct warp_picture *picture = &bench->picture;
    double counts[BINS] = {0}, squares[BINS] = {0}, n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (uint32_t i = 0; i < bench->width * bench->height; i++) {
        const double share = picture->sticking[i] / 255.0, error = squares_of(picture->colours[i], move->truth[i]);
        const uint32_t bin = (uint32_t)(share * (BINS - 1e-9));
        if (!picture->seen[i])
            continue;
        counts[bin]++;
        squares[bin] += error;
        n++;
        x += share;
        y += sqrt(error);
        xx += share * share;
        xy += share * sqrt(error);
        yy += error;
    }
    json_t *bins = json_array();
    for (uint32_t bin = 0; bin < BINS; bin++)
        json_array_append_new(bins, json_pack("{s:f, s:f}", "pixels", counts[bin] / n, "rms",
                                              counts[bin] > 0 ? sqrt(squares[bin] / (3 * counts[bin])) : 0));
    const double spread = sqrt((n * xx - x * x) * (n * yy - y * y));
    return json_pack("{s:f, s:f, s:o}", "share", x / n, "correlation", spread > 0 ? (n * xy - x * y) / spread : 0,
                     "bins", bins);
}

/* bench->picture beside the truth. */
static void note(const struct bench *bench, struct move *move, enum warp_method method,
                 const struct bench_runs *times, const struct bench_runs *builds)
{
    const char *name = warp_method_names[method];
    const struct warp_picture *picture = &bench->picture;
    const uint32_t count = bench->width * bench->height;
    uint32_t unseen = 0;
    for (uint32_t i = 0; i < count; i++)
        unseen += !picture->seen[i];
    json_array_append_new(
        move->methods,
        json_pack("{s:s, s:i, s:o, s:o, s:f, s:o, s:o}", "name", name, "layers", 1, "psnr_db",
                  bench_decibels(warp_psnr_db(picture->colours, move->truth, NULL, count)), "seen_psnr_db",
                  bench_decibels(warp_psnr_db(picture->colours, move->truth, picture->seen, count)), "unseen",
                  (double)unseen / count, "cpu_ns", bench_times_json(times), "build_ns",
                  bench_times_json(builds)));
    if (bench->pictures)
        write_picture(bench, (uint32_t)(move - bench->moves), name, picture->colours, picture->seen);
}

static bool warp(struct bench *bench, struct move *move, struct error *error)
{
    const struct warp_view view = {.width = bench->width,
                                   .height = bench->height,
                                   .key_width = bench->width,
                                   .key_height = bench->height,
                                   .radius = RADIUS,
                                   .from = bench->scene.camera,
                                   .to = bench_moved(&bench->scene.camera, move->way),
                                   .layer_count = 1,
                                   .layers = {{bench->key, bench->w, bench->sticking}}};
    for (enum warp_method method = 0; method < WARP_METHODS; method++) {
        struct bench_runs times = {0}, builds = {0};
        for (unsigned run = 0; run <= bench->runs; run++) {
            if (!warp_picture_make(&bench->picture, &view, method))
                return error_set(error, ERROR_INVALID, "--move", "no picture can be made of it");
            if (run > 0)
                bench_add(&times, bench->picture.processor_ns);
            if (run > 0 && bench->picture.build_ns > 0)
                bench_add(&builds, bench->picture.build_ns);
        }
        note(bench, move, method, &times, &builds);
        if (method == WARP_QUADTREE)
            move->sticking = sticking_json(bench, move);
    }
    return true;
}

static bool run(struct bench *bench, struct error *error)
{
    for (uint32_t i = 0; i < bench->move_count; i++) {
        struct move *move = &bench->moves[i];
        const struct frame_camera to = bench_moved(&bench->scene.camera, move->way);
        move->methods = json_array();
        move->truth = calloc((size_t)bench->width * bench->height, sizeof(*move->truth));
        if (!move->truth)
            return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the pictures");
        if (!render_runs(bench, &to, move->truth, NULL, NULL, &move->true_times, error))
            return false;
        if (bench->pictures)
            write_picture(bench, i, "true", move->truth, NULL);
        if (!warp(bench, move, error))
            return false;
    }
    return gpu_check(bench->device, "bench", error);
}

/* ---- in and out ---- */

static json_t *move_json(const struct move *move)
{
    char name[96];
    snprintf(name, sizeof(name), "%g,%g,%g", (double)move->way[0], (double)move->way[1], (double)move->way[2]);
    return json_pack("{s:s, s:o, s:O, s:O}", "name", name, "true_ns", bench_times_json(&move->true_times),
                     "sticking", move->sticking, "methods", move->methods);
}

static bool print(const struct bench *bench)
{
    json_t *moves = json_array();
    for (uint32_t i = 0; i < bench->move_count; i++)
        json_array_append_new(moves, move_json(&bench->moves[i]));
    json_t *measured = json_pack("{s:i, s:i, s:o, s:o}", "width", (int)bench->width, "height", (int)bench->height,
                                 "key_ns", bench_times_json(&bench->key_times), "moves", moves);
    return bench_scene_print(&bench->scene, &bench->scene_options, bench->device, measured);
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    switch (option) {
    case 'M':
        return bench->move_count < MOVES_MAX && bench_parse_vector(text, bench->moves[bench->move_count++].way);
    case 'p':
        bench->pictures = text;
        return true;
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
        {"model", 1, NULL, 'm'}, {"family", 1, NULL, 'f'}, {"move", 1, NULL, 'M'},    {"pictures", 1, NULL, 'p'},
        {"size", 1, NULL, 's'},  {"eye", 1, NULL, 'e'},    {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},   {"runs", 1, NULL, 'r'},   {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.width = 1280, .height = 720, .runs = 3};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    if (bench->move_count == 0) {
        bench->move_count = 2;
        bench->moves[0].way[0] = 0.065f;
        bench->moves[1].way[0] = 0.15f;
        bench->moves[1].way[2] = 0.05f;
    }
    return (bench->scene_options.model != NULL) != (bench->scene_options.family_triangles > 0) && optind == argc;
}

static void finish(struct bench *bench)
{
    for (uint32_t i = 0; i < bench->move_count; i++) {
        json_decref(bench->moves[i].methods);
        json_decref(bench->moves[i].sticking);
        free(bench->moves[i].truth);
    }
    warp_picture_finish(&bench->picture);
    free(bench->key);
    free(bench->w);
    free(bench->sticking);
    frame_renderer_destroy(bench->renderer);
    frame_scene_destroy(bench->shared);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

BENCH_ON_DEVICE(views, prepare(&bench, &error) && run(&bench, &error))
