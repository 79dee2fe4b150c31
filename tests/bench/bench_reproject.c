/* SPDX-License-Identifier: MIT */
/* A view whose camera moves, or that plays a clip, frame by frame: noisy, denoised alone, and with what frames
 * before it show, beside converged pictures of the same cameras.
 *
 * Prints one JSON object: {"scene", "triangles", "device", "software", "width", "height", "samples", "part": [of
 * each frame, by number], "methods": [{"name", "error": [of each frame: root of the mean square difference of
 * display values], "flicker": [of each frame but the first: the same of how errors differ from those of the frame
 * before at the same places], "cpu_ns": [of each frame]}]}. Exit status: 1 failed, 2 usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_camera.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_stats.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: bench reproject --model FILE [options]\n"
    "  --size WxH         default 160x96\n"
    "  --frames N         default 24\n"
    "  --samples N        a frame; default 1\n"
    "  --true-samples N   of the true pictures; default 256\n"
    "  --integrator NAME  path or distributed; default path\n"
    "  --speed X          of the camera, times that of a hand at 20 frames a second; default 1\n"
    "  --clip             the first clip plays in place of the camera\n"
    "  --pictures DIR     all pictures go there too\n";

enum method { METHOD_NOISY, METHOD_DENOISED, METHOD_REPROJECTED, METHODS };

static const char *const names[METHODS] = {"noisy", "denoised", "reprojected"};

#define PARTS 4u
#define RATE 20
#define OBJECTS_MAX 100000u
#define TRUE_STEP 64u /* samples of a pass: what is denoised has fewer */

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct frame_scene *shared;
    struct frame_renderer *renderers[METHODS + 1]; /* and of the true pictures */
    uint32_t width, height, frames, samples, true_samples;
    enum integrator_kind integrator;
    float speed;
    bool plays;
    struct clip_use clip;
    struct scene_motion motion; /* of this frame, where it plays */
    const char *pictures;
    struct viewer_camera camera;
    uint8_t *truth;
    float *depths[2]; /* of the true pictures of this frame, and of the one before */
    struct frame_camera cameras[2];
    float *errors[METHODS][2]; /* three a pixel, of the same */
    json_t *part, *error[METHODS], *flicker[METHODS], *cpu_ns[METHODS];
};

static bool render(struct bench *bench, uint32_t renderer, const struct frame_request *request,
                   struct frame_result *result, struct error *error)
{
    if (!frame_begin(bench->renderers[renderer], bench->scene.loaded.scene, bench->plays ? &bench->motion : NULL,
                     request, error))
        return false;
    enum frame_progress progress;
    while ((progress = frame_step(bench->renderers[renderer], result, error)) == FRAME_MORE)
        continue;
    return progress == FRAME_DONE;
}

static struct frame_request request_of(const struct bench *bench)
{
    return (struct frame_request){.width = bench->width,
                                  .height = bench->height,
                                  .samples = bench->samples,
                                  .depth = 8,
                                  .integrator = bench->integrator,
                                  .camera = bench->cameras[0],
                                  .tone_map = TONE_ACES,
                                  .tracer = TRACER_BVH};
}

static bool render_truth(struct bench *bench, struct error *error)
{
    struct frame_request request = request_of(bench);
    struct frame_result result = {0};
    request.accumulate = true;
    request.seed = 7;
    request.attachments = 1u << ATTACHMENT_DEPTH;
    const size_t count = (size_t)bench->width * bench->height;
    for (uint32_t held = 0; held < bench->true_samples; held += TRUE_STEP) {
        frame_result_finish(&result);
        request.samples = TRUE_STEP;
        if (!render(bench, METHODS, &request, &result, error))
            return false;
    }
    memcpy(bench->truth, result.pixels, count * 4);
    memcpy(bench->depths[0], frame_result_attachment(&result, ATTACHMENT_DEPTH), count * sizeof(float));
    frame_result_finish(&result);
    return true;
}

static void write_picture(const struct bench *bench, uint32_t frame, const char *name, const uint8_t *rgba)
{
    char path[512];
    snprintf(path, sizeof(path), "%s/%03u-%s.ppm", bench->pictures, frame, name);
    FILE *file = fopen(path, "wb");
    if (!file)
        return;
    fprintf(file, "P6 %u %u 255\n", bench->width, bench->height);
    for (size_t i = 0; i < (size_t)bench->width * bench->height; i++)
        fwrite(rgba + 4 * i, 1, 3, file);
    fclose(file);
}

/* The pixel of the frame before that shows what this one does; false: none. */
static bool place_before(const struct bench *bench, uint32_t x, uint32_t y, size_t *place)
{
    const float depth = bench->depths[0][(size_t)y * bench->width + x];
    const struct frame_camera *now = &bench->cameras[0], *before = &bench->cameras[1];
    const float high = tanf(now->fov_y / 2), wide = high * (float)bench->width / (float)bench->height;
    const float view[3] = {((float)x + 0.5f) / (float)bench->width * 2 * wide - wide,
                           high - ((float)y + 0.5f) / (float)bench->height * 2 * high, -1};
    float d[3], there[3];
    for (int i = 0; i < 3; i++) {
        const float *row = now->world_from_view + 4 * i;
        d[i] = depth * (row[0] * view[0] + row[1] * view[1] + row[2] * view[2]) + row[3] -
               before->world_from_view[4 * i + 3];
    }
    for (int i = 0; i < 3; i++)
        there[i] = d[0] * before->world_from_view[i] + d[1] * before->world_from_view[4 + i] +
                   d[2] * before->world_from_view[8 + i];
    if (!(depth > 0) || !(there[2] < 0))
        return false;
    const float px = floorf((there[0] / -there[2] / wide + 1) / 2 * (float)bench->width);
    const float py = floorf((1 - there[1] / -there[2] / high) / 2 * (float)bench->height);
    if (!(px >= 0 && px < (float)bench->width && py >= 0 && py < (float)bench->height))
        return false;
    *place = (size_t)py * bench->width + (size_t)px;
    return fabsf(bench->depths[1][*place] + there[2]) < 0.02f * depth;
}

static void note(struct bench *bench, uint32_t method, uint32_t frame, const uint8_t *rgba, uint64_t cpu_ns)
{
    const size_t count = (size_t)bench->width * bench->height;
    float *errors = bench->errors[method][0];
    double squares = 0, changes = 0;
    size_t seen = 0;
    for (size_t i = 0; i < count * 3; i++) {
        errors[i] = (float)rgba[i / 3 * 4 + i % 3] - (float)bench->truth[i / 3 * 4 + i % 3];
        squares += (double)(errors[i] * errors[i]);
    }
    for (size_t i = 0; i < count && frame > 0; i++) {
        size_t place;
        if (!place_before(bench, (uint32_t)(i % bench->width), (uint32_t)(i / bench->width), &place))
            continue;
        for (size_t c = 0; c < 3; c++) {
            const double change = (double)(errors[3 * i + c] - bench->errors[method][1][3 * place + c]);
            changes += change * change;
        }
        seen += 3;
    }
    json_array_append_new(bench->error[method], json_real(sqrt(squares / (double)(3 * count))));
    if (frame > 0)
        json_array_append_new(bench->flicker[method], json_real(seen ? sqrt(changes / (double)seen) : 0));
    json_array_append_new(bench->cpu_ns[method], json_integer((json_int_t)cpu_ns));
    if (bench->pictures)
        write_picture(bench, frame, names[method], rgba);
}

static bool compare(struct bench *bench, uint32_t frame, struct error *error)
{
    for (uint32_t method = 0; method < METHODS; method++) {
        struct frame_request request = request_of(bench);
        struct frame_result result = {0};
        request.denoise = method == METHOD_NOISY ? DENOISE_OFF : DENOISE_AUTO;
        request.history = method == METHOD_REPROJECTED ? HISTORY_MOVING : HISTORY_NONE;
        request.seed = frame;
        const uint64_t begun_ns = bench_processor_ns();
        if (!render(bench, method, &request, &result, error))
            return false;
        note(bench, method, frame, result.pixels, bench_processor_ns() - begun_ns);
        frame_result_finish(&result);
    }
    if (bench->pictures)
        write_picture(bench, frame, "true", bench->truth);
    return true;
}

static void keep_before(struct bench *bench)
{
    float *depths = bench->depths[0];
    bench->depths[0] = bench->depths[1];
    bench->depths[1] = depths;
    bench->cameras[1] = bench->cameras[0];
    for (uint32_t method = 0; method < METHODS; method++) {
        float *errors = bench->errors[method][0];
        bench->errors[method][0] = bench->errors[method][1];
        bench->errors[method][1] = errors;
    }
}

/* The identifiers of a model's objects are small numbers. */
static bool find_clip(struct bench *bench, struct error *error)
{
    for (uint32_t id = 1; id <= OBJECTS_MAX && bench->clip.clip == 0; id++)
        if (scene_clip(bench->scene.loaded.scene, id))
            bench->clip = (struct clip_use){.clip = id, .speed = 1.0f, .loop = true};
    return bench->clip.clip || error_set(error, ERROR_INVALID, "--clip", "the model has none");
}

static bool pose(struct bench *bench, uint32_t frame, struct error *error)
{
    scene_motion_finish(&bench->motion);
    return !bench->plays || scene_motion_evaluate(&bench->motion, bench->scene.loaded.scene, &bench->clip, 1,
                                                  (double)bench->speed * frame / RATE, 0.0, error);
}

static bool run(struct bench *bench, struct error *error)
{
    if (bench->plays && !find_clip(bench, error))
        return false;
    bench->camera = bench_camera_first(&bench->scene);
    for (uint32_t frame = 0; frame < bench->frames; frame++) {
        const uint32_t part = frame * PARTS / bench->frames;
        if (frame > 0 && !bench->plays)
            bench_camera_move(&bench->camera, part, (double)bench->speed);
        bench->cameras[0] = (struct frame_camera){.fov_y = (float)bench->camera.fov_y};
        camera_pose(&bench->camera, bench->cameras[0].world_from_view);
        json_array_append_new(bench->part, json_integer(part));
        if (!pose(bench, frame, error) || !render_truth(bench, error) || !compare(bench, frame, error))
            return false;
        keep_before(bench);
    }
    return gpu_check(bench->device, "bench", error);
}

static bool prepare(struct bench *bench, struct error *error)
{
    const size_t count = (size_t)bench->width * bench->height;
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    bench->part = json_array();
    bench->truth = calloc(count, 4);
    bool done = bench->truth != NULL;
    for (uint32_t i = 0; i < 2; i++)
        done = (bench->depths[i] = calloc(count, sizeof(float))) && done;
    for (uint32_t method = 0; method < METHODS; method++) {
        bench->error[method] = json_array();
        bench->flicker[method] = json_array();
        bench->cpu_ns[method] = json_array();
        for (uint32_t i = 0; i < 2; i++)
            done = (bench->errors[method][i] = calloc(count * 3, sizeof(float))) && done;
    }
    if (!done)
        return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the pictures");
    if (!bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error))
        return false;
    bench->shared = frame_scene_create(bench->device, error);
    for (uint32_t i = 0; i <= METHODS && bench->shared; i++)
        if (!(bench->renderers[i] = frame_renderer_create(bench->shared, error)))
            return false;
    return bench->shared != NULL;
}

static bool print(const struct bench *bench)
{
    json_t *methods = json_array();
    for (uint32_t method = 0; method < METHODS; method++)
        json_array_append_new(methods, json_pack("{s:s, s:O, s:O, s:O}", "name", names[method], "error",
                                                 bench->error[method], "flicker", bench->flicker[method], "cpu_ns",
                                                 bench->cpu_ns[method]));
    json_t *measured =
        json_pack("{s:i, s:i, s:i, s:O, s:o}", "width", (int)bench->width, "height", (int)bench->height, "samples",
                  (int)bench->samples, "part", bench->part, "methods", methods);
    return bench_scene_print(&bench->scene, &bench->scene_options, bench->device, measured);
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    static const char *const integrators[] = {"path", "distributed"};
    static const enum integrator_kind kinds[] = {INTEGRATOR_PATH, INTEGRATOR_DISTRIBUTED};
    uint32_t found;
    switch (option) {
    case 'p':
        bench->pictures = text;
        return true;
    case 's':
        return bench_parse_size(text, &bench->width, &bench->height);
    case 'n':
        return bench_parse_number(text, 1, 3600, &bench->frames);
    case 'a':
        return bench_parse_number(text, 1, 63, &bench->samples);
    case 't':
        return bench_parse_number(text, TRUE_STEP, 4096, &bench->true_samples);
    case 'x':
        return bench_parse_real(text, &bench->speed);
    case 'c':
        bench->plays = true;
        return true;
    case 'i':
        if (!bench_parse_word(text, integrators, 2, &found))
            return false;
        bench->integrator = kinds[found];
        return true;
    default:
        return bench_parse_scene(option, text, &bench->scene_options);
    }
}

static bool parse(struct bench *bench, int argc, char **argv)
{
    static const struct option options[] = {
        {"model", 1, NULL, 'm'},        {"size", 1, NULL, 's'},
        {"frames", 1, NULL, 'n'},       {"samples", 1, NULL, 'a'},
        {"speed", 1, NULL, 'x'},        {"integrator", 1, NULL, 'i'},
        {"true-samples", 1, NULL, 't'}, {"pictures", 1, NULL, 'p'},
        {"clip", 0, NULL, 'c'},         {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.width = 160,
                            .height = 96,
                            .frames = 24,
                            .samples = 1,
                            .true_samples = 256,
                            .integrator = INTEGRATOR_PATH,
                            .speed = 1.0f};
    for (int option; (option = getopt_long(argc, argv, "", options, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    return bench->scene_options.model != NULL && optind == argc;
}

static void finish(struct bench *bench)
{
    scene_motion_finish(&bench->motion);
    json_decref(bench->part);
    free(bench->truth);
    for (uint32_t i = 0; i < 2; i++)
        free(bench->depths[i]);
    for (uint32_t method = 0; method < METHODS; method++) {
        json_decref(bench->error[method]);
        json_decref(bench->flicker[method]);
        json_decref(bench->cpu_ns[method]);
        for (uint32_t i = 0; i < 2; i++)
            free(bench->errors[method][i]);
    }
    for (uint32_t i = 0; i <= METHODS; i++)
        frame_renderer_destroy(bench->renderers[i]);
    frame_scene_destroy(bench->shared);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

BENCH_ON_DEVICE(reproject, prepare(&bench, &error) && run(&bench, &error))
