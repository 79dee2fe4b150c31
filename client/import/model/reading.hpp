// SPDX-License-Identifier: MIT
// Shared parts of the readers in C++: errors as exceptions, arrays, colours.
#ifndef FARLIGHT_IMPORT_MODEL_READING_HPP
#define FARLIGHT_IMPORT_MODEL_READING_HPP

#include "scene.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <vector>

namespace reading
{
// Thrown after import_fail(); caught in the format's C function, and at the edges of libraries in C.
struct failed {
};

// Runs the body of a format's C function and ends exceptions. Returns whether the scene was read.
template <typename work> bool run(import_scene *scene, const char *too_large, work read)
{
    try {
        read();
    } catch (const failed &) {
        // Reported already.
    } catch (const std::bad_alloc &) {
        import_fail(scene, nullptr, "%s", too_large);
    } catch (const std::exception &exception) {
        import_fail(scene, nullptr, "the file cannot be parsed: %s", exception.what());
    } catch (...) {
        import_fail(scene, nullptr, "the file cannot be parsed");
    }
    return !scene->failed;
}

// Base of every reader. The functions below are found through it, so that a reader calls them without a namespace.
struct base {
    import_scene *scene;
};

// Fails with a message, of which the scene keeps 480 bytes.
[[noreturn]] inline void fail(base &r, const std::string &where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
inline void fail(base &r, const std::string &where, const char *format, ...)
{
    char words[480];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(words, sizeof(words), format, arguments);
    va_end(arguments);
    import_fail(r.scene, where.c_str(), "%s", words);
    throw failed();
}

// Ends the work if the scene has failed.
inline void check(base &r)
{
    if (r.scene->failed)
        throw failed();
}

// Fails if the scene has no space for this number of bytes, before they are allocated.
inline void check_room(base &r, const std::string &where, uint64_t count, uint64_t element_bytes)
{
    if (count > (IMPORT_BYTES_MAX - r.scene->blob_bytes) / element_bytes)
        fail(r, where, "the scene would need more than %llu GiB",
             static_cast<unsigned long long>(IMPORT_BYTES_MAX >> 30));
}

// Allocates zeroed memory for the C interface, which takes it over.
template <typename type> type *allocate(base &r, const std::string &where, uint64_t count)
{
    check_room(r, where, count, sizeof(type));
    void *memory = calloc(count > 0 ? size_t(count) : 1, sizeof(type));
    if (!memory)
        throw std::bad_alloc();
    return static_cast<type *>(memory);
}

// Copies an array for the C interface; NULL for an empty one.
template <typename type> type *copy_of(const std::vector<type> &from)
{
    type *copy = from.empty() ? nullptr : static_cast<type *>(malloc(from.size() * sizeof(type)));
    if (!copy && !from.empty())
        throw std::bad_alloc();
    if (copy)
        memcpy(copy, from.data(), from.size() * sizeof(type));
    return copy;
}

// A mesh under construction; empty arrays are missing.
struct mesh_parts {
    std::vector<float> positions = {}, normals = {};
    std::vector<uint16_t> colours = {};
    std::vector<uint32_t> indices = {};
    std::vector<record_material_range> ranges = {};
};

// Adds the mesh; returns its identifier.
inline uint32_t add_mesh(base &r, const mesh_parts &from, const std::string &name, const std::string &where)
{
    import_mesh mesh = {};

    mesh.name = name.c_str();
    mesh.where = where.c_str();
    mesh.vertex_count = uint32_t(from.positions.size() / 3);
    mesh.triangle_count = uint32_t(from.indices.size() / 3);
    mesh.range_count = uint32_t(from.ranges.size());
    try {
        mesh.positions = copy_of(from.positions);
        mesh.normals = copy_of(from.normals);
        mesh.colours = copy_of(from.colours);
        mesh.indices = copy_of(from.indices);
        mesh.ranges = copy_of(from.ranges);
    } catch (...) {
        import_mesh_finish(&mesh);
        throw;
    }
    const uint32_t id = import_add_mesh(r.scene, &mesh);
    check(r);
    return id;
}

// Converts a colour of a vertex, as a share of white in linear light, to 16 bits. NaN becomes 0.
inline uint16_t wide(float value)
{
    return uint16_t(std::lround(std::min(std::max(0.0f, value), 1.0f) * 65535));
}

// The value of a hexadecimal digit; -1: it is not one.
inline int hex_value(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

// True for a percent sign with two digits.
inline bool is_escape(const std::string &uri, size_t at)
{
    return at + 2 < uri.size() && uri[at] == '%' && hex_value(uri[at + 1]) >= 0 && hex_value(uri[at + 2]) >= 0;
}

// Resolves the percent signs of a URI.
inline std::string decoded_uri(const std::string &uri)
{
    std::string name;

    for (size_t at = 0; at < uri.size(); at++) {
        const bool escape = is_escape(uri, at);
        name += escape ? char(hex_value(uri[at + 1]) << 4 | hex_value(uri[at + 2])) : uri[at];
        at += escape ? 2 : 0;
    }
    return name;
}
} // namespace reading

#endif
