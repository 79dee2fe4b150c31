/* SPDX-License-Identifier: MIT */
/* Makes the table of the environment's brightness by direction. */
#include "render/light/environment_choice.h"

#include "shared/bindings.h"
#include "shared/sky.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define SKY_ROWS 256
/* Cells of the table of an image, at most: each has a texel, or some squared, of a larger one. */
#define ROWS_MAX 1024u
#define COLUMNS_MAX 2048u

/* The table of luminances, those of each row side by side, rows of equal angles from +y down. `sums` has room for
 * rows + 1 + rows * (columns + 1). Returns the extent; 0: all are 0. */
static float make_sums(float *sums, const float *luminances, uint32_t rows, uint32_t columns)
{
    double *row_sums = calloc(rows + 1, sizeof(*row_sums)), squares = 0.0;
    if (!row_sums)
        return 0.0f;
    float *row = sums + rows + 1;
    for (uint32_t v = 0; v < rows; v++, row += columns + 1) {
        const float *own = luminances + (size_t)v * columns;
        double sum = 0.0, before = 0.0, own_squares = 0.0, height = cos(PI * v / rows) - cos(PI * (v + 1) / rows);
        for (uint32_t u = 0; u < columns; u++) {
            sum += (double)own[u];
            own_squares += (double)own[u] * (double)own[u];
        }
        for (uint32_t u = 0; u <= columns; u++) {
            row[u] = sum > 0.0 ? (float)(before / sum) : (float)u / (float)columns;
            before += u < columns ? (double)own[u] : 0.0;
        }
        row[columns] = 1.0f;
        row_sums[v + 1] = row_sums[v] + sum * height;
        squares += own_squares * height;
    }
    double all = row_sums[rows];
    for (uint32_t v = 0; all > 0.0 && v <= rows; v++)
        sums[v] = (float)(row_sums[v] / all);
    free(row_sums);
    return all > 0.0 ? (float)(all / squares * all * 2.0 * PI / columns) : 0.0f;
}

static float luminance(const float rgb[3])
{
    return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

static void sky_luminances(float luminances[SKY_ROWS])
{
    static const float zenith[3] = {SKY_ZENITH}, horizon[3] = {SKY_HORIZON}, ground[3] = {SKY_GROUND};
    for (int i = 0; i < SKY_ROWS; i++) {
        float up = (float)cos(PI * (i + 0.5) / SKY_ROWS);
        float share = up < 0.0f ? fminf(-up * SKY_GROUND_SLOPE, 1.0f) : up;
        luminances[i] = luminance(horizon) * (1.0f - share) + luminance(up < 0.0f ? ground : zenith) * share;
    }
}

/* Brightness of a row of texels, each with its share of its neighbours': light between two texels is blended of
 * both, and so an eighth of the light of a texel shines from each half of a texel beside it. */
static void image_row(float *row, float *scratch, const struct scene_environment *image, uint32_t v)
{
    uint32_t width = image->value.width;
    for (uint32_t u = 0; u < width; u++) {
        uint16_t halves[4];
        float rgb[3];
        memcpy(halves, (const uint8_t *)image->texels->data + ((size_t)v * width + u) * 8, sizeof(halves));
        for (int c = 0; c < 3; c++)
            rgb[c] = environment_float_from_half(halves[c]) * image->value.colour[c];
        scratch[u] = fmaxf(luminance(rgb), 0.0f);
    }
    for (uint32_t u = 0; u < width; u++)
        row[u] = 0.125f * (scratch[(u + width - 1) % width] + scratch[(u + 1) % width]) + 0.75f * scratch[u];
}

/* Sums of the texels whose middles are in each cell. */
static bool image_luminances(float *cells, const struct scene_environment *image, uint32_t rows, uint32_t columns)
{
    uint32_t width = image->value.width, height = image->value.height;
    float *lines = malloc((size_t)4 * width * sizeof(*lines));
    if (!lines)
        return false;
    float *scratch = lines + (size_t)3 * width, *ring[3] = {lines, lines + width, lines + (size_t)2 * width};
    memset(cells, 0, (size_t)rows * columns * sizeof(*cells));
    image_row(ring[0], scratch, image, 0);
    memcpy(ring[2], ring[0], width * sizeof(float)); /* rows beyond the pole repeat the row before it */
    for (uint32_t v = 0; v < height; v++) {
        float *own = ring[v % 3], *below = ring[(v + 1) % 3];
        const float *above = ring[(v + 2) % 3];
        if (v + 1 < height)
            image_row(below, scratch, image, v + 1);
        else
            memcpy(below, own, width * sizeof(float));
        float *cell_row = cells + ((uint64_t)v * 2 + 1) * rows / (2 * (uint64_t)height) * columns;
        for (uint32_t u = 0; u < width; u++)
            cell_row[((uint64_t)u * 2 + 1) * columns / (2 * (uint64_t)width)] +=
                0.125f * (above[u] + below[u]) + 0.75f * own[u];
    }
    free(lines);
    return true;
}

static uint32_t cells_along(uint32_t texels, uint32_t maximum)
{
    uint32_t each = (texels + maximum - 1) / maximum;
    return (texels + each - 1) / each;
}

static bool make_table(struct environment_choice *choice, struct gpu_device *device,
                       const struct scene_environment *given, struct error *error)
{
    bool image = choice->kind == ENVIRONMENT_IMAGE;
    uint32_t rows = image ? cells_along(given->value.height, ROWS_MAX) : SKY_ROWS;
    uint32_t columns = image ? cells_along(given->value.width, COLUMNS_MAX) : 1;
    size_t cell_count = (size_t)rows * columns, sum_count = rows + 1 + (size_t)rows * (columns + 1);
    float *luminances = malloc((cell_count + sum_count) * sizeof(*luminances));
    if (!luminances)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the environment's table");
    bool made = true;
    if (!image)
        sky_luminances(luminances);
    else if (!image_luminances(luminances, given, rows, columns))
        made = error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the environment's rows");
    float *sums = luminances + cell_count;
    if (made)
        choice->extent = make_sums(sums, luminances, rows, columns);
    if (made && choice->extent > 0.0f) {
        made = gpu_buffer_upload(device, &choice->table, sums, sum_count * sizeof(*sums), error);
        choice->rows = rows;
        choice->columns = columns;
    }
    free(luminances);
    return made;
}

bool environment_choice_update(struct environment_choice *choice, struct gpu_device *device,
                               const struct environment *environment, const struct scene_environment *given,
                               struct error *error)
{
    if (choice->known && choice->revision == given->revision && choice->kind == environment->kind)
        return true;
    choice->known = false;
    choice->kind = environment->kind;
    choice->revision = given->revision;
    choice->rows = choice->columns = 0;
    choice->extent = 0.0f;
    if ((choice->kind == ENVIRONMENT_IMAGE || choice->kind == ENVIRONMENT_SKY) &&
        !make_table(choice, device, given, error))
        return false;
    choice->known = true;
    return true;
}

void environment_choice_bind(struct environment_choice *choice, struct gpu_device *device,
                             const struct gpu_program *program)
{
    gpu_uniform_uint(program, "environment_rows", choice->rows);
    gpu_uniform_uint(program, "environment_columns", choice->columns);
    gpu_buffer_bind_texels(device, &choice->table, UNIT_SHADE_ENVIRONMENT, GL_R32F);
}

void environment_choice_finish(struct environment_choice *choice, struct gpu_device *device)
{
    gpu_buffer_finish(device, &choice->table);
    *choice = (struct environment_choice){0};
}
