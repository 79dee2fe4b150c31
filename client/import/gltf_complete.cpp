// SPDX-License-Identifier: MIT
// tinygltf refuses a file in which the indices of a primitive have no buffer view (KHR_draco_mesh_compression lets
// them), a buffer has no bytes (EXT_meshopt_compression) or a channel no node (KHR_animation_pointer).
#include "gltf.hpp"

#include <jansson.h>

#include <cstring>
#include <memory>

namespace gltf
{
namespace
{
const char *const draco = "KHR_draco_mesh_compression";

struct release_json {
    void operator()(json_t *json) const
    {
        json_decref(json);
    }
};

void complete_primitive(json_t *primitive, const json_t *accessors)
{
    json_t *compressed = json_object_get(json_object_get(primitive, "extensions"), draco);
    json_t *indices = json_object_get(primitive, "indices");

    if (!json_is_object(compressed) || !json_is_integer(indices) || json_integer_value(indices) < 0)
        return;
    const json_t *accessor = json_array_get(accessors, size_t(json_integer_value(indices)));
    if (!json_is_object(accessor) || json_object_get(accessor, "bufferView"))
        return;
    json_object_set(compressed, "indices", indices);
    json_object_del(primitive, "indices");
}

void complete_meshes(json_t *root)
{
    const json_t *accessors = json_object_get(root, "accessors");
    size_t i, j;
    json_t *mesh, *primitive;

    json_array_foreach(json_object_get(root, "meshes"), i, mesh)
        json_array_foreach(json_object_get(mesh, "primitives"), j, primitive)
            complete_primitive(primitive, accessors);
}

bool is_fallback(const json_t *buffer)
{
    for (const char *name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
        if (json_is_true(
                json_object_get(json_object_get(json_object_get(buffer, "extensions"), name), "fallback")))
            return true;
    return false;
}

// The bytes that a program without the extension would read get a stand-in of one byte; only the first buffer of
// a binary file may have its bytes there.
void complete_buffers(json_t *root, bool binary)
{
    size_t i;
    json_t *buffer;

    json_array_foreach(json_object_get(root, "buffers"), i, buffer)
    {
        if (!is_fallback(buffer) && (json_object_get(buffer, "uri") || (binary && i == 0)))
            continue;
        json_object_set_new(buffer, "byteLength", json_integer(1));
        json_object_set_new(buffer, "uri", json_string("data:application/octet-stream;base64,AA=="));
    }
}

void complete_channels(json_t *root)
{
    size_t i, j;
    json_t *animation, *channel;

    json_array_foreach(json_object_get(root, "animations"), i, animation)
        json_array_foreach(json_object_get(animation, "channels"), j, channel)
    {
        json_t *target = json_object_get(channel, "target");
        if (json_is_object(target) && !json_object_get(target, "node"))
            json_object_set_new(target, "node", json_integer(-1));
    }
}
} // namespace

std::string complete_json(const unsigned char *json, size_t size_bytes, bool binary)
{
    const auto names = [&](const char *text) { return memmem(json, size_bytes, text, strlen(text)) != nullptr; };
    const bool compressed = names("meshopt_compression");
    std::string text;

    if (!names(draco) && !compressed && !names("KHR_animation_pointer"))
        return text;
    const std::unique_ptr<json_t, release_json> root(
        json_loadb(reinterpret_cast<const char *>(json), size_bytes, JSON_ALLOW_NUL, nullptr));
    if (!json_is_object(root.get()))
        return text; // the parser says what is wrong
    complete_meshes(root.get());
    if (compressed)
        complete_buffers(root.get(), binary);
    complete_channels(root.get());
    const auto append = [](const char *part, size_t part_bytes, void *out) {
        try {
            static_cast<std::string *>(out)->append(part, part_bytes);
        } catch (...) {
            return -1; // must not pass the C library
        }
        return 0;
    };
    if (json_dump_callback(root.get(), append, &text, JSON_COMPACT) != 0)
        throw std::bad_alloc();
    return text;
}
} // namespace gltf
