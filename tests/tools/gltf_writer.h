/* SPDX-License-Identifier: MIT */
/* The numbers of a glTF 2.0 file that is put together piece by piece: accessors, meshes, and the samplers and
 * channels of one animation. What fails is kept and said by gltf_finish. */
#ifndef FARLIGHT_TOOLS_GLTF_WRITER_H
#define FARLIGHT_TOOLS_GLTF_WRITER_H

#include "shape.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct gltf_text {
    FILE *stream; /* into `text`, in memory */
    char *text;
    size_t bytes;
    unsigned count; /* number of the array's elements */
};

struct gltf_writer {
    struct gltf_text binary, views, accessors, meshes, samplers, channels;
    bool failed;
};

enum gltf_use { GLTF_NUMBERS = 0, GLTF_VERTICES = 34962, GLTF_INDICES = 34963 };

/* Accessors of a mesh with one primitive. */
struct gltf_geometry {
    unsigned positions, normals, indices;
    int joints, weights;    /* -1: no skin moves it */
    unsigned target_count;  /* at most 2 */
    unsigned targets[2][2]; /* accessors of displacements of positions and of normals */
};

void gltf_begin(struct gltf_writer *writer);
/* Writes everything and `rest`, the other members of the file's object. Releases the writer
 * in any case. Returns false and has said why on stderr. */
bool gltf_finish(struct gltf_writer *writer, const char *path, const char *rest);

/* These return the new element's number. */
unsigned gltf_floats(struct gltf_writer *writer, const float *numbers, size_t count, unsigned width,
                     enum gltf_use use);
unsigned gltf_joints(struct gltf_writer *writer, const uint8_t (*joints)[4], size_t count);
struct gltf_geometry gltf_geometry(struct gltf_writer *writer, const struct shape *shape);
unsigned gltf_mesh(struct gltf_writer *writer, const char *name, const struct gltf_geometry *geometry,
                   unsigned material);

/* `node`'s `path` ("translation", "rotation", "scale", "weights") over time: `key_count` times and as many values
 * of `width` numbers, thrice as many for "CUBICSPLINE". */
struct gltf_curve {
    const char *path, *interpolation;
    const float *times_s, *values;
    size_t key_count;
    unsigned width;
};
void gltf_animate(struct gltf_writer *writer, unsigned node, const struct gltf_curve *curve);

#endif
