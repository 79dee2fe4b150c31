// SPDX-License-Identifier: MIT
// The hierarchy of nodes: transforms, and the objects that nodes show. Without recursion.
#include "reader.hpp"

#include <algorithm>
#include <cmath>

namespace gltf
{
namespace
{
// The server's limit minus one, since a node with a mesh and a camera needs a child.
constexpr int depth_max = 255;

std::string name_of(const reader &r, const tinygltf::Node &node)
{
    if (!node.name.empty())
        return node.name;
    if (node.mesh >= 0 && size_t(node.mesh) < r.model.meshes.size())
        return r.model.meshes[size_t(node.mesh)].name;
    if (node.camera >= 0 && size_t(node.camera) < r.model.cameras.size())
        return r.model.cameras[size_t(node.camera)].name;
    return "";
}

// 0, with a note: it cannot be had.
uint32_t camera_id(reader &r, int index, const std::string &where)
{
    const auto leave_out = [&](const std::string &what, const char *why) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, what.c_str(), "the camera is left out: %s", why);
        return 0u;
    };

    if (size_t(index) >= r.model.cameras.size())
        return leave_out(where, "no camera has its number");
    const tinygltf::Camera &camera = r.model.cameras[size_t(index)];
    const std::string here = place("cameras", size_t(index));
    message_set_camera set = {};

    set.name = camera.name.c_str();
    if (camera.type == "perspective") {
        if (!(camera.perspective.yfov > 0))
            return leave_out(here, "yfov, its field of view, is not above 0");
        set.value.fov_y = limited(r, here, "the field of view", camera.perspective.yfov, 0.001, 3.1);
        set.value.near = limited(r, here, "the near distance", camera.perspective.znear, 0, 1e12);
    } else if (camera.type == "orthographic") {
        if (!(std::fabs(camera.orthographic.ymag) > 0))
            return leave_out(here, "ymag, half the height that it sees, is 0");
        set.value.height =
            limited(r, here, "the orthographic height", 2 * std::fabs(camera.orthographic.ymag), 0, 1e12);
        set.value.near = limited(r, here, "the near distance", std::max(0.0, camera.orthographic.znear), 0, 1e12);
    } else {
        return leave_out(here, "its type is neither 'perspective' nor 'orthographic'");
    }
    return import_add_camera(r.scene, &set);
}

struct attachment {
    protocol_node_kind kind;
    uint32_t object;
    const char *suffix;
    bool is_of_mesh; // shown for each instance of the node's mesh
    uint32_t skin;
    std::vector<record_morph_weight> weights;
};

void attach_mesh(reader &r, const tinygltf::Node &node, const std::string &where, std::vector<attachment> &found)
{
    const shown_mesh &mesh = mesh_of(r, node.mesh);
    for (const shown_part &part : mesh.parts)
        found.push_back(
            {part.kind, part.id, part.kind == PROTOCOL_NODE_SPHERES ? " points" : " lines", true, 0, {}});
    if (mesh.id == 0)
        return;
    attachment one = {PROTOCOL_NODE_MESH, mesh.id, " mesh", true, 0, {}};
    if (node.skin >= 0 && mesh.has_joints)
        one.skin = skin_id(r, node.skin, mesh, where);
    if (!node.weights.empty())
        one.weights = morph_weights(r, node.weights, mesh.target_count, where);
    found.push_back(std::move(one));
}

std::vector<attachment> attachments_of(reader &r, size_t index)
{
    const tinygltf::Node &node = r.model.nodes[index];
    const std::string where = place("nodes", index);
    std::vector<attachment> found;

    if (node.mesh >= 0)
        attach_mesh(r, node, where, found);
    const uint32_t camera = node.camera >= 0 ? camera_id(r, node.camera, where) : 0;
    if (camera != 0)
        found.push_back({PROTOCOL_NODE_CAMERA, camera, " camera", false, 0, {}});
    if (const tinygltf::Value *lights = extension(node.extensions, "KHR_lights_punctual")) {
        const uint32_t light = light_id(r, index_of(*lights, "light"), where);
        if (light != 0)
            found.push_back({PROTOCOL_NODE_LIGHT, light, " light", false, 0, {}});
    }
    return found;
}

// Adds a node; `what` null: a group.
uint32_t add_node(reader &r, uint32_t parent, const matrix &m, const attachment *what, const std::string &name,
                  bool hidden)
{
    message_set_node set = {};

    set.value.parent = parent;
    set.value.hidden = hidden;
    set.name = name.c_str();
    to_rows(m, set.value.parent_from_node);
    if (what) {
        set.value.kind = what->kind;
        set.value.object = what->object;
        set.value.skin = what->skin;
        set.weights = const_cast<record_morph_weight *>(what->weights.data()); // copied by import_add_node()
        set.weights_count = uint32_t(what->weights.size());
    }
    const uint32_t id = import_add_node(r.scene, &set);
    check(r);
    return id;
}

bool is_hidden(const tinygltf::Node &node)
{
    const tinygltf::Value *visibility = extension(node.extensions, "KHR_node_visibility");

    return visibility && visibility->Has("visible") && visibility->Get("visible").IsBool() &&
           !visibility->Get("visible").Get<bool>();
}

// A glTF node may have a mesh, a camera and a light at once, or many instances of a mesh; our node shows a single
// object, so the others become children.
uint32_t add_one(reader &r, size_t index, uint32_t parent)
{
    const tinygltf::Node &node = r.model.nodes[index];
    const std::string name = name_of(r, node);
    const std::vector<attachment> found = attachments_of(r, index);
    const std::vector<matrix> instances = node.mesh >= 0 ? instances_of(r, index) : std::vector<matrix>();
    const uint32_t mesh = node.mesh >= 0 ? mesh_of(r, node.mesh).id : 0;
    const bool single = found.size() == 1 && instances.empty();
    const uint32_t id =
        add_node(r, parent, node_matrix(r, index), single ? &found[0] : nullptr, name, is_hidden(node));

    r.node_ids[index] = id;
    for (const attachment &one : found) {
        std::vector<uint32_t> holders;
        if (one.is_of_mesh)
            for (const matrix &instance : instances)
                holders.push_back(add_node(r, id, instance, &one, "", false));
        if (holders.empty())
            holders.push_back(single ? id : add_node(r, id, identity(), &one, name + one.suffix, false));
        if (one.kind == PROTOCOL_NODE_MESH && one.object == mesh) // points and lines have no morph targets
            r.mesh_nodes[index] = holders;
    }
    return id;
}

std::vector<int> roots_of(reader &r)
{
    const tinygltf::Model &model = r.model;
    std::vector<int> roots;

    if (model.scenes.empty()) {
        for (size_t i = 0; i < r.parents.size(); i++)
            if (r.parents[i] < 0)
                roots.push_back(int(i));
        if (!roots.empty())
            import_note(r.scene, PROTOCOL_SEVERITY_INFO, "", "the file has no scene: every node is shown");
        return roots;
    }
    const int scene = model.defaultScene < 0 ? 0 : model.defaultScene;
    if (size_t(scene) >= model.scenes.size())
        fail(r, "scene", "scene %d does not exist; there are %zu", scene, model.scenes.size());
    if (model.scenes.size() > 1)
        import_note(r.scene, PROTOCOL_SEVERITY_INFO, "", "scene %d of the file's %zu is shown", scene,
                    model.scenes.size());
    std::set<int> seen;
    for (int root : model.scenes[size_t(scene)].nodes) {
        if (root < 0 || size_t(root) >= model.nodes.size())
            fail(r, place("scenes", size_t(scene)), "node %d does not exist", root);
        if (r.parents[size_t(root)] >= 0)
            fail(r, place("scenes", size_t(scene)), "node %d is not a root: it is a child of node %d", root,
                 r.parents[size_t(root)]);
        if (!seen.insert(root).second)
            fail(r, place("scenes", size_t(scene)), "node %d is listed twice", root);
        roots.push_back(root);
    }
    return roots;
}

struct pending {
    int node;
    uint32_t parent;
    int depth;
};

void note_uses(reader &r, const tinygltf::Node &node, std::set<int> &used)
{
    if (node.mesh < 0 || size_t(node.mesh) >= r.model.meshes.size())
        return;
    for (const tinygltf::Primitive &primitive : r.model.meshes[size_t(node.mesh)].primitives)
        if (material_of(r, primitive) >= 0)
            used.insert(material_of(r, primitive));
    if (node.skin >= 0)
        r.skinned_meshes.insert(node.mesh);
}

// Calls `visit(node, parent's result)` for all nodes below the roots, parents first.
template <typename visitor> void traverse(reader &r, const std::vector<int> &roots, uint32_t top, visitor visit)
{
    std::vector<pending> open;

    for (size_t i = roots.size(); i-- > 0;)
        open.push_back({roots[i], top, 1});
    while (!open.empty()) {
        const pending at = open.back();
        open.pop_back();
        if (at.depth > depth_max)
            fail(r, place("nodes", size_t(at.node)), "nodes are nested more than %d deep", depth_max);
        const uint32_t id = visit(size_t(at.node), at.parent);
        const std::vector<int> &children = r.model.nodes[size_t(at.node)].children;
        for (size_t i = children.size(); i-- > 0;)
            open.push_back({children[i], id, at.depth + 1});
    }
}
} // namespace

void check_hierarchy(reader &r)
{
    const std::vector<tinygltf::Node> &nodes = r.model.nodes;

    r.parents.assign(nodes.size(), -1);
    for (size_t i = 0; i < nodes.size(); i++) {
        for (int child : nodes[i].children) {
            if (child < 0 || size_t(child) >= nodes.size())
                fail(r, place("nodes", i), "child %d does not exist; there are %zu nodes", child, nodes.size());
            if (r.parents[size_t(child)] >= 0)
                fail(r, place("nodes", size_t(child)), "the node is a child of node %d and of node %zu",
                     r.parents[size_t(child)], i);
            r.parents[size_t(child)] = int(i);
        }
    }
    // Each node has at most one parent, so a cycle is an upward chain that meets itself. State 1: on the current
    // chain, 2: known to end.
    std::vector<char> state(nodes.size(), 0);
    for (size_t i = 0; i < nodes.size(); i++) {
        int at = int(i);
        for (; at >= 0 && state[size_t(at)] == 0; at = r.parents[size_t(at)])
            state[size_t(at)] = 1;
        if (at >= 0 && state[size_t(at)] == 1)
            fail(r, place("nodes", size_t(at)), "the node is its own ancestor");
        for (at = int(i); at >= 0 && state[size_t(at)] == 1; at = r.parents[size_t(at)])
            state[size_t(at)] = 2;
    }
}

void add_scene(reader &r)
{
    const std::vector<int> roots = roots_of(r);
    std::set<int> used;

    traverse(r, roots, 0, [&](size_t node, uint32_t) {
        note_uses(r, r.model.nodes[node], used);
        return 0u;
    });
    convert_photometric_lights(r, roots);
    add_materials(r, used);
    r.node_ids.assign(r.model.nodes.size(), 0);
    const uint32_t top = settle_origin(r, roots);
    traverse(r, roots, top, [&](size_t node, uint32_t parent) { return add_one(r, node, parent); });
    add_skins(r);
}

uint32_t add_hidden_node(reader &r, size_t node)
{
    std::vector<size_t> chain;
    uint32_t parent = 0;

    for (int at = int(node); at >= 0; at = r.parents[size_t(at)]) {
        if (r.node_ids[size_t(at)] != 0) {
            parent = r.node_ids[size_t(at)];
            break;
        }
        chain.push_back(size_t(at));
        if (chain.size() > depth_max)
            fail(r, place("nodes", node), "nodes are nested more than %d deep", depth_max);
    }
    for (; !chain.empty(); chain.pop_back()) {
        const size_t at = chain.back();
        import_note(r.scene, PROTOCOL_SEVERITY_INFO, place("nodes", at).c_str(),
                    "joints that are not part of the scene are kept, hidden");
        parent = r.node_ids[at] = add_node(r, parent, node_matrix(r, at), nullptr, r.model.nodes[at].name, true);
    }
    return parent;
}
} // namespace gltf
