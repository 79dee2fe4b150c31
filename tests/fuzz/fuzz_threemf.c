/* SPDX-License-Identifier: MIT */
/* Any bytes as a model: 3MF. Those that are kept are archives that are not packed, so that changed bytes reach the
 * parser of XML; checksums are looked at behind it. */
#include "import/threemf/import.h"
#include "tests/fuzz/importing.h"

static bool import_alone(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                         size_t size_bytes)
{
    (void)files;
    return threemf_import(scene, bytes, size_bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    import_any(import_alone, data, size);
    return 0;
}
