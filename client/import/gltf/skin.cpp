// SPDX-License-Identifier: MIT
// Skins, and their influences on vertices. The server moves the vertices, not the importer.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace gltf
{
namespace
{
struct influence {
    uint32_t joint;
    float weight;
};

// An accessor of joints and one of weights, with four of each for a vertex.
struct influence_set {
    std::vector<uint32_t> joints;
    std::vector<float> weights;
};

std::vector<influence_set> read_sets(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                                     const std::string &where)
{
    std::vector<influence_set> sets;

    for (;;) {
        const std::string number = std::to_string(sets.size());
        const auto joints = primitive.attributes.find("JOINTS_" + number);
        const auto weights = primitive.attributes.find("WEIGHTS_" + number);
        if (joints == primitive.attributes.end() || weights == primitive.attributes.end())
            return sets;
        check_room(r, where, vertices, 32);
        influence_set one;
        one.joints = read_integers(r, joints->second, 4, where + "." + joints->first);
        one.weights.resize(vertices * 4);
        accessor_count(r, weights->second, TINYGLTF_TYPE_VEC4, where + "." + weights->first);
        read_floats(r, weights->second, 4, 0, one.weights.data(), where + "." + weights->first);
        sets.push_back(std::move(one));
    }
}

// Collects the influences of a vertex, up to the limit.
void collect(reader &r, const std::vector<influence_set> &sets, size_t vertex, std::vector<influence> &found,
             const std::string &where)
{
    found.clear();
    for (const influence_set &set : sets)
        for (size_t i = vertex * 4; i < vertex * 4 + 4; i++)
            if (set.weights[i] > 0 && std::isfinite(set.weights[i]))
                found.push_back({set.joints[i], set.weights[i]});
    if (found.size() > IMPORT_INFLUENCES_MAX) {
        std::stable_sort(found.begin(), found.end(),
                         [](const influence &a, const influence &b) { return a.weight > b.weight; });
        found.resize(IMPORT_INFLUENCES_MAX);
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "of the joints that move a vertex the %d with the largest weights were kept",
                    IMPORT_INFLUENCES_MAX);
    }
    if (found.empty()) { // vertices without influences follow a joint, as in other programs
        found.push_back({0, 1});
        import_note(r.scene, PROTOCOL_SEVERITY_INFO, where.c_str(),
                    "vertices without weights follow the first joint of the skin");
    }
}

struct skin_arrays {
    uint32_t *joints = nullptr;
    float *joint_from_mesh = nullptr;

    ~skin_arrays()
    {
        free(joints);
        free(joint_from_mesh);
    }
};

void read_bind_matrices(reader &r, const tinygltf::Skin &skin, float *joint_from_mesh, const std::string &where)
{
    const size_t present = accessor_count(r, skin.inverseBindMatrices, TINYGLTF_TYPE_MAT4, where);
    if (present < skin.joints.size())
        fail(r, where, "fewer inverse bind matrices than joints");
    check_room(r, where, present, 64);
    std::vector<float> columns(present * 16);
    read_floats(r, skin.inverseBindMatrices, 16, 0, columns.data(), where);
    for (size_t j = 0; j < skin.joints.size(); j++) {
        const float *from = columns.data() + j * 16;
        const bool usable = std::all_of(from, from + 16, [](float value) { return std::fabs(value) <= 1e12f; });
        if (!usable)
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "an inverse bind matrix is not finite or beyond 1e12 and is taken as none");
        for (size_t row = 0; row < 3; row++)
            for (size_t column = 0; column < 4; column++)
                joint_from_mesh[j * 12 + row * 4 + column] = usable          ? from[column * 4 + row]
                                                             : row == column ? 1.0f
                                                                             : 0.0f;
    }
}

void add_skin(reader &r, int index, uint32_t id)
{
    const tinygltf::Skin &skin = r.model.skins[size_t(index)];
    const std::string where = place("skins", size_t(index));
    skin_arrays arrays;

    arrays.joints = reading::allocate<uint32_t>(r, where, skin.joints.size());
    for (size_t j = 0; j < skin.joints.size(); j++)
        arrays.joints[j] = add_hidden_node(r, size_t(skin.joints[j]));
    if (skin.inverseBindMatrices >= 0) {
        arrays.joint_from_mesh = reading::allocate<float>(r, where, skin.joints.size() * 12);
        read_bind_matrices(r, skin, arrays.joint_from_mesh, where);
    }
    uint32_t *joints = arrays.joints;
    float *joint_from_mesh = arrays.joint_from_mesh;
    arrays.joints = nullptr;
    arrays.joint_from_mesh = nullptr;
    if (!import_add_skin(r.scene, id, skin.name.c_str(), uint32_t(skin.joints.size()), joints, joint_from_mesh))
        throw reading::failed();
}
} // namespace

influences read_influences(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                           const std::string &where)
{
    const std::vector<influence_set> sets = read_sets(r, primitive, vertices, where);
    std::vector<influence> found;
    influences result;

    if (sets.empty())
        return result;
    result.stride = std::min<size_t>(sets.size() * 4, IMPORT_INFLUENCES_MAX);
    check_room(r, where, vertices, result.stride * 6);
    result.joints.assign(vertices * result.stride, 0);
    result.weights.assign(vertices * result.stride, 0);
    for (size_t v = 0; v < vertices; v++) {
        collect(r, sets, v, found, where);
        result.used = std::max(result.used, found.size());
        for (size_t i = 0; i < found.size(); i++) {
            if (found[i].joint >= IMPORT_JOINTS_MAX)
                fail(r, where, "vertex %zu names joint %u", v, found[i].joint);
            result.joints[v * result.stride + i] = uint16_t(found[i].joint);
            result.weights[v * result.stride + i] = found[i].weight;
            result.max_joint = std::max(result.max_joint, found[i].joint);
        }
    }
    return result;
}

uint32_t skin_id(reader &r, int index, const shown_mesh &mesh, const std::string &where)
{
    if (size_t(index) >= r.model.skins.size())
        fail(r, where, "skin %d does not exist", index);
    const tinygltf::Skin &skin = r.model.skins[size_t(index)];
    if (skin.joints.empty() || skin.joints.size() > IMPORT_JOINTS_MAX)
        fail(r, place("skins", size_t(index)), "%zu joints; 1 to %d are allowed", skin.joints.size(),
             IMPORT_JOINTS_MAX);
    if (mesh.max_joint >= skin.joints.size())
        fail(r, where, "a vertex of the mesh names joint %u of %zu", mesh.max_joint, skin.joints.size());
    uint32_t &id = r.skin_ids[index];
    if (id != 0)
        return id;
    for (int joint : skin.joints)
        if (joint < 0 || size_t(joint) >= r.model.nodes.size())
            fail(r, place("skins", size_t(index)), "joint node %d does not exist", joint);
    return id = import_reserve_id(r.scene, PROTOCOL_OBJECT_SKIN);
}

void add_skins(reader &r)
{
    for (const auto &skin : r.skin_ids)
        add_skin(r, skin.first, skin.second);
}
} // namespace gltf
