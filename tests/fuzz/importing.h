/* SPDX-License-Identifier: MIT */
/* Shared parts of the fuzzers of the importer's formats. */
#ifndef FARLIGHT_TESTS_FUZZ_IMPORTING_H
#define FARLIGHT_TESTS_FUZZ_IMPORTING_H

#include "import/model/files.h"
#include "import/model/scene.h"
#include "tests/fuzz/fuzz.h"

#include <stdlib.h>
#include <string.h>

typedef bool importing_fn(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                          size_t size_bytes);

/* A model in a folder where nothing else can be read. It becomes edits or a reason why not. */
static inline void import_any(importing_fn *import, const uint8_t *data, size_t size)
{
    static struct import_scene scene;
    struct files files = {.folder = -1, .model = -1, .environment = -1};
    unsigned char *bytes = malloc(size + 1);
    FUZZ_REQUIRE(bytes);
    if (size > 0)
        memcpy(bytes, data, size);
    bytes[size] = 0;
    import_scene_init(&scene, "model");
    bool imported = size > 0 && import(&scene, &files, bytes, size);
    FUZZ_REQUIRE(!imported || (!scene.failed && import_hash(&scene)));
    FUZZ_REQUIRE(imported || size == 0 || (scene.failed && scene.failure.text[0] != '\0'));
    import_scene_finish(&scene);
    free(bytes);
}

#endif
