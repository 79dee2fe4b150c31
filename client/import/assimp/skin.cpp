// SPDX-License-Identifier: MIT
// Skins: the library has bones in each mesh, by the names of their nodes.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace assimp
{
namespace
{
struct influence {
    uint16_t joint;
    float weight;
};

std::vector<std::vector<influence>> influences_of(reader &r, const aiMesh &from, const std::string &where)
{
    std::vector<std::vector<influence>> all(from.mNumVertices);

    for (unsigned j = 0; j < from.mNumBones; j++) {
        const aiBone *bone = from.mBones[j];
        for (unsigned i = 0; bone && bone->mWeights && i < bone->mNumWeights; i++) {
            const aiVertexWeight &one = bone->mWeights[i];
            if (one.mVertexId >= from.mNumVertices)
                fail(r, where, "a bone moves vertex %u of %u", one.mVertexId, from.mNumVertices);
            if (one.mWeight > 0 && std::isfinite(one.mWeight))
                all[one.mVertexId].push_back({uint16_t(j), one.mWeight});
        }
    }
    return all;
}

// The heaviest ones, which the protocol has room for; one that stands still where there is none.
void limit(reader &r, std::vector<influence> &all, const std::string &where)
{
    if (all.size() > IMPORT_INFLUENCES_MAX) {
        std::stable_sort(all.begin(), all.end(),
                         [](const influence &a, const influence &b) { return a.weight > b.weight; });
        all.resize(IMPORT_INFLUENCES_MAX);
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "of the joints that move a vertex the %d with the largest weights were kept",
                    IMPORT_INFLUENCES_MAX);
    }
    if (all.empty()) {
        all.push_back({0, 1});
        import_note(r.scene, PROTOCOL_SEVERITY_INFO, where.c_str(),
                    "vertices without weights follow the first joint of the skin");
    }
}

void add_skin(reader &r, const aiMesh &from, uint32_t skin)
{
    const std::string name = text(from.mName);
    uint32_t *joints = static_cast<uint32_t *>(calloc(from.mNumBones, sizeof(uint32_t)));
    float *joint_from_mesh = static_cast<float *>(calloc(from.mNumBones, 12 * sizeof(float)));

    for (unsigned j = 0; joints && joint_from_mesh && j < from.mNumBones; j++) {
        const aiBone *bone = from.mBones[j];
        const auto node = bone ? r.nodes.find(text(bone->mName)) : r.nodes.end();
        joints[j] = node == r.nodes.end() ? r.root : node->second.first;
        if (node == r.nodes.end())
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(), "a bone has no node and stands still");
        const float *rows = bone ? bone->mOffsetMatrix[0] : nullptr; // 4 x 4, the last row being 0 0 0 1
        const bool usable =
            rows && std::all_of(rows, rows + 12, [](float value) { return std::fabs(value) <= 1e12f; });
        for (unsigned i = 0; i < 12; i++)
            joint_from_mesh[j * 12 + i] = usable ? rows[i] : i % 5 == 0 ? 1.0f : 0.0f;
    }
    if (!joints || !joint_from_mesh) {
        free(joints);
        free(joint_from_mesh);
        throw std::bad_alloc();
    }
    import_add_skin(r.scene, skin, name.c_str(), from.mNumBones, joints, joint_from_mesh);
    check(r);
}
} // namespace

bool has_skin(const aiMesh &from)
{
    return from.mNumBones > 0 && from.mBones;
}

uint32_t read_skin(reader &r, unsigned place, import_mesh &mesh, const std::string &where)
{
    const aiMesh &from = *r.source->mMeshes[place];
    size_t used = 0;

    if (from.mNumBones > IMPORT_JOINTS_MAX)
        fail(r, where, "%u bones; up to %d are allowed", from.mNumBones, IMPORT_JOINTS_MAX);
    std::vector<std::vector<influence>> all = influences_of(r, from, where);
    for (std::vector<influence> &of_vertex : all) {
        limit(r, of_vertex, where);
        used = std::max(used, of_vertex.size());
    }
    mesh.influence_count = uint32_t(used);
    mesh.joints = reading::allocate<uint16_t>(r, where, from.mNumVertices * used);
    mesh.joint_weights = reading::allocate<float>(r, where, from.mNumVertices * used);
    for (size_t v = 0; v < all.size(); v++)
        for (size_t i = 0; i < all[v].size(); i++) {
            mesh.joints[v * used + i] = all[v][i].joint;
            mesh.joint_weights[v * used + i] = all[v][i].weight;
        }
    return import_reserve_id(r.scene, PROTOCOL_OBJECT_SKIN);
}

void add_skins(reader &r)
{
    for (const auto &entry : r.meshes)
        if (entry.second.skin != 0)
            add_skin(r, *r.source->mMeshes[entry.first[0]], entry.second.skin);
}
} // namespace assimp
