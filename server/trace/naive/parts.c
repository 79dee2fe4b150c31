// SPDX-License-Identifier: MIT
// Parts of the scene's primitives with a limited number of tests.
#include "trace/naive/parts.h"

#define GROUP_RAYS 64u

/* Advances by at most `tests`; returns the number of tests used. */
static uint32_t advance(const struct gpu_scene *scene, uint32_t tests, uint32_t *instance, uint32_t *primitive)
{
    uint32_t left = tests;
    while (left > 0 && *instance < scene->instance_count) {
        const uint32_t count = scene->geometries[scene->instances[*instance].geometry].device.primitive_count;
        if (left == 1 && count > *primitive && left < tests) /* the last test would only enter the instance */
            break;
        const uint32_t rest = count - *primitive, taken = rest < left - 1 ? rest : left - 1;
        left -= 1 + taken;
        *primitive += taken;
        if (*primitive < count)
            break;
        *primitive = 0;
        (*instance)++;
    }
    return tests - left;
}

bool naive_next_part(const struct gpu_scene *scene, uint32_t tests_max, struct naive_part *part)
{
    advance(scene, part->tests, &part->first_instance, &part->first_primitive);
    uint32_t instance = part->first_instance, primitive = part->first_primitive;
    part->tests = advance(scene, tests_max, &instance, &primitive);
    return part->tests > 0;
}

uint32_t naive_rays_of(const struct naive_part *part, uint64_t tests)
{
    const uint64_t rays = tests / (part->tests + 1) / GROUP_RAYS * GROUP_RAYS, maximum = (uint64_t)1 << 30;
    return (uint32_t)(rays < GROUP_RAYS ? GROUP_RAYS : rays < maximum ? rays : maximum);
}
