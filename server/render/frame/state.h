/* SPDX-License-Identifier: MIT */
/* Private to frame/: the shared state of a scene's renderers, that of each of them, and that of a frame. */
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

/* The next action of the pass over samples. */
enum samples_phase { SAMPLES_BEGIN, SAMPLES_RASTER, SAMPLES_SLICE, SAMPLES_PASSES, SAMPLES_LAND };

struct frame_scene {
    struct gpu_device *device;
    struct gpu_scene copy;
    struct change_history changes;                  /* changes of the copy */
    struct tracer_set tracers;                      /* tracers that depend on the scene alone */
    uint64_t step_ns;                               /* time of a step that brings them to the scene */
    struct environment environment, no_environment; /* the latter for scenes that their lamps light */
    struct environment_choice environment_choice;
    uint64_t showing;        /* counts the contents of the copy: revisions, poses */
    uint32_t frames;         /* in progress, of all renderers */
    struct frame_work *idle; /* owned: the resources that ended frames leave to those that begin */
    uint32_t idle_count;
};

/* The state of a frame in progress; none of it is kept. */
struct frame_work {
    struct frame_work *next;             /* idle */
    struct trace_state *trace_state;     /* state of its waves; NULL: no frame has traced any yet */
    struct trace_state *key_trace_state; /* state of rays of eyes that are made from layers */
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
    struct denoise_sums denoise; /* sums of a picture that is denoised */
    struct denoise_history history;
    struct key_view key;       /* for frames whose eyes are made from layers */
    struct tracer_set tracers; /* tracers that depend on the view: no other renderer's frames may use them */
    const struct tracer_impl *stand_in;
    unsigned stand_in_number;
    uint32_t wanted_slice_pixels, wanted_wave_rays; /* 0: chosen */
    bool queues_ahead;     /* counts_on_host of the device is false, where the request allows it */
    uint32_t waves_needed; /* by a slice of this renderer, where more than were queued */
    /* the frame in progress */
    enum frame_phase phase;
    enum samples_phase samples_phase;
    size_t slice_pass;       /* the pass over the slice that is in progress */
    bool begun_building;     /* every tracer has had its first step */
    struct frame_work *work; /* owned until the frame ends */
    struct trace_view view;
    const struct scene *scene;         /* until the copy is of it */
    const struct scene_motion *motion; /* kept until then; NULL: all stands still */
    struct tracer *tracer, *second;    /* held; NULL: none */
    struct tracer *key_tracer;         /* the tracer of the structure that eyes are made from */
    bool built;                        /* `tracer` is up to date with the scene */
    bool second_built;                 /* `second` is */
    bool key_built;                    /* `key_tracer` is */
    struct frame_request request; /* the frame's; work->frame has that of the picture that is rendered (key.h) */
    uint32_t pass;          /* with a key tracer: the layer that is rendered, or, behind the last, the eyes */
    struct picture *target; /* the picture that gets the samples: `picture`, or the sums of the key view */
    uint32_t eyes_samples_before; /* samples_before, while layers are rendered */
    bool announced;               /* programs of the picture that is being reserved are announced */
    bool announced_early;         /* programs that depend on no structure are */
    bool announced_first;         /* the program that depends on materials alone is */
    uint32_t samples_before;      /* samples in the picture from earlier frames that this one continues */
    uint32_t sample;              /* samples of this frame that are done */
    uint32_t plane, band;         /* the band that is handed out next */
    bool copying;                 /* copies[copied % 2] is on its way, with these parameters: */
    uint32_t copied, copied_plane, copied_band;
    struct slices slices;
    uint32_t slice_rays_max; /* rays of a slice that the buffers are for */
    /* the last frame that was finished, whose sum the picture holds */
    struct frame_request kept_request;
    uint32_t kept_samples; /* 0: there is none */
    uint64_t kept_showing;
    struct frame_result result; /* counts, until the last step hands it out */
};

#endif
