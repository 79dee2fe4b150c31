/* SPDX-License-Identifier: MIT */
/* Texture lookup on the host. */
#include "trace/reference/texture.h"

#include "trace/reference/opacity.h"
#include "protocol/common/srgb.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

/* Linear values of all 256 bytes. */
static float linear_from_byte[256];

static void make_table(void)
{
    for (int i = 0; i < 256; i++) {
        linear_from_byte[i] = linear_from_srgb_f((float)i / 255.0f);
    }
}

static float wrap_coordinate(float u, enum wrap wrap)
{
    switch (wrap) {
    case WRAP_REPEAT:
    case WRAP_COUNT:
        break;
    case WRAP_CLAMP:
        return fminf(fmaxf(u, 0.0f), 1.0f);
    case WRAP_MIRROR:
        return fabsf(u - 2.0f * floorf(0.5f * u + 0.5f)); /* distance to the nearest even number */
    }
    return u - floorf(u);
}

/* Wraps an index at most one beyond the edge. Beyond a mirrored edge lies the edge itself once more. */
static int wrap_neighbour(int i, int size, enum wrap wrap)
{
    if (wrap == WRAP_REPEAT)
        i = i < 0 ? i + size : i >= size ? i - size : i;
    return i < 0 ? 0 : i >= size ? size - 1 : i;
}

static void add_texel(const struct opacity_texture *texture, int x, int y, float share, float sum[4])
{
    size_t column = (size_t)wrap_neighbour(x, (int)texture->width, texture->wrap_u);
    size_t row = (size_t)wrap_neighbour(y, (int)texture->height, texture->wrap_v);
    const uint8_t *texel = texture->texels->data + 4 * (row * texture->width + column);
    for (int k = 0; k < 4; k++) {
        bool decode = texture->is_srgb && k < 3;
        sum[k] += share * (decode ? linear_from_byte[texel[k]] : (float)texel[k] / 255.0f);
    }
}

/* Texel of a wrapped coordinate along its axis, and its weight. NaN counts as the first texel. */
static int corner_of(float wrapped, uint32_t size, bool nearest, float *weight)
{
    float at = wrapped * (float)size - (nearest ? 0.0f : 0.5f);
    if (!(at >= -0.5f))
        at = 0.0f;
    *weight = nearest ? 0.0f : at - floorf(at);
    int corner = (int)floorf(at);
    return corner < (int)size - 1 ? corner : (int)size - 1;
}

void reference_texture_sample(const struct opacity_texture *texture, const float uv[2][2], float texel[4])
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    if (!texture->texels)
        return;
    pthread_once(&once, make_table);
    const float *m = texture->uv_transform, *in = uv[texture->second_set];
    float u = wrap_coordinate(m[0] * in[0] + m[1] * in[1] + m[2], texture->wrap_u);
    float v = wrap_coordinate(m[3] * in[0] + m[4] * in[1] + m[5], texture->wrap_v);
    float weight[2];
    int x = corner_of(u, texture->width, texture->nearest, &weight[0]);
    int y = corner_of(v, texture->height, texture->nearest, &weight[1]);
    memset(texel, 0, 4 * sizeof(*texel));
    for (int tap = 0; tap < (texture->nearest ? 1 : 4); tap++) {
        int right = tap & 1, below = tap >> 1;
        float share = (right ? weight[0] : 1.0f - weight[0]) * (below ? weight[1] : 1.0f - weight[1]);
        add_texel(texture, x + right, y + below, share, texel);
    }
}
