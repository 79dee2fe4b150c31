/* SPDX-License-Identifier: MIT */
#include "render/denoise/places.h"

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

void denoise_places_compare(const struct denoise_places *before, const struct denoise_places *now, uint32_t *moved)
{
    for (uint32_t i = 0; i < now->count; i++) {
        const struct denoise_place *a = &before->instances[i], *b = &now->instances[i];
        moved[i] = a->deformed_revision != b->deformed_revision ||
                   memcmp(a->world_from_object, b->world_from_object, sizeof(a->world_from_object)) != 0;
    }
}

void denoise_places_finish(struct denoise_places *places)
{
    free(places->instances);
    *places = (struct denoise_places){0};
}
