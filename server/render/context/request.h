/* SPDX-License-Identifier: MIT */
/* Validation and comparison of frame requests. */
#ifndef FARLIGHT_RENDER_CONTEXT_REQUEST_H
#define FARLIGHT_RENDER_CONTEXT_REQUEST_H

#include "render/frame/frame.h"

/* Checks what the session's checks of a client's request do not cover. Tracers are left out.
 */
bool frame_request_check(const struct frame_request *request, struct error *error);
/* As bits, with that of the beauty where the request names none. */
uint32_t frame_request_layers(const struct frame_request *request);
/* The plane that an attachment alone is made of: a layer after all others. */
#define LAYER_STICKING ((enum layer)31)
/* All that there is a plane for in the picture: layers and those that attachments are made of. */
uint32_t frame_request_planes(const struct frame_request *request);
/* Of a plane's pixels on the host, that of the beauty where the request attaches what it is. */
unsigned frame_request_plane_format(const struct frame_request *request, enum layer layer);
uint32_t frame_format_bytes(unsigned format); /* of a pixel */
/* Of a plane's rows on the host; a multiple of 8, or all that there are. As Y'CbCr an odd last one has two. */
uint64_t frame_request_plane_bytes(const struct frame_request *request, enum layer layer, uint32_t rows);
/* Of the frame's pixels, all planes. */
uint64_t frame_request_bytes(const struct frame_request *request);
/* Behind the surfaces of the picture. */
bool frame_request_hides_environment(const struct frame_request *request);
/* What its clamp limits radiance to, before exposure; 0: nothing is limited. */
float frame_request_radiance_limit(const struct frame_request *request);
/* Whether the same ray brings the same radiance. */
bool frame_request_same_radiance(const struct frame_request *a, const struct frame_request *b);
/* How many samples a pixel will have is not known beforehand. */
bool frame_request_goes_on(const struct frame_request *request);
/* Whether the samples of `b` may be added to those of `a`: they are equal but for their number and the use of the
 * sum, and `b` does not start anew. */
bool frame_request_adds_to(const struct frame_request *a, const struct frame_request *b);

#endif
