/* SPDX-License-Identifier: MIT */
/* Any bytes as a model: NFF. */
#include "import/nff/import.h"
#include "tests/fuzz/importing.h"

static bool import_alone(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                         size_t size_bytes)
{
    (void)files;
    return nff_import(scene, bytes, size_bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    import_any(import_alone, data, size);
    return 0;
}
