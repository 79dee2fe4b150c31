/* SPDX-License-Identifier: MIT */
/* Shares of a picture that depend on the eye, for the wire (protocol/pixels/sticking.h). */
#ifndef FARLIGHT_ENCODE_STICKING_H
#define FARLIGHT_ENCODE_STICKING_H

#include "encode/encoder.h"

/* Encodes 255 times the share of each pixel, one every `apart` bytes. *out: malloc'ed. */
bool sticking_encode(const uint8_t *shares, size_t apart, uint32_t width, uint32_t height, uint8_t **out,
                     size_t *out_bytes, struct error *error);

#endif
