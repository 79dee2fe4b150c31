// SPDX-License-Identifier: MIT
// The parts of the reader of what Assimp has read. Its structures are checked like a file: no index, count,
// pointer or name that they hold is used before it is checked.
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
// What became of meshes of the library that one node shows.
struct shown_mesh {
    protocol_node_kind kind = PROTOCOL_NODE_MESH;
    uint32_t id = 0; // 0: there is nothing to show
    uint32_t skin = 0, target_count = 0;
};

struct reader : reading::base {
    struct files *files;
    const assimp_format *format;
    const aiScene *source = nullptr;
    double metres = 1;            // of a unit, when the scene is there
    double origin[3] = {0, 0, 0}; // to be added to the positions that the library has
    std::vector<uint32_t> material_ids = {};
    bool uses_second_texcoords = false;                                    // some material does
    std::map<std::vector<unsigned>, shown_mesh> meshes = {};               // by places in the scene's list
    std::map<std::string, std::pair<uint32_t, const aiNode *>> nodes = {}; // by name: the first one
    std::map<std::string, std::pair<uint32_t, uint32_t>> morphs = {}; // by node's or mesh's name: node, targets
    uint32_t root = 0; // the first node: where bones without one are held
    uint64_t budget = POLYGON_BUDGET;
};

std::string text(const aiString &from);
// sRGB to linear light, cut to 0..1.
float linear(float value);

// ---- check.cpp: what the library would not survive, before it sees the file
void check_bytes(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- collada.cpp, ply.cpp, stl.cpp
// What the library is to read instead; of PLY and STL empty: the file itself.
std::string mend_collada(reader &r, const unsigned char *bytes, size_t size_bytes);
std::string mend_ply(reader &r, const unsigned char *bytes, size_t size_bytes);
// Whether it is a file of Gaussians, which are added.
bool add_ply_gaussians(reader &r, const unsigned char *bytes, size_t size_bytes);
std::string mend_stl(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- scene.cpp
void add_scene(reader &r);

// ---- mesh.cpp
// What the meshes become, all of which stand in the same node; adds them when they are asked for the first time.
const shown_mesh &meshes_of(reader &r, const std::vector<unsigned> &places);
bool is_point_cloud(const aiMesh &mesh);

// ---- skin.cpp
// Whether bones of the mesh move it.
bool has_skin(const aiMesh &from);
// Joints and weights of its vertices into `mesh`; returns the identifier that the skin will have.
uint32_t read_skin(reader &r, unsigned place, import_mesh &mesh, const std::string &where);
// Adds the skins that were asked for, once all nodes are there.
void add_skins(reader &r);

// ---- material.cpp
void add_materials(reader &r);

// ---- clip.cpp
void add_clips(reader &r);
} // namespace assimp

#endif
