/* SPDX-License-Identifier: MIT */
/* Buffers of the quadtrees, and the settings of a view as its uniforms. */
#include "trace/quadtree/store.h"

#include "protocol/words.h"
#include "trace/quadtree/faces.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

/* Distance at which w is 1: slopes of w then use the full precision of half floats. */
#define UNIT_OF_DIAGONAL 0.05f
#define DOUBLED_AT 0.25f /* distance in diagonals at which bounds that grow with distance have doubled */
#define CUBE_TEXELS_MAX 1024u
#define CUBE_TEXELS_MIN 256u
#define CUBE_TEXELS_STEP 128u

#define PAPER_COSINE 0.99862953f /* cosine of 3 degrees: gamma_norm of the paper */

static bool is_paper(const struct quadtree_settings *settings)
{
    return settings->form == TRACER_FORM_PAPER;
}

uint32_t quadtree_layer_count(const struct quadtree_settings *settings)
{
    return settings->layers ? settings->layers : is_paper(settings) ? 1 : QUADTREE_LAYERS_MAX;
}

bool quadtree_hits_planes(const struct quadtree_settings *settings)
{
    return settings->hits == QUADTREE_HITS_PLANE || (settings->hits == QUADTREE_HITS_AUTO && is_paper(settings));
}

void quadtree_store_finish(struct quadtree_store *store)
{
    struct gpu_device *device = store->device;
    gpu_buffer_finish(device, &store->uniform_buffer);
    gpu_buffer_finish(device, &store->nodes);
    gpu_texture_finish(device, &store->visible);
    quadtree_runs_finish(&store->runs);
    *store = (struct quadtree_store){.device = device};
}

uint64_t quadtree_store_bytes(const struct quadtree_store *store)
{
    return store->uniform_buffer.capacity_bytes + store->nodes.capacity_bytes + store->visible.size_bytes;
}

/* ---- placement of faces ---- */

static uint32_t scaled(uint32_t pixels, double scale)
{
    const double texels = floor(pixels * scale + 0.5);
    return texels < 1 ? 1 : (uint32_t)texels;
}

void quadtree_texel_view(struct trace_view *texels, const struct trace_view *view,
                         const struct quadtree_settings *settings)
{
    const uint32_t longer = view->width > view->height ? view->width : view->height;
    const double scale = settings->resolution ? (double)settings->resolution / longer : 1.0;
    const uint32_t margin = scaled(longer, scale * (double)settings->margin);
    const uint32_t height = scaled(view->height, scale);
    const double wider = (height + 2.0 * margin) / height;
    *texels = *view;
    texels->width = scaled(view->width, scale) + 2 * margin;
    texels->height = height + 2 * margin;
    texels->ortho_height = (float)((double)view->ortho_height * wider);
    if (view->fov_y > 0.0f)
        texels->fov_y = (float)(2.0 * atan(tan((double)view->fov_y / 2.0) * wider));
}

static float distance_from(const float eye[3], const float lower[3], const float upper[3])
{
    float squared = 0.0f;
    for (int i = 0; i < 3; i++) {
        const float way = fmaxf(fabsf(lower[i] - eye[i]), fabsf(upper[i] - eye[i]));
        squared += way * way;
    }
    return sqrtf(squared);
}

/* Distance of the far plane. Beyond it there is nothing but discs, which do not count in a scene's bounds. */
static float far_distance(const struct gpu_scene *scene, const float eye[3], bool orthographic)
{
    float far = scene->instance_count > 0 ? distance_from(eye, scene->lower_world, scene->upper_world) : 0.0f;
    for (uint32_t i = 0; orthographic && i < scene->disc_count; i++) {
        const float *disc = scene->discs[i].centre_radius;
        far = fmaxf(far, distance_from(eye, disc, disc) + disc[3]);
    }
    return far * 1.001f + 1e-6f;
}

/* Two texels cover three of the picture's pixels along its middle. A hit is on the primitive itself, so only
 * details thinner than a texel, or hidden within one, are missed. On the SPD scenes, one texel per pixel took
 * 1.5 to 2 times as long, for 0.2 to 0.8 dB. */
#define CUBE_PIXELS_A_TEXEL 1.5f

/* Texels along a side of a cube's face. */
static uint32_t cube_texels(const struct trace_view *view, const struct quadtree_settings *settings)
{
    if (settings->resolution)
        return settings->resolution;
    const float tangent = view->fov_y > 0.0f ? tanf(view->fov_y / 2.0f) : 1.0f;
    const float texels = fminf((float)view->height / tangent / CUBE_PIXELS_A_TEXEL, (float)CUBE_TEXELS_MAX);
    const uint32_t whole = ((uint32_t)texels + CUBE_TEXELS_STEP / 2) / CUBE_TEXELS_STEP * CUBE_TEXELS_STEP;
    return whole > CUBE_TEXELS_MIN ? whole : CUBE_TEXELS_MIN;
}

/* Factor on the error bound where planes lead to primitives: a plane that is off makes grazing rays meet another
 * texel. */
#define ERROR_TO_PRIMITIVES (1.0f / 64.0f)

/* The error of w that displaces surfaces, seen by an eye within the radius, by the allowed number of pixels:
 * e / (f R), as a difference of 1 / Z. An orthographic view has no parallax; there the error is that of a
 * depth of as many pixels. */
static float error_of_w(const struct quadtree_uniforms *u, const struct trace_view *view,
                        const struct quadtree_settings *settings)
{
    if (view->fov_y == 0.0f)
        return settings->pixels * view->ortho_height / (float)view->height / (u->depths[1] - u->depths[0]);
    const float focal_pixels = (float)view->height / 2.0f / tanf(view->fov_y / 2.0f);
    return u->depths[0] * settings->pixels / (focal_pixels * settings->radius);
}

static float diagonal_of(const struct gpu_scene *scene)
{
    return scene->diagonal > 0.0f && isfinite(scene->diagonal) ? scene->diagonal : 1.0f;
}

static void place_depths(struct quadtree_uniforms *u, const struct gpu_scene *scene, const struct trace_view *view)
{
    const bool orthographic = view->fov_y == 0.0f && u->faces == 1;
    /* A mirror may show surfaces that the picture's near plane cuts off. */
    const float near = raster_near(scene, u->faces == 1 ? view->near : 0.0f, orthographic);
    u->depths[0] = orthographic ? near : fmaxf(diagonal_of(scene) * UNIT_OF_DIAGONAL, 1e-6f);
    u->depths[1] = fmaxf(far_distance(scene, u->eye_world, orthographic), 2.0f * near);
    u->depths[2] = orthographic ? 1.0f : 0.0f;
    u->depths[3] = near;
}

static uint32_t padded(uint32_t texels)
{
    return (texels + QUADTREE_SIDE - 1) / QUADTREE_SIDE * QUADTREE_SIDE;
}

static void fill_uniforms(struct quadtree_uniforms *u, const struct gpu_scene *scene,
                          const struct trace_view *view, const struct quadtree_settings *settings,
                          const struct quadtree_store *store)
{
    *u = (struct quadtree_uniforms){.layers = quadtree_layer_count(settings)};
    for (int i = 0; i < 3; i++)
        u->eye_world[i] = view->world_from_view[4 * i + 3];
    u->eye_world[3] = settings->radius;
    if (settings->faces == QUADTREE_FACES_VIEW) {
        struct trace_view texels;
        quadtree_texel_view(&texels, view, settings);
        quadtree_place_view(u, &texels);
    } else {
        quadtree_place_cube(u, view, cube_texels(view, settings));
    }
    u->scale_centre[2] = (float)u->width / 2.0f;
    u->scale_centre[3] = (float)u->height / 2.0f;
    place_depths(u, scene, view);
    u->bounds[0] = error_of_w(u, view, settings) * (quadtree_hits_planes(settings) ? 1.0f : ERROR_TO_PRIMITIVES);
    u->bounds[1] = is_paper(settings) ? PAPER_COSINE : 0.0f;
    u->bounds[2] = is_paper(settings) ? u->depths[0] / (DOUBLED_AT * diagonal_of(scene)) : 0.0f;
    u->bounds[3] = settings->radius / u->depths[0];
    quadtree_drop_empty_faces(u, scene, &store->runs);
    u->padded_width = padded(u->width);
    u->padded_height = padded(u->height);
    for (uint32_t level = 0; level <= (store->only_leaves ? 0 : QUADTREE_TOP); level++)
        u->slice_nodes += (u->padded_width >> level) * (u->padded_height >> level);
}

/* ---- memory ---- */

bool quadtree_store_place(struct quadtree_store *store, const struct gpu_scene *scene,
                          const struct trace_view *view, const struct quadtree_settings *settings,
                          struct error *error)
{
    struct quadtree_uniforms *u = &store->uniforms;
    if (!quadtree_runs_update(&store->runs, scene, error))
        return false;
    fill_uniforms(u, scene, view, settings, store);
    const uint32_t longer = u->padded_width > u->padded_height ? u->padded_width : u->padded_height;
    if (longer > store->device->facts.texture_size_max) {
        error_set(error, ERROR_LIMIT, "quadtree_resolution", "%u texels along a side; the device holds %u", longer,
                  store->device->facts.texture_size_max);
        return error_remedy(error, "choose a smaller quadtree_resolution");
    }
    return gpu_buffer_upload(store->device, &store->uniform_buffer, u, sizeof(*u), error) &&
           gpu_texture_reserve_array(store->device, &store->visible, GL_RG32UI, u->padded_width, u->padded_height,
                                     u->faces * u->layers, error);
}

void quadtree_store_bind(struct quadtree_store *store)
{
    gpu_buffer_bind_uniform(&store->uniform_buffer, UNIFORM_QUADTREE);
    gpu_texture_bind(&store->visible, UNIT_QUADTREE_VISIBLE);
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_QUADTREE_NODES, GL_RG32UI);
}
