/* SPDX-License-Identifier: MIT */
/* The colours that files get: from the renderer's linear Rec. 709 to a space of which primaries are known, or to
 * what an OpenColorIO configuration has: a colour space for EXR, a view of a display for pictures of 8 bits. C++
 * behind C. One for all files of a run. */
#ifndef FARLIGHT_CLIENT_OUTPUT_COLOUR_H
#define FARLIGHT_CLIENT_OUTPUT_COLOUR_H

#include "protocol/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

struct colour_wanted {
    const char *config; /* file of the configuration; NULL: there is none */
    const char *space;  /* NULL: as the renderer has it */
    const char *view;   /* "VIEW" of the default display, or "DISPLAY/VIEW"; NULL: none */
};

bool colour_is_wanted(const struct colour_wanted *wanted);
/* Whether the module of library.h does it, by the configuration. */
bool colour_needs_library(const struct colour_wanted *wanted);
/* Within the sandbox, the module loaded if it is needed. False: `reason` says why. */
bool colour_prepare(const struct colour_wanted *wanted, char *reason, size_t reason_bytes);
/* Converts the frame, which has the format rgba32f, in place; with a view to rgba8. */
bool colour_convert(struct message_frame_begin *begin, uint8_t *pixels, char *reason, size_t reason_bytes);
/* x and y of red, green, blue and white that EXR files name; NULL: they are not known. */
const float *colour_chromaticities(void);

#ifdef __cplusplus
}
#endif

#endif
