// SPDX-License-Identifier: MIT
// Traversal of a geometry's tree of wide nodes (BVH_WIDE; layout: tree/layout.h), by one ray. Ylitie, Karras, Laine,
// Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017, section 4: the children of a node that
// the ray hits are a group, in bits by the order in which its octant visits them. What is left of a group when one of its
// nodes is visited waits on a stack: at most one group a level, and a tree has at most BVH_WIDE_DEPTH_MAX levels, so the
// stack cannot overflow.
//
// Nodes are visited until one has primitives; then these are tested: see the loops of traverse.glsl.
#ifdef BVH_WIDE

// A group of nodes: number of the first inner child of their parent; hits in bits 24..31 by priority, inner children in
// bits 0..7 by slot. y is 0 at the end of the tree. A group of primitives: the first one; hits in bits 0..23.
struct wide_traversal {
    uvec2 nodes, primitives;
    int height; // groups on the stack
};
wide_traversal wide;
uvec2 wide_stack[BVH_WIDE_DEPTH_MAX];

// The ray in the tree's space: a plane at p is hit at (p - origin) reciprocal, but for the slack.
struct wide_ray {
    vec3 origin, reciprocal, slack;
    uint octant_inverse; // 7 ^ octant
    uint first_texel;    // the root's first texel
#ifdef HAS_SPHERES
    uint leaf_kind;
#endif
};
wide_ray wide_r;

const uint WIDE_HITS = 0xff000000u;

// `extent`: the largest coordinates in the tree, by which the slack is that of origins of nodes (tree/slack.glsl).
void begin_wide(object_ray o, vec3 extent, uint first_node, uint leaf_kind)
{
    vec3 d = o.direction;
    float smallest = 1e-12 * max_component(abs(d)); // see bundle_of()
    wide_r.origin = o.origin;
    wide_r.reciprocal = 1.0 / mix(d, vec3(smallest), lessThan(abs(d), vec3(smallest)));
    wide_r.slack = OBJECT_SLACK * (abs(o.origin) + extent) * abs(wide_r.reciprocal);
    uvec3 negative = uvec3(lessThan(wide_r.reciprocal, vec3(0.0)));
    wide_r.octant_inverse = 7u ^ (negative.x | negative.y << 1 | negative.z << 2);
    wide_r.first_texel = first_node * BVH_WIDE_TEXELS;
#ifdef HAS_SPHERES
    wide_r.leaf_kind = leaf_kind;
#endif
    wide.nodes = uvec2(0u, 0x80000000u); // a group of the root alone
    wide.primitives = uvec2(0u);
    wide.height = 0;
}

void end_wide()
{
    wide.nodes.y = wide.primitives.y = 0u;
}

float wide_cell(uint byte_) // 2^e, e signed
{
    return uintBitsToFloat((byte_ + 127u & 0xffu) << 23);
}

vec4 wide_bytes(uint word)
{
    return vec4(ivec4(word & 0xffu, word >> 8 & 0xffu, word >> 16 & 0xffu, word >> 24));
}

// Bits of those of four children that the ray hits: of inner ones their priority, of leaves their primitives.
uint wide_hits(uint meta, uvec3 nearer, uvec3 farther, vec3 scale, vec3 near, vec3 far, float t_min, float t_max)
{
    vec4 x0 = wide_bytes(nearer.x) * scale.x + near.x, x1 = wide_bytes(farther.x) * scale.x + far.x;
    vec4 y0 = wide_bytes(nearer.y) * scale.y + near.y, y1 = wide_bytes(farther.y) * scale.y + far.y;
    vec4 z0 = wide_bytes(nearer.z) * scale.z + near.z, z1 = wide_bytes(farther.z) * scale.z + far.z;
    vec4 enter = max(max(x0, y0), max(z0, vec4(t_min))), leave = min(min(x1, y1), min(z1, vec4(t_max)));
    uint is_inner = (meta & meta << 1) & 0x10101010u; // bits 3 and 4 of 24 + slot
    uint inner_bytes = (is_inner >> 4) * 0xffu;
    uint places = (meta ^ (wide_r.octant_inverse * 0x01010101u & inner_bytes)) & 0x1f1f1f1fu;
    uint bits = meta >> 5 & 0x07070707u, hits = 0u;
    // The negated comparisons let NaN count as a hit.
    hits |= !(enter.x > leave.x) ? (bits & 0xffu) << (places & 0xffu) : 0u;
    hits |= !(enter.y > leave.y) ? (bits >> 8 & 0xffu) << (places >> 8 & 0xffu) : 0u;
    hits |= !(enter.z > leave.z) ? (bits >> 16 & 0xffu) << (places >> 16 & 0xffu) : 0u;
    hits |= !(enter.w > leave.w) ? (bits >> 24) << (places >> 24) : 0u;
    return hits;
}

// Visits the next node of the group.
void visit_wide_node(float t_min, float t_max)
{
    uvec2 group = wide.nodes;
    uint bit = uint(findMSB(group.y));
    group.y &= ~(1u << bit);
    if ((group.y & WIDE_HITS) != 0u)
        wide_stack[wide.height++] = group;
    uint slot = bit - 24u ^ wide_r.octant_inverse;
    uint node = group.x + uint(bitCount(group.y & 0xffu & (1u << slot) - 1u));
    int texel = int(wide_r.first_texel + node * BVH_WIDE_TEXELS);
    uvec4 n0 = texelFetch(bvh_elements, texel), n1 = texelFetch(bvh_elements, texel + 1);
    uvec4 n2 = texelFetch(bvh_elements, texel + 2), n3 = texelFetch(bvh_elements, texel + 3);
    uvec4 n4 = texelFetch(bvh_elements, texel + 4);
    vec3 scale = vec3(wide_cell(n0.w & 0xffu), wide_cell(n0.w >> 8 & 0xffu), wide_cell(n0.w >> 16 & 0xffu)) *
                 wide_r.reciprocal;
    vec3 begin = (uintBitsToFloat(n0.xyz) - wide_r.origin) * wide_r.reciprocal;
    vec3 near = begin - wide_r.slack, far = begin + wide_r.slack;
    bvec3 negative = lessThan(wide_r.reciprocal, vec3(0.0));
    uvec3 lower = uvec3(n2.x, n2.z, n3.x), upper = uvec3(n3.z, n4.x, n4.z);
    uint hits = wide_hits(n1.z, mix(lower, upper, negative), mix(upper, lower, negative), scale, near, far, t_min, t_max);
    lower = uvec3(n2.y, n2.w, n3.y);
    upper = uvec3(n3.w, n4.y, n4.w);
    hits |= wide_hits(n1.w, mix(lower, upper, negative), mix(upper, lower, negative), scale, near, far, t_min, t_max);
    wide.nodes = uvec2(n1.x, hits & WIDE_HITS | n0.w >> 24);
    wide.primitives = uvec2(n1.y, hits & ~WIDE_HITS);
    if ((hits & WIDE_HITS) == 0u) {
        bool is_empty = wide.height == 0;
        wide.height = max(wide.height - 1, 0);
        wide.nodes = is_empty ? uvec2(0u) : wide_stack[wide.height];
    }
}

// Tests primitives of the group until none is left, or an intersection is noted.
void test_wide_primitives(entered_instance inside, object_ray o[PACKET_RAYS], relative_rays rays,
                          inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS], inout noted_primitive noted)
{
    while (wide.primitives.y != 0u && noted.bits == 0u) {
        uint bit = uint(findLSB(wide.primitives.y));
        wide.primitives.y &= wide.primitives.y - 1u;
#ifdef HAS_SPHERES
        if (wide_r.leaf_kind == BVH_LEAF_SPHERES)
            test_sphere(wide.primitives.x + bit, inside, o, r, found, noted);
        else
#endif
            test_triangle(wide.primitives.x + bit, inside, o, rays, r, found, noted);
    }
}

uint test_wide_leaves(entered_instance inside, object_ray o[PACKET_RAYS], relative_rays rays,
                      inout trace_ray r[PACKET_RAYS], inout answer found[PACKET_RAYS], inout noted_primitive noted)
{
    for (;;) {
        distances_left left = left_of(r, found);
        while (wide.primitives.y == 0u && wide.nodes.y != 0u) {
#ifdef BVH_BUDGET
            if (budget_left == 0u)
                break;
            budget_left--;
#endif
            visit_wide_node(left.t_min, left.t_max);
        }
        if (wide.primitives.y == 0u)
            return 0u;
        test_wide_primitives(inside, o, rays, r, found, noted);
#ifdef ASK_MATERIALS
        if (noted.bits != 0u)
            return LEAF_NOTED;
#elif defined ANY_HIT
        if (!is_alive_any(r))
            end_wide();
#endif
    }
}

#ifdef BVH_RESUMES

// The place of a ray in bvh/layout.h, behind its first texel. No primitives are left where a budget ends.
void store_wide()
{
    uint texel = item_index() * PLACE_TEXELS + 1u;
    places[texel] = uvec4(wide.nodes, uint(wide.height), 0u);
    for (int i = 0; i < wide.height; i += 2)
        places[texel + 1u + uint(i) / 2u] = uvec4(wide_stack[i], wide_stack[min(i + 1, int(BVH_WIDE_DEPTH_MAX) - 1)]);
}

void load_wide()
{
    uint texel = item_index() * PLACE_TEXELS + 1u;
    uvec4 first = places[texel];
    wide.nodes = first.xy;
    wide.height = int(first.z);
    for (int i = 0; i < wide.height; i += 2) {
        uvec4 pair = places[texel + 1u + uint(i) / 2u];
        wide_stack[i] = pair.xy;
        wide_stack[min(i + 1, int(BVH_WIDE_DEPTH_MAX) - 1)] = pair.zw;
    }
}

#endif

#endif
