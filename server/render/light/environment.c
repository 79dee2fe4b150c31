/* SPDX-License-Identifier: MIT */
/* Integrates the environment into irradiance, and makes the default light. */
#include "render/light/environment.h"

#include "base/clock.h"
#include "shared/bindings.h"
#include "shared/sky.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define SKY_ROWS 256

/* The sums of one row of an equirectangular image: per texel and channel only the five functions of the azimuth
 * that the nine harmonics share. */
struct row_sums {
    double one[3], x[3], z[3], xz[3], xx[3]; /* sums of colour times 1, sx, sz, sx sz, sx sx; s: unit circle */
};

float environment_float_from_half(uint16_t half)
{
    uint32_t sign = (uint32_t)(half & 0x8000u) << 16, exponent = half >> 10 & 31u, mantissa = half & 0x3ffu;
    uint32_t bits;
    float value;
    if (exponent == 0) {
        value = (float)mantissa * 0x1p-24f;
        return sign ? -value : value;
    }
    if (exponent == 31)
        return mantissa ? 0.0f : 65504.0f; /* infinity becomes the largest half; NaN counts as 0 */
    bits = sign | (exponent + 112) << 23 | mantissa << 13;
    memcpy(&value, &bits, sizeof(value));
    return value;
}

/* Adds a row at polar angle theta (0: +y) to the nine projections. */
static void add_row(double sums[9][3], const struct row_sums *row, double theta, double solid_angle)
{
    double y = cos(theta), s = sin(theta);
    for (int c = 0; c < 3; c++) {
        double one = row->one[c] * solid_angle, x = row->x[c] * s * solid_angle, z = row->z[c] * s * solid_angle;
        double xz = row->xz[c] * s * s * solid_angle, xx = row->xx[c] * s * s * solid_angle;
        double zz = one * s * s - xx;
        sums[0][c] += one;
        sums[1][c] += one * y;
        sums[2][c] += z;
        sums[3][c] += x;
        sums[4][c] += x * y;
        sums[5][c] += z * y;
        sums[6][c] += 3.0 * zz - one;
        sums[7][c] += xz;
        sums[8][c] += xx - one * y * y;
    }
}

/* Squares of the harmonics' constants times the cosine lobe's factors (1, 2/3, 1/4): irradiance / pi as a
 * polynomial in the normal, in the order of environment_irradiance() in shaders/common/environment.glsl. */
static void fold_constants(float irradiance[9][3], double sums[9][3], const float colour[3])
{
    static const double factors[9] = {
        1.0 / (4.0 * PI),   0.5 / PI,          0.5 / PI,           0.5 / PI,           15.0 / (16.0 * PI),
        15.0 / (16.0 * PI), 5.0 / (64.0 * PI), 15.0 / (16.0 * PI), 15.0 / (64.0 * PI),
    };
    for (int i = 0; i < 9; i++)
        for (int c = 0; c < 3; c++)
            irradiance[i][c] = (float)(sums[i][c] * factors[i] * (double)colour[c]);
}

static void add_sky(double sums[9][3])
{
    static const float zenith[3] = {SKY_ZENITH}, horizon[3] = {SKY_HORIZON}, ground[3] = {SKY_GROUND};
    for (int i = 0; i < SKY_ROWS; i++) {
        double theta = PI * (i + 0.5) / SKY_ROWS, up = cos(theta);
        double share = up < 0.0 ? fmin(-up * (double)SKY_GROUND_SLOPE, 1.0) : up;
        struct row_sums row = {0};
        for (int c = 0; c < 3; c++) {
            double end = (double)(up < 0.0 ? ground[c] : zenith[c]);
            row.one[c] = (double)horizon[c] + (end - (double)horizon[c]) * share;
            row.xx[c] = row.one[c] / 2.0;
        }
        add_row(sums, &row, theta, 2.0 * PI * (cos(PI * i / SKY_ROWS) - cos(PI * (i + 1) / SKY_ROWS)));
    }
}

/* Continues with the rows until about `end_ns`. */
static bool add_image(struct environment *environment, const struct scene_environment *image, uint64_t end_ns,
                      struct error *error)
{
    const uint8_t *texels = image->texels->data;
    uint32_t width = image->value.width, height = image->value.height;
    double(*circle)[2] = malloc(width * sizeof(*circle));
    if (!circle)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the environment's columns");
    for (uint32_t u = 0; u < width; u++) {
        /* The middle column is -z; the image is turned by the rotation about +y. */
        double azimuth = ((u + 0.5) / width - 0.5) * 2.0 * PI - (double)image->value.rotation;
        circle[u][0] = sin(azimuth);
        circle[u][1] = -cos(azimuth);
    }
    if (environment->summed_revision != image->revision) {
        memset(environment->sums, 0, sizeof(environment->sums));
        environment->summed_rows = 0;
        environment->summed_revision = image->revision;
    }
    do {
        const uint32_t v = environment->summed_rows;
        struct row_sums row = {0};
        for (uint32_t u = 0; u < width; u++) {
            double x = circle[u][0], z = circle[u][1];
            uint16_t halves[4];
            memcpy(halves, texels + ((size_t)v * width + u) * 8, sizeof(halves));
            for (int c = 0; c < 3; c++) {
                double value = (double)environment_float_from_half(halves[c]);
                row.one[c] += value;
                row.x[c] += value * x;
                row.z[c] += value * z;
                row.xz[c] += value * x * z;
                row.xx[c] += value * x * x;
            }
        }
        double cap = cos(PI * v / height) - cos(PI * (v + 1) / height);
        add_row(environment->sums, &row, PI * (v + 0.5) / height, 2.0 * PI / width * cap);
    } while (++environment->summed_rows < height && clock_now_ns() < end_ns);
    free(circle);
    return true;
}

static bool is_black(const float colour[3])
{
    return colour[0] <= 0.0f && colour[1] <= 0.0f && colour[2] <= 0.0f;
}

/* They are of the environment's light group. */
static bool make_default_lights(struct environment *environment, struct gpu_device *device, uint32_t group,
                                struct error *error)
{
    const float kind = (float)LIGHT_KIND_DIRECTIONAL + (float)group / LIGHT_GROUPS_MAX;
    const struct light lights[SKY_LIGHTS] = {
        {.position_kind = {0.0f, 0.0f, 0.0f, kind},
         .direction_range = {SKY_KEY_DIRECTION, 0.0f},
         .colour = {SKY_KEY_IRRADIANCE, 0.0f}},
        {.position_kind = {0.0f, 0.0f, 0.0f, kind},
         .direction_range = {SKY_RIM_DIRECTION, 0.0f},
         .colour = {SKY_RIM_IRRADIANCE, 0.0f}},
    };
    if (environment->default_lights.name && environment->default_light_group == group)
        return true;
    environment->default_light_group = group;
    return gpu_buffer_upload(device, &environment->default_lights, lights, sizeof(lights), error);
}

bool environment_update(struct environment *environment, struct gpu_device *device, const struct gpu_scene *gpu,
                        uint64_t end_ns, bool *done, struct error *error)
{
    static const float white[3] = {1.0f, 1.0f, 1.0f};
    const struct scene_environment *given = &gpu->scene->environment;
    *done = true;
    bool image = given->texels && given->value.width > 0 && given->value.height > 0;
    uint32_t kind = image ? ENVIRONMENT_IMAGE : ENVIRONMENT_CONSTANT;
    if (is_black(given->value.colour))
        kind = gpu->light_count == 0 ? ENVIRONMENT_SKY : ENVIRONMENT_NONE;
    else if (given->value.backdrop)
        kind = ENVIRONMENT_BACKDROP;
    environment->default_light = kind == ENVIRONMENT_SKY;
    if (environment->default_light && !make_default_lights(environment, device, given->value.light_group, error))
        return false;
    if (environment->known && environment->revision == given->revision && environment->kind == kind)
        return true;
    double sums[9][3] = {0};
    memset(environment->irradiance, 0, sizeof(environment->irradiance));
    if (kind == ENVIRONMENT_SKY) {
        add_sky(sums);
        fold_constants(environment->irradiance, sums, white);
    } else if (kind == ENVIRONMENT_IMAGE) {
        environment->known = false;
        if (!add_image(environment, given, end_ns, error))
            return false;
        *done = environment->summed_rows == given->value.height;
        if (!*done)
            return true;
        fold_constants(environment->irradiance, environment->sums, given->value.colour);
        environment->summed_revision = 0;
    } else if (kind == ENVIRONMENT_CONSTANT) {
        memcpy(environment->irradiance[0], given->value.colour, sizeof(given->value.colour));
    }
    environment->kind = kind;
    environment->revision = given->revision;
    environment->known = true;
    return true;
}

void environment_fill_uniforms(const struct environment *environment, struct frame_uniforms *uniforms,
                               const struct gpu_scene *gpu)
{
    memcpy(uniforms->environment_colour, gpu->environment_colour, sizeof(gpu->environment_colour));
    uniforms->environment_colour[3] = gpu->environment_rotation;
    for (int i = 0; i < 9; i++)
        memcpy(uniforms->irradiance[i], environment->irradiance[i], sizeof(environment->irradiance[i]));
    uniforms->environment_kind = environment->kind;
    uniforms->light_count = environment->default_light ? SKY_LIGHTS : gpu->light_count;
}

struct gpu_buffer *environment_lights(struct environment *environment, struct gpu_scene *gpu)
{
    return environment->default_light ? &environment->default_lights : &gpu->lights;
}

void environment_finish(struct environment *environment, struct gpu_device *device)
{
    gpu_buffer_finish(device, &environment->default_lights);
    *environment = (struct environment){0};
}
