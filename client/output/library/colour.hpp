// SPDX-License-Identifier: MIT
// Colours of an OpenColorIO configuration, by OpenImageIO.
#pragma once

#include "output/library.h"

// See struct image_library.
bool colour_open_configuration(const struct library_colour *wanted, char *reason, size_t reason_bytes);
void colour_apply_to(float *pixels, size_t count);
