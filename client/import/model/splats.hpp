// SPDX-License-Identifier: MIT
// 3D Gaussians (3DGS): a body each, out to where its opacity falls to a limit.
#ifndef FARLIGHT_IMPORT_MODEL_SPLATS_HPP
#define FARLIGHT_IMPORT_MODEL_SPLATS_HPP

#include "reading.hpp"

#include <array>
#include <vector>

namespace splats
{
struct gaussian {
    std::array<float, 3> place, colour, deviations; // colour: sRGB, or linear as the cloud says
    std::array<float, 4> rotation;                  // x, y, z, w; of any length
    float opacity;                                  // of its middle
};

struct cloud {
    std::vector<gaussian> all;
    bool is_linear = false;
};

// The colour by the first coefficient of spherical harmonics, which has the same value in all directions.
float colour_of(double coefficient);
// Returns the identifier of a mesh; 0: none of them is opaque enough to be shown.
uint32_t add(reading::base &r, const cloud &from, const std::string &name, const std::string &where);
} // namespace splats

#endif
