/* SPDX-License-Identifier: MIT */
/* Any bytes as a model of a format that Assimp reads: the first byte chooses it. */
#include "import/assimp/import.h"
#include "tests/fuzz/importing.h"

static const struct assimp_format *format;

static bool import_with_library(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                                size_t size_bytes)
{
    return assimp_import(scene, files, format, bytes, size_bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    size_t count = 0;
    while (assimp_format_at(count))
        count++;
    if (size == 0)
        return 0;
    format = assimp_format_at(data[0] % count);
    import_any(import_with_library, data + 1, size - 1);
    return 0;
}
