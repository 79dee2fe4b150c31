// SPDX-License-Identifier: MIT
// The objects of a 3MF model as meshes, and its build as nodes.
#include "reader.hpp"

#include "protocol/common/srgb.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <unordered_map>

namespace threemf
{
namespace
{
constexpr uint32_t instances_max = 1 << 20;
constexpr unsigned depth_max = 64;

using colour = std::array<uint8_t, 4>;
constexpr colour white = {255, 255, 255, 255};

float linear(uint8_t value)
{
    return linear_from_srgb_f(float(value) / 255);
}

std::array<uint16_t, 4> linear_of(const colour &of)
{
    return {reading::wide(linear(of[0])), reading::wide(linear(of[1])), reading::wide(linear(of[2])),
            uint16_t(of[3] * 257)};
}

uint32_t add_material(reader &r, const std::string &name, const colour &of)
{
    message_set_material set;

    import_material_default(&set);
    set.name = name.c_str();
    set.value.double_sided = 1;
    set.value.roughness = 1; // matches plain colours of other formats
    for (size_t c = 0; c < 3; c++)
        set.value.base_colour[c] = linear(of[c]);
    if (of[3] > 0 && of[3] < 255) { // exporters without alpha write 0
        set.value.base_colour[3] = float(of[3]) / 255;
        set.value.alpha_mode = PROTOCOL_ALPHA_BLEND;
    }
    const uint32_t id = import_add_material(r.scene, &set);
    check(r);
    return id;
}

// The meaning of triangles' properties, from the file's groups.
class meaning
{
  public:
    meaning(reader &from, std::map<uint32_t, group> &known) : r(from), groups(known)
    {
    }
    // The material of a triangle; 0: none.
    uint32_t material(const triangle &t)
    {
        group *g = group_of(t);
        if (!g)
            return 0;
        if (!g->has_materials) {
            if (r.colours_material == 0)
                r.colours_material = add_material(r, "colours", white);
            return r.colours_material;
        }
        g->materials.resize(g->colours.size(), 0);
        uint32_t &id = g->materials[t.properties[0]];
        if (id == 0)
            id = add_material(r, g->names[t.properties[0]], g->colours[t.properties[0]]);
        return id;
    }
    colour of_corner(const triangle &t, size_t corner) const
    {
        const group *g = group_of(t);
        return g && !g->has_materials ? g->colours[t.properties[corner]] : white;
    }

  private:
    reader &r;
    std::map<uint32_t, group> &groups;

    // The group of a triangle; NULL: it has no properties, or unsupported ones.
    group *group_of(const triangle &t) const
    {
        const auto found = groups.find(t.group_id);
        if (found == groups.end())
            return nullptr;
        for (const uint32_t property : t.properties)
            if (property >= found->second.colours.size())
                return nullptr;
        return &found->second;
    }
};

// Merges corners with equal positions and colours into vertices.
void split_by_colour(const geometry &from, const std::vector<const triangle *> &order, const meaning &means,
                     reading::mesh_parts &out)
{
    std::unordered_map<uint64_t, uint32_t> made;

    for (const triangle *t : order)
        for (size_t i = 0; i < 3; i++) {
            const colour c = means.of_corner(*t, i);
            uint32_t packed = 0;
            memcpy(&packed, c.data(), sizeof(packed));
            const auto entry =
                made.emplace(uint64_t(packed) << 32 | t->corners[i], uint32_t(out.colours.size() / 4));
            if (entry.second) {
                out.positions.insert(out.positions.end(), &from.positions[size_t(t->corners[i]) * 3],
                                     &from.positions[size_t(t->corners[i]) * 3] + 3);
                const std::array<uint16_t, 4> made_linear = linear_of(c);
                out.colours.insert(out.colours.end(), made_linear.begin(), made_linear.end());
            }
            out.indices.push_back(entry.first->second);
        }
}

reading::mesh_parts make_parts(reader &r, const geometry &from, std::map<uint32_t, group> &groups)
{
    meaning means(r, groups);
    std::vector<std::pair<uint32_t, const triangle *>> sorted;
    std::vector<const triangle *> order;
    reading::mesh_parts out;

    for (const triangle &t : from.triangles)
        sorted.emplace_back(means.material(t), &t);
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto &a, const auto &b) { return a.first < b.first; });
    bool has_colours = false;
    for (const auto &one : sorted) {
        if (out.ranges.empty() || out.ranges.back().material != one.first)
            out.ranges.push_back({uint32_t(order.size()), 0, one.first});
        out.ranges.back().count++;
        order.push_back(one.second);
        has_colours = has_colours || (one.first != 0 && one.first == r.colours_material);
    }
    if (has_colours) {
        split_by_colour(from, order, means, out);
        return out;
    }
    out.positions = from.positions;
    for (const triangle *t : order)
        out.indices.insert(out.indices.end(), t->corners.begin(), t->corners.end());
    return out;
}

struct placing {
    reader &r;
    uint32_t left = instances_max;
};

void place(placing &p, uint32_t parent, const instance &from, unsigned depth)
{
    reader &r = p.r;
    const auto found = r.objects.find(from.key);
    message_set_node set = {};

    if (found == r.objects.end()) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, from.key.first.c_str(), "the object %u does not exist",
                    from.key.second);
        return;
    }
    if (depth > depth_max)
        fail(r, from.key.first, "the object %u has itself as a component, or more than %u levels of components",
             from.key.second, depth_max);
    if (p.left-- == 0)
        fail(r, from.key.first, "the objects are there more than %u times", instances_max);
    set.value.parent = parent;
    set.name = found->second.name.c_str();
    memcpy(set.value.parent_from_node, from.parent_from_object, sizeof(set.value.parent_from_node));
    if (found->second.mesh != 0) {
        set.value.kind = PROTOCOL_NODE_MESH;
        set.value.object = found->second.mesh;
    }
    const uint32_t node = import_add_node(r.scene, &set);
    check(r);
    for (const instance &component : found->second.components)
        place(p, node, component, depth + 1);
}
} // namespace

uint32_t add_mesh(reader &r, const std::string &name, const geometry &from, std::map<uint32_t, group> &groups)
{
    return reading::add_mesh(r, make_parts(r, from, groups), name, "");
}

// Adds the items; the scene has y up, and metres.
void add_items(reader &r)
{
    const float s = float(r.metres), upright[12] = {s, 0, 0, 0, 0, 0, s, 0, 0, -s, 0, 0};
    message_set_node set = {};
    placing p = {r};

    if (r.items.empty())
        fail(r, "", "the 3MF file builds nothing: it has no item");
    memcpy(set.value.parent_from_node, upright, sizeof(upright));
    set.name = "3MF";
    const uint32_t root = import_add_node(r.scene, &set);
    check(r);
    for (const instance &item : r.items)
        place(p, root, item, 0);
}
} // namespace threemf
