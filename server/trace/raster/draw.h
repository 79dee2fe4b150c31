/* SPDX-License-Identifier: MIT */
/* Draws instances into three images at once, along the axes of the world (shaders/raster): for tracers that are
 * built by rasterising the scene. GL thread. */
#ifndef FARLIGHT_TRACE_RASTER_DRAW_H
#define FARLIGHT_TRACE_RASTER_DRAW_H

#include "base/error.h"
#include "gpu/program.h"
#include "gpu/texture.h"
#include "raster/layout.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* What is drawn by one program. */
enum axes_sort { AXES_TRIANGLES, AXES_TRIANGLES_CUTOUT, AXES_SPHERES };

/* Instances of one sort, drawn with one call: commands first .. first + count - 1. */
struct axes_run {
    enum axes_sort sort;
    uint32_t first, count;
};

/* Instances of one geometry, drawn together: as GL has it, and the id of their first primitive. */
struct axes_command {
    uint32_t vertex_count, instance_count, first_vertex, base_instance;
    uint32_t first_id;
};

/* What a build uploads for each instance: its place among the primitives, and its draw. */
#define AXES_INSTANCE_BYTES 36

struct axes_draw {
    struct gpu_device *device;
    unsigned vertex_array;
    struct gpu_framebuffer plain; /* without attachments, three layers */
    uint32_t plain_along;         /* its texels along a side; 0: not made yet */
    struct gpu_buffer drawn;      /* raster/layout.h */
    struct gpu_buffer commands;
    /* Of what was listed last. */
    struct axes_run *runs;
    struct axes_command *listed; /* mirror of `commands` */
    uint32_t *instances;         /* that were listed, ascending */
    uint32_t run_count, drawn_count, command_count;
    uint32_t primitive_count; /* of all instances; their ids are 0 .. primitive_count - 1 */
};

void axes_draw_init(struct axes_draw *draw, struct gpu_device *device);
void axes_draw_finish(struct axes_draw *draw); /* leaves it empty */

/* Those of the scene's instances that have primitives, ascending; the caller frees the list. */
bool axes_list_instances(const struct gpu_scene *scene, uint32_t **instances, uint32_t *count,
                         struct error *error);

/* Lists instances[0 .. count - 1] (gpu_scene's), which need not ascend, for the passes that follow. */
bool axes_draw_prepare(struct axes_draw *draw, const struct gpu_scene *scene, const uint32_t *instances,
                       uint32_t instance_count, struct error *error);
enum axes_sort axes_sort_of(const struct geometry *geometry);
/* A framebuffer of three layers without attachments, so many texels along a side. */
bool axes_draw_bind_plain(struct axes_draw *draw, uint32_t along, struct error *error);

/* One pass over what is listed. */
struct axes_pass {
    const char *fragment; /* a shader that takes what raster/draw.geom gives; NULL: depths only */
    /* Besides PRIMITIVE_KIND, HAS_CUTOUT and HAS_SPHERES, which are set as what is drawn asks for it; ends with
     * {0} */
    const struct gpu_define *defines;
    bool cutouts_ignored;             /* nothing is cut out: every primitive is drawn whole */
    float lower_world[3], cell_world; /* of the cube */
    uint32_t resolution;              /* texels along a side of the images */
    uint32_t first_row, end_row;      /* of each image, what is drawn; 0, 0: all */
    float overlap; /* of the largest component of a normal, to be in an axis' image; without ALL_IMAGES */
    /* Sets further uniforms of each program; may be NULL */
    void (*set)(const void *context, const struct gpu_program *program);
    const void *context;
};
#define AXES_PASS_DEFINES_MAX 12

/* The framebuffer and the pass's own images are bound, and the scene's buffers; draws, and unbinds the
 * framebuffer. */
bool axes_draw(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
               struct error *error);
/* Of the pass, what the primitives with the ids first .. end - 1 are drawn to: ranges that follow one another up
 * to draw->primitive_count draw what axes_draw() does. Does not wait. */
bool axes_draw_range(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
                     uint32_t first, uint32_t end, struct error *error);
/* Which of `listed` a primitive's id is of; there are some. */
uint32_t axes_draw_command_of(const struct axes_draw *draw, uint32_t id);

#endif
