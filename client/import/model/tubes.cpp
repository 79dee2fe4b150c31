// SPDX-License-Identifier: MIT
// Lines as thin tubes, which rays can hit.
#include "tubes.hpp"

#include <algorithm>
#include <cstdlib>
#include <initializer_list>

namespace tubes
{
namespace
{
constexpr uint32_t sides = 4, tube_vertices = 2 * sides, tube_triangles = 2 * sides + 2 * (sides - 2);
constexpr uint64_t tubes_max = 1u << 26;
constexpr uint64_t tube_bytes = tube_vertices * (6 * sizeof(float) + 8) + tube_triangles * 3 * sizeof(uint32_t);
constexpr double share_of_box = 200; // its diagonal, in diameters: three pixels of a picture that shows it all

using place3 = std::array<float, 3>;

place3 place_at(const std::vector<float> &places, uint32_t vertex)
{
    return {places[size_t(vertex) * 3], places[size_t(vertex) * 3 + 1], places[size_t(vertex) * 3 + 2]};
}

bool is_usable(const place3 &p)
{
    return std::all_of(p.begin(), p.end(), [](float value) { return std::fabs(value) <= 1e12f; });
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

void add_corners(set &t, uint32_t first, std::initializer_list<uint32_t> corners)
{
    for (uint32_t corner : corners)
        t.mesh.indices.push_back(first + corner);
}

// A closed prism. Vertex 2 * side is at the line's begin, the next one at its end. False: the line has no length.
bool add_tube(set &t, const place3 &begin, const place3 &end)
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
    const uint32_t first = uint32_t(t.mesh.positions.size() / 3);
    const vector3 across[sides] = {u, v, {-u[0], -u[1], -u[2]}, {-v[0], -v[1], -v[2]}};

    for (const vector3 &outwards : across)
        for (const place3 &at : {begin, end})
            for (size_t c = 0; c < 3; c++) {
                t.mesh.positions.push_back(float(double(at[c]) + outwards[c] * t.radius));
                t.mesh.normals.push_back(float(outwards[c]));
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

double diagonal(const box &of)
{
    return length({of.upper[0] - of.lower[0], of.upper[1] - of.lower[1], of.upper[2] - of.lower[2]});
}
} // namespace

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

void choose_radius(set &t, const box &all, double metres)
{
    t.metres = metres;
    t.radius = (t.r.scene->point_size > 0 ? t.r.scene->point_size / metres : diagonal(all) / share_of_box) / 2;
}

void add_lines(set &t, const std::vector<float> &places, const std::vector<uint32_t> &ends,
               const std::vector<uint16_t> &colours, uint32_t material, const std::string &where)
{
    const uint64_t count = t.mesh.positions.size() / 3 / tube_vertices + ends.size() / 2;
    const uint32_t first = uint32_t(t.mesh.indices.size() / 3);

    if (count > tubes_max)
        fail(t.r, where, "more than %llu lines", static_cast<unsigned long long>(tubes_max));
    check_room(t.r, where, count, tube_bytes);
    for (size_t i = 0; i + 1 < ends.size(); i += 2) {
        const place3 begin = place_at(places, ends[i]), end = place_at(places, ends[i + 1]);
        if (!is_usable(begin) || !is_usable(end) || !add_tube(t, begin, end)) {
            import_note(t.r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "lines without length, or with NaN or infinity, are left out");
            continue;
        }
        for (size_t vertex = 0; vertex < tube_vertices && t.has_colours; vertex++)
            for (size_t c = 0; c < 4; c++)
                t.mesh.colours.push_back(colours.empty() ? 65535 : colours[size_t(ends[i + vertex % 2]) * 4 + c]);
    }
    const uint32_t triangles = uint32_t(t.mesh.indices.size() / 3) - first;
    if (triangles > 0)
        t.mesh.ranges.push_back({first, triangles, material});
}

uint32_t add_mesh(set &t, const std::string &name)
{
    if (t.mesh.indices.empty())
        return 0;
    const uint32_t id = reading::add_mesh(t.r, t.mesh, name, t.where);
    import_note(t.r.scene, PROTOCOL_SEVERITY_INFO, t.where.c_str(),
                "%zu lines are shown as tubes of diameter %.3g; --point-size sets it",
                t.mesh.indices.size() / 3 / tube_triangles, 2 * t.radius * t.metres);
    return id;
}

} // namespace tubes
