/* SPDX-License-Identifier: MIT */
/* Deforms vertices: compares each node's pose with its current vertices, and runs a pass of
 * shaders/gpu_scene/deform.comp over those that differ. Per frame only joint matrices and target weights are
 * uploaded. */
#include "gpu_scene/deform.h"

#include "gpu/barrier.h"
#include "gpu/program.h"
#include "scene/affine.h"
#include "shared/bindings.h"
#include "gpu_scene/state.h"

#include <epoxy/gl.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A pass over the vertices of one use, for shutter open or close. */
struct pass {
    uint32_t use;
    bool closes;
    uint32_t first_joint, first_morph, morph_count; /* places in the parameters */
};

struct work {
    struct gpu_scene *gpu;
    const struct scene *scene;
    struct pass *passes; /* at most 2 per use */
    uint32_t pass_count;
    float (*parameters)[4];
    size_t parameter_count, parameter_capacity;
};

/* ---- values of a pose ---- */

static const struct scene_skin *skin_of(const struct scene *scene, const struct deform_use *use)
{
    return use->skin ? scene_skin(scene, use->skin) : NULL;
}

/* Values of a use in a pose, to be freed; NULL and *error. */
static float *values_of(const struct scene *scene, const struct scene_pose *pose, const struct deform_use *use,
                        uint32_t *count, struct error *error)
{
    const struct scene_mesh *mesh = scene_mesh(scene, use->mesh_id);
    const struct scene_skin *skin = skin_of(scene, use);
    size_t joint_floats = skin ? (size_t)skin->value.joint_count * 12 : 0;
    float *values = malloc((joint_floats + mesh->value.target_count + 1) * sizeof(*values));
    if (!values) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the joints of node %u", use->node);
        return NULL;
    }
    if (skin && !scene_skin_matrices(scene, pose, skin, values, error)) {
        free(values);
        return NULL;
    }
    scene_pose_weights(pose, scene_node(scene, use->node), mesh, values + joint_floats);
    *count = (uint32_t)joint_floats + mesh->value.target_count;
    return values;
}

/* ---- bounds ---- */

static void join(struct deform_box *box, const float lower[3], const float upper[3])
{
    for (int k = 0; k < 3; k++) {
        /* A vertex that overflows is undefined; the device puts it at 0. */
        bool fine = isfinite(lower[k]) && isfinite(upper[k]);
        box->lower[k] = fminf(box->lower[k], fine ? lower[k] : -FLT_MAX);
        box->upper[k] = fmaxf(box->upper[k], fine ? upper[k] : FLT_MAX);
    }
}

/* Bounds a mesh in a pose. A vertex is the weighted mean of its positions under each joint, so it lies in the
 * hull of each joint's transformed box of its vertices, enlarged by the targets' maximum offset. */
static void grow_by_pose(struct deform_box *box, const struct scene_mesh *mesh, const struct deform_mesh *rest,
                         const float *values, bool has_skin, uint32_t joint_count)
{
    const float *weights = values + (size_t)joint_count * 12;
    struct deform_box added = {{0}, {0}};
    for (uint32_t target = 0; target < mesh->value.target_count; target++)
        for (int k = 0; k < 3; k++) {
            float a = weights[target] * rest->targets[target].lower[k];
            float b = weights[target] * rest->targets[target].upper[k];
            added.lower[k] += fminf(a, b);
            added.upper[k] += fmaxf(a, b);
        }
    uint32_t count = has_skin ? (rest->joint_count < joint_count ? rest->joint_count : joint_count) + 1 : 1;
    for (uint32_t joint = 0; joint < count; joint++) {
        bool moved = joint + 1 < count; /* no joint moves the last box */
        float lower[3], upper[3];
        for (int k = 0; k < 3; k++) {
            lower[k] = moved ? rest->joints[joint].lower[k] : has_skin ? rest->unmoved.lower[k] : mesh->lower[k];
            upper[k] = moved ? rest->joints[joint].upper[k] : has_skin ? rest->unmoved.upper[k] : mesh->upper[k];
        }
        if (lower[0] > upper[0])
            continue;
        for (int k = 0; k < 3; k++) {
            lower[k] += added.lower[k];
            upper[k] += added.upper[k];
        }
        if (moved)
            affine_bounds(lower, upper, values + (size_t)joint * 12, lower, upper);
        join(box, lower, upper);
    }
}

static void find_box(struct deform_use *use, const struct scene *scene, const struct deform_mesh *rest)
{
    const struct scene_mesh *mesh = scene_mesh(scene, use->mesh_id);
    uint32_t joint_count = (use->value_count - mesh->value.target_count) / 12;
    use->box = (struct deform_box){{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
    grow_by_pose(&use->box, mesh, rest, use->open, use->skin != 0, joint_count);
    if (use->close)
        grow_by_pose(&use->box, mesh, rest, use->close, use->skin != 0, joint_count);
}

/* ---- list of passes ---- */

static bool add_parameters(struct work *work, size_t count)
{
    if (count <= work->parameter_capacity - work->parameter_count)
        return true;
    size_t capacity = (work->parameter_count + count) * 2;
    float(*larger)[4] = realloc(work->parameters, capacity * sizeof(*larger));
    if (!larger)
        return false;
    work->parameters = larger;
    work->parameter_capacity = capacity;
    return true;
}

/* Adds a pass; targets without weight are skipped. */
static bool add_pass(struct work *work, uint32_t use_index, bool closes)
{
    const struct deform_use *use = &work->gpu->state->deform.uses[use_index];
    const float *values = closes ? use->close : use->open;
    uint32_t target_count = scene_mesh(work->scene, use->mesh_id)->value.target_count;
    uint32_t joint_floats = use->value_count - target_count;
    if (!add_parameters(work, (size_t)joint_floats / 4 + target_count))
        return false;
    struct pass *pass = &work->passes[work->pass_count++];
    *pass = (struct pass){.use = use_index, .closes = closes, .first_joint = (uint32_t)work->parameter_count};
    if (joint_floats)
        memcpy(work->parameters[work->parameter_count], values, joint_floats * sizeof(*values));
    work->parameter_count += joint_floats / 4;
    pass->first_morph = (uint32_t)work->parameter_count;
    for (uint32_t target = 0; target < target_count; target++) {
        if (values[joint_floats + target] == 0.0f)
            continue;
        float texel[4] = {values[joint_floats + target], (float)target, 0.0f, 0.0f};
        memcpy(work->parameters[work->parameter_count++], texel, sizeof(texel));
        pass->morph_count++;
    }
    return true;
}

static bool same_values(const float *a, const float *b, size_t count)
{
    return a && b && memcmp(a, b, count * sizeof(*a)) == 0;
}

/* Copies the poses' values to the use, and lists the passes that they need. */
static bool update_use(struct work *work, uint32_t use_index, const struct scene_motion *motion,
                       struct scene_changes *changes, struct error *error)
{
    struct gpu_scene_deform *deform = &work->gpu->state->deform;
    struct deform_use *use = &deform->uses[use_index];
    const struct scene_pose *first = motion ? &motion->poses[0] : NULL;
    uint32_t count = 0;
    float *open = values_of(work->scene, first, use, &count, error), *close = NULL;
    if (!open)
        return false;
    if (motion && motion->pose_count > 1 &&
        !(close = values_of(work->scene, &motion->poses[motion->pose_count - 1], use, &count, error))) {
        free(open);
        return false;
    }
    if (same_values(open, close, count)) {
        free(close);
        close = NULL;
    }
    bool same_count = use->value_count == count;
    bool same_open = same_count && same_values(use->open, open, count);
    bool same_close = same_count && same_values(use->close, close, count);
    bool changed = !same_open || (close ? !same_close : use->close != NULL);
    free(use->open);
    free(use->close);
    use->open = open;
    use->close = close;
    use->value_count = count;
    if (changed) {
        use->revision = ++work->gpu->deformed_revision;
        changes->bits |= CHANGED_DEFORMED;
        find_box(use, work->scene, &deform->meshes[use->mesh]);
    }
    bool ok = (use->is_placed && same_open) || add_pass(work, use_index, false);
    ok = ok && (!close || (use->is_placed && same_close) || add_pass(work, use_index, true));
    use->is_placed = true;
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the joints of a scene");
}

/* ---- passes ---- */

static void bind(struct gpu_scene *gpu)
{
    struct gpu_scene_deform *deform = &gpu->state->deform;
    const struct {
        struct gpu_buffer *buffer;
        unsigned unit, format;
    } rows[] = {
        {&deform->positions, UNIT_REST_POSITIONS, GL_RGBA32F},
        {&deform->normals, UNIT_REST_NORMALS, GL_RGBA32F},
        {&deform->tangents, UNIT_REST_TANGENTS, GL_RGBA32F},
        {&deform->joints, UNIT_JOINTS, GL_R16UI},
        {&deform->joint_weights, UNIT_JOINT_WEIGHTS, GL_R32F},
        {&deform->target_positions, UNIT_TARGET_POSITIONS, GL_RGBA32F},
        {&deform->target_normals, UNIT_TARGET_NORMALS, GL_RGBA32F},
        {&deform->target_tangents, UNIT_TARGET_TANGENTS, GL_RGBA32F},
        {&deform->parameters, UNIT_DEFORM_PARAMETERS, GL_RGBA32F},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
        gpu_buffer_bind_texels(gpu->device, rows[i].buffer, rows[i].unit, rows[i].format);
    gpu_buffer_bind_image(gpu->device, &gpu->positions, IMAGE_POSITIONS, GL_RGBA32F);
    gpu_buffer_bind_image(gpu->device, &gpu->normals, IMAGE_NORMALS, GL_RGBA32F);
    gpu_buffer_bind_image(gpu->device, &gpu->tangents, IMAGE_TANGENTS, GL_R32UI);
}

static const struct gpu_program *program_for(struct gpu_device *device, uint32_t flags, struct error *error)
{
    struct gpu_define defines[3] = {0};
    size_t n = 0;
    if (flags & GEOMETRY_HAS_NORMALS)
        defines[n++] = (struct gpu_define){"HAS_NORMALS", "1"};
    if (flags & GEOMETRY_HAS_TANGENTS)
        defines[n++] = (struct gpu_define){"HAS_TANGENTS", "1"};
    const struct gpu_program_source source = {.compute = "gpu_scene/deform.comp", .defines = defines};
    return gpu_program_get(device, &source, error);
}

static bool run_pass(const struct work *work, const struct pass *pass, struct error *error)
{
    struct gpu_scene *gpu = work->gpu;
    const struct deform_use *use = &gpu->state->deform.uses[pass->use];
    const struct deform_mesh *rest = &gpu->state->deform.meshes[use->mesh];
    const struct geometry *out = &gpu->geometries[gpu->state->rigid_count + pass->use].device;
    const struct scene_mesh *mesh = scene_mesh(work->scene, use->mesh_id);
    const struct gpu_program *program = program_for(gpu->device, out->flags, error);
    if (!program)
        return false;
    uint32_t arrays = (mesh->arrays[MESH_TARGET_POSITIONS] ? 1u : 0) |
                      (mesh->arrays[MESH_TARGET_NORMALS] ? 2u : 0) | (mesh->arrays[MESH_TARGET_TANGENTS] ? 4u : 0);
    const struct {
        const char *name;
        uint32_t value;
    } uniforms[] = {
        {"vertex_count", mesh->value.vertex_count},
        {"first_vertex", rest->first_vertex},
        {"first_vertex_out", out->first_vertex + (pass->closes ? out->close_offset : 0)},
        {"first_influence", rest->first_influence},
        {"influence_count", use->skin ? mesh->value.influence_count : 0},
        {"first_joint", pass->first_joint},
        {"joint_count", (use->value_count - mesh->value.target_count) / 12},
        {"first_target_vertex", rest->first_target_vertex},
        {"first_morph", pass->first_morph},
        {"morph_count", pass->morph_count},
        {"target_arrays", arrays},
    };
    for (size_t i = 0; i < sizeof(uniforms) / sizeof(uniforms[0]); i++)
        gpu_uniform_uint(program, uniforms[i].name, uniforms[i].value);
    gpu_dispatch(gpu->device, program, mesh->value.vertex_count);
    return true;
}

static bool run_passes(struct work *work, struct scene_changes *changes, struct error *error)
{
    struct gpu_scene *gpu = work->gpu;
    size_t bytes = work->parameter_count * sizeof(*work->parameters);
    if (work->pass_count == 0)
        return true;
    if (!gpu_scene_check_texels(gpu, work->parameter_count, "rows of the matrices of joints", error) ||
        !gpu_buffer_upload(gpu->device, &gpu->state->deform.parameters, work->parameters, bytes, error))
        return false;
    changes->uploaded_bytes += bytes;
    gpu_push_group(gpu->device, "deform");
    bind(gpu);
    bool ok = true;
    gpu_together_begin(gpu->device); /* each pass writes vertices of its own */
    for (uint32_t i = 0; ok && i < work->pass_count; i++)
        ok = run_pass(work, &work->passes[i], error);
    gpu_together_end(gpu->device);
    gpu_pop_group(gpu->device);
    return ok;
}

/* Sets the tables' entry of a geometry that deforms. */
static void note_geometry(struct gpu_scene *gpu, uint32_t use_index, uint32_t *close_vertex)
{
    const struct deform_use *use = &gpu->state->deform.uses[use_index];
    struct gpu_scene_geometry *geometry = &gpu->geometries[gpu->state->rigid_count + use_index];
    uint32_t close_offset = use->close ? *close_vertex - geometry->device.first_vertex : 0;
    *close_vertex += geometry->device.vertex_count;
    if (geometry->device.close_offset != close_offset) {
        geometry->device.close_offset = close_offset;
        gpu->state->stale_tables = true;
    }
    geometry->deformed_revision = use->revision;
    memcpy(geometry->lower, use->box.lower, sizeof(geometry->lower));
    memcpy(geometry->upper, use->box.upper, sizeof(geometry->upper));
}

bool gpu_scene_deform(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct error *error)
{
    struct gpu_scene_deform *deform = &gpu->state->deform;
    uint32_t close_vertex = gpu->state->close_vertex;
    if (deform->use_count == 0)
        return true;
    struct work work = {.gpu = gpu, .scene = scene};
    work.passes = calloc((size_t)deform->use_count * 2, sizeof(*work.passes));
    bool ok = work.passes ||
              error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u deformed meshes", deform->use_count);
    for (uint32_t i = 0; ok && i < deform->use_count; i++)
        ok = update_use(&work, i, motion, changes, error);
    for (uint32_t i = 0; ok && i < deform->use_count; i++)
        note_geometry(gpu, i, &close_vertex);
    ok = ok && run_passes(&work, changes, error);
    free(work.passes);
    free(work.parameters);
    return ok;
}

bool gpu_scene_any_closes(const struct gpu_scene *gpu)
{
    for (uint32_t i = 0; i < gpu->state->deform.use_count; i++)
        if (gpu->state->deform.uses[i].close)
            return true;
    return false;
}
