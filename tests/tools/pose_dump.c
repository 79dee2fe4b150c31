/* SPDX-License-Identifier: MIT */
/* Where a model's triangles are at some times of a clip, as the daemon has it: the importer's edits in a scene of
 * this process, its poses, its deformation. For tests that know where they should be.
 *
 *   pose_dump MODEL CLIP TIME..     CLIP: its number from 0 in the order of the import, or - for none
 *
 * "time T" for each TIME, in it "node NAME" for each visible mesh, in the order of the import, in it "c X Y Z NX
 * NY NZ" for each corner: place and normal in world space, the normal 0 0 0 where the mesh has none. Exit status
 * 1: it says why. */
#include "scene/affine.h"
#include "scene/pose.h"
#include "tests/fixtures/load_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct shown {
    float *positions, *normals;
};

static bool make_room(struct shown *shown, const struct scene_mesh *mesh, struct error *error)
{
    const size_t bytes = (size_t)mesh->value.vertex_count * 3 * sizeof(float);
    *shown = (struct shown){malloc(bytes), calloc(1, bytes)};
    return (shown->positions && shown->normals) || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
}

static void transform(const float m[12], float point[3], float normal[3])
{
    const double p[3] = {(double)point[0], (double)point[1], (double)point[2]};
    const double n[3] = {(double)normal[0], (double)normal[1], (double)normal[2]};
    double out[3], length = 0, determinant = 0;
    for (int row = 0; row < 3; row++) {
        const float *a = m + 4 * ((row + 1) % 3), *b = m + 4 * ((row + 2) % 3);
        point[row] = (float)((double)m[4 * row] * p[0] + (double)m[4 * row + 1] * p[1] +
                             (double)m[4 * row + 2] * p[2] + (double)m[4 * row + 3]);
        out[row] = 0;
        for (int column = 0; column < 3; column++) {
            const int c1 = (column + 1) % 3, c2 = (column + 2) % 3;
            const double cofactor = (double)a[c1] * (double)b[c2] - (double)a[c2] * (double)b[c1];
            out[row] += cofactor * n[column];
            determinant += row == 0 ? cofactor * (double)m[column] : 0;
        }
        length += out[row] * out[row];
    }
    for (int row = 0; row < 3 && length > 0; row++)
        normal[row] = (float)(out[row] / sqrt(length) * (determinant < 0 ? -1 : 1));
}

static void print_corners(const struct scene_mesh *mesh, const struct shown *shown, const float *world_from_node)
{
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    for (size_t i = 0; i < (size_t)mesh->value.triangle_count * 3; i++) {
        float p[3], n[3];
        memcpy(p, shown->positions + (size_t)indices[i] * 3, sizeof(p));
        memcpy(n, shown->normals + (size_t)indices[i] * 3, sizeof(n));
        if (world_from_node)
            transform(world_from_node, p, n);
        printf("c %.9g %.9g %.9g %.9g %.9g %.9g\n", (double)p[0], (double)p[1], (double)p[2], (double)n[0],
               (double)n[1], (double)n[2]);
    }
}

static bool print_node(const struct scene *scene, const struct scene_pose *pose,
                       const struct scene_instance *instance, struct error *error)
{
    const struct scene_node *node = instance->node;
    const struct scene_mesh *mesh = scene_mesh(scene, node->value.object);
    const bool has_skin = node->value.skin && mesh->value.influence_count > 0;
    struct shown shown = {0};
    bool fine =
        make_room(&shown, mesh, error) && scene_deform(scene, pose, node, shown.positions, shown.normals, error);
    if (fine) {
        printf("node %s\n", node->base.name);
        print_corners(mesh, &shown, has_skin ? NULL : instance->world_from_object);
    }
    free(shown.positions);
    free(shown.normals);
    return fine;
}

static bool print_time(const struct scene *scene, uint32_t clip, const char *time, struct error *error)
{
    const struct record_clip_use use = {.clip = clip, .speed = 1};
    struct scene_pose pose = {0};
    struct scene_instance *instances = NULL;
    size_t count = 0;
    bool fine = clip == 0 || scene_pose_evaluate(&pose, scene, &use, 1, strtod(time, NULL), error);
    if (fine && !scene_flatten(scene, &pose, NODE_MESH, &instances, &count))
        fine = error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    if (fine)
        printf("time %s\n", time);
    for (size_t i = 0; i < count && fine; i++)
        fine = print_node(scene, &pose, &instances[i], error);
    free(instances);
    scene_pose_finish(&pose);
    return fine;
}

static uint32_t clip_of(const char *text)
{
    return strcmp(text, "-") == 0 ? 0 : (uint32_t)strtoul(text, NULL, 10) + 1; /* the importer counts from 1 */
}

int main(int argc, char **argv)
{
    struct loaded_model model;
    struct error error = {0};
    if (argc < 4) {
        fprintf(stderr, "usage: pose_dump MODEL CLIP TIME..\n");
        return 2;
    }
    bool fine = load_model(&model, argv[1], &error);
    for (int i = 3; i < argc && fine; i++)
        fine = print_time(model.scene, clip_of(argv[2]), argv[i], &error);
    load_model_finish(&model);
    if (!fine)
        fprintf(stderr, "pose_dump: %s: %s\n", error.field, error.text);
    return fine ? 0 : 1;
}
