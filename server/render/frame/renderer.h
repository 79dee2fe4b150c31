/* SPDX-License-Identifier: MIT */
/* Resources that outlive a frame: those of a scene on the device, and those of each of its viewers. */
#ifndef FARLIGHT_RENDER_FRAME_RENDERER_H
#define FARLIGHT_RENDER_FRAME_RENDERER_H

#include "base/error.h"
#include "gpu/device.h"

#include <stdint.h>

struct tracer_impl;
struct tracer_set;

/* The device's resources of a scene that all its viewers share: its copy, its light, and the tracers in use. */
struct frame_scene;

struct frame_scene *frame_scene_create(struct gpu_device *device, struct error *error);
void frame_scene_destroy(struct frame_scene *shared); /* after its renderers; accepts NULL */
uint64_t frame_scene_device_bytes(const struct frame_scene *shared);

/* The resources of one viewer: the waves and the picture of one frame at a time, and the last one's samples. */
struct frame_renderer;

/* `shared` stays the caller's and outlives the renderer. */
struct frame_renderer *frame_renderer_create(struct frame_scene *shared, struct error *error);
void frame_renderer_destroy(struct frame_renderer *renderer);                /* accepts NULL */
uint64_t frame_renderer_device_bytes(const struct frame_renderer *renderer); /* without the shared state */
/* For frame/ alone: the set that a tracer belongs to, the scene's or the renderer's, by its dependencies. */
struct tracer_set *frame_tracers(struct frame_renderer *renderer, const struct tracer_impl *impl);

#endif
