/* SPDX-License-Identifier: MIT */
/* Checks spheres and discs. */
#include "scene/edit.h"

#include <float.h>
#include <math.h>

static const char centres_radii_path[] = ".arrays[0] (centres and radii)";

bool spheres_check_shape(const struct scene_spheres *spheres, const struct edit_place *place)
{
    const char *path = centres_radii_path;
    if (!spheres->value.sphere_count)
        return edit_error(place, ERROR_INVALID, ".sphere_count", "a set of spheres has at least one");
    if (!spheres->centres_radii)
        return edit_error(place, ERROR_INVALID, path, "spheres need this array");
    return array_size_check(spheres->centres_radii, spheres->value.sphere_count, 16, path, place) &&
           ranges_check(spheres->ranges, spheres->range_count, spheres->value.sphere_count, place);
}

bool spheres_check_content(struct scene_spheres *spheres, const struct edit_place *place)
{
    const char *path = centres_radii_path;
    const float *values = (const float *)(const void *)spheres->centres_radii->data;
    size_t count = (size_t)spheres->value.sphere_count * 4;
    size_t bad = first_bad_float(values, count, COORDINATE_MAX);
    if (bad != count) {
        edit_error(place, ERROR_INVALID, path, "sphere %zu has %g as component %zu", bad / 4, (double)values[bad],
                   bad % 4);
        return error_remedy(place->error, "numbers must be finite and not beyond 1e18");
    }
    float lower[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, upper[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (size_t i = 0; i < count; i += 4) {
        float radius = values[i + 3];
        if (!(radius > 0.0f))
            return edit_error(place, ERROR_INVALID, path, "sphere %zu has the radius %g, which is not above 0",
                              i / 4, (double)radius);
        for (size_t axis = 0; axis < 3; axis++) {
            lower[axis] = fminf(lower[axis], values[i + axis] - radius);
            upper[axis] = fmaxf(upper[axis], values[i + axis] + radius);
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        spheres->lower[axis] = lower[axis];
        spheres->upper[axis] = upper[axis];
    }
    return true;
}

bool disc_check(const struct scene_disc *disc, const struct edit_place *place)
{
    const float *n = disc->value.normal_world;
    double length = sqrt((double)n[0] * (double)n[0] + (double)n[1] * (double)n[1] + (double)n[2] * (double)n[2]);
    if (!(fabs(length - 1.0) <= 1e-3))
        return edit_error(place, ERROR_INVALID, ".normal_world", "its length is %g, not 1", length);
    if (first_bad_float(disc->value.centre_world, 3, COORDINATE_MAX) != 3)
        return edit_error(place, ERROR_INVALID, ".centre_world", "numbers must be finite and not beyond 1e18");
    if (!(disc->value.radius > 0.0f) || !(disc->value.radius <= COORDINATE_MAX))
        return edit_error(place, ERROR_INVALID, ".radius", "%g is not above 0 and at most 1e18",
                          (double)disc->value.radius);
    return true;
}
