/* SPDX-License-Identifier: MIT */
/* Planes of the sums that shading notes light in. */
#include "render/waves/notes.h"

#include "shared/layers.h"

uint32_t notes_plane(const struct wave_notes *notes, uint32_t layer_bit)
{
    return (uint32_t)__builtin_popcount(notes->layers & ~LAYER_BITS_CRYPTO & (layer_bit - 1));
}

bool notes_have_light(const struct wave_notes *notes)
{
    return notes->layers & LAYER_BITS_LIGHT;
}

size_t notes_light_defines(const struct wave_notes *notes, struct gpu_define defines[NOTES_LIGHT_DEFINES])
{
    size_t n = 0;
    if (notes_have_light(notes))
        defines[n++] = (struct gpu_define){"LIGHT_LAYERS", "1"};
    if (notes->layers & LAYER_BITS_LIGHT_GROUPS)
        defines[n++] = (struct gpu_define){"LIGHT_GROUPS", "1"};
    return n;
}

void notes_bind_light(struct wave_notes *notes, const struct gpu_program *program)
{
    if (!notes_have_light(notes))
        return;
    gpu_buffer_bind_storage(&notes->sums, BIND_LAYER_SUMS);
    gpu_uniform_uint(program, "light_layers", notes->layers & ~LAYER_BITS_CRYPTO);
    gpu_uniform_uint(program, "plane_samples", notes->plane_samples);
    if (notes->layers & LAYER_BITS_LIGHT_GROUPS)
        gpu_uniform_uint(program, "environment_group", notes->environment_group);
}

struct gpu_buffer *notes_covers(struct wave_notes *notes)
{
    return notes->covers_by_shading ? &notes->covers : NULL;
}
