// SPDX-License-Identifier: MIT
// EXT_mesh_gpu_instancing: transforms at which a node's mesh is shown, one for each element of three accessors.
// Other attributes are for shaders that know them.
#include "reader.hpp"

#include <algorithm>

namespace gltf
{
namespace
{
// Limit for all nodes together; one of our nodes takes some hundred bytes
constexpr size_t instances_max = 1u << 20;

// Reads an attribute with `components` numbers an instance; empty: it is missing.
std::vector<float> read_attribute(reader &r, const tinygltf::Value &attributes, const char *name, int components,
                                  size_t &count, const std::string &where)
{
    const std::string here = where + "." + name;
    std::vector<float> values;

    if (!attributes.Has(name))
        return values;
    const int accessor = index_of(attributes, name);
    const size_t found =
        accessor_count(r, accessor, components == 4 ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3, here);
    if (count != 0 && found != count)
        fail(r, here, "%zu instances, where another attribute has %zu", found, count);
    count = found;
    if (count > instances_max - std::min(r.instance_count, instances_max))
        fail(r, here, "more than %zu instances", instances_max);
    values.resize(count * size_t(components));
    read_floats(r, accessor, components, 0, values.data(), here);
    return values;
}

std::vector<double> part_of(const std::vector<float> &values, size_t instance, size_t components)
{
    if (values.empty())
        return {};
    const auto from = values.begin() + std::ptrdiff_t(instance * components);
    return {from, from + std::ptrdiff_t(components)};
}
} // namespace

std::vector<matrix> instances_of(reader &r, size_t node)
{
    const tinygltf::Value *instanced = extension(r.model.nodes[node].extensions, "EXT_mesh_gpu_instancing");
    const std::string where = place("nodes", node) + ".EXT_mesh_gpu_instancing";
    std::vector<matrix> result;
    size_t count = 0;

    if (!instanced || !instanced->Has("attributes") || !instanced->Get("attributes").IsObject())
        return result;
    const tinygltf::Value &attributes = instanced->Get("attributes");
    const std::vector<float> translations = read_attribute(r, attributes, "TRANSLATION", 3, count, where),
                             rotations = read_attribute(r, attributes, "ROTATION", 4, count, where),
                             scales = read_attribute(r, attributes, "SCALE", 3, count, where);
    r.instance_count += count;
    result.reserve(count);
    for (size_t i = 0; i < count; i++) {
        result.push_back(matrix_of(part_of(translations, i, 3), part_of(rotations, i, 4), part_of(scales, i, 3)));
        check_matrix(r, result.back(), where);
    }
    return result;
}
} // namespace gltf
