/* SPDX-License-Identifier: MIT */
/* Checks of the arguments of fl_warp functions. */
#include "warp/check.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#define RIGID_SLACK 1e-3f /* tolerance of products of the camera's axes, which are rounded floats */
#define PLACE_MAX 1e9f    /* metres */
#define LENGTH_MIN 1e-9f  /* metres */
#define FOV_MAX 3.0f      /* radians */
#define W_MAX 1e9f

/* ---- errors ---- */

bool warp_error_set(struct fl_warp_error *error, enum fl_warp_error_code code, const char *field,
                    const char *format, ...)
{
    if (!error)
        return false;
    *error = (struct fl_warp_error){.code = code};
    snprintf(error->field, sizeof(error->field), "%s", field);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof(error->text), format, arguments);
    va_end(arguments);
    return false;
}

/* ---- checks ---- */

static bool check_size(uint32_t width, uint32_t height, struct fl_warp_error *error)
{
    if (width >= 1 && height >= 1 && width <= FL_WARP_SIDE_MAX && height <= FL_WARP_SIDE_MAX)
        return true;
    return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "size", "%ux%u is not between 1x1 and %ux%u", width,
                          height, FL_WARP_SIDE_MAX, FL_WARP_SIDE_MAX);
}

static bool check_number(float value, float least, float greatest, const char *field, struct fl_warp_error *error)
{
    if (value >= least && value <= greatest)
        return true;
    return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, field, "%g is not between %g and %g", (double)value,
                          (double)least, (double)greatest);
}

static bool check_camera(const struct fl_warp_camera *camera, struct fl_warp_error *error)
{
    const float *m = camera->world_from_view;
    for (int i = 0; i < 12; i++)
        if (!check_number(m[i], -PLACE_MAX, PLACE_MAX, "camera.world_from_view", error))
            return false;
    for (int a = 0; a < 3; a++)
        for (int b = a; b < 3; b++) {
            const float product = m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b];
            if (!(fabsf(product - (a == b ? 1.0f : 0.0f)) <= RIGID_SLACK))
                return warp_error_set(
                    error, FL_WARP_ERROR_ARGUMENT, "camera.world_from_view",
                    "axes %d and %d have the product %g; a rigid camera has axes of length 1 at right angles", a,
                    b, (double)product);
        }
    return check_number(camera->fov_y, 1e-3f, FOV_MAX, "camera.fov_y", error);
}

static bool check_w(const float *w, size_t count, uint32_t width, struct fl_warp_error *error)
{
    uint32_t wrong = 0;
    for (size_t i = 0; i < count; i++)
        wrong |= !(w[i] >= 0 && w[i] <= W_MAX);
    for (size_t i = 0; wrong && i < count; i++)
        if (!(w[i] >= 0 && w[i] <= W_MAX))
            return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "w",
                                  "%g at column %zu of row %zu is not between 0 and %g", (double)w[i], i % width,
                                  i / width, (double)W_MAX);
    return true;
}

bool warp_check_layer(const struct fl_warp_layer *layer, uint32_t width, uint32_t height,
                      struct fl_warp_error *error)
{
    if (!layer->colours || !layer->w)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "layers", "a layer has no colours, or no depths");
    return check_w(layer->w, (size_t)width * height, width, error);
}

bool warp_check_key(const struct fl_warp_key *key, struct fl_warp_error *error)
{
    if (!check_size(key->width, key->height, error))
        return false;
    if (key->width * key->height > FL_WARP_TEXELS_MAX)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "size", "%ux%u are more than %u texels", key->width,
                              key->height, FL_WARP_TEXELS_MAX);
    if (!check_camera(&key->camera, error) ||
        (key->unit != 0 && !check_number(key->unit, LENGTH_MIN, PLACE_MAX, "unit", error)) ||
        !check_number(key->w_error, 0, W_MAX, "w_error", error) ||
        !check_number(key->radius, LENGTH_MIN, PLACE_MAX, "radius", error) ||
        !check_number(key->pixels, 1e-3f, (float)FL_WARP_SIDE_MAX, "pixels", error))
        return false;
    if (key->layer_count < 1 || key->layer_count > FL_WARP_LAYERS_MAX)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "layer_count", "%u is not between 1 and %u",
                              key->layer_count, FL_WARP_LAYERS_MAX);
    bool good = true;
    for (uint32_t l = 0; good && l < key->layer_count; l++)
        good = warp_check_layer(&key->layers[l], key->width, key->height, error);
    return good;
}

bool warp_check_part(const struct fl_warp_part *part, uint32_t width, uint32_t height, struct fl_warp_error *error)
{
    if (part->width < 1 || part->height < 1 || part->x >= width || part->y >= height ||
        part->width > width - part->x || part->height > height - part->y)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "part",
                              "%ux%u texels at %u, %u are not some of %ux%u", part->width, part->height, part->x,
                              part->y, width, height);
    if (!part->texels.colours || !part->texels.w)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "texels", "the part has no colours, or no depths");
    return check_w(part->texels.w, (size_t)part->width * part->height, part->width, error);
}

bool warp_check_view(const struct fl_warp_view *view, const struct fl_warp_picture *picture,
                     struct fl_warp_error *error)
{
    if (!check_size(view->width, view->height, error) || !check_camera(&view->camera, error))
        return false;
    if ((unsigned)view->quality > FL_WARP_ITERATIVE)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "quality", "%d is none", (int)view->quality);
    if ((unsigned)view->holes > FL_WARP_PATTERN)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "holes", "%d is no way to show them",
                              (int)view->holes);
    if (picture->stride > 0 && picture->stride < view->width)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "stride", "%u is less than the width, %u",
                              picture->stride, view->width);
    if (!picture->colours || !picture->mask)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "picture", "it has no colours, or no mask");
    return true;
}
