// SPDX-License-Identifier: MIT
// Skinning, once, in the pose in which the file's nodes stand.
#include "gltf.hpp"

#include <cmath>

namespace gltf
{
namespace
{
using matrix = std::array<double, 16>;

matrix multiply(const matrix &a, const matrix &b)
{
    matrix m = {};
    for (size_t column = 0; column < 4; column++)
        for (size_t row = 0; row < 4; row++)
            for (size_t k = 0; k < 4; k++)
                m[column * 4 + row] += a[k * 4 + row] * b[column * 4 + k];
    return m;
}

// World matrices of all nodes. Parents may come after their children in the file, so each chain is followed up
// to what is known and done downwards.
void fill_world(reader &r)
{
    const size_t count = r.model.nodes.size();
    std::vector<char> known(count, 0);
    std::vector<size_t> chain;

    r.world.resize(count);
    for (size_t i = 0; i < count; i++) {
        for (int at = int(i); at >= 0 && !known[size_t(at)]; at = r.parents[size_t(at)])
            chain.push_back(size_t(at));
        for (; !chain.empty(); chain.pop_back()) {
            const size_t node = chain.back();
            const matrix own = node_matrix(r, node);
            r.world[node] = r.parents[node] < 0 ? own : multiply(r.world[size_t(r.parents[node])], own);
            known[node] = 1;
        }
    }
}

std::vector<matrix> joint_matrices(reader &r, int index)
{
    const tinygltf::Skin &skin = r.model.skins[size_t(index)];
    const std::string where = place("skins", size_t(index));
    std::vector<matrix> joints(skin.joints.size());
    std::vector<float> inverse(skin.joints.size() * 16);

    if (skin.inverseBindMatrices >= 0) {
        if (accessor_count(r, skin.inverseBindMatrices, TINYGLTF_TYPE_MAT4, where) < skin.joints.size())
            fail(r, where, "fewer inverse bind matrices than joints");
        inverse.resize(accessor_count(r, skin.inverseBindMatrices, TINYGLTF_TYPE_MAT4, where) * 16);
        read_floats(r, skin.inverseBindMatrices, 16, 0, inverse.data(), where);
    }
    for (size_t j = 0; j < joints.size(); j++) {
        const int node = skin.joints[j];
        if (node < 0 || size_t(node) >= r.model.nodes.size())
            fail(r, where, "joint node %d does not exist", node);
        matrix bind = {};
        for (size_t i = 0; i < 16; i++)
            bind[i] = skin.inverseBindMatrices >= 0 ? double(inverse[j * 16 + i]) : (i % 5 == 0 ? 1.0 : 0.0);
        joints[j] = multiply(r.world[size_t(node)], bind);
    }
    return joints;
}

struct influences {
    std::vector<uint32_t> joints;
    std::vector<float> weights;
};

std::vector<influences> influences_of(reader &r, const tinygltf::Primitive &primitive, size_t vertices,
                                      const std::string &where)
{
    std::vector<influences> sets;

    for (int set = 0; set < 4; set++) {
        const auto joints = primitive.attributes.find("JOINTS_" + std::to_string(set));
        const auto weights = primitive.attributes.find("WEIGHTS_" + std::to_string(set));
        if (joints == primitive.attributes.end() || weights == primitive.attributes.end())
            break;
        influences one;
        one.joints = read_integers(r, joints->second, 4, where + "." + joints->first);
        one.weights.resize(vertices * 4);
        accessor_count(r, weights->second, TINYGLTF_TYPE_VEC4, where + "." + weights->first);
        read_floats(r, weights->second, 4, 0, one.weights.data(), where + "." + weights->first);
        sets.push_back(std::move(one));
    }
    return sets;
}

void transform(const matrix &m, float *vector, double w)
{
    const double x = double(vector[0]), y = double(vector[1]), z = double(vector[2]);
    for (size_t row = 0; row < 3; row++)
        vector[row] = float(m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row] * w);
}

// Normals want the inverse transpose; its direction is that of the cofactors, which exist for flat matrices, too.
void transform_normal(const matrix &m, float *normal)
{
    const double n[3] = {double(normal[0]), double(normal[1]), double(normal[2])};
    double out[3];
    for (size_t row = 0; row < 3; row++) {
        const size_t a = (row + 1) % 3, b = (row + 2) % 3;
        out[row] = 0;
        for (size_t column = 0; column < 3; column++) {
            const size_t c = (column + 1) % 3, d = (column + 2) % 3;
            out[row] += (m[c * 4 + a] * m[d * 4 + b] - m[c * 4 + b] * m[d * 4 + a]) * n[column];
        }
    }
    const double length = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (size_t i = 0; i < 3; i++)
        normal[i] = length > 0 ? float(out[i] / length) : 0;
}
} // namespace

void apply_skin(reader &r, const tinygltf::Primitive &primitive, int skin, const skinned_arrays &arrays,
                const std::string &where)
{
    const std::vector<influences> sets = influences_of(r, primitive, arrays.vertex_count, where);

    if (sets.empty()) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, where.c_str(), "a skinned mesh has no joints or weights");
        return;
    }
    if (r.world.empty())
        fill_world(r);
    const std::vector<matrix> joints = joint_matrices(r, skin);
    for (size_t v = 0; v < arrays.vertex_count; v++) {
        matrix m = {};
        double sum = 0;
        for (const influences &set : sets) {
            for (size_t i = v * 4; i < v * 4 + 4; i++) {
                const double weight = double(set.weights[i]);
                if (!(weight > 0) || !std::isfinite(weight))
                    continue;
                if (set.joints[i] >= joints.size())
                    fail(r, where, "vertex %zu names joint %u of %zu", v, set.joints[i], joints.size());
                for (size_t k = 0; k < 16; k++)
                    m[k] += weight * joints[set.joints[i]][k];
                sum += weight;
            }
        }
        if (!(sum > 0))
            continue; // held by nothing: stays where it is
        for (double &value : m)
            value /= sum;
        transform(m, arrays.positions + v * 3, 1);
        if (arrays.normals)
            transform_normal(m, arrays.normals + v * 3);
        if (arrays.tangents)
            transform(m, arrays.tangents + v * 4, 0);
    }
    import_note(r.scene, PROTOCOL_SEVERITY_INFO, where.c_str(),
                "skinned meshes stand in the pose of the file's nodes");
}
} // namespace gltf
