/* SPDX-License-Identifier: MIT */
/* Interface of all acceleration structures. A tracer answers waves of rays through the scene for which its
 * structure was last updated. The wrappers below check their arguments, limit the time, and call the tracer's
 * implementation.
 *
 * Owners. The inputs of a structure (tracer_impl.depends_on) decide who owns it: the scene alone      struct
 *   tracer, shared by all viewers of a scene (render/frame/renderer.c) CHANGED_VIEW too     struct tracer, owned
 *   by the renderer of that view: it never serves another one the rays of a wave   struct trace_state, owned by
 *   the work of one frame; several frames may be in progress
 *
 * Threads: all calls come from the thread that owns the device. Times are in nanoseconds. A function that fails
 * fills *error and leaves an object that can be destroyed, or updated again from the beginning. */
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
 * place, and reads those of its own name: options->ldc.resolution. All members are words without padding:
 * tracer_options_same() compares bytes. */
/* clang-format off */
struct tracer_options {
#define SETTINGS(tracer) struct tracer##_settings tracer;
#include "protocol/tracers.def"
    struct tracer_limits limits;
    uint32_t quadtree_leaves; /* 1: only its layers will be read, and no ray traced */
    /* Pixels of the requested pictures, rounded to a power of two, so that a window may change its size a
     * little. A structure of samples chooses its resolution by it. 0: unknown, or a resolution was requested. */
    uint32_t picture_pixels;
};
/* clang-format on */

struct tracer_options tracer_options_of(const struct tracer_settings *settings,
                                        const struct tracer_limits *limits);

/* Notes the number of pixels of the requested pictures, for tracers (by number) that depend on it. Other
 * structures are the same for all pictures. */
void tracer_options_note_picture(struct tracer_options *options, unsigned tracer, uint64_t pixels);

/* Whether one tracer serves both, so that a picture by one may continue with the other. */
bool tracer_options_same(const struct tracer_options *a, const struct tracer_options *b);

struct tracer_stats {
    uint64_t device_bytes;   /* memory of the structure */
    uint64_t uploaded_bytes; /* by the last update */
    uint64_t nodes;          /* elements of the structure */
    uint64_t nodes_rebuilt;  /* by the last update */
    uint64_t nodes_refitted;
    uint32_t parts_built;  /* by the last update: a bit for each part of the structure */
    uint64_t traversal_ns; /* `reference`: of the last wave or part, in Embree alone, without copies from and to
                              the device */
};

struct tracer {
    const struct tracer_impl *impl;
    struct gpu_device *device;
    struct tracer_options options;
    struct tracer_stats stats;
    /* Set by the wrappers: */
    bool updated;              /* the structure is that of some revision */
    bool updating;             /* an update has begun and has not ended */
    uint64_t step_end_ns;      /* when the current step of an update should end: for step_is_over() */
    struct trace_state *state; /* for waves traced at once; NULL: none was yet */
};

/* Arguments of an update. */
struct tracer_update {
    unsigned changed; /* enum scene_change: all changes since the last completed update of this tracer */
    /* The view to build the structure for; NULL where the tracer does not depend on it. A tracer that needs it
     * after the step copies it. */
    const struct trace_view *view;
    struct stage_times *times; /* the step's spans are added to it; may be NULL */
};

/* A structure that a tracer builds from the rays of one wave, and its progress. It serves one wave after
 * another, and keeps its buffers from wave to wave and from frame to frame. It refers to no tracer, but works
 * with every one of the same implementation and options. An implementation that needs more begins its own
 * struct with this one. */
struct trace_state {
    const struct tracer_impl *impl;
    struct gpu_device *device;
    struct tracer_options options;
    /* Set by the wrappers: */
    struct wave wave; /* in progress */
    bool in_progress; /* the wave has begun and is not complete */
    bool has_traced;  /* a wave was completed since the reset */
    bool patient;     /* rays took too long to be queued: the tracer waits for each dispatch, until the reset */
    uint32_t traced_rays; /* rays before this one have their final answers */
    /* When the step ends, and the end of the range being traced, to which trace_range() may shorten it, at a
     * multiple of minimum_rays. */
    uint64_t step_end_ns;
    uint32_t range_end;
    /* Rays that the next step may have, by family, for tracers that trace ranges; 0: unknown. */
    uint32_t step_rays[WAVE_FAMILIES];
};

struct tracer_impl {
    const char *name;
    /* enum scene_change: the inputs of the structure. `update` is called when one of these changed, and for the
     * first structure; with CHANGED_VIEW among them each view has a tracer of its own. */
    unsigned depends_on;
    bool sampled; /* hits of meshes and spheres are stored samples (HIT_SAMPLED) */
    /* The structure knows the scene only as the shutter opens: rays must have no times where something moves
     * while it is open. */
    bool still;
    bool traces_on_host; /* fetches the rays: the caller must know how many there are */
    /* Its first hits are those of the rasteriser, so fast that the device decides which way is faster. */
    bool finds_first_hits;
    /* Granularity of trace_range(): ranges begin at multiples of it, so that rays that are traversed together
     * stay together, and have no fewer rays unless the wave ends. 0: 1. */
    uint32_t minimum_rays;

    /* ---- the structure ---- */

    /* NULL and *error: the options are invalid (ERROR_INVALID names the field), or there is no memory. */
    struct tracer *(*create)(struct gpu_device *device, const struct tracer_options *options, struct error *error);
    void (*destroy)(struct tracer *tracer);
    /* Runs a step of an update of the structure to the scene, until about tracer->step_end_ns; update->changed has
     * only bits that the tracer depends on, all of them at first. After TRACER_MORE it is called again with the
     * same scene, view and bits; scene->motion may be read in the first step only. The tracer keeps its progress
     * in its own struct: other buffers may be bound between two steps. Reports the times of the step as
     * STAGE_BUILD and STAGE_UPLOAD, and keeps the stats' device_bytes true. Stats of the last update are 0 when
     * the first step begins. After TRACER_FAILED the structure is empty. */
    enum tracer_progress (*update)(struct tracer *tracer, struct gpu_scene *scene,
                                   const struct tracer_update *update, struct error *error);
    /* Drops an unfinished update and the whole structure; the next update is a first one. NULL: an update is
     * always one step. */
    void (*abandon)(struct tracer *tracer);
    /* Adds rows that describe the structure after the last update, at most STRUCTURE_ROWS_MAX. NULL: none. */
    void (*report)(const struct tracer *tracer, struct structure_rows *rows);
    /* Whether the next step of the update would only wait for threads of the tracer's own. NULL: never. */
    bool (*waits)(struct tracer *tracer);

    /* ---- waves: the scene's buffers are bound; work is queued and not waited for, unless the CPU does it ---- */

    /* Makes and frees the state of waves. `create` leaves the members of struct trace_state zero; the wrapper sets
     * them. All three NULL: the struct trace_state is enough. */
    struct trace_state *(*state_create)(struct gpu_device *device, const struct tracer_options *options,
                                        struct error *error);
    void (*state_destroy)(struct trace_state *state);
    uint64_t (*state_device_bytes)(const struct trace_state *state);
    /* Describe the waves since the reset, of which there is at least one: the first begins to copy the device's
     * counts, the second adds rows from the copy, and waits for no more than that. Both NULL: none. */
    bool (*state_copy_counts)(struct trace_state *state, struct error *error);
    bool (*state_report)(struct trace_state *state, struct structure_rows *rows, struct error *error);
    /* Begins state->wave: makes the decisions for the whole wave. NULL: there are none. */
    bool (*trace_begin)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        struct error *error);
    /* Exactly one of trace_range and trace_step finds the intersections (shared/hit.h) or visibilities of
     * state->wave. trace_range: for tracers that trace one ray, or one packet, independently of others. Traces
     * the rays of the range; the wrapper chooses ranges that fit a step and calls it for one after another.
     * Where the cost of a ray has no bound, it ends the range early, once the step is over (see range_end). */
    bool (*trace_range)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        const struct ray_range *rays, struct error *error);
    /* trace_step: for tracers that advance in another way, by batches of triangles for example. Runs until
     * about `step_end_ns` (STEP_WITHOUT_END: to the end). Answers are valid from TRACER_DONE on; waves of other
     * states may be traced between two steps. A wave may also be dropped: then the next call is trace_begin. */
    enum tracer_progress (*trace_step)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                       uint64_t step_end_ns, struct error *error);
    /* Gets the programs that a wave of this kind needs, and no others, to announce them (gpu_program_announce).
     * NULL: none is announced. */
    void (*announce)(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave);
    /* Turns the intersections of these rays of a WAVE_CLOSEST into hits, in place: the shading reads hits.
     * NULL: an intersection names a primitive of the scene, and trace_surfaces() (trace/program.h) does it.
     * Sampled tracers run a program of their own, shaders/<tracer>/surface.comp. */
    bool (*surfaces)(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                     struct error *error);

    /* ---- layers: for a tracer whose structure is a picture of the view's surfaces; otherwise both NULL ---- */

    /* Gets the view whose pixels are the texels of the layers after the last update: the eye and direction of
     * the requested view, with a margin round it; and the number of layers. False: with these options the
     * structure is no picture of one view. */
    bool (*texel_view)(const struct tracer *tracer, struct trace_view *texels, uint32_t *layers);
    /* Intersects rays that begin at the eye of that view, some of them dead, with the surfaces that the layer
     * holds at the texels they pass through. A miss where it holds none, and with wave.within_reach where no
     * eye within the radius of the structure sees them. */
    bool (*layer_hits)(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                       uint32_t layer, struct error *error);
    /* Finds where the rays of some eyes meet the layers faster than trace_range() would. Both NULL:
     * unsupported. finds_eyes: whether these eyes qualify. eye_hits: queues the work. */
    bool (*finds_eyes)(const struct tracer *tracer, const struct gpu_scene *scene,
                       const struct frame_uniforms *frame);
    bool (*eye_hits)(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                     const struct eye_rays *rays, struct error *error);
};

/* Defines tracer_bvh_impl and its siblings, one for each row of tracers.def; weak, as a build may leave a
 * tracer out. */
#define TRACER(NAME, name, number, use, needs, doc)                                                               \
    extern const struct tracer_impl tracer_##name##_impl __attribute__((weak));
#include "protocol/tracers.def"

/* Implementations by the protocol's tracer number; NULL where this build leaves one out. */
const struct tracer_impl *tracer_impl_by_number(unsigned number);
/* Finds an implementation by number; if there is none, ERROR_UNSUPPORTED with the reason and the remedy. */
const struct tracer_impl *tracer_find(unsigned number, const char *field, struct error *error);

/* Whether the tracer can show motion while the shutter is open, if there is any; otherwise ERROR_UNSUPPORTED. */
bool tracer_check_motion(const struct tracer_impl *impl, const struct gpu_scene *scene, struct error *error);

struct tracer *tracer_create(const struct tracer_impl *impl, struct gpu_device *device,
                             const struct tracer_options *options, struct error *error);
void tracer_destroy(struct tracer *tracer); /* accepts NULL */
/* Memory of the structure, and of the state of waves traced at once. */
uint64_t tracer_device_bytes(const struct tracer *tracer);

/* ---- updates ---- */

/* Runs one step of about `step_ns` (STEP_NS; 0: the smallest one; STEP_WITHOUT_END: all of it). The scene, its
 * arrays and the view must not change until the update is done or abandoned. Bits that the tracer does not depend
 * on are ignored: where no other changed, nothing is called. In the first update, and in the first one after a
 * failed or abandoned one, everything counts as changed. A tracer that depends on the view is refused without one,
 * ERROR_INTERNAL. */
enum tracer_progress tracer_update_step(struct tracer *tracer, struct gpu_scene *scene,
                                        const struct tracer_update *update, uint64_t step_ns, struct error *error);
/* Whether the next step would only wait. */
bool tracer_update_waits(struct tracer *tracer);
/* Drops an update in progress, if any. */
void tracer_update_abandon(struct tracer *tracer);
/* Runs all steps at once. */
bool tracer_update(struct tracer *tracer, struct gpu_scene *scene, const struct tracer_update *update,
                   struct error *error);
/* Adds rows that describe the structure after the last update. */
void tracer_report(const struct tracer *tracer, struct structure_rows *rows);

/* ---- tracing, resumable ---- */

/* Creates a state, which the caller owns. NULL and *error: no memory. */
struct trace_state *trace_state_create(const struct tracer_impl *impl, struct gpu_device *device,
                                       const struct tracer_options *options, struct error *error);
void trace_state_destroy(struct trace_state *state); /* accepts NULL */
/* Whether the state was made for this implementation and these options. */
bool trace_state_fits(const struct trace_state *state, const struct tracer_impl *impl,
                      const struct tracer_options *options);
uint64_t trace_state_device_bytes(const struct trace_state *state);
/* Drops the wave in progress, if any, and forgets the measured cost of rays and the counts: for the beginning
 * of a frame. */
void trace_state_reset(struct trace_state *state);
/* Begins a wave, which must fit its buffers (checked; ERROR_INTERNAL). A wave in progress is dropped. */
bool tracer_trace_begin(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave,
                        struct trace_state *state, struct error *error);
/* Runs a step of about `step_ns` (as above) of the wave in progress, from rays to hits or visibilities. The
 * scene's buffers are bound; between two steps others may be. The division into steps depends on the clock, the
 * answers do not: after TRACER_DONE they are identical, to the bit, with those of the whole wave traced at once.
 * After TRACER_FAILED no wave is in progress. */
enum tracer_progress tracer_trace_step(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                       uint64_t step_ns, struct error *error);

/* Begins to copy the counts of the waves since the reset. */
bool trace_state_copy_counts(struct trace_state *state, struct error *error);
/* Adds rows from the copied counts. It does not wait where the host has waited for a later command. */
bool trace_state_report(struct trace_state *state, struct structure_rows *rows, struct error *error);

/* Intersects the rays of a wave with one layer of a structure that is a picture of a view
 * (tracer_impl.layer_hits). The scene's buffers are bound. */
bool tracer_layer_hits(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, uint32_t layer,
                       struct error *error);

/* Whether tracer_eye_hits() supports these eyes. */
bool tracer_finds_eyes(const struct tracer *tracer, const struct gpu_scene *scene,
                       const struct frame_uniforms *frame);
/* Finds where the rays of eyes meet the layers of the view (tracer_impl.eye_hits); the state counts them. The
 * scene's buffers are bound. */
bool tracer_eye_hits(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                     const struct eye_rays *rays, struct error *error);

/* Announces the programs of a wave of this kind (gpu_program_announce); its buffers may be missing. */
void tracer_announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave);

/* ---- tracing at once, with a state of the tracer's own: tests, benchmarks, comparisons ---- */

/* Traces from rays to hits or visibilities: tracer_intersect() and tracer_surfaces(). */
bool tracer_trace(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error);
/* Traverses alone: hits are left as intersections, in which only distance, primitive and instance are set. */
bool tracer_intersect(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave,
                      struct error *error);
/* Turns all intersections of the wave into hits; there is nothing to do for visibilities. */
bool tracer_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error);

#endif
