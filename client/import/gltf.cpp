// SPDX-License-Identifier: MIT
#include "gltf.hpp"

#include <algorithm>
#include <cmath>
#include <new>

namespace gltf
{
namespace
{
const char *const understood[] = {
    "KHR_lights_punctual",
    "KHR_materials_transmission",
    "KHR_materials_ior",
    "KHR_materials_unlit",
    "KHR_materials_emissive_strength",
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_materials_pbrSpecularGlossiness",
    "EXT_texture_webp",
    "KHR_materials_anisotropy",
    "KHR_materials_specular",
    "KHR_materials_volume",
};
// These hold nothing that could be seen.
const char *const invisible[] = {"KHR_xmp", "KHR_xmp_json_ld", "KHR_animation_pointer", "EXT_mesh_manifold"};

template <size_t count> bool is_one_of(const std::string &name, const char *const (&names)[count])
{
    return std::any_of(names, names + count, [&](const char *known) { return name == known; });
}

void check_extensions(reader &r)
{
    for (const std::string &name : r.model.extensionsRequired)
        if (!is_one_of(name, understood) && !is_one_of(name, invisible))
            fail(r, "extensionsRequired",
                 "the file cannot be shown without the extension '%.80s', which is unknown", name.c_str());
    for (const std::string &name : r.model.extensionsUsed)
        if (!is_one_of(name, understood) && !is_one_of(name, invisible))
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "extensionsUsed",
                        "what the extension '%.80s' describes is not shown", name.c_str());
}

void import(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    load(r, bytes, size_bytes);
    check_extensions(r);
    check_hierarchy(r);
    r.material_ids.assign(r.model.materials.size(), 0);
    add_scene(r);
    add_clips(r);
}
} // namespace

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

float limited(reader &r, const std::string &where, const char *what, double value, double minimum, double maximum)
{
    if (value >= minimum && value <= maximum)
        return float(value);
    const double cut = value > maximum ? maximum : minimum; // NaN becomes the minimum
    import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(), "%s is %g; it was set to %g", what, value, cut);
    return float(cut);
}
} // namespace gltf

extern "C" bool gltf_import(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                            size_t size_bytes)
{
    try {
        gltf::reader r = {};
        r.scene = scene;
        r.files = files;
        gltf::import(r, bytes, size_bytes);
    } catch (const gltf::failed &) {
        // said already
    } catch (const std::bad_alloc &) {
        import_fail(scene, nullptr, "out of memory");
    } catch (const std::exception &exception) {
        import_fail(scene, nullptr, "the file cannot be parsed: %s", exception.what());
    } catch (...) {
        import_fail(scene, nullptr, "the file cannot be parsed");
    }
    return !scene->failed;
}
