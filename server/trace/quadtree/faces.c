/* SPDX-License-Identifier: MIT */
/* Faces of a view: one of its own, or the cube round its eye; and which of them instances reach. */
#include "trace/quadtree/faces.h"

#include <math.h>
#include <string.h>

/* ---- placement ---- */

/* The axes of a view: right, down and forward. */
static void axes_of(const struct trace_view *view, vec4 axes[3])
{
    const float *m = view->world_from_view;
    for (int i = 0; i < 3; i++) {
        axes[0][i] = m[4 * i];
        axes[1][i] = -m[4 * i + 1];
        axes[2][i] = -m[4 * i + 2];
    }
}

void quadtree_place_view(struct quadtree_uniforms *uniforms, const struct trace_view *texels)
{
    const bool orthographic = texels->fov_y == 0.0f;
    const float half_height = orthographic ? texels->ortho_height / 2.0f : tanf(texels->fov_y / 2.0f);
    axes_of(texels, uniforms->face_from_world);
    uniforms->faces = 1;
    uniforms->width = texels->width;
    uniforms->height = texels->height;
    uniforms->scale_centre[0] = uniforms->scale_centre[1] = (float)texels->height / 2.0f / half_height;
}

/* Face 2 a looks along axis a of the view, face 2 a + 1 against it; right, down and forward are right-handed. The
 * picture lies in one face where its angle allows it: a ray that stays there reads no other. */
void quadtree_place_cube(struct quadtree_uniforms *uniforms, const struct trace_view *view, uint32_t texels)
{
    vec4 axes[3] = {{0}};
    axes_of(view, axes);
    for (int face = 0; face < 6; face++) {
        const int axis = face / 2, side = face % 2;
        vec4 *rows = &uniforms->face_from_world[3 * face];
        for (int i = 0; i < 3; i++) {
            rows[0][i] = axes[(axis + 1 + side) % 3][i];
            rows[1][i] = axes[(axis + 2 - side) % 3][i];
            rows[2][i] = side ? -axes[axis][i] : axes[axis][i];
        }
    }
    uniforms->faces = 6;
    uniforms->width = uniforms->height = texels;
    uniforms->scale_centre[0] = uniforms->scale_centre[1] = (float)texels / 2.0f;
}

/* ---- visibility ---- */

struct raster_camera quadtree_face_camera(const struct quadtree_uniforms *uniforms, uint32_t face)
{
    const vec4 *rows = &uniforms->face_from_world[(size_t)face * 3];
    struct raster_camera camera = {
        .near = uniforms->depths[3],
        .far = uniforms->depths[1],
        .orthographic = uniforms->depths[2] != 0.0f,
        .width = uniforms->width,
        .height = uniforms->height,
    };
    for (int i = 0; i < 3; i++) {
        camera.world_from_view[4 * i] = rows[0][i];
        camera.world_from_view[4 * i + 1] = -rows[1][i];
        camera.world_from_view[4 * i + 2] = -rows[2][i];
        camera.world_from_view[4 * i + 3] = uniforms->eye_world[i];
    }
    camera.extent[0] = (float)uniforms->width / 2.0f / uniforms->scale_centre[0];
    camera.extent[1] = (float)uniforms->height / 2.0f / uniforms->scale_centre[1];
    return camera;
}

static void view_of(float view[3], const struct raster_camera *camera, const float world[3])
{
    const float *m = camera->world_from_view;
    for (int k = 0; k < 3; k++)
        view[k] = (world[0] - m[3]) * m[k] + (world[1] - m[7]) * m[4 + k] + (world[2] - m[11]) * m[8 + k];
}

/* The sides of the frustum that a ball lies beyond, as bits. */
static unsigned beyond(const struct raster_camera *camera, const float world[3], float radius)
{
    float v[3];
    view_of(v, camera, world);
    /* Slightly wider, for rounding. */
    const float reach = (camera->orthographic ? 1.0f : -v[2]) * 1.0001f;
    unsigned sides = 0;
    for (int k = 0; k < 2; k++) {
        const float extent = camera->extent[k], side = extent * reach;
        const float slack = radius * (camera->orthographic ? 1.0f : sqrtf(1.0f + extent * extent));
        sides |= v[k] < -side - slack ? 1u << 2 * k : 0;
        sides |= v[k] > side + slack ? 2u << 2 * k : 0;
    }
    return sides | (-v[2] + radius < camera->near ? 16u : 0);
}

bool quadtree_is_beside(const struct raster_camera *camera, const struct gpu_scene *scene, uint32_t instance)
{
    float bounds[2][3];
    unsigned all = ~0u;
    gpu_scene_instance_bounds(scene, instance, bounds[0], bounds[1]);
    for (int corner = 0; corner < 8; corner++) {
        const float point[3] = {bounds[corner & 1][0], bounds[corner >> 1 & 1][1], bounds[corner >> 2][2]};
        all &= beyond(camera, point, 0.0f);
    }
    return all != 0;
}

static void world_of(float world[3], const struct instance *instance, const float object[3])
{
    for (int r = 0; r < 3; r++) {
        const float *m = instance->world_from_object[r];
        world[r] = m[0] * object[0] + m[1] * object[1] + m[2] * object[2] + m[3];
    }
}

bool quadtree_is_run_beside(const struct raster_camera *camera, const struct quadtree_runs *runs,
                            const struct gpu_scene *scene, uint32_t instance, uint32_t run)
{
    const struct quadtree_run_box *box = quadtree_run_box(runs, scene, instance, run);
    unsigned all = box ? ~0u : 0u;
    for (int corner = 0; corner < 8 && all != 0; corner++) {
        const float object[3] = {(corner & 1 ? box->upper : box->lower)[0],
                                 (corner & 2 ? box->upper : box->lower)[1],
                                 (corner & 4 ? box->upper : box->lower)[2]};
        float world[3];
        world_of(world, &scene->instances[instance], object);
        all &= beyond(camera, world, 0.0f);
    }
    return all != 0;
}

/* Sides of a face's frustum. Each can add one corner to a clipped triangle. */
#define SIDES 5
#define CORNERS_MAX (3 + SIDES)

/* Distance of a point of the view (right, up, backward) within a side; slightly more, for rounding. */
static float within(const struct raster_camera *camera, const float v[3], int side)
{
    const float reach = (camera->orthographic ? 1.0f : -v[2]) + 1e-4f * fabsf(v[2]);
    if (side == 4)
        return -v[2] - camera->near;
    const int k = side / 2;
    return camera->extent[k] * reach + (side % 2 ? -v[k] : v[k]);
}

/* Clips a polygon to a side; returns its number of corners. */
static int cut(const struct raster_camera *camera, float corners[CORNERS_MAX][3], int count, int side)
{
    float kept[CORNERS_MAX][3];
    int n = 0;
    for (int i = 0; i < count; i++) {
        const float *a = corners[i], *b = corners[(i + 1) % count];
        const float d_a = within(camera, a, side), d_b = within(camera, b, side);
        if (d_a >= 0.0f)
            memcpy(kept[n++], a, sizeof(kept[0]));
        if (n < CORNERS_MAX && (d_a >= 0.0f) != (d_b >= 0.0f)) {
            const float share = d_a / (d_a - d_b);
            for (int k = 0; k < 3; k++)
                kept[n][k] = a[k] + (b[k] - a[k]) * share;
            n++;
        }
    }
    memcpy(corners, kept, (size_t)n * sizeof(kept[0]));
    return n;
}

/* Whether a triangle misses the frustum. A large one, of a floor for example, may miss it although no single
 * side has all of it beyond. */
static bool is_triangle_beside(const struct raster_camera *camera, const struct instance *instance,
                               const struct scene_mesh *mesh, uint32_t triangle)
{
    const uint32_t *corner =
        (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data + 3 * (size_t)triangle;
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    float corners[CORNERS_MAX][3];
    unsigned all = ~0u;
    for (int i = 0; i < 3; i++) {
        float world[3];
        world_of(world, instance, &positions[3 * (size_t)corner[i]]);
        all &= beyond(camera, world, 0.0f);
        view_of(corners[i], camera, world);
    }
    int count = all != 0 ? 0 : 3;
    for (int side = 0; side < SIDES && count > 0; side++)
        count = cut(camera, corners, count, side);
    return count == 0;
}

static bool is_sphere_beside(const struct raster_camera *camera, const struct instance *instance,
                             const struct scene_spheres *spheres, uint32_t sphere)
{
    const float *at = (const float *)(const void *)spheres->centres_radii->data + 4 * (size_t)sphere;
    float world[3], squares = 0.0f;
    world_of(world, instance, at);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            squares += instance->world_from_object[r][c] * instance->world_from_object[r][c];
    return beyond(camera, world, at[3] * sqrtf(squares)) != 0; /* their sum bounds the growth along each axis */
}

/* Primitives tested for a face: about a millisecond's worth. A face with more counts as not empty. */
#define PRIMITIVES_TESTED (1u << 16)

/* Whether all primitives of a span lie beside the face. A mesh that deforms leaves its original place, so it
 * never does. *left: what remains of PRIMITIVES_TESTED. */
static bool are_all_beside(const struct raster_camera *camera, const struct gpu_scene *scene,
                           struct raster_span span, uint32_t *left)
{
    const uint32_t instance = span.instance, count = span.end - span.first;
    const struct gpu_scene_geometry *geometry = &scene->geometries[scene->instances[instance].geometry];
    bool beside = geometry->node == 0 && count <= *left;
    *left -= beside ? count : 0;
    for (uint32_t i = span.first; beside && i < span.end; i++)
        beside = geometry->mesh ? is_triangle_beside(camera, &scene->instances[instance], geometry->mesh, i)
                                : is_sphere_beside(camera, &scene->instances[instance], geometry->spheres, i);
    return beside;
}

static bool is_instance_beside(const struct raster_camera *camera, const struct quadtree_runs *runs,
                               const struct gpu_scene *scene, uint32_t instance, uint32_t *left)
{
    const uint32_t count =
        quadtree_is_beside(camera, scene, instance) ? 0 : quadtree_runs_of(runs, scene, instance);
    bool beside = true;
    for (uint32_t run = 0; beside && run < count; run++)
        beside = quadtree_is_run_beside(camera, runs, scene, instance, run) ||
                 are_all_beside(camera, scene, quadtree_run_span(runs, scene, instance, run), left);
    return beside;
}

static bool is_empty(const struct quadtree_uniforms *uniforms, const struct gpu_scene *scene,
                     const struct quadtree_runs *runs, uint32_t face)
{
    const struct raster_camera camera = quadtree_face_camera(uniforms, face);
    uint32_t left = PRIMITIVES_TESTED;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (!is_instance_beside(&camera, runs, scene, i, &left))
            return false;
    for (uint32_t i = 0; i < scene->disc_count; i++) {
        const float *ball = scene->discs[i].centre_radius; /* encloses the disc */
        if (beyond(&camera, ball, ball[3]) == 0)
            return false;
    }
    return true;
}

void quadtree_drop_empty_faces(struct quadtree_uniforms *uniforms, const struct gpu_scene *scene,
                               const struct quadtree_runs *runs)
{
    uint32_t kept = 0;
    if (uniforms->faces == 1)
        return;
    for (uint32_t face = 0; face < uniforms->faces; face++) {
        vec4 *rows = uniforms->face_from_world;
        if (!is_empty(uniforms, scene, runs, face))
            memmove(&rows[3 * (size_t)kept++], &rows[3 * (size_t)face], 3 * sizeof(rows[0]));
    }
    uniforms->faces = kept > 0 ? kept : 1;
}
