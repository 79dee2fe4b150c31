/* SPDX-License-Identifier: MIT */
/* The pixels of a result. */
#include "render/frame/result.h"

#include <stdlib.h>

void frame_result_finish(struct frame_result *result)
{
    free(result->pixels);
    free(result->comparisons);
    *result = (struct frame_result){0};
}

const uint8_t *frame_result_attachment(const struct frame_result *result, enum attachment which)
{
    size_t bytes = (size_t)result->width * result->height * frame_format_bytes(PIXEL_FORMAT_DEPTH32F);
    /* Attachments come in the order of their layers. */
    static const uint32_t before[] = {[ATTACHMENT_DEPTH] = 1u << ATTACHMENT_NORMALS,
                                      [ATTACHMENT_STICKING] = 1u << ATTACHMENT_DEPTH | 1u << ATTACHMENT_NORMALS};
    return result->pixels + result->size_bytes +
           bytes * (size_t)__builtin_popcount(result->attachments & before[which]);
}
