// SPDX-License-Identifier: MIT
// 3D Gaussians (3DGS): a body each, out to where its opacity falls to a limit.
#include "splats.hpp"
#include "protocol/common/srgb.h"

#include <algorithm>
#include <cmath>

namespace splats
{
namespace
{
// An octahedron: bodies of few triangles, as files have millions of Gaussians.
constexpr uint32_t corners = 6, faces = 8;
constexpr uint32_t face_corners[faces][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                             {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
constexpr size_t gaussians_max = 1u << 26;
// Gaussians fade without an end. Those of trained files that are fainter than this everywhere are haze; it is the
// limit of the viewer of Kerbl et al. (3D Gaussian Splatting. 2023) when it draws ellipsoids.
constexpr double opacity_min = 0.2;
// The square that an octahedron shows along an axis has then the area of the ellipse that it stands for.
constexpr double widening = 1.2533141373155; // sqrt(pi / 2)

// Columns: the axes, as long as the body reaches from its middle. False: it is left out.
bool axes_of(const gaussian &of, std::array<std::array<double, 3>, 3> &axes)
{
    const double x = double(of.rotation[0]), y = double(of.rotation[1]), z = double(of.rotation[2]),
                 w = double(of.rotation[3]), squared = x * x + y * y + z * z + w * w;
    const double opacity = std::min(double(of.opacity), 1.0), s = 2 / squared;

    if (!(opacity > opacity_min) || !(squared > 0) || !std::isfinite(s))
        return false;
    const double reach = widening * std::sqrt(2 * std::log(opacity / opacity_min));
    axes = {{{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)},
             {s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)},
             {s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}}};
    for (size_t i = 0; i < 3; i++)
        for (size_t c = 0; c < 3; c++) {
            axes[i][c] *= reach * double(of.deviations[i]);
            if (!(std::fabs(axes[i][c]) + std::fabs(double(of.place[c])) <= 1e12)) // NaN is left out as well
                return false;
        }
    return true;
}

void add_body(const gaussian &of, const std::array<std::array<double, 3>, 3> &axes, bool is_linear,
              reading::mesh_parts &out)
{
    const uint32_t first = uint32_t(out.positions.size() / 3);

    for (size_t corner = 0; corner < corners; corner++) {
        for (size_t c = 0; c < 3; c++)
            out.positions.push_back(float(double(of.place[c]) + (corner % 2 == 0 ? 1 : -1) * axes[corner / 2][c]));
        for (size_t c = 0; c < 3; c++) {
            const float value = std::min(std::max(0.0f, of.colour[c]), 1.0f); // NaN becomes 0
            out.colours.push_back(reading::wide(is_linear ? value : linear_from_srgb_f(value)));
        }
        out.colours.push_back(65535);
    }
    for (const auto &face : face_corners)
        for (uint32_t corner : face)
            out.indices.push_back(first + corner);
}

// Their light is in their colours.
uint32_t add_material(reading::base &r)
{
    message_set_material set;

    import_material_default(&set);
    set.name = "gaussians";
    set.value.unlit = 1;
    set.value.double_sided = 1;
    const uint32_t id = import_add_material(r.scene, &set);
    check(r);
    return id;
}
} // namespace

float colour_of(double coefficient)
{
    return float(0.5 + 0.28209479177387814 * coefficient);
}

uint32_t add(reading::base &r, const cloud &from, const std::string &name, const std::string &where)
{
    reading::mesh_parts mesh;
    std::array<std::array<double, 3>, 3> axes;

    if (from.all.size() > gaussians_max)
        fail(r, where, "%zu Gaussians; up to %zu are allowed", from.all.size(), gaussians_max);
    check_room(r, where, from.all.size(), corners * 20 + faces * 12);
    for (const gaussian &one : from.all)
        if (axes_of(one, axes))
            add_body(one, axes, from.is_linear, mesh);
    const size_t shown = mesh.positions.size() / 3 / corners;
    import_note(
        r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
        "3D Gaussians (3DGS) are not blended: each is shown as a body out to where its opacity is %.1f, in "
        "its colour straight on; %zu of %zu are fainter, or broken, and left out",
        opacity_min, from.all.size() - shown, from.all.size());
    if (shown == 0)
        return 0;
    mesh.ranges = {{0, uint32_t(shown * faces), add_material(r)}};
    return reading::add_mesh(r, mesh, name, where);
}
} // namespace splats
