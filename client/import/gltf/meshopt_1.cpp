// SPDX-License-Identifier: MIT
// Decoder of meshoptimizer's attributes, version 1.
#include "meshopt.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace gltf
{
namespace
{
constexpr size_t group_size = 16, block_max = 256, stride_max = 256, tail_min = 24;

// A cursor that never passes the end.
struct source {
    const unsigned char *at, *end;

    const unsigned char *take(size_t count)
    {
        if (count > size_t(end - at))
            return nullptr;
        const unsigned char *bytes = at;
        at += count;
        return bytes;
    }
};

// 16 deltas of `bits` each; one that is all ones is a sentinel, whose byte follows behind the group.
bool decode_group(source &in, unsigned bits, unsigned char *out)
{
    const unsigned sentinel = (1u << bits) - 1;

    if (bits == 0) {
        memset(out, 0, group_size);
        return true;
    }
    const unsigned char *packed = in.take(group_size * bits / 8);
    if (!packed)
        return false;
    for (unsigned i = 0; i < group_size; i++) {
        const unsigned bit = i * bits, byte = packed[bit / 8];
        // Single bits start at the lowest bit of a byte, others at the highest ones.
        const unsigned shift = bits == 1 ? bit % 8 : 8 - bits - bit % 8;
        out[i] = static_cast<unsigned char>(byte >> shift & sentinel);
        if (bits == 8 || out[i] != sentinel)
            continue;
        const unsigned char *literal = in.take(1);
        if (!literal)
            return false;
        out[i] = *literal;
    }
    return true;
}

// Decodes the deltas of one byte of the elements of a block.
bool decode_plane(source &in, unsigned control, size_t count, unsigned char *out)
{
    static const unsigned char bits[2][4] = {{0, 1, 2, 4}, {1, 2, 4, 8}};
    const size_t groups = (count + group_size - 1) / group_size;

    if (control == 2) {
        memset(out, 0, count);
        return true;
    }
    if (control == 3) {
        const unsigned char *literals = in.take(count);
        if (literals)
            memcpy(out, literals, count);
        return literals != nullptr;
    }
    const unsigned char *modes = in.take((groups + 3) / 4);
    if (!modes)
        return false;
    for (size_t group = 0; group < groups; group++)
        if (!decode_group(in, bits[control][modes[group / 4] >> group % 4 * 2 & 3], out + group * group_size))
            return false;
    return true;
}

uint32_t unzigzag(uint32_t value, uint32_t mask)
{
    return ((value & 1) != 0 ? ~(value >> 1) : value >> 1) & mask;
}

// The value after `last`, 4 bytes wide, from its deltas. Mode 0: bytes, 1: pairs of bytes, 2: rotated bits.
uint32_t next_value(uint32_t last, uint32_t delta, unsigned mode)
{
    if (mode % 16 == 2) {
        const unsigned turn = mode / 16;
        return last ^ (delta << turn | delta >> ((32 - turn) & 31));
    }
    const unsigned width = mode == 0 ? 8 : 16;
    const uint32_t mask = (1u << width) - 1;
    uint32_t value = 0;
    for (unsigned shift = 0; shift < 32; shift += width)
        value |= (((last >> shift) + unzigzag(delta >> shift & mask, mask)) & mask) << shift;
    return value;
}

bool decode_block(source &in, const unsigned char *modes, size_t count, size_t stride, unsigned char *last,
                  unsigned char *out)
{
    const unsigned char *controls = in.take(stride / 4);
    unsigned char planes[4][block_max];

    for (size_t channel = 0; controls && channel < stride / 4; channel++) {
        for (size_t k = 0; k < 4; k++)
            if (!decode_plane(in, controls[channel] >> k * 2 & 3, count, planes[k]))
                return false;
        uint32_t value = 0;
        for (size_t k = 0; k < 4; k++)
            value |= uint32_t(last[channel * 4 + k]) << k * 8;
        for (size_t i = 0; i < count; i++) {
            const uint32_t delta = uint32_t(planes[0][i]) | uint32_t(planes[1][i]) << 8 |
                                   uint32_t(planes[2][i]) << 16 | uint32_t(planes[3][i]) << 24;
            value = next_value(value, delta, modes[channel]);
            for (size_t k = 0; k < 4; k++)
                out[i * stride + channel * 4 + k] = static_cast<unsigned char>(value >> k * 8);
        }
        for (size_t k = 0; k < 4; k++)
            last[channel * 4 + k] = static_cast<unsigned char>(value >> k * 8);
    }
    return controls != nullptr;
}
} // namespace

bool decode_attributes_1(const unsigned char *bytes, size_t size_bytes, size_t count, size_t stride,
                         unsigned char *out)
{
    const size_t tail = std::max(stride + stride / 4, tail_min);
    const size_t whole_block = std::min((8192 / stride) & ~(group_size - 1), block_max);
    unsigned char last[stride_max];

    if (size_bytes < 1 + tail || bytes[0] != 0xa1)
        return false;
    const unsigned char *modes = bytes + size_bytes - stride / 4, *base = modes - stride;
    for (size_t i = 0; i < stride / 4; i++)
        if (modes[i] % 16 > 2 || (modes[i] % 16 < 2 && modes[i] / 16 != 0))
            return false;
    memcpy(last, base, stride);
    source in = {bytes + 1, bytes + size_bytes - tail};
    for (size_t first = 0; first < count;) {
        const size_t block = std::min(whole_block, count - first);
        if (!decode_block(in, modes, block, stride, last, out + first * stride))
            return false;
        first += block;
    }
    return in.at == in.end;
}
} // namespace gltf
