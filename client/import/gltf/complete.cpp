// SPDX-License-Identifier: MIT
// Completion of the JSON before tinygltf reads it, which refuses a file in which the indices of a primitive have
// no buffer view (as KHR_draco_mesh_compression allows), a buffer has no bytes (EXT_meshopt_compression) or a
// channel no node (KHR_animation_pointer), and a file with an accessor of no elements.
#include "reader.hpp"

#include <jansson.h>

#include <cctype>
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

// Gives fallback buffers, which only programs without the extension read, a stand-in of one byte; only the first
// buffer of a binary file may have its bytes in the file.
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
bool is_empty(const json_t *accessors, const json_t *index)
{
    const json_t *accessor = json_is_integer(index) && json_integer_value(index) >= 0
                                 ? json_array_get(accessors, size_t(json_integer_value(index)))
                                 : nullptr;
    const json_t *count = json_object_get(accessor, "count");

    return json_is_integer(count) && json_integer_value(count) == 0;
}

// Removes empty parts of each holder, with a note.
template <typename predicate>
void leave_out(reader &r, json_t *root, const char *holders, const char *parts, const char *what,
               predicate is_left_out)
{
    size_t i;
    json_t *holder;

    json_array_foreach(json_object_get(root, holders), i, holder)
    {
        json_t *list = json_object_get(holder, parts);
        for (size_t k = json_array_size(list); k-- > 0;) {
            if (!is_left_out(holder, json_array_get(list, k)))
                continue;
            import_note(r.scene, PROTOCOL_SEVERITY_INFO, (place(holders, i) + "." + place(parts, k)).c_str(),
                        "%s is left out", what);
            json_array_remove(list, k);
        }
    }
}

// Removes empty primitives and channels, which exporters write for objects without faces and actions without keys.
void leave_out_empty(reader &r, json_t *root)
{
    const json_t *accessors = json_object_get(root, "accessors");

    leave_out(r, root, "meshes", "primitives", "a primitive without vertices",
              [accessors](const json_t *, const json_t *primitive) {
                  const json_t *attributes = json_object_get(primitive, "attributes");
                  return is_empty(accessors, json_object_get(attributes, "POSITION")) ||
                         is_empty(accessors, json_object_get(primitive, "indices"));
              });
    leave_out(r, root, "animations", "channels", "a channel without keys",
              [accessors](const json_t *animation, const json_t *channel) {
                  const json_t *number = json_object_get(channel, "sampler");
                  const json_t *sampler = json_is_integer(number) && json_integer_value(number) >= 0
                                              ? json_array_get(json_object_get(animation, "samplers"),
                                                               size_t(json_integer_value(number)))
                                              : nullptr;
                  return is_empty(accessors, json_object_get(sampler, "input")) ||
                         is_empty(accessors, json_object_get(sampler, "output"));
              });
}

// Encodes names that are no valid URIs: a percent sign without two digits stands for itself, and one with digits
// may do so, too.
void complete_uris(reader &r, json_t *root)
{
    size_t i;
    json_t *holder;

    for (const char *array : {"buffers", "images"})
        json_array_foreach(json_object_get(root, array), i, holder)
        {
            const char *text = json_string_value(json_object_get(holder, "uri"));
            const std::string uri = text ? text : "";
            std::string completed;
            if (uri.find('%') == std::string::npos || uri.compare(0, 5, "data:") == 0)
                continue;
            for (size_t at = 0; at < uri.size(); at++)
                completed += uri[at] == '%' && !reading::is_escape(uri, at) ? "%25" : std::string(1, uri[at]);
            if (completed != uri)
                json_object_set_new(holder, "uri", json_string(completed.c_str()));
            r.raw_names[reading::decoded_uri(completed)] = uri;
        }
}

// True for JSON with "count": 0.
bool counts_nothing(const char *json, size_t size_bytes)
{
    const char *const end = json + size_bytes, key[] = "\"count\"";

    for (const char *at = json;
         (at = static_cast<const char *>(memmem(at, size_t(end - at), key, sizeof(key) - 1)));) {
        at += sizeof(key) - 1;
        const char *value = at;
        while (value < end && (isspace(static_cast<unsigned char>(*value)) || *value == ':'))
            value++;
        if (value < end && *value == '0')
            return true;
    }
    return false;
}
} // namespace

std::string complete_json(reader &r, const unsigned char *json, size_t size_bytes, bool binary)
{
    const auto names = [&](const char *text) { return memmem(json, size_bytes, text, strlen(text)) != nullptr; };
    const bool compressed = names("meshopt_compression"),
               counts_none = counts_nothing(reinterpret_cast<const char *>(json), size_bytes);
    std::string text;

    if (!names(draco) && !compressed && !names("KHR_animation_pointer") && !counts_none && !names("%"))
        return text;
    const std::unique_ptr<json_t, release_json> root(
        json_loadb(reinterpret_cast<const char *>(json), size_bytes, JSON_ALLOW_NUL, nullptr));
    if (!json_is_object(root.get()))
        return text; // the parser reports the error
    complete_meshes(root.get());
    if (counts_none)
        leave_out_empty(r, root.get());
    complete_uris(r, root.get());
    if (compressed)
        complete_buffers(root.get(), binary);
    complete_channels(root.get());
    const auto append = [](const char *part, size_t part_bytes, void *out) {
        try {
            static_cast<std::string *>(out)->append(part, part_bytes);
        } catch (...) {
            return -1; // an exception must not pass through the C library
        }
        return 0;
    };
    if (json_dump_callback(root.get(), append, &text, JSON_COMPACT) != 0)
        throw std::bad_alloc();
    return text;
}
} // namespace gltf
