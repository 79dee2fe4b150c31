// SPDX-License-Identifier: MIT
// Morph targets: their offsets, and their default weights.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace gltf
{
namespace
{
const char *const names[3] = {"POSITION", "NORMAL", "TANGENT"};

bool any_has(const std::vector<morph_lot> &lots, const char *name)
{
    for (const morph_lot &lot : lots)
        for (const auto &target : lot.primitive->targets)
            if (target.count(name) > 0)
                return true;
    return false;
}

void read_lot(reader &r, const morph_lot &lot, size_t which, import_mesh &mesh, const std::string &where)
{
    const size_t targets = std::min<size_t>(lot.primitive->targets.size(), mesh.target_count);

    for (size_t target = 0; target < targets; target++) {
        const auto found = lot.primitive->targets[target].find(names[which]);
        if (found == lot.primitive->targets[target].end())
            continue; // zeros
        const std::string here = where + "." + place("targets", target) + "." + names[which];
        accessor_count(r, found->second, TINYGLTF_TYPE_VEC3, here);
        read_floats(r, found->second, 3, 0,
                    mesh.target_offsets[which] + (target * mesh.vertex_count + lot.first) * 3, here);
    }
}
} // namespace

size_t read_targets(reader &r, const std::vector<morph_lot> &lots, import_mesh &mesh, const std::string &where)
{
    size_t count = 0;

    for (const morph_lot &lot : lots)
        count = std::max(count, lot.primitive->targets.size());
    for (const morph_lot &lot : lots)
        if (lot.primitive->targets.size() != count)
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "primitives of one mesh have different numbers of morph targets");
    if (count > IMPORT_TARGETS_MAX)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "the first %d of %zu morph targets were kept", IMPORT_TARGETS_MAX, count);
    mesh.target_count = uint32_t(std::min<size_t>(count, IMPORT_TARGETS_MAX));
    for (size_t which = 0; which < 3 && mesh.target_count > 0; which++) {
        const bool has_base = which == 0 || (which == 1 ? mesh.normals : mesh.tangents);
        // Positions are always present, if only as zeros; the others need a base attribute.
        if (which > 0 && (!has_base || !any_has(lots, names[which])))
            continue;
        const uint64_t vectors = uint64_t(mesh.vertex_count) * mesh.target_count;
        mesh.target_offsets[which] = reading::allocate<float>(r, where, vectors * 3);
        for (const morph_lot &lot : lots)
            read_lot(r, lot, which, mesh, where);
    }
    return count;
}

std::vector<record_morph_weight> morph_weights(reader &r, const std::vector<double> &from, size_t count,
                                               const std::string &where)
{
    std::vector<record_morph_weight> weights(count);

    for (size_t i = 0; i < count && i < from.size(); i++)
        weights[i].weight = limited(r, where, "a morph target's weight", from[i], -1e6, 1e6);
    return weights;
}
} // namespace gltf
