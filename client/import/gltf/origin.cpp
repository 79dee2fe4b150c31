// SPDX-License-Identifier: MIT
// Models far from the origin: their nodes have doubles, which floats would round too much, so an origin near the
// model is subtracted in advance.
#include "reader.hpp"
#include "import/model/origin.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gltf
{
namespace
{
struct displacement {
    int node;
    std::array<double, 3> by; // in the space of the node's parent
};

// Effects of clips on a node, as bits.
enum { TURNS = 1, MOVES = 2 };

std::vector<int> animated_nodes(const reader &r)
{
    std::vector<int> found(r.model.nodes.size(), 0);

    for (const tinygltf::Animation &animation : r.model.animations)
        for (const tinygltf::AnimationChannel &channel : animation.channels) {
            const bool by_pointer = channel.target_path == "pointer"; // may change any node
            if (by_pointer)
                std::fill(found.begin(), found.end(), TURNS | MOVES);
            else if (channel.target_node >= 0 && size_t(channel.target_node) < found.size())
                found[size_t(channel.target_node)] |= channel.target_path == "translation" ? MOVES : TURNS;
        }
    return found;
}

double length2(const std::array<double, 3> &v)
{
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

// Converts a displacement in the parent's space to the node's. False: the node has no extent in some direction.
bool into_node(const matrix &m, const std::array<double, 3> &by, std::array<double, 3> &out)
{
    const auto minor = [&](size_t i, size_t j) { // minor of the cofactor
        const size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
        return m[c * 4 + a] * m[d * 4 + b] - m[d * 4 + a] * m[c * 4 + b];
    };
    const double determinant = m[0] * minor(0, 0) + m[4] * minor(0, 1) + m[8] * minor(0, 2);

    for (size_t j = 0; j < 3; j++)
        out[j] = (minor(0, j) * by[0] + minor(1, j) * by[1] + minor(2, j) * by[2]) / determinant;
    return std::isfinite(length2(out));
}

// Finds the nodes of the tree that hold the large numbers. False: a clip holds them.
bool find_displacements(reader &r, const std::vector<int> &roots, const std::array<double, 3> &origin,
                        std::vector<displacement> &found)
{
    const std::vector<int> animated = animated_nodes(r);
    std::vector<displacement> open;

    for (int root : roots)
        open.push_back({root, origin});
    while (!open.empty()) {
        const displacement one = open.back();
        const tinygltf::Node &node = r.model.nodes[size_t(one.node)];
        const matrix m = node_matrix(r, size_t(one.node));
        const std::array<double, 3> place = {m[12], m[13], m[14]};
        const std::array<double, 3> rest = {m[12] - one.by[0], m[13] - one.by[1], m[14] - one.by[2]};
        std::array<double, 3> below;
        open.pop_back();
        if (length2(rest) >= length2(place) && node.mesh < 0 && node.camera < 0 && node.extensions.empty() &&
            !node.children.empty() && animated[size_t(one.node)] == 0 && into_node(m, one.by, below)) {
            for (int child : node.children)
                open.push_back({child, below});
            continue;
        }
        if (animated[size_t(one.node)] & MOVES)
            return false;
        found.push_back(one);
    }
    return true;
}
} // namespace

uint32_t settle_origin(reader &r, const std::vector<int> &roots)
{
    const world_box around = box_of(r, roots);
    std::array<double, 3> origin = {};
    std::vector<displacement> found;

    if (!import_find_origin(around.lower.data(), around.upper.data(), origin.data()) ||
        !find_displacements(r, roots, origin, found))
        return 0;
    for (const displacement &one : found) {
        tinygltf::Node &node = r.model.nodes[size_t(one.node)];
        if (node.matrix.empty())
            node.translation.resize(3, 0);
        for (size_t c = 0; c < 3; c++)
            (node.matrix.empty() ? node.translation[c] : node.matrix[12 + c]) -= one.by[c];
    }
    const uint32_t id = import_add_origin_node(r.scene, origin.data(), 0);
    check(r);
    return id;
}
} // namespace gltf
