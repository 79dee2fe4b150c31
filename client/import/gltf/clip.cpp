// SPDX-License-Identifier: MIT
// Animations: each becomes a clip, with a channel for each property of a node. A channel is checked before it is
// added: an unplayable one is left out, with a note, and the rest is played.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace gltf
{
namespace
{
constexpr size_t keys_max = 1u << 24;
constexpr float value_max = 1e12f;

// The ascending times of one accessor, and their keys in the file.
struct key_times {
    std::vector<float> times;
    std::vector<uint32_t> kept;
    uint32_t first = UINT32_MAX; // offset in the clip's floats, once they are added
};

struct builder {
    reader &r;
    std::string where;
    const tinygltf::Animation &source;
    uint32_t clip = 0; // 0: nothing to play so far
    uint32_t played = 0;
    double end_s = 0;
    std::vector<float> floats = {};
    std::map<int, key_times> inputs = {}; // by accessor
    // Offsets of values by input, output, width and conversion; UINT32_MAX marks invalid values, so that they are
    // checked only once.
    std::map<std::tuple<int, int, uint32_t, std::array<float, 5>>, uint32_t> values = {};
    std::set<std::pair<protocol_channel_path, uint32_t>> changed = {}; // paths of each object that have a channel
    std::map<int, unsigned> nodes = {}; // nodes whose transform changes: bits of enum protocol_channel_path
};

bool find_interpolation(const std::string &name, protocol_interpolation &found)
{
    if (name == "STEP")
        found = PROTOCOL_INTERPOLATION_STEP;
    else if (name.empty() || name == "LINEAR")
        found = PROTOCOL_INTERPOLATION_LINEAR;
    else if (name == "CUBICSPLINE")
        found = PROTOCOL_INTERPOLATION_CUBIC_SPLINE;
    else
        return false;
    return true;
}

// ---- keys

// Makes times ascend: the last of equal times is moved by as little as possible, so that a jump stays one; times
// between it and the first, and times that decrease, are removed.
key_times read_times(builder &b, int accessor, const std::string &where)
{
    key_times result;
    std::vector<float> times(accessor_count(b.r, accessor, TINYGLTF_TYPE_SCALAR, where));
    bool mended = false;

    read_floats(b.r, accessor, 1, 0, times.data(), where);
    for (size_t i = 0; i < times.size(); i++) {
        const bool first = result.times.empty();
        float time = times[i];
        if (!first && time == times[result.kept.back()]) {
            mended = true;
            if (time != result.times.back()) { // was moved before
                result.kept.back() = uint32_t(i);
                continue;
            }
            time = std::nextafter(time, value_max);
        }
        const bool kept = std::fabs(time) <= 1e9f && (first || time > result.times.back());
        mended = mended || !kept || time != times[i];
        if (!kept)
            continue;
        result.times.push_back(time);
        result.kept.push_back(uint32_t(i));
    }
    if (mended)
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "the times of keys do not ascend; equal ones were moved apart and earlier ones left out");
    return result;
}

const key_times *times_of(builder &b, int accessor, const std::string &where)
{
    const auto known = b.inputs.find(accessor);
    if (known != b.inputs.end())
        return &known->second;
    const size_t count = accessor_count(b.r, accessor, TINYGLTF_TYPE_SCALAR, where);
    if (count > keys_max) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(), "a channel of %zu keys is left out",
                    count);
        return nullptr;
    }
    return &(b.inputs[accessor] = read_times(b, accessor, where));
}

bool all_usable(const std::vector<float> &values)
{
    return std::all_of(values.begin(), values.end(), [](float value) { return std::fabs(value) <= value_max; });
}

// Invalid rotations become the identity.
void mend_rotations(std::vector<float> &values, size_t parts)
{
    for (size_t at = parts == 3 ? 4 : 0; at < values.size(); at += 4 * parts) {
        float *q = &values[at];
        if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0)
            q[3] = 1;
    }
}

uint32_t append(builder &b, const std::vector<float> &values)
{
    check_room(b.r, b.where, b.floats.size() + values.size(), sizeof(float));
    if (values.size() > UINT32_MAX - b.floats.size())
        fail(b.r, b.where, "the clip has too many numbers");
    const uint32_t first = uint32_t(b.floats.size());
    b.floats.insert(b.floats.end(), values.begin(), values.end());
    return first;
}

// Reads the values of the kept keys; `parts` is 3 for keys with tangents. False: the file has another number of
// values.
bool read_values(builder &b, int accessor, const channel_target &to, const key_times &keys, size_t key_count,
                 size_t parts, std::vector<float> &out, const std::string &where)
{
    const size_t components = to.type == TINYGLTF_TYPE_SCALAR ? 1 : to.width;
    const size_t count = accessor_count(b.r, accessor, to.type, where);
    const size_t wanted = key_count * parts * (to.type == TINYGLTF_TYPE_SCALAR ? to.file_width : 1);

    if (count != wanted) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "a channel with %zu values, where its keys ask for %zu, is left out", count, wanted);
        return false;
    }
    check_room(b.r, where, count * components, 2 * sizeof(float));
    std::vector<float> all(count * components);
    read_floats(b.r, accessor, int(components), 0, all.data(), where);
    out.reserve(keys.kept.size() * parts * to.width);
    for (uint32_t key : keys.kept)
        for (size_t part = 0; part < parts; part++) {
            const float *from = all.data() + (key * parts + part) * to.file_width;
            const float offset = parts == 1 || part == 1 ? to.offset : 0; // tangents have no offset
            for (size_t i = 0; i < to.width; i++)
                out.push_back(from[to.file_width < to.width ? 0 : i] * to.scale[std::min<size_t>(i, 3)] + offset);
        }
    if (all_usable(out))
        return true;
    import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                "a channel with values that are not finite or beyond 1e12 is left out");
    return false;
}

// ---- channels

void send_channel(builder &b, protocol_channel_path path, uint32_t object, uint32_t width,
                  protocol_interpolation interpolation, uint32_t key_count, uint32_t first_time,
                  uint32_t first_value)
{
    message_set_channel set = {};

    if (b.clip == 0)
        b.clip = import_reserve_id(b.r.scene, PROTOCOL_OBJECT_CLIP);
    set.value.clip = b.clip;
    set.value.path = path;
    set.value.object = object;
    set.value.interpolation = interpolation;
    set.value.width = width;
    set.value.key_count = key_count;
    set.value.first_time = first_time;
    set.value.first_value = first_value;
    if (import_add_channel(b.r.scene, &set) == 0)
        throw reading::failed();
}

void play(builder &b, const tinygltf::AnimationSampler &sampler, const channel_target &to,
          protocol_interpolation interpolation, const std::string &where)
{
    const size_t parts = interpolation == PROTOCOL_INTERPOLATION_CUBIC_SPLINE ? 3 : 1;
    const key_times *keys = times_of(b, sampler.input, where + ".input");

    if (!keys || keys->times.empty())
        return;
    const auto place_of_values =
        std::make_tuple(sampler.input, sampler.output, uint32_t(to.width * 4 + parts),
                        std::array<float, 5>{to.scale[0], to.scale[1], to.scale[2], to.scale[3], to.offset});
    auto known = b.values.find(place_of_values);
    if (known == b.values.end()) {
        std::vector<float> values;
        const size_t key_count = accessor_count(b.r, sampler.input, TINYGLTF_TYPE_SCALAR, where);
        const bool good = read_values(b, sampler.output, to, *keys, key_count, parts, values, where + ".output");
        if (good && to.path == PROTOCOL_CHANNEL_NODE_ROTATION)
            mend_rotations(values, parts);
        known = b.values.emplace(place_of_values, good ? append(b, values) : UINT32_MAX).first;
    }
    if (known->second == UINT32_MAX)
        return;
    uint32_t &first_time = b.inputs[sampler.input].first;
    if (first_time == UINT32_MAX)
        first_time = append(b, keys->times);
    for (uint32_t object : to.objects)
        if (b.changed.emplace(to.path, object).second)
            send_channel(b, to.path, object, to.width, interpolation, uint32_t(keys->times.size()), first_time,
                         known->second);
    b.end_s = std::max(b.end_s, double(keys->times.back()));
    b.played++;
}

void add_channel(builder &b, size_t index)
{
    const tinygltf::AnimationChannel &channel = b.source.channels[index];
    channel_target to = {};
    protocol_interpolation interpolation;

    if (!find_target(b.r, channel, b.where, to))
        return;
    if (channel.sampler < 0 || size_t(channel.sampler) >= b.source.samplers.size()) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "a channel names a sampler that does not exist and is left out");
        return;
    }
    const tinygltf::AnimationSampler &sampler = b.source.samplers[size_t(channel.sampler)];
    const std::string where = b.where + "." + place("samplers", size_t(channel.sampler));
    if (!find_interpolation(sampler.interpolation, interpolation)) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "a channel of the unknown interpolation '%.40s' is left out", sampler.interpolation.c_str());
        return;
    }
    if (b.changed.count({to.path, to.objects[0]}) > 0) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "a second channel of the same property of %s is left out",
                    to.node >= 0 ? "a node" : "an object");
        return;
    }
    const uint32_t before = b.played;
    play(b, sampler, to, interpolation, where);
    if (b.played > before && to.node >= 0)
        b.nodes[to.node] |= 1u << to.path;
}

// Adds the parts of a node's transform that a clip does not change, so that no matrix has to be decomposed.
void add_constants(builder &b, int node, unsigned seen)
{
    const unsigned moved = 1u << PROTOCOL_CHANNEL_NODE_TRANSLATION | 1u << PROTOCOL_CHANNEL_NODE_ROTATION |
                           1u << PROTOCOL_CHANNEL_NODE_SCALE;
    if ((seen & moved) == 0 || (seen & moved) == moved)
        return;
    const parts p = node_parts(b.r, size_t(node));
    const std::pair<protocol_channel_path, std::vector<float>> constants[] = {
        {PROTOCOL_CHANNEL_NODE_TRANSLATION, {p.translation, p.translation + 3}},
        {PROTOCOL_CHANNEL_NODE_ROTATION, {p.rotation, p.rotation + 4}},
        {PROTOCOL_CHANNEL_NODE_SCALE, {p.scale, p.scale + 3}}};
    for (const auto &constant : constants) {
        if (seen & 1u << constant.first)
            continue;
        const uint32_t first_time = append(b, {0.0f}), first_value = append(b, constant.second);
        const uint32_t width = uint32_t(constant.second.size());
        send_channel(b, constant.first, b.r.node_ids[size_t(node)], width, PROTOCOL_INTERPOLATION_STEP, 1,
                     first_time, first_value);
    }
}

void add_clip(reader &r, size_t index)
{
    const tinygltf::Animation &source = r.model.animations[index];
    builder b = {r, place("animations", index), source};

    for (size_t i = 0; i < source.channels.size(); i++)
        add_channel(b, i);
    for (const auto &node : b.nodes)
        add_constants(b, node.first, node.second);
    if (b.clip != 0) {
        if (!import_add_clip(r.scene, b.clip, source.name.c_str(), reading::copy_of(b.floats),
                             uint32_t(b.floats.size())))
            throw reading::failed();
    } else {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "an animation has nothing that can be played");
    }
    import_list_clip(r.scene, b.clip, source.name.c_str(), b.played, b.end_s);
}
} // namespace

void add_clips(reader &r)
{
    for (size_t i = 0; i < r.model.animations.size(); i++)
        add_clip(r, i);
}
} // namespace gltf
