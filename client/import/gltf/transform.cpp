// SPDX-License-Identifier: MIT
// Transforms of nodes: as matrices, and decomposed.
#include "reader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gltf
{
namespace
{
struct vector3 {
    double x, y, z;
};

double dot(vector3 a, vector3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

vector3 cross(vector3 a, vector3 b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

vector3 scaled(vector3 a, double factor)
{
    return {a.x * factor, a.y * factor, a.z * factor};
}

double length(vector3 a)
{
    return std::sqrt(dot(a, a));
}

vector3 column(const matrix &m, size_t index)
{
    return {m[index * 4], m[index * 4 + 1], m[index * 4 + 2]};
}

// A unit vector perpendicular to a unit vector.
vector3 any_perpendicular(vector3 a)
{
    const vector3 axis = std::fabs(a.x) < 0.6 ? vector3{1, 0, 0} : vector3{0, 1, 0};
    const vector3 other = cross(a, axis);
    return scaled(other, 1 / length(other));
}

// The quaternion of a rotation with these columns (Shepperd 1978: the largest of the four is found by a root).
void quaternion_of(vector3 x, vector3 y, vector3 z, float out[4])
{
    const double candidates[4] = {x.x - y.y - z.z, y.y - x.x - z.z, z.z - x.x - y.y, x.x + y.y + z.z};
    const size_t maximum = size_t(std::max_element(candidates, candidates + 4) - candidates);
    const double root = std::sqrt(std::max(0.0, 1 + candidates[maximum])), part = 0.5 / root;
    double q[4];

    q[maximum] = root / 2;
    switch (maximum) {
    case 0:
        q[1] = (x.y + y.x) * part, q[2] = (x.z + z.x) * part, q[3] = (y.z - z.y) * part;
        break;
    case 1:
        q[0] = (x.y + y.x) * part, q[2] = (y.z + z.y) * part, q[3] = (z.x - x.z) * part;
        break;
    case 2:
        q[0] = (x.z + z.x) * part, q[1] = (y.z + z.y) * part, q[3] = (x.y - y.x) * part;
        break;
    default:
        q[0] = (y.z - z.y) * part, q[1] = (z.x - x.z) * part, q[2] = (x.y - y.x) * part;
        break;
    }
    for (size_t i = 0; i < 4; i++)
        out[i] = float(q[i]);
}

// Decomposes a matrix. Scales are the lengths of the columns, the first one negative if the matrix mirrors;
// columns that are not perpendicular are made so (Gram-Schmidt).
parts decompose(reader &r, const matrix &m, const std::string &where)
{
    parts result = {};
    vector3 axes[3];
    double scales[3];
    bool sheared = false;

    for (size_t i = 0; i < 3; i++) {
        result.translation[i] = float(m[12 + i]);
        axes[i] = column(m, i);
        scales[i] = length(axes[i]);
    }
    const double mirror = dot(cross(axes[0], axes[1]), axes[2]) < 0 ? -1 : 1;
    scales[0] *= mirror;
    // A column without length is derived from the others.
    vector3 x = scales[0] != 0  ? scaled(axes[0], 1 / scales[0])
                : scales[1] > 0 ? any_perpendicular(scaled(axes[1], 1 / scales[1]))
                : scales[2] > 0 ? any_perpendicular(scaled(axes[2], 1 / scales[2]))
                                : vector3{1, 0, 0};
    vector3 y = scales[1] > 0   ? scaled(axes[1], 1 / scales[1])
                : scales[2] > 0 ? cross(scaled(axes[2], 1 / scales[2]), x)
                                : any_perpendicular(x);
    sheared = std::fabs(dot(x, y)) > 1e-4;
    y = {y.x - dot(x, y) * x.x, y.y - dot(x, y) * x.y, y.z - dot(x, y) * x.z};
    y = length(y) > 1e-9 ? scaled(y, 1 / length(y)) : any_perpendicular(x);
    const vector3 z = cross(x, y);
    if (scales[2] > 0)
        sheared = sheared || std::fabs(dot(z, scaled(axes[2], 1 / scales[2])) - 1) > 1e-4;
    quaternion_of(x, y, z, result.rotation);
    for (size_t i = 0; i < 3; i++)
        result.scale[i] = float(scales[i]);
    import_note(r.scene, PROTOCOL_SEVERITY_INFO, where.c_str(),
                "an animated node is given by a matrix, which was taken apart");
    if (sheared)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(),
                    "the shear of an animated node's matrix is lost");
    return result;
}
} // namespace

matrix identity()
{
    matrix m = {};
    m[0] = m[5] = m[10] = m[15] = 1;
    return m;
}

void to_rows(const matrix &m, float out[12])
{
    for (size_t row = 0; row < 3; row++)
        for (size_t column = 0; column < 4; column++)
            out[row * 4 + column] = float(m[column * 4 + row]);
}

matrix matrix_of(const std::vector<double> &t, const std::vector<double> &q, const std::vector<double> &s)
{
    matrix m = identity();

    if (q.size() == 4) {
        const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (length > 0) {
            const double x = q[0] / length, y = q[1] / length, z = q[2] / length, w = q[3] / length;
            m[0] = 1 - 2 * (y * y + z * z), m[4] = 2 * (x * y - z * w), m[8] = 2 * (x * z + y * w);
            m[1] = 2 * (x * y + z * w), m[5] = 1 - 2 * (x * x + z * z), m[9] = 2 * (y * z - x * w);
            m[2] = 2 * (x * z - y * w), m[6] = 2 * (y * z + x * w), m[10] = 1 - 2 * (x * x + y * y);
        }
    }
    for (size_t column = 0; column < 3 && s.size() == 3; column++)
        for (size_t row = 0; row < 3; row++)
            m[column * 4 + row] *= s[column];
    for (size_t row = 0; row < 3 && t.size() == 3; row++)
        m[12 + row] = t[row];
    return m;
}

matrix product(const matrix &a, const matrix &b)
{
    matrix out;

    for (size_t column = 0; column < 4; column++)
        for (size_t row = 0; row < 4; row++) {
            out[column * 4 + row] = 0;
            for (size_t k = 0; k < 4; k++)
                out[column * 4 + row] += a[k * 4 + row] * b[column * 4 + k];
        }
    return out;
}

void check_matrix(reader &r, const matrix &m, const std::string &where)
{
    for (double value : m)
        if (!std::isfinite(value) || std::fabs(value) > 1e12)
            fail(r, where, "a transform that is not finite or beyond 1e12");
}

matrix node_matrix(reader &r, size_t index)
{
    const tinygltf::Node &node = r.model.nodes[index];
    matrix m = identity();

    if (node.matrix.size() == 16)
        std::copy(node.matrix.begin(), node.matrix.end(), m.begin());
    else if (!node.matrix.empty())
        fail(r, place("nodes", index), "a matrix of %zu numbers", node.matrix.size());
    else
        m = matrix_of(node.translation, node.rotation, node.scale);
    check_matrix(r, m, place("nodes", index));
    return m;
}

parts node_parts(reader &r, size_t index)
{
    const tinygltf::Node &node = r.model.nodes[index];
    const matrix m = node_matrix(r, index); // also checks the numbers

    if (node.matrix.size() == 16)
        return decompose(r, m, place("nodes", index));
    parts result = {};
    for (size_t i = 0; i < 3; i++) {
        result.translation[i] = node.translation.size() == 3 ? float(node.translation[i]) : 0.0f;
        result.scale[i] = node.scale.size() == 3 ? float(node.scale[i]) : 1.0f;
    }
    double q[4] = {0, 0, 0, 0}, squared = 0;
    for (size_t i = 0; i < 4 && node.rotation.size() == 4; i++) {
        q[i] = node.rotation[i];
        squared += q[i] * q[i];
    }
    if (!(squared > 0) || !std::isfinite(squared)) {
        q[0] = q[1] = q[2] = 0, q[3] = squared = 1;
    }
    for (size_t i = 0; i < 4; i++)
        result.rotation[i] = float(q[i] / std::sqrt(squared));
    return result;
}

std::array<double, 3> point_of(const matrix &m, const std::array<double, 3> &p)
{
    std::array<double, 3> out;
    for (size_t row = 0; row < 3; row++)
        out[row] = m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row];
    return out;
}

namespace
{
// Extends a box by the positions of a mesh, from its accessors, transformed by `m`.
void grow(const reader &r, int mesh, const matrix &m, world_box &around)
{
    if (mesh < 0 || size_t(mesh) >= r.model.meshes.size())
        return;
    for (const tinygltf::Primitive &primitive : r.model.meshes[size_t(mesh)].primitives) {
        const int position = attribute(primitive.attributes, "POSITION");
        if (position < 0 || size_t(position) >= r.model.accessors.size())
            continue;
        const tinygltf::Accessor &of = r.model.accessors[size_t(position)];
        for (size_t corner = 0; corner < 8 && of.minValues.size() == 3 && of.maxValues.size() == 3; corner++) {
            std::array<double, 3> place;
            for (size_t c = 0; c < 3; c++)
                place[c] = corner >> c & 1 ? of.maxValues[c] : of.minValues[c];
            place = point_of(m, place);
            for (size_t c = 0; c < 3; c++) {
                around.lower[c] = std::min(around.lower[c], place[c]);
                around.upper[c] = std::max(around.upper[c], place[c]);
            }
        }
    }
}

} // namespace

world_box box_of(reader &r, const std::vector<int> &roots, const node_visitor &visit)
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    world_box around = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
    std::vector<std::pair<int, matrix>> open;

    for (int root : roots)
        open.push_back({root, identity()});
    while (!open.empty()) {
        const auto [index, parent] = open.back();
        const tinygltf::Node &node = r.model.nodes[size_t(index)];
        const matrix placed = product(parent, node_matrix(r, size_t(index)));
        open.pop_back();
        grow(r, node.mesh, placed, around);
        if (visit)
            visit(node, placed);
        for (int child : node.children)
            open.push_back({child, placed});
    }
    return around;
}

} // namespace gltf
