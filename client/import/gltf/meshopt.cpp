// SPDX-License-Identifier: MIT
// Views compressed with meshoptimizer, in the format of KHR_meshopt_compression, which includes
// EXT_meshopt_compression; sections and names are of its appendices A and B. The header's claims are compared with
// the compressed size, which bounds them, before memory is allocated.
#include "meshopt.hpp"

#include "reader.hpp"

#include <meshoptimizer.h>

#include <cmath>
#include <cstring>

namespace gltf
{
namespace
{
// Maximum expansion of a compressed byte: a block of 256 elements of 4 bytes whose deltas are all zero
// (attributes, version 1).
constexpr size_t attribute_bytes_max = 1024;

struct packed_view {
    const unsigned char *bytes;
    size_t size_bytes, count, stride;
    std::string mode, filter;
};

packed_view read_header(reader &r, const tinygltf::Value &value, size_t wanted_bytes, const std::string &where)
{
    packed_view packed = {};

    packed.size_bytes = whole_number(value, "byteLength", 0);
    packed.count = whole_number(value, "count", 0);
    packed.stride = whole_number(value, "byteStride", 0);
    packed.mode = text_of(value, "mode");
    packed.filter = text_of(value, "filter");
    if (packed.filter.empty())
        packed.filter = "NONE";
    packed.bytes =
        buffer_bytes(r, index_of(value, "buffer"), whole_number(value, "byteOffset", 0), packed.size_bytes, where);
    if (packed.stride < 1 || packed.stride > 256 || packed.count < 1 || packed.count > wanted_bytes ||
        packed.count * packed.stride != wanted_bytes)
        fail(r, where, "%zu compressed elements of %zu bytes are not the %zu bytes of the view", packed.count,
             packed.stride, wanted_bytes);
    if (packed.size_bytes < 1)
        fail(r, where, "there are no compressed bytes");
    return packed;
}

void check_filter(reader &r, const packed_view &packed, const std::string &where)
{
    const bool pair = packed.stride == 4 || packed.stride == 8;
    const std::string &filter = packed.filter;
    const bool allowed = filter == "NONE" || ((filter == "OCTAHEDRAL" || filter == "COLOR") && pair) ||
                         (filter == "QUATERNION" && packed.stride == 8) || filter == "EXPONENTIAL";

    if (!allowed)
        fail(r, where, "the filter '%.32s' with elements of %zu bytes is not allowed", filter.c_str(),
             packed.stride);
}

// Converts YCoCg to RGB, for components of 8 or 16 bits: appendix B, filter 4.
template <typename type, typename signed_type> void decode_colours(std::vector<unsigned char> &out, size_t count)
{
    const float whole = float(type(~type(0)));

    for (size_t i = 0; i < count; i++) {
        type in[4];
        memcpy(in, out.data() + i * sizeof(in), sizeof(in));
        int scale = in[3]; // becomes all ones up to its highest bit
        for (int shift = 1; shift < 16; shift *= 2)
            scale |= scale >> shift;
        const int y = in[0], co = signed_type(in[1]), cg = signed_type(in[2]), alpha = in[3] & scale >> 1;
        const int rgba[4] = {y + co - cg, y + cg, y - co - cg, alpha << 1 | (alpha & 1)};
        for (size_t c = 0; c < 4; c++) {
            const float value = scale > 0 ? std::round(float(rgba[c]) * whole / float(scale)) : 0.0f;
            in[c] = type(std::fmin(std::fmax(value, 0.0f), whole));
        }
        memcpy(out.data() + i * sizeof(in), in, sizeof(in));
    }
}

void apply_filter(const packed_view &packed, std::vector<unsigned char> &out)
{
    if (packed.filter == "OCTAHEDRAL")
        meshopt_decodeFilterOct(out.data(), packed.count, packed.stride);
    else if (packed.filter == "QUATERNION")
        meshopt_decodeFilterQuat(out.data(), packed.count, packed.stride);
    else if (packed.filter == "EXPONENTIAL")
        meshopt_decodeFilterExp(out.data(), packed.count * (packed.stride / 4), 4);
    else if (packed.filter == "COLOR" && packed.stride == 4)
        decode_colours<uint8_t, int8_t>(out, packed.count);
    else if (packed.filter == "COLOR")
        decode_colours<uint16_t, int16_t>(out, packed.count);
}

// The filters process groups of elements and are safe for any bytes.
bool decode_attributes(reader &r, const packed_view &packed, std::vector<unsigned char> &out,
                       const std::string &where)
{
    if (packed.stride % 4 != 0)
        fail(r, where, "elements of %zu bytes; multiples of 4 are allowed", packed.stride);
    check_filter(r, packed, where);
    if (packed.count * packed.stride / attribute_bytes_max > packed.size_bytes)
        return false;
    out.resize(packed.count * packed.stride);
    const bool decoded =
        packed.bytes[0] == 0xa1
            ? decode_attributes_1(packed.bytes, packed.size_bytes, packed.count, packed.stride, out.data())
            : meshopt_decodeVertexBuffer(out.data(), packed.count, packed.stride, packed.bytes,
                                         packed.size_bytes) == 0;
    if (decoded)
        apply_filter(packed, out);
    return decoded;
}

// A triangle takes a byte at least, and so does an index of a sequence.
bool decode_indices(reader &r, const packed_view &packed, std::vector<unsigned char> &out,
                    const std::string &where)
{
    const bool triangles = packed.mode == "TRIANGLES";

    if (packed.stride != 2 && packed.stride != 4)
        fail(r, where, "indices of %zu bytes; 2 or 4 are allowed", packed.stride);
    if ((triangles && packed.count % 3 != 0) || packed.filter != "NONE")
        fail(r, where, "%zu indices with the filter '%.32s' are not allowed", packed.count, packed.filter.c_str());
    if ((triangles ? packed.count / 3 : packed.count) > packed.size_bytes)
        return false;
    out.resize(packed.count * packed.stride);
    return (triangles ? meshopt_decodeIndexBuffer(out.data(), packed.count, packed.stride, packed.bytes,
                                                  packed.size_bytes)
                      : meshopt_decodeIndexSequence(out.data(), packed.count, packed.stride, packed.bytes,
                                                    packed.size_bytes)) == 0;
}
} // namespace

const std::vector<unsigned char> *decoded_view(reader &r, int view, const std::string &where)
{
    const auto known = r.decoded_views.find(view);
    if (known != r.decoded_views.end())
        return &known->second;
    const tinygltf::BufferView &v = r.model.bufferViews[size_t(view)];
    const tinygltf::Value *value = extension(v.extensions, "KHR_meshopt_compression");
    if (!value)
        value = extension(v.extensions, "EXT_meshopt_compression");
    if (!value)
        return nullptr;
    const packed_view packed = read_header(r, *value, v.byteLength, where);
    check_room(r, where, packed.count, packed.stride);
    std::vector<unsigned char> out;
    bool decoded = false;
    if (packed.mode == "ATTRIBUTES")
        decoded = decode_attributes(r, packed, out, where);
    else if (packed.mode == "TRIANGLES" || packed.mode == "INDICES")
        decoded = decode_indices(r, packed, out, where);
    else
        fail(r, where, "the compression mode '%.32s' is unknown", packed.mode.c_str());
    if (!decoded)
        fail(r, where, "the %zu compressed bytes are not %zu %s of %zu bytes", packed.size_bytes, packed.count,
             packed.mode == "ATTRIBUTES" ? "attributes" : "indices", packed.stride);
    return &(r.decoded_views[view] = std::move(out));
}
} // namespace gltf
