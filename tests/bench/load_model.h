/* SPDX-License-Identifier: MIT */
/* A model file into a scene of this process, for benchmarks and tests in C. farlight-import reads it, as it does
 * for a client; its offers, blobs and edits are answered here by the daemon's own functions, with no daemon. */
#ifndef FARLIGHT_TESTS_LOAD_MODEL_H
#define FARLIGHT_TESTS_LOAD_MODEL_H

#include "base/error.h"
#include "scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

struct loaded_model {
    struct scene *scene;
    uint64_t blob_bytes; /* of the blobs that came, each counted once */
    uint64_t edits;      /* of all transactions */
    uint32_t camera;     /* the first node that shows a camera; 0: none */
};

/* The helper lies in $FARLIGHT_LIBEXEC, or else in the build folder that the running program is part of. Zeroes
 * *model first; false and *error: it cannot be started, refuses the file, or the scene refuses its edits. */
bool load_model(struct loaded_model *model, const char *path, struct error *error);
void load_model_finish(struct loaded_model *model);

#endif
