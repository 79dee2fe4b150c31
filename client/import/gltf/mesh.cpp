// SPDX-License-Identifier: MIT
// Meshes: the primitives of a glTF mesh become a single mesh, with concatenated vertices and a range of triangles
// for each primitive, so that instances and materials are preserved.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace gltf
{
namespace
{
constexpr uint64_t vertices_max = 1u << 29, triangles_max = 1u << 29;

struct vertex_attributes {
    int position = -1, normal = -1, tangent = -1, colour = -1;
    int texcoord[2] = {-1, -1};
};

// Vertices of a primitive; primitives with the same accessors share them.
struct vertex_lot {
    const tinygltf::Primitive *primitive;
    vertex_attributes attributes;
    uint32_t first, count;
};

struct builder {
    reader &r;
    std::string where;
    const tinygltf::Mesh &source;
    bool skinned; // a node moves the mesh by a skin
    shown_mesh shown = {};
    import_mesh mesh = {};
    std::vector<record_morph_weight> weights = {};
    std::vector<vertex_lot> lots = {};
    std::vector<uint32_t> indices = {};
    std::vector<record_material_range> ranges = {};

    ~builder()
    {
        import_mesh_finish(&mesh);
    }
};

vertex_attributes attributes_of(const tinygltf::Primitive &primitive)
{
    vertex_attributes a;
    a.position = attribute(primitive.attributes, "POSITION");
    a.normal = attribute(primitive.attributes, "NORMAL");
    a.tangent = attribute(primitive.attributes, "TANGENT");
    a.colour = attribute(primitive.attributes, "COLOR_0");
    a.texcoord[0] = attribute(primitive.attributes, "TEXCOORD_0");
    a.texcoord[1] = attribute(primitive.attributes, "TEXCOORD_1");
    return a;
}

uint32_t lot_of(builder &b, const tinygltf::Primitive &primitive, const std::string &where)
{
    for (size_t i = 0; i < b.lots.size(); i++)
        if (b.lots[i].primitive->attributes == primitive.attributes &&
            b.lots[i].primitive->targets == primitive.targets)
            return uint32_t(i);
    const vertex_attributes a = attributes_of(primitive);
    const size_t count = vertex_count(b.r, primitive, where);
    const uint64_t first = b.lots.empty() ? 0 : uint64_t(b.lots.back().first) + b.lots.back().count;
    if (first + count > vertices_max)
        fail(b.r, b.where, "more than %llu vertices", static_cast<unsigned long long>(vertices_max));
    b.lots.push_back({&primitive, a, uint32_t(first), uint32_t(count)});
    return uint32_t(b.lots.size() - 1);
}

// ---- triangles

void add_triangle(builder &b, uint32_t first, uint32_t x, uint32_t y, uint32_t z)
{
    b.indices.push_back(first + x);
    b.indices.push_back(first + y);
    b.indices.push_back(first + z);
}

// Adds complete triangles. Most meshes are a single list of them, and copying a large one would take time.
void add_corners(builder &b, uint32_t first, std::vector<uint32_t> corners)
{
    if (first > 0)
        for (uint32_t &corner : corners)
            corner += first;
    if (b.indices.empty())
        b.indices = std::move(corners);
    else
        b.indices.insert(b.indices.end(), corners.begin(), corners.end());
}

void add_triangles(builder &b, const tinygltf::Primitive &primitive, const vertex_lot &lot,
                   const std::string &where)
{
    std::vector<uint32_t> corners = corners_of(b.r, primitive, lot.count, where);
    const size_t count = corners.size();

    if (primitive.mode == TINYGLTF_MODE_TRIANGLES) {
        if (count % 3 != 0)
            import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "corners that make no whole triangle were left out");
        corners.resize(count - count % 3);
        add_corners(b, lot.first, std::move(corners));
        return;
    }
    for (size_t i = 2; i < count; i++) {
        if (primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN) // glTF's order: (i + 1, i + 2, 0)
            add_triangle(b, lot.first, corners[i - 1], corners[i], corners[0]);
        else if (i % 2 == 0)
            add_triangle(b, lot.first, corners[i - 2], corners[i - 1], corners[i]);
        else // every other triangle of a strip is reversed
            add_triangle(b, lot.first, corners[i - 2], corners[i], corners[i - 1]);
    }
}

void add_primitive(builder &b, const tinygltf::Primitive &primitive, size_t number)
{
    const std::string where = b.where + "." + place("primitives", number);
    record_material_range range = {};

    if (primitive.mode < TINYGLTF_MODE_POINTS || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)
        fail(b.r, where, "mode %d is unknown", primitive.mode);
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES)
        return; // handled by add_points_and_lines()
    if (attribute(primitive.attributes, "POSITION") < 0) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "a primitive without positions is left out");
        return;
    }
    range.material = material_id(b.r, primitive, where);
    const uint32_t lot = lot_of(b, primitive, where);
    range.first = uint32_t(b.indices.size() / 3);
    add_triangles(b, primitive, b.lots[lot], where);
    if (b.indices.size() / 3 > triangles_max)
        fail(b.r, b.where, "more than %llu triangles", static_cast<unsigned long long>(triangles_max));
    range.count = uint32_t(b.indices.size() / 3) - range.first;
    if (range.count > 0)
        b.ranges.push_back(range);
}

// ---- vertices

void read_lot(builder &b, const vertex_lot &lot)
{
    const vertex_attributes &a = lot.attributes;
    const size_t first = lot.first;

    read_floats(b.r, a.position, 3, 0, b.mesh.positions + first * 3, b.where + ".POSITION");
    if (a.normal >= 0)
        read_floats(b.r, a.normal, 3, 0, b.mesh.normals + first * 3, b.where + ".NORMAL");
    if (a.tangent >= 0)
        read_floats(b.r, a.tangent, 4, 1, b.mesh.tangents + first * 4, b.where + ".TANGENT");
    for (size_t set = 0; set < 2; set++)
        if (a.texcoord[set] >= 0)
            read_floats(b.r, a.texcoord[set], 2, 0, b.mesh.texcoords[set] + first * 2, b.where + ".TEXCOORD");
    if (a.colour >= 0)
        read_colours(b.r, a.colour, lot.count, b.mesh.colours + first * 4, b.where + ".COLOR_0");
    else if (b.mesh.colours)
        std::fill_n(b.mesh.colours + first * 4, size_t(lot.count) * 4, uint16_t(65535));
}

bool any(const builder &b, int vertex_attributes::*member)
{
    return std::any_of(b.lots.begin(), b.lots.end(),
                       [&](const vertex_lot &lot) { return lot.attributes.*member >= 0; });
}

void read_vertices(builder &b)
{
    const uint64_t count = uint64_t(b.lots.back().first) + b.lots.back().count;

    b.mesh.vertex_count = uint32_t(count);
    b.mesh.positions = reading::allocate<float>(b.r, b.where, count * 3);
    if (any(b, &vertex_attributes::normal))
        b.mesh.normals =
            reading::allocate<float>(b.r, b.where, count * 3); // zeros are replaced when the mesh is added
    if (b.mesh.normals && any(b, &vertex_attributes::tangent))
        b.mesh.tangents = reading::allocate<float>(b.r, b.where, count * 4);
    else
        for (vertex_lot &lot : b.lots)
            lot.attributes.tangent = -1; // glTF ignores tangents without normals
    for (size_t set = 0; set < 2; set++)
        if (std::any_of(b.lots.begin(), b.lots.end(),
                        [&](const vertex_lot &lot) { return lot.attributes.texcoord[set] >= 0; }))
            b.mesh.texcoords[set] = reading::allocate<float>(b.r, b.where, count * 2);
    if (any(b, &vertex_attributes::colour))
        b.mesh.colours = reading::allocate<uint16_t>(b.r, b.where, count * 4);
    for (const vertex_lot &lot : b.lots)
        read_lot(b, lot);
}

// Reads the joints of all vertices; vertices without joints follow the first one.
void read_joints(builder &b)
{
    std::vector<influences> of_lots;
    size_t used = 0, without = 0;

    for (const vertex_lot &lot : b.lots) {
        of_lots.push_back(read_influences(b.r, *lot.primitive, lot.count, b.where));
        used = std::max(used, of_lots.back().used);
        without += of_lots.back().stride == 0;
        b.shown.max_joint = std::max(b.shown.max_joint, of_lots.back().max_joint);
    }
    if (without > 0)
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "a skinned mesh has no joints or weights");
    if (used == 0)
        return;
    b.shown.has_joints = true;
    b.mesh.influence_count = uint32_t(used);
    b.mesh.joints = reading::allocate<uint16_t>(b.r, b.where, uint64_t(b.mesh.vertex_count) * used);
    b.mesh.joint_weights = reading::allocate<float>(b.r, b.where, uint64_t(b.mesh.vertex_count) * used);
    for (size_t i = 0; i < b.lots.size(); i++) {
        const influences &from = of_lots[i];
        for (size_t v = 0; v < b.lots[i].count; v++) {
            const size_t to = (b.lots[i].first + v) * used;
            if (from.stride == 0)
                b.mesh.joint_weights[to] = 1;
            for (size_t k = 0; k < std::min(from.stride, used); k++) {
                b.mesh.joints[to + k] = from.joints[v * from.stride + k];
                b.mesh.joint_weights[to + k] = from.weights[v * from.stride + k];
            }
        }
    }
}

void read_morphs(builder &b)
{
    std::vector<morph_lot> lots;

    for (const vertex_lot &lot : b.lots)
        lots.push_back({lot.primitive, lot.first, lot.count});
    b.shown.file_targets = read_targets(b.r, lots, b.mesh, b.where);
    b.shown.target_count = b.mesh.target_count;
    if (b.mesh.target_count == 0)
        return;
    b.weights = morph_weights(b.r, b.source.weights,
                              std::min<size_t>(b.source.weights.size(), b.mesh.target_count), b.where);
    b.mesh.weights = b.weights.data();
    b.mesh.weight_count = uint32_t(b.weights.size());
}

void build(builder &b)
{
    for (size_t i = 0; i < b.source.primitives.size(); i++)
        add_primitive(b, b.source.primitives[i], i);
    if (b.indices.empty())
        return;
    read_vertices(b);
    if (b.skinned)
        read_joints(b);
    read_morphs(b);
    b.mesh.name = b.source.name.c_str();
    b.mesh.where = b.where.c_str();
    b.mesh.triangle_count = uint32_t(b.indices.size() / 3);
    b.mesh.indices = reading::copy_of(b.indices);
    b.mesh.range_count = uint32_t(b.ranges.size());
    b.mesh.ranges = reading::copy_of(b.ranges);
    b.shown.id = import_add_mesh(b.r.scene, &b.mesh);
    check(b.r);
}
} // namespace

int attribute(const std::map<std::string, int> &attributes, const char *name)
{
    const auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

size_t vertex_count(reader &r, const tinygltf::Primitive &primitive, const std::string &where)
{
    const size_t vertices =
        accessor_count(r, attribute(primitive.attributes, "POSITION"), TINYGLTF_TYPE_VEC3, where + ".POSITION");

    if (attribute(primitive.attributes, "NORMAL") >= 0)
        accessor_count(r, attribute(primitive.attributes, "NORMAL"), TINYGLTF_TYPE_VEC3, where + ".NORMAL");
    for (const auto &entry : primitive.attributes) {
        const size_t count = accessor_count(r, entry.second, 0, where + "." + entry.first);
        if (count != vertices)
            fail(r, where, "%.40s has %zu elements, POSITION has %zu", entry.first.c_str(), count, vertices);
    }
    for (const auto &target : primitive.targets)
        for (const auto &entry : target)
            if (accessor_count(r, entry.second, 0, where + ".targets") != vertices)
                fail(r, where, "a morph target has another count than the %zu vertices", vertices);
    return vertices;
}

std::vector<uint32_t> corners_of(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                                 const std::string &where)
{
    std::vector<uint32_t> corners;

    if (primitive.indices < 0) {
        check_room(r, where, vertices, sizeof(uint32_t));
        corners.resize(vertices);
        for (size_t i = 0; i < vertices; i++)
            corners[i] = uint32_t(i);
        return corners;
    }
    corners = read_integers(r, primitive.indices, 1, where + ".indices");
    for (size_t i = 0; i < corners.size(); i++)
        if (corners[i] >= vertices)
            fail(r, where, "index %u (number %zu) is beyond the %zu vertices", corners[i], i, vertices);
    return corners;
}

uint32_t material_id(reader &r, const tinygltf::Primitive &primitive, const std::string &where)
{
    const int material = material_of(r, primitive);

    if (material >= 0 && size_t(material) >= r.material_ids.size())
        fail(r, where, "material %d does not exist", material);
    return material >= 0 ? r.material_ids[size_t(material)] : 0;
}

void read_colours(reader &r, int accessor, size_t count, uint16_t *out, const std::string &where)
{
    const bool has_alpha = accessor_components(r, accessor, where) == 4;
    tinygltf::Accessor &from = r.model.accessors[size_t(accessor)];

    // Exporters forget to mark integers as normalised, which is their only meaning here (glTF 2.0, section
    // 3.7.2.1).
    from.normalized = from.normalized || from.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT;
    std::vector<float> colours(count * 4);

    read_floats(r, accessor, 4, 1, colours.data(), where);
    for (size_t i = 0; i < colours.size(); i++) {
        out[i] = reading::wide(i % 4 == 3 && !has_alpha ? 1 : colours[i]);
    }
}

const shown_mesh &mesh_of(reader &r, int mesh)
{
    if (size_t(mesh) >= r.model.meshes.size())
        fail(r, "nodes", "mesh %d does not exist; there are %zu", mesh, r.model.meshes.size());
    const auto found = r.meshes.find(mesh);
    if (found != r.meshes.end())
        return found->second;
    decode_draco(r, size_t(mesh));
    const tinygltf::Mesh &source = r.model.meshes[size_t(mesh)];
    builder b = {r, place("meshes", size_t(mesh)), source, r.skinned_meshes.count(mesh) > 0};
    build(b);
    b.shown.parts = add_points_and_lines(r, source, b.skinned, b.where);
    forget_draco(r);
    return r.meshes[mesh] = b.shown;
}
} // namespace gltf
