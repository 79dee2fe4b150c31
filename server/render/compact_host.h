/* SPDX-License-Identifier: MIT */
/* The lists of compact.h, made by the host: software GL shares its memory, and would take longer to compile the
 * passes than they run for. Same lists, to the byte. */
#ifndef FARLIGHT_RENDER_COMPACT_HOST_H
#define FARLIGHT_RENDER_COMPACT_HOST_H

#include "render/context.h"

/* Of a context whose counts are on the host. */
bool compact_host_is_used(const struct render_context *context);
bool compact_host_hits(struct render_context *context, struct error *error);
/* How many children and shadow rays the hits have. */
bool compact_host_count(struct render_context *context, struct gpu_buffer *child_counts, uint32_t *children,
                        uint32_t *shadow_rays, struct error *error);
/* The places of the children, of which there are some. `sorted`: octant by octant. */
bool compact_host_places(struct render_context *context, struct gpu_buffer *child_counts, bool sorted,
                         struct error *error);

#endif
