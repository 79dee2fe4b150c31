/* SPDX-License-Identifier: MIT */
/* Keeps a view's picture, and binds the one before for reprojection. */
#include "render/passes/denoise/history.h"

#include "render/context/camera.h"
#include "render/passes/denoise/sums.h"
#include "render/context/request.h"
#include "shared/denoise.h"

#include <epoxy/gl.h>
#include <stdlib.h>

/* Keeps pictures of one eye through a pinhole: a pixel of others shows several places of another picture. */
static bool may_keep(const struct render_frame *frame)
{
    const struct frame_request *request = &frame->request;
    return request->history != HISTORY_NONE && denoise_is_wanted(frame) && !frame_has_views(request) &&
           request->aperture == 0.0f && request->sampling.noise == 0.0f && !frame->scene->has_motion;
}

/* Whether the scene is the same; while it moves, perhaps in another pose. */
static bool is_followed(const struct denoise_kept *before, const struct denoise_kept *now)
{
    struct frame_request same = before->request;
    same.sampling.seed = now->request.sampling.seed;
    const bool posed = before->revision == now->revision && now->request.history == HISTORY_MOVING &&
                       denoise_places_match(&before->places, &now->places);
    return before->whole && (before->showing == now->showing || posed) &&
           frame_request_same_radiance(&same, &now->request);
}

static bool upload_moved(struct denoise_history *history, const struct render_frame *frame,
                         const struct denoise_kept *before, const struct denoise_kept *now, struct error *error)
{
    const size_t bytes = now->places.count * sizeof(float[12]);
    float(*moved)[12] = malloc(bytes);
    if (!moved)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for what has moved");
    denoise_places_compare(&before->places, &now->places, moved);
    const bool uploaded = gpu_buffer_upload(frame->device->gpu, &history->moved, moved, bytes, error);
    free(moved);
    return uploaded;
}

bool denoise_history_begin(struct denoise_history *history, struct render_frame *frame, uint64_t showing,
                           bool goes_on, struct error *error)
{
    history->is_written = history->is_used = history->is_moving = history->things_moved = false;
    if (frame->request.hidden_layer > 0) /* the history is of the picture that was written last */
        return true;
    if (!may_keep(frame)) {
        denoise_history_finish(history, frame->device->gpu);
        return true;
    }
    if (!goes_on && history->kept[history->now].whole)
        history->now = 1 - history->now;
    struct denoise_kept *now = &history->kept[history->now], *before = &history->kept[1 - history->now];
    now->request = frame->request;
    now->showing = showing;
    now->revision = frame->scene->revision;
    now->whole = false;
    denoise_places_note(&now->places, frame->scene);
    before->whole = is_followed(before, now);
    history->is_written = true;
    history->is_used = before->whole && frame->request.history != HISTORY_KEPT;
    history->is_moving = frame->request.history == HISTORY_MOVING;
    if (history->is_moving)
        frame->uniforms.seed ^= (history->moving + 1) * 0x9e3779b9u;
    history->things_moved = history->is_used && before->showing != showing;
    return !history->things_moved || upload_moved(history, frame, before, now, error);
}

struct gpu_buffer *denoise_history_moved(struct denoise_history *history)
{
    return history->things_moved ? &history->moved : NULL;
}

bool denoise_history_reserve(struct denoise_history *history, const struct render_frame *frame, bool fits,
                             bool has_motion, struct error *error)
{
    const struct frame_request *request = &frame->request;
    struct denoise_kept *now = &history->kept[history->now];
    now->uniforms = frame->uniforms;
    history->is_written = history->is_written && fits;
    history->is_used = history->is_used && fits && (has_motion || !history->things_moved);
    const size_t bytes = (size_t)request->picture.width * request->picture.height * sizeof(uvec4);
    return !history->is_written || gpu_buffer_reserve(frame->device->gpu, &now->pixels, bytes, error);
}

void denoise_history_bind(struct denoise_history *history, const struct render_frame *frame,
                          const struct gpu_program *program, uint32_t samples)
{
    struct denoise_kept *now = &history->kept[history->now], *before = &history->kept[1 - history->now];
    gpu_buffer_bind_storage(&now->pixels, BIND_DENOISE_OUT_TOO);
    gpu_uniform_float(program, "samples", (float)samples);
    gpu_uniform_float(program, "samples_before_max",
                      !history->is_used       ? 0.0f
                      : history->things_moved ? DENOISE_HISTORY_POSED_MAX
                                              : DENOISE_HISTORY_MAX);
    gpu_buffer_bind_texels(frame->device->gpu, history->is_used ? &before->pixels : &now->pixels,
                           UNIT_DENOISE_FIRST, GL_RGBA32UI);
    const struct frame_uniforms *u = &before->uniforms;
    gpu_uniform_vec(program, "before_row_0", 4, u->world_from_view[0]);
    gpu_uniform_vec(program, "before_row_1", 4, u->world_from_view[1]);
    gpu_uniform_vec(program, "before_row_2", 4, u->world_from_view[2]);
    gpu_uniform_vec(program, "before_extent", 4, u->extent_near);
    gpu_uniform_int(program, "before_width", (int32_t)u->width);
    gpu_uniform_int(program, "before_height", (int32_t)u->height);
}

struct gpu_buffer *denoise_history_pixels(struct denoise_history *history)
{
    return &history->kept[history->now].pixels;
}

void denoise_history_end(struct denoise_history *history)
{
    history->kept[history->now].whole = history->is_written;
    history->moving += history->is_moving;
}

uint64_t denoise_history_device_bytes(const struct denoise_history *history)
{
    return history->moved.capacity_bytes + history->kept[0].pixels.capacity_bytes +
           history->kept[1].pixels.capacity_bytes;
}

void denoise_history_finish(struct denoise_history *history, struct gpu_device *device)
{
    for (int i = 0; i < 2; i++) {
        gpu_buffer_finish(device, &history->kept[i].pixels);
        denoise_places_finish(&history->kept[i].places);
        history->kept[i].whole = false;
    }
    gpu_buffer_finish(device, &history->moved);
}
