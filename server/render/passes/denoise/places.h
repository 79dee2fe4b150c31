/* SPDX-License-Identifier: MIT */
/* Where instances were in a picture, so that the next one knows how they have moved since, and which have another
 * shape: while clips play. */
#ifndef FARLIGHT_RENDER_PASSES_DENOISE_PLACES_H
#define FARLIGHT_RENDER_PASSES_DENOISE_PLACES_H

#include "gpu_scene/scene.h"

struct denoise_place {
    float world_from_object[12];
    uint64_t deformed_revision;
};

struct denoise_places {
    struct denoise_place *instances; /* owned; NULL: they stay where they are, or are too many */
    uint32_t count, capacity;
};

/* Notes where the scene's instances are, as it is posed. */
void denoise_places_note(struct denoise_places *places, const struct gpu_scene *scene);
/* Whether both are of the same instances. */
bool denoise_places_match(const struct denoise_places *a, const struct denoise_places *b);
/* Computes for matching places the matrix of each instance from its present to its previous place. An
 * instance with another shape gets DENOISE_ANEW. */
void denoise_places_compare(const struct denoise_places *before, const struct denoise_places *now,
                            float (*before_from_now)[12]);
void denoise_places_finish(struct denoise_places *places);

#endif
