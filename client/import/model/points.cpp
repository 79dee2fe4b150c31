// SPDX-License-Identifier: MIT
// Points without faces: a sphere each.
#include "points.hpp"
#include "protocol/common/srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>

namespace points
{
namespace
{
// Spheres have their colours from materials: with 16 steps for each component there are never more of them than
// ranges in one set.
constexpr int steps = 16;
static_assert(steps * steps * steps <= IMPORT_RANGES_MAX, "one set has room for the ranges of all colours");

bool usable(const float *p)
{
    return std::fabs(p[0]) <= 1e12f && std::fabs(p[1]) <= 1e12f && std::fabs(p[2]) <= 1e12f;
}

// Median distance of some points to their nearest neighbour at another position; 0: there is none.
double spacing(const std::vector<float> &places)
{
    constexpr uint64_t budget = 200000000; // number of distances: a fraction of a second
    const size_t count = places.size() / 3;
    const size_t samples =
        std::min<size_t>(count, size_t(std::min<uint64_t>(std::max<uint64_t>(budget / count, 8), 256)));
    std::vector<float> nearest;

    for (size_t s = 0; s < samples; s++) {
        const float *at = &places[s * count / samples * 3];
        float least = std::numeric_limits<float>::infinity();
        for (size_t i = 0; i < count * 3; i += 3) {
            const float x = places[i] - at[0], y = places[i + 1] - at[1], z = places[i + 2] - at[2];
            const float distance = x * x + y * y + z * z;
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

unsigned cell_of(const float *colour)
{
    unsigned at = 0;
    for (unsigned c = 0; c < 3; c++) {
        const float value = std::min(std::max(0.0f, colour[c]), 1.0f); // NaN becomes 0
        at = at * steps + unsigned(std::lround(value * (steps - 1)));
    }
    return at;
}

// Adds a material for each existing colour, which is the mean of nearly equal ones.
std::vector<uint32_t> add_palette(reading::base &r, const std::vector<float> &colours, uint32_t otherwise)
{
    std::vector<cell> cells(steps * steps * steps);
    std::vector<uint32_t> ids(cells.size(), otherwise);

    for (size_t i = 0; i < colours.size(); i += 3) {
        cell &of = cells[cell_of(&colours[i])];
        for (unsigned c = 0; c < 3; c++) // NaN becomes 0
            of.sum[c] += double(linear_from_srgb_f(std::min(std::max(0.0f, colours[i + c]), 1.0f)));
        of.count++;
    }
    for (size_t i = 0; i < cells.size(); i++) {
        message_set_material set;
        if (cells[i].count == 0)
            continue;
        import_material_default(&set);
        set.name = "point";
        for (unsigned c = 0; c < 3; c++)
            set.value.base_colour[c] = std::min(float(cells[i].sum[c] / cells[i].count), 1.0f);
        ids[i] = import_add_material(r.scene, &set);
        check(r);
    }
    return ids;
}

// Counting sort by material, so that each material has one range.
uint32_t add_set(reading::base &r, const std::vector<float> &places, const std::vector<unsigned> &cells,
                 const std::vector<uint32_t> &materials, double radius, const char *name)
{
    std::vector<uint32_t> first(materials.size() + 1, 0);
    const uint32_t count = uint32_t(places.size() / 3);

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
        std::copy_n(&places[size_t(i) * 3], 3, to);
        to[3] = float(radius);
    }
    return import_add_spheres(r.scene, name, spheres, count, ranges, range_count);
}
} // namespace

uint32_t add(reading::base &r, const cloud &from, const std::string &name, const std::string &where)
{
    const bool has_colours = !from.colours.empty();
    const double diameter = r.scene->point_size;
    std::vector<float> places;
    std::vector<unsigned> cells;

    check_room(r, where, from.places.size() / 3, 4 * sizeof(float));
    for (size_t i = 0; i < from.places.size(); i += 3) {
        if (!usable(&from.places[i])) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                        "points that are NaN or infinite are left out");
            continue;
        }
        places.insert(places.end(), &from.places[i], &from.places[i] + 3);
        cells.push_back(has_colours ? cell_of(&from.colours[i]) : 0);
    }
    if (places.empty())
        return 0;
    const double apart = diameter > 0 ? 0 : spacing(places);
    const double radius = diameter > 0 ? diameter / 2 / from.metres : apart > 0 ? apart : 0.5;
    std::vector<uint32_t> materials = {from.material};
    if (has_colours)
        materials = add_palette(r, from.colours, from.material);
    const uint32_t id = add_set(r, places, cells, materials, radius, name.c_str());
    check(r);
    import_note(r.scene, PROTOCOL_SEVERITY_INFO, where.c_str(),
                "%zu points without faces are shown as spheres of diameter %.3g; --point-size sets it",
                places.size() / 3, 2 * radius * from.metres);
    return id;
}
} // namespace points
