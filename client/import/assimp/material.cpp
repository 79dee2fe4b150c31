// SPDX-License-Identifier: MIT
// Materials, converted to those of OBJ, whose terms are the same: Phong's, and the later ones for physically based
// shading. Textures lie beside the model or within it.
#include "reader.hpp"
#include "import/obj/reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace assimp
{
namespace
{
const aiMaterialProperty *property(const aiMaterial &material, const char *key, unsigned semantic,
                                   aiPropertyTypeInfo type, size_t bytes)
{
    for (unsigned i = 0; i < material.mNumProperties; i++) {
        const aiMaterialProperty *p = material.mProperties[i];
        if (p && p->mData && p->mIndex == 0 && p->mSemantic == semantic && p->mType == type &&
            p->mDataLength >= bytes && text(p->mKey) == key)
            return p;
    }
    return nullptr;
}

// Reads `count` numbers; false: the material lacks them.
bool numbers(const aiMaterial &material, const char *key, unsigned semantic, float *out, size_t count)
{
    const aiMaterialProperty *p = property(material, key, semantic, aiPTI_Float, count * sizeof(float));
    if (p)
        memcpy(out, p->mData, count * sizeof(float));
    return p != nullptr && std::all_of(out, out + count, [](float value) { return std::isfinite(value); });
}

float number(const aiMaterial &material, const char *key, float otherwise)
{
    float value = otherwise;
    return numbers(material, key, 0, &value, 1) ? value : otherwise;
}

// Reads a string, which follows a 32-bit length.
std::string words(const aiMaterial &material, const char *key, unsigned semantic)
{
    const aiMaterialProperty *p = property(material, key, semantic, aiPTI_String, sizeof(uint32_t));
    uint32_t length = 0;

    if (!p)
        return {};
    memcpy(&length, p->mData, sizeof(length));
    return {p->mData + sizeof(length), std::min<size_t>(length, p->mDataLength - sizeof(length))};
}

void colour(reader &r, const aiMaterial &material, const char *key, tinyobj::real_t out[3])
{
    float value[3];
    if (!numbers(material, key, 0, value, 3))
        return;
    for (size_t c = 0; c < 3; c++)
        out[c] = r.format->colours_are_srgb ? linear(value[c]) : value[c];
}

int32_t whole_number(const aiMaterial &material, const char *key, unsigned semantic, int32_t otherwise)
{
    const aiMaterialProperty *p = property(material, key, semantic, aiPTI_Integer, sizeof(int32_t));
    if (p)
        memcpy(&otherwise, p->mData, sizeof(otherwise));
    return otherwise;
}

// Returns a texture's set of coordinates, and marks that meshes need the second set.
uint32_t texcoord_set(reader &r, const aiMaterial &material, aiTextureType kind)
{
    const int32_t set = whole_number(material, "$tex.uvwsrc", kind, 0);
    if (set == 0 || set == 1) {
        r.uses_second_texcoords = r.uses_second_texcoords || set == 1;
        return uint32_t(set);
    }
    import_note(r.scene, PROTOCOL_SEVERITY_WARNING, words(material, "?mat.name", 0).c_str(),
                "texture coordinate set %d is not read; set 0 is used", set);
    return 0;
}

// Reads the first of the kinds for which the material has a texture. Returns its set of texture coordinates.
uint32_t texture(reader &r, const aiMaterial &material, std::initializer_list<aiTextureType> kinds,
                 std::string &name, tinyobj::texture_option_t &option)
{
    option.scale[0] = option.scale[1] = option.scale[2] = option.bump_multiplier = 1;
    for (aiTextureType kind : kinds) {
        float transform[5]; // offset, scale, rotation
        name = words(material, "$tex.file", kind);
        if (name.empty())
            continue;
        option.clamp =
            whole_number(material, "$tex.mapmodeu", kind, aiTextureMapMode_Wrap) == aiTextureMapMode_Clamp;
        if (numbers(material, "$tex.uvtrafo", kind, transform, 5))
            for (size_t c = 0; c < 2; c++) {
                option.origin_offset[c] = transform[c];
                option.scale[c] = transform[2 + c];
            }
        return texcoord_set(r, material, kind);
    }
    return 0;
}

obj::texcoord_sets textures(reader &r, const aiMaterial &from, tinyobj::material_t &m)
{
    obj::texcoord_sets sets = {};

    const uint32_t alpha = texture(r, from, {aiTextureType_OPACITY}, m.alpha_texname, m.alpha_texopt);
    sets[PROTOCOL_MATERIAL_BASE_COLOUR] =
        texture(r, from, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}, m.diffuse_texname, m.diffuse_texopt);
    sets[PROTOCOL_MATERIAL_NORMAL] =
        texture(r, from, {aiTextureType_NORMAL_CAMERA, aiTextureType_NORMALS}, m.normal_texname, m.normal_texopt);
    sets[PROTOCOL_MATERIAL_BUMP] = texture(r, from, {aiTextureType_HEIGHT}, m.bump_texname, m.bump_texopt);
    sets[PROTOCOL_MATERIAL_EMISSION] = texture(r, from, {aiTextureType_EMISSION_COLOR, aiTextureType_EMISSIVE},
                                               m.emissive_texname, m.emissive_texopt);
    const uint32_t metal = texture(r, from, {aiTextureType_METALNESS}, m.metallic_texname, m.metallic_texopt);
    const uint32_t rough =
        texture(r, from, {aiTextureType_DIFFUSE_ROUGHNESS}, m.roughness_texname, m.roughness_texopt);
    sets[PROTOCOL_MATERIAL_METALLIC_ROUGHNESS] = m.roughness_texname.empty() ? metal : rough;
    // An image for both colour and cutouts is listed twice.
    if (m.alpha_texname == m.diffuse_texname)
        m.alpha_texname.clear();
    if (!m.alpha_texname.empty())
        sets[PROTOCOL_MATERIAL_BASE_COLOUR] = alpha;
    return sets;
}

tinyobj::material_t material_of(reader &r, const aiMaterial &from, obj::texcoord_sets &sets)
{
    tinyobj::material_t m = {};

    m.name = words(from, "?mat.name", 0);
    m.diffuse[0] = m.diffuse[1] = m.diffuse[2] = 1;
    colour(r, from, "$clr.diffuse", m.diffuse);
    colour(r, from, "$clr.base", m.diffuse);
    colour(r, from, "$clr.specular", m.specular);
    colour(r, from, "$clr.emissive", m.emission);
    const float strength = number(from, "$mat.emissiveIntensity", 1);
    for (tinyobj::real_t &one : m.emission)
        one *= std::max(strength, 0.0f);
    m.illum = 2;
    m.shininess = number(from, "$mat.shininess", 0);
    m.roughness = number(from, "$mat.roughnessFactor", 0);
    m.metallic = number(from, "$mat.metallicFactor", 0);
    m.ior = number(from, "$mat.refracti", 0);
    m.anisotropy = number(from, "$mat.anisotropyFactor", 0);
    m.dissolve = number(from, "$mat.opacity", 1);
    if (m.dissolve <= 0) {
        m.dissolve = 1;
        import_note(r.scene, PROTOCOL_SEVERITY_INFO, m.name.c_str(),
                    "a material of opacity 0 is taken for opaque, as exporters mean it");
    }
    sets = textures(r, from, m);
    return m;
}

// ---- images

std::string base_name(const std::string &path)
{
    return path.substr(path.find_last_of("/\\") + 1); // npos + 1 is 0
}

unsigned char *copy_bytes(const void *from, size_t count, size_t *size_bytes)
{
    unsigned char *copy = static_cast<unsigned char *>(malloc(count + 1));
    if (!copy)
        throw std::bad_alloc();
    memcpy(copy, from, count);
    *size_bytes = count;
    return copy;
}

// Stores raw texels behind the header of a TGA file: B, G, R, A a texel, rows from the top.
unsigned char *as_tga(const aiTexture &image, size_t *size_bytes, char *reason)
{
    constexpr size_t head_bytes = 18;
    const size_t texels_bytes = size_t(image.mWidth) * image.mHeight * sizeof(aiTexel);

    if (image.mWidth == 0 || image.mWidth > UINT16_MAX || image.mHeight > UINT16_MAX) {
        snprintf(reason, FILES_REASON_BYTES, "has %u x %u texels", image.mWidth, image.mHeight);
        return nullptr;
    }
    unsigned char *file = static_cast<unsigned char *>(calloc(head_bytes + texels_bytes, 1));
    if (!file)
        throw std::bad_alloc();
    file[2] = 2; // uncompressed colours
    file[12] = uint8_t(image.mWidth);
    file[13] = uint8_t(image.mWidth >> 8);
    file[14] = uint8_t(image.mHeight);
    file[15] = uint8_t(image.mHeight >> 8);
    file[16] = 32;   // bits of a texel
    file[17] = 0x28; // 8 of them alpha, from the top
    memcpy(file + head_bytes, image.pcData, texels_bytes);
    *size_bytes = head_bytes + texels_bytes;
    return file;
}

// Finds an embedded texture by its number, "*2", or by the name of its former file.
const aiTexture *embedded(const reader &r, const std::string &name)
{
    for (unsigned i = 0; i < r.source->mNumTextures; i++) {
        const aiTexture *image = r.source->mTextures[i];
        if (image && image->pcData &&
            (name == "*" + std::to_string(i) || base_name(text(image->mFilename)) == base_name(name)))
            return image;
    }
    return nullptr;
}

unsigned char *read_image(const reader &r, const std::string &name, size_t *size_bytes, char *reason)
{
    if (const aiTexture *image = embedded(r, name))
        return image->mHeight == 0 ? copy_bytes(image->pcData, image->mWidth, size_bytes)
                                   : as_tga(*image, size_bytes, reason);
    return files_read_image(r.files, r.scene, name.c_str(), size_bytes, reason);
}

// True for materials that the library invents for a file without any: nameless or with the library's own name, and
// plain white or, from some of its readers, grey.
bool is_made_up(const tinyobj::material_t &m)
{
    const tinyobj::real_t *d = m.diffuse, white = 1, grey = 0.6f;
    return (m.name.empty() || m.name == "DefaultMaterial") && d[0] == d[1] && d[1] == d[2] &&
           (d[0] == white || d[0] == grey) && m.metallic == 0 && m.dissolve == 1 && m.emission[0] == 0 &&
           m.emission[1] == 0 && m.emission[2] == 0 && m.diffuse_texname.empty() && m.emissive_texname.empty();
}
} // namespace

void add_materials(reader &r)
{
    std::vector<bool> used(r.source->mNumMaterials, false);
    std::vector<tinyobj::material_t> materials;
    std::vector<const tinyobj::material_t *> wanted;
    std::vector<obj::texcoord_sets> sets(used.size());

    for (unsigned i = 0; i < r.source->mNumMeshes; i++) {
        const aiMesh *mesh = r.source->mMeshes[i];
        if (mesh && mesh->mMaterialIndex < used.size())
            used[mesh->mMaterialIndex] = true;
    }
    materials.reserve(used.size());
    for (unsigned i = 0; i < r.source->mNumMaterials; i++) {
        const aiMaterial *from = r.source->mMaterials[i];
        materials.push_back(from && used[i] ? material_of(r, *from, sets[i]) : tinyobj::material_t());
        wanted.push_back(from && used[i] && !is_made_up(materials.back()) ? &materials.back() : nullptr);
    }
    r.material_ids = obj::add_materials(
        r.scene,
        [&](const std::string &name, size_t *size_bytes, char *reason) {
            return read_image(r, name, size_bytes, reason);
        },
        wanted, sets);
    check(r);
}
} // namespace assimp
