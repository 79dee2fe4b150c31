/* SPDX-License-Identifier: MIT */
/* Writes a small binary glTF: meshes with one material each, lights, one camera. */
#ifndef FARLIGHT_TOOLS_GLB_H
#define FARLIGHT_TOOLS_GLB_H

#include "shape.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

struct glb_material {
    const char *name;
    float base_colour[4];
    float metallic, roughness;
    float transmission, ior; /* 0: opaque */
    float emission[3];       /* may exceed 1 */
};

struct glb_part {
    const char *name;
    struct shape shape;
    struct glb_material material;
};

struct glb_light {
    const char *kind; /* "point" or "directional" */
    float colour[3], intensity;
    float position[3];
};

struct glb_camera {
    float eye[3], look_at[3];
    float fov_y; /* radians */
};

/* Returns false and has said why on stderr. */
bool glb_write(const char *path, const struct glb_part *parts, size_t part_count, const struct glb_light *lights,
               size_t light_count, const struct glb_camera *camera);

/* The pieces of it, for files with more in them. */

/* Prints an element of "materials". */
void glb_print_material(FILE *json, const struct glb_material *material);
/* Rotation whose -z looks from eye to look_at with +y up, as a quaternion x y z w. */
void glb_look_rotation(float q[4], const struct glb_camera *camera);
/* A file of JSON and one buffer, a multiple of four bytes long. Returns false and has said why on stderr. */
bool glb_write_chunks(const char *path, const char *json, size_t json_bytes, const void *binary,
                      size_t binary_bytes);

#endif
