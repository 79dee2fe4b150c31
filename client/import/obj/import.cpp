// SPDX-License-Identifier: MIT
// Wavefront OBJ through tinyobjloader's callbacks: the library splits lines into numbers, everything else happens
// here. One mesh for the whole file; triangles sorted by material.
#include "import.h"
#include "reader.hpp"

#include "import/model/origin.h"
#include "import/model/points.hpp"
#include "protocol/common/srgb.h"
#include "import/model/tubes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>

namespace obj
{
namespace
{
constexpr uint32_t none = UINT32_MAX;
constexpr size_t corners_max = 1u << 30;

struct triple {
    uint32_t v, vt, vn;
};

// Hash table with open addressing: the file's (v, vt, vn) to the vertex's number.
class vertex_table
{
  public:
    uint32_t find_or_add(const triple &key, bool shared)
    {
        if (triples.size() * 2 >= slots.size())
            grow();
        if (!shared) {
            triples.push_back(key);
            return uint32_t(triples.size() - 1);
        }
        size_t at = hash(key) & (slots.size() - 1);
        for (; slots[at] != none; at = (at + 1) & (slots.size() - 1))
            if (memcmp(&triples[slots[at]], &key, sizeof(key)) == 0)
                return slots[at];
        slots[at] = uint32_t(triples.size());
        triples.push_back(key);
        return slots[at];
    }
    std::vector<triple> triples;

  private:
    std::vector<uint32_t> slots;

    static size_t hash(const triple &key)
    {
        uint64_t h = key.v * 0x9e3779b97f4a7c15ull;
        h = (h ^ (h >> 29) ^ key.vt) * 0xbf58476d1ce4e5b9ull;
        h = (h ^ (h >> 32) ^ key.vn) * 0x94d049bb133111ebull;
        return size_t(h ^ (h >> 31));
    }
    void grow()
    {
        slots.assign(std::max<size_t>(slots.size() * 2, 1024), none);
        for (size_t i = 0; i < triples.size(); i++) {
            size_t at = hash(triples[i]) & (slots.size() - 1);
            while (slots[at] != none)
                at = (at + 1) & (slots.size() - 1);
            slots[at] = uint32_t(i);
        }
    }
};

struct state {
    reader &r;
    const prepared &text;
    memory_stream &stream;
    std::vector<float> positions, texcoords, normals;
    vertex_table vertices;
    std::vector<uint32_t> indices, names; // for each triangle: index in material_names
    std::vector<std::string> material_names;
    std::map<std::string, uint32_t> name_numbers;
    uint32_t name = none;
    uint64_t budget = POLYGON_BUDGET;
    bool failed = false; // instead of exceptions, which would pass through the library's frames
    std::vector<uint32_t> corners, triangles;
    std::vector<float> corner_positions;
};

template <typename body> void guarded(void *user, body action)
{
    state &s = *static_cast<state *>(user);
    if (s.failed)
        return;
    try {
        action(s);
    } catch (...) {
        import_fail(s.r.scene, nullptr, "out of memory");
        s.failed = true;
    }
}

void fail_at_line(state &s, const char *what, int64_t index, size_t count)
{
    import_fail(s.r.scene, s.stream.place().c_str(), "%s %lld does not exist; there are %zu so far", what,
                static_cast<long long>(index), count);
    s.failed = true;
}

// Resolves an index from 1 on, or backwards from -1; 0 is 'none' where that is allowed.
bool resolve(state &s, int index, size_t count, const char *what, uint32_t &out)
{
    const int64_t at = index > 0 ? int64_t(index) - 1 : int64_t(count) + index;
    if (index == 0 || at < 0 || at >= int64_t(count)) {
        fail_at_line(s, what, index, count);
        return false;
    }
    out = uint32_t(at);
    return true;
}

bool add_corner(state &s, const tinyobj::index_t &index)
{
    triple key = {none, none, none};

    if (!resolve(s, index.vertex_index, s.positions.size() / 3, "vertex", key.v))
        return false;
    if (index.texcoord_index != 0 &&
        !resolve(s, index.texcoord_index, s.texcoords.size() / 2, "texture coordinate", key.vt))
        return false;
    if (index.normal_index != 0 && !resolve(s, index.normal_index, s.normals.size() / 3, "normal", key.vn))
        return false;
    // A corner without a normal in a file with normals is flat and gets its own vertex.
    s.corners.push_back(s.vertices.find_or_add(key, key.vn != none || s.normals.empty()));
    const float *position = &s.positions[size_t(key.v) * 3];
    s.corner_positions.insert(s.corner_positions.end(), position, position + 3);
    return true;
}

void add_face(state &s, const tinyobj::index_t *indices, int count)
{
    s.corners.clear();
    s.corner_positions.clear();
    if (count < 3) {
        import_note(s.r.scene, PROTOCOL_SEVERITY_WARNING, s.stream.place().c_str(),
                    "a face with less than three corners is left out");
        return;
    }
    for (int i = 0; i < count; i++)
        if (!add_corner(s, indices[i]))
            return;
    if (s.indices.size() + size_t(count) * 3 > corners_max) {
        import_fail(s.r.scene, s.stream.place().c_str(), "more triangles than %zu", corners_max / 3);
        s.failed = true;
        return;
    }
    s.triangles.resize(size_t(count - 2) * 3);
    if (!polygon_triangulate(s.corner_positions.data(), uint32_t(count), s.triangles.data(), &s.budget))
        import_note(s.r.scene, PROTOCOL_SEVERITY_WARNING, s.stream.place().c_str(),
                    "a twisted polygon may look wrong");
    for (uint32_t corner : s.triangles)
        s.indices.push_back(s.corners[corner]);
    s.names.insert(s.names.end(), size_t(count - 2), s.name);
}

uint32_t name_number(state &s, const char *text)
{
    std::string name = text;
    while (!name.empty() && (name.back() == ' ' || name.back() == '\t'))
        name.pop_back();
    const auto found = s.name_numbers.find(name);
    if (found != s.name_numbers.end())
        return found->second;
    s.material_names.push_back(name);
    return s.name_numbers[name] = uint32_t(s.material_names.size() - 1);
}

void add_position(state &s, std::array<float, 3> place)
{
    const size_t at = s.positions.size();

    for (size_t c = 0; at + c < s.text.places.size() && c < 3; c++)
        place[c] = float(s.text.places[at + c] - s.text.origin[c]);
    s.positions.insert(s.positions.end(), place.begin(), place.end());
}

tinyobj::callback_t callbacks()
{
    tinyobj::callback_t all;
    all.vertex_cb = [](void *user, float x, float y, float z, float) {
        guarded(user, [&](state &s) { add_position(s, {x, y, z}); });
    };
    all.normal_cb = [](void *user, float x, float y, float z) {
        guarded(user, [&](state &s) { s.normals.insert(s.normals.end(), {x, y, z}); });
    };
    all.texcoord_cb = [](void *user, float u, float v, float) {
        guarded(user, [&](state &s) { s.texcoords.insert(s.texcoords.end(), {u, v}); });
    };
    all.index_cb = [](void *user, tinyobj::index_t *indices, int count) {
        guarded(user, [&](state &s) { add_face(s, indices, count); });
    };
    all.usemtl_cb = [](void *user, const char *name, int) {
        guarded(user, [&](state &s) { s.name = name_number(s, name); });
    };
    return all;
}

template <typename type> type *allocate(size_t count)
{
    void *memory = calloc(std::max<size_t>(count, 1), sizeof(type));
    if (!memory)
        throw std::bad_alloc();
    return static_cast<type *>(memory);
}

uint16_t linear(float srgb)
{
    return reading::wide(linear_from_srgb_f(std::min(std::max(0.0f, srgb), 1.0f))); // NaN becomes 0
}

// Fills the arrays of the mesh, with a vertex for each triple. OBJ's v points upwards, ours downwards.
void fill_mesh(const state &s, const std::vector<float> &colours, import_mesh &mesh)
{
    const std::vector<triple> &triples = s.vertices.triples;
    const size_t count = triples.size();

    mesh.vertex_count = uint32_t(count);
    mesh.triangle_count = uint32_t(s.indices.size() / 3);
    mesh.positions = allocate<float>(count * 3);
    mesh.indices = allocate<uint32_t>(s.indices.size());
    memcpy(mesh.indices, s.indices.data(), s.indices.size() * sizeof(uint32_t));
    if (std::any_of(triples.begin(), triples.end(), [](const triple &t) { return t.vn != none; }))
        mesh.normals = allocate<float>(count * 3);
    if (std::any_of(triples.begin(), triples.end(), [](const triple &t) { return t.vt != none; }))
        mesh.texcoords[0] = allocate<float>(count * 2);
    if (!colours.empty())
        mesh.colours = allocate<uint16_t>(count * 4);
    for (size_t i = 0; i < count; i++) {
        const triple &t = triples[i];
        memcpy(mesh.positions + i * 3, &s.positions[size_t(t.v) * 3], 12);
        if (t.vn != none)
            memcpy(mesh.normals + i * 3, &s.normals[size_t(t.vn) * 3], 12);
        if (t.vt != none) {
            mesh.texcoords[0][i * 2] = s.texcoords[size_t(t.vt) * 2];
            mesh.texcoords[0][i * 2 + 1] = 1 - s.texcoords[size_t(t.vt) * 2 + 1];
        }
        for (size_t c = 0; mesh.colours && c < 4; c++)
            mesh.colours[i * 4 + c] = c < 3 ? linear(colours[size_t(t.v) * 3 + c]) : 65535;
    }
}

// Identifiers of the materials that faces use; 0 for undefined ones.
std::vector<uint32_t> material_ids(state &s, const std::vector<std::string> &libraries)
{
    const std::vector<tinyobj::material_t> materials = read_libraries(s.r, libraries);
    std::map<std::string, const tinyobj::material_t *> defined;
    std::vector<const tinyobj::material_t *> wanted;

    for (const tinyobj::material_t &material : materials)
        defined.emplace(material.name, &material);
    for (const std::string &name : s.material_names) {
        const auto found = defined.find(name);
        if (found == defined.end())
            import_note(s.r.scene, PROTOCOL_SEVERITY_WARNING, nullptr, "the material '%.100s' is not defined",
                        name.c_str());
        wanted.push_back(found == defined.end() ? nullptr : found->second);
    }
    const auto read_image = [&](const std::string &name, size_t *size_bytes, char *reason) {
        return files_read_image(s.r.files, s.r.scene, name.c_str(), size_bytes, reason);
    };
    return add_materials(s.r.scene, read_image, wanted);
}

// The node at the origin of the positions.
uint32_t parent_of(const state &s)
{
    return s.text.places.empty() ? 0 : import_add_origin_node(s.r.scene, s.text.origin, 0);
}

void add_node(state &s, protocol_node_kind kind, uint32_t object, uint32_t parent)
{
    message_set_node set = {};

    set.value.object = object;
    set.value.kind = kind;
    set.name = s.r.scene->file;
    set.value.parent = parent;
    import_identity(set.value.parent_from_node);
    if (object != 0)
        import_add_node(s.r.scene, &set);
}

void add_lines(state &s, const std::vector<uint32_t> &ids, const std::vector<float> &colours, uint32_t parent)
{
    reading::base r = {s.r.scene};
    tubes::set t = {r, ""};
    tubes::box all;
    std::vector<float> used;
    std::vector<uint16_t> linears;

    for (const line_run &run : s.text.lines)
        for (uint32_t end : run.ends) {
            if (end >= s.positions.size() / 3) // the library may see fewer vertices than our own scan of the text
                reading::fail(r, "", "a line has the vertex %u, but there are %zu", end + 1,
                              s.positions.size() / 3);
            used.insert(used.end(), &s.positions[size_t(end) * 3], &s.positions[size_t(end) * 3] + 3);
        }
    tubes::extend(all, used);
    tubes::choose_radius(t, all, 1);
    t.has_colours = !colours.empty();
    for (size_t i = 0; i < colours.size(); i++) {
        linears.push_back(linear(colours[i]));
        if (i % 3 == 2)
            linears.push_back(65535);
    }
    for (const line_run &run : s.text.lines)
        tubes::add_lines(t, s.positions, run.ends, linears,
                         run.material.empty() ? 0 : ids[name_number(s, run.material.c_str())], "");
    add_node(s, PROTOCOL_NODE_MESH, tubes::add_mesh(t, s.r.scene->file), parent);
}

void add_faces_and_lines(state &s, const prepared &text)
{
    for (const line_run &run : text.lines)
        if (!run.material.empty())
            name_number(s, run.material.c_str());
    const std::vector<uint32_t> ids = material_ids(s, text.libraries);
    std::vector<uint32_t> materials(s.names.size());
    import_mesh mesh = {};

    if (s.r.scene->failed)
        return;
    const uint32_t parent = parent_of(s);
    if (!text.lines.empty())
        add_lines(s, ids, text.colours, parent);
    if (s.indices.empty())
        return;
    for (size_t i = 0; i < materials.size(); i++)
        materials[i] = s.names[i] == none ? 0 : ids[s.names[i]];
    try {
        fill_mesh(s, text.colours, mesh);
    } catch (...) {
        import_mesh_finish(&mesh);
        throw;
    }
    mesh.name = s.r.scene->file;
    import_add_grouped_mesh(s.r.scene, parent, &mesh, materials.data());
}

void add_points(state &s, prepared &text)
{
    reading::base r = {s.r.scene};
    points::cloud cloud;

    cloud.places = std::move(s.positions);
    cloud.colours = std::move(text.colours);
    const uint32_t object = points::add(r, cloud, s.r.scene->file, "");
    add_node(s, PROTOCOL_NODE_SPHERES, object, parent_of(s));
}

void import(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    prepared text = prepare(r, bytes, size_bytes);
    if (r.scene->failed)
        return;
    memory_stream stream(text.begin(), text.size_bytes());
    state s = {r, text, stream, {}, {}, {}, {}, {}, {}, {}, {}, none, POLYGON_BUDGET, false, {}, {}, {}};
    std::istream input(&stream);
    std::string warning, error;

    tinyobj::LoadObjWithCallback(input, callbacks(), &s, nullptr, &warning, &error);
    if (r.scene->failed)
        return;
    text.colours.resize(text.colours.empty() ? 0 : s.positions.size(), 1);
    if (s.indices.empty() && text.lines.empty() && !s.positions.empty()) {
        add_points(s, text);
        return;
    }
    if (s.indices.empty() && text.lines.empty()) {
        import_fail(r.scene, nullptr, "it contains no faces");
        return;
    }
    if (text.has_points)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, nullptr, "points beside faces or lines cannot be shown");
    add_faces_and_lines(s, text);
}
} // namespace
} // namespace obj

extern "C" bool obj_import(struct import_scene *scene, struct files *files, const unsigned char *bytes,
                           size_t size_bytes)
{
    return reading::run(scene, "out of memory", [&] {
        obj::reader r = {scene, files};
        obj::import(r, bytes, size_bytes);
    });
}
