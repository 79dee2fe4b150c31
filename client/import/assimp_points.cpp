// SPDX-License-Identifier: MIT
// Points without faces: a sphere each.
#include "assimp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace assimp
{
namespace
{
constexpr uint32_t points_max = 1u << 27;
// Colours of spheres are those of materials: with 16 steps of each component there are never more of them than
// ranges in one set.
constexpr int steps = 16;
static_assert(steps * steps * steps <= IMPORT_RANGES_MAX, "one set has room for the ranges of all colours");

bool usable(const aiVector3D &p)
{
    return std::fabs(p.x) <= 1e12f && std::fabs(p.y) <= 1e12f && std::fabs(p.z) <= 1e12f;
}

// Median distance of some points to the nearest other one that is not at the same place; 0: there is none.
double spacing(const std::vector<aiVector3D> &points)
{
    constexpr uint64_t budget = 200000000; // distances: a fraction of a second
    const size_t samples = std::min<size_t>(
        points.size(), size_t(std::min<uint64_t>(std::max<uint64_t>(budget / points.size(), 8), 256)));
    std::vector<float> nearest;

    for (size_t s = 0; s < samples; s++) {
        const aiVector3D at = points[s * points.size() / samples];
        float least = std::numeric_limits<float>::infinity();
        for (const aiVector3D &other : points) {
            const float distance = (other - at).SquareLength();
            if (distance > 0)
                least = std::min(least, distance);
        }
        if (std::isfinite(least))
            nearest.push_back(least);
    }
    if (nearest.empty())
        return 0;
    std::nth_element(nearest.begin(), nearest.begin() + long(nearest.size() / 2), nearest.end());
    return std::sqrt(double(nearest[nearest.size() / 2]));
}

struct cell {
    std::array<double, 3> sum = {}; // linear light
    uint32_t count = 0;
};

unsigned cell_of(const aiColor4D &colour)
{
    unsigned at = 0;
    for (unsigned c = 0; c < 3; c++) {
        const float value = std::min(std::max(colour[c], 0.0f), 1.0f); // NaN becomes 0
        at = at * steps + unsigned(std::lround(value * (steps - 1)));
    }
    return at;
}

// A material for each colour that there is, the mean of those that are nearly the same.
std::vector<uint32_t> add_palette(reader &r, const std::vector<aiColor4D> &colours, uint32_t otherwise)
{
    std::vector<cell> cells(steps * steps * steps);
    std::vector<uint32_t> ids(cells.size(), otherwise);

    for (const aiColor4D &colour : colours) {
        cell &of = cells[cell_of(colour)];
        for (unsigned c = 0; c < 3; c++)
            of.sum[c] += double(linear(colour[c]));
        of.count++;
    }
    for (size_t i = 0; i < cells.size(); i++) {
        message_set_material set;
        if (cells[i].count == 0)
            continue;
        import_material_default(&set);
        set.name = "point";
        for (unsigned c = 0; c < 3; c++)
            set.base_colour[c] = std::min(float(cells[i].sum[c] / cells[i].count), 1.0f);
        ids[i] = import_add_material(r.scene, &set);
        check(r);
    }
    return ids;
}

// Counting sort by material, so that each has one range.
uint32_t add_set(reader &r, const std::vector<aiVector3D> &points, const std::vector<unsigned> &cells,
                 const std::vector<uint32_t> &materials, double radius, const char *name)
{
    std::vector<uint32_t> first(materials.size() + 1, 0);
    const uint32_t count = uint32_t(points.size());

    for (unsigned one : cells)
        first[one + 1]++;
    for (size_t i = 1; i < first.size(); i++)
        first[i] += first[i - 1];
    record_material_range *ranges =
        static_cast<record_material_range *>(calloc(materials.size(), sizeof(record_material_range)));
    float *spheres = static_cast<float *>(calloc(count, 4 * sizeof(float)));
    if (!ranges || !spheres) {
        free(ranges);
        free(spheres);
        throw std::bad_alloc();
    }
    uint32_t range_count = 0;
    for (size_t i = 0; i < materials.size(); i++)
        if (first[i + 1] > first[i])
            ranges[range_count++] = {first[i], first[i + 1] - first[i], materials[i]};
    for (uint32_t i = 0; i < count; i++) {
        float *to = spheres + size_t(first[cells[i]]++) * 4;
        to[0] = points[i].x;
        to[1] = points[i].y;
        to[2] = points[i].z;
        to[3] = float(radius);
    }
    return import_add_spheres(r.scene, name, spheres, count, ranges, range_count);
}
} // namespace

bool is_point_cloud(const aiMesh &mesh)
{
    return mesh.mNumFaces == 0 || mesh.mPrimitiveTypes == aiPrimitiveType_POINT;
}

shown_mesh add_points(reader &r, const aiMesh &from, const std::string &where)
{
    std::vector<aiVector3D> points;
    std::vector<aiColor4D> colours;
    std::vector<unsigned> cells;
    shown_mesh shown;

    if (from.mNumVertices > points_max)
        fail(r, where, "%u points; up to %u are allowed", from.mNumVertices, points_max);
    check_room(r, where, from.mNumVertices, 4 * sizeof(float));
    for (unsigned i = 0; i < from.mNumVertices; i++) {
        if (!usable(from.mVertices[i])) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "points that are NaN or infinite are left out");
            continue;
        }
        points.push_back(from.mVertices[i]);
        if (from.mColors[0])
            colours.push_back(from.mColors[0][i]);
    }
    if (points.empty())
        return shown;
    const double apart = r.point_size > 0 ? 0 : spacing(points);
    const double radius = r.point_size > 0 ? r.point_size / 2 / r.metres : apart > 0 ? apart : 0.5;
    const uint32_t plain = from.mMaterialIndex < r.material_ids.size() ? r.material_ids[from.mMaterialIndex] : 0;
    std::vector<uint32_t> materials = {plain};
    if (colours.empty()) {
        cells.assign(points.size(), 0);
    } else {
        materials = add_palette(r, colours, plain);
        for (const aiColor4D &colour : colours)
            cells.push_back(cell_of(colour));
    }
    shown.kind = PROTOCOL_NODE_SPHERES;
    shown.id = add_set(r, points, cells, materials, radius, text(from.mName).c_str());
    check(r);
    import_note(r.scene, PROTOCOL_SEVERITY_INFO, where.c_str(),
                "%zu points without faces are shown as spheres of diameter %.3g; --point-size sets it",
                points.size(), 2 * radius * r.metres);
    return shown;
}
} // namespace assimp
