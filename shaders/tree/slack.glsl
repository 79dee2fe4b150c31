// SPDX-License-Identifier: MIT
// Slack by which rays count as displaced, and surfaces as nearer, so that rounding loses no hit.
//
// Rounding, with u = 2^-24. A box's plane b is hit at b i - o i, i = 1 / d: the reciprocal errs by 1 u (2.5 u on
// hardware), each product by 1 u, the difference by 1 u, which moves the plane by at most 5 u (|b| + |o|). The
// intersection of the primitive itself errs by about as much (corners are relative to the origin), and a sphere's
// distance from the line by less than 8 u of the same. The bounds include the part of b: the builder pads them by
// BVH_PAD_RELATIVE = 8 u of their magnitude, and on a grid by 8 u of its cells. The slack of the ray is the part of o:
// OBJECT_SLACK |o| with 16 u, on a grid of |o| + |the grid's corner|, to which it is relative. In the top tree the ray
// will be transformed to an object's space, which rounds again, by some 6 u |o| in that space, and so by that times the
// matrix's condition in this one: WORLD_SLACK is 128 u, for conditions up to 20.

const float OBJECT_SLACK = 9.5367431640625e-7;  // 2^-20
const float WORLD_SLACK = 7.62939453125e-6;     // 2^-17

// Factor by which an element may begin beyond the closest hit so far: a distance is less exact than a bound if the ray
// grazes a triangle, and finding a slightly nearer one must not depend on the order. 2^-14 suffices if the cosine between
// ray and normal is above some 0.005; below, of two surfaces this close together, either may be hit.
const float PRUNE_SLACK = 1.00006103515625;
