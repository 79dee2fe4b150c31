/* SPDX-License-Identifier: MIT */
/* The kind of scene that the stackless sphere tree's paper measures distributed ray tracing with: 1,767
 * primitives. A textured disc as the ground, 64 loose spheres (rough, glossy, glass, mirror), a sphereflake of
 * 820, a blob of 882 triangles, and three lights that have a size. */
#ifndef FARLIGHT_TESTS_PAPER_SCENE_H
#define FARLIGHT_TESTS_PAPER_SCENE_H

#include "render/frame/frame.h"
#include "scene/pose.h"
#include "scene/scene.h"

#define PAPER_SCENE_PRIMITIVES 1767

/* NULL: no memory. The caller destroys it. */
struct scene *paper_scene_create(void);
/* Looks at all of it, with the plane in focus through the sphereflake; 640x480, everything else zero. */
void paper_scene_request(struct frame_request *request);
/* While the shutter is open some of the loose spheres fall and the blob turns. False: no memory. To be finished
 * either way. */
bool paper_scene_motion(struct scene_motion *motion);
void paper_scene_motion_finish(struct scene_motion *motion);

#endif
