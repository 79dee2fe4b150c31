// SPDX-License-Identifier: MIT
// MTL: Phong's terms of 1995, and the later ones for physically based shading, to metallic-roughness.
#include "obj.hpp"
#include "texture.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>

namespace obj
{
namespace
{
enum slot { BASE_COLOUR, NORMAL, METALLIC_ROUGHNESS, OCCLUSION, EMISSION, TRANSMISSION, BUMP, slot_count };

// MTL's bump maps have no unit; a height of 1 cm for white suits models in metres.
constexpr double bump_height_m = 0.01;

struct free_bytes {
    void operator()(unsigned char *bytes) const
    {
        free(bytes);
    }
};

struct image {
    std::unique_ptr<unsigned char, free_bytes> texels; // the marker if it could not be had
    uint32_t width = 2, height = 2;
    bool has_alpha = false, marked = false;
};

struct building {
    import_scene *scene;
    const image_source &read_image;
    std::map<std::string, image> images;      // by file name
    std::map<std::string, uint32_t> textures; // by file name and use
};

// ---- images

std::set<std::string> image_names(const std::vector<const tinyobj::material_t *> &materials)
{
    std::set<std::string> names;
    for (const tinyobj::material_t *m : materials) {
        if (!m)
            continue;
        for (const std::string *name :
             {&m->diffuse_texname, &m->alpha_texname, &m->bump_texname, &m->normal_texname, &m->emissive_texname,
              &m->roughness_texname, &m->metallic_texname})
            if (!name->empty())
                names.insert(*name);
    }
    return names;
}

void read_images(building &b, const std::set<std::string> &names)
{
    std::vector<texture_job> jobs;
    std::vector<std::unique_ptr<unsigned char, free_bytes>> files;

    for (const std::string &name : names) {
        texture_job job = {};
        char reason[FILES_REASON_BYTES] = "";
        unsigned char *bytes = b.read_image(name, &job.size_bytes, reason);
        if (!bytes)
            snprintf(job.reason, sizeof(job.reason), "%.199s", reason);
        job.bytes = bytes;
        job.srgb = true;
        files.emplace_back(bytes);
        jobs.push_back(job);
    }
    texture_decode(jobs.data(), jobs.size());
    size_t number = 0;
    for (const std::string &name : names) {
        const texture_job &job = jobs[number++];
        image &i = b.images[name];
        i.texels.reset(job.texels ? job.texels : texture_marker());
        if (!i.texels)
            throw std::bad_alloc();
        if (job.texels) {
            i.width = job.width;
            i.height = job.height;
            i.has_alpha = job.has_alpha;
            continue;
        }
        i.marked = true;
        import_note(b.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(),
                    "the image '%.100s' cannot be used: %.150s; it is shown in magenta and black", name.c_str(),
                    job.reason);
    }
}

// What a texel of one image is at the place of a texel of another size.
const unsigned char *texel_at(const image &i, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    const size_t column = size_t(uint64_t(x) * i.width / width), row = size_t(uint64_t(y) * i.height / height);
    return i.texels.get() + (row * i.width + column) * 4;
}

unsigned char *new_texels(uint32_t width, uint32_t height)
{
    unsigned char *texels = static_cast<unsigned char *>(calloc(size_t(width) * height, 4));
    if (!texels)
        throw std::bad_alloc();
    return texels;
}

uint32_t add_texture(building &b, const std::string &key, const std::string &name, unsigned char *texels,
                     const image &size, bool colour, bool clamp)
{
    message_set_texture set = {};
    set.width = size.width;
    set.height = size.height;
    set.format = colour ? PROTOCOL_TEXTURE_RGBA8_SRGB : PROTOCOL_TEXTURE_RGBA8_LINEAR;
    set.wrap_u = set.wrap_v = clamp ? PROTOCOL_WRAP_CLAMP : PROTOCOL_WRAP_REPEAT;
    set.nearest = size.marked;
    set.name = name.c_str();
    const uint32_t blob = import_add_blob(b.scene, texels, uint64_t(size.width) * size.height * 4);
    return b.textures[key] = import_add_texture(b.scene, &set, blob);
}

uint32_t plain_texture(building &b, const std::string &name, bool colour, bool clamp)
{
    const std::string key = name + (colour ? "|colour" : "|data") + (clamp ? "|clamp" : "");
    const auto found = b.textures.find(key);
    if (found != b.textures.end())
        return found->second;
    const image &i = b.images.at(name);
    unsigned char *texels = new_texels(i.width, i.height);
    memcpy(texels, i.texels.get(), size_t(i.width) * i.height * 4);
    return add_texture(b, key, name, texels, i, colour, clamp);
}

// Base colour with map_d as its alpha; without map_Kd it is white. *cutout: alpha is nearly only 0 or 1.
uint32_t alpha_texture(building &b, const tinyobj::material_t &m, bool &cutout)
{
    const image &alpha = b.images.at(m.alpha_texname);
    const image *colour = m.diffuse_texname.empty() ? nullptr : &b.images.at(m.diffuse_texname);
    const image &size = colour ? *colour : alpha;
    const std::string key = m.diffuse_texname + "|alpha|" + m.alpha_texname;
    unsigned char *texels = new_texels(size.width, size.height);
    size_t between = 0;

    for (uint32_t y = 0; y < size.height; y++) {
        for (uint32_t x = 0; x < size.width; x++) {
            unsigned char *to = texels + (size_t(y) * size.width + x) * 4;
            const unsigned char *a = texel_at(alpha, x, y, size.width, size.height);
            if (colour)
                memcpy(to, texel_at(*colour, x, y, size.width, size.height), 3);
            else
                memset(to, 255, 3);
            to[3] = alpha.marked ? 255 : alpha.has_alpha ? a[3] : a[0];
            between += to[3] > 16 && to[3] < 239;
        }
    }
    cutout = between * 20 < size_t(size.width) * size.height;
    const auto found = b.textures.find(key);
    if (found != b.textures.end()) {
        free(texels);
        return found->second;
    }
    return add_texture(b, key, m.alpha_texname, texels, size, true, m.alpha_texopt.clamp);
}

// map_Pr in green and map_Pm in blue, as glTF has them.
uint32_t roughness_texture(building &b, const tinyobj::material_t &m)
{
    const image *rough = m.roughness_texname.empty() ? nullptr : &b.images.at(m.roughness_texname);
    const image *metal = m.metallic_texname.empty() ? nullptr : &b.images.at(m.metallic_texname);
    const image &size = rough ? *rough : *metal;
    const std::string key = m.roughness_texname + "|pr|" + m.metallic_texname;
    const auto found = b.textures.find(key);

    if (found != b.textures.end())
        return found->second;
    unsigned char *texels = new_texels(size.width, size.height);
    for (uint32_t y = 0; y < size.height; y++) {
        for (uint32_t x = 0; x < size.width; x++) {
            unsigned char *to = texels + (size_t(y) * size.width + x) * 4;
            to[0] = to[3] = 255;
            to[1] = rough ? texel_at(*rough, x, y, size.width, size.height)[0] : 255;
            to[2] = metal ? texel_at(*metal, x, y, size.width, size.height)[0] : 255;
        }
    }
    return add_texture(b, key, rough ? m.roughness_texname : m.metallic_texname, texels, size, false, false);
}

// Many files call a normal map a bump map: it is bluish throughout, heights are grey.
bool looks_like_normals(const image &i)
{
    uint64_t sum[3] = {0};
    const size_t count = size_t(i.width) * i.height, step = std::max<size_t>(count / 4096, 1);
    size_t seen = 0;

    for (size_t at = 0; at < count; at += step, seen++)
        for (size_t c = 0; c < 3; c++)
            sum[c] += i.texels.get()[at * 4 + c];
    return !i.marked && sum[2] > 190 * seen && sum[0] > 90 * seen && sum[0] < 165 * seen && sum[1] > 90 * seen &&
           sum[1] < 165 * seen;
}

// -o and -s; ours have v running downwards, hence the odd last term.
record_texture_use use_of(uint32_t texture, const tinyobj::texture_option_t &option)
{
    record_texture_use use;
    import_texture_use_default(&use, texture);
    const float values[4] = {option.scale[0], option.scale[1], option.origin_offset[0], option.origin_offset[1]};
    for (float value : values)
        if (!(std::fabs(value) < 1e6f))
            return use;
    use.uv_transform[0] = values[0];
    use.uv_transform[2] = values[2];
    use.uv_transform[4] = values[1];
    use.uv_transform[5] = 1 - values[1] - values[3];
    return use;
}

// ---- the material

float unit(float value)
{
    return std::min(std::max(value, 0.0f), 1.0f); // NaN becomes 0
}

float max_component(const float colour[3])
{
    return unit(std::max({colour[0], colour[1], colour[2]}));
}

// Kd is what scatters and Ks what mirrors: their sum is reflected, Ks' share of it like a metal.
void reflection(const tinyobj::material_t &m, message_set_material &set)
{
    const bool mirrors = m.illum >= 3 && m.illum <= 7;
    const float diffuse = max_component(m.diffuse), specular = max_component(m.specular);

    for (size_t c = 0; c < 3; c++)
        set.base_colour[c] = unit(m.diffuse[c]);
    // Equal width of Blinn's and GGX's highlights (Walter et al. 2007), perceptual roughness being the root.
    set.roughness = unit(std::sqrt(2 / (std::max(m.shininess, 0.0f) + 2)));
    set.metallic = unit(m.metallic);
    if (mirrors && specular > 0 && m.metallic <= 0) {
        for (size_t c = 0; c < 3; c++)
            set.base_colour[c] = unit(m.diffuse[c] + m.specular[c]);
        set.metallic = specular / (diffuse + specular);
        if (m.shininess >= 100) // illumination 3 and up asks for sharp reflections
            set.roughness = 0;
    }
    if (m.roughness > 0 || !m.roughness_texname.empty())
        set.roughness = m.roughness > 0 ? unit(m.roughness) : 1;
    if (!m.metallic_texname.empty() && m.metallic <= 0)
        set.metallic = 1;
}

// `anisor` counts turns.
void anisotropy(const tinyobj::material_t &m, message_set_material &set)
{
    constexpr float turn = 6.28318531f;

    set.anisotropy = unit(m.anisotropy);
    if (std::fabs(m.anisotropy_rotation) <= 100) // NaN is not
        set.anisotropy_rotation = m.anisotropy_rotation * turn;
}

void transparency(const tinyobj::material_t &m, message_set_material &set)
{
    const float through = 1 - unit(m.dissolve), filter = max_component(m.transmittance);
    const bool refracts = m.illum == 4 || m.illum == 6 || m.illum == 7 || m.illum == 9;

    if (m.ior >= 1 && m.ior <= 10)
        set.ior = m.ior > 1 ? m.ior : set.ior;
    if ((refracts && (through > 0 || filter > 0)) || (through > 0 && m.ior > 1)) {
        set.transmission = through > 0 ? through : filter;
        set.metallic = 0;
        set.roughness = m.shininess >= 100 || refracts ? 0 : set.roughness;
        for (size_t c = 0; c < 3; c++) // black glass would let nothing through: colours are for the filter
            set.base_colour[c] = filter > 0                     ? unit(m.transmittance[c])
                                 : max_component(m.diffuse) > 0 ? unit(m.diffuse[c])
                                                                : 1;
    } else if (through > 0) {
        set.alpha_mode = PROTOCOL_ALPHA_BLEND;
        set.base_colour[3] = 1 - through;
    }
}

void maps(building &b, const tinyobj::material_t &m, message_set_material &set, record_texture_use *uses)
{
    if (!m.alpha_texname.empty()) {
        bool cutout = false;
        uses[BASE_COLOUR] = use_of(alpha_texture(b, m, cutout), m.alpha_texopt);
        set.alpha_mode = cutout ? PROTOCOL_ALPHA_MASK : PROTOCOL_ALPHA_BLEND;
    } else if (!m.diffuse_texname.empty()) {
        uses[BASE_COLOUR] =
            use_of(plain_texture(b, m.diffuse_texname, true, m.diffuse_texopt.clamp), m.diffuse_texopt);
    }
    if (!m.emissive_texname.empty()) {
        uses[EMISSION] =
            use_of(plain_texture(b, m.emissive_texname, true, m.emissive_texopt.clamp), m.emissive_texopt);
        if (max_component(m.emission) <= 0)
            set.emission[0] = set.emission[1] = set.emission[2] = 1;
    }
    if (!m.roughness_texname.empty() || !m.metallic_texname.empty())
        uses[METALLIC_ROUGHNESS] = use_of(roughness_texture(b, m), m.roughness_texopt);
    if (!m.normal_texname.empty())
        uses[NORMAL] = use_of(plain_texture(b, m.normal_texname, false, m.normal_texopt.clamp), m.normal_texopt);
    if (m.bump_texname.empty())
        return;
    const slot at = looks_like_normals(b.images.at(m.bump_texname)) ? NORMAL : BUMP;
    const double strength =
        std::isfinite(m.bump_texopt.bump_multiplier) ? double(m.bump_texopt.bump_multiplier) : 1;
    if (at == NORMAL && uses[NORMAL].texture != 0)
        return;
    uses[at] = use_of(plain_texture(b, m.bump_texname, false, m.bump_texopt.clamp), m.bump_texopt);
    uses[at].strength = float(std::min(std::max(strength, -1e3), 1e3) * (at == BUMP ? bump_height_m : 1));
    if (at == NORMAL)
        import_note(b.scene, PROTOCOL_SEVERITY_INFO, m.bump_texname.c_str(), "a bump map that holds normals");
}

void note_unused(building &b, const tinyobj::material_t &m)
{
    const std::pair<const char *, const std::string *> unused[] = {{"map_Ka", &m.ambient_texname},
                                                                   {"map_Ks", &m.specular_texname},
                                                                   {"map_Ns", &m.specular_highlight_texname},
                                                                   {"disp", &m.displacement_texname},
                                                                   {"refl", &m.reflection_texname},
                                                                   {"map_Ps", &m.sheen_texname}};
    for (const auto &entry : unused)
        if (!entry.second->empty())
            import_note(b.scene, PROTOCOL_SEVERITY_WARNING, m.name.c_str(), "maps of kind %s are not shown",
                        entry.first);
}

uint32_t add_material(building &b, const tinyobj::material_t &m)
{
    record_texture_use uses[slot_count] = {};
    message_set_material set;

    import_material_default(&set);
    set.double_sided = 1; // OBJ has no notion of sides
    set.name = m.name.c_str();
    reflection(m, set);
    anisotropy(m, set);
    transparency(m, set);
    for (size_t c = 0; c < 3; c++)
        set.emission[c] = m.emission[c] > 0 ? std::min(m.emission[c], 1e6f) : 0;
    maps(b, m, set, uses);
    note_unused(b, m);
    set.textures = uses;
    set.textures_count = slot_count;
    return import_add_material(b.scene, &set);
}
} // namespace

bool material_reader::operator()(const std::string &name, std::vector<tinyobj::material_t> *materials,
                                 std::map<std::string, int> *numbers, std::string *, std::string *)
{
    char reason[FILES_REASON_BYTES] = "";
    std::string tried = name;
    size_t size_bytes = 0;
    unsigned char *bytes = files_read(r.files, name.c_str(), &size_bytes, reason);

    // tinyobjloader cuts the names at blanks; a name may have some.
    for (size_t i = 0; i < libraries.size() && !bytes; i++) {
        if (libraries[i] != name && libraries[i].compare(0, name.size(), name) == 0) {
            tried = libraries[i];
            bytes = files_read(r.files, tried.c_str(), &size_bytes, reason);
        }
    }
    if (!bytes) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, tried.c_str(), "the material file '%.100s' %.100s",
                    tried.c_str(), reason);
        return false;
    }
    const std::unique_ptr<unsigned char, free_bytes> owner(bytes);
    if (!files_is_material_library(bytes, size_bytes)) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, tried.c_str(),
                    "the material file '%.100s' has no statement 'newmtl'", tried.c_str());
        return false;
    }
    memory_stream stream(reinterpret_cast<const char *>(bytes), size_bytes);
    std::istream input(&stream);
    std::string warning, error;
    tinyobj::LoadMtl(numbers, materials, &input, &warning, &error);
    return !materials->empty();
}

std::vector<uint32_t> add_materials(import_scene *scene, const image_source &read_image,
                                    const std::vector<const tinyobj::material_t *> &materials)
{
    building b = {scene, read_image, {}, {}};
    std::vector<uint32_t> ids;

    read_images(b, image_names(materials));
    for (const tinyobj::material_t *material : materials)
        ids.push_back(material ? add_material(b, *material) : 0);
    return ids;
}
} // namespace obj
