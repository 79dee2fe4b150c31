// SPDX-License-Identifier: MIT
// Primitives of points and lines: spheres, as of other formats' points, and thin tubes, which rays can hit.
#include "gltf.hpp"
#include "points.hpp"
#include "protocol/common/srgb.h"
#include "splats.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace gltf
{
namespace
{
constexpr uint32_t sides = 4, tube_vertices = 2 * sides, tube_triangles = 2 * sides + 2 * (sides - 2);
constexpr uint64_t tubes_max = 1u << 26;
constexpr uint64_t tube_bytes = tube_vertices * (6 * sizeof(float) + 4) + tube_triangles * 3 * sizeof(uint32_t);
constexpr double share_of_box = 200; // its diagonal, in diameters: three pixels of a picture that shows it all

using vector3 = std::array<double, 3>;
using place3 = std::array<float, 3>;

std::vector<float> places_of(reader &r, const tinygltf::Primitive &primitive, const std::string &where)
{
    const size_t count = vertex_count(r, primitive, where);

    check_room(r, where, count, 3 * sizeof(float));
    std::vector<float> places(count * 3);
    read_floats(r, attribute(primitive.attributes, "POSITION"), 3, 0, places.data(), where + ".POSITION");
    return places;
}

place3 place_at(const std::vector<float> &places, uint32_t vertex)
{
    return {places[size_t(vertex) * 3], places[size_t(vertex) * 3 + 1], places[size_t(vertex) * 3 + 2]};
}

bool is_usable(const place3 &p)
{
    return std::all_of(p.begin(), p.end(), [](float value) { return std::fabs(value) <= 1e12f; });
}

// Colours of vertices times that of the material, as points::cloud has them; empty: the vertices have none.
std::vector<float> point_colours(reader &r, const tinygltf::Primitive &primitive, size_t count,
                                 const std::string &where)
{
    const int accessor = attribute(primitive.attributes, "COLOR_0"), material = material_of(r, primitive);
    std::vector<double> factor = {1, 1, 1, 1};

    if (accessor < 0)
        return {};
    if (material >= 0 && r.model.materials[size_t(material)].pbrMetallicRoughness.baseColorFactor.size() == 4)
        factor = r.model.materials[size_t(material)].pbrMetallicRoughness.baseColorFactor;
    check_room(r, where, count, 7 * sizeof(float));
    std::vector<float> read(count * 4), colours(count * 3);
    read_floats(r, accessor, 4, 1, read.data(), where + ".COLOR_0");
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 3; c++) {
            const double linear = double(read[i * 4 + c]) * factor[c]; // NaN becomes 0
            colours[i * 3 + c] = srgb_from_linear_f(float(std::min(std::max(0.0, linear), 1.0)));
        }
    return colours;
}

uint32_t add_points(reader &r, const tinygltf::Primitive &primitive, const std::string &name,
                    const std::string &where)
{
    const std::vector<float> places = places_of(r, primitive, where);
    const std::vector<uint32_t> corners = corners_of(r, primitive, places.size() / 3, where);
    points::cloud cloud;

    cloud.material = material_id(r, primitive, where);
    if (corners.size() > points::points_max)
        fail(r, where, "%zu points; up to %u are allowed", corners.size(), points::points_max);
    const std::vector<float> colours = point_colours(r, primitive, places.size() / 3, where);
    check_room(r, where, corners.size(), 10 * sizeof(float));
    for (uint32_t corner : corners) {
        cloud.places.insert(cloud.places.end(), &places[size_t(corner) * 3], &places[size_t(corner) * 3] + 3);
        if (!colours.empty())
            cloud.colours.insert(cloud.colours.end(), &colours[size_t(corner) * 3],
                                 &colours[size_t(corner) * 3] + 3);
    }
    return points::add(r, cloud, name, where);
}

// ---- Gaussians

std::vector<float> floats_of(reader &r, const tinygltf::Primitive &primitive, const char *name, size_t count,
                             int components, const std::string &where)
{
    const std::string attribute_name = std::string("KHR_gaussian_splatting:") + name;
    const int accessor = attribute(primitive.attributes, attribute_name.c_str());
    std::vector<float> values(count * size_t(components));

    if (accessor < 0)
        fail(r, where, "Gaussians lack the attribute %s", attribute_name.c_str());
    read_floats(r, accessor, components, 0, values.data(), where + "." + attribute_name);
    return values;
}

uint32_t add_gaussians(reader &r, const tinygltf::Primitive &primitive, const tinygltf::Value &description,
                       const std::string &name, const std::string &where)
{
    const std::vector<float> places = places_of(r, primitive, where);
    const size_t count = places.size() / 3;
    splats::cloud cloud;

    check_room(r, where, count, 11 * sizeof(float) + sizeof(splats::gaussian));
    const std::vector<float> turns = floats_of(r, primitive, "ROTATION", count, 4, where),
                             scales = floats_of(r, primitive, "SCALE", count, 3, where),
                             opacities = floats_of(r, primitive, "OPACITY", count, 1, where),
                             colours = floats_of(r, primitive, "SH_DEGREE_0_COEF_0", count, 3, where);
    cloud.is_linear = text_of(description, "colorSpace").rfind("lin_", 0) == 0;
    for (size_t i = 0; i < count; i++) {
        splats::gaussian one = {};
        for (size_t c = 0; c < 3; c++) {
            one.place[c] = places[i * 3 + c];
            one.deviations[c] = scales[i * 3 + c];
            one.colour[c] = splats::colour_of(double(colours[i * 3 + c]));
        }
        std::copy_n(&turns[i * 4], 4, one.rotation.begin());
        one.opacity = opacities[i];
        cloud.all.push_back(one);
    }
    return splats::add(r, cloud, name, where);
}

// ---- lines

// Those of all primitives of a mesh.
struct tubes {
    reader &r;
    std::string where;
    double radius = 0;
    bool has_colours = false;
    std::vector<float> positions = {}, normals = {};
    std::vector<uint8_t> colours = {};
    std::vector<uint32_t> indices = {};
    std::vector<record_material_range> ranges = {};
};

// Ends of lines, two each.
std::vector<uint32_t> ends_of(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                              const std::string &where)
{
    std::vector<uint32_t> corners = corners_of(r, primitive, vertices, where), ends;

    if (primitive.mode == TINYGLTF_MODE_LINE) {
        corners.resize(corners.size() - corners.size() % 2);
        return corners;
    }
    check_room(r, where, corners.size(), 2 * sizeof(uint32_t));
    for (size_t i = 1; i < corners.size(); i++)
        ends.insert(ends.end(), {corners[i - 1], corners[i]});
    if (primitive.mode == TINYGLTF_MODE_LINE_LOOP && corners.size() > 2)
        ends.insert(ends.end(), {corners.back(), corners.front()});
    return ends;
}

vector3 cross(const vector3 &a, const vector3 &b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double length(const vector3 &a)
{
    return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

vector3 unit(const vector3 &a)
{
    return {a[0] / length(a), a[1] / length(a), a[2] / length(a)};
}

void add_corners(tubes &t, uint32_t first, std::initializer_list<uint32_t> corners)
{
    for (uint32_t corner : corners)
        t.indices.push_back(first + corner);
}

// A closed prism. Vertex 2 * side is at the line's begin, the next one at its end. False: the line has no length.
bool add_tube(tubes &t, const place3 &begin, const place3 &end)
{
    const vector3 way = {double(end[0]) - double(begin[0]), double(end[1]) - double(begin[1]),
                         double(end[2]) - double(begin[2])};
    if (!(length(way) > 0))
        return false;
    const vector3 axis = unit(way);
    const size_t smallest =
        size_t(std::min_element(axis.begin(), axis.end(),
                                [](double a, double b) { return std::fabs(a) < std::fabs(b); }) -
               axis.begin());
    vector3 other = {};
    other[smallest] = 1;
    const vector3 u = unit(cross(axis, other)), v = cross(axis, u);
    const uint32_t first = uint32_t(t.positions.size() / 3);
    const vector3 across[sides] = {u, v, {-u[0], -u[1], -u[2]}, {-v[0], -v[1], -v[2]}};

    for (const vector3 &outwards : across)
        for (const place3 &at : {begin, end})
            for (size_t c = 0; c < 3; c++) {
                t.positions.push_back(float(double(at[c]) + outwards[c] * t.radius));
                t.normals.push_back(float(outwards[c]));
            }
    for (uint32_t side = 0; side < sides; side++) {
        const uint32_t here = 2 * side, next = 2 * ((side + 1) % sides);
        add_corners(t, first, {here, next, next + 1, here, next + 1, here + 1});
    }
    for (uint32_t side = 2; side < sides; side++) {
        add_corners(t, first, {0, 2 * side, 2 * side - 2});
        add_corners(t, first, {1, 2 * side - 1, 2 * side + 1});
    }
    return true;
}

void add_lines(tubes &t, const tinygltf::Primitive &primitive, const std::string &where)
{
    const std::vector<float> places = places_of(t.r, primitive, where);
    const std::vector<uint32_t> ends = ends_of(t.r, primitive, places.size() / 3, where);
    const uint64_t count = t.positions.size() / 3 / tube_vertices + ends.size() / 2;
    const int accessor = attribute(primitive.attributes, "COLOR_0");
    const uint32_t first = uint32_t(t.indices.size() / 3);
    std::vector<uint8_t> colours;

    if (count > tubes_max)
        fail(t.r, where, "more than %llu lines", static_cast<unsigned long long>(tubes_max));
    check_room(t.r, where, count, tube_bytes);
    if (accessor >= 0) {
        colours.resize(places.size() / 3 * 4);
        read_colours(t.r, accessor, places.size() / 3, colours.data(), where + ".COLOR_0");
    }
    for (size_t i = 0; i < ends.size(); i += 2) {
        const place3 begin = place_at(places, ends[i]), end = place_at(places, ends[i + 1]);
        if (!is_usable(begin) || !is_usable(end) || !add_tube(t, begin, end)) {
            import_note(t.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "lines without length, or with NaN or infinity, are left out");
            continue;
        }
        for (size_t vertex = 0; vertex < tube_vertices && t.has_colours; vertex++)
            for (size_t c = 0; c < 4; c++)
                t.colours.push_back(colours.empty() ? 255 : colours[size_t(ends[i + vertex % 2]) * 4 + c]);
    }
    const uint32_t triangles = uint32_t(t.indices.size() / 3) - first;
    if (triangles > 0)
        t.ranges.push_back({first, triangles, material_id(t.r, primitive, where)});
}

uint32_t add_mesh(tubes &t, const std::string &name)
{
    import_mesh mesh = {};

    if (t.indices.empty())
        return 0;
    mesh.name = name.c_str();
    mesh.where = t.where.c_str();
    mesh.vertex_count = uint32_t(t.positions.size() / 3);
    mesh.triangle_count = uint32_t(t.indices.size() / 3);
    mesh.range_count = uint32_t(t.ranges.size());
    try {
        mesh.positions = reading::copy_of(t.positions);
        mesh.normals = reading::copy_of(t.normals);
        mesh.colours = reading::copy_of(t.colours);
        mesh.indices = reading::copy_of(t.indices);
        mesh.ranges = reading::copy_of(t.ranges);
    } catch (...) {
        import_mesh_finish(&mesh);
        throw;
    }
    const uint32_t id = import_add_mesh(t.r.scene, &mesh);
    check(t.r);
    import_note(t.r.scene, PROTOCOL_SEVERITY_INFO, t.where.c_str(),
                "%zu lines are shown as tubes of diameter %.3g; --point-size sets it",
                t.indices.size() / 3 / tube_triangles, 2 * t.radius);
    return id;
}

struct box {
    vector3 lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
};

void extend(box &of, const std::vector<float> &places)
{
    for (uint32_t vertex = 0; vertex < places.size() / 3; vertex++) {
        const place3 at = place_at(places, vertex);
        for (size_t c = 0; c < 3 && is_usable(at); c++) {
            of.lower[c] = std::min(of.lower[c], double(at[c]));
            of.upper[c] = std::max(of.upper[c], double(at[c]));
        }
    }
}

double diagonal(const box &of)
{
    return length({of.upper[0] - of.lower[0], of.upper[1] - of.lower[1], of.upper[2] - of.lower[2]});
}
} // namespace

std::vector<shown_part> add_points_and_lines(reader &r, const tinygltf::Mesh &source, bool skinned,
                                             const std::string &where)
{
    std::vector<shown_part> parts;
    std::vector<size_t> lines;
    tubes t = {r, where};
    box all;

    for (size_t i = 0; i < source.primitives.size(); i++) {
        const tinygltf::Primitive &primitive = source.primitives[i];
        const std::string here = where + "." + place("primitives", i);
        if (primitive.mode >= TINYGLTF_MODE_TRIANGLES)
            continue;
        if (attribute(primitive.attributes, "POSITION") < 0) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, here.c_str(),
                        "a primitive without positions is left out");
            continue;
        }
        if (skinned || !primitive.targets.empty())
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, here.c_str(),
                        "no skin and no morph target moves points and lines: they stay at rest");
        const tinygltf::Value *gaussians = extension(primitive.extensions, "KHR_gaussian_splatting");
        if (primitive.mode == TINYGLTF_MODE_POINTS && gaussians) {
            const uint32_t id = add_gaussians(r, primitive, *gaussians, source.name, here);
            if (id != 0)
                parts.push_back({PROTOCOL_NODE_MESH, id});
            continue;
        }
        if (primitive.mode == TINYGLTF_MODE_POINTS) {
            const uint32_t id = add_points(r, primitive, source.name, here);
            if (id != 0)
                parts.push_back({PROTOCOL_NODE_SPHERES, id});
            continue;
        }
        extend(all, places_of(r, primitive, here));
        t.has_colours = t.has_colours || attribute(primitive.attributes, "COLOR_0") >= 0;
        lines.push_back(i);
    }
    t.radius = (r.scene->point_size > 0 ? r.scene->point_size : diagonal(all) / share_of_box) / 2;
    for (size_t i : lines)
        add_lines(t, source.primitives[i], where + "." + place("primitives", i));
    const uint32_t id = add_mesh(t, source.name);
    if (id != 0)
        parts.push_back({PROTOCOL_NODE_MESH, id});
    return parts;
}
} // namespace gltf
