// SPDX-License-Identifier: MIT
// The reader of 3MF: an archive with models in XML (3MF Core Specification 1.3, and from its extensions the colour
// groups of materials, and parts in other files of the archive).
#ifndef FARLIGHT_IMPORT_THREEMF_READER_HPP
#define FARLIGHT_IMPORT_THREEMF_READER_HPP

#include "import/model/files.h"
#include "import/model/scene.h"
#include "import/model/reading.hpp"

#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace threemf
{
// A missing property of a corner.
constexpr uint32_t none = UINT32_MAX;

// Base materials, or colours.
struct group {
    bool has_materials = false;
    std::vector<std::array<uint8_t, 4>> colours; // sRGB
    std::vector<std::string> names;
    std::vector<uint32_t> materials; // identifiers, once they are added
};

struct triangle {
    std::array<uint32_t, 3> corners;
    uint32_t group_id;
    std::array<uint32_t, 3> properties;
};

using object_key = std::pair<std::string, uint32_t>; // a file of the archive, and an identifier in it

// A placed object.
struct instance {
    object_key key;
    float parent_from_object[12];
};

struct object {
    std::string name;
    uint32_t mesh = 0; // 0: it has no triangles
    std::vector<instance> components;
};

struct reader : reading::base {
    double metres = 0.001; // length of a unit
    std::map<object_key, object> objects = {};
    std::vector<instance> items = {};
    uint32_t colours_material = 0; // white, multiplied by colours
};

// ---- archive.cpp
// Normalises a part's name for comparison: without the first slash, with slashes for the backslashes of some
// programs, small letters (Open Packaging Conventions, 6.2.2.3) and its percent signs resolved.
std::string part_name(const std::string &name);
using taker = std::function<void(const char *bytes, size_t size_bytes, bool is_last)>;
// Calls `begin` with the name of each model in the archive, the main one last, and the function that it returns
// with the model's bytes, a part at a time.
void each_model(reader &r, const unsigned char *bytes, size_t size_bytes,
                const std::function<taker(const std::string &name, bool is_main)> &begin);

// ---- scene.cpp
struct geometry {
    std::vector<float> positions;
    std::vector<triangle> triangles;
};
// Adds a mesh; returns its identifier.
uint32_t add_mesh(reader &r, const std::string &name, const geometry &from, std::map<uint32_t, group> &groups);
// Adds the nodes of all items, with the objects that they consist of.
void add_items(reader &r);
} // namespace threemf

#endif
