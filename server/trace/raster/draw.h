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

/* Sorts of primitives; each has a program of its own. */
enum axes_sort { AXES_TRIANGLES, AXES_TRIANGLES_CUTOUT, AXES_SPHERES };

/* Commands of one sort, first .. first + count - 1, drawn with one call. */
struct axes_run {
    enum axes_sort sort;
    uint32_t first, count;
};

/* Instances of one geometry, drawn together: a draw command of GL, and the id of its first primitive. */
struct axes_command {
    uint32_t vertex_count, instance_count, first_vertex, base_instance;
    uint32_t first_id;
};

/* Bytes uploaded per instance: its place among the primitives, and its draw. */
#define AXES_INSTANCE_BYTES 36

struct axes_draw {
    struct gpu_device *device;
    unsigned vertex_array;
    struct gpu_framebuffer plain; /* without attachments, three layers */
    uint32_t plain_along;         /* texels along a side of it; 0: not made yet */
    struct gpu_buffer drawn;      /* raster/layout.h */
    struct gpu_buffer commands;
    /* Contents of the last list. */
    struct axes_run *runs;
    struct axes_command *listed; /* mirror of `commands` */
    uint32_t *instances;         /* listed instances, ascending */
    uint32_t run_count, drawn_count, command_count;
    uint32_t primitive_count; /* primitives of all instances; ids are 0 .. primitive_count - 1 */
};

void axes_draw_init(struct axes_draw *draw, struct gpu_device *device);
void axes_draw_finish(struct axes_draw *draw); /* leaves it empty */

/* Lists the scene's instances that have primitives, ascending; the caller frees the list. */
bool axes_list_instances(const struct gpu_scene *scene, uint32_t **instances, uint32_t *count,
                         struct error *error);

/* Lists instances[0 .. count - 1] (gpu_scene's), which need not ascend, for the passes that follow. */
bool axes_draw_prepare(struct axes_draw *draw, const struct gpu_scene *scene, const uint32_t *instances,
                       uint32_t instance_count, struct error *error);
enum axes_sort axes_sort_of(const struct geometry *geometry);
/* Binds a framebuffer of three layers without attachments, with `along` texels along a side. */
bool axes_draw_bind_plain(struct axes_draw *draw, uint32_t along, struct error *error);

/* A pass over the listed instances. */
struct axes_pass {
    const char *fragment; /* a shader that reads the output of raster/draw.geom; NULL: depths only */
    /* Defines besides PRIMITIVE_KIND, HAS_CUTOUT and HAS_SPHERES, which follow from what is drawn; end with {0}.
     */
    const struct gpu_define *defines;
    bool cutouts_ignored;             /* every primitive is drawn whole, without cutouts */
    float lower_world[3], cell_world; /* place of the cube */
    uint32_t resolution;              /* texels along a side of the images */
    uint32_t first_row, end_row;      /* rows of each image that are drawn; 0, 0: all */
    float overlap; /* a normal's component along an axis, as a share of its largest one, above which a triangle
                      is in that axis' image; not with ALL_IMAGES */
    /* Sets further uniforms of each program; may be NULL. */
    void (*set)(const void *context, const struct gpu_program *program);
    const void *context;
};
#define AXES_PASS_DEFINES_MAX 12

/* Draws with the framebuffer, the pass's own images and the scene's buffers bound; unbinds the framebuffer. */
bool axes_draw(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
               struct error *error);
/* Draws the primitives with ids first .. end - 1: consecutive ranges up to draw->primitive_count together draw
 * the same as axes_draw(). Does not wait. */
bool axes_draw_range(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
                     uint32_t first, uint32_t end, struct error *error);
/* The index in `listed` of the command that has this id; the list is not empty. */
uint32_t axes_draw_command_of(const struct axes_draw *draw, uint32_t id);

#endif
