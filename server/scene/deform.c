/* SPDX-License-Identifier: MIT */
/* Deforms meshes: morph targets, then joints (glTF 2.0, sections 3.7.2.2 and 3.7.3). Sums are in double; tests
 * compare the GPU's results with these. */
#include "scene/affine.h"
#include "scene/pose.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float *floats_of(const struct blob *blob)
{
    return blob ? (const float *)(const void *)blob->data : NULL;
}

static bool normalise(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3 && length > 0.0; i++)
        v[i] /= length;
    return length > 0.0 && isfinite(length);
}

/* Adds the targets' offsets to the mesh's vertices. */
static void morph(const struct scene_mesh *mesh, enum mesh_array base, enum mesh_array added, const float *weights,
                  float *out)
{
    size_t count = (size_t)mesh->value.vertex_count * 3;
    const float *from = floats_of(mesh->arrays[base]), *targets = floats_of(mesh->arrays[added]);
    for (size_t i = 0; i < count; i++) {
        double sum = (double)from[i];
        for (uint32_t target = 0; targets && target < mesh->value.target_count; target++)
            sum += (double)weights[target] * (double)targets[target * count + i];
        out[i] = (float)sum;
    }
}

/* Mean of the joints' matrices, weighted for the vertex. False: it has no weights, and stays unchanged. */
static bool blend(const struct scene_mesh *mesh, const float *world_from_mesh, size_t vertex, double m[12])
{
    uint32_t count = mesh->value.influence_count;
    const uint16_t *joints = (const uint16_t *)(const void *)mesh->arrays[MESH_JOINTS]->data + vertex * count;
    const float *weights = floats_of(mesh->arrays[MESH_WEIGHTS]) + vertex * count;
    double sum = 0.0;
    memset(m, 0, 12 * sizeof(*m));
    for (uint32_t i = 0; i < count; i++) {
        const float *matrix = world_from_mesh + (size_t)joints[i] * 12;
        sum += (double)weights[i];
        for (int k = 0; k < 12 && weights[i] != 0.0f; k++)
            m[k] += (double)weights[i] * (double)matrix[k];
    }
    for (int k = 0; k < 12 && sum > 0.0; k++)
        m[k] /= sum;
    return sum > 0.0;
}

static void make_unit(float *normals, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        double n[3] = {(double)normals[3 * i], (double)normals[3 * i + 1], (double)normals[3 * i + 2]};
        if (normalise(n)) {
            for (int k = 0; k < 3; k++)
                normals[3 * i + (size_t)k] = (float)n[k];
        }
    }
}

static void move_point(const double m[12], float point[3])
{
    double x = (double)point[0], y = (double)point[1], z = (double)point[2];
    for (int row = 0; row < 3; row++)
        point[row] = (float)(m[4 * row] * x + m[4 * row + 1] * y + m[4 * row + 2] * z + m[4 * row + 3]);
}

/* Transforms a normal by the cofactors, which are the inverse transpose up to a factor; its sign keeps a
 * mirrored normal outside. */
static void move_normal(const double m[12], float normal[3])
{
    double out[3], determinant = 0.0;
    for (int row = 0; row < 3; row++) {
        const double *p = m + 4 * ((row + 1) % 3), *q = m + 4 * ((row + 2) % 3);
        out[row] = 0.0;
        for (int column = 0; column < 3; column++) {
            int c1 = (column + 1) % 3, c2 = (column + 2) % 3;
            double cofactor = p[c1] * q[c2] - p[c2] * q[c1];
            out[row] += cofactor * (double)normal[column];
            determinant += row == 0 ? cofactor * m[column] : 0.0;
        }
    }
    if (!normalise(out))
        return;
    for (int i = 0; i < 3; i++)
        normal[i] = (float)(determinant < 0.0 ? -out[i] : out[i]);
}

static void skin_vertices(const struct scene_mesh *mesh, const float *world_from_mesh, float *positions,
                          float *normals)
{
    for (size_t vertex = 0; vertex < mesh->value.vertex_count; vertex++) {
        double m[12];
        if (!blend(mesh, world_from_mesh, vertex, m))
            continue;
        move_point(m, positions + vertex * 3);
        if (normals)
            move_normal(m, normals + vertex * 3);
    }
}

bool scene_deform(const struct scene *scene, const struct scene_pose *pose, const struct scene_node *node,
                  float *positions, float *normals, struct error *error)
{
    const struct scene_mesh *mesh = node->value.kind == NODE_MESH ? scene_mesh(scene, node->value.object) : NULL;
    if (!mesh)
        return error_set(error, ERROR_INVALID, "node", "node %u shows no mesh", node->base.id);
    const struct scene_skin *skin =
        node->value.skin && mesh->value.influence_count ? scene_skin(scene, node->value.skin) : NULL;
    float *matrices = skin ? malloc((size_t)skin->value.joint_count * 12 * sizeof(*matrices)) : NULL;
    float *weights = malloc(((size_t)mesh->value.target_count + 1) * sizeof(*weights));
    bool fine = weights && (!skin || matrices);
    if (!fine)
        error_set(error, ERROR_OUT_OF_MEMORY, "node", "no memory to deform the mesh of node %u", node->base.id);
    if (fine && skin)
        fine = scene_skin_matrices(scene, pose, skin, matrices, error);
    if (fine) {
        float *moved_normals = mesh->arrays[MESH_NORMALS] ? normals : NULL;
        scene_pose_weights(pose, node, mesh, weights);
        morph(mesh, MESH_POSITIONS, MESH_TARGET_POSITIONS, weights, positions);
        if (moved_normals) {
            morph(mesh, MESH_NORMALS, MESH_TARGET_NORMALS, weights, moved_normals);
            make_unit(moved_normals, mesh->value.vertex_count);
        }
        if (skin)
            skin_vertices(mesh, matrices, positions, moved_normals);
    }
    free(matrices);
    free(weights);
    return fine;
}
