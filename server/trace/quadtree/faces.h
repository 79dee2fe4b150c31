/* SPDX-License-Identifier: MIT */
/* Places the faces of a view (shaders/quadtree/layout.h), and finds those that see nothing. */
#ifndef FARLIGHT_TRACE_QUADTREE_FACES_H
#define FARLIGHT_TRACE_QUADTREE_FACES_H

#include "gpu_scene/scene.h"
#include "quadtree/layout.h"
#include "trace/quadtree/runs.h"
#include "trace/raster/view.h"
#include "trace/view.h"

#include <stdbool.h>
#include <stdint.h>

/* Places one face, whose texels are the pixels of `texels`. */
void quadtree_place_view(struct quadtree_uniforms *uniforms, const struct trace_view *texels);
/* Places six faces round the eye, with `along` texels along a side; the last but one looks along the view. */
void quadtree_place_cube(struct quadtree_uniforms *uniforms, const struct trace_view *view, uint32_t texels);
/* Drops the faces of a placed cube that no instance of the scene reaches, except for one. */
void quadtree_drop_empty_faces(struct quadtree_uniforms *uniforms, const struct gpu_scene *scene,
                               const struct quadtree_runs *runs);

/* The camera that draws a face. */
struct raster_camera quadtree_face_camera(const struct quadtree_uniforms *uniforms, uint32_t face);
/* Whether an instance lies outside of the camera's frustum. */
bool quadtree_is_beside(const struct raster_camera *camera, const struct gpu_scene *scene, uint32_t instance);
/* Whether one run of an instance lies outside of it. */
bool quadtree_is_run_beside(const struct raster_camera *camera, const struct quadtree_runs *runs,
                            const struct gpu_scene *scene, uint32_t instance, uint32_t run);

#endif
