/* SPDX-License-Identifier: MIT */
/* Divides a scene's instances among the cubes, places the cubes, and finds those that must be rebuilt.
 *
 * Instances that deform, or have moved, changed their shape or reappeared, are dynamic; all others are static. A
 * dynamic instance stays dynamic until the scene's geometry changes, for then cubes are rebuilt anyhow: instances
 * that still move stay dynamic, the rest become static. So the static cube is rebuilt once when something begins
 * to move, and then no longer. */
#ifndef FARLIGHT_TRACE_LDC_PARTS_H
#define FARLIGHT_TRACE_LDC_PARTS_H

#include "base/error.h"
#include "base/hashmap.h"
#include "trace/raster/box.h"
#include "trace/raster/fit.h"
#include "gpu_scene/scene.h"
#include "trace/ldc/store.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stdint.h>

/* An instance as a cube sees it: equal members in equal boxes give equal samples. */
struct ldc_member {
    uint64_t revision, deformed_revision; /* revisions of the geometry */
    uint32_t geometry, deforming_node;    /* unique together with these two */
    uint32_t is_mesh, node;
    float world_from_object[12];
};

struct ldc_part {
    uint32_t *instances; /* indices into the scene's, ascending */
    struct ldc_member *members;
    uint32_t count;
    struct axes_box box; /* the cube's */
    uint32_t resolution; /* resolution of the cube, at most the requested one; 0: there are no instances */
};

/* All-zero is empty. */
struct ldc_parts {
    struct ldc_part parts[LDC_CUBES_MAX];
    struct ldc_record *records; /* records of nodes seen so far */
    uint32_t record_count, record_capacity;
    struct hashmap record_by_node; /* value: its number, plus 1 */
    uint64_t updates;
};

struct ldc_parts_settings {
    const struct tracer *tracer;
    struct axes_request request; /* requested resolution of a cube; lowered where it would have too many samples */
    float overlap;               /* axes_pass.overlap */
};

void ldc_parts_finish(struct ldc_parts *parts); /* leaves it empty */
/* Brings the parts to the scene; `stale` marks those whose instances or box have changed. On failure (no
 * memory, an instance beyond the range of floats, too many layers) their state is undefined: call
 * ldc_parts_finish(). */
bool ldc_parts_update(struct ldc_parts *parts, const struct gpu_scene *scene,
                      const struct ldc_parts_settings *settings, bool geometry_changed, bool stale[LDC_CUBES_MAX],
                      struct error *error);

#endif
