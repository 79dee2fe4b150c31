// SPDX-License-Identifier: MIT
// Comparison of two image files with OpenImageIO and libjxl.
#pragma once

#include "output/library.h"

// Implements compare_images.
bool compare_with_library(const struct library_host *host, const struct message_compare_images *wanted,
                          const struct compare_file *a, const struct compare_file *b,
                          struct compare_result *result);
