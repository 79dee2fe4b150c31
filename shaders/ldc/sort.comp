// SPDX-License-Identifier: MIT
// Sorts the fragments of texels that have many (pack.comp does the others): by insertion where they come nearly in
// order, as those of things drawn front to back do, else as a heap. No loop here runs more than a few rounds for each
// fragment and each doubling of their number: software GL ends an invocation's loops after 65,535 rounds.

#include "common/dispatch.glsl"
#include "ldc/run.glsl"

const uint MOVES_EACH = 4u; // a fragment: more than the heap is worth

// Whether it was done: false leaves them in another order.
bool insert_all(run r)
{
    uint moves = MOVES_EACH * r.count;
    for (uint i = 1u; i < r.count; i++) {
        uvec2 moved = load(r, i);
        uint k = i;
        for (; k > 0u; k--) {
            uvec2 above = load(r, k - 1u);
            if (!before(moved, above) || moves == 0u)
                break;
            store(r, k, above);
            moves--;
        }
        if (k != i)
            store(r, k, moved);
        if (moves == 0u)
            return false;
    }
    return true;
}

// Down from `at` to where what is below it comes before it.
void sift(run r, uint at, uint count)
{
    uvec2 own = load(r, at);
    for (;;) {
        uint below = 2u * at + 1u;
        if (below >= count)
            break;
        uvec2 most = load(r, below);
        if (below + 1u < count) {
            uvec2 other = load(r, below + 1u);
            bool greater = before(most, other);
            most = greater ? other : most;
            below += greater ? 1u : 0u;
        }
        if (!before(own, most))
            break;
        store(r, at, most);
        at = below;
    }
    store(r, at, own);
}

void main()
{
    uint k = item_index();
    if (k >= occupied_count)
        return;
    run r = run_of(k);
    if (r.count <= LDC_PACK_SORTS || insert_all(r))
        return;
    for (uint i = r.count / 2u; i > 0u; i--)
        sift(r, i - 1u, r.count);
    for (uint left = r.count - 1u; left > 0u; left--) {
        uvec2 last = load(r, left);
        store(r, left, load(r, 0u));
        store(r, 0u, last);
        sift(r, 0u, left);
    }
}
