/* SPDX-License-Identifier: MIT */
/* Passes that trace the rays of pinhole eyes near the view's own, with their checks. */
#include "trace/quadtree/eyes.h"

#include "shared/bindings.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <math.h>

/* Minimum cosine between an eye's ray and the direction of the view: for a ray nearly across it, numbers grow
 * beyond the precision of floats. */
#define COSINE_MIN 0.1f

/* ---- an eye in the face ---- */

/* Rotates from view to face: rows of quadtree_uniforms.face_from_world times columns of the frame's axes. */
static void face_from_view(const struct quadtree_uniforms *u, const struct frame_uniforms *frame,
                           const float view[3], float face[3])
{
    float world[3];
    for (int i = 0; i < 3; i++) {
        const float *row = frame->world_from_view[i];
        world[i] = row[0] * view[0] + row[1] * view[1] + row[2] * view[2];
    }
    for (int i = 0; i < 3; i++) {
        const float *row = u->face_from_world[i];
        face[i] = row[0] * world[0] + row[1] * world[1] + row[2] * world[2];
    }
}

static void eye_of_view(const struct quadtree_uniforms *u, const struct frame_uniforms *frame, uint32_t across,
                        uint32_t down, float face[3])
{
    const float steps[2] = {(float)across - frame->eyes_middle[0], (float)down - frame->eyes_middle[1]};
    float aside[3] = {0}, from_face[3];
    for (int i = 0; i < 2; i++)
        aside[i] = steps[0] * frame->eye_steps[i] + steps[1] * frame->eye_steps[2 + i];
    for (int i = 0; i < 3; i++)
        from_face[i] = frame->world_from_view[i][3] - u->eye_world[i];
    face_from_view(u, frame, aside, face);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            face[i] += u->face_from_world[i][k] * from_face[k];
}

static void direction_of(const struct quadtree_uniforms *u, const struct frame_uniforms *frame, float x, float y,
                         float face[3])
{
    const float place[3] = {frame->extent_near[0] * x, -frame->extent_near[1] * y, -1.0f};
    face_from_view(u, frame, place, face);
}

static float length_of(const float v[3])
{
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Whether all rays go ahead in the face. The rays through the picture's corners bound all others. */
static bool goes_ahead(const struct quadtree_uniforms *u, const struct frame_uniforms *frame)
{
    for (int corner = 0; corner < 4; corner++) {
        float direction[3];
        direction_of(u, frame, corner & 1 ? 1.0f : -1.0f, corner & 2 ? 1.0f : -1.0f, direction);
        if (!(direction[2] >= COSINE_MIN * length_of(direction)))
            return false;
    }
    return true;
}

static bool is_near(const struct quadtree_uniforms *u, const struct frame_uniforms *frame)
{
    const uint32_t across = frame->width / frame->view_width, down = frame->height / frame->view_height;
    for (int corner = 0; corner < 4; corner++) {
        float eye[3];
        eye_of_view(u, frame, corner & 1 ? across - 1 : 0, corner & 2 ? down - 1 : 0, eye);
        if (!(length_of(eye) <= u->eye_world[3]))
            return false;
    }
    return true;
}

bool quadtree_finds_eyes(const struct quadtree_store *store, const struct gpu_scene *scene,
                         const struct frame_uniforms *frame, const struct tracer_options *options)
{
    const struct quadtree_uniforms *u = &store->uniforms;
    const bool is_perspective = u->depths[2] == 0.0f && frame->extent_near[3] == 0.0f;
    return quadtree_hits_planes(&options->quadtree) && is_perspective &&
           options->quadtree.faces == QUADTREE_FACES_VIEW && scene->disc_count == 0 && frame->lens[0] == 0.0f &&
           is_near(u, frame) && goes_ahead(u, frame);
}

/* ---- uniforms ---- */

static void set_vector(const struct gpu_program *program, const char *name, const struct quadtree_uniforms *u,
                       const float v[3])
{
    const float scaled[3] = {u->scale_centre[0] * v[0], u->scale_centre[1] * v[1], v[2]};
    gpu_uniform_vec(program, name, 3, scaled);
}

static void difference(const float a[3], const float b[3], float share, float result[3])
{
    for (int i = 0; i < 3; i++)
        result[i] = (a[i] - b[i]) * share;
}

static void set_eyes(const struct gpu_program *program, const struct quadtree_uniforms *u,
                     const struct frame_uniforms *frame)
{
    float corner[3], first[3], other[3];
    direction_of(u, frame, -1.0f, -1.0f, corner);
    set_vector(program, "eye_corner", u, corner);
    direction_of(u, frame, 1.0f, -1.0f, other);
    difference(other, corner, 1.0f / (float)frame->view_width, other);
    set_vector(program, "eye_right", u, other);
    direction_of(u, frame, -1.0f, 1.0f, other);
    difference(other, corner, 1.0f / (float)frame->view_height, other);
    set_vector(program, "eye_down", u, other);
    eye_of_view(u, frame, 0, 0, first);
    set_vector(program, "eye_first", u, first);
    eye_of_view(u, frame, 1, 0, other);
    difference(other, first, 1.0f, other);
    set_vector(program, "eye_across", u, other);
    eye_of_view(u, frame, 0, 1, other);
    difference(other, first, 1.0f, other);
    set_vector(program, "eye_below", u, other);
}

/* ---- passes ---- */

struct programs {
    const struct gpu_program *beams, *eyes;
};

/* Gets the programs. Either may have been announced. */
static bool get_programs(const struct quadtree_store *store, bool spread, struct programs *programs,
                         struct error *error)
{
    static const char *const numbers[QUADTREE_LAYERS_MAX + 1] = {"0", "1", "2", "3"};
    const struct gpu_define defines[] = {
        {"QUADTREE_LAYERS", numbers[store->uniforms.layers]}, {spread ? "SPREAD" : NULL, "1"}, {NULL, NULL}};
    const struct gpu_program_source beams = {.compute = "quadtree/beams.comp"};
    programs->beams = gpu_program_get(store->device, &beams, error);
    const struct gpu_program_source eyes = {.compute = "quadtree/eyes.comp", .defines = defines};
    programs->eyes = gpu_program_get(store->device, &eyes, error);
    return programs->eyes && programs->beams;
}

/* Finds where the rays of each tile begin. */
static bool make_beams(const struct quadtree_store *store, struct quadtree_state *state,
                       const struct eye_rays *rays, const struct gpu_program *program, struct error *error)
{
    const uint32_t first = rays->first_slot / 64, end = (rays->first_slot + rays->slot_count + 63) / 64;
    const struct quadtree_uniforms *u = &store->uniforms;
    const float far = u->depths[1], w_of_far = 1.0f / far - QUADTREE_PLANES_APART * u->bounds[0] / u->depths[0];
    if (!gpu_buffer_reserve(store->device, &state->beams, (end - first) * sizeof(vec4), error))
        return false;
    set_eyes(program, u, rays->frame);
    gpu_uniform_float(program, "eye_near", rays->frame->extent_near[2]);
    gpu_uniform_float(program, "eye_far", 1.0f / fmaxf(w_of_far, 1.0f / (QUADTREE_FARTHER_MAX * far)));
    gpu_uniform_float(program, "eye_reach", rays->reach);
    gpu_uniform_uint(program, "first_tile", first);
    gpu_uniform_uint(program, "tile_count", end - first);
    gpu_buffer_bind_image(store->device, &state->beams, IMAGE_QUADTREE_BEAMS, GL_RGBA32F);
    gpu_dispatch(store->device, program, end - first);
    gpu_buffer_bind_texels(store->device, &state->beams, UNIT_QUADTREE_BEAMS, GL_RGBA32F);
    return true;
}

/* Dispatches in parts: a GPU's driver ends a dispatch that takes long (trace/program.h). */
static void dispatch(const struct quadtree_store *store, const struct gpu_program *program, uint32_t samples)
{
    const uint32_t together = trace_rays_a_dispatch(store->device, quadtree_rounds_of_a_ray(store));
    for (uint32_t first = 0, part; first < samples; first += part) {
        part = together && together < samples - first ? together : samples - first;
        gpu_uniform_uint(program, "first_item", first);
        gpu_uniform_uint(program, "end_item", first + part);
        gpu_dispatch(store->device, program, part);
        if (first + part < samples)
            glFlush();
    }
}

bool quadtree_eye_hits(struct quadtree_store *store, struct quadtree_state *state, const struct eye_rays *rays,
                       struct error *error)
{
    const uint32_t samples = rays->slot_count << rays->frame->sample_shift;
    struct programs programs;
    if (!get_programs(store, rays->spread, &programs, error) || !quadtree_trace_begin(&state->base, error))
        return false;
    quadtree_store_bind(store);
    if (!make_beams(store, state, rays, programs.beams, error))
        return false;
    set_eyes(programs.eyes, &store->uniforms, rays->frame);
    gpu_uniform_uint(programs.eyes, "first_slot", rays->first_slot);
    gpu_buffer_bind_storage(&state->counts, BIND_QUADTREE_COUNTS);
    gpu_buffer_bind_image(store->device, rays->hits, IMAGE_HITS, GL_RGBA32F);
    dispatch(store, programs.eyes, samples);
    state->eye_samples += samples;
    return true;
}
