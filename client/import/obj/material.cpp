// SPDX-License-Identifier: MIT
// Materials of MTL: Phong's terms of 1995, and the later ones for physically based shading, converted to
// metallic-roughness.
#include "texture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <sstream>
#include <strings.h>

namespace obj
{
namespace
{
// MTL's bump maps have no unit; a height of 1 cm for white suits models in metres.
constexpr double bump_height_m = 0.01;
// Roughness of sheen's fibres, which MTL lacks: the default of Blender's shader, whose exporter writes Ps.
constexpr float sheen_roughness = 0.5f;

float unit(float value)
{
    return std::min(std::max(value, 0.0f), 1.0f); // NaN becomes 0
}

float max_component(const float colour[3])
{
    return unit(std::max({colour[0], colour[1], colour[2]}));
}

// Kd scatters and Ks mirrors: their sum is reflected, Ks' share of it like a metal.
void reflection(const tinyobj::material_t &m, message_set_material &set)
{
    const bool mirrors = m.illum >= 3 && m.illum <= 7;
    const float diffuse = max_component(m.diffuse), specular = max_component(m.specular);

    // Exporters write a black Kd if a texture replaces it.
    const bool is_textured = diffuse <= 0 && !m.diffuse_texname.empty();

    for (size_t c = 0; c < 3; c++)
        set.value.base_colour[c] = is_textured ? 1 : unit(m.diffuse[c]);
    // Equal width of Blinn's and GGX's highlights (Walter et al. 2007), where perceptual roughness is the root.
    set.value.roughness = unit(std::sqrt(2 / (std::max(m.shininess, 0.0f) + 2)));
    set.value.metallic = unit(m.metallic);
    if (mirrors && specular > 0 && m.metallic <= 0) {
        for (size_t c = 0; c < 3; c++)
            set.value.base_colour[c] = unit(m.diffuse[c] + m.specular[c]);
        set.value.metallic = specular / (diffuse + specular);
        if (m.shininess >= 100) // illumination 3 and up means sharp reflections
            set.value.roughness = 0;
    }
    if (m.roughness > 0 || !m.roughness_texname.empty())
        set.value.roughness = m.roughness > 0 ? unit(m.roughness) : 1;
    if (!m.metallic_texname.empty() && m.metallic <= 0)
        set.value.metallic = 1;
}

// `anisor` counts turns.
void anisotropy(const tinyobj::material_t &m, message_set_material &set)
{
    constexpr float turn = 6.28318531f;

    set.value.anisotropy = unit(m.anisotropy);
    if (std::fabs(m.anisotropy_rotation) <= 100) // false for NaN
        set.value.anisotropy_rotation = m.anisotropy_rotation * turn;
}

void transparency(const tinyobj::material_t &m, message_set_material &set)
{
    const float through = 1 - unit(m.dissolve), filter = max_component(m.transmittance);
    const bool refracts = m.illum == 4 || m.illum == 6 || m.illum == 7 || m.illum == 9;

    if (m.ior >= 1 && m.ior <= 10)
        set.value.ior = m.ior > 1 ? m.ior : set.value.ior;
    if ((refracts && (through > 0 || filter > 0)) || (through > 0 && m.ior > 1)) {
        set.value.transmission = through > 0 ? through : filter;
        set.value.metallic = 0;
        set.value.roughness = m.shininess >= 100 || refracts ? 0 : set.value.roughness;
        for (size_t c = 0; c < 3; c++) // black glass would be opaque: colours apply to the filter
            set.value.base_colour[c] = filter > 0                     ? unit(m.transmittance[c])
                                       : max_component(m.diffuse) > 0 ? unit(m.diffuse[c])
                                                                      : 1;
    } else if (through > 0) {
        set.value.alpha_mode = PROTOCOL_ALPHA_BLEND;
        set.value.base_colour[3] = 1 - through;
    }
}

// Reads Pc, Pcr and Ps.
void layers(const tinyobj::material_t &m, message_set_material &set)
{
    set.value.clearcoat = unit(m.clearcoat_thickness);
    set.value.clearcoat_roughness = unit(m.clearcoat_roughness);
    const float sheen = m.sheen <= 0 && !m.sheen_texname.empty() ? 1 : unit(m.sheen);
    for (float &channel : set.value.sheen)
        channel = sheen;
    set.value.sheen_roughness = sheen > 0 ? sheen_roughness : 0;
}

void surface_maps(building &b, const tinyobj::material_t &m, const texcoord_sets &sets, message_set_material &set,
                  record_texture_use *uses)
{
    if (!m.alpha_texname.empty()) {
        bool cutout = false;
        uses[PROTOCOL_MATERIAL_BASE_COLOUR] =
            use_of(alpha_texture(b, m, cutout), m.alpha_texopt, sets[PROTOCOL_MATERIAL_BASE_COLOUR]);
        set.value.alpha_mode = cutout ? PROTOCOL_ALPHA_MASK : PROTOCOL_ALPHA_BLEND;
    } else if (!m.diffuse_texname.empty()) {
        uses[PROTOCOL_MATERIAL_BASE_COLOUR] =
            use_of(plain_texture(b, m.diffuse_texname, true, m.diffuse_texopt.clamp), m.diffuse_texopt,
                   sets[PROTOCOL_MATERIAL_BASE_COLOUR]);
    }
    if (!m.emissive_texname.empty()) {
        uses[PROTOCOL_MATERIAL_EMISSION] =
            use_of(plain_texture(b, m.emissive_texname, true, m.emissive_texopt.clamp), m.emissive_texopt,
                   sets[PROTOCOL_MATERIAL_EMISSION]);
        if (max_component(m.emission) <= 0)
            set.value.emission[0] = set.value.emission[1] = set.value.emission[2] = 1;
    }
    if (!m.roughness_texname.empty() || !m.metallic_texname.empty())
        uses[PROTOCOL_MATERIAL_METALLIC_ROUGHNESS] =
            use_of(roughness_texture(b, m), m.roughness_texopt, sets[PROTOCOL_MATERIAL_METALLIC_ROUGHNESS]);
    if (!m.sheen_texname.empty())
        uses[PROTOCOL_MATERIAL_SHEEN] = use_of(plain_texture(b, m.sheen_texname, false, m.sheen_texopt.clamp),
                                               m.sheen_texopt, sets[PROTOCOL_MATERIAL_SHEEN]);
}

void relief_maps(building &b, const tinyobj::material_t &m, const texcoord_sets &sets, record_texture_use *uses)
{
    if (!m.normal_texname.empty())
        uses[PROTOCOL_MATERIAL_NORMAL] = use_of(plain_texture(b, m.normal_texname, false, m.normal_texopt.clamp),
                                                m.normal_texopt, sets[PROTOCOL_MATERIAL_NORMAL]);
    if (m.bump_texname.empty())
        return;
    const protocol_material_texture at =
        looks_like_normals(b.images.at(m.bump_texname)) ? PROTOCOL_MATERIAL_NORMAL : PROTOCOL_MATERIAL_BUMP;
    const double strength =
        std::isfinite(m.bump_texopt.bump_multiplier) ? double(m.bump_texopt.bump_multiplier) : 1;
    if (at == PROTOCOL_MATERIAL_NORMAL && uses[PROTOCOL_MATERIAL_NORMAL].texture != 0)
        return;
    uses[at] = use_of(plain_texture(b, m.bump_texname, false, m.bump_texopt.clamp), m.bump_texopt,
                      sets[PROTOCOL_MATERIAL_BUMP]);
    uses[at].strength =
        float(std::min(std::max(strength, -1e3), 1e3) * (at == PROTOCOL_MATERIAL_BUMP ? bump_height_m : 1));
    if (at == PROTOCOL_MATERIAL_NORMAL)
        import_note(b.scene, PROTOCOL_SEVERITY_INFO, m.bump_texname.c_str(), "a bump map with normals");
}

void note_unused(building &b, const tinyobj::material_t &m)
{
    const std::pair<const char *, const std::string *> unused[] = {{"map_Ka", &m.ambient_texname},
                                                                   {"map_Ks", &m.specular_texname},
                                                                   {"map_Ns", &m.specular_highlight_texname},
                                                                   {"disp", &m.displacement_texname},
                                                                   {"refl", &m.reflection_texname}};
    for (const auto &entry : unused)
        if (!entry.second->empty())
            import_note(b.scene, PROTOCOL_SEVERITY_WARNING, m.name.c_str(), "maps of kind %s are not shown",
                        entry.first);
}

uint32_t add_material(building &b, const tinyobj::material_t &m, const texcoord_sets &sets)
{
    record_texture_use uses[PROTOCOL_MATERIAL_COUNT] = {};
    message_set_material set;

    import_material_default(&set);
    set.value.double_sided = 1; // OBJ has no notion of sides
    set.name = m.name.c_str();
    reflection(m, set);
    anisotropy(m, set);
    layers(m, set);
    transparency(m, set);
    for (size_t c = 0; c < 3; c++)
        set.value.emission[c] = m.emission[c] > 0 ? std::min(m.emission[c], 1e6f) : 0;
    if (set.value.alpha_mode == PROTOCOL_ALPHA_BLEND && set.value.base_colour[3] <= 0 && m.alpha_texname.empty())
        import_note(b.scene, PROTOCOL_SEVERITY_WARNING, m.name.c_str(),
                    "a material is wholly transparent (d 0 or Tr 1): objects with it are invisible");
    surface_maps(b, m, sets, set, uses);
    relief_maps(b, m, sets, uses);
    note_unused(b, m);
    set.textures = uses;
    set.textures_count = PROTOCOL_MATERIAL_COUNT;
    return import_add_material(b.scene, &set);
}
} // namespace

namespace
{
const char *const statements[] = {
    "newmtl",   "Ka",       "Kd",     "Ks",     "Kt",     "Tf",       "Ni",       "Ke",     "Ns",
    "illum",    "d",        "Tr",     "Pr",     "Pm",     "Ps",       "Pc",       "Pcr",    "aniso",
    "anisor",   "map_Ka",   "map_Kd", "map_Ks", "map_Ns", "map_Bump", "map_bump", "bump",   "map_d",
    "map_disp", "map_Disp", "disp",   "refl",   "map_Pr", "map_Pm",   "map_Ps",   "map_Ke", "norm"};

// The statement's word as tinyobjloader expects it, whatever its case.
std::string statement_of(const std::string &word)
{
    const char *const *end = std::end(statements);
    const char *const *same = std::find(std::begin(statements), end, word);
    const char *const *found =
        same != end ? same : std::find_if(std::begin(statements), end, [&](const char *known) {
            return strcasecmp(known, word.c_str()) == 0;
        });
    return found != end ? *found : word;
}

// Adds Kd to materials without it, whose texture counts fully; tinyobjloader would use 0.6, or nothing after a
// material with Kd.
std::string mend_library(const char *bytes, size_t size_bytes)
{
    const char *const end = bytes + size_bytes;
    std::string out;
    bool has_kd = true, has_map = false;
    const auto finish = [&] {
        if (has_map && !has_kd)
            out += "Kd 1 1 1\n";
    };

    for (const char *at = bytes; at < end;) {
        const char *stop = std::find_if(at, end, [](char c) { return c == '\n' || c == '\r'; });
        const char *word = std::find_if(at, stop, [](char c) { return c != ' ' && c != '\t'; });
        const char *behind = std::find_if(word, stop, [](char c) { return c == ' ' || c == '\t'; });
        const std::string statement = statement_of(std::string(word, behind));
        if (statement == "newmtl") {
            finish();
            has_kd = has_map = false;
        }
        has_kd = has_kd || statement == "Kd";
        has_map = has_map || statement == "map_Kd";
        out += statement;
        out.append(behind, stop);
        out += '\n';
        at = stop + 1;
    }
    finish();
    return out;
}

// Reads a library. False: the file is unusable, and `reason` is set.
bool read_library(reader &r, const std::string &name, std::vector<tinyobj::material_t> &materials, char *reason)
{
    size_t size_bytes = 0;
    const std::unique_ptr<unsigned char, free_bytes> bytes(files_read(r.files, name.c_str(), &size_bytes, reason));

    if (!bytes)
        return false;
    if (!files_is_material_library(bytes.get(), size_bytes)) {
        snprintf(reason, FILES_REASON_BYTES, "it has no statement 'newmtl'");
        return false;
    }
    const std::string text = mend_library(reinterpret_cast<const char *>(bytes.get()), size_bytes);
    memory_stream stream(text.data(), text.size());
    std::istream input(&stream);
    std::map<std::string, int> numbers;
    std::string warning, error;
    tinyobj::LoadMtl(&numbers, &materials, &input, &warning, &error);
    return true;
}

void note_library(reader &r, const std::string &name, const char *reason)
{
    import_note(r.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(),
                "the material file '%.100s' cannot be used: %.100s", name.c_str(), reason);
}
} // namespace

std::vector<tinyobj::material_t> read_libraries(reader &r, const std::vector<std::string> &libraries)
{
    std::vector<tinyobj::material_t> materials;
    std::set<std::string> seen;

    for (const std::string &whole : libraries) {
        char reason[FILES_REASON_BYTES] = "";
        if (!seen.insert(whole).second || read_library(r, whole, materials, reason))
            continue;
        std::istringstream words(whole);
        std::string name;
        const bool is_one = whole.find_first_of(" \t") == std::string::npos;
        if (is_one)
            note_library(r, whole, reason);
        while (!is_one && words >> name)
            if (seen.insert(name).second && !read_library(r, name, materials, reason))
                note_library(r, name, reason);
    }
    return materials;
}

std::vector<uint32_t> add_materials(import_scene *scene, const image_source &read_image,
                                    const std::vector<const tinyobj::material_t *> &materials,
                                    const std::vector<texcoord_sets> &sets)
{
    building b = {scene, read_image, {}, {}};
    std::vector<uint32_t> ids;

    read_images(b, materials);
    for (size_t i = 0; i < materials.size(); i++)
        ids.push_back(materials[i] ? add_material(b, *materials[i], i < sets.size() ? sets[i] : texcoord_sets{})
                                   : 0);
    return ids;
}
} // namespace obj
