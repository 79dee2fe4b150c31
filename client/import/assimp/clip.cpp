// SPDX-License-Identifier: MIT
// Animations: each becomes a clip. The library has linear keys only, with times in ticks.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <set>

namespace assimp
{
namespace
{
constexpr unsigned keys_max = 1u << 24;
constexpr float value_max = 1e12f;

struct builder {
    reader &r;
    std::string where;
    double ticks_per_s;
    uint32_t clip = 0; // 0: nothing to play so far
    uint32_t played = 0;
    double end_s = 0;
    std::vector<float> floats = {};
    std::set<uint32_t> moved = {}, morphed = {}; // nodes that have their channels
};

// A channel under construction: keys whose times ascend.
struct keys {
    std::vector<float> times = {}, values = {};

    void add(double time_s, std::initializer_list<float> value)
    {
        const float time = float(time_s);
        if (!(std::fabs(time) <= 1e9f) || (!times.empty() && !(time > times.back())) ||
            !std::all_of(value.begin(), value.end(), [](float one) { return std::fabs(one) <= value_max; }))
            return;
        times.push_back(time);
        values.insert(values.end(), value);
    }
};

void send(builder &b, protocol_channel_path path, uint32_t node, uint32_t width, const keys &of)
{
    message_set_channel set = {};

    if (of.times.empty() || width == 0)
        return;
    check_room(b.r, b.where, b.floats.size() + of.times.size() + of.values.size(), sizeof(float));
    if (of.times.size() + of.values.size() > UINT32_MAX - b.floats.size())
        fail(b.r, b.where, "the clip has too many numbers");
    if (b.clip == 0)
        b.clip = import_reserve_id(b.r.scene, PROTOCOL_OBJECT_CLIP);
    set.value.clip = b.clip;
    set.value.path = path;
    set.value.object = node;
    set.value.interpolation = PROTOCOL_INTERPOLATION_LINEAR;
    set.value.width = width;
    set.value.key_count = uint32_t(of.times.size());
    set.value.first_time = uint32_t(b.floats.size());
    b.floats.insert(b.floats.end(), of.times.begin(), of.times.end());
    set.value.first_value = uint32_t(b.floats.size());
    b.floats.insert(b.floats.end(), of.values.begin(), of.values.end());
    import_add_channel(b.r.scene, &set);
    check(b.r);
    b.played++;
    b.end_s = std::max(b.end_s, double(of.times.back()));
}

keys read_vectors(const builder &b, const aiVectorKey *from, unsigned count)
{
    keys of;
    for (unsigned i = 0; from && i < std::min(count, keys_max); i++)
        of.add(from[i].mTime / b.ticks_per_s, {from[i].mValue.x, from[i].mValue.y, from[i].mValue.z});
    return of;
}

keys read_rotations(const builder &b, const aiQuatKey *from, unsigned count)
{
    keys of;
    for (unsigned i = 0; from && i < std::min(count, keys_max); i++) {
        const aiQuaternion &q = from[i].mValue;
        const bool none = q.x == 0 && q.y == 0 && q.z == 0 && q.w == 0;
        of.add(from[i].mTime / b.ticks_per_s, {q.x, q.y, q.z, none ? 1 : q.w});
    }
    return of;
}

void add_node_channels(builder &b, const aiNodeAnim &from)
{
    const auto node = b.r.nodes.find(text(from.mNodeName));

    if (node == b.r.nodes.end()) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "a channel names a node that does not exist and is left out");
        return;
    }
    const uint32_t id = node->second.first;
    keys translation = read_vectors(b, from.mPositionKeys, from.mNumPositionKeys);
    keys rotation = read_rotations(b, from.mRotationKeys, from.mNumRotationKeys);
    keys scale = read_vectors(b, from.mScalingKeys, from.mNumScalingKeys);
    if ((translation.times.empty() && rotation.times.empty() && scale.times.empty()) || !b.moved.insert(id).second)
        return;
    // Adds the unchanged parts, too, so that no matrix has to be decomposed.
    aiVector3D scaled, moved;
    aiQuaternion turned;
    node->second.second->mTransformation.Decompose(scaled, turned, moved);
    if (translation.times.empty())
        translation.add(0, {moved.x, moved.y, moved.z});
    if (rotation.times.empty())
        rotation.add(0, {turned.x, turned.y, turned.z, turned.w});
    if (scale.times.empty())
        scale.add(0, {scaled.x, scaled.y, scaled.z});
    send(b, PROTOCOL_CHANNEL_NODE_TRANSLATION, id, 3, translation);
    send(b, PROTOCOL_CHANNEL_NODE_ROTATION, id, 4, rotation);
    send(b, PROTOCOL_CHANNEL_NODE_SCALE, id, 3, scale);
}

// A key holds the weights of some targets, by number; the weights of others are 0.
void add_morph_channel(builder &b, const aiMeshMorphAnim &from)
{
    std::string name = text(from.mName);
    const auto whole = b.r.morphs.find(name);
    // FBX files append the mesh's number to the node's name
    const auto found = whole != b.r.morphs.end() ? whole : b.r.morphs.find(name.substr(0, name.rfind('*')));
    keys of;

    if (found == b.r.morphs.end() || !from.mKeys) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "a channel of morph targets names no mesh that has some and is left out");
        return;
    }
    const uint32_t width = found->second.second;
    for (unsigned i = 0; i < std::min(from.mNumKeys, keys_max); i++) {
        const aiMeshMorphKey &key = from.mKeys[i];
        const size_t before = of.times.size();
        of.add(key.mTime / b.ticks_per_s, {});
        if (of.times.size() == before)
            continue;
        check_room(b.r, b.where, of.values.size() + width, sizeof(float));
        of.values.resize(of.values.size() + width, 0);
        for (unsigned j = 0; key.mValues && key.mWeights && j < key.mNumValuesAndWeights; j++)
            if (key.mValues[j] < width && std::fabs(key.mWeights[j]) <= 1e6)
                of.values[of.values.size() - width + key.mValues[j]] = float(key.mWeights[j]);
    }
    if (b.morphed.insert(found->second.first).second)
        send(b, PROTOCOL_CHANNEL_NODE_WEIGHTS, found->second.first, width, of);
}

void add_clip(reader &r, unsigned index)
{
    const aiAnimation &from = *r.source->mAnimations[index];
    const std::string name = text(from.mName);
    // Files without a rate mean 25 frames a second.
    builder b = {r, "animations[" + std::to_string(index) + "]",
                 from.mTicksPerSecond > 0 && from.mTicksPerSecond <= 1e12 ? from.mTicksPerSecond : 25};

    for (unsigned i = 0; from.mChannels && i < from.mNumChannels; i++)
        if (from.mChannels[i])
            add_node_channels(b, *from.mChannels[i]);
    for (unsigned i = 0; from.mMorphMeshChannels && i < from.mNumMorphMeshChannels; i++)
        if (from.mMorphMeshChannels[i])
            add_morph_channel(b, *from.mMorphMeshChannels[i]);
    if (from.mNumMeshChannels > 0)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(), "whole meshes in turn are not played");
    if (b.clip != 0) {
        import_add_clip(r.scene, b.clip, name.c_str(), reading::copy_of(b.floats), uint32_t(b.floats.size()));
        check(r);
    }
    import_list_clip(r.scene, b.clip, name.c_str(), b.played, b.end_s);
}
} // namespace

void add_clips(reader &r)
{
    for (unsigned i = 0; r.source->mAnimations && i < r.source->mNumAnimations; i++)
        if (r.source->mAnimations[i])
            add_clip(r, i);
}
} // namespace assimp
