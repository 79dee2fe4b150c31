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

#include <array>
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

// What became of a glTF mesh.
struct shown_mesh {
    uint32_t id = 0;           // 0: there is nothing to show
    bool has_joints = false;   // a skin can move it
    uint32_t max_joint = 0;    // that moves one of its vertices: place in the skin
    size_t file_targets = 0;   // morph targets in the file, and
    uint32_t target_count = 0; // those that are kept, the first ones
};

struct reader {
    import_scene *scene;
    struct files *files;
    tinygltf::Model model;
    // By index of the glTF material: identifier in the scene, 0 until it is added.
    std::vector<uint32_t> material_ids;
    std::map<int, shown_mesh> meshes;      // by index of the glTF mesh
    std::set<int> skinned_meshes;          // those that a shown node has a skin for
    std::map<int, uint32_t> skin_ids;      // by index of the glTF skin: reserved identifier
    std::vector<uint32_t> node_ids;        // by node: identifier, 0: it is not part of what is shown
    std::map<size_t, uint32_t> mesh_nodes; // by node with a mesh: which node of ours shows it
    // By texture and whether it holds colour: what has been decoded.
    std::map<std::pair<int, bool>, uint32_t> texture_ids;
    std::map<std::string, size_t> buffer_sizes; // by file: how much of it the model asks for, where that is less
    std::vector<int> parents;                   // by node; -1: a root
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
// The mesh as its vertices are given; adds it when it is asked for the first time.
const shown_mesh &mesh_of(reader &r, int mesh);
// Fails if the scene would not have room for so many bytes more, before anybody allocates them.
void check_room(reader &r, const std::string &where, uint64_t count, uint64_t element_bytes);

// ---- gltf_skin.cpp
// Joints of a primitive's vertices and their weights, the used ones first; `stride` places a vertex, of which no
// vertex uses more than `used`.
struct influences {
    size_t stride = 0, used = 0;
    uint32_t max_joint = 0;
    std::vector<uint16_t> joints;
    std::vector<float> weights;
};
// stride 0: the primitive has none.
influences read_influences(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                           const std::string &where);
// The identifier that the skin will have. Checks that it has the joints that the mesh asks for.
uint32_t skin_id(reader &r, int skin, const shown_mesh &mesh, const std::string &where);
// Adds the skins that were asked for, once all nodes have been added.
void add_skins(reader &r);

// ---- gltf_morph.cpp
// A mesh's vertices of one primitive: where they begin in its arrays.
struct morph_lot {
    const tinygltf::Primitive *primitive;
    size_t first, count;
};
// Fills the target arrays of a mesh whose vertices are known. Returns how many targets the file has.
size_t read_targets(reader &r, const std::vector<morph_lot> &lots, import_mesh &mesh, const std::string &where);
// Weights cut to what the protocol allows, `count` of them.
std::vector<record_morph_weight> morph_weights(reader &r, const std::vector<double> &from, size_t count,
                                               const std::string &where);

// ---- gltf_clip.cpp
void add_clips(reader &r);

// ---- gltf_transform.cpp
using matrix = std::array<double, 16>; // column-major as in glTF
matrix identity();
matrix node_matrix(reader &r, size_t node);
void to_rows(const matrix &m, float out[12]);
// A node's translation, rotation (a unit quaternion x y z w) and scale; of a matrix the nearest, with a note where
// it has shear.
struct parts {
    float translation[3], rotation[4], scale[3];
};
parts node_parts(reader &r, size_t node);

// ---- gltf_node.cpp
// Checks that the nodes are a forest and fills r.parents.
void check_hierarchy(reader &r);
void add_scene(reader &r);
// Adds a node that is not part of what is shown, and those above it, without what hangs there; returns its
// identifier.
uint32_t add_hidden_node(reader &r, size_t node);

// ---- values of extensions; absent or of another type: the default
const tinygltf::Value *extension(const tinygltf::ExtensionMap &extensions, const char *name);
double number(const tinygltf::Value &object, const char *key, double otherwise);
std::vector<double> numbers(const tinygltf::Value &object, const char *key);
// A number within the protocol's limits; beyond them it is cut, with a note.
float limited(reader &r, const std::string &where, const char *what, double value, double minimum, double maximum);
} // namespace gltf

#endif
