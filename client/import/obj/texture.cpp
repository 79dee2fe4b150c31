// SPDX-License-Identifier: MIT
// Textures of MTL, and combinations of several images.
#include "texture.hpp"

#include "import/image/texture.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

namespace obj
{
namespace
{
std::set<std::string> image_names(const std::vector<const tinyobj::material_t *> &materials)
{
    std::set<std::string> names;
    for (const tinyobj::material_t *m : materials) {
        if (!m)
            continue;
        for (const std::string *name :
             {&m->diffuse_texname, &m->alpha_texname, &m->bump_texname, &m->normal_texname, &m->emissive_texname,
              &m->roughness_texname, &m->metallic_texname, &m->sheen_texname})
            if (!name->empty())
                names.insert(*name);
    }
    return names;
}

// The texel of an image at the place of a texel of another size.
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
    set.value.width = size.width;
    set.value.height = size.height;
    set.value.format = colour ? PROTOCOL_TEXTURE_RGBA8_SRGB : PROTOCOL_TEXTURE_RGBA8_LINEAR;
    set.value.wrap_u = set.value.wrap_v = clamp ? PROTOCOL_WRAP_CLAMP : PROTOCOL_WRAP_REPEAT;
    set.value.nearest = size.marked;
    set.name = name.c_str();
    const uint32_t blob = import_add_blob(b.scene, texels, uint64_t(size.width) * size.height * 4);
    return b.textures[key] = import_add_texture(b.scene, &set, blob);
}
} // namespace

void read_images(building &b, const std::vector<const tinyobj::material_t *> &materials)
{
    const std::set<std::string> names = image_names(materials);
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
            char text[200];
            texture_explain_reduction(&job, text);
            if (job.reduced > 1)
                import_note(b.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(), "the image %s", text);
            continue;
        }
        i.marked = true;
        import_note(b.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(),
                    "the image '%.100s' cannot be used: %.150s; it is shown in magenta and black", name.c_str(),
                    job.reason);
    }
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

record_texture_use use_of(uint32_t texture, const tinyobj::texture_option_t &option, uint32_t texcoord_set)
{
    record_texture_use use;
    import_texture_use_default(&use, texture);
    use.texcoord_set = texcoord_set;
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
} // namespace obj
