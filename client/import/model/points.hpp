// SPDX-License-Identifier: MIT
// Points without faces: a sphere each.
#ifndef FARLIGHT_IMPORT_MODEL_POINTS_HPP
#define FARLIGHT_IMPORT_MODEL_POINTS_HPP

#include "reading.hpp"

#include <vector>

namespace points
{
constexpr uint32_t points_max = 1u << 27;

struct cloud {
    std::vector<float> places;  // 3 a point
    std::vector<float> colours; // 3 a point, sRGB; empty: all have `material`
    uint32_t material = 0;
    double metres = 1; // length of a unit
};

// Adds a set of spheres and returns its identifier; 0: no point can be shown. The spheres' size is the scene's
// point_size.
uint32_t add(reading::base &r, const cloud &from, const std::string &name, const std::string &where);
} // namespace points

#endif
