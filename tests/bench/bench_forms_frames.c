/* SPDX-License-Identifier: MIT */
/* Frames: {"name", "structure", "structure_bytes", "primary_rays", "shadow_rays", "secondary_rays", "frame_ns":
 * [..], "build_ns": [..], "stages_ns": {STAGE: [..]}, "psnr_db"}: whole pictures by an integrator with rasterised
 * first hits, from begin to the pixels on the host, what building took of that, and the peak signal to noise ratio
 * of the last run's 8-bit colours beside the reference's of the same moment. */
#include "tests/bench/bench_forms.h"

#include "base/clock.h"
#include "render/tracer_set.h"
#include "scene/pose.h"

#include <math.h>
#include <stdlib.h>

#define STEP_S 0.1 /* of the clip, from run to run */
/* The first compiles and builds; in the second it is seen what moves, and what stands still is built once more. */
#define WARM_UPS 2u

static const enum stage shown[] = {STAGE_UPLOAD, STAGE_PRIMARY, STAGE_TRACE, STAGE_SHADE, STAGE_RESOLVE};
enum { SHOWN = sizeof(shown) / sizeof(shown[0]) };

struct frames {
    struct bench_forms *bench;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    struct frame_result last[BENCH_FORMS_MAX];
    struct bench_runs whole[BENCH_FORMS_MAX], build[BENCH_FORMS_MAX], stages[BENCH_FORMS_MAX][SHOWN];
};

static bool pose(struct frames *frames, unsigned run, struct scene_motion *motion, struct error *error)
{
    const struct scene *scene = frames->bench->scene.loaded.scene;
    uint64_t clip;
    void *value;
    size_t cursor = 0;
    if (!hashmap_next(&scene->objects[OBJECT_CLIP], &cursor, &clip, &value))
        return error_set(error, ERROR_INVALID, "--play", "the model has no clip");
    const struct clip_use use = {.clip = (uint32_t)clip, .speed = 1, .loop = true};
    return scene_motion_evaluate(motion, scene, &use, 1, STEP_S * run, 0, error);
}

static bool render(struct frames *frames, const struct bench_form *form, const struct scene_motion *motion,
                   struct frame_result *result, struct error *error)
{
    const struct bench_forms *bench = frames->bench;
    const struct frame_request request = {.width = bench->width,
                                          .height = bench->height,
                                          .samples = 1,
                                          .depth = bench->depth,
                                          .camera = bench->scene.camera,
                                          .tracer = form->tracer,
                                          .tracer_options = form->options,
                                          .integrator = bench->integrator,
                                          .ao_rays = form->ao_rays ? form->ao_rays : bench->ao_rays};
    frame_renderer_stand_in(frames->renderer, BENCH_TRACER_RIVAL, form->rival);
    if (!frame_begin(frames->renderer, bench->scene.loaded.scene, motion, &request, error))
        return false;
    enum frame_progress progress;
    while ((progress = frame_step(frames->renderer, result, error)) == FRAME_MORE)
        continue;
    return progress == FRAME_DONE;
}

static unsigned warm_ups(const struct frames *frames)
{
    return frames->bench->once ? 0 : WARM_UPS;
}

static bool run_once(struct frames *frames, unsigned i, unsigned run, struct error *error)
{
    struct bench_forms *bench = frames->bench;
    struct scene_motion motion = {0};
    if (bench->plays && !pose(frames, run, &motion, error))
        return false;
    struct frame_result result = {0};
    const uint64_t start_ns = clock_now_ns();
    const bool done = render(frames, &bench->forms[i], bench->plays ? &motion : NULL, &result, error);
    const uint64_t frame_ns = clock_now_ns() - start_ns;
    scene_motion_finish(&motion);
    if (!done)
        return false;
    frame_result_finish(&frames->last[i]);
    frames->last[i] = result;
    if (run < warm_ups(frames))
        return true;
    bench_add(&frames->whole[i], frame_ns);
    bench_add(&frames->build[i], stage_times_sum_ns(&result.times, STAGE_BUILD, CLOCK_CPU));
    for (int k = 0; k < SHOWN; k++)
        bench_add(&frames->stages[i][k], stage_times_sum_ns(&result.times, shown[k], CLOCK_CPU));
    return true;
}

/* Forms may differ in what is asked of one tracer. */
static unsigned tracers_of(const struct bench_forms *bench)
{
    unsigned count = 0;
    for (unsigned i = 0; i < bench->form_count; i++) {
        const struct bench_form *form = &bench->forms[i];
        bool is_new = true;
        for (unsigned k = 0; k < i; k++)
            is_new = is_new && !(bench->forms[k].tracer == form->tracer && bench->forms[k].rival == form->rival &&
                                 tracer_options_same(&bench->forms[k].options, &form->options));
        count += is_new;
    }
    return count;
}

/* The forms take turns where their tracers are all kept between frames. Where the scene plays, who comes first
 * would pay for what all of a round are shown. */
static bool run_all(struct frames *frames, struct error *error)
{
    const unsigned forms = frames->bench->form_count, runs = warm_ups(frames) + frames->bench->runs;
    const bool turns = tracers_of(frames->bench) <= TRACERS_KEPT && !frames->bench->plays;
    for (unsigned k = 0; k < forms * runs; k++) {
        const unsigned i = turns ? k % forms : k / runs, run = turns ? k / forms : k % runs;
        if (!run_once(frames, i, run, error))
            return false;
    }
    return true;
}

/* Colours as a screen shows them; infinite where there is no error. */
static double psnr_db(const struct frame_result *a, const struct frame_result *b)
{
    double squares = 0;
    size_t count = 0;
    for (size_t i = 0; i < a->size_bytes && i < b->size_bytes; i++) {
        const double error = (double)a->pixels[i] - (double)b->pixels[i];
        if (i % 4 == 3)
            continue;
        squares += error * error;
        count++;
    }
    return 10 * log10(255.0 * 255.0 * (double)count / squares);
}

static json_t *describe(const struct frames *frames, unsigned i, const struct frame_result *truth)
{
    const struct frame_result *last = &frames->last[i];
    const double psnr = psnr_db(last, truth);
    json_t *stages = json_object();
    for (int k = 0; k < SHOWN; k++)
        json_object_set_new(stages, stage_name(shown[k]), bench_times_json(&frames->stages[i][k]));
    return json_pack("{s:s, s:o, s:I, s:I, s:I, s:I, s:o, s:o, s:o, s:o}", "name", frames->bench->forms[i].name,
                     "structure", bench_structure_json(&last->structure), "structure_bytes",
                     (json_int_t)last->structure_bytes, "primary_rays", (json_int_t)last->primary_rays,
                     "shadow_rays", (json_int_t)last->shadow_rays, "secondary_rays",
                     (json_int_t)last->secondary_rays, "frame_ns", bench_times_json(&frames->whole[i]), "build_ns",
                     bench_times_json(&frames->build[i]), "stages_ns", stages, "psnr_db",
                     isfinite(psnr) ? json_real(psnr) : json_null());
}

static bool render_truth(struct frames *frames, struct frame_result *truth, struct error *error)
{
    const struct bench_form reference = {.tracer = TRACER_REFERENCE};
    struct scene_motion motion = {0};
    const bool plays = frames->bench->plays;
    const bool done = (!plays || pose(frames, warm_ups(frames) + frames->bench->runs - 1, &motion, error)) &&
                      render(frames, &reference, plays ? &motion : NULL, truth, error);
    scene_motion_finish(&motion);
    return done;
}

json_t *bench_forms_frames(struct bench_forms *bench, struct error *error)
{
    struct frames *frames = calloc(1, sizeof(*frames));
    if (!frames) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for frames");
        return NULL;
    }
    frames->bench = bench;
    frames->shared = frame_scene_create(bench->device, error);
    frames->renderer = frames->shared ? frame_renderer_create(frames->shared, error) : NULL;
    bool done = frames->renderer != NULL;
    struct frame_result truth = {0};
    done = done && run_all(frames, error) && render_truth(frames, &truth, error);
    json_t *list = done ? json_array() : NULL;
    for (unsigned i = 0; i < bench->form_count; i++) {
        if (done)
            json_array_append_new(list, describe(frames, i, &truth));
        frame_result_finish(&frames->last[i]);
    }
    frame_result_finish(&truth);
    frame_renderer_destroy(frames->renderer);
    frame_scene_destroy(frames->shared);
    free(frames);
    return list;
}
