/* SPDX-License-Identifier: MIT */
/* Colours of files: conversion from the renderer's linear Rec. 709 to a space with known primaries, or by an
 * OpenColorIO configuration to a colour space for EXR or to a display's view for pictures of 8 bits. C++ behind
 * C. All files of a run share one conversion. */
#ifndef FARLIGHT_CLIENT_OUTPUT_COLOUR_H
#define FARLIGHT_CLIENT_OUTPUT_COLOUR_H

#include "protocol/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

struct colour_wanted {
    const char *config; /* file of the configuration; NULL: none */
    const char *space;  /* NULL: the renderer's */
    const char *view;   /* "VIEW" of the default display, or "DISPLAY/VIEW"; NULL: none */
};

bool colour_is_wanted(const struct colour_wanted *wanted);
/* True if the conversion needs the module of library.h, for the configuration. */
bool colour_needs_library(const struct colour_wanted *wanted);
/* Prepares the conversion, within the sandbox and after the module was loaded. False: `reason` is set. */
bool colour_prepare(const struct colour_wanted *wanted, char *reason, size_t reason_bytes);
/* Converts a frame of the format rgba32f in place; a view makes it rgba8. */
bool colour_convert(struct message_frame_begin *begin, uint8_t *pixels, char *reason, size_t reason_bytes);
/* x and y of red, green, blue and white, for EXR files; NULL: unknown. */
const float *colour_chromaticities(void);

#ifdef __cplusplus
}
#endif

#endif
