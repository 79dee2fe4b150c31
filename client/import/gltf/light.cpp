// SPDX-License-Identifier: MIT
// Lights of KHR_lights_punctual. Candela become watts per steradian and lux watts per square metre with the same
// numbers: the renderer uses one unit throughout, and files are exposed correctly at exposure 0.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace gltf
{
namespace
{
constexpr double pi = 3.14159265358979;

// The extension knows only points. A point light whose "extras" have a "radius" (metres) becomes a sphere with the
// same intensity, which is its radiance times its visible disc.
void give_size(reader &r, const tinygltf::Light &light, const std::string &where, message_set_light &set)
{
    const double radius = number(light.extras, "radius", 0);

    if (!(radius > 0))
        return;
    set.value.kind = PROTOCOL_LIGHT_SPHERE;
    set.value.size[0] = limited(r, where, "the light's radius", radius, 1e-6, 1e12);
    for (float &one : set.value.colour)
        one = limited(r, where, "the light's radiance", double(one) / light_disc(light), 0, 1e12);
}

// ---- photometric files

struct light_place {
    int light;
    std::array<double, 3> at;
};

// Brightness of a white surface in the middle of the scene, relative to white.
double whiteness(const reader &r, const std::vector<light_place> &lights, const world_box &around)
{
    double extent2 = 0, sum = 0;

    for (size_t c = 0; c < 3; c++)
        extent2 += std::pow(around.upper[c] - around.lower[c], 2);
    for (const light_place &one : lights) {
        const tinygltf::Light &light = r.model.lights[size_t(one.light)];
        double distance2 = 0;
        for (size_t c = 0; c < 3; c++)
            distance2 += std::pow(one.at[c] - (around.lower[c] + around.upper[c]) / 2, 2);
        // A light within the scene counts as a quarter of its extent away.
        sum += light.type == "directional" ? light.intensity : light.intensity / std::max(distance2, extent2 / 16);
    }
    return sum / pi;
}
// Threshold above which intensities count as lumens: beyond models that are lit brightly on purpose (Khronos'
// LightsPunctualLamp is 61 times white), or little above white for exporters that write lumens by default.
double photometric_white(const reader &r)
{
    int major = 0, minor = 0;
    const bool is_blender =
        sscanf(r.model.asset.generator.c_str(), "Khronos glTF Blender I/O v%d.%d", &major, &minor) == 2;

    return is_blender && major * 100 + minor >= 306 ? 20 : 200;
}
} // namespace

double light_disc(const tinygltf::Light &light)
{
    const double radius = light.type == "point" ? number(light.extras, "radius", 0) : 0;

    if (!(radius > 0))
        return 1;
    const double allowed = std::min(std::max(radius, 1e-6), 1e12);
    return pi * allowed * allowed;
}

uint32_t light_id(reader &r, int index, const std::string &where)
{
    if (index < 0 || size_t(index) >= r.model.lights.size()) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "the light is left out: no light has its number");
        return 0;
    }
    const tinygltf::Light &light = r.model.lights[size_t(index)];
    const std::string here = place("KHR_lights_punctual.lights", size_t(index));
    message_set_light set = {};

    for (size_t c = 0; c < 3; c++)
        set.value.colour[c] = limited(r, here, "the light's colour",
                                      (light.color.size() == 3 ? light.color[c] : 1.0) * light.intensity, 0, 1e12);
    set.value.range = limited(r, here, "the light's range", light.range, 0, 1e12);
    set.name = light.name.c_str();
    if (light.type == "directional") {
        set.value.kind = PROTOCOL_LIGHT_DIRECTIONAL;
    } else if (light.type == "point") {
        set.value.kind = PROTOCOL_LIGHT_POINT;
        give_size(r, light, here, set);
    } else if (light.type == "spot") {
        set.value.kind = PROTOCOL_LIGHT_SPOT;
        set.value.outer_cone = limited(r, here, "the outer cone", light.spot.outerConeAngle, 0, 1.5707);
        set.value.inner_cone =
            limited(r, here, "the inner cone", light.spot.innerConeAngle, 0, double(set.value.outer_cone));
    } else {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, here.c_str(),
                    "a light of unknown type '%.32s' is left out", light.type.c_str());
        return 0;
    }
    const uint32_t id = import_add_light(r.scene, &set);
    r.light_ids[index].push_back(id);
    return id;
}

void convert_photometric_lights(reader &r, const std::vector<int> &roots)
{
    constexpr double lumens_per_watt = 683; // the factor of Blender's exporter
    std::vector<light_place> lights;

    if (r.model.lights.empty())
        return;
    const world_box around = box_of(r, roots, [&](const tinygltf::Node &node, const matrix &placed) {
        const tinygltf::Value *own = extension(node.extensions, "KHR_lights_punctual");
        const int light = own ? index_of(*own, "light") : -1;
        if (light >= 0 && size_t(light) < r.model.lights.size())
            lights.push_back({light, point_of(placed, {0, 0, 0})});
    });
    const double white = whiteness(r, lights, around); // 0 or NaN for a scene without meshes
    if (!(white > photometric_white(r) && white < 1e30))
        return;
    for (tinygltf::Light &light : r.model.lights)
        light.intensity /= lumens_per_watt;
    import_note(
        r.scene, PROTOCOL_SEVERITY_INFO, "KHR_lights_punctual",
        "the lights are in candela and lux, %.0f times white: they are divided by 683, the lumens of a watt; "
        "--exposure %.1f shows them as they were",
        white, std::log2(lumens_per_watt));
}
} // namespace gltf
