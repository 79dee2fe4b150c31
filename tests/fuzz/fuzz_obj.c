/* SPDX-License-Identifier: MIT */
/* Any bytes as a model: Wavefront OBJ. */
#include "import/obj/import.h"
#include "tests/fuzz/importing.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    import_any(obj_import, data, size);
    return 0;
}
