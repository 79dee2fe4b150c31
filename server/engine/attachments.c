/* SPDX-License-Identifier: MIT */
#include "engine/attachments.h"

#include "encode/depth.h"
#include "encode/parts.h"
#include "encode/sticking.h"

#include <stdlib.h>
#include <string.h>

#define ATTACHMENT_PIXEL_BYTES 4

static bool no_memory_for_attachments(struct error *error)
{
    return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "out of memory for a frame's attachments");
}

/* A picture whose encoding is abandoned together with that of `like`. */
static struct picture picture_of(const struct engine_frame *frame, const struct picture *like,
                                 const uint8_t *pixels, uint32_t pixel_bytes)
{
    return (struct picture){.width = frame->result.width,
                            .height = frame->result.height,
                            .bytes_per_pixel = pixel_bytes,
                            .pixels = pixels,
                            .is_given_up = like->is_given_up,
                            .given_up_context = like->given_up_context};
}

const float *attachments_depths(const struct frame_result *result)
{
    return (const float *)(const void *)frame_result_attachment(result, ATTACHMENT_DEPTH);
}

/* *rounded: malloc'ed; NULL: the frame's depths are in metres. */
static bool round_depths(struct engine_frame *frame, uint16_t **rounded, struct error *error)
{
    const struct frame_result *result = &frame->result;
    const struct depth_picture picture = {.depths = attachments_depths(result),
                                          .width = result->width,
                                          .height = result->height,
                                          .fov_y = frame->request.camera.fov_y,
                                          .pixels = frame->view.depth_pixels,
                                          .radius = frame->view.depth_radius};
    *rounded = NULL;
    return frame->view.depth_form != DEPTH_FORM_INVERSE ||
           depth_round(&picture, rounded, &frame->depth_step, error);
}

/* Appends the bytes and frees them. */
static bool append_bytes(struct engine_frame *frame, uint8_t *added, size_t added_bytes, struct error *error)
{
    uint8_t *bytes = realloc(frame->bytes, frame->size_bytes + added_bytes);
    if (bytes) {
        memcpy(bytes + frame->size_bytes, added, added_bytes);
        frame->bytes = bytes;
        frame->size_bytes += added_bytes;
    }
    free(added);
    return bytes || no_memory_for_attachments(error);
}

static bool append(struct engine_frame *frame, const struct picture *picture, size_t *added_bytes,
                   struct error *error)
{
    uint8_t *encoded;
    return encoder_encode(ENCODING_PREDICTED, picture, 1, &encoded, added_bytes, error) &&
           append_bytes(frame, encoded, *added_bytes, error);
}

/* Coarse depths, which only a frame in parts has; they precede the depths. */
static bool append_coarse_depth(struct engine_frame *frame, const uint16_t *rounded, struct error *error)
{
    uint8_t *encoded;
    if (!frame->in_parts || !rounded)
        return true;
    return depth_encode_coarse(rounded, frame->result.width, frame->result.height, &encoded, &frame->coarse_bytes,
                               error) &&
           append_bytes(frame, encoded, frame->coarse_bytes, error);
}

static bool append_depth(struct engine_frame *frame, const struct picture *like, struct error *error)
{
    uint16_t *rounded;
    if (!(frame->result.attachments & 1u << ATTACHMENT_DEPTH))
        return true;
    if (!round_depths(frame, &rounded, error))
        return false;
    const struct picture picture =
        rounded ? picture_of(frame, like, (const uint8_t *)rounded, sizeof(*rounded))
                : picture_of(frame, like, frame_result_attachment(&frame->result, ATTACHMENT_DEPTH),
                             ATTACHMENT_PIXEL_BYTES);
    const bool done =
        append_coarse_depth(frame, rounded, error) && append(frame, &picture, &frame->depth_bytes, error);
    free(rounded);
    return done;
}

static bool append_normals(struct engine_frame *frame, const struct picture *like, struct error *error)
{
    if (!(frame->result.attachments & 1u << ATTACHMENT_NORMALS))
        return true;
    const struct picture picture = picture_of(
        frame, like, frame_result_attachment(&frame->result, ATTACHMENT_NORMALS), ATTACHMENT_PIXEL_BYTES);
    return append(frame, &picture, &frame->normal_bytes, error);
}

static bool append_sticking(struct engine_frame *frame, struct error *error)
{
    const struct frame_result *result = &frame->result;
    uint8_t *encoded;
    if (!(result->attachments & 1u << ATTACHMENT_STICKING))
        return true;
    return sticking_encode(frame_result_attachment(result, ATTACHMENT_STICKING), ATTACHMENT_PIXEL_BYTES,
                           result->width, result->height, &encoded, &frame->sticking_bytes, error) &&
           append_bytes(frame, encoded, frame->sticking_bytes, error);
}

static bool put_in_parts(struct engine_frame *frame, struct error *error)
{
    const size_t depths_bytes = frame->coarse_bytes + frame->depth_bytes;
    const size_t colours_bytes = frame->size_bytes - depths_bytes - frame->normal_bytes - frame->sticking_bytes;
    const uint8_t *coarse = frame->bytes + colours_bytes, *normals = coarse + depths_bytes;
    const struct parts_source source = {
        .encoding = frame->encoding,
        .bytes = {[FRAME_PART_COLOURS] = frame->bytes,
                  [FRAME_PART_COARSE_DEPTH] = coarse,
                  [FRAME_PART_DEPTH] = coarse + frame->coarse_bytes,
                  [FRAME_PART_NORMALS] = normals,
                  [FRAME_PART_STICKING] = normals + frame->normal_bytes},
        .size_bytes = {[FRAME_PART_COLOURS] = colours_bytes,
                       [FRAME_PART_COARSE_DEPTH] = frame->coarse_bytes,
                       [FRAME_PART_DEPTH] = frame->depth_bytes,
                       [FRAME_PART_NORMALS] = frame->normal_bytes,
                       [FRAME_PART_STICKING] = frame->sticking_bytes},
    };
    if (!frame->in_parts)
        return true;
    uint8_t *bytes = malloc(frame->size_bytes);
    if (!bytes)
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "out of memory for a frame in parts");
    parts_arrange(&source, bytes, &frame->parts);
    free(frame->bytes);
    frame->bytes = bytes;
    if (frame->parts.count == 1)
        frame->parts.count = 0;
    return true;
}

bool attachments_append(struct engine_frame *frame, const struct picture *picture, struct error *error)
{
    return append_depth(frame, picture, error) && append_normals(frame, picture, error) &&
           append_sticking(frame, error) && put_in_parts(frame, error);
}
