/* SPDX-License-Identifier: MIT */
/* Limits of a driver beside the needs of the programs: the rows of limits.def. */
#ifndef FARLIGHT_GPU_LIMITS_H
#define FARLIGHT_GPU_LIMITS_H

#include "base/error.h"

#include <stdbool.h>
#include <stdint.h>

enum gpu_limit {
#define LIMIT(name, needed, promised, noun) GPU_##name,
#include "gpu/limits.def"
    GPU_LIMIT_COUNT
};

struct gpu_limit_row {
    const char *name, *noun; /* "GL_MAX_..", "storage bindings" */
    uint64_t needed;
    uint64_t promised; /* by OpenGL 4.5 */
};
extern const struct gpu_limit_row gpu_limit_rows[GPU_LIMIT_COUNT];

/* Reads the limits of the current context. */
void gpu_limits_ask(uint64_t values[GPU_LIMIT_COUNT]);
/* Whether all of them suffice; otherwise ERROR_UNSUPPORTED names the first one that does not, its value and the
 * need. */
bool gpu_limits_check(const uint64_t values[GPU_LIMIT_COUNT], struct error *error);

#endif
