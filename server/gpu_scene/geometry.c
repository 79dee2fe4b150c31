/* SPDX-License-Identifier: MIT */
/* Packs meshes and sphere sets into the scene-wide buffers of shared/geometry.h. */
#include "gpu_scene/state.h"
#include "gpu_scene/unit_vector.h"

#include "shared/material.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct totals {
    uint64_t triangles, vertices, spheres;
    uint64_t close_vertices; /* behind the vertices: those of deforming geometries at shutter close */
    uint32_t flags;          /* GEOMETRY_HAS_* of all meshes */
};

static int by_id(const void *a, const void *b)
{
    uint32_t id_a = ((const struct gpu_scene_geometry *)a)->id, id_b = ((const struct gpu_scene_geometry *)b)->id;
    return id_a < id_b ? -1 : id_a > id_b;
}

static uint32_t mesh_flags(const struct scene_mesh *mesh)
{
    uint32_t flags = 0;
    if (mesh->arrays[MESH_NORMALS])
        flags |= GEOMETRY_HAS_NORMALS;
    /* The handedness is stored with the normals; and a tangent without a normal spans no frame. */
    if (mesh->arrays[MESH_TANGENTS] && mesh->arrays[MESH_NORMALS])
        flags |= GEOMETRY_HAS_TANGENTS;
    if (mesh->arrays[MESH_TEXCOORDS_0])
        flags |= GEOMETRY_HAS_TEXCOORDS_0;
    if (mesh->arrays[MESH_TEXCOORDS_1])
        flags |= GEOMETRY_HAS_TEXCOORDS_1;
    if (mesh->arrays[MESH_COLOURS])
        flags |= GEOMETRY_HAS_COLOURS;
    if (mesh->value.closed)
        flags |= GEOMETRY_CLOSED;
    return flags;
}

/* Finds meshes, by id, that nodes deform and that no other node shows undeformed. They have no rigid geometry
 * besides those of the nodes. */
static bool find_only_deformed(const struct gpu_scene *gpu, const struct scene *scene, struct hashmap *meshes)
{
    const struct gpu_scene_deform *deform = &gpu->state->deform;
    size_t cursor = 0;
    uint64_t id;
    void *value;
    bool ok = true;
    for (uint32_t i = 0; ok && i < deform->use_count; i++)
        ok = hashmap_put(meshes, deform->uses[i].mesh_id, &deform->uses[i]);
    while (ok && meshes->count > 0 && hashmap_next(&scene->objects[OBJECT_NODE], &cursor, &id, &value)) {
        const struct scene_node *node = value;
        const struct scene_mesh *mesh =
            node->value.kind == NODE_MESH ? scene_mesh(scene, node->value.object) : NULL;
        if (mesh && !scene_node_deforms(node, mesh))
            hashmap_remove(meshes, node->value.object);
    }
    return ok;
}

static void add_meshes(struct gpu_scene *gpu, const struct scene *scene, const struct hashmap *only_deformed)
{
    size_t cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_MESH], &cursor, &id, &value)) {
        const struct scene_mesh *mesh = value;
        if (hashmap_get(only_deformed, id))
            continue;
        struct gpu_scene_geometry *geometry = &gpu->geometries[gpu->geometry_count++];
        *geometry = (struct gpu_scene_geometry){.mesh = mesh, .id = (uint32_t)id, .revision = mesh->base.revision};
        memcpy(geometry->lower, mesh->lower, sizeof(geometry->lower));
        memcpy(geometry->upper, mesh->upper, sizeof(geometry->upper));
    }
    qsort(gpu->geometries, gpu->geometry_count, sizeof(*gpu->geometries), by_id);
}

static void add_sphere_sets(struct gpu_scene *gpu, const struct scene *scene)
{
    uint32_t first = gpu->geometry_count;
    size_t cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_SPHERES], &cursor, &id, &value)) {
        const struct scene_spheres *set = value;
        struct gpu_scene_geometry *geometry = &gpu->geometries[gpu->geometry_count++];
        *geometry =
            (struct gpu_scene_geometry){.spheres = set, .id = (uint32_t)id, .revision = set->base.revision};
        memcpy(geometry->lower, set->lower, sizeof(geometry->lower));
        memcpy(geometry->upper, set->upper, sizeof(geometry->upper));
    }
    qsort(gpu->geometries + first, gpu->geometry_count - first, sizeof(*gpu->geometries), by_id);
}

/* Lists meshes by id, then sphere sets by id, then deformed meshes by node: the same scene has the same order,
 * whatever its history. */
static bool list_geometries(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    const struct gpu_scene_deform *deform = &gpu->state->deform;
    struct hashmap only_deformed = {0};
    size_t total = scene->objects[OBJECT_MESH].count + scene->objects[OBJECT_SPHERES].count + deform->use_count;
    gpu_scene_drop_geometries(gpu);
    gpu->geometries = calloc(total ? total : 1, sizeof(*gpu->geometries));
    bool ok = gpu->geometries && find_only_deformed(gpu, scene, &only_deformed);
    if (ok) {
        add_meshes(gpu, scene, &only_deformed);
        add_sphere_sets(gpu, scene);
        gpu->state->rigid_count = gpu->geometry_count;
    }
    hashmap_finish(&only_deformed);
    for (uint32_t i = 0; ok && i < deform->use_count; i++)
        gpu->geometries[gpu->geometry_count++] = (struct gpu_scene_geometry){
            .mesh = scene_mesh(scene, deform->uses[i].mesh_id),
            .id = deform->uses[i].mesh_id,
            .revision = deform->uses[i].mesh_revision,
            .node = deform->uses[i].node,
        };
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %zu geometries", total);
}

/* Sets the offset of each geometry in the buffers. */
static struct totals lay_out(struct gpu_scene *gpu)
{
    struct totals totals = {0};
    for (uint32_t i = 0; i < gpu->geometry_count; i++) {
        struct gpu_scene_geometry *geometry = &gpu->geometries[i];
        if (geometry->mesh) {
            geometry->device = (struct geometry){
                .kind = GEOMETRY_MESH,
                .first_primitive = (uint32_t)totals.triangles,
                .primitive_count = geometry->mesh->value.triangle_count,
                .first_vertex = (uint32_t)totals.vertices,
                .vertex_count = geometry->mesh->value.vertex_count,
                .flags = mesh_flags(geometry->mesh),
            };
            totals.triangles += geometry->mesh->value.triangle_count;
            totals.vertices += geometry->mesh->value.vertex_count;
            totals.close_vertices += geometry->node ? geometry->mesh->value.vertex_count : 0;
            totals.flags |= geometry->device.flags;
        } else {
            geometry->device = (struct geometry){
                .kind = GEOMETRY_SPHERES,
                .first_primitive = (uint32_t)totals.spheres,
                .primitive_count = geometry->spheres->value.sphere_count,
            };
            totals.spheres += geometry->spheres->value.sphere_count;
        }
    }
    return totals;
}

static bool check_totals(const struct gpu_scene *gpu, const struct totals *totals, struct error *error)
{
    return gpu_scene_check_texels(gpu, totals->triangles, "triangles", error) &&
           gpu_scene_check_texels(gpu, totals->vertices + totals->close_vertices, "vertices", error) &&
           gpu_scene_check_texels(gpu, totals->spheres, "spheres", error);
}

/* Runs of primitives with one material: the ranges, and the default material in the gaps between them. */
struct run {
    uint32_t first, end, material_index;
};

static struct run next_run(const struct gpu_scene *gpu, const struct record_material_range *ranges,
                           uint32_t range_count, uint32_t *range, uint32_t at, uint32_t count)
{
    while (*range < range_count && (uint64_t)ranges[*range].first + ranges[*range].count <= at)
        ++*range;
    if (*range == range_count)
        return (struct run){.first = at, .end = count};
    const struct record_material_range *next = &ranges[*range];
    if (next->first > at)
        return (struct run){.first = at, .end = next->first < count ? next->first : count};
    uint64_t end = (uint64_t)next->first + next->count;
    return (struct run){.first = at,
                        .end = end < count ? (uint32_t)end : count,
                        .material_index = gpu_scene_material_index(gpu, next->material)};
}

static void pack_triangles(const struct gpu_scene *gpu, const struct gpu_scene_geometry *geometry, uint32_t *out)
{
    const struct scene_mesh *mesh = geometry->mesh;
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    uint32_t base = geometry->device.first_vertex, range = 0;
    out += (size_t)geometry->device.first_primitive * 4;
    for (uint32_t at = 0; at < mesh->value.triangle_count;) {
        struct run run = next_run(gpu, mesh->ranges, mesh->range_count, &range, at, mesh->value.triangle_count);
        for (size_t i = run.first; i < run.end; i++) {
            out[4 * i] = base + indices[3 * i];
            out[4 * i + 1] = base + indices[3 * i + 1];
            out[4 * i + 2] = base + indices[3 * i + 2];
            out[4 * i + 3] = run.material_index;
        }
        at = run.end;
    }
}

/* Packs positions; for deforming geometry the device computes them, with normals and tangents if there are any. */
static void pack_positions(const struct gpu_scene_geometry *geometry, float *out)
{
    if (geometry->node)
        return;
    const float *in = (const float *)(const void *)geometry->mesh->arrays[MESH_POSITIONS]->data;
    out += (size_t)geometry->device.first_vertex * 4;
    for (size_t i = 0; i < geometry->mesh->value.vertex_count; i++) {
        memcpy(&out[4 * i], &in[3 * i], 3 * sizeof(float));
        out[4 * i + 3] = 0.0f;
    }
}

/* Averages would spread a value that is not finite. */
static float finite_or_zero(float x)
{
    return isfinite(x) ? x : 0.0f;
}

static void pack_normals(const struct gpu_scene_geometry *geometry, float *out)
{
    const struct scene_mesh *mesh = geometry->mesh;
    out += (size_t)geometry->device.first_vertex * 4;
    if (!(geometry->device.flags & GEOMETRY_HAS_NORMALS)) {
        memset(out, 0, (size_t)mesh->value.vertex_count * 4 * sizeof(float));
        return;
    }
    if (geometry->node)
        return;
    const float *in = (const float *)(const void *)mesh->arrays[MESH_NORMALS]->data;
    const float *tangents = NULL;
    if (geometry->device.flags & GEOMETRY_HAS_TANGENTS)
        tangents = (const float *)(const void *)mesh->arrays[MESH_TANGENTS]->data;
    for (size_t i = 0; i < mesh->value.vertex_count; i++) {
        for (size_t k = 0; k < 3; k++)
            out[4 * i + k] = finite_or_zero(in[3 * i + k]);
        out[4 * i + 3] = tangents ? (tangents[4 * i + 3] < 0.0f ? -1.0f : 1.0f) : 0.0f;
    }
}

static void pack_tangents(const struct gpu_scene_geometry *geometry, uint32_t *out)
{
    const struct scene_mesh *mesh = geometry->mesh;
    out += geometry->device.first_vertex;
    if (!(geometry->device.flags & GEOMETRY_HAS_TANGENTS)) {
        memset(out, 0, (size_t)mesh->value.vertex_count * sizeof(*out));
        return;
    }
    if (geometry->node)
        return;
    const float *in = (const float *)(const void *)mesh->arrays[MESH_TANGENTS]->data;
    for (size_t i = 0; i < mesh->value.vertex_count; i++)
        out[i] = unit_vector_pack(&in[4 * i]);
}

static void pack_texcoords(const struct gpu_scene_geometry *geometry, float *out)
{
    const struct scene_mesh *mesh = geometry->mesh;
    out += (size_t)geometry->device.first_vertex * 4;
    for (unsigned set = 0; set < 2; set++) {
        const struct blob *blob = mesh->arrays[MESH_TEXCOORDS_0 + set];
        const float *in = blob ? (const float *)(const void *)blob->data : NULL;
        for (size_t i = 0; i < mesh->value.vertex_count; i++) {
            out[4 * i + 2 * set] = in ? finite_or_zero(in[2 * i]) : 0.0f;
            out[4 * i + 2 * set + 1] = in ? finite_or_zero(in[2 * i + 1]) : 0.0f;
        }
    }
}

/* Packs colours as four 16-bit values: bytes of linear light would show steps in dark colours. */
static void pack_colours(const struct gpu_scene_geometry *geometry, uint16_t *out)
{
    const struct scene_mesh *mesh = geometry->mesh;
    const size_t count = (size_t)mesh->value.vertex_count * 4;
    out += (size_t)geometry->device.first_vertex * 4;
    if (!mesh->arrays[MESH_COLOURS])
        memset(out, 0, count * sizeof(*out));
    else if (mesh_has_wide_colours(mesh))
        memcpy(out, mesh->arrays[MESH_COLOURS]->data, count * sizeof(*out));
    else
        for (size_t i = 0; i < count; i++)
            out[i] = (uint16_t)(mesh->arrays[MESH_COLOURS]->data[i] * 257);
}

/* Arrays written for each mesh. */
enum packed {
    PACKED_TRIANGLES,
    PACKED_POSITIONS,
    PACKED_NORMALS,
    PACKED_TANGENTS,
    PACKED_TEXCOORDS,
    PACKED_COLOURS
};

static void write_mesh(const struct gpu_scene *gpu, const struct gpu_scene_geometry *geometry, int packed,
                       void *out)
{
    switch ((enum packed)packed) {
    case PACKED_TRIANGLES:
        pack_triangles(gpu, geometry, out);
        gpu_scene_find_runs(geometry);
        break;
    case PACKED_POSITIONS:
        pack_positions(geometry, out);
        break;
    case PACKED_NORMALS:
        pack_normals(geometry, out);
        break;
    case PACKED_TANGENTS:
        pack_tangents(geometry, out);
        break;
    case PACKED_TEXCOORDS:
        pack_texcoords(geometry, out);
        break;
    case PACKED_COLOURS:
        pack_colours(geometry, out);
        break;
    }
}

static void write_meshes(const struct gpu_scene *gpu, const struct packing_part *part, const atomic_bool *stop)
{
    for (uint32_t i = 0; i < gpu->geometry_count && !atomic_load(stop); i++)
        if (gpu->geometries[i].mesh)
            write_mesh(gpu, &gpu->geometries[i], part->array, part->out);
}

static void write_spheres(const struct gpu_scene *gpu, const struct packing_part *part, const atomic_bool *stop)
{
    float *out = part->out;
    for (uint32_t i = 0; i < gpu->geometry_count && !atomic_load(stop); i++) {
        const struct gpu_scene_geometry *geometry = &gpu->geometries[i];
        if (!geometry->spheres)
            continue;
        memcpy(out + (size_t)geometry->device.first_primitive * 4, geometry->spheres->centres_radii->data,
               (size_t)geometry->spheres->value.sphere_count * 4 * sizeof(float));
        gpu_scene_find_runs(geometry);
    }
}

static void write_sphere_materials(const struct gpu_scene *gpu, const struct packing_part *part,
                                   const atomic_bool *stop)
{
    uint32_t *materials = part->out;
    for (uint32_t i = 0; i < gpu->geometry_count && !atomic_load(stop); i++) {
        const struct scene_spheres *set = gpu->geometries[i].spheres;
        uint32_t range = 0;
        for (uint32_t at = 0; set && at < set->value.sphere_count;) {
            struct run run = next_run(gpu, set->ranges, set->range_count, &range, at, set->value.sphere_count);
            for (; at < run.end; at++)
                materials[gpu->geometries[i].device.first_primitive + at] = run.material_index;
        }
    }
}

static void list_parts(struct gpu_scene *gpu, const struct totals *totals)
{
    const uint64_t moving = totals->triangles ? totals->vertices + totals->close_vertices : 0;
    const uint64_t resting = totals->triangles ? totals->vertices : 0;
    const struct {
        struct gpu_buffer *buffer;
        enum packed packed;
        uint64_t bytes;
        uint32_t flags; /* flags of the meshes that need it; 0: always needed */
    } rows[] = {
        {&gpu->triangles, PACKED_TRIANGLES, totals->triangles * 4 * sizeof(uint32_t), 0},
        {&gpu->positions, PACKED_POSITIONS, moving * 4 * sizeof(float), 0},
        {&gpu->normals, PACKED_NORMALS, moving * 4 * sizeof(float), GEOMETRY_HAS_NORMALS},
        {&gpu->tangents, PACKED_TANGENTS, moving * sizeof(uint32_t), GEOMETRY_HAS_TANGENTS},
        {&gpu->texcoords, PACKED_TEXCOORDS, resting * 4 * sizeof(float),
         GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1},
        {&gpu->colours, PACKED_COLOURS, resting * 4 * sizeof(uint16_t), GEOMETRY_HAS_COLOURS},
    };
    struct packing *packing = &gpu->state->packing;
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        const bool needed = !rows[i].flags || (totals->flags & rows[i].flags);
        packing_add(packing, &(struct packing_part){.buffer = rows[i].buffer,
                                                    .bytes = needed ? (size_t)rows[i].bytes : 0,
                                                    .write = write_meshes,
                                                    .array = (int)rows[i].packed});
    }
    gpu->has_spheres = totals->spheres > 0;
    packing_add(packing, &(struct packing_part){.buffer = &gpu->spheres,
                                                .bytes = (size_t)totals->spheres * 4 * sizeof(float),
                                                .write = write_spheres});
    packing_add(packing, &(struct packing_part){.buffer = &gpu->sphere_materials,
                                                .bytes = (size_t)totals->spheres * sizeof(uint32_t),
                                                .write = write_sphere_materials});
}

/* Updates pointers into the host's scene: an edit of another object may have moved them. */
static void refresh_pointers(struct gpu_scene *gpu, const struct scene *scene)
{
    for (uint32_t i = 0; i < gpu->geometry_count; i++) {
        struct gpu_scene_geometry *geometry = &gpu->geometries[i];
        if (geometry->mesh)
            geometry->mesh = scene_mesh(scene, geometry->id);
        else
            geometry->spheres = scene_spheres(scene, geometry->id);
    }
}

static uint64_t signature_of(const struct scene *scene)
{
    return gpu_scene_signature(scene, OBJECT_MESH) * 3 + gpu_scene_signature(scene, OBJECT_SPHERES) +
           gpu_scene_deform_signature(scene) * 5;
}

bool gpu_scene_list_geometry(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    uint64_t signature = signature_of(scene);
    if (gpu->state->any_update && signature == gpu->state->shapes_signature) {
        refresh_pointers(gpu, scene);
        return true;
    }
    if (!gpu_scene_deform_list(&gpu->state->deform, scene, error) || !list_geometries(gpu, scene, error))
        return false;
    struct totals totals = lay_out(gpu);
    for (uint32_t i = 0; i < gpu->geometry_count; i++)
        if (!gpu_scene_reserve_runs(&gpu->geometries[i], error))
            return false;
    gpu->state->close_vertex = (uint32_t)totals.vertices;
    gpu->state->stale_tables = true;
    gpu->state->brought.bits |= CHANGED_GEOMETRY;
    gpu->state->shapes_signature = signature;
    if (!check_totals(gpu, &totals, error))
        return false;
    list_parts(gpu, &totals);
    return gpu_scene_deform_list_rest(gpu, scene, error);
}

/* Classifies the features that a material needs of the tracers, by its state at shutter open. */
static void classify_material(struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose,
                              uint32_t material_id, uint32_t *geometry_flags)
{
    const struct scene_material *material = scene_material(scene, material_id);
    if (!material)
        return;
    material = scene_pose_material(pose, material);
    if (material->value.alpha_mode == ALPHA_MASK) {
        *geometry_flags |= GEOMETRY_HAS_CUTOUT;
        gpu->has_cutout = true;
    }
    if (material->value.alpha_mode == ALPHA_BLEND || material->value.transmission > 0.0f)
        gpu->has_translucent = true;
    gpu->has_transmission |= material->value.transmission > 0.0f;
    gpu->has_tangents |=
        material->textures[MATERIAL_NORMAL].texture || material->textures[MATERIAL_BUMP].texture ||
        material->textures[MATERIAL_CLEARCOAT_NORMAL].texture || material->value.anisotropy != 0.0f;
    bool varies =
        material->textures[MATERIAL_BASE_COLOUR].texture || material->textures[MATERIAL_TRANSMISSION].texture ||
        material->textures[MATERIAL_METALLIC_ROUGHNESS].texture || (*geometry_flags & GEOMETRY_HAS_COLOURS);
    gpu->has_varied_alpha |=
        varies && (material->value.alpha_mode != ALPHA_OPAQUE || material->value.transmission > 0.0f);
}

void gpu_scene_classify_geometry(struct gpu_scene *gpu, const struct scene *scene,
                                 const struct scene_motion *motion)
{
    const struct scene_pose *pose = motion ? &motion->poses[0] : NULL;
    gpu->has_cutout = false;
    gpu->has_translucent = false;
    gpu->has_transmission = false;
    gpu->has_varied_alpha = false;
    gpu->has_texcoords = gpu->has_colours = gpu->has_tangents = false;
    for (uint32_t i = 0; i < gpu->geometry_count; i++) {
        struct gpu_scene_geometry *geometry = &gpu->geometries[i];
        const struct record_material_range *ranges =
            geometry->mesh ? geometry->mesh->ranges : geometry->spheres->ranges;
        uint32_t range_count = geometry->mesh ? geometry->mesh->range_count : geometry->spheres->range_count;
        uint32_t flags = geometry->device.flags & ~GEOMETRY_HAS_CUTOUT;
        for (uint32_t k = 0; k < range_count; k++)
            if (ranges[k].count > 0)
                classify_material(gpu, scene, pose, ranges[k].material, &flags);
        if (flags != geometry->device.flags)
            gpu->state->stale_tables = true;
        geometry->device.flags = flags;
        gpu->has_texcoords |= (flags & (GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1)) != 0;
        gpu->has_colours |= (flags & GEOMETRY_HAS_COLOURS) != 0;
        gpu->has_tangents |= (flags & GEOMETRY_HAS_TANGENTS) != 0;
    }
    size_t cursor = 0;
    uint64_t id;
    void *value;
    uint32_t ignored = 0;
    while (hashmap_next(&scene->objects[OBJECT_DISC], &cursor, &id, &value))
        classify_material(gpu, scene, pose, ((const struct scene_disc *)value)->value.material, &ignored);
}
