// SPDX-License-Identifier: MIT
// 3D Gaussians (3DGS): a body for each, up to where its opacity falls to a limit.
#ifndef FARLIGHT_IMPORT_MODEL_SPLATS_HPP
#define FARLIGHT_IMPORT_MODEL_SPLATS_HPP

#include "reading.hpp"

#include <array>
#include <vector>

namespace splats
{
struct gaussian {
    std::array<float, 3> place, colour, deviations; // colour: sRGB or linear, see is_linear
    std::array<float, 4> rotation;                  // x, y, z, w; of any length
    float opacity;                                  // opacity of its centre
};

struct cloud {
    std::vector<gaussian> all;
    bool is_linear = false;
};

// The colour from the first coefficient of spherical harmonics, which is equal in all directions.
float colour_of(double coefficient);
// Adds a mesh and returns its identifier; 0: no Gaussian is opaque enough to be shown.
uint32_t add(reading::base &r, const cloud &from, const std::string &name, const std::string &where);
} // namespace splats

#endif
