// SPDX-License-Identifier: MIT
// Textures: their images, samplers and placement.
#include "texture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

namespace gltf
{
namespace
{
constexpr double pi = 3.14159265358979323846;

std::string image_name(const reader &r, int image)
{
    const tinygltf::Image &i = r.model.images[size_t(image)];
    if (!i.uri.empty())
        return i.uri.substr(0, 200);
    return i.name.empty() ? place("images", size_t(image)) : i.name;
}

uint32_t blob_of(reader &r, images &all, size_t number)
{
    texture_job &job = all.jobs[number];

    if (all.blobs[number] == 0) {
        all.blobs[number] = import_add_blob(r.scene, job.texels, uint64_t(job.width) * job.height * 4);
        job.texels = nullptr;
        check(r);
    }
    return all.blobs[number];
}

protocol_wrap wrap_of(int mode)
{
    return mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? PROTOCOL_WRAP_CLAMP
           : mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? PROTOCOL_WRAP_MIRROR
                                                           : PROTOCOL_WRAP_REPEAT;
}

// KHR_texture_transform: translation * rotation * scale; a positive angle turns the coordinates counter-clockwise,
// seen with v downwards.
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
    texcoord = transform.Has("texCoord") ? index_of(transform, "texCoord") : texcoord;
}
} // namespace

int image_of(reader &r, int texture, const std::string &where)
{
    if (texture < 0 || size_t(texture) >= r.model.textures.size())
        fail(r, where, "texture %d does not exist; there are %zu", texture, r.model.textures.size());
    const tinygltf::Texture &t = r.model.textures[size_t(texture)];
    int source = t.source;
    if (const tinygltf::Value *webp = extension(t.extensions, "EXT_texture_webp"))
        source = webp->Has("source") ? index_of(*webp, "source") : source;
    if (source >= 0 && size_t(source) >= r.model.images.size())
        fail(r, place("textures", size_t(texture)), "image %d does not exist", source);
    const bool has_ktx2 = extension(t.extensions, "KHR_texture_basisu") != nullptr;
    if (source < 0)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, place("textures", size_t(texture)).c_str(),
                    "a texture without an image in a known format is left out%s%s", has_ktx2 ? "; " : "",
                    has_ktx2 ? TEXTURE_KTX2_REMEDY : "");
    else if (has_ktx2)
        import_note(r.scene, PROTOCOL_SEVERITY_INFO, place("textures", size_t(texture)).c_str(),
                    "KTX2 images (KHR_texture_basisu) are not read; the images that stand in for them are shown");
    return source;
}

namespace
{
// Reads an image that is missing at its stated place.
void read_moved(reader &r, tinygltf::Image &source, texture_job &job)
{
    char reason[FILES_REASON_BYTES] = "";
    size_t size_bytes = 0;
    const std::unique_ptr<unsigned char, void (*)(void *)> bytes(
        files_read_image(r.files, r.scene, reading::decoded_uri(source.uri).c_str(), &size_bytes, reason), free);

    if (bytes)
        source.image.assign(bytes.get(), bytes.get() + size_bytes);
    else
        snprintf(job.reason, sizeof(job.reason), "could not be read: %.150s", reason);
}
} // namespace

void want_image(reader &r, images &all, int image, bool colour)
{
    const image_key key = {image, colour};
    if (all.numbers.count(key))
        return;
    tinygltf::Image &source = r.model.images[size_t(image)];
    texture_job job = {};
    job.srgb = colour;
    if (source.bufferView < 0 && source.image.empty() && !source.uri.empty() &&
        source.uri.compare(0, 5, "data:") != 0)
        read_moved(r, source, job);
    if (source.bufferView >= 0) {
        job.bytes = view_bytes(r, source.bufferView, job.size_bytes, place("images", size_t(image)));
    } else {
        job.bytes = source.image.data();
        job.size_bytes = source.image.size();
    }
    all.numbers[key] = all.jobs.size();
    all.jobs.push_back(job);
}

void decode_images(reader &r, images &all)
{
    texture_decode(all.jobs.data(), all.jobs.size());
    all.blobs.assign(all.jobs.size(), 0);
    for (const auto &entry : all.numbers) {
        texture_job &job = all.jobs[entry.second];
        if (job.texels && job.reduced > 1) {
            char text[200];
            texture_explain_reduction(&job, text);
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, image_name(r, entry.first.first).c_str(),
                        "the image %s", text);
        }
        if (!job.texels) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, image_name(r, entry.first.first).c_str(),
                        "the image '%.100s' %.150s; it is shown in magenta and black",
                        image_name(r, entry.first.first).c_str(),
                        job.size_bytes == 0 && job.reason[0] == '\0' ? "could not be read" : job.reason);
            job.texels = texture_marker();
            job.width = job.height = 2;
        }
        if (!job.texels)
            throw std::bad_alloc();
    }
}

gloss_image texels_of(const reader &r, const images &all, size_t number)
{
    const texture_job &job = all.jobs[number];
    const uint32_t blob = all.blobs[number];

    return {blob == 0 ? job.texels : r.scene->blobs[blob - 1].bytes, job.width, job.height};
}

uint32_t add_texture(reader &r, int texture, const std::string &name, bool colour, message_set_texture set,
                     uint32_t blob)
{
    const tinygltf::Texture &t = r.model.textures[size_t(texture)];
    set.value.format = colour ? PROTOCOL_TEXTURE_RGBA8_SRGB : PROTOCOL_TEXTURE_RGBA8_LINEAR;
    set.name = name.c_str();
    if (t.sampler >= 0) {
        if (size_t(t.sampler) >= r.model.samplers.size())
            fail(r, place("textures", size_t(texture)), "sampler %d does not exist", t.sampler);
        const tinygltf::Sampler &sampler = r.model.samplers[size_t(t.sampler)];
        set.value.wrap_u = wrap_of(sampler.wrapS);
        set.value.wrap_v = wrap_of(sampler.wrapT);
        set.value.nearest |= sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    return import_add_texture(r.scene, &set, blob);
}

std::string texture_name(const reader &r, int texture, int image)
{
    const std::string &name = r.model.textures[size_t(texture)].name;
    return name.empty() ? image_name(r, image) : name;
}

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

namespace
{
uint32_t texture_id(reader &r, images &all, int texture, int image, bool colour)
{
    const auto found = r.texture_ids.find({texture, colour});
    if (found != r.texture_ids.end())
        return found->second;
    const size_t number = all.numbers.at({image, colour});
    message_set_texture set = {};
    set.value.width = all.jobs[number].width;
    set.value.height = all.jobs[number].height;
    set.value.nearest = all.jobs[number].reason[0] != '\0';
    return r.texture_ids[{texture, colour}] =
               add_texture(r, texture, texture_name(r, texture, image), colour, set, blob_of(r, all, number));
}
} // namespace

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
        source.index = index_of(*source.value, "index");
        source.texcoord = source.value->Has("texCoord") ? index_of(*source.value, "texCoord") : 0;
    }
    return source;
}
} // namespace gltf
