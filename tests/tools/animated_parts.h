/* SPDX-License-Identifier: MIT */
/* Parts of the roundabout of animated_scene.h: meshes, each about its own origin, in metres, y up. */
#ifndef FARLIGHT_TOOLS_ANIMATED_PARTS_H
#define FARLIGHT_TOOLS_ANIMATED_PARTS_H

#include "glb.h"
#include "gltf_writer.h"
#include "shape.h"

#include <stdint.h>

#define PARTS_JOINTS 4 /* joints of the reed, evenly from its root up */
#define PARTS_REED_HEIGHT 2.6f

enum parts_material { SLATE, CREAM, BLUE, RED, GOLD, COPPER, BRASS, JADE, GLOW, DARK, PARTS_MATERIALS };

extern const struct glb_material parts_materials[PARTS_MATERIALS];

/* These return the mesh's number. */

/* Finishes the shape. */
unsigned parts_mesh(struct gltf_writer *writer, const char *name, struct shape *shape,
                    enum parts_material material);
unsigned parts_lathe(struct gltf_writer *writer, const char *name, const float (*profile)[2], uint32_t count,
                     enum parts_material material);
unsigned parts_platform(struct gltf_writer *writer);
unsigned parts_column(struct gltf_writer *writer);
/* `count` balls on a circle (radius, height) about +y, from one angle to another; the last one is left out. */
unsigned parts_balls(struct gltf_writer *writer, const char *name, const float circle[2], const float angles[2],
                     int count, float radius, enum parts_material material);
/* In the xy plane, with six spokes, 0.85 to the middle of its rim. */
unsigned parts_wheel(struct gltf_writer *writer);
/* For a skin of PARTS_JOINTS; each vertex is moved by two of them at most. */
unsigned parts_reed(struct gltf_writer *writer);
/* A ball with two morph targets: 0 stands up with a waist, 1 grows lobes. */
unsigned parts_blob(struct gltf_writer *writer);

#endif
