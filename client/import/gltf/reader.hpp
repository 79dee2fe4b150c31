// SPDX-License-Identifier: MIT
// glTF 2.0 through tinygltf, which parses JSON and little else here: it is given files by our callbacks, no image
// is decoded by it, and no index, offset, stride or count that it passes on is used before it is checked.
#ifndef FARLIGHT_IMPORT_GLTF_READER_HPP
#define FARLIGHT_IMPORT_GLTF_READER_HPP

#include "import/model/files.h"
#include "import/model/reading.hpp"

// What the library was built with in every distribution; the declarations do not depend on it.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include <array>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace gltf
{
// Points or lines of a glTF mesh.
struct shown_part {
    protocol_node_kind kind;
    uint32_t id;
};

// What became of a glTF mesh.
struct shown_mesh {
    uint32_t id = 0;                    // 0: there is nothing to show
    bool has_joints = false;            // a skin can move it
    uint32_t max_joint = 0;             // that moves one of its vertices: place in the skin
    size_t file_targets = 0;            // morph targets in the file, and
    uint32_t target_count = 0;          // those that are kept, the first ones
    std::vector<shown_part> parts = {}; // that are shown beside its triangles
};

struct reader : reading::base {
    struct files *files;
    tinygltf::Model model;
    // By index of the glTF material: identifier in the scene, 0 until it is added.
    std::vector<uint32_t> material_ids;
    std::map<int, shown_mesh> meshes;                   // by index of the glTF mesh
    std::set<int> skinned_meshes;                       // those that a shown node has a skin for
    std::map<int, uint32_t> skin_ids;                   // by index of the glTF skin: reserved identifier
    std::vector<uint32_t> node_ids;                     // by node: identifier, 0: it is not part of what is shown
    std::map<size_t, std::vector<uint32_t>> mesh_nodes; // by node with a mesh: the nodes of ours that show it
    std::map<int, std::vector<uint32_t>> light_ids;     // by index of the glTF light: identifiers in the scene
    size_t instance_count = 0;
    int variant = -1; // of the materials; -1: as the primitives have them
    // By texture and whether it holds colour: what has been decoded.
    std::map<std::pair<int, bool>, uint32_t> texture_ids;
    std::map<std::string, std::string> raw_names; // by name as a URI: as it stands in the file, with percent signs
    std::map<std::string, size_t> buffer_sizes;   // by file: how much of it the model asks for, where that is less
    std::vector<int> parents;                     // by node; -1: a root
    // By view that is compressed: what it holds.
    std::map<int, std::vector<unsigned char>> decoded_views;
    size_t draco_buffers = 0; // where buffers begin that Draco has filled for the mesh at hand
};

// "meshes[3]"
std::string place(const char *array, size_t index);

// ---- load.cpp: bytes to tinygltf's structures
void load(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- complete.cpp
// Some extensions let a file leave out what tinygltf insists on: the JSON with that filled in; empty where nothing
// has to be, or the JSON is none. The indices of a mesh that Draco holds alone are named by the extension then.
// Primitives without vertices or indices are left out, with a note, and percent signs that stand for themselves
// are written as URIs have them.
std::string complete_json(reader &r, const unsigned char *json, size_t size_bytes, bool binary);

// ---- meshopt.cpp
// The bytes of a view that is compressed with meshoptimizer (EXT_meshopt_compression, KHR_meshopt_compression),
// decoded when they are asked for the first time. Null: it is not.
const std::vector<unsigned char> *decoded_view(reader &r, int view, const std::string &where);

// ---- draco.cpp
// Decodes the primitives of a mesh that are compressed with Draco: their accessors are replaced by others, of the
// decoded bytes, until forget_draco().
void decode_draco(reader &r, size_t mesh);
void forget_draco(reader &r);

// ---- accessor.cpp
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
// A part of a buffer, checked likewise; `what` names it.
const unsigned char *buffer_bytes(reader &r, int buffer, size_t offset, size_t size_bytes,
                                  const std::string &where);

// ---- material.cpp
// Adds those of the materials that are used, and their textures.
void add_materials(reader &r, const std::set<int> &used);

// ---- mesh.cpp
// The mesh as its vertices are given; adds it when it is asked for the first time.
const shown_mesh &mesh_of(reader &r, int mesh);
int attribute(const std::map<std::string, int> &attributes, const char *name); // its accessor; -1: none
// Vertices of a primitive that has positions, once all its accessors are known to have as many elements.
size_t vertex_count(reader &r, const tinygltf::Primitive &primitive, const std::string &where);
// The vertices, of so many, that it joins, in order.
std::vector<uint32_t> corners_of(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                                 const std::string &where);
// Its material in the scene; 0: the default one.
uint32_t material_id(reader &r, const tinygltf::Primitive &primitive, const std::string &where);
// Four bytes each, linear.
void read_colours(reader &r, int accessor, size_t count, uint16_t *out, const std::string &where);

// ---- line.cpp
// Adds the points and lines of a mesh, as spheres and as tubes; `skinned`: it has a skin, which does not move
// them.
std::vector<shown_part> add_points_and_lines(reader &r, const tinygltf::Mesh &source, bool skinned,
                                             const std::string &where);

// ---- skin.cpp
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

// ---- morph.cpp
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

// ---- target.cpp
// What a channel changes, and what becomes of its numbers.
struct channel_target {
    protocol_channel_path path;
    std::vector<uint32_t> objects; // one at least
    uint32_t width;
    size_t file_width; // numbers of a value in the file; less than `width`: the first one counts for all
    int type;          // of the accessor of values
    int node = -1;     // of the file, if its transform changes
    float scale[4] = {1, 1, 1, 1}; // of each number, the last one of all further ones; then `offset` is added
    float offset = 0;
};
// False: leave the channel out; a note says why if it is not for the file to be ignored.
bool find_target(reader &r, const tinygltf::AnimationChannel &channel, const std::string &where,
                 channel_target &found);

// ---- clip.cpp
void add_clips(reader &r);

// ---- transform.cpp
using matrix = std::array<double, 16>; // column-major as in glTF
matrix identity();
matrix node_matrix(reader &r, size_t node);
matrix product(const matrix &a, const matrix &b);
void to_rows(const matrix &m, float out[12]);
// A node's translation, rotation (a unit quaternion x y z w) and scale; of a matrix the nearest, with a note where
// it has shear.
struct parts {
    float translation[3], rotation[4], scale[3];
};
parts node_parts(reader &r, size_t node);

matrix matrix_of(const std::vector<double> &translation, const std::vector<double> &rotation,
                 const std::vector<double> &scale); // of other lengths than 3, 4, 3: none
std::array<double, 3> point_of(const matrix &m, const std::array<double, 3> &p);
struct world_box {
    std::array<double, 3> lower, upper;
};
using node_visitor = std::function<void(const tinygltf::Node &node, const matrix &world_from_node)>;
// Around all meshes at rest, as their accessors state it; inside out where there is none. Visits each node.
world_box box_of(reader &r, const std::vector<int> &roots, const node_visitor &visit = {});
// Fails where a number is not finite or beyond 1e12.
void check_matrix(reader &r, const matrix &m, const std::string &where);

// ---- origin.cpp
// Subtracts an origin from the nodes of a model that is far away; the identifier of the node that has it, 0: none.
uint32_t settle_origin(reader &r, const std::vector<int> &roots);

// ---- instance.cpp
// Where the node's mesh is shown, in the node's space; none: it is not instanced.
std::vector<matrix> instances_of(reader &r, size_t node);

// ---- variant.cpp
// Tells which there are and finds the one that the user wants.
void choose_variant(reader &r);
// The primitive's material in that variant; -1: none.
int material_of(const reader &r, const tinygltf::Primitive &primitive);

// ---- node.cpp
// Checks that the nodes are a forest and fills r.parents.
void check_hierarchy(reader &r);
void add_scene(reader &r);
// Adds a node that is not part of what is shown, and those above it, without what hangs there; returns its
// identifier.
uint32_t add_hidden_node(reader &r, size_t node);

// ---- light.cpp
// The light's identifier; 0, with a note: it cannot be had.
uint32_t light_id(reader &r, int index, const std::string &where);
// What a light's colour is divided by: the disc that a sphere shows, 1 for a light without size.
double light_disc(const tinygltf::Light &light);
// Intensities that would make the scene white throughout are lumens, as Blender writes them: they become watts.
void convert_photometric_lights(reader &r, const std::vector<int> &roots);

// ---- extension.cpp
// Fails with the name of an extension that the file requires and that is not understood, and what to do.
void check_required_extensions(reader &r);
// One note lists the others that are not understood.
void note_unknown_extensions(reader &r);

// Values of extensions; absent or of another type: the default.
const tinygltf::Value *extension(const tinygltf::ExtensionMap &extensions, const char *name);
double number(const tinygltf::Value &object, const char *key, double otherwise);
std::vector<double> numbers(const tinygltf::Value &object, const char *key);
std::string text_of(const tinygltf::Value &object, const char *key);
// A size or an offset; SIZE_MAX where it is negative or beyond 9e15.
size_t whole_number(const tinygltf::Value &object, const char *key, size_t otherwise);
// An index, -1 where there is none.
int index_of(const tinygltf::Value &object, const char *key);
// A number within the protocol's limits; beyond them it is cut, with a note.
float limited(reader &r, const std::string &where, const char *what, double value, double minimum, double maximum);
} // namespace gltf

#endif
