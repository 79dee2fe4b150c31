/* SPDX-License-Identifier: MIT */
/* Compares where instances are with where they were. */
#include "render/passes/denoise/places.h"

#include "scene/affine.h"
#include "shared/denoise.h"

#include <stdlib.h>
#include <string.h>

/* More would take longer to compare than a frame may. */
#define INSTANCES_MAX (1u << 16)

void denoise_places_note(struct denoise_places *places, const struct gpu_scene *scene)
{
    const uint32_t count = scene->instance_count;
    places->count = 0;
    if (!scene->motion || count > INSTANCES_MAX)
        return;
    if (count > places->capacity) {
        denoise_places_finish(places);
        places->instances = malloc(count * sizeof(*places->instances));
        places->capacity = places->instances ? count : 0;
    }
    places->count = places->capacity >= count ? count : 0;
    for (uint32_t i = 0; i < places->count; i++) {
        const struct instance *instance = &scene->instances[i];
        struct denoise_place *place = &places->instances[i];
        memcpy(place->world_from_object, instance->world_from_object, sizeof(place->world_from_object));
        place->deformed_revision = scene->geometries[instance->geometry].deformed_revision;
    }
}

bool denoise_places_match(const struct denoise_places *a, const struct denoise_places *b)
{
    return a->count > 0 && a->count == b->count;
}

static void lead_back(const struct denoise_place *before, const struct denoise_place *now,
                      float before_from_now[12])
{
    float object_from_now[12];
    affine_identity(before_from_now);
    if (before->deformed_revision != now->deformed_revision ||
        !affine_invert(object_from_now, now->world_from_object))
        before_from_now[3] = DENOISE_ANEW;
    else if (memcmp(before->world_from_object, now->world_from_object, sizeof(now->world_from_object)) != 0)
        affine_multiply(before_from_now, before->world_from_object, object_from_now);
}

void denoise_places_compare(const struct denoise_places *before, const struct denoise_places *now,
                            float (*before_from_now)[12])
{
    for (uint32_t i = 0; i < now->count; i++)
        lead_back(&before->instances[i], &now->instances[i], before_from_now[i]);
}

void denoise_places_finish(struct denoise_places *places)
{
    free(places->instances);
    *places = (struct denoise_places){0};
}
