/* SPDX-License-Identifier: MIT */
/* One interface for every acceleration structure. A tracer answers waves of rays about the scene that its
 * structure was brought to. The wrappers below check, limit the time, and call the tracer's implementation.
 *
 * Owners. What a structure is built from (tracer_impl.depends_on) decides who owns it:
 *   the scene alone      struct tracer, owned by what all viewers of a scene share (render/frame_renderer.c)
 *   CHANGED_VIEW too     struct tracer, owned by the renderer of that view: it never serves another one
 *   the rays of a wave   struct trace_state, owned by the work of one frame; several frames may be in progress
 *
 * Threads: all of it belongs to the thread that owns the device. Times are in nanoseconds. What fails fills *error
 * and leaves the object such that it can be destroyed, or brought to the scene again from the beginning. */
#ifndef FARLIGHT_TRACE_TRACER_H
#define FARLIGHT_TRACE_TRACER_H

#include "base/error.h"
#include "base/stage_times.h"
#include "gpu/device.h"
#include "gpu_scene/scene.h"
#include "protocol/tracers.h"
#include "trace/step.h"
#include "trace/structure.h"
#include "trace/view.h"
#include "trace/wave.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Options of all tracers; zero is the default of each. A tracer gets them with the defaults of tracers.def in
 * place, and looks at those of its own name: options->ldc.resolution. Words only, without bytes between them:
 * tracer_options_same() compares all. */
/* clang-format off */
struct tracer_options {
#define SETTINGS(tracer) struct tracer##_settings tracer;
#include "protocol/tracers.def"
    struct tracer_limits limits;
    uint32_t quadtree_leaves; /* 1: its layers will be asked for, and no ray traced */
    /* Of the pictures that are asked for, the nearest power of two, so that a window may change its size a little:
     * by it a structure of samples chooses its resolution. 0: not known, or a resolution was asked for. */
    uint32_t picture_pixels;
};
/* clang-format on */

struct tracer_options tracer_options_of(const struct tracer_settings *settings,
                                        const struct tracer_limits *limits);

/* Notes the pixels of the pictures that are asked for of a tracer, by number, where it needs them. Structures that
 * do not depend on them are the same for all pictures. */
void tracer_options_note_picture(struct tracer_options *options, unsigned tracer, uint64_t pixels);

/* Whether one tracer serves both, and a picture by either goes on from one by the other. */
bool tracer_options_same(const struct tracer_options *a, const struct tracer_options *b);

struct tracer_stats {
    uint64_t device_bytes;   /* of the structure */
    uint64_t uploaded_bytes; /* by the last update */
    uint64_t nodes;          /* elements of the structure */
    uint64_t nodes_rebuilt;  /* by the last update */
    uint64_t nodes_refitted;
    uint32_t parts_built;  /* by the last update: a bit for each part of the structure */
    uint64_t traversal_ns; /* `reference`: of the last wave or part, in Embree alone, without the copies from and
                         to the device */
};

struct tracer {
    const struct tracer_impl *impl;
    struct gpu_device *device;
    struct tracer_options options;
    struct tracer_stats stats;
    /* by the wrappers: */
    bool updated;              /* the structure is that of some revision */
    bool updating;             /* an update has begun and has not come to its end */
    uint64_t step_end_ns;      /* when the step of the update in progress is to end: for step_is_over() */
    struct trace_state *state; /* of waves that are traced at once; NULL: there was none yet */
};

/* What an update is told. */
struct tracer_update {
    unsigned changed; /* enum scene_change: since the last update of this tracer that came to its end */
    /* What to build a structure of a view from; NULL where nothing that the tracer depends on is of a view. Copied
     * by a tracer that needs it after the step. */
    const struct trace_view *view;
    struct stage_times *times; /* the step's spans are added to it; may be NULL */
};

/* The structure that a tracer builds from the rays of one wave, and how far it has come with it. It serves one
 * wave after another, and keeps its buffers from wave to wave and from frame to frame. It refers to no tracer, but
 * works with every one of the same implementation and options. An implementation that needs more begins its own
 * struct with this one. */
struct trace_state {
    const struct tracer_impl *impl;
    struct gpu_device *device;
    struct tracer_options options;
    /* by the wrappers: */
    struct wave wave; /* in progress */
    bool in_progress; /* the wave has begun and is not traced to its end */
    bool has_traced;  /* a wave, to its end, since the reset */
    bool patient;     /* rays were too long to be queued: the tracer waits for each dispatch, until the reset */
    uint32_t traced_rays; /* rays before this one have their final answers */
    /* Of the range being traced: when the step ends, and the range, which trace_range() may end before its end, at
     * a multiple of minimum_rays. */
    uint64_t step_end_ns;
    uint32_t range_end;
    /* Of a tracer that traces ranges of rays: how many rays the next step may have, by family; 0: not known. */
    uint32_t step_rays[WAVE_FAMILIES];
};

struct tracer_impl {
    const char *name;
    /* enum scene_change: what the structure is built from. `update` is called when one of these changed, and for
     * the first structure; with CHANGED_VIEW among them each view has a tracer of its own. */
    unsigned depends_on;
    bool sampled; /* hits of meshes and spheres are stored samples (HIT_SAMPLED) */
    /* The structure knows the scene as the shutter opens: rays of a scene in which something moves meanwhile must
     * have no times. */
    bool still;
    bool traces_on_host; /* fetches the rays: the caller must know how many there are */
    /* Its first hits are those of the rasteriser, and fast enough that a device decides which way is faster. */
    bool finds_first_hits;
    /* The smallest range of rays that trace_range() is good for: ranges begin at multiples of it, so that rays
     * that are traversed together stay together, and have no fewer rays unless the wave ends. 0: 1. */
    uint32_t minimum_rays;

    /* ---- the structure ---- */

    /* NULL and *error: the options make no sense (ERROR_INVALID names the field), or there is no memory. */
    struct tracer *(*create)(struct gpu_device *device, const struct tracer_options *options, struct error *error);
    void (*destroy)(struct tracer *tracer);
    /* Does a step of bringing the structure to the scene, until about tracer->step_end_ns; update->changed has
     * none but bits that the tracer depends on, all of them at first. After TRACER_MORE it is called again with
     * the same scene, view and bits; scene->motion may be read in the first step only. What it has found so far
     * the tracer keeps in its own struct: other buffers may be bound between two steps. Reports the times of the
     * step as STAGE_BUILD and STAGE_UPLOAD, and keeps the stats' device_bytes true. Stats of the last update are 0
     * when the first step begins. After TRACER_FAILED the structure is empty. */
    enum tracer_progress (*update)(struct tracer *tracer, struct gpu_scene *scene,
                                   const struct tracer_update *update, struct error *error);
    /* Drops an update that is not done, and all that was built; the next one is a first one. NULL: an update is
     * always one step. */
    void (*abandon)(struct tracer *tracer);
    /* Adds the rows of the structure, as of the last update: STRUCTURE_ROWS_MAX at most. NULL: nothing. */
    void (*tell)(const struct tracer *tracer, struct structure_rows *rows);
    /* Whether the next step of the update would only wait, for threads of the tracer's own. NULL: never. */
    bool (*waits)(struct tracer *tracer);

    /* ---- waves: the scene's buffers are bound; work is queued and not waited for, unless the CPU does it ---- */

    /* Makes and frees the state of waves. `create` leaves the members of struct trace_state zero; the wrapper sets
     * them. All three NULL: the struct trace_state is enough. */
    struct trace_state *(*state_create)(struct gpu_device *device, const struct tracer_options *options,
                                        struct error *error);
    void (*state_destroy)(struct trace_state *state);
    uint64_t (*state_device_bytes)(const struct trace_state *state);
    /* What the waves since the reset were like, of which there is one at least: begins to copy what the device has
     * counted; adds rows of what was copied, without waiting for more than the copy. Both NULL: nothing. */
    bool (*state_copy_counts)(struct trace_state *state, struct error *error);
    bool (*state_tell)(struct trace_state *state, struct structure_rows *rows, struct error *error);
    /* Begins state->wave: decides what holds for all of it. NULL: there is nothing to do. */
    bool (*trace_begin)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        struct error *error);
    /* One of these two finds the intersections (shared/hit.h) or visibilities of state->wave.
     * trace_range: for tracers that trace one ray, or one packet, independently of others. Does the rays of the
     * range; the wrapper chooses ranges that fit a step and calls it for one after another. Where the cost of a
     * ray has no bound, it ends the range early, once the step is over (see range_end). */
    bool (*trace_range)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        const struct ray_range *rays, struct error *error);
    /* trace_step: for tracers that advance in another way, by batches of triangles for example. Does a step until
     * about `step_end_ns` (STEP_WITHOUT_END: all of it). No answer counts before TRACER_DONE; other waves of other
     * states may be traced between two steps. A wave may also be dropped: then the next call is trace_begin. */
    enum tracer_progress (*trace_step)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                       uint64_t step_end_ns, struct error *error);
    /* Gets the programs that such a wave needs, to announce them (gpu_program_announce), but no others.
     * NULL: nothing is announced. */
    void (*announce)(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave);
    /* Turns the intersections of these rays of a WAVE_CLOSEST into hits, in place: what the shading reads of a
     * surface. NULL: an intersection names a primitive of the scene, and trace_surfaces() (trace/program.h) does
     * it. Sampled tracers run a program of their own, shaders/<tracer>/surface.comp. */
    bool (*surfaces)(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                     struct error *error);

    /* ---- layers: of a tracer whose structure is a picture of what a view sees; both NULL: it is none ---- */

    /* The view whose pixels are the texels of the layers, as of the last update: the eye and direction of the one
     * that was asked for, and a margin round it. And how many layers there are. False: with these options the
     * structure is no picture of one view. */
    bool (*texel_view)(const struct tracer *tracer, struct trace_view *texels, uint32_t *layers);
    /* Of rays that begin at the eye of that view, which may be dead: the intersections with the surfaces that the
     * layer holds at the texels they pass through. A miss where it holds none, and with wave.within_reach where no
     * eye within the radius of the structure sees them. */
    bool (*layer_hits)(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                       uint32_t layer, struct error *error);
    /* A shorter way than trace_range() to where the rays of some eyes meet the layers. Both NULL: there is none.
     * finds_eyes: whether it is open to such eyes. eye_hits: queues it. */
    bool (*finds_eyes)(const struct tracer *tracer, const struct gpu_scene *scene,
                       const struct frame_uniforms *frame);
    bool (*eye_hits)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                     const struct eye_rays *rays, struct error *error);
};

/* tracer_bvh_impl and its like, one for each row of tracers.def; weak, as a build may leave a tracer out. */
#define TRACER(NAME, name, number, use, needs, doc)                                                               \
    extern const struct tracer_impl tracer_##name##_impl __attribute__((weak));
#include "protocol/tracers.def"

/* The table of what this build has; index is the protocol's tracer number, NULL where it is left out. */
const struct tracer_impl *tracer_impl_by_number(unsigned number);
/* The same with an error: if there is none, ERROR_UNSUPPORTED says why and what can be done. */
const struct tracer_impl *tracer_find(unsigned number, const char *field, struct error *error);

/* Whether the tracer can show what moves while the shutter is open, if something does; else ERROR_UNSUPPORTED. */
bool tracer_check_motion(const struct tracer_impl *impl, const struct gpu_scene *scene, struct error *error);

struct tracer *tracer_create(const struct tracer_impl *impl, struct gpu_device *device,
                             const struct tracer_options *options, struct error *error);
void tracer_destroy(struct tracer *tracer); /* accepts NULL */
/* Of the structure, and of the state of waves that are traced at once. */
uint64_t tracer_device_bytes(const struct tracer *tracer);

/* ---- bringing the structure to the scene ---- */

/* Does one step of about `step_ns` (STEP_NS; 0: the smallest one; STEP_WITHOUT_END: all of it). The scene, its
 * arrays and the view must not change until the update is done or abandoned. Bits that the tracer does not depend
 * on are ignored: where no other changed, nothing is called. The first update, and the first one after a failure
 * or one that was abandoned, takes everything as changed. A tracer that depends on the view is refused without
 * one, ERROR_INTERNAL. */
enum tracer_progress tracer_update_step(struct tracer *tracer, struct gpu_scene *scene,
                                        const struct tracer_update *update, uint64_t step_ns, struct error *error);
/* Whether the next step would do nothing but wait. */
bool tracer_update_waits(struct tracer *tracer);
/* Nothing happens where no update has begun. */
void tracer_update_abandon(struct tracer *tracer);
/* All steps at once. */
bool tracer_update(struct tracer *tracer, struct gpu_scene *scene, const struct tracer_update *update,
                   struct error *error);
/* The rows of the structure, as of the last update. */
void tracer_tell(const struct tracer *tracer, struct structure_rows *rows);

/* ---- tracing, resumable ---- */

/* The caller owns the state. NULL and *error where there is no memory for it. */
struct trace_state *trace_state_create(const struct tracer_impl *impl, struct gpu_device *device,
                                       const struct tracer_options *options, struct error *error);
void trace_state_destroy(struct trace_state *state); /* accepts NULL */
/* Whether the state was made for these. */
bool trace_state_fits(const struct trace_state *state, const struct tracer_impl *impl,
                      const struct tracer_options *options);
uint64_t trace_state_device_bytes(const struct trace_state *state);
/* Drops the wave in progress, if any, what was learnt of the cost of rays, and what was counted: for the beginning
 * of a frame. */
void trace_state_reset(struct trace_state *state);
/* Begins a wave, which must fit its buffers (checked; ERROR_INTERNAL). A wave in progress is dropped. */
bool tracer_trace_begin(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave,
                        struct trace_state *state, struct error *error);
/* Does a step of about `step_ns` (as above) of the wave in progress, from rays to hits or visibilities. The
 * scene's buffers are bound; between two steps others may be. The cut into steps depends on the clock, the answers
 * do not: after TRACER_DONE they are to the bit those of the whole wave traced at once. After TRACER_FAILED no
 * wave is in progress. */
enum tracer_progress tracer_trace_step(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                       uint64_t step_ns, struct error *error);

/* Begins to copy what was counted of the waves since the reset. */
bool trace_state_copy_counts(struct trace_state *state, struct error *error);
/* Adds rows of what was copied. It does not wait where the host has waited for a later command. */
bool trace_state_tell(struct trace_state *state, struct structure_rows *rows, struct error *error);

/* Hits of the rays of a wave with one layer of a structure that is a picture of a view (tracer_impl.layer_hits).
 * The scene's buffers are bound. */
bool tracer_layer_hits(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, uint32_t layer,
                       struct error *error);

/* Whether tracer_eye_hits() is for such eyes. */
bool tracer_finds_eyes(const struct tracer *tracer, const struct gpu_scene *scene,
                       const struct frame_uniforms *frame);
/* Where their rays meet the layers of the view (tracer_impl.eye_hits), counted in the state. The scene's buffers
 * are bound. */
bool tracer_eye_hits(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                     const struct eye_rays *rays, struct error *error);

/* Announces the programs of such a wave (gpu_program_announce), of which the buffers may be missing. */
void tracer_announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave);

/* ---- tracing at once, with a state of the tracer's own: tests, benchmarks, comparisons ---- */

/* From rays to hits or visibilities: tracer_intersect() and tracer_surfaces(). */
bool tracer_trace(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error);
/* The traversal alone: hits are left as intersections, of which only distance, primitive and instance are set. */
bool tracer_intersect(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave,
                      struct error *error);
/* Turns all intersections of the wave into hits; there is nothing to do for visibilities. */
bool tracer_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error);

#endif
