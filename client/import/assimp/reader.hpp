// SPDX-License-Identifier: MIT
// The reader of scenes from Assimp. The library's structures are checked like a file: no index, count, pointer or
// name is used unchecked.
#ifndef FARLIGHT_IMPORT_ASSIMP_READER_HPP
#define FARLIGHT_IMPORT_ASSIMP_READER_HPP

#include "import/model/files.h"
#include "import/model/grouping.h"
#include "import/model/reading.hpp"
#include "library.h"

#include <assimp/scene.h>

#include <map>
#include <string>
#include <vector>

namespace assimp
{
// The object made from the library's meshes of a node.
struct shown_mesh {
    protocol_node_kind kind = PROTOCOL_NODE_MESH;
    uint32_t id = 0; // 0: there is nothing to show
    uint32_t skin = 0, target_count = 0;
};

struct reader : reading::base {
    struct files *files;
    const assimp_format *format;
    const aiScene *source = nullptr;
    double metres = 1;            // length of a unit, once the scene is read
    double origin[3] = {0, 0, 0}; // offset of the library's positions
    std::vector<uint32_t> material_ids = {};
    bool uses_second_texcoords = false;                                    // some material uses them
    std::map<std::vector<unsigned>, shown_mesh> meshes = {};               // by indices in the scene's list
    std::map<std::string, std::pair<uint32_t, const aiNode *>> nodes = {}; // by name: the first node with it
    // By the node's or mesh's name: node, number of targets
    std::map<std::string, std::pair<uint32_t, uint32_t>> morphs = {};
    uint32_t root = 0; // the first node, to which bones without a node are attached
    uint64_t budget = POLYGON_BUDGET;
};

std::string text(const aiString &from);
// Converts sRGB to linear light, clamped to 0..1.
float linear(float value);

// ---- check.cpp: checks against faults that the library would not survive
void check_bytes(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- collada.cpp, ply.cpp, stl.cpp
// Mended text for the library; empty for PLY and STL: the file itself is fine.
std::string mend_collada(reader &r, const unsigned char *bytes, size_t size_bytes);
std::string mend_ply(reader &r, const unsigned char *bytes, size_t size_bytes);
// Adds the Gaussians of a file; false: it has none.
bool add_ply_gaussians(reader &r, const unsigned char *bytes, size_t size_bytes);
std::string mend_stl(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- scene.cpp
void add_scene(reader &r);

// ---- mesh.cpp
// The object of meshes that a node shows, which is added at the first call.
const shown_mesh &meshes_of(reader &r, const std::vector<unsigned> &places);
bool is_point_cloud(const aiMesh &mesh);

// ---- skin.cpp
// True if bones move the mesh.
bool has_skin(const aiMesh &from);
// Reads joints and weights of the vertices into `mesh`; returns the skin's reserved identifier.
uint32_t read_skin(reader &r, unsigned place, import_mesh &mesh, const std::string &where);
// Adds the reserved skins, once all nodes are added.
void add_skins(reader &r);

// ---- material.cpp
void add_materials(reader &r);

// ---- clip.cpp
void add_clips(reader &r);
} // namespace assimp

#endif
