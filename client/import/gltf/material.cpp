// SPDX-License-Identifier: MIT
// Materials. The same code visits each material twice: first to collect the required images, so that they can be
// decoded in parallel, then to add the material.
#include "material.hpp"

#include <algorithm>
#include <cstdlib>

namespace gltf
{
namespace
{
// ---- the parts of a material

void core(const building &b)
{
    const tinygltf::PbrMetallicRoughness &pbr = b.source.pbrMetallicRoughness;

    for (size_t c = 0; c < 4; c++)
        b.set.value.base_colour[c] = limited(b.r, b.where, "the base colour", pbr.baseColorFactor[c], 0, 1);
    b.set.value.metallic = limited(b.r, b.where, "metallicFactor", pbr.metallicFactor, 0, 1);
    b.set.value.roughness = limited(b.r, b.where, "roughnessFactor", pbr.roughnessFactor, 0, 1);
    if (!extension(b.source.extensions, "KHR_materials_pbrSpecularGlossiness")) { // which replaces these fields
        use_texture(b.r, b.all, source_of(pbr.baseColorTexture), true, b.uses[PROTOCOL_MATERIAL_BASE_COLOUR],
                    b.where);
        use_texture(b.r, b.all, source_of(pbr.metallicRoughnessTexture), false,
                    b.uses[PROTOCOL_MATERIAL_METALLIC_ROUGHNESS], b.where);
    }
    const tinygltf::NormalTextureInfo &normal = b.source.normalTexture;
    use_texture(b.r, b.all, {normal.index, normal.texCoord, normal.scale, &normal.extensions, nullptr}, false,
                b.uses[PROTOCOL_MATERIAL_NORMAL], b.where);
    const tinygltf::OcclusionTextureInfo &occlusion = b.source.occlusionTexture;
    use_texture(b.r, b.all,
                {occlusion.index, occlusion.texCoord, occlusion.strength, &occlusion.extensions, nullptr}, false,
                b.uses[PROTOCOL_MATERIAL_OCCLUSION], b.where);
}

void emission(const building &b)
{
    const tinygltf::Value *stronger = extension(b.source.extensions, "KHR_materials_emissive_strength");
    const double strength = stronger ? number(*stronger, "emissiveStrength", 1) : 1;

    for (size_t c = 0; c < 3 && c < b.source.emissiveFactor.size(); c++)
        b.set.value.emission[c] =
            limited(b.r, b.where, "the emission", b.source.emissiveFactor[c] * strength, 0, 1e6);
    use_texture(b.r, b.all, source_of(b.source.emissiveTexture), true, b.uses[PROTOCOL_MATERIAL_EMISSION],
                b.where);
}

void alpha(const building &b)
{
    const std::string &mode = b.source.alphaMode;

    if (mode == "MASK")
        b.set.value.alpha_mode = PROTOCOL_ALPHA_MASK;
    else if (mode == "BLEND")
        b.set.value.alpha_mode = PROTOCOL_ALPHA_BLEND;
    else if (mode != "OPAQUE")
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "unknown alpha mode '%.32s' is treated as OPAQUE", mode.c_str());
    // A cutoff above 1 is allowed and removes the whole surface; 1 keeps only fully opaque parts.
    b.set.value.alpha_cutoff = limited(b.r, b.where, "the alpha cutoff", b.source.alphaCutoff, 0, 1);
    b.set.value.double_sided = b.source.doubleSided;
}

void transmission(const building &b)
{
    if (const tinygltf::Value *ior = extension(b.source.extensions, "KHR_materials_ior")) {
        const double value = number(*ior, "ior", 1.5);
        b.set.value.ior = value == 0 ? 10.0f : limited(b.r, b.where, "the index of refraction", value, 1, 10);
    }
    if (const tinygltf::Value *glass = extension(b.source.extensions, "KHR_materials_transmission")) {
        b.set.value.transmission =
            limited(b.r, b.where, "transmissionFactor", number(*glass, "transmissionFactor", 0), 0, 1);
        use_texture(b.r, b.all, source_of(*glass, "transmissionTexture"), false,
                    b.uses[PROTOCOL_MATERIAL_TRANSMISSION], b.where);
    }
    b.set.value.unlit = extension(b.source.extensions, "KHR_materials_unlit") != nullptr;
}

// Marks a panel that only shows a light, which lights the scene itself; Blender stores this as a property of the
// material.
void emission_seen_only(const building &b)
{
    static const char key[] = "emission_seen_only";
    const tinygltf::Value &extras = b.source.extras;
    const bool is_true =
        extras.IsObject() && extras.Has(key) && extras.Get(key).IsBool() && extras.Get(key).Get<bool>();
    b.set.value.emission_seen_only = is_true || number(extras, key, 0) != 0;
}

// ---- the old model, converted

struct gloss_maps {
    texture_source sources[2]; // diffuse; specular and glossiness
    int images[2] = {-1, -1};
    record_texture_use uses[2] = {};
};

// Both maps are read as colours; their alpha is linear. Maps with different placements on the surface cannot be
// combined: only the first one counts then.
gloss_maps maps_of(const building &b, const tinygltf::Value &old)
{
    static const char *const names[2] = {"diffuseTexture", "specularGlossinessTexture"};
    gloss_maps maps;

    for (size_t i = 0; i < 2; i++) {
        maps.sources[i] = source_of(old, names[i]);
        if (maps.sources[i].index < 0)
            continue;
        maps.images[i] = image_of(b.r, maps.sources[i].index, b.where);
        if (maps.images[i] >= 0 && b.all.collecting)
            want_image(b.r, b.all, maps.images[i], true);
        else if (maps.images[i] >= 0)
            place_texture(b.r, maps.sources[i], 0, maps.uses[i], b.where);
    }
    const record_texture_use &first = maps.uses[0], &second = maps.uses[1];
    if (maps.images[0] < 0 || maps.images[1] < 0 ||
        (first.texcoord_set == second.texcoord_set &&
         std::equal(first.uv_transform, first.uv_transform + 6, second.uv_transform)))
        return maps;
    maps.images[1] = -1;
    import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                "the texture of specular and glossiness lies otherwise than the diffuse one and is not shown");
    return maps;
}

unsigned char *allocate_texels(const building &b, uint32_t width, uint32_t height)
{
    check_room(b.r, b.where, uint64_t(width) * height, 4);
    unsigned char *texels = static_cast<unsigned char *>(malloc(size_t(width) * height * 4));
    if (!texels)
        throw std::bad_alloc();
    return texels;
}

void use_converted(const building &b, const specular_gloss &factors, const gloss_maps &maps)
{
    const size_t main = maps.images[0] >= 0 ? 0 : 1;
    gloss_image from[2] = {};
    message_set_texture set = {};

    for (size_t i = 0; i < 2; i++)
        if (maps.images[i] >= 0) {
            const size_t number = b.all.numbers.at({maps.images[i], true});
            from[i] = texels_of(b.r, b.all, number);
            set.value.width = std::max(set.value.width, from[i].width);
            set.value.height = std::max(set.value.height, from[i].height);
            set.value.nearest = set.value.nearest || b.all.jobs[number].reason[0] != '\0';
        }
    metal_images to = {set.value.width, set.value.height, nullptr, nullptr, nullptr};
    uint32_t blobs[3];
    unsigned char **const places[3] = {&to.base, &to.rough, &to.mirror};
    for (size_t i = 0; i < 3; i++) {
        *places[i] = allocate_texels(b, set.value.width, set.value.height);
        blobs[i] = import_add_blob(b.r.scene, *places[i], uint64_t(set.value.width) * set.value.height * 4);
    }
    check(b.r);
    metal_texels(factors, from[0], from[1], to);
    const int texture = maps.sources[main].index;
    const std::string name = texture_name(b.r, texture, maps.images[main]);
    b.uses[PROTOCOL_MATERIAL_BASE_COLOUR] = b.uses[PROTOCOL_MATERIAL_METALLIC_ROUGHNESS] =
        b.uses[PROTOCOL_MATERIAL_SPECULAR_COLOUR] = maps.uses[main];
    b.uses[PROTOCOL_MATERIAL_BASE_COLOUR].texture = add_texture(b.r, texture, name, true, set, blobs[0]);
    b.uses[PROTOCOL_MATERIAL_METALLIC_ROUGHNESS].texture =
        add_texture(b.r, texture, name + " metallic roughness", false, set, blobs[1]);
    b.uses[PROTOCOL_MATERIAL_SPECULAR_COLOUR].texture =
        add_texture(b.r, texture, name + " mirror", true, set, blobs[2]);
}

void specular_glossiness(const building &b)
{
    const tinygltf::Value *old = extension(b.source.extensions, "KHR_materials_pbrSpecularGlossiness");
    if (!old)
        return;
    const std::vector<double> diffuse = numbers(*old, "diffuseFactor"), specular = numbers(*old, "specularFactor");
    specular_gloss factors = {{1, 1, 1}, 1, {1, 1, 1}, 1};
    for (size_t c = 0; c < 3; c++) {
        if (diffuse.size() == 4)
            factors.diffuse[c] = double(limited(b.r, b.where, "the diffuse colour", diffuse[c], 0, 1));
        if (specular.size() == 3)
            factors.specular[c] = double(limited(b.r, b.where, "the specular colour", specular[c], 0, 1));
    }
    if (diffuse.size() == 4)
        factors.alpha = double(limited(b.r, b.where, "the diffuse colour", diffuse[3], 0, 1));
    factors.glossiness =
        double(limited(b.r, b.where, "glossinessFactor", number(*old, "glossinessFactor", 1), 0, 1));
    const gloss_maps maps = maps_of(b, *old);
    const bool textured = maps.images[0] >= 0 || maps.images[1] >= 0;
    const metal_rough metal =
        // The textures contain the factors then
        textured ? metal_rough{{1, 1, 1}, 1, 1, 1, {1, 1, 1}} : metal_of(factors);
    for (size_t c = 0; c < 3; c++) {
        b.set.value.base_colour[c] = float(metal.base[c]);
        b.set.value.specular_colour[c] = float(metal.mirror[c] / plain_mirror);
    }
    b.set.value.base_colour[3] = float(metal.alpha);
    b.set.value.metallic = float(metal.metallic);
    b.set.value.roughness = float(metal.roughness);
    if (textured && !b.all.collecting)
        use_converted(b, factors, maps);
}

uint32_t material(reader &r, images &all, int index)
{
    const tinygltf::Material &source = r.model.materials[size_t(index)];
    record_texture_use uses[PROTOCOL_MATERIAL_COUNT] = {};
    message_set_material set;
    import_material_default(&set);
    const building b = {r, all, source, place("materials", size_t(index)), set, uses};

    core(b);
    emission(b);
    alpha(b);
    transmission(b);
    emission_seen_only(b);
    extensions(b);
    specular_glossiness(b);
    if (all.collecting)
        return 0;
    set.textures = uses;
    set.textures_count = PROTOCOL_MATERIAL_COUNT;
    set.name = source.name.c_str();
    return import_add_material(r.scene, &set);
}
} // namespace

void add_materials(reader &r, const std::set<int> &used)
{
    images all;

    for (int index : used)
        if (size_t(index) < r.model.materials.size())
            material(r, all, index);
    decode_images(r, all);
    all.collecting = false;
    for (int index : used)
        if (size_t(index) < r.model.materials.size())
            r.material_ids[size_t(index)] = material(r, all, index);
    check(r);
}
} // namespace gltf
