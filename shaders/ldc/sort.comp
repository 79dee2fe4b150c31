// SPDX-License-Identifier: MIT
// Sorts the fragments of texels that have many (pack.comp sorts the others).

#define SORT_ITEM uvec2
#include "common/dispatch.glsl"
#include "ldc/run.glsl"
#include "common/sort.glsl"

void main()
{
    uint k = item_index();
    if (k >= occupied_count)
        return;
    run r = run_of(k);
    if (r.count > LDC_PACK_SORTS)
        sort(r);
}
