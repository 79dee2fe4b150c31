// SPDX-License-Identifier: MIT
// Version 1 of meshoptimizer's codec of attributes, which libraries before 0.23 lack.
#ifndef FARLIGHT_IMPORT_GLTF_MESHOPT_HPP
#define FARLIGHT_IMPORT_GLTF_MESHOPT_HPP

#include <cstddef>

namespace gltf
{
// Writes count elements of `stride` bytes, a multiple of 4 up to 256. False: the bytes are not of that many.
// KHR_meshopt_compression, appendix A, mode 0.
bool decode_attributes_1(const unsigned char *bytes, size_t size_bytes, size_t count, size_t stride,
                         unsigned char *out);
} // namespace gltf

#endif
