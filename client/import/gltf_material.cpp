// SPDX-License-Identifier: MIT
// Materials and textures. Every material is gone through twice by the same code: first to learn which images are
// wanted and how, so that they can be decoded side by side, then to be added.
#include "gltf.hpp"
#include "gltf_gloss.hpp"
#include "texture.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace gltf
{
namespace
{
constexpr double pi = 3.14159265358979323846;
enum slot { BASE_COLOUR, NORMAL, METALLIC_ROUGHNESS, OCCLUSION, EMISSION, TRANSMISSION, slot_count };

// By image and whether it holds colour.
using image_key = std::pair<int, bool>;

struct images {
    std::map<image_key, size_t> numbers; // position in jobs
    std::vector<texture_job> jobs;
    std::vector<uint32_t> blobs; // by job: 0 until its texels are used as they are
    bool collecting = true;

    ~images()
    {
        for (const texture_job &job : jobs)
            free(job.texels);
    }
};

struct texture_source {
    int index = -1, texcoord = 0;
    double strength = 1;
    const tinygltf::ExtensionMap *extensions = nullptr;
    const tinygltf::Value *value = nullptr; // for textures that stand in an extension
};

std::string image_name(const reader &r, int image)
{
    const tinygltf::Image &i = r.model.images[size_t(image)];
    if (!i.uri.empty())
        return i.uri.substr(0, 200);
    return i.name.empty() ? place("images", size_t(image)) : i.name;
}

// The image of a texture, -1 if it has none that could be shown.
int image_of(reader &r, int texture, const std::string &where)
{
    if (texture < 0 || size_t(texture) >= r.model.textures.size())
        fail(r, where, "texture %d does not exist; there are %zu", texture, r.model.textures.size());
    const tinygltf::Texture &t = r.model.textures[size_t(texture)];
    int source = t.source;
    if (const tinygltf::Value *webp = extension(t.extensions, "EXT_texture_webp"))
        source = int(number(*webp, "source", source));
    if (source >= 0 && size_t(source) >= r.model.images.size())
        fail(r, place("textures", size_t(texture)), "image %d does not exist", source);
    if (source < 0)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, place("textures", size_t(texture)).c_str(),
                    "a texture without an image in a known format is left out");
    return source;
}

void want_image(reader &r, images &all, int image, bool colour)
{
    const image_key key = {image, colour};
    if (all.numbers.count(key))
        return;
    const tinygltf::Image &source = r.model.images[size_t(image)];
    texture_job job = {};
    job.srgb = colour;
    if (source.bufferView >= 0) {
        job.bytes = view_bytes(r, source.bufferView, job.size_bytes, place("images", size_t(image)));
    } else {
        job.bytes = source.image.data();
        job.size_bytes = source.image.size();
    }
    all.numbers[key] = all.jobs.size();
    all.jobs.push_back(job);
}

// An image that cannot be decoded is shown in a conspicuous colour.
void decode_images(reader &r, images &all)
{
    texture_decode(all.jobs.data(), all.jobs.size());
    all.blobs.assign(all.jobs.size(), 0);
    for (const auto &entry : all.numbers) {
        texture_job &job = all.jobs[entry.second];
        if (!job.texels) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, image_name(r, entry.first.first).c_str(),
                        "the image '%.100s' %.150s; it is shown in magenta and black",
                        image_name(r, entry.first.first).c_str(),
                        job.size_bytes == 0 ? "could not be read" : job.reason);
            job.texels = texture_marker();
            job.width = job.height = 2;
        }
        if (!job.texels)
            throw std::bad_alloc();
    }
}

uint32_t blob_of(reader &r, images &all, size_t number)
{
    texture_job &job = all.jobs[number];

    if (all.blobs[number] == 0) {
        all.blobs[number] = import_add_blob(r.scene, job.texels, uint64_t(job.width) * job.height * 4);
        job.texels = nullptr;
        if (r.scene->failed)
            throw failed();
    }
    return all.blobs[number];
}

gloss_image texels_of(const reader &r, const images &all, size_t number)
{
    const texture_job &job = all.jobs[number];
    const uint32_t blob = all.blobs[number];

    return {blob == 0 ? job.texels : r.scene->blobs[blob - 1].bytes, job.width, job.height};
}

protocol_wrap wrap_of(int mode)
{
    return mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? PROTOCOL_WRAP_CLAMP
           : mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? PROTOCOL_WRAP_MIRROR
                                                           : PROTOCOL_WRAP_REPEAT;
}

// A texture that is sampled as the file's; its size, whether it is sampled at the nearest texel and its texels are
// those given.
uint32_t add_texture(reader &r, int texture, const std::string &name, bool colour, message_set_texture set,
                     uint32_t blob)
{
    const tinygltf::Texture &t = r.model.textures[size_t(texture)];
    set.format = colour ? PROTOCOL_TEXTURE_RGBA8_SRGB : PROTOCOL_TEXTURE_RGBA8_LINEAR;
    set.name = name.c_str();
    if (t.sampler >= 0) {
        if (size_t(t.sampler) >= r.model.samplers.size())
            fail(r, place("textures", size_t(texture)), "sampler %d does not exist", t.sampler);
        const tinygltf::Sampler &sampler = r.model.samplers[size_t(t.sampler)];
        set.wrap_u = wrap_of(sampler.wrapS);
        set.wrap_v = wrap_of(sampler.wrapT);
        set.nearest |= sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    return import_add_texture(r.scene, &set, blob);
}

std::string texture_name(const reader &r, int texture, int image)
{
    const std::string &name = r.model.textures[size_t(texture)].name;
    return name.empty() ? image_name(r, image) : name;
}

uint32_t texture_id(reader &r, images &all, int texture, int image, bool colour)
{
    const auto found = r.texture_ids.find({texture, colour});
    if (found != r.texture_ids.end())
        return found->second;
    const size_t number = all.numbers.at({image, colour});
    message_set_texture set = {};
    set.width = all.jobs[number].width;
    set.height = all.jobs[number].height;
    set.nearest = all.jobs[number].reason[0] != '\0';
    return r.texture_ids[{texture, colour}] =
               add_texture(r, texture, texture_name(r, texture, image), colour, set, blob_of(r, all, number));
}

// KHR_texture_transform: translation * rotation * scale, where a positive angle turns the coordinates
// counter-clockwise as seen with v downwards.
void apply_transform(reader &r, const tinygltf::Value &transform, record_texture_use &use, int &texcoord,
                     const std::string &where)
{
    const std::vector<double> offset = numbers(transform, "offset"), scale = numbers(transform, "scale");
    const double angle = std::fmod(number(transform, "rotation", 0), 2 * pi);
    const double u = scale.size() == 2 ? scale[0] : 1, v = scale.size() == 2 ? scale[1] : 1;
    const double rows[6] = {std::cos(angle) * u,  std::sin(angle) * v, offset.size() == 2 ? offset[0] : 0,
                            -std::sin(angle) * u, std::cos(angle) * v, offset.size() == 2 ? offset[1] : 0};

    for (size_t i = 0; i < 6; i++)
        use.uv_transform[i] = limited(r, where, "the texture transform", rows[i], -1e9, 1e9);
    texcoord = int(number(transform, "texCoord", texcoord));
}

// Where the texture lies on the surface, and how strong it is.
void place_texture(reader &r, const texture_source &source, uint32_t texture, record_texture_use &use,
                   const std::string &where)
{
    const tinygltf::Value *transform = nullptr;
    int texcoord = source.texcoord;

    import_texture_use_default(&use, texture);
    use.strength = limited(r, where, "the texture's strength", source.strength, -1e6, 1e6);
    if (source.extensions)
        transform = extension(*source.extensions, "KHR_texture_transform");
    else if (source.value && source.value->Has("extensions") && source.value->Get("extensions").IsObject() &&
             source.value->Get("extensions").Has("KHR_texture_transform"))
        transform = &source.value->Get("extensions").Get("KHR_texture_transform");
    if (transform)
        apply_transform(r, *transform, use, texcoord, where);
    if (texcoord < 0 || texcoord > 1) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "texture coordinate set %d is not read; set 0 is used", texcoord);
        texcoord = 0;
    }
    use.texcoord_set = uint32_t(texcoord);
}

void use_texture(reader &r, images &all, const texture_source &source, bool colour, record_texture_use &use,
                 const std::string &where)
{
    if (source.index < 0)
        return;
    const int image = image_of(r, source.index, where);
    if (image < 0)
        return;
    if (all.collecting)
        want_image(r, all, image, colour);
    else
        place_texture(r, source, texture_id(r, all, source.index, image, colour), use, where);
}

texture_source source_of(const tinygltf::TextureInfo &info)
{
    return {info.index, info.texCoord, 1, &info.extensions, nullptr};
}

texture_source source_of(const tinygltf::Value &object, const char *key)
{
    texture_source source;
    if (object.IsObject() && object.Has(key) && object.Get(key).IsObject()) {
        source.value = &object.Get(key);
        source.index = int(number(*source.value, "index", -1));
        source.texcoord = int(number(*source.value, "texCoord", 0));
    }
    return source;
}

// ---- the parts of a material

struct building {
    reader &r;
    images &all;
    const tinygltf::Material &source;
    std::string where;
    message_set_material &set;
    record_texture_use *uses; // slot_count of them
};

void core(const building &b)
{
    const tinygltf::PbrMetallicRoughness &pbr = b.source.pbrMetallicRoughness;

    for (size_t c = 0; c < 4; c++)
        b.set.base_colour[c] = limited(b.r, b.where, "the base colour", pbr.baseColorFactor[c], 0, 1);
    b.set.metallic = limited(b.r, b.where, "metallicFactor", pbr.metallicFactor, 0, 1);
    b.set.roughness = limited(b.r, b.where, "roughnessFactor", pbr.roughnessFactor, 0, 1);
    if (!extension(b.source.extensions, "KHR_materials_pbrSpecularGlossiness")) { // which is in their place
        use_texture(b.r, b.all, source_of(pbr.baseColorTexture), true, b.uses[BASE_COLOUR], b.where);
        use_texture(b.r, b.all, source_of(pbr.metallicRoughnessTexture), false, b.uses[METALLIC_ROUGHNESS],
                    b.where);
    }
    const tinygltf::NormalTextureInfo &normal = b.source.normalTexture;
    use_texture(b.r, b.all, {normal.index, normal.texCoord, normal.scale, &normal.extensions, nullptr}, false,
                b.uses[NORMAL], b.where);
    const tinygltf::OcclusionTextureInfo &occlusion = b.source.occlusionTexture;
    use_texture(b.r, b.all,
                {occlusion.index, occlusion.texCoord, occlusion.strength, &occlusion.extensions, nullptr}, false,
                b.uses[OCCLUSION], b.where);
}

void emission(const building &b)
{
    const tinygltf::Value *stronger = extension(b.source.extensions, "KHR_materials_emissive_strength");
    const double strength = stronger ? number(*stronger, "emissiveStrength", 1) : 1;

    for (size_t c = 0; c < 3 && c < b.source.emissiveFactor.size(); c++)
        b.set.emission[c] = limited(b.r, b.where, "the emission", b.source.emissiveFactor[c] * strength, 0, 1e6);
    use_texture(b.r, b.all, source_of(b.source.emissiveTexture), true, b.uses[EMISSION], b.where);
}

void alpha(const building &b)
{
    const std::string &mode = b.source.alphaMode;

    if (mode == "MASK")
        b.set.alpha_mode = PROTOCOL_ALPHA_MASK;
    else if (mode == "BLEND")
        b.set.alpha_mode = PROTOCOL_ALPHA_BLEND;
    else if (mode != "OPAQUE")
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "unknown alpha mode '%.32s' is treated as OPAQUE", mode.c_str());
    // A cutoff above 1 is allowed and leaves nothing of the surface; 1 leaves what is fully opaque.
    b.set.alpha_cutoff = limited(b.r, b.where, "the alpha cutoff", b.source.alphaCutoff, 0, 1);
    b.set.double_sided = b.source.doubleSided;
}

void transmission(const building &b)
{
    if (const tinygltf::Value *ior = extension(b.source.extensions, "KHR_materials_ior")) {
        const double value = number(*ior, "ior", 1.5);
        b.set.ior = value == 0 ? 10.0f : limited(b.r, b.where, "the index of refraction", value, 1, 10);
    }
    if (const tinygltf::Value *glass = extension(b.source.extensions, "KHR_materials_transmission")) {
        b.set.transmission =
            limited(b.r, b.where, "transmissionFactor", number(*glass, "transmissionFactor", 0), 0, 1);
        use_texture(b.r, b.all, source_of(*glass, "transmissionTexture"), false, b.uses[TRANSMISSION], b.where);
    }
    b.set.unlit = extension(b.source.extensions, "KHR_materials_unlit") != nullptr;
}

void anisotropy(const building &b)
{
    const tinygltf::Value *brushed = extension(b.source.extensions, "KHR_materials_anisotropy");
    if (!brushed)
        return;
    b.set.anisotropy =
        limited(b.r, b.where, "anisotropyStrength", number(*brushed, "anisotropyStrength", 0), 0, 1);
    b.set.anisotropy_rotation =
        limited(b.r, b.where, "anisotropyRotation", number(*brushed, "anisotropyRotation", 0), -1000, 1000);
    if (source_of(*brushed, "anisotropyTexture").index >= 0 && !b.all.collecting)
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "a texture of anisotropy is not shown; its strength and rotation are the same everywhere");
}

// ---- the old model, converted

struct gloss_maps {
    texture_source sources[2]; // diffuse; specular and glossiness
    int images[2] = {-1, -1};
    record_texture_use uses[2] = {};
};

// Both are read as colours: the alpha of either is linear. Maps that lie differently on the surface do not become
// one: then the first one counts.
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
            set.width = std::max(set.width, from[i].width);
            set.height = std::max(set.height, from[i].height);
            set.nearest = set.nearest || b.all.jobs[number].reason[0] != '\0';
        }
    unsigned char *base = allocate_texels(b, set.width, set.height);
    const uint64_t bytes = uint64_t(set.width) * set.height * 4;
    const uint32_t base_blob = import_add_blob(b.r.scene, base, bytes);
    unsigned char *rough = allocate_texels(b, set.width, set.height);
    const uint32_t rough_blob = import_add_blob(b.r.scene, rough, bytes);
    if (b.r.scene->failed)
        throw failed();
    metal_texels(factors, from[0], from[1], set.width, set.height, base, rough);
    const int texture = maps.sources[main].index;
    const std::string name = texture_name(b.r, texture, maps.images[main]);
    b.uses[BASE_COLOUR] = b.uses[METALLIC_ROUGHNESS] = maps.uses[main];
    b.uses[BASE_COLOUR].texture = add_texture(b.r, texture, name, true, set, base_blob);
    b.uses[METALLIC_ROUGHNESS].texture =
        add_texture(b.r, texture, name + " metallic roughness", false, set, rough_blob);
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
        textured ? metal_rough{{1, 1, 1}, 1, 1, 1} : metal_of(factors); // the textures have all then
    for (size_t c = 0; c < 3; c++)
        b.set.base_colour[c] = float(metal.base[c]);
    b.set.base_colour[3] = float(metal.alpha);
    b.set.metallic = float(metal.metallic);
    b.set.roughness = float(metal.roughness);
    if (textured && !b.all.collecting)
        use_converted(b, factors, maps);
}

uint32_t material(reader &r, images &all, int index)
{
    const tinygltf::Material &source = r.model.materials[size_t(index)];
    record_texture_use uses[slot_count] = {};
    message_set_material set;
    import_material_default(&set);
    const building b = {r, all, source, place("materials", size_t(index)), set, uses};

    core(b);
    emission(b);
    alpha(b);
    transmission(b);
    anisotropy(b);
    specular_glossiness(b);
    if (all.collecting)
        return 0;
    set.textures = uses;
    set.textures_count = slot_count;
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
    if (r.scene->failed)
        throw failed();
}
} // namespace gltf
