/* SPDX-License-Identifier: MIT */
/* Frames of eyes that are made from the layers of a key view (render/key_view.h), beside rendered ones. Prints one
 * JSON object: {"scene", "triangles", "device", "software", "width", "height", "samples", "true_samples",
 * "aperture", "moves": [{"name", "true_psnr_db", "rendered_ns", "psnr_db", "forms": [{"name", "cold_ns",
 * "warm_ns", "stages_ns": {STAGE: [..]}, "psnr_db", "seen_psnr_db", "unseen"}]}]}.
 *
 *   true_psnr_db of the true picture, of true_samples, beside one without noise; null: it has none. psnr_db of all
 *                others are beside one without noise, too
 *   rendered_ns  a frame by `bvh`
 *   cold_ns      the first frame from a key view: its layers and their structure are made, too; stages_ns: by the
 *                clock
 *   warm_ns      another frame from the same key view
 *   unseen       the share of samples that the key view does not show
 *
 * Times are of the processor, all threads of the process, one a run. Exit status: 1 failed, 2 usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_warps.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] = "usage: bench eyes --model FILE | --family TRIANGLES [options]\n"
                            "  --move R,U,A    metres that the eye moves right, up and ahead; may be repeated;\n"
                            "                  default 0.065,0,0 and 0.15,0,0.05\n"
                            "  --forms LIST    of one, two, three (layers), minmax, dda, adaptive; default "
                            "one,two,three\n"
                            "  --samples N, --true-samples N, --aperture METRES, --focus METRES\n"
                            "  --pictures DIR  all pictures go there too, with what is not seen in red\n"
                            "  --size WxH      multiples of 8; default 1280x720\n"
                            "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]\n"
                            "  --runs N        after one warm-up; default 3, at most 64\n";

#define MOVES_MAX 8u
#define TRUE_SEED 1000u /* and the next one: no run has them */
#define KEY_STEP 1e-5f  /* metres: no run has the key view of another one */

static const struct form {
    const char *name;
    struct quadtree_settings settings;
} forms[] = {
    {"one", {.layers = 1}},
    {"two", {.layers = 2}},
    {"three", {.layers = 3}},
    {"minmax", {.layers = 2, .nodes = QUADTREE_NODES_MINMAX}},
    {"dda", {.layers = 2, .walk = QUADTREE_WALK_DDA}},
    {"adaptive", {.layers = 2, .adaptive = QUADTREE_ADAPTIVE_ON}},
};
enum { FORMS = sizeof(forms) / sizeof(forms[0]) };

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    const char *names, *pictures;
    uint32_t width, height, runs, samples, true_samples, move_count, keys;
    float aperture, focus;
    float ways[MOVES_MAX][3]; /* right, up, ahead */
    uint32_t *truth, *halves[2], *colours;
    uint8_t *seen;
    json_t *moves;
};

/* ---- frames ---- */

static struct frame_request request_of(const struct bench *bench, const float way[3])
{
    return (struct frame_request){.width = bench->width,
                                  .height = bench->height,
                                  .samples = bench->samples,
                                  .depth = 4,
                                  .integrator = bench->samples > 1 ? INTEGRATOR_DISTRIBUTED : INTEGRATOR_WHITTED,
                                  .aperture = bench->aperture,
                                  .focus = bench->focus,
                                  .camera = bench_moved(&bench->scene.camera, way),
                                  .tracer = TRACER_BVH};
}

static bool render(struct bench *bench, const struct frame_request *request, struct frame_result *result,
                   uint64_t *time_ns, struct error *error)
{
    const uint64_t start_ns = bench_processor_ns();
    if (!frame_begin(bench->renderer, bench->scene.loaded.scene, NULL, request, error))
        return false;
    enum frame_progress progress;
    while ((progress = frame_step(bench->renderer, result, error)) == FRAME_MORE)
        continue;
    *time_ns = bench_processor_ns() - start_ns;
    return progress == FRAME_DONE;
}

/* A frame's time, and its colours. */
static bool render_colours(struct bench *bench, const struct frame_request *request, uint32_t *colours,
                           uint64_t *time_ns, struct error *error)
{
    struct frame_result result = {0};
    const bool done = render(bench, request, &result, time_ns, error);
    if (done)
        memcpy(colours, result.pixels, (size_t)bench->width * bench->height * sizeof(*colours));
    frame_result_finish(&result);
    return done;
}

/* ---- the true picture ---- */

/* Two halves, each with random numbers of its own: the truth is their mean. Where it has no noise they are one. */
static bool find_truth(struct bench *bench, struct frame_request request, struct error *error)
{
    const size_t count = (size_t)bench->width * bench->height;
    uint64_t time_ns;
    request.samples = bench->true_samples > 1 ? bench->true_samples / 2 : 1;
    for (unsigned half = 0; half < 2; half++) {
        request.seed = TRUE_SEED + half;
        if (!render_colours(bench, &request, bench->halves[half], &time_ns, error))
            return false;
    }
    for (size_t i = 0; i < count; i++) {
        const uint32_t a = bench->halves[0][i], b = bench->halves[1][i];
        bench->truth[i] = (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); /* of each byte */
    }
    return true;
}

static double squares_of(double psnr_db)
{
    return pow(10, -psnr_db / 10);
}

/* The truth's own, beside a picture without noise: the squared error of the mean is a quarter of the halves'
 * squared difference. */
static double true_psnr_db(const struct bench *bench, const uint8_t *seen)
{
    return warp_psnr_db(bench->halves[0], bench->halves[1], seen, bench->width * bench->height) + 20 * log10(2);
}

/* bench->colours beside a picture without noise: its random numbers are not the truth's, whose squared error is
 * therefore added to its own. */
static double psnr_db(const struct bench *bench, const uint8_t *seen)
{
    const double squares =
        squares_of(warp_psnr_db(bench->colours, bench->truth, seen, bench->width * bench->height)) -
        squares_of(true_psnr_db(bench, seen));
    return squares > 0 ? -10 * log10(squares) : (double)INFINITY;
}

/* ---- frames from layers ---- */

struct results {
    struct bench_runs cold, warm, stages[STAGE_COUNT];
    double unseen;
};

/* Where the picture's pixels are known, all samples of them. */
static bool find_seen(struct bench *bench, struct frame_request request, struct results *results,
                      struct error *error)
{
    struct frame_result result = {0};
    const size_t count = (size_t)bench->width * bench->height;
    uint64_t time_ns;
    request.format = PIXEL_FORMAT_RGBA32F;
    request.layers = 1u << LAYER_BEAUTY | 1u << LAYER_UNKNOWN;
    const bool done = render(bench, &request, &result, &time_ns, error);
    results->unseen = 0;
    for (size_t i = 0; done && i < count; i++) {
        const float *unknown = (const float *)(const void *)result.pixels + 4 * (count + i);
        bench->seen[i] = unknown[0] <= 0;
        results->unseen += (double)unknown[0] / (double)count;
    }
    frame_result_finish(&result);
    return done;
}

static bool make_once(struct bench *bench, const struct form *form, const float way[3], bool is_counted,
                      struct results *results, struct error *error)
{
    struct frame_request request = request_of(bench, way);
    struct frame_result first = {0};
    uint64_t cold_ns, warm_ns;
    struct tracer_settings settings = {.quadtree = form->settings};
    tracer_settings_resolve(&settings); /* as every request has them */
    request.tracer_options.quadtree = settings.quadtree;
    request.view_source = VIEW_SOURCE_LAYERS;
    request.has_key = true;
    request.key_camera = bench_moved(&bench->scene.camera, (float[3]){KEY_STEP * (float)++bench->keys, 0, 0});
    if (!render(bench, &request, &first, &cold_ns, error) ||
        !render_colours(bench, &request, bench->colours, &warm_ns, error))
        return false;
    if (is_counted) {
        bench_add(&results->cold, cold_ns);
        bench_add(&results->warm, warm_ns);
        for (enum stage stage = 0; stage < STAGE_COUNT; stage++)
            bench_add(&results->stages[stage], stage_times_sum_ns(&first.times, stage, CLOCK_CPU));
    }
    frame_result_finish(&first);
    return is_counted || find_seen(bench, request, results, error);
}

static void write_picture(const struct bench *bench, const char *move, const char *name, const uint32_t *colours,
                          const uint8_t *seen)
{
    char path[512];
    snprintf(path, sizeof(path), "%s/%s-%s.ppm", bench->pictures, move, name);
    if (!warp_write(path, bench->width, bench->height, colours, seen))
        fprintf(stderr, "bench eyes: %s cannot be written\n", path);
}

static json_t *results_json(const struct bench *bench, const struct form *form, const struct results *results)
{
    json_t *stages = json_object();
    for (enum stage stage = 0; stage < STAGE_COUNT; stage++)
        if (stage != STAGE_FRAME && bench_figure(&results->stages[stage]).max_ns > 0)
            json_object_set_new(stages, stage_name(stage), bench_times_json(&results->stages[stage]));
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:f}", "name", form->name, "cold_ns",
                     bench_times_json(&results->cold), "warm_ns", bench_times_json(&results->warm), "stages_ns",
                     stages, "psnr_db", bench_decibels(psnr_db(bench, NULL)), "seen_psnr_db",
                     bench_decibels(psnr_db(bench, bench->seen)), "unseen", results->unseen);
}

static bool make(struct bench *bench, const struct form *form, const float way[3], json_t *list,
                 struct error *error)
{
    struct results results = {0};
    for (unsigned run = 0; run <= bench->runs; run++)
        if (!make_once(bench, form, way, run > 0, &results, error))
            return false;
    json_array_append_new(list, results_json(bench, form, &results));
    return true;
}

static bool run_move(struct bench *bench, const float way[3], struct error *error)
{
    struct frame_request request = request_of(bench, way);
    struct bench_runs rendered = {0};
    uint64_t time_ns;
    char name[96];
    if (!find_truth(bench, request, error))
        return false;
    for (unsigned run = 0; run <= bench->runs; run++) {
        request.seed = run;
        if (!render_colours(bench, &request, bench->colours, &time_ns, error))
            return false;
        if (run > 0)
            bench_add(&rendered, time_ns);
    }
    snprintf(name, sizeof(name), "%g,%g,%g", (double)way[0], (double)way[1], (double)way[2]);
    json_t *list = json_array();
    json_array_append_new(bench->moves, json_pack("{s:s, s:o, s:o, s:o, s:o}", "name", name, "true_psnr_db",
                                                  bench_decibels(true_psnr_db(bench, NULL)), "rendered_ns",
                                                  bench_times_json(&rendered), "psnr_db",
                                                  bench_decibels(psnr_db(bench, NULL)), "forms", list));
    if (bench->pictures)
        write_picture(bench, name, "true", bench->truth, NULL);
    for (unsigned i = 0; i < FORMS; i++) {
        if (!bench_is_named(bench->names, forms[i].name))
            continue;
        if (!make(bench, &forms[i], way, list, error))
            return false;
        if (bench->pictures)
            write_picture(bench, name, forms[i].name, bench->colours, bench->seen);
    }
    return true;
}

static bool run(struct bench *bench, struct error *error)
{
    const size_t count = (size_t)bench->width * bench->height;
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    if (!bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error))
        return false;
    bench->shared = frame_scene_create(bench->device, error);
    bench->renderer = bench->shared ? frame_renderer_create(bench->shared, error) : NULL;
    bench->truth = calloc(count, sizeof(*bench->truth));
    for (unsigned half = 0; half < 2; half++)
        bench->halves[half] = calloc(count, sizeof(*bench->halves[half]));
    bench->colours = calloc(count, sizeof(*bench->colours));
    bench->seen = calloc(count, sizeof(*bench->seen));
    bench->moves = json_array();
    if (!bench->renderer)
        return false;
    if (!bench->truth || !bench->halves[0] || !bench->halves[1] || !bench->colours || !bench->seen ||
        !bench->moves)
        return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the pictures");
    for (uint32_t i = 0; i < bench->move_count; i++)
        if (!run_move(bench, bench->ways[i], error))
            return false;
    return gpu_check(bench->device, "bench", error);
}

/* ---- in and out ---- */

static bool print(const struct bench *bench)
{
    json_t *measured =
        json_pack("{s:i, s:i, s:i, s:i, s:f, s:O}", "width", (int)bench->width, "height", (int)bench->height,
                  "samples", (int)bench->samples, "true_samples", (int)bench->true_samples, "aperture",
                  (double)bench->aperture, "moves", bench->moves);
    return bench_scene_print(&bench->scene, &bench->scene_options, bench->device, measured);
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    switch (option) {
    case 'M':
        return bench->move_count < MOVES_MAX && bench_parse_vector(text, bench->ways[bench->move_count++]);
    case 'n':
        bench->names = text;
        return true;
    case 'p':
        bench->pictures = text;
        return true;
    case 'S':
        return bench_parse_number(text, 1, 4096, &bench->samples);
    case 'T':
        return bench_parse_number(text, 1, 4096, &bench->true_samples);
    case 'A':
        return bench_parse_real(text, &bench->aperture);
    case 'F':
        return bench_parse_real(text, &bench->focus);
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
        {"model", 1, NULL, 'm'},    {"family", 1, NULL, 'f'},  {"move", 1, NULL, 'M'},
        {"forms", 1, NULL, 'n'},    {"samples", 1, NULL, 'S'}, {"size", 1, NULL, 's'},
        {"eye", 1, NULL, 'e'},      {"look-at", 1, NULL, 'l'}, {"true-samples", 1, NULL, 'T'},
        {"aperture", 1, NULL, 'A'}, {"focus", 1, NULL, 'F'},   {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},      {"runs", 1, NULL, 'r'},    {"pictures", 1, NULL, 'p'},
        {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.names = "one,two,three", .width = 1280, .height = 720, .runs = 3, .samples = 1};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    if (bench->true_samples == 0)
        bench->true_samples = bench->samples;
    if (bench->move_count == 0) {
        bench->move_count = 2;
        bench->ways[0][0] = 0.065f;
        bench->ways[1][0] = 0.15f;
        bench->ways[1][2] = 0.05f;
    }
    return (bench->scene_options.model != NULL) != (bench->scene_options.family_triangles > 0) && optind == argc;
}

static void finish(struct bench *bench)
{
    json_decref(bench->moves);
    free(bench->truth);
    free(bench->halves[0]);
    free(bench->halves[1]);
    free(bench->colours);
    free(bench->seen);
    frame_renderer_destroy(bench->renderer);
    frame_scene_destroy(bench->shared);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

BENCH_ON_DEVICE(eyes, run(&bench, &error))
