/* SPDX-License-Identifier: MIT */
/* The list of a frame's passes, in order, and the way through it. */
#include "render/frame/passes.h"

#include "render/frame/build.h"
#include "render/frame/key.h"
#include "render/frame/output.h"
#include "render/frame/samples.h"
#include "render/frame/update.h"
#include "render/passes/ground/ground.h"
#include "render/passes/wireframe/wireframe.h"

#include <stddef.h>

struct entry {
    const struct pass *pass;
    bool is_of_work; /* the pass's state is at `state` in the frame's work; else the renderer is its state */
    size_t state;
    bool is_brief; /* a dispatch or two, done in the step of the pass before it */
};

#define OF_WORK(member) .is_of_work = true, .state = offsetof(struct frame_work, member)

static const struct entry frame_passes[PHASE_COUNT] = {
    [PHASE_UPDATE] = {.pass = &update_pass}, /* brings the scene to the device */
    [PHASE_BUILD] = {.pass = &build_pass}, /* brings the tracers' structures to the scene, and reserves buffers */
    [PHASE_SAMPLES] = {.pass = &samples_pass}, /* adds samples to the picture, slice by slice */
    [PHASE_KEEP] = {.pass = &keep_pass},       /* keeps a layer of the key view; then build follows again */
    [PHASE_DENOISE] = {.pass = &denoise_pass, OF_WORK(denoise)},
    [PHASE_OUTPUT] = {.pass = &output_pass}, /* turns sums into pixels, on the host, band by band */
};

static const struct entry slice_passes[] = {
    {.pass = &primary_pass, OF_WORK(primary)}, /* makes rays of the camera and finds their hits */
    {.pass = &eyes_pass, OF_WORK(eyes)},       /* or finds the surfaces of a key view that eyes see */
    /* Each wave of the slice, the first hits included: */
    {.pass = &ground_pass, .is_brief = true},
    {.pass = &wireframe_pass, .is_brief = true},
    {.pass = &guides_pass, OF_WORK(denoise), .is_brief = true},
    {.pass = &layers_pass, OF_WORK(layers)},
    {.pass = &shading_pass, OF_WORK(shading)},
    {.pass = &bounce_pass, OF_WORK(shading)}, /* traces the children; then the next wave begins */
    /* Once there is no wave left: */
    {.pass = &sums_pass, .is_brief = true}, /* adds the slice to the picture */
};

#define SLICE_PASSES (sizeof(slice_passes) / sizeof(slice_passes[0]))
#define FIRST_OF_WAVE 2 /* ground */

static void *state_of(const struct entry *entry, struct frame_renderer *renderer)
{
    return entry->is_of_work ? (char *)renderer->work + entry->state : (void *)renderer;
}

static bool is_wanted(const struct entry *entry, const struct frame_renderer *renderer)
{
    const void *state = entry->is_of_work ? (const char *)renderer->work + entry->state : (const void *)renderer;
    return entry->pass && (!entry->pass->wants || entry->pass->wants(state, &renderer->work->wave));
}

static enum pass_progress run(const struct entry *entry, struct frame_renderer *renderer, struct error *error)
{
    return entry->pass->run(state_of(entry, renderer), &renderer->work->wave, error);
}

enum pass_progress passes_run(struct frame_renderer *renderer, struct error *error)
{
    return run(&frame_passes[renderer->phase], renderer, error);
}

enum frame_phase passes_next(const struct frame_renderer *renderer, enum frame_phase phase)
{
    while (phase < PHASE_COUNT && !is_wanted(&frame_passes[phase], renderer))
        phase++;
    return phase;
}

/* Behind the pass that has just ended. */
static size_t next_of_slice(const struct frame_renderer *renderer)
{
    const struct entry *ended = &slice_passes[renderer->slice_pass];
    size_t next = ended->pass == &bounce_pass ? FIRST_OF_WAVE : renderer->slice_pass + 1;
    while (next < SLICE_PASSES && !is_wanted(&slice_passes[next], renderer))
        next++;
    return next;
}

enum pass_progress passes_begin_slice(struct frame_renderer *renderer, struct error *error)
{
    renderer->work->wave.has_rays = false;
    renderer->work->shading.has_children = false;
    context_set_number(&renderer->work->wave, 0);
    renderer->slice_pass = 0;
    while (!is_wanted(&slice_passes[renderer->slice_pass], renderer))
        renderer->slice_pass++;
    return passes_run_slice(renderer, error);
}

enum pass_progress passes_run_slice(struct frame_renderer *renderer, struct error *error)
{
    for (;;) {
        const enum pass_progress progress = run(&slice_passes[renderer->slice_pass], renderer, error);
        if (progress != PASS_DONE)
            return progress;
        renderer->slice_pass = next_of_slice(renderer);
        if (renderer->slice_pass == SLICE_PASSES)
            return PASS_DONE;
        if (!slice_passes[renderer->slice_pass].is_brief)
            return PASS_MORE;
    }
}

bool passes_reserve(struct frame_work *work, uint32_t slice_samples, struct error *error)
{
    for (size_t i = 0; i < SLICE_PASSES; i++) {
        const struct entry *entry = &slice_passes[i];
        if (entry->pass->reserve &&
            !entry->pass->reserve((char *)work + entry->state, &work->wave, slice_samples, error))
            return false;
    }
    return true;
}

static void finish(const struct entry *entry, struct frame_work *work, struct gpu_device *device)
{
    if (entry->pass && entry->pass->finish)
        entry->pass->finish((char *)work + entry->state, device);
}

void passes_finish(struct frame_work *work, struct gpu_device *device)
{
    for (size_t i = 0; i < SLICE_PASSES; i++)
        finish(&slice_passes[i], work, device);
    for (size_t i = 0; i < PHASE_COUNT; i++)
        finish(&frame_passes[i], work, device);
}
