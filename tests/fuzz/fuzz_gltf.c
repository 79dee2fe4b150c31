/* SPDX-License-Identifier: MIT */
/* Any bytes as a model: glTF 2.0, JSON or binary. */
#include "import/gltf/import.h"
#include "tests/fuzz/importing.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    import_any(gltf_import, data, size);
    return 0;
}
