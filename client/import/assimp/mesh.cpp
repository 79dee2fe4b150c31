// SPDX-License-Identifier: MIT
// Meshes. The library splits meshes by material; those of a node that nothing deforms are joined again, with a
// range of triangles for each, so that a body with several materials stays closed.
#include "reader.hpp"
#include "import/model/points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace assimp
{
namespace
{
constexpr uint64_t vertices_max = 1u << 29, corners_max = 1u << 30;

struct builder {
    reader &r;
    std::string where;
    std::vector<const aiMesh *> sources;
    import_mesh mesh = {};
    std::vector<uint32_t> indices = {}, triangles = {};
    std::vector<float> corners = {};
    std::vector<record_material_range> ranges = {};
    std::vector<record_morph_weight> weights = {};

    ~builder()
    {
        import_mesh_finish(&mesh);
    }
};

// ---- triangles

void add_face(builder &b, const aiMesh &from, const aiFace &face, uint32_t first)
{
    if (face.mNumIndices > POLYGON_CORNERS_MAX)
        fail(b.r, b.where, "a polygon of %u corners; 3 to %u are allowed", face.mNumIndices, POLYGON_CORNERS_MAX);
    for (unsigned i = 0; i < face.mNumIndices; i++)
        if (face.mIndices[i] >= from.mNumVertices)
            fail(b.r, b.where, "index %u is beyond the %u vertices", face.mIndices[i], from.mNumVertices);
    if (face.mNumIndices < 3) {
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "points and lines beside faces cannot be shown");
        return;
    }
    if (b.indices.size() + size_t(face.mNumIndices) * 3 > corners_max)
        fail(b.r, b.where, "more triangles than %llu", static_cast<unsigned long long>(corners_max / 3));
    if (face.mNumIndices == 3) {
        for (unsigned i = 0; i < 3; i++)
            b.indices.push_back(first + face.mIndices[i]);
        return;
    }
    b.corners.clear();
    for (unsigned i = 0; i < face.mNumIndices; i++) {
        const aiVector3D &v = from.mVertices[face.mIndices[i]];
        b.corners.insert(b.corners.end(), {v.x, v.y, v.z});
    }
    b.triangles.resize(size_t(face.mNumIndices - 2) * 3);
    if (!polygon_triangulate(b.corners.data(), face.mNumIndices, b.triangles.data(), &b.r.budget))
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(), "a twisted polygon may look wrong");
    for (uint32_t corner : b.triangles)
        b.indices.push_back(first + face.mIndices[corner]);
}

void add_faces(builder &b, const aiMesh &from, uint32_t first)
{
    const uint32_t before = uint32_t(b.indices.size() / 3);

    for (unsigned i = 0; i < from.mNumFaces; i++)
        add_face(b, from, from.mFaces[i], first);
    const uint32_t material =
        from.mMaterialIndex < b.r.material_ids.size() ? b.r.material_ids[from.mMaterialIndex] : 0;
    const uint32_t count = uint32_t(b.indices.size() / 3) - before;
    if (count > 0)
        b.ranges.push_back({before, count, material});
}

// ---- vertices

template <typename predicate> bool any(const builder &b, predicate has)
{
    return std::any_of(b.sources.begin(), b.sources.end(), [&](const aiMesh *from) { return has(*from); });
}

void read_vectors(const aiVector3D *from, unsigned count, float *to)
{
    for (unsigned i = 0; from && i < count; i++, to += 3) {
        to[0] = from[i].x;
        to[1] = from[i].y;
        to[2] = from[i].z;
    }
}

// The value of full intensity: PLY files with floats have 1, or 255.
float full_colour(const reader &r, const aiMesh &from)
{
    const aiColor4D *colours = from.mColors[0];
    const bool is_ply = strcmp(r.format->ending, ".ply") == 0;

    return is_ply && colours &&
                   std::any_of(colours, colours + from.mNumVertices,
                               [](const aiColor4D &one) { return one.r > 1 || one.g > 1 || one.b > 1; })
               ? 255
               : 1;
}

void read_colours(const aiColor4D *from, unsigned count, float full, uint16_t *to)
{
    for (unsigned i = 0; i < count; i++)
        for (unsigned c = 0; c < 4; c++) {
            const float value = !from   ? 1
                                : c < 3 ? linear(from[i][c] / full)
                                        : std::min(std::max(from[i].a, 0.0f), 1.0f);
            to[size_t(i) * 4 + c] = reading::wide(value);
        }
}

// The library's v points upwards, ours downwards.
void read_texcoords(const aiVector3D *from, unsigned count, float *to)
{
    for (unsigned i = 0; from && i < count; i++) {
        to[size_t(i) * 2] = from[i].x;
        to[size_t(i) * 2 + 1] = 1 - from[i].y;
    }
}

void read_vertices(builder &b, uint64_t count)
{
    import_mesh &mesh = b.mesh;
    size_t first = 0;

    mesh.vertex_count = uint32_t(count);
    mesh.positions = reading::allocate<float>(b.r, b.where, count * 3);
    if (any(b, [](const aiMesh &from) { return from.mNormals != nullptr; }))
        mesh.normals =
            reading::allocate<float>(b.r, b.where, count * 3); // zeros are replaced when the mesh is added
    for (size_t set = 0; set < (b.r.uses_second_texcoords ? 2 : 1); set++)
        if (any(b, [&](const aiMesh &from) { return from.mTextureCoords[set] != nullptr; }))
            mesh.texcoords[set] = reading::allocate<float>(b.r, b.where, count * 2);
    if (any(b, [](const aiMesh &from) { return from.mColors[0] != nullptr; }))
        mesh.colours = reading::allocate<uint16_t>(b.r, b.where, count * 4);
    for (const aiMesh *from : b.sources) {
        read_vectors(from->mVertices, from->mNumVertices, mesh.positions + first * 3);
        if (mesh.normals)
            read_vectors(from->mNormals, from->mNumVertices, mesh.normals + first * 3);
        for (size_t set = 0; set < 2; set++)
            if (mesh.texcoords[set])
                read_texcoords(from->mTextureCoords[set], from->mNumVertices, mesh.texcoords[set] + first * 2);
        if (mesh.colours)
            read_colours(from->mColors[0], from->mNumVertices, full_colour(b.r, *from), mesh.colours + first * 4);
        first += from->mNumVertices;
    }
}

// ---- morph targets: the library has whole shapes, ours are offsets

void read_target(const aiVector3D *base, const aiVector3D *shape, unsigned count, float *to)
{
    for (unsigned i = 0; base && shape && i < count; i++, to += 3)
        for (unsigned c = 0; c < 3; c++)
            to[c] = shape[i][c] - base[i][c];
}

void read_targets(builder &b, const aiMesh &from)
{
    const uint32_t count = std::min<uint32_t>(from.mNumAnimMeshes, IMPORT_TARGETS_MAX);
    const uint64_t vectors = uint64_t(from.mNumVertices) * count;
    bool has_normals = false;

    if (from.mNumAnimMeshes > count)
        import_note(b.r.scene, PROTOCOL_SEVERITY_WARNING, b.where.c_str(),
                    "the first %u of %u morph targets were kept", count, from.mNumAnimMeshes);
    for (uint32_t i = 0; i < count; i++) {
        if (!from.mAnimMeshes[i] || from.mAnimMeshes[i]->mNumVertices != from.mNumVertices)
            fail(b.r, b.where, "a morph target has another count than the %u vertices", from.mNumVertices);
        has_normals = has_normals || (from.mNormals && from.mAnimMeshes[i]->mNormals);
    }
    b.mesh.target_count = count;
    b.mesh.target_offsets[0] = reading::allocate<float>(b.r, b.where, vectors * 3);
    if (has_normals)
        b.mesh.target_offsets[1] = reading::allocate<float>(b.r, b.where, vectors * 3);
    for (uint32_t i = 0; i < count; i++) {
        const aiAnimMesh &shape = *from.mAnimMeshes[i];
        const size_t first = size_t(i) * from.mNumVertices * 3;
        read_target(from.mVertices, shape.mVertices, from.mNumVertices, b.mesh.target_offsets[0] + first);
        if (has_normals)
            read_target(from.mNormals, shape.mNormals, from.mNumVertices, b.mesh.target_offsets[1] + first);
        const float weight = shape.mWeight;
        // FBX in this library starts with every target at its full weight, whatever the file says.
        b.weights.push_back({std::isfinite(weight) && strcmp(b.r.format->ending, ".fbx") != 0
                                 ? std::min(std::max(weight, -1e6f), 1e6f)
                                 : 0});
    }
    b.mesh.weights = b.weights.data();
    b.mesh.weight_count = count;
}

shown_mesh build(builder &b, const std::vector<unsigned> &places)
{
    shown_mesh shown;
    uint64_t count = 0;

    for (const aiMesh *from : b.sources) {
        if (count + from->mNumVertices > vertices_max)
            fail(b.r, b.where, "more than %llu vertices", static_cast<unsigned long long>(vertices_max));
        add_faces(b, *from, uint32_t(count));
        count += from->mNumVertices;
    }
    if (b.indices.empty())
        return shown;
    read_vertices(b, count);
    if (b.sources.size() == 1 && has_skin(*b.sources[0]))
        shown.skin = read_skin(b.r, places[0], b.mesh, b.where);
    if (b.sources.size() == 1 && b.sources[0]->mNumAnimMeshes > 0)
        read_targets(b, *b.sources[0]);
    shown.target_count = b.mesh.target_count;
    const std::string name = text(b.sources[0]->mName);
    b.mesh.name = name.c_str();
    b.mesh.where = b.where.c_str();
    b.mesh.triangle_count = uint32_t(b.indices.size() / 3);
    b.mesh.indices = reading::copy_of(b.indices);
    b.mesh.range_count = uint32_t(b.ranges.size());
    b.mesh.ranges = reading::copy_of(b.ranges);
    shown.id = import_add_mesh(b.r.scene, &b.mesh);
    check(b.r);
    return shown;
}

// ---- points

shown_mesh add_points(reader &r, const aiMesh &from, const std::string &where)
{
    points::cloud cloud;
    shown_mesh shown;

    if (from.mNumVertices > points::points_max)
        fail(r, where, "%u points; up to %u are allowed", from.mNumVertices, points::points_max);
    check_room(r, where, from.mNumVertices, 10 * sizeof(float)); // each point with its sphere
    const float full = full_colour(r, from);
    for (unsigned i = 0; i < from.mNumVertices; i++) {
        const aiVector3D &place = from.mVertices[i];
        cloud.places.insert(cloud.places.end(), {place.x, place.y, place.z});
        if (from.mColors[0]) {
            const aiColor4D &colour = from.mColors[0][i];
            cloud.colours.insert(cloud.colours.end(), {colour.r / full, colour.g / full, colour.b / full});
        }
    }
    cloud.material = from.mMaterialIndex < r.material_ids.size() ? r.material_ids[from.mMaterialIndex] : 0;
    cloud.metres = r.metres;
    shown.kind = PROTOCOL_NODE_SPHERES;
    shown.id = points::add(r, cloud, text(from.mName), where);
    return shown;
}
} // namespace

bool is_point_cloud(const aiMesh &mesh)
{
    return mesh.mNumFaces == 0 || mesh.mPrimitiveTypes == aiPrimitiveType_POINT;
}

const shown_mesh &meshes_of(reader &r, const std::vector<unsigned> &places)
{
    const auto found = r.meshes.find(places);
    if (found != r.meshes.end())
        return found->second;
    builder b = {r, "meshes[" + std::to_string(places[0]) + "]", {}};
    for (unsigned place : places)
        b.sources.push_back(r.source->mMeshes[place]);
    const aiMesh &first = *b.sources[0];
    const bool is_cloud = places.size() == 1 && first.mNumVertices > 0 && is_point_cloud(first);
    return r.meshes[places] = is_cloud ? add_points(r, first, b.where) : build(b, places);
}
} // namespace assimp
