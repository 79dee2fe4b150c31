// SPDX-License-Identifier: MIT
// The supported extensions, and the treatment of files with others.
#include "reader.hpp"
#include "import/image/texture.h"

#include <algorithm>
#include <cstring>

namespace gltf
{
namespace
{
const char *const understood[] = {
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_gaussian_splatting",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_emissive_strength",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_transform",
};
// Extensions without visible contents.
const char *const invisible[] = {"KHR_xmp", "KHR_xmp_json_ld", "EXT_mesh_manifold"};

// Advice about a required unsupported extension, where more than leaving it out is possible.
struct remedy {
    const char *extension, *text;
};
const remedy remedies[] = {
    {"KHR_texture_basisu", TEXTURE_KTX2_REMEDY},
};

template <size_t count> bool is_one_of(const std::string &name, const char *const (&names)[count])
{
    return std::any_of(names, names + count, [&](const char *known) { return name == known; });
}

bool is_known(const std::string &name)
{
    return is_one_of(name, understood) || is_one_of(name, invisible);
}
} // namespace

void check_required_extensions(reader &r)
{
    for (const std::string &name : r.model.extensionsRequired) {
        if (is_known(name))
            continue;
        const char *text = "export the model without it, or as one that is not required";
        for (const remedy &known : remedies)
            if (name == known.extension)
                text = known.text;
        fail(r, "extensionsRequired",
             "the file cannot be shown without the extension '%.80s', which is not supported; %s", name.c_str(),
             text);
    }
}

void note_unknown_extensions(reader &r)
{
    std::set<std::string> names;
    std::string list;

    for (const std::string &name : r.model.extensionsUsed)
        if (!is_known(name) && name != "KHR_texture_basisu") // textures with it have notes of their own
            names.insert(name.substr(0, 80));
    for (const std::string &name : names)
        list += (list.empty() ? "" : ", ") + name;
    if (!names.empty())
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "extensionsUsed",
                    "these extensions are not supported: %.400s", list.c_str());
}

const tinygltf::Value *extension(const tinygltf::ExtensionMap &extensions, const char *name)
{
    const auto found = extensions.find(name);
    return found != extensions.end() && found->second.IsObject() ? &found->second : nullptr;
}

double number(const tinygltf::Value &object, const char *key, double otherwise)
{
    if (!object.IsObject() || !object.Has(key))
        return otherwise;
    const tinygltf::Value &value = object.Get(key);
    return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

size_t whole_number(const tinygltf::Value &object, const char *key, size_t otherwise)
{
    const double value = number(object, key, double(otherwise));
    return value >= 0 && value < 9e15 ? size_t(value) : SIZE_MAX;
}

int index_of(const tinygltf::Value &object, const char *key)
{
    const double value = number(object, key, -1);
    return value >= 0 && value < 2147483648.0 ? int(value) : -1;
}

std::string text_of(const tinygltf::Value &object, const char *key)
{
    return object.IsObject() && object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>()
                                                                              : std::string();
}

std::vector<double> numbers(const tinygltf::Value &object, const char *key)
{
    std::vector<double> result;

    if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsArray())
        return result;
    const tinygltf::Value &array = object.Get(key);
    for (size_t i = 0; i < array.ArrayLen() && i < 16; i++)
        if (array.Get(int(i)).IsNumber())
            result.push_back(array.Get(int(i)).GetNumberAsDouble());
    return result;
}
} // namespace gltf
