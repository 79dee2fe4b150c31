/* SPDX-License-Identifier: MIT */
/* A view's last picture, kept for the next one: for each pixel its light, the number of samples that it is
 * worth, and the guide; and the camera. The next frame finds there the places that it sees again (Schied et
 * al. Spatiotemporal Variance-Guided Filtering. HPG 2017, 4.1). README.md has the conditions. */
#ifndef FARLIGHT_RENDER_PASSES_DENOISE_HISTORY_H
#define FARLIGHT_RENDER_PASSES_DENOISE_HISTORY_H

#include "render/context/wave.h"
#include "render/passes/denoise/places.h"
#include "render/picture/picture.h"

struct denoise_kept {
    struct gpu_buffer pixels; /* uvec4 a pixel, row by row: shaders/render/denoise_reproject.comp */
    struct frame_uniforms uniforms;
    struct frame_request request;
    uint64_t showing, revision; /* `showing` of frame_scene, and the scene's revision */
    struct denoise_places places;
    bool whole; /* a whole picture is kept */
};

struct denoise_history {
    struct denoise_kept kept[2];
    uint32_t now;    /* the one that the current frame is written to; the other one is of the picture before */
    bool is_written; /* the frame that is rendered writes it */
    bool is_used;    /* the frame that is rendered uses it */
    uint32_t moving; /* frames so far: each has noise of its own */
    bool is_moving;  /* the current frame, or the last one, moves */
    /* DENOISE_MOVED_TEXELS an instance, where some have moved since the picture before. */
    struct gpu_buffer moved;
    bool things_moved; /* `moved` is not empty */
};

/* Called once the contents of the frame are known. `goes_on`: it adds samples to the last written picture,
 * and follows the one before that. */
bool denoise_history_begin(struct denoise_history *history, struct render_frame *frame, uint64_t showing,
                           bool goes_on, struct error *error);
/* Motion of instances since the previous picture; NULL: none. */
struct gpu_buffer *denoise_history_moved(struct denoise_history *history);
/* `fits`: the picture is filtered in one strip, and the guides are those of first hits; others have no history.
 * `has_motion`: of each pixel it is known how it has moved. False: there is no memory. */
bool denoise_history_reserve(struct denoise_history *history, const struct render_frame *frame, bool fits,
                             bool has_motion, struct error *error);
/* Binds the history for the pass that reprojects, for a picture of this many samples. */
void denoise_history_bind(struct denoise_history *history, const struct render_frame *frame,
                          const struct gpu_program *program, uint32_t samples);
/* The current picture, behind that pass. */
struct gpu_buffer *denoise_history_pixels(struct denoise_history *history);
void denoise_history_end(struct denoise_history *history);
uint64_t denoise_history_device_bytes(const struct denoise_history *history);
void denoise_history_finish(struct denoise_history *history, struct gpu_device *device);

#endif
