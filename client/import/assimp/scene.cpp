// SPDX-License-Identifier: MIT
// The hierarchy of nodes, with cameras and lights, which the library assigns to nodes by name. Without recursion.
#include "reader.hpp"
#include "import/model/origin.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace assimp
{
namespace
{
constexpr double pi = 3.14159265358979323846;
// Two below the server's limit: a node is above all others, and an object may need a node below its own.
constexpr int depth_max = 254;

struct attachment {
    protocol_node_kind kind;
    uint32_t object;
    uint32_t skin;
    aiMatrix4x4 placed; // transform within the node
    std::string suffix;
};

struct walk {
    reader &r;
    std::multimap<std::string, unsigned> cameras = {}, lights = {}; // by their node's name
};

// ---- which way is up, and how long a unit is

// The library passes on an FBX file's axes without applying them.
int metadata_integer(const aiScene &scene, const char *key, int otherwise)
{
    const aiMetadata *all = scene.mMetaData;
    for (unsigned i = 0; all && i < all->mNumProperties; i++)
        if (text(all->mKeys[i]) == key && all->mValues[i].mType == AI_INT32 && all->mValues[i].mData)
            memcpy(&otherwise, all->mValues[i].mData, sizeof(otherwise));
    return otherwise;
}

double metadata_float(const aiScene &scene, const char *key, float otherwise)
{
    const aiMetadata *all = scene.mMetaData;
    for (unsigned i = 0; all && i < all->mNumProperties; i++)
        if (text(all->mKeys[i]) == key && all->mValues[i].mType == AI_FLOAT && all->mValues[i].mData)
            memcpy(&otherwise, all->mValues[i].mData, sizeof(otherwise));
    return double(otherwise);
}

// The transform to y up and metres.
aiMatrix4x4 axes_of(reader &r)
{
    const float signs[3] = {metadata_integer(*r.source, "CoordAxisSign", 1) < 0 ? -1.0f : 1.0f,
                            metadata_integer(*r.source, "UpAxisSign", 1) < 0 ? -1.0f : 1.0f,
                            metadata_integer(*r.source, "FrontAxisSign", 1) < 0 ? -1.0f : 1.0f};
    const int axes[3] = {metadata_integer(*r.source, "CoordAxis", 0), metadata_integer(*r.source, "UpAxis", 1),
                         metadata_integer(*r.source, "FrontAxis", 2)};
    const double factor = metadata_float(*r.source, "UnitScaleFactor", 1);
    const double unit = r.format->metres * (factor >= 1e-6 && factor <= 1e6 ? factor : 1);
    aiMatrix4x4 m;

    if (r.format->z_up) {
        m = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1};
    } else if (((1 << (axes[0] & 3)) | (1 << (axes[1] & 3)) | (1 << (axes[2] & 3))) == 7) {
        for (unsigned row = 0; row < 3; row++)
            for (unsigned column = 0; column < 3; column++)
                m[row][column] = int(column) == axes[row] ? signs[row] : 0;
    }
    for (unsigned row = 0; row < 3; row++)
        for (unsigned column = 0; column < 3; column++)
            m[row][column] *= float(unit);
    return m;
}

uint32_t add_node(reader &r, uint32_t parent, const aiMatrix4x4 &placed, const attachment *what,
                  const std::string &name)
{
    message_set_node set = {};

    set.value.parent = parent;
    set.name = name.c_str();
    for (unsigned i = 0; i < 12; i++)
        set.value.parent_from_node[i] = placed[i / 4][i % 4];
    if (what) {
        set.value.kind = what->kind;
        set.value.object = what->object;
        set.value.skin = what->skin;
    }
    const uint32_t id = import_add_node(r.scene, &set);
    check(r);
    return id;
}

// ---- cameras and lights

// The transform of a camera or light along -z, as ours are.
aiMatrix4x4 looking(const aiVector3D &along, const aiVector3D &up, const aiVector3D &from)
{
    aiVector3D back = -along;
    if (!(back.SquareLength() > 0))
        back = {0, 0, 1};
    back.Normalize();
    aiVector3D right = up ^ back;
    if (!(right.SquareLength() > 1e-12f))
        right = aiVector3D(0, 0, 1) ^ back;
    if (!(right.SquareLength() > 1e-12f))
        right = aiVector3D(1, 0, 0) ^ back;
    right.Normalize();
    const aiVector3D above = back ^ right;
    return {right.x, above.x, back.x, from.x, right.y, above.y, back.y, from.y,
            right.z, above.z, back.z, from.z, 0,       0,       0,      1};
}

float cut(double value, double minimum, double maximum)
{
    return float(value >= minimum ? std::min(value, maximum) : minimum); // NaN becomes the minimum
}

attachment camera_of(reader &r, const aiCamera &from)
{
    const std::string name = text(from.mName);
    // The library's value for 45 degrees, if a COLLADA file states only the vertical angle.
    constexpr double lost = pi / 4 * pi / 180;
    const double aspect = from.mAspect > 0 ? double(from.mAspect) : 16.0 / 9;
    double width = double(from.mHorizontalFOV);
    message_set_camera set = {};

    if (std::fabs(width - lost) < 1e-6 && !(from.mAspect > 0)) {
        width = 2 * std::atan(std::tan(pi / 8) * aspect);
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(),
                    "the library does not give this camera's field of view; 45 degrees are used");
    }
    set.name = name.c_str();
    set.value.near = cut(double(from.mClipPlaneNear) * r.metres, 0, 1e12);
    if (from.mOrthographicWidth > 0)
        set.value.height = cut(2 * double(from.mOrthographicWidth) / aspect * r.metres, 0, 1e12);
    else
        set.value.fov_y = cut(2 * std::atan(std::tan(double(cut(width, 0.001, 3.1)) / 2) / aspect), 0.001, 3.1);
    return {PROTOCOL_NODE_CAMERA, import_add_camera(r.scene, &set), 0,
            looking(from.mLookAt, from.mUp, from.mPosition), " camera"};
}

// True for FBX files of Blender 2.80 and later, whose lights have watts.
bool has_watts(const reader &r)
{
    const aiMetadata *all = r.source->mMetaData;
    int version = 0;

    for (unsigned i = 0; all && i < all->mNumProperties; i++) {
        if (text(all->mKeys[i]) != "SourceAsset_Generator" || all->mValues[i].mType != AI_AISTRING ||
            !all->mValues[i].mData)
            continue;
        const std::string generator = text(*static_cast<const aiString *>(all->mValues[i].mData));
        int minor = 0;
        if (sscanf(generator.c_str(), "Blender (stable FBX IO) - %d.%d", &version, &minor) == 2)
            version = version * 100 + minor;
    }
    return version >= 280;
}

// Strength of a light with the colour 1. In these formats a white surface shows the light's colour, hence the
// factor pi, as for NFF. An FBX light's falloff is left to programs, which ignore it, except for lights in watts.
double strength_of(reader &r, const aiLight &from, uint32_t &kind)
{
    const bool is_fbx = strcmp(r.format->ending, ".fbx") == 0, is_point = kind == PROTOCOL_LIGHT_POINT;
    const double constant = from.mAttenuationConstant > 0 ? double(from.mAttenuationConstant) : 1;

    if (is_fbx && has_watts(r))
        return kind == PROTOCOL_LIGHT_DIRECTIONAL ? 1 : 1 / (4 * pi);
    if (kind == PROTOCOL_LIGHT_DIRECTIONAL)
        return pi;
    if (from.mAttenuationQuadratic > 0 && !(is_fbx && is_point))
        return pi / double(from.mAttenuationQuadratic) * r.metres * r.metres;
    if (is_point)
        kind = PROTOCOL_LIGHT_STEADY;
    if (!is_point || from.mAttenuationLinear > 0)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, text(from.mName).c_str(),
                    "the light falls off otherwise than the file says");
    return pi / constant;
}

attachment light_of(reader &r, const aiLight &from)
{
    const std::string name = text(from.mName);
    message_set_light set = {};

    if (from.mType == aiLightSource_AMBIENT || from.mType == aiLightSource_UNDEFINED) {
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, name.c_str(), "ambient light is left out");
        return {PROTOCOL_NODE_LIGHT, 0, 0, {}, ""};
    }
    set.value.kind = from.mType == aiLightSource_DIRECTIONAL ? PROTOCOL_LIGHT_DIRECTIONAL
                     : from.mType == aiLightSource_SPOT      ? PROTOCOL_LIGHT_SPOT
                                                             : PROTOCOL_LIGHT_POINT;
    const double strength = strength_of(r, from, set.value.kind);
    if (set.value.kind == PROTOCOL_LIGHT_SPOT) {
        set.value.outer_cone = cut(double(from.mAngleOuterCone) / 2, 0, 1.5707);
        set.value.inner_cone = cut(double(from.mAngleInnerCone) / 2, 0, double(set.value.outer_cone));
    }
    for (unsigned c = 0; c < 3; c++)
        set.value.colour[c] = cut(double(from.mColorDiffuse[c]) * strength, 0, 1e12);
    set.name = name.c_str();
    return {PROTOCOL_NODE_LIGHT, import_add_light(r.scene, &set), 0,
            looking(from.mDirection, {0, 1, 0}, from.mPosition), " light"};
}

// ---- nodes

// Groups a node's meshes: all undeformed ones together, others each by itself.
std::vector<std::vector<unsigned>> sets_of(reader &r, const aiNode &node)
{
    std::vector<std::vector<unsigned>> sets;
    std::vector<unsigned> still;

    for (unsigned i = 0; node.mMeshes && i < node.mNumMeshes; i++) {
        const unsigned place = node.mMeshes[i];
        const aiMesh *mesh = place < r.source->mNumMeshes ? r.source->mMeshes[place] : nullptr;
        if (!mesh || !mesh->mVertices)
            continue;
        if (has_skin(*mesh) || mesh->mNumAnimMeshes > 0 || is_point_cloud(*mesh))
            sets.push_back({place});
        else
            still.push_back(place);
    }
    if (!still.empty())
        sets.push_back(still);
    return sets;
}

bool is_identity(const aiMatrix4x4 &m)
{
    return m == aiMatrix4x4();
}

uint32_t add_one(walk &w, const aiNode &node, uint32_t parent)
{
    reader &r = w.r;
    const std::string name = text(node.mName);
    std::vector<attachment> found;
    std::vector<std::pair<uint32_t, std::vector<unsigned>>> morphed; // indices in `found`

    for (const std::vector<unsigned> &set : sets_of(r, node)) {
        const shown_mesh &shown = meshes_of(r, set);
        if (shown.id == 0)
            continue;
        if (shown.target_count > 0)
            morphed.push_back({uint32_t(found.size()), set});
        found.push_back({shown.kind, shown.id, shown.skin, {}, " mesh"});
    }
    const auto cameras = w.cameras.equal_range(name);
    for (auto one = cameras.first; one != cameras.second; ++one)
        found.push_back(camera_of(r, *r.source->mCameras[one->second]));
    const auto lights = w.lights.equal_range(name);
    for (auto one = lights.first; one != lights.second; ++one)
        found.push_back(light_of(r, *r.source->mLights[one->second]));
    w.cameras.erase(name); // a second node of the same name has none
    w.lights.erase(name);
    found.erase(std::remove_if(found.begin(), found.end(), [](const attachment &one) { return one.object == 0; }),
                found.end());
    const bool single = found.size() == 1 && is_identity(found[0].placed);
    const uint32_t id = add_node(r, parent, node.mTransformation, single ? &found[0] : nullptr, name);
    r.nodes.emplace(name, std::make_pair(id, &node));
    std::vector<uint32_t> holders;
    for (const attachment &one : found)
        holders.push_back(single ? id : add_node(r, id, one.placed, &one, name + one.suffix));
    for (const auto &one : morphed) {
        const uint32_t targets = meshes_of(r, one.second).target_count;
        r.morphs.emplace(name, std::make_pair(holders[one.first], targets));
        r.morphs.emplace(text(r.source->mMeshes[one.second[0]]->mName),
                         std::make_pair(holders[one.first], targets));
    }
    return id;
}

struct pending {
    const aiNode *node;
    uint32_t parent;
    int depth;
};
} // namespace

void add_scene(reader &r)
{
    const aiMatrix4x4 axes = axes_of(r);
    const aiMatrix4x4 whole = axes * r.source->mRootNode->mTransformation;
    std::vector<pending> open = {{r.source->mRootNode, 0, 1}};
    walk w = {r};

    r.metres = std::cbrt(std::fabs(double(whole.Determinant())));
    if (!(r.metres > 1e-12 && r.metres < 1e12))
        r.metres = 1;
    for (unsigned i = 0; r.source->mCameras && i < r.source->mNumCameras; i++)
        if (r.source->mCameras[i])
            w.cameras.emplace(text(r.source->mCameras[i]->mName), i);
    for (unsigned i = 0; r.source->mLights && i < r.source->mNumLights; i++)
        if (r.source->mLights[i])
            w.lights.emplace(text(r.source->mLights[i]->mName), i);
    if (!is_identity(axes))
        open[0].parent = add_node(r, 0, axes, nullptr, "y up, in metres");
    if (std::any_of(r.origin, r.origin + 3, [](double one) { return one < 0 || one > 0; }))
        open[0].parent = import_add_origin_node(r.scene, r.origin, open[0].parent);
    while (!open.empty()) {
        const pending at = open.back();
        open.pop_back();
        if (at.depth > depth_max)
            fail(r, text(at.node->mName), "nodes are nested more than %d deep", depth_max);
        const uint32_t id = add_one(w, *at.node, at.parent);
        if (r.root == 0)
            r.root = id;
        for (unsigned i = at.node->mNumChildren; at.node->mChildren && i-- > 0;)
            if (at.node->mChildren[i])
                open.push_back({at.node->mChildren[i], id, at.depth + 1});
    }
}
} // namespace assimp
