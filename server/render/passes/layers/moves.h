/* SPDX-License-Identifier: MIT */
/* Places of objects and the camera a frame earlier and a frame later, for the layer `motion`. */
#ifndef FARLIGHT_RENDER_PASSES_LAYERS_MOVES_H
#define FARLIGHT_RENDER_PASSES_LAYERS_MOVES_H

#include "gpu/buffer.h"
#include "gpu/program.h"
#include "gpu_scene/scene.h"
#include "render/context/request.h"

struct moves {                   /* an all-zero one has none */
    struct gpu_buffer instances; /* shared/layers.h: struct move */
    struct gpu_buffer vertices;
    bool has_any; /* else only the camera moves */
};

/* Finds them for a copy that has just been updated to `motion`, which is read now and not later. NULL, or one
 * without neighbours: objects stand still. ERROR_OUT_OF_MEMORY; ERROR_LIMIT: a buffer would be too large for
 * the device. */
bool moves_find(struct moves *moves, const struct gpu_scene *gpu, const struct scene_motion *motion,
                struct error *error);
/* Binds them, and sets the cameras, for render/layers_motion.comp, which is in use. */
void moves_bind(const struct moves *moves, const struct frame_request *request, const struct gpu_program *program);
uint64_t moves_device_bytes(const struct moves *moves);
void moves_finish(struct moves *moves, struct gpu_device *device);

#endif
