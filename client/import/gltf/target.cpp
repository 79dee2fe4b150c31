// SPDX-License-Identifier: MIT
// Targets of animation channels: a property of a node, or with KHR_animation_pointer a property at a path through
// the file's JSON.
#include "reader.hpp"

#include <algorithm>

namespace gltf
{
namespace
{
bool find_weights(reader &r, size_t node, channel_target &found)
{
    const auto holders = r.mesh_nodes.find(node);

    if (holders == r.mesh_nodes.end())
        return false;
    const shown_mesh &mesh = mesh_of(r, r.model.nodes[node].mesh);
    found.path = PROTOCOL_CHANNEL_NODE_WEIGHTS;
    found.objects = holders->second;
    found.width = mesh.target_count;
    found.file_width = mesh.file_targets;
    found.type = TINYGLTF_TYPE_SCALAR;
    return found.width > 0;
}

bool find_transform(reader &r, size_t node, const std::string &name, channel_target &found)
{
    static const struct {
        const char *name;
        protocol_channel_path path;
        uint32_t width;
        int type;
    } rows[] = {{"translation", PROTOCOL_CHANNEL_NODE_TRANSLATION, 3, TINYGLTF_TYPE_VEC3},
                {"rotation", PROTOCOL_CHANNEL_NODE_ROTATION, 4, TINYGLTF_TYPE_VEC4},
                {"scale", PROTOCOL_CHANNEL_NODE_SCALE, 3, TINYGLTF_TYPE_VEC3}};

    for (const auto &row : rows)
        if (name == row.name) {
            found.path = row.path;
            found.objects = {r.node_ids[node]};
            found.width = row.width;
            found.file_width = row.width;
            found.type = row.type;
            found.node = int(node);
            return true;
        }
    return false;
}

// ---- KHR_animation_pointer

enum class result { FOUND, NOT_SHOWN, UNKNOWN };

result find_node_property(reader &r, size_t node, const std::string &name, channel_target &found)
{
    if (node >= r.node_ids.size() || r.node_ids[node] == 0)
        return result::NOT_SHOWN;
    if (name == "weights")
        return find_weights(r, node, found) ? result::FOUND : result::NOT_SHOWN;
    if (find_transform(r, node, name, found))
        return result::FOUND;
    if (name != "extensions/KHR_node_visibility/visible")
        return result::UNKNOWN;
    found.path = PROTOCOL_CHANNEL_NODE_HIDDEN; // the inverse of visibility
    found.objects = {r.node_ids[node]};
    found.width = 1;
    found.file_width = 1;
    found.type = TINYGLTF_TYPE_SCALAR;
    found.scale[0] = -1;
    found.offset = 1;
    return result::FOUND;
}

result find_material_property(reader &r, size_t index, const std::string &name, channel_target &found)
{
    static const struct {
        const char *name;
        protocol_channel_path path;
        uint32_t width, file_width;
        int type;
    } rows[] = {
        {"pbrMetallicRoughness/baseColorFactor", PROTOCOL_CHANNEL_MATERIAL_BASE_COLOUR, 4, 4, TINYGLTF_TYPE_VEC4},
        {"pbrMetallicRoughness/metallicFactor", PROTOCOL_CHANNEL_MATERIAL_METALLIC, 1, 1, TINYGLTF_TYPE_SCALAR},
        {"pbrMetallicRoughness/roughnessFactor", PROTOCOL_CHANNEL_MATERIAL_ROUGHNESS, 1, 1, TINYGLTF_TYPE_SCALAR},
        {"emissiveFactor", PROTOCOL_CHANNEL_MATERIAL_EMISSION, 3, 3, TINYGLTF_TYPE_VEC3},
        {"extensions/KHR_materials_emissive_strength/emissiveStrength", PROTOCOL_CHANNEL_MATERIAL_EMISSION, 3, 1,
         TINYGLTF_TYPE_SCALAR},
        {"extensions/KHR_materials_transmission/transmissionFactor", PROTOCOL_CHANNEL_MATERIAL_TRANSMISSION, 1, 1,
         TINYGLTF_TYPE_SCALAR},
        {"extensions/KHR_materials_ior/ior", PROTOCOL_CHANNEL_MATERIAL_IOR, 1, 1, TINYGLTF_TYPE_SCALAR},
    };

    if (index >= r.material_ids.size() || r.material_ids[index] == 0)
        return result::NOT_SHOWN;
    for (const auto &row : rows) {
        if (name != row.name)
            continue;
        found.path = row.path;
        found.objects = {r.material_ids[index]};
        found.width = row.width;
        found.file_width = row.file_width;
        found.type = row.type;
        if (row.path == PROTOCOL_CHANNEL_MATERIAL_EMISSION) {
            // Our emission is the product of factor and strength, one of which is animated.
            const tinygltf::Material &material = r.model.materials[index];
            const tinygltf::Value *strong = extension(material.extensions, "KHR_materials_emissive_strength");
            for (size_t c = 0; c < 3; c++) {
                const double other = row.file_width == 3 ? (strong ? number(*strong, "emissiveStrength", 1) : 1)
                                     : c < material.emissiveFactor.size() ? material.emissiveFactor[c]
                                                                          : 0;
                found.scale[c] = limited(r, place("materials", index), "the emission", other, 0, 1e6);
            }
        }
        return result::FOUND;
    }
    return result::UNKNOWN;
}

// Our light has one colour, the product of the file's colour and intensity, one of which is animated.
result find_light_property(reader &r, size_t index, const std::string &name, channel_target &found)
{
    const bool colour = name == "color";

    if (!colour && name != "intensity")
        return result::UNKNOWN;
    const auto ids = r.light_ids.find(int(std::min<size_t>(index, INT32_MAX)));
    if (ids == r.light_ids.end())
        return result::NOT_SHOWN;
    const tinygltf::Light &light = r.model.lights[index];
    found.path = PROTOCOL_CHANNEL_LIGHT_COLOUR;
    found.objects = ids->second;
    found.width = 3;
    found.file_width = colour ? 3 : 1;
    found.type = colour ? TINYGLTF_TYPE_VEC3 : TINYGLTF_TYPE_SCALAR;
    for (size_t c = 0; c < 3; c++)
        found.scale[c] = limited(r, place("KHR_lights_punctual.lights", index), "the light's colour",
                                 (colour                    ? light.intensity
                                  : light.color.size() == 3 ? light.color[c]
                                                            : 1.0) /
                                     light_disc(light),
                                 0, 1e12);
    return result::FOUND;
}

// Splits "/nodes/3/translation" after "/nodes/" into 3 and the name of the property. False: there is no index.
bool split(const std::string &path, const std::string &begin, size_t &index, std::string &name)
{
    if (path.compare(0, begin.size(), begin) != 0)
        return false;
    const size_t slash = path.find('/', begin.size());
    const std::string digits = path.substr(begin.size(), slash - begin.size());
    if (slash == std::string::npos || digits.empty() || digits.size() > 9 ||
        digits.find_first_not_of("0123456789") != std::string::npos)
        return false;
    index = size_t(std::stoul(digits));
    name = path.substr(slash + 1);
    return true;
}

bool find_pointer(reader &r, const tinygltf::AnimationChannel &channel, const std::string &where,
                  channel_target &found)
{
    const tinygltf::Value *value = extension(channel.target_extensions, "KHR_animation_pointer");
    const std::string path = value ? text_of(*value, "pointer") : "";
    result known = result::UNKNOWN;
    size_t index = 0;
    std::string name;

    if (split(path, "/nodes/", index, name))
        known = find_node_property(r, index, name, found);
    else if (split(path, "/materials/", index, name))
        known = find_material_property(r, index, name, found);
    else if (split(path, "/extensions/KHR_lights_punctual/lights/", index, name))
        known = find_light_property(r, index, name, found);
    if (known == result::UNKNOWN)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "'%.200s', a property that cannot be animated here, stays as it is", path.c_str());
    return known == result::FOUND;
}
} // namespace

bool find_target(reader &r, const tinygltf::AnimationChannel &channel, const std::string &where,
                 channel_target &found)
{
    if (channel.target_path == "pointer")
        return find_pointer(r, channel, where, found);
    if (channel.target_node < 0 || size_t(channel.target_node) >= r.model.nodes.size())
        return false; // glTF 2.0, 3.11: ignored
    const size_t node = size_t(channel.target_node);
    if (channel.target_path == "weights")
        return find_weights(r, node, found);
    if (r.node_ids[node] == 0)
        return false; // the node is not shown
    if (find_transform(r, node, channel.target_path, found))
        return true;
    import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(), "a channel of the unknown path '%.40s'",
                channel.target_path.c_str());
    return false;
}
} // namespace gltf
