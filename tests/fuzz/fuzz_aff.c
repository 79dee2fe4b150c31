/* SPDX-License-Identifier: MIT */
/* Any bytes as a model: AFF. */
#include "tests/fuzz/importing.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    import_any(aff_import, data, size);
    return 0;
}
