// SPDX-License-Identifier: MIT
// The reader of glTF 2.0. It uses tinygltf to parse the JSON and for little else: our callbacks read the files,
// images are not decoded by it, and every index, offset, stride or count is checked before use.
#ifndef FARLIGHT_IMPORT_GLTF_READER_HPP
#define FARLIGHT_IMPORT_GLTF_READER_HPP

#include "import/model/files.h"
#include "import/model/reading.hpp"

// Distributions build the library with these settings; the declarations do not depend on them.
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

// The objects made from a glTF mesh.
struct shown_mesh {
    uint32_t id = 0;                    // 0: there are no triangles
    bool has_joints = false;            // a skin can move the mesh
    uint32_t max_joint = 0;             // largest index of a joint in the skin that moves a vertex
    size_t file_targets = 0;            // number of morph targets in the file, and ..
    uint32_t target_count = 0;          // .. the kept ones, which come first
    std::vector<shown_part> parts = {}; // points and lines beside the triangles
};

struct reader : reading::base {
    struct files *files;
    tinygltf::Model model;
    // Identifiers by glTF material; 0: not added yet.
    std::vector<uint32_t> material_ids;
    std::map<int, shown_mesh> meshes;                   // by glTF mesh
    std::set<int> skinned_meshes;                       // meshes for which a shown node has a skin
    std::map<int, uint32_t> skin_ids;                   // reserved identifiers by glTF skin
    std::vector<uint32_t> node_ids;                     // identifiers by node; 0: the node is not shown
    std::map<size_t, std::vector<uint32_t>> mesh_nodes; // our nodes that show the mesh, by glTF node
    std::map<int, std::vector<uint32_t>> light_ids;     // identifiers by glTF light
    size_t instance_count = 0;
    int variant = -1; // index of the variant of the materials; -1: the primitives' own
    // Decoded textures, by texture and whether it holds colour.
    std::map<std::pair<int, bool>, uint32_t> texture_ids;
    std::map<std::string, std::string> raw_names; // names as in the file, with percent signs, by decoded name
    std::map<std::string, size_t> buffer_sizes;   // sizes of buffers that are shorter than their files, by file
    std::vector<int> parents;                     // by node; -1: a root
    // Decoded bytes by compressed view.
    std::map<int, std::vector<unsigned char>> decoded_views;
    size_t draco_buffers = 0; // index of the first buffer that Draco has filled for the current mesh
};

// Formats a place as "meshes[3]".
std::string place(const char *array, size_t index);

// ---- load.cpp: loading of files into tinygltf's structures
void load(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- complete.cpp
// Completes the JSON with fields that some extensions make optional but tinygltf requires; empty if nothing is
// missing, or the JSON is invalid. Indices that exist only in Draco's bytes then refer to the extension.
// Primitives without vertices or indices are removed, with a note, and percent signs that stand for themselves
// are encoded as in URIs.
std::string complete_json(reader &r, const unsigned char *json, size_t size_bytes, bool binary);

// ---- meshopt.cpp
// The bytes of a view that is compressed with meshoptimizer (EXT_meshopt_compression, KHR_meshopt_compression),
// decoded at their first use. Null: the view is not compressed.
const std::vector<unsigned char> *decoded_view(reader &r, int view, const std::string &where);

// ---- draco.cpp
// Decodes the primitives of a mesh that are compressed with Draco: their accessors are replaced by accessors of
// the decoded bytes, until forget_draco().
void decode_draco(reader &r, size_t mesh);
void forget_draco(reader &r);

// ---- accessor.cpp
// Number of elements of an accessor of this type (TINYGLTF_TYPE_..; 0: any vector or scalar), after checking that
// all of its bytes exist.
size_t accessor_count(reader &r, int accessor, int type, const std::string &where);
// Number of components of an accessor's elements.
int accessor_components(reader &r, int accessor, const std::string &where);
// Writes `components` floats for each element; missing components become `fill`, further ones are dropped.
void read_floats(reader &r, int accessor, int components, float fill, float *out, const std::string &where);
// Reads unsigned integers: indices, joints.
std::vector<uint32_t> read_integers(reader &r, int accessor, int components, const std::string &where);
// Bytes of a buffer view, checked to lie within its buffer.
const unsigned char *view_bytes(reader &r, int view, size_t &size_bytes, const std::string &where);
// A part of a buffer, checked to lie within it; `where` names it in errors.
const unsigned char *buffer_bytes(reader &r, int buffer, size_t offset, size_t size_bytes,
                                  const std::string &where);

// ---- material.cpp
// Adds the used materials and their textures.
void add_materials(reader &r, const std::set<int> &used);

// ---- mesh.cpp
// The objects of a mesh, which are added at the first call.
const shown_mesh &mesh_of(reader &r, int mesh);
int attribute(const std::map<std::string, int> &attributes, const char *name); // index of the accessor; -1: none
// Number of vertices of a primitive with positions, after checking that all its accessors have as many elements.
size_t vertex_count(reader &r, const tinygltf::Primitive &primitive, const std::string &where);
// Indices of the vertices that the primitive joins, each below `vertices`, in order.
std::vector<uint32_t> corners_of(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                                 const std::string &where);
// The primitive's material in the scene; 0: the default one.
uint32_t material_id(reader &r, const tinygltf::Primitive &primitive, const std::string &where);
// Reads colours: four values for each vertex, linear.
void read_colours(reader &r, int accessor, size_t count, uint16_t *out, const std::string &where);

// ---- line.cpp
// Adds the points and lines of a mesh, as spheres and as tubes; `skinned`: it has a skin, which does not move
// them.
std::vector<shown_part> add_points_and_lines(reader &r, const tinygltf::Mesh &source, bool skinned,
                                             const std::string &where);

// ---- skin.cpp
// Joints of a primitive's vertices and their weights, used ones first; `stride` entries for each vertex, of which
// no vertex uses more than `used`.
struct influences {
    size_t stride = 0, used = 0;
    uint32_t max_joint = 0;
    std::vector<uint16_t> joints;
    std::vector<float> weights;
};
// Reads the influences; stride 0: the primitive has none.
influences read_influences(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                           const std::string &where);
// Reserves the skin's identifier, after checking that the skin has the joints that the mesh uses.
uint32_t skin_id(reader &r, int skin, const shown_mesh &mesh, const std::string &where);
// Adds the reserved skins, once all nodes are added.
void add_skins(reader &r);

// ---- morph.cpp
// The vertices of a primitive: their position in the mesh's arrays.
struct morph_lot {
    const tinygltf::Primitive *primitive;
    size_t first, count;
};
// Fills the target arrays of a mesh with known vertices. Returns the number of targets in the file.
size_t read_targets(reader &r, const std::vector<morph_lot> &lots, import_mesh &mesh, const std::string &where);
// Clamps `count` weights to the protocol's limits.
std::vector<record_morph_weight> morph_weights(reader &r, const std::vector<double> &from, size_t count,
                                               const std::string &where);

// ---- target.cpp
// The property that a channel changes, and the conversion of its numbers.
struct channel_target {
    protocol_channel_path path;
    std::vector<uint32_t> objects; // at least one
    uint32_t width;
    size_t file_width; // numbers of a value in the file; fewer than `width`: the first one counts for all
    int type;          // type of the accessor of values
    int node = -1;     // the file's node, if its transform changes
    // Factor of each number, the last one for all further ones; then `offset` is added
    float scale[4] = {1, 1, 1, 1};
    float offset = 0;
};
// Finds the target of a channel. False: the channel must be left out; a note has the reason unless the file
// demands it.
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
// A node's translation, rotation (a unit quaternion x y z w) and scale; the nearest ones to a matrix, with a note
// if it has shear.
struct parts {
    float translation[3], rotation[4], scale[3];
};
parts node_parts(reader &r, size_t node);

matrix matrix_of(const std::vector<double> &translation, const std::vector<double> &rotation,
                 const std::vector<double> &scale); // identity for lengths other than 3, 4, 3
std::array<double, 3> point_of(const matrix &m, const std::array<double, 3> &p);
struct world_box {
    std::array<double, 3> lower, upper;
};
using node_visitor = std::function<void(const tinygltf::Node &node, const matrix &world_from_node)>;
// Bounds of all meshes at rest, from their accessors; inverted if there are none. Visits each node.
world_box box_of(reader &r, const std::vector<int> &roots, const node_visitor &visit = {});
// Fails for numbers that are not finite or beyond 1e12.
void check_matrix(reader &r, const matrix &m, const std::string &where);

// ---- origin.cpp
// Subtracts an origin from the nodes of a distant model; returns the node at this origin, 0: none.
uint32_t settle_origin(reader &r, const std::vector<int> &roots);

// ---- instance.cpp
// Transforms of the node's instances, in the node's space; empty: it is not instanced.
std::vector<matrix> instances_of(reader &r, size_t node);

// ---- variant.cpp
// Lists the variants and finds the requested one.
void choose_variant(reader &r);
// The primitive's material in the chosen variant; -1: none.
int material_of(const reader &r, const tinygltf::Primitive &primitive);

// ---- node.cpp
// Checks that the nodes are a forest and fills r.parents.
void check_hierarchy(reader &r);
void add_scene(reader &r);
// Adds a node that is not shown, and its parents, without the objects that they show; returns its identifier.
uint32_t add_hidden_node(reader &r, size_t node);

// ---- light.cpp
// The light's identifier; 0, with a note: the light is unusable.
uint32_t light_id(reader &r, int index, const std::string &where);
// Divisor of a light's colour: the visible disc of a sphere, 1 for a light without size.
double light_disc(const tinygltf::Light &light);
// Converts intensities from lumens, as Blender writes them, to watts, if they would make the scene white
// throughout.
void convert_photometric_lights(reader &r, const std::vector<int> &roots);

// ---- extension.cpp
// Fails for a required extension that is not supported, with advice.
void check_required_extensions(reader &r);
// Lists the other unsupported extensions in a note.
void note_unknown_extensions(reader &r);

// Read values of extensions; absent ones or ones of another type become the default.
const tinygltf::Value *extension(const tinygltf::ExtensionMap &extensions, const char *name);
double number(const tinygltf::Value &object, const char *key, double otherwise);
std::vector<double> numbers(const tinygltf::Value &object, const char *key);
std::string text_of(const tinygltf::Value &object, const char *key);
// A size or an offset; SIZE_MAX if it is negative or beyond 9e15.
size_t whole_number(const tinygltf::Value &object, const char *key, size_t otherwise);
// An index; -1: there is none.
int index_of(const tinygltf::Value &object, const char *key);
// Clamps a number to the protocol's limits, with a note.
float limited(reader &r, const std::string &where, const char *what, double value, double minimum, double maximum);
} // namespace gltf

#endif
