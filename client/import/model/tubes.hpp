// SPDX-License-Identifier: MIT
// Lines as thin tubes, which rays can hit.
#ifndef FARLIGHT_IMPORT_MODEL_TUBES_HPP
#define FARLIGHT_IMPORT_MODEL_TUBES_HPP

#include "reading.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace tubes
{
using vector3 = std::array<double, 3>;

struct box {
    vector3 lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
};

// The tubes of one mesh.
struct set {
    reading::base &r;
    std::string where;
    double radius = 0, metres = 1; // metres: length of a unit
    bool has_colours = false;
    reading::mesh_parts mesh = {};
};

void extend(box &of, const std::vector<float> &places);
// Chooses the scene's point_size, or a small part of the box of all lines.
void choose_radius(set &t, const box &all, double metres);
// Adds tubes. `places`: 3 a vertex; `ends`: two vertices a line; `colours`: 4 a vertex, linear, or empty.
void add_lines(set &t, const std::vector<float> &places, const std::vector<uint32_t> &ends,
               const std::vector<uint16_t> &colours, uint32_t material, const std::string &where);
// Adds the mesh, with a note, and returns its identifier; 0: there are no tubes.
uint32_t add_mesh(set &t, const std::string &name);
} // namespace tubes

#endif
