/* SPDX-License-Identifier: MIT */
/* Divides a scene's instances among the cubes, places the cubes, and finds those that must be rebuilt.
 *
 * Dynamic are instances that deform, and those that have moved, changed their shape or reappeared; all others are
 * static. A dynamic instance stays dynamic until the scene's geometry changes, for then cubes are rebuilt anyhow:
 * instances that still move stay dynamic, the rest become static. So the static cube is rebuilt once when
 * something begins to move, and then no longer. */
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

/* One instance as far as a cube can tell: of equal members in equal boxes the samples are equal. */
struct ldc_member {
    uint64_t revision, deformed_revision; /* of the geometry */
    uint32_t geometry, deforming_node;    /* whose id is unique with these two */
    uint32_t is_mesh, node;
    float world_from_object[12];
};

struct ldc_part {
    uint32_t *instances; /* indices into the scene's, ascending */
    struct ldc_member *members;
    uint32_t count;
    struct axes_box box; /* the cube's */
    uint32_t resolution; /* the cube's, no more than is wanted; 0: there are no instances */
};

/* All-zero is empty. */
struct ldc_parts {
    struct ldc_part parts[LDC_CUBES_MAX];
    struct ldc_record *records; /* of each node that was seen */
    uint32_t record_count, record_capacity;
    struct hashmap record_by_node; /* value: its number, plus 1 */
    uint64_t updates;
};

struct ldc_parts_settings {
    const struct tracer *tracer;
    struct axes_wish wish; /* of a cube's resolution: it is lower where there would be too many samples */
    float overlap;         /* as axes_pass */
};

void ldc_parts_finish(struct ldc_parts *parts); /* leaves it empty */
/* Brings the parts to the scene; `stale` says whose instances or box are others than before. On failure (no
 * memory, an instance is larger than numbers can tell, or there are too many layers) nothing is known of them:
 * finish. */
bool ldc_parts_update(struct ldc_parts *parts, const struct gpu_scene *scene,
                      const struct ldc_parts_settings *settings, bool geometry_changed, bool stale[LDC_CUBES_MAX],
                      struct error *error);

#endif
