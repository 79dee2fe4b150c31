/* SPDX-License-Identifier: MIT */
/* From sums of samples to pixels in the output's format. */
#ifndef FARLIGHT_RENDER_PICTURE_RESOLVE_H
#define FARLIGHT_RENDER_PICTURE_RESOLVE_H

#include "render/picture/picture.h"

/* Announces the programs that accumulate and resolve (gpu_program_announce). */
void picture_announce(const struct picture *picture, struct render_wave *wave);
/* Resolves a band of a plane into picture->resolved. */
bool picture_resolve_band(struct picture *picture, const struct render_frame *frame, uint32_t plane, uint32_t band,
                          struct error *error);

#endif
