/* SPDX-License-Identifier: MIT */
/* Embree's instances: their transform in each pose, and whether Embree can compute with them. */
#include "trace/reference/tracer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* World coordinates up to which rays must be usable; otherwise the scene is refused. */
#define REACH_MIN 1e9

static bool resize_instances(struct reference *reference, uint32_t count)
{
    for (uint32_t i = count; i < reference->instance_count; i++) {
        rtcDetachGeometry(reference->top, i + 1);
        rtcReleaseGeometry(reference->instances[i].geometry);
        free(reference->instances[i].world_from_object);
    }
    if (count < reference->instance_count)
        reference->instance_count = count;
    struct reference_instance *instances =
        realloc(reference->instances, ((size_t)count + 1) * sizeof(*reference->instances));
    if (!instances)
        return false;
    reference->instances = instances;
    for (uint32_t i = reference->instance_count; i < count; i++) {
        instances[i] =
            (struct reference_instance){.geometry = rtcNewGeometry(reference->device, RTC_GEOMETRY_TYPE_INSTANCE)};
        if (!instances[i].geometry)
            return false;
        rtcAttachGeometryByID(reference->top, instances[i].geometry, i + 1);
        reference->instance_count = i + 1;
    }
    return true;
}

static double determinant(const float *m)
{
    return (double)m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]) -
           (double)m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]) +
           (double)m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
}

/* The largest world coordinate that Embree can transform to the instance's space. It computes with coordinates up
 * to 1.844e18 and ends the process at a ray beyond (Debian's is built with its assertions); and it inverts the
 * transform by a determinant in single precision, which must neither vanish nor overflow. 0: it can transform
 * none. */
static float reach_of(const struct instance *instance)
{
    const float *m = instance->world_from_object[0], *inverse = instance->object_from_world[0];
    double lengths = 1.0, reach = REFERENCE_COORDINATE_MAX;
    for (size_t k = 0; k < 3; k++) {
        const double x = m[k], y = m[4 + k], z = m[8 + k];
        const double sum =
            fabs((double)inverse[4 * k]) + fabs((double)inverse[4 * k + 1]) + fabs((double)inverse[4 * k + 2]);
        lengths *= sqrt(x * x + y * y + z * z);
        reach = fmin(reach, (REFERENCE_COORDINATE_MAX - fabs((double)inverse[4 * k + 3])) / sum);
    }
    const double size = fabs(determinant(m));
    bool inverts = size > 1e-30 && lengths < 1e30 && size >= 1e-5 * lengths;
    return inverts && reach >= REACH_MIN ? (float)reach : 0.0f;
}

/* The minimum magnitude of the determinant of a + u (b - a) for u in 0 .. 1, 0 if the sign changes: a cubic
 * polynomial, given by four values, examined at its ends and extrema. */
static double min_determinant(const float *a, const float *b)
{
    double at[4];
    for (int i = 0; i < 4; i++) {
        float m[12];
        for (int k = 0; k < 12; k++)
            m[k] = (float)((double)a[k] + ((double)b[k] - (double)a[k]) * i / 3.0);
        at[i] = determinant(m);
    }
    const double c0 = at[0], c1 = -5.5 * at[0] + 9.0 * at[1] - 4.5 * at[2] + at[3];
    const double c2 = 9.0 * at[0] - 22.5 * at[1] + 18.0 * at[2] - 4.5 * at[3];
    const double c3 = 4.5 * (at[3] - at[0]) + 13.5 * (at[1] - at[2]);
    double lowest = fmin(at[0], at[3]), highest = fmax(at[0], at[3]);
    const double root = sqrt(fmax(c2 * c2 - 3.0 * c3 * c1, 0.0));
    const double turns[3] = {(-c2 + root) / (3.0 * c3), (-c2 - root) / (3.0 * c3), -c1 / (2.0 * c2)};
    for (int i = 0; i < 3; i++) {
        const double u = turns[i]; /* the last counts where c3 is nothing; elsewhere it does no harm */
        if (!(u > 0.0 && u < 1.0))
            continue;
        const double value = ((c3 * u + c2) * u + c1) * u + c0;
        lowest = fmin(lowest, value);
        highest = fmax(highest, value);
    }
    return lowest > 0.0 ? lowest : highest < 0.0 ? -highest : 0.0;
}

/* The reach between two poses: an inverse has no entry above 2 m^2 / determinant, where no entry of the matrix
 * is above m. */
static float reach_between(const float *a, const float *b)
{
    double maximum = 0.0, farthest = 0.0;
    for (int k = 0; k < 12; k++) {
        double *into = k % 4 == 3 ? &farthest : &maximum;
        *into = fmax(*into, fmax(fabs((double)a[k]), fabs((double)b[k])));
    }
    double lengths = 1.0;
    for (int k = 0; k < 3; k++)
        lengths *= fmax(hypot(hypot((double)a[k], (double)a[4 + k]), (double)a[8 + k]),
                        hypot(hypot((double)b[k], (double)b[4 + k]), (double)b[8 + k]));
    const double minimum = min_determinant(a, b);
    const double reach = REFERENCE_COORDINATE_MAX / (6.0 * maximum * maximum / minimum) - farthest;
    bool inverts = minimum > 1e-30 && lengths < 1e30 && minimum >= 1e-6 * lengths;
    return inverts && reach >= REACH_MIN ? (float)reach : 0.0f;
}

static float reach_in_motion(const struct gpu_scene *scene, const struct instance *instance)
{
    uint32_t pose_count;
    const float(*matrices)[12] = gpu_scene_poses(scene, instance, &pose_count);
    float reach = reach_of(instance);
    for (uint32_t p = 1; p < pose_count; p++)
        reach = fminf(reach, reach_between(matrices[p - 1], matrices[p]));
    return reach;
}

/* Passes a moved or changed instance to Embree. */
static bool place_instance(struct reference *reference, const struct gpu_scene *scene, uint32_t i, bool *changed)
{
    struct reference_instance *instance = &reference->instances[i];
    const struct instance *now = &scene->instances[i];
    const struct reference_entry *entry = reference->entries[now->geometry];
    uint32_t pose_count;
    const float(*matrices)[12] = gpu_scene_poses(scene, now, &pose_count);
    size_t bytes = pose_count * sizeof(*matrices);
    bool same_entry = instance->entry == entry && !entry->is_fresh;
    bool same_place = instance->entry && instance->pose_count == pose_count &&
                      memcmp(instance->world_from_object, matrices, bytes) == 0;
    instance->first_primitive = scene->geometries[now->geometry].device.first_primitive;
    if (same_entry && same_place)
        return true;
    float(*copy)[12] = realloc(instance->world_from_object, bytes);
    if (!copy)
        return false;
    memcpy(copy, matrices, bytes);
    instance->world_from_object = copy;
    if (!same_entry)
        rtcSetGeometryInstancedScene(instance->geometry, entry->scene);
    if (instance->pose_count != pose_count)
        rtcSetGeometryTimeStepCount(instance->geometry, pose_count);
    for (uint32_t p = 0; p < pose_count; p++)
        rtcSetGeometryTransform(instance->geometry, p, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, copy[p]);
    rtcCommitGeometry(instance->geometry);
    instance->pose_count = pose_count;
    instance->entry = entry;
    *changed = true;
    return true;
}

static bool find_reach(struct reference *reference, const struct gpu_scene *scene, struct error *error)
{
    reference->coordinate_max = REFERENCE_COORDINATE_MAX;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        float reach = reach_in_motion(scene, &scene->instances[i]);
        if (reach == 0.0f) {
            char field[64];
            snprintf(field, sizeof(field), "node %u.parent_from_node", scene->instances[i].node);
            error_set(
                error, ERROR_UNSUPPORTED, field,
                "its place in the world is scaled, sheared or moved too far, or turns flat between two poses");
            return error_remedy(error,
                                "the tracer reference computes in single precision: choose bvh, or scale by "
                                "more than 1e-9");
        }
        reference->coordinate_max = fminf(reference->coordinate_max, reach);
    }
    /* Embree would silently drop whole instances beyond its range. */
    for (int k = 0; k < 3; k++) {
        const double farthest = fmax(-(double)scene->lower_world[k], (double)scene->upper_world[k]);
        if (scene->instance_count > 0 && farthest > (double)reference->coordinate_max) {
            error_set(error, ERROR_UNSUPPORTED, "tracer",
                      "reference: the scene reaches out to %g, and it sees up to %g", farthest,
                      (double)reference->coordinate_max);
            return error_remedy(error, "choose bvh, or make the scene smaller");
        }
    }
    return true;
}

bool reference_update_instances(struct reference *reference, const struct gpu_scene *scene, bool may_have_moved,
                                bool *changed, struct error *error)
{
    if (may_have_moved && !find_reach(reference, scene, error))
        return false;
    *changed = *changed || reference->instance_count != scene->instance_count;
    if (!resize_instances(reference, scene->instance_count))
        return false;
    for (uint32_t i = 0; may_have_moved && i < scene->instance_count; i++)
        if (!place_instance(reference, scene, i, changed))
            return false;
    if (*changed)
        reference->base.stats.nodes_rebuilt += (uint64_t)scene->instance_count + scene->disc_count;
    return true;
}

void reference_drop_instances(struct reference *reference)
{
    for (uint32_t i = 0; i < reference->instance_count; i++) {
        rtcReleaseGeometry(reference->instances[i].geometry);
        free(reference->instances[i].world_from_object);
    }
    free(reference->instances);
    reference->instances = NULL;
    reference->instance_count = 0;
}
