/* SPDX-License-Identifier: MIT */
/* Octahedral unit vectors. */
#include "gpu_scene/unit_vector.h"

#include <math.h>

/* Packs two snorms of `bits` bits each. */
static uint32_t pack(const float v[3], unsigned bits)
{
    const float sum = fabsf(v[0]) + fabsf(v[1]) + fabsf(v[2]), maximum = (float)((1u << (bits - 1)) - 1);
    if (!(sum > 0.0f) || !isfinite(sum))
        return 0;
    float p[2] = {v[0] / sum, v[1] / sum};
    if (v[2] < 0.0f) {
        float x = p[0], y = p[1];
        p[0] = (1.0f - fabsf(y)) * (x >= 0.0f ? 1.0f : -1.0f);
        p[1] = (1.0f - fabsf(x)) * (y >= 0.0f ? 1.0f : -1.0f);
    }
    uint32_t packed[2];
    for (int i = 0; i < 2; i++)
        packed[i] = (uint32_t)(int32_t)lrintf(fminf(fmaxf(p[i], -1.0f), 1.0f) * maximum) & ((1u << bits) - 1);
    return packed[0] | packed[1] << bits;
}

uint32_t unit_vector_pack(const float v[3])
{
    return pack(v, 16);
}

uint32_t unit_vector_pack_24(const float v[3])
{
    return pack(v, 12);
}
