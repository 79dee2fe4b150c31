/* SPDX-License-Identifier: MIT */
/* Private to frame/: what the renderers of a scene share, what each has, and the state of its frame. */
#ifndef FARLIGHT_RENDER_FRAME_STATE_H
#define FARLIGHT_RENDER_FRAME_STATE_H

#include "render/compare/waves.h"
#include "render/context/wave.h"
#include "render/frame/result.h"
#include "render/frame/slices.h"
#include "render/frame/slices_ahead.h"
#include "render/frame/tracer_set.h"
#include "render/light/environment.h"
#include "render/light/environment_choice.h"
#include "render/passes/denoise/filter.h"
#include "render/passes/key_view/eyes.h"
#include "render/passes/layers/layers.h"
#include "render/passes/primary/primary.h"
#include "render/picture/picture.h"
#include "render/waves/shading.h"
#include "scene/pose.h"

/* The frame's passes, in order (passes.c). */
enum frame_phase {
    PHASE_IDLE,
    PHASE_UPDATE,
    PHASE_BUILD,
    PHASE_SAMPLES,
    PHASE_KEEP,
    PHASE_DENOISE,
    PHASE_OUTPUT,
    PHASE_COUNT
};

/* What the pass over samples does next. */
enum samples_phase { SAMPLES_BEGIN, SAMPLES_RASTER, SAMPLES_SLICE, SAMPLES_PASSES, SAMPLES_LAND };

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
    struct frame_work *next;             /* idle */
    struct trace_state *trace_state;     /* of its waves; NULL: no frame has traced any yet */
    struct trace_state *key_trace_state; /* of the rays of eyes that are made from layers; likewise */
    struct render_device device;
    struct render_frame frame;
    struct render_wave wave;
    /* The passes' states: */
    struct primary primary;
    struct key_eyes eyes;
    struct layers layers;
    struct wave_shading shading;
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
    enum samples_phase samples_phase;
    size_t slice_pass;       /* the pass over the slice that is in progress */
    bool begun_building;     /* every tracer has had its first step */
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
    uint32_t samples_before;      /* that the picture holds of the frames that this one goes on from */
    uint32_t sample;              /* samples of this frame that are done */
    uint32_t plane, band;         /* of the picture that is handed out next */
    bool copying;                 /* copies[copied % 2] is on its way, of these: */
    uint32_t copied, copied_plane, copied_band;
    struct slices slices;
    uint32_t slice_rays_max; /* that the buffers are for */
    /* the last frame that was finished, whose sum the picture holds */
    struct frame_request kept_request;
    uint32_t kept_samples; /* 0: there is none */
    uint64_t kept_showing;
    struct frame_result result; /* counts, until the last step hands it out */
};

#endif
