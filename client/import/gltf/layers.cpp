// SPDX-License-Identifier: MIT
// Extensions of materials that add a layer, or change the mirror or the interior.
#include "material.hpp"

namespace gltf
{
namespace
{
// An extension of a material.
struct part {
    const building &b;
    const tinygltf::Value &object;

    // Reads a number into `value`, which holds the default.
    void factor(const char *key, float &value, double minimum, double maximum) const
    {
        value = limited(b.r, b.where, key, number(object, key, double(value)), minimum, maximum);
    }

    void colour(const char *key, float (&channels)[3], double maximum) const
    {
        const std::vector<double> given = numbers(object, key);
        for (size_t c = 0; c < 3 && c < given.size(); c++)
            channels[c] = limited(b.r, b.where, key, given[c], 0, maximum);
    }

    void texture(const char *key, bool is_colour, protocol_material_texture at) const
    {
        use_texture(b.r, b.all, source_of(object, key), is_colour, b.uses[at], b.where);
    }
};

void anisotropy(const part &p)
{
    p.factor("anisotropyStrength", p.b.set.value.anisotropy, 0, 1);
    p.factor("anisotropyRotation", p.b.set.value.anisotropy_rotation, -1000, 1000);
    p.texture("anisotropyTexture", false, PROTOCOL_MATERIAL_ANISOTROPY);
}

void clearcoat(const part &p)
{
    p.factor("clearcoatFactor", p.b.set.value.clearcoat, 0, 1);
    p.factor("clearcoatRoughnessFactor", p.b.set.value.clearcoat_roughness, 0, 1);
    p.texture("clearcoatTexture", false, PROTOCOL_MATERIAL_CLEARCOAT);
    p.texture("clearcoatRoughnessTexture", false, PROTOCOL_MATERIAL_CLEARCOAT_ROUGHNESS);
    texture_source normal = source_of(p.object, "clearcoatNormalTexture");
    normal.strength = normal.value ? number(*normal.value, "scale", 1) : 1;
    use_texture(p.b.r, p.b.all, normal, false, p.b.uses[PROTOCOL_MATERIAL_CLEARCOAT_NORMAL], p.b.where);
}

void diffuse_transmission(const part &p)
{
    message_set_material &set = p.b.set;
    p.factor("diffuseTransmissionFactor", set.value.diffuse_transmission, 0, 1);
    p.colour("diffuseTransmissionColorFactor", set.value.diffuse_transmission_colour, 1);
    p.texture("diffuseTransmissionTexture", false, PROTOCOL_MATERIAL_DIFFUSE_TRANSMISSION);
    p.texture("diffuseTransmissionColorTexture", true, PROTOCOL_MATERIAL_DIFFUSE_TRANSMISSION_COLOUR);
}

void dispersion(const part &p)
{
    p.factor("dispersion", p.b.set.value.dispersion, 0, 100);
}

void iridescence(const part &p)
{
    message_set_material &set = p.b.set;
    p.factor("iridescenceFactor", set.value.iridescence, 0, 1);
    p.factor("iridescenceIor", set.value.iridescence_ior, 1, 10);
    p.factor("iridescenceThicknessMinimum", set.value.iridescence_minimum_nm, 0, 1e6);
    p.factor("iridescenceThicknessMaximum", set.value.iridescence_maximum_nm, 0, 1e6);
    p.texture("iridescenceTexture", false, PROTOCOL_MATERIAL_IRIDESCENCE);
    p.texture("iridescenceThicknessTexture", false, PROTOCOL_MATERIAL_IRIDESCENCE_THICKNESS);
}

void sheen(const part &p)
{
    p.colour("sheenColorFactor", p.b.set.value.sheen, 1);
    p.factor("sheenRoughnessFactor", p.b.set.value.sheen_roughness, 0, 1);
    p.texture("sheenColorTexture", true, PROTOCOL_MATERIAL_SHEEN);
    p.texture("sheenRoughnessTexture", false, PROTOCOL_MATERIAL_SHEEN_ROUGHNESS);
}

void specular(const part &p)
{
    message_set_material &set = p.b.set;
    p.factor("specularFactor", set.value.specular, 0, 1);
    p.colour("specularColorFactor", set.value.specular_colour, 1000);
    p.texture("specularTexture", false, PROTOCOL_MATERIAL_SPECULAR);
    p.texture("specularColorTexture", true, PROTOCOL_MATERIAL_SPECULAR_COLOUR);
}

void volume(const part &p)
{
    message_set_material &set = p.b.set;
    p.factor("attenuationDistance", set.value.attenuation_distance, 0, 1e12);
    p.colour("attenuationColor", set.value.attenuation_colour, 1);
    p.factor("thicknessFactor", set.value.thickness, 0, 1e12);
}

const struct {
    const char *name;
    void (*read)(const part &);
} known[] = {
    {"KHR_materials_anisotropy", anisotropy},
    {"KHR_materials_clearcoat", clearcoat},
    {"KHR_materials_diffuse_transmission", diffuse_transmission},
    {"KHR_materials_dispersion", dispersion},
    {"KHR_materials_iridescence", iridescence},
    {"KHR_materials_sheen", sheen},
    {"KHR_materials_specular", specular},
    {"KHR_materials_volume", volume},
};
} // namespace

void extensions(const building &b)
{
    for (const auto &one : known)
        if (const tinygltf::Value *object = extension(b.source.extensions, one.name))
            one.read({b, *object});
    // KHR_materials_volume: a thickness of 0, the default, means that there is no interior.
    b.set.value.thin_walled =
        (b.set.value.transmission > 0 || b.set.value.diffuse_transmission > 0) && b.set.value.thickness <= 0;
}
} // namespace gltf
