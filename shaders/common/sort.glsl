// SPDX-License-Identifier: MIT
// Sorts a run in place: by insertion where its items are nearly in order, as those of objects drawn front to back are,
// else as a heap. No loop here runs more than a few rounds for each item and each doubling of their number: software GL
// ends an invocation's loops after 65,535 rounds. The including file defines before: SORT_ITEM, a type; struct run with a
// member `count`; SORT_ITEM load(run, uint), void store(run, uint, SORT_ITEM), bool before(SORT_ITEM, SORT_ITEM).

const uint MOVES_EACH = 4u; // per item: with more moves, a heap is faster

// Sorts by insertion. False: it gave up, and the items are partly sorted.
bool insert_all(run r)
{
    uint moves = MOVES_EACH * r.count;
    for (uint i = 1u; i < r.count; i++) {
        SORT_ITEM moved = load(r, i);
        uint k = i;
        for (; k > 0u; k--) {
            SORT_ITEM above = load(r, k - 1u);
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

// Sifts the item at `at` down the heap.
void sift(run r, uint at, uint count)
{
    SORT_ITEM own = load(r, at);
    for (;;) {
        uint below = 2u * at + 1u;
        if (below >= count)
            break;
        SORT_ITEM maximum = load(r, below);
        if (below + 1u < count) {
            SORT_ITEM other = load(r, below + 1u);
            bool greater = before(maximum, other);
            maximum = greater ? other : maximum;
            below += greater ? 1u : 0u;
        }
        if (!before(own, maximum))
            break;
        store(r, at, maximum);
        at = below;
    }
    store(r, at, own);
}

void sort(run r)
{
    if (insert_all(r))
        return;
    for (uint i = r.count / 2u; i > 0u; i--)
        sift(r, i - 1u, r.count);
    for (uint left = r.count - 1u; left > 0u; left--) {
        SORT_ITEM last = load(r, left);
        store(r, left, load(r, 0u));
        store(r, 0u, last);
        sift(r, 0u, left);
    }
}
