// SPDX-License-Identifier: MIT
// glTF 2.0 through tinygltf, which parses JSON and little else here: it is given files by our callbacks, no image
// is decoded by it, and no index, offset, stride or count that it passes on is used before it is checked.
#ifndef FARLIGHT_IMPORT_GLTF_HPP
#define FARLIGHT_IMPORT_GLTF_HPP

#include "formats.h"

// What the library was built with in every distribution; the declarations do not depend on it.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace gltf
{
// Thrown after import_fail(); caught in gltf_import().
struct failed {
};

struct reader {
    import_scene *scene;
    struct files *files;
    tinygltf::Model model;
    // By index of the glTF material: identifier in the scene, 0 until it is added.
    std::vector<uint32_t> material_ids;
    // By mesh, skin (-1: none) and node with weights of its own (-1: none): identifier, 0: nothing to show.
    std::map<std::tuple<int, int, int>, uint32_t> mesh_ids;
    // By texture and whether it holds colour: what has been decoded.
    std::map<std::pair<int, bool>, uint32_t> texture_ids;
    std::map<std::string, size_t> buffer_sizes; // by file: how much of it the model asks for, where that is less
    std::vector<int> parents;                   // by node; -1: a root
    std::vector<std::array<double, 16>> world;  // by node, column-major as in glTF; filled when a skin asks
};

[[noreturn]] void fail(reader &r, const std::string &where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// "meshes[3]"
std::string place(const char *array, size_t index);

// ---- gltf_load.cpp: bytes to tinygltf's structures
void load(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- gltf_accessor.cpp
// Number of elements of an accessor of the given type (TINYGLTF_TYPE_..; 0: any vector or scalar), all of whose
// bytes are known to be there.
size_t accessor_count(reader &r, int accessor, int type, const std::string &where);
// Components of an accessor's elements.
int accessor_components(reader &r, int accessor, const std::string &where);
// Writes `components` floats an element; elements with fewer components get `fill` for the rest, more are cut.
void read_floats(reader &r, int accessor, int components, float fill, float *out, const std::string &where);
// Unsigned integers: indices, joints.
std::vector<uint32_t> read_integers(reader &r, int accessor, int components, const std::string &where);
// Bytes of a buffer view, checked to lie within its buffer.
const unsigned char *view_bytes(reader &r, int view, size_t &size_bytes, const std::string &where);

// ---- gltf_material.cpp
// Adds those of the materials that are used, and their textures.
void add_materials(reader &r, const std::set<int> &used);

// ---- gltf_mesh.cpp
// The mesh in its default shape: morph targets at their weights, skin in the pose of the nodes.
uint32_t mesh_id(reader &r, int mesh, int skin, int node);

// ---- gltf_skin.cpp
struct skinned_arrays {
    float *positions, *normals, *tangents; // normals and tangents may be null
    size_t vertex_count;
};
void apply_skin(reader &r, const tinygltf::Primitive &primitive, int skin, const skinned_arrays &arrays,
                const std::string &where);

// ---- gltf_node.cpp
std::array<double, 16> node_matrix(reader &r, size_t node);
// Checks that the nodes are a forest and fills r.parents.
void check_hierarchy(reader &r);
void add_scene(reader &r);
void add_clips(reader &r);

// ---- values of extensions; absent or of another type: the default
const tinygltf::Value *extension(const tinygltf::ExtensionMap &extensions, const char *name);
double number(const tinygltf::Value &object, const char *key, double otherwise);
std::vector<double> numbers(const tinygltf::Value &object, const char *key);
// A number within the protocol's limits; beyond them it is cut, with a note.
float limited(reader &r, const std::string &where, const char *what, double value, double least, double most);
} // namespace gltf

#endif
