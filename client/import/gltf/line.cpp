// SPDX-License-Identifier: MIT
// Primitives of points and lines: spheres, as for points of other formats, and thin tubes, which rays can hit.
#include "reader.hpp"
#include "import/model/points.hpp"
#include "protocol/common/srgb.h"
#include "import/model/splats.hpp"
#include "import/model/tubes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace gltf
{
namespace
{
std::vector<float> places_of(reader &r, const tinygltf::Primitive &primitive, const std::string &where)
{
    const size_t count = vertex_count(r, primitive, where);

    check_room(r, where, count, 3 * sizeof(float));
    std::vector<float> places(count * 3);
    read_floats(r, attribute(primitive.attributes, "POSITION"), 3, 0, places.data(), where + ".POSITION");
    return places;
}

// Multiplies colours of vertices by the material's, in the form of points::cloud; empty: the vertices have none.
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

// Lists the ends of lines, two each.
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

void add_lines(tubes::set &t, reader &r, const tinygltf::Primitive &primitive, const std::string &where)
{
    const std::vector<float> places = places_of(r, primitive, where);
    const std::vector<uint32_t> ends = ends_of(r, primitive, places.size() / 3, where);
    const int accessor = attribute(primitive.attributes, "COLOR_0");
    std::vector<uint16_t> colours;

    if (accessor >= 0) {
        colours.resize(places.size() / 3 * 4);
        read_colours(r, accessor, places.size() / 3, colours.data(), where + ".COLOR_0");
    }
    tubes::add_lines(t, places, ends, colours, material_id(r, primitive, where), where);
}
} // namespace

std::vector<shown_part> add_points_and_lines(reader &r, const tinygltf::Mesh &source, bool skinned,
                                             const std::string &where)
{
    std::vector<shown_part> parts;
    std::vector<size_t> lines;
    tubes::set t = {r, where};
    tubes::box all;

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
        tubes::extend(all, places_of(r, primitive, here));
        t.has_colours = t.has_colours || attribute(primitive.attributes, "COLOR_0") >= 0;
        lines.push_back(i);
    }
    tubes::choose_radius(t, all, 1);
    for (size_t i : lines)
        add_lines(t, r, source.primitives[i], where + "." + place("primitives", i));
    const uint32_t id = tubes::add_mesh(t, source.name);
    if (id != 0)
        parts.push_back({PROTOCOL_NODE_MESH, id});
    return parts;
}
} // namespace gltf
