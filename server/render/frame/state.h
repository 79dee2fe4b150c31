/* SPDX-License-Identifier: MIT */
/* Private to renderer.c, work.c, begin.c, key.c and frame.c: the shared resources of a scene's renderers, those of
 * each, and the state of its frame. */
#ifndef FARLIGHT_RENDER_FRAME_STATE_H
#define FARLIGHT_RENDER_FRAME_STATE_H

#include "render/compare/waves.h"
#include "render/context/context.h"
#include "render/passes/denoise/filter.h"
#include "render/frame/frame.h"
#include "render/passes/key_view/key_view.h"
#include "render/passes/layers/layers.h"
#include "render/picture/picture.h"
#include "render/passes/primary/primary.h"
#include "render/frame/slices.h"
#include "render/frame/slices_ahead.h"
#include "render/frame/tracer_set.h"
#include "render/waves/shading.h"

enum frame_phase {
    PHASE_IDLE,
    PHASE_UPDATE,
    PHASE_BUILD,
    PHASE_SAMPLE,
    PHASE_RASTER,
    PHASE_SLICE,
    PHASE_PRIMARY,
    PHASE_LAYERS,
    PHASE_SHADE,
    PHASE_TRACE,
    PHASE_LAND,
    PHASE_KEEP,
    PHASE_DENOISE,
    PHASE_RESOLVE
};

struct frame_scene {
    struct gpu_device *device;
    struct gpu_scene copy;
    struct change_history changes;                  /* of the copy */
    struct tracer_set tracers;                      /* that depend on the scene alone */
    uint64_t step_ns;                               /* of bringing them to the scene */
    struct environment environment, no_environment; /* the latter for scenes that their lamps light */
    struct environment_choice environment_choice;
    uint64_t showing;        /* counts up when the copy is of something else: a revision, poses */
    uint32_t frames;         /* in progress, of all renderers */
    struct frame_work *idle; /* owned: what frames that have ended leave to those that begin */
    uint32_t idle_count;
};

/* The state of a frame while it is in progress, of which nothing is kept. */
struct frame_work {
    struct frame_work *next; /* idle */
    struct wave_passes passes;
    struct trace_state *trace_state;     /* of its waves; NULL: no frame has traced any yet */
    struct trace_state *key_trace_state; /* of the rays of eyes that are made from layers; likewise */
    struct render_context context;
    struct primary primary;
    struct layers layers;
    struct denoise_filter denoise;
    struct slices_ahead ahead;
    struct comparison *comparison; /* NULL: the last frame asked for none */
    /* Two bands of the picture on their way to the host: while one is fetched, the next is copied. */
    struct gpu_readback copies[2];
};

struct frame_renderer {
    struct gpu_device *device;
    struct frame_scene *shared;
    struct picture picture;
    struct denoise_sums denoise; /* of a picture that is denoised */
    struct denoise_history history;
    struct key_view key;       /* of frames whose eyes are made from layers */
    struct tracer_set tracers; /* that depend on the view: no other renderer's frames may use them */
    const struct tracer_impl *stand_in;
    unsigned stand_in_number;
    uint32_t wanted_slice_pixels, wanted_wave_rays; /* 0: chosen */
    bool queues_ahead;                              /* see counts_on_host of the context */
    uint32_t waves_needed;                          /* by a slice of this renderer, where more than were queued */
    /* the frame in hand */
    enum frame_phase phase;
    struct frame_work *work; /* owned until it ends */
    struct trace_view view;
    const struct scene *scene;         /* until the copy is of it */
    const struct scene_motion *motion; /* the same; NULL: nothing moves */
    struct tracer *tracer, *second;    /* held; NULL: none */
    struct tracer *key_tracer;         /* likewise, of the structure that eyes are made from */
    bool built;                        /* `tracer` is what the scene is */
    bool second_built;                 /* the same of `second` */
    bool key_built;                    /* and of `key_tracer` */
    struct frame_request request;      /* the frame's; the context has that of the pass in hand (key.c) */
    uint32_t pass;          /* with a key tracer: the layer that is rendered, or, behind the last, the eyes */
    struct picture *target; /* that gets the samples: `picture`, or the sums of the key view */
    uint32_t eyes_samples_before; /* samples_before, while layers are rendered */
    bool announced;               /* are the programs of the pass that is being reserved */
    bool announced_early;         /* and those that depend on no structure */
    bool announced_first;         /* and what depends on materials alone */
    bool rasterise;
    uint32_t strip_rows; /* that are rasterised together */
    uint32_t sample_shift_max;
    uint32_t samples_before; /* that the picture holds of the frames that this one goes on from */
    uint32_t sample;         /* samples of this frame that are done */
    uint32_t plane, band;    /* of the picture that is handed out next */
    bool copying;            /* copies[copied % 2] is on its way, of these: */
    uint32_t copied, copied_plane, copied_band;
    struct slices slices;
    uint32_t slice_rays_max; /* that the buffers are for */
    /* the last frame that was finished, whose sum the picture holds */
    struct frame_request kept_request;
    uint32_t kept_samples; /* 0: there is none */
    uint64_t kept_showing;
    struct frame_result result; /* counts, until the last step hands it out */
};

/* work.c. One that has what that integrator needs, if there is one. */
struct frame_work *frame_work_take(struct frame_scene *shared, const struct integrator *integrator,
                                   struct error *error);
void frame_work_give(struct frame_scene *shared, struct frame_work *work); /* accepts NULL */
void frame_work_finish(struct frame_scene *shared);                        /* all that are idle */
/* Makes one of the work's trace states one for these, where it is not. */
bool frame_work_trace_by(struct frame_work *work, struct trace_state **state, const struct tracer *tracer,
                         struct error *error);
uint64_t frame_work_device_bytes(const struct frame_work *work);
/* renderer.c. Which set a tracer belongs to follows from what it depends on. */
struct tracer_set *frame_tracers(struct frame_renderer *renderer, const struct tracer_impl *impl);
/* begin.c. Its stand-in, if it has one. */
const struct tracer_impl *frame_find_tracer(const struct frame_renderer *renderer, unsigned number,
                                            const char *field, struct error *error);
/* key.c */
#define PASS_UNKNOWN UINT32_MAX
#define PASS_MARK (UINT32_MAX - 1) /* eyes are intersected, to know what they look at, before it is rendered */
bool frame_is_from_layers(const struct frame_request *request);
struct frame_camera frame_key_camera(const struct frame_request *request);
bool frame_is_layer_pass(const struct frame_renderer *renderer);
bool frame_is_mark_pass(const struct frame_renderer *renderer); /* a pass over the eyes as well */
bool frame_is_eyes_pass(const struct frame_renderer *renderer);
/* The pass over the eyes, once the frame is ready for it. */
struct key_eyes frame_key_eyes(const struct frame_renderer *renderer);
void frame_key_announce(struct frame_renderer *renderer);
bool frame_key_begin_slice(struct frame_renderer *renderer, struct error *error);
/* All eyes are intersected: goes on to the layers. */
bool frame_key_end_marks(struct frame_renderer *renderer, struct error *error);
/* Of a layer of which only tiles are rendered: as many rows as the picture of those has. */
void frame_key_limit_rows(const struct frame_renderer *renderer, struct frame_request *request);
/* Takes the tracer of the key view's structure. */
bool frame_key_take(struct frame_renderer *renderer, struct error *error);
/* Sets the context to the pass in hand, once the tracers are built: request, tracer, and what gets the samples. */
bool frame_key_set_pass(struct frame_renderer *renderer, struct error *error);
/* A step of keeping a layer whose samples are all there; then the next pass. */
bool frame_key_keep(struct frame_renderer *renderer, struct error *error);
/* A step of finding the radiance of a slice of eyes. */
bool frame_key_find(struct frame_renderer *renderer, bool *done, struct error *error);
/* Rows of the structure: what the eyes' rays were like. */
bool frame_key_tell(struct frame_renderer *renderer, struct error *error);
/* begin.c. A step of bringing the tracers to the scene; the last one leaves the frame ready for its first
 * sample. */
bool frame_build(struct frame_renderer *renderer, struct error *error);
/* begin.c. Releases the shared resources of the current frame. */
void frame_end(struct frame_renderer *renderer);
/* begin.c. Reserves buffers for slices of slices.slice_rays and waves of context.wave_capacity rays. */
bool frame_reserve_waves(struct frame_renderer *renderer, struct error *error);
/* begin.c. A step of bringing the scene to the device; after the last one the tracers have their first. */
bool frame_update(struct frame_renderer *renderer, struct error *error);
/* A step of reserving picture.pixels, which has them or not; false: there is no memory. */
bool frame_reserve_pixels(struct frame_renderer *renderer, struct error *error);

#endif
