/* SPDX-License-Identifier: MIT */
/* Reads a driver's limits, and compares them with the programs' needs. */
#include "gpu/limits.h"

#include <epoxy/gl.h>

const struct gpu_limit_row gpu_limit_rows[GPU_LIMIT_COUNT] = {
#define LIMIT(name, needed, promised, noun) {"GL_" #name, noun, needed, promised},
#include "gpu/limits.def"
};

void gpu_limits_ask(uint64_t values[GPU_LIMIT_COUNT])
{
    static const GLenum names[GPU_LIMIT_COUNT] = {
#define LIMIT(name, needed, promised, noun) GL_##name,
#include "gpu/limits.def"
    };
    for (int i = 0; i < GPU_LIMIT_COUNT; i++) {
        GLint64 value = 0;
        glGetInteger64v(names[i], &value);
        values[i] = value < 0 ? 0 : (uint64_t)value;
    }
}

bool gpu_limits_check(const uint64_t values[GPU_LIMIT_COUNT], struct error *error)
{
    for (int i = 0; i < GPU_LIMIT_COUNT; i++) {
        const struct gpu_limit_row *row = &gpu_limit_rows[i];
        if (values[i] >= row->needed)
            continue;
        error_set(error, ERROR_UNSUPPORTED, "device", "it has %llu %s (%s); %llu are needed",
                  (unsigned long long)values[i], row->noun, row->name, (unsigned long long)row->needed);
        return error_remedy(error, "take a newer driver, or another device of farlightd --list-devices");
    }
    return true;
}
