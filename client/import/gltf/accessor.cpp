// SPDX-License-Identifier: MIT
// Accessors: every byte that is read is known to be inside its buffer first.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gltf
{
namespace
{
// An accessor without a buffer view is all zeros, so no bytes of the file bound its count.
constexpr size_t unbacked_max = 1u << 24;

struct elements {
    const unsigned char *bytes; // null: zeros
    size_t count, stride;
    int components, component_type;
    bool normalised;
};

size_t component_bytes(int type)
{
    switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
    default:
        return 0;
    }
}

const tinygltf::Accessor &accessor_at(reader &r, int index, const std::string &where)
{
    if (index < 0 || size_t(index) >= r.model.accessors.size())
        fail(r, where, "accessor %d does not exist; there are %zu", index, r.model.accessors.size());
    return r.model.accessors[size_t(index)];
}

// Checks that `count` elements of `element_bytes`, `stride` apart, from `offset`, lie within the view.
const unsigned char *range_within(reader &r, int view, size_t offset, size_t count, size_t stride,
                                  size_t element_bytes, const std::string &where)
{
    size_t size = 0;
    const unsigned char *bytes = view_bytes(r, view, size, where);
    if (count == 0)
        return bytes;
    if (offset > size || element_bytes > size - offset || (count - 1) > (size - offset - element_bytes) / stride)
        fail(r, where, "%zu elements of %zu bytes at offset %zu exceed the %zu bytes of bufferViews[%d]", count,
             element_bytes, offset, size, view);
    return bytes + offset;
}

elements elements_of(reader &r, int index, const std::string &where)
{
    const tinygltf::Accessor &accessor = accessor_at(r, index, where);
    const std::string here = where + ", " + place("accessors", size_t(index));
    elements e = {};

    e.components = tinygltf::GetNumComponentsInType(uint32_t(accessor.type));
    e.component_type = accessor.componentType;
    e.normalised = accessor.normalized;
    e.count = accessor.count;
    const size_t part = component_bytes(e.component_type);
    if (part == 0 || e.components < 1)
        fail(r, here, "component type %d is not allowed", e.component_type);
    if (e.count == 0 || e.count > UINT32_MAX)
        fail(r, here, "a count of %zu is not allowed", e.count);
    const size_t element_bytes = part * size_t(e.components);
    if (accessor.bufferView < 0) {
        if (e.count > unbacked_max)
            fail(r, here, "%zu elements without a buffer view", e.count);
        e.stride = element_bytes;
        return e;
    }
    if (size_t(accessor.bufferView) >= r.model.bufferViews.size())
        fail(r, here, "bufferViews[%d] does not exist", accessor.bufferView);
    e.stride = r.model.bufferViews[size_t(accessor.bufferView)].byteStride;
    if (e.stride == 0)
        e.stride = element_bytes;
    if (e.stride < element_bytes)
        fail(r, here, "a stride of %zu is less than an element's %zu bytes", e.stride, element_bytes);
    e.bytes = range_within(r, accessor.bufferView, accessor.byteOffset, e.count, e.stride, element_bytes, here);
    return e;
}

template <typename type> type load_as(const unsigned char *bytes)
{
    type value;
    memcpy(&value, bytes, sizeof(value));
    return value;
}

// Converts normalised integers as in glTF 2.0, sections 3.11 (Animations) and 3.6.2.2.
float float_of(const unsigned char *bytes, int component_type, bool normalised)
{
    switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
        const float value = load_as<int8_t>(bytes);
        return normalised ? std::max(value / 127.0f, -1.0f) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return normalised ? float(*bytes) / 255.0f : float(*bytes);
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
        const float value = load_as<int16_t>(bytes);
        return normalised ? std::max(value / 32767.0f, -1.0f) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
        const float value = load_as<uint16_t>(bytes);
        return normalised ? value / 65535.0f : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return float(load_as<uint32_t>(bytes));
    default:
        return load_as<float>(bytes);
    }
}

uint32_t integer_of(const unsigned char *bytes, int component_type)
{
    switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return *bytes;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return load_as<uint16_t>(bytes);
    default:
        return load_as<uint32_t>(bytes);
    }
}

bool is_unsigned(int component_type)
{
    return component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
           component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

// Copies a row of floats. Matrices of small components have padded columns, but none of these is read here.
void copy_floats(const elements &e, size_t element, const unsigned char *bytes, int components, float fill,
                 float *out)
{
    const size_t part = component_bytes(e.component_type);
    float *to = out + element * size_t(components);
    for (int c = 0; c < components; c++)
        to[c] = c < e.components ? float_of(bytes + size_t(c) * part, e.component_type, e.normalised) : fill;
}

struct sparse_elements {
    std::vector<uint32_t> indices;
    const unsigned char *values = nullptr;
    size_t stride = 0;
};

// Reads the elements that replace some of a sparse accessor's; none if it is not sparse.
sparse_elements sparse_of(reader &r, int index, const elements &e, const std::string &where)
{
    const tinygltf::Accessor &accessor = r.model.accessors[size_t(index)];
    const std::string here = where + ", " + place("accessors", size_t(index)) + ".sparse";
    sparse_elements result;

    if (!accessor.sparse.isSparse)
        return result;
    const int count = accessor.sparse.count;
    const int type = accessor.sparse.indices.componentType;
    if (count < 1 || size_t(count) > e.count)
        fail(r, here, "a count of %d is not within 1 .. %zu", count, e.count);
    if (!is_unsigned(type))
        fail(r, here, "component type %d is not allowed for indices", type);
    if (accessor.sparse.indices.byteOffset < 0 || accessor.sparse.values.byteOffset < 0)
        fail(r, here, "a negative offset");
    const size_t part = component_bytes(type);
    result.stride = component_bytes(e.component_type) * size_t(e.components);
    const unsigned char *indices =
        range_within(r, accessor.sparse.indices.bufferView, size_t(accessor.sparse.indices.byteOffset),
                     size_t(count), part, part, here);
    result.values = range_within(r, accessor.sparse.values.bufferView, size_t(accessor.sparse.values.byteOffset),
                                 size_t(count), result.stride, result.stride, here);
    for (size_t i = 0; i < size_t(count); i++) {
        const uint32_t at = integer_of(indices + i * part, type);
        if (at >= e.count || (i > 0 && at <= result.indices.back()))
            fail(r, here, "index %u is not ascending or beyond the %zu elements", at, e.count);
        result.indices.push_back(at);
    }
    return result;
}
} // namespace

const unsigned char *buffer_bytes(reader &r, int buffer, size_t offset, size_t size_bytes,
                                  const std::string &where)
{
    if (buffer < 0 || size_t(buffer) >= r.model.buffers.size())
        fail(r, where, "it names buffer %d, which does not exist", buffer);
    const std::vector<unsigned char> &data = r.model.buffers[size_t(buffer)].data;
    if (offset > data.size() || size_bytes > data.size() - offset)
        fail(r, where, "%zu bytes at %zu exceed the %zu bytes of buffers[%d]", size_bytes, offset, data.size(),
             buffer);
    return data.data() + offset;
}

const unsigned char *view_bytes(reader &r, int view, size_t &size_bytes, const std::string &where)
{
    if (view < 0 || size_t(view) >= r.model.bufferViews.size())
        fail(r, where, "bufferViews[%d] does not exist", view);
    const std::string here = where + ", " + place("bufferViews", size_t(view));
    if (const std::vector<unsigned char> *decoded = decoded_view(r, view, here)) {
        size_bytes = decoded->size();
        return decoded->data();
    }
    const tinygltf::BufferView &v = r.model.bufferViews[size_t(view)];
    size_bytes = v.byteLength;
    return buffer_bytes(r, v.buffer, v.byteOffset, v.byteLength, here);
}

size_t accessor_count(reader &r, int accessor, int type, const std::string &where)
{
    const elements e = elements_of(r, accessor, where);
    if (type != 0 && r.model.accessors[size_t(accessor)].type != type)
        fail(r, where, "accessors[%d] has the wrong type for its use", accessor);
    return e.count;
}

int accessor_components(reader &r, int accessor, const std::string &where)
{
    return elements_of(r, accessor, where).components;
}

void read_floats(reader &r, int accessor, int components, float fill, float *out, const std::string &where)
{
    const elements e = elements_of(r, accessor, where);
    const size_t element_bytes = component_bytes(e.component_type) * size_t(e.components);
    const sparse_elements sparse = sparse_of(r, accessor, e, where);

    if (!e.bytes) {
        std::fill(out, out + e.count * size_t(components), 0.0f);
    } else if (e.component_type == TINYGLTF_COMPONENT_TYPE_FLOAT && components == e.components &&
               e.stride == element_bytes) {
        memcpy(out, e.bytes, e.count * element_bytes);
    } else {
        for (size_t i = 0; i < e.count; i++)
            copy_floats(e, i, e.bytes + i * e.stride, components, fill, out);
    }
    for (size_t i = 0; i < sparse.indices.size(); i++)
        copy_floats(e, sparse.indices[i], sparse.values + i * sparse.stride, components, fill, out);
}

std::vector<uint32_t> read_integers(reader &r, int accessor, int components, const std::string &where)
{
    const elements e = elements_of(r, accessor, where);
    const sparse_elements sparse = sparse_of(r, accessor, e, where);
    const size_t part = component_bytes(e.component_type);

    if (!is_unsigned(e.component_type))
        fail(r, where, "accessors[%d] should hold unsigned integers", accessor);
    if (e.components != components)
        fail(r, where, "accessors[%d] should have %d components, not %d", accessor, components, e.components);
    std::vector<uint32_t> out(e.count * size_t(components));
    if (e.bytes && part == sizeof(uint32_t) && e.stride == part * size_t(components))
        memcpy(out.data(), e.bytes, out.size() * part);
    else if (e.bytes)
        for (size_t i = 0; i < e.count; i++)
            for (size_t c = 0; c < size_t(components); c++)
                out[i * size_t(components) + c] = integer_of(e.bytes + i * e.stride + c * part, e.component_type);
    for (size_t i = 0; i < sparse.indices.size(); i++)
        for (size_t c = 0; c < size_t(components); c++)
            out[sparse.indices[i] * size_t(components) + c] =
                integer_of(sparse.values + i * sparse.stride + c * part, e.component_type);
    return out;
}
} // namespace gltf
