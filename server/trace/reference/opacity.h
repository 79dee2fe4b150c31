/* SPDX-License-Identifier: MIT */
/* Cutouts, blending and transmission by the rules of shaders/common/alpha.glsl, from the host's copy of the
 * scene. Keeps references on the blobs that it reads and no pointer into the scene. Any number of threads may
 * read it at once. */
#ifndef FARLIGHT_TRACE_REFERENCE_OPACITY_H
#define FARLIGHT_TRACE_REFERENCE_OPACITY_H

#include "base/hashmap.h"
#include "scene/pose.h"
#include "scene/scene.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

struct opacity_texture {
    struct blob *texels; /* NULL: no texture */
    uint32_t width, height;
    bool is_srgb, nearest, second_set;
    enum wrap wrap_u, wrap_v;
    float uv_transform[6];
};

struct opacity_material {
    enum alpha_mode alpha_mode;
    float base_colour[4];
    float alpha_cutoff;
    float transmission, metallic;
    float body_tint[3]; /* scene_material_body_tint() */
    struct opacity_texture base_colour_texture, transmission_texture, metallic_texture;
};

struct opacity_materials {
    struct opacity_material *list; /* 0: the default material, which is opaque */
    uint32_t count;
    struct hashmap index_by_id; /* value: (index + 1) as a pointer */
};

/* Primitives up to `end` (and from the run before) have a material. */
struct opacity_run {
    uint32_t end;
    uint32_t material_id; /* 0: the default */
    uint32_t material;    /* index in the list */
};

/* Opacity data of one geometry; zero is empty. */
struct opacity_surface {
    enum { OPACITY_MESH, OPACITY_SPHERES, OPACITY_DISCS } kind;
    const struct opacity_materials *materials;
    struct opacity_run *runs;
    uint32_t run_count;
    struct blob *indices, *texcoords[2], *colours; /* meshes; all but the indices may be missing */
    bool has_wide_colours;                         /* 16 bits per channel */
    struct blob *centres_radii;                    /* spheres */
    struct disc *discs;                            /* discs: a copy */
};

/* A place on a primitive, in the space of the geometry: world space for discs. */
struct opacity_point {
    uint32_t primitive; /* in its geometry */
    float u, v;         /* barycentrics of the second and third vertex */
    float origin[3], direction[3], distance;
};

/* Copies the materials in the pose (NULL: as committed). All or nothing; false: out of memory. */
bool opacity_materials_init(struct opacity_materials *materials, const struct scene *scene,
                            const struct scene_pose *pose);
void opacity_materials_finish(struct opacity_materials *materials); /* leaves it empty */

bool opacity_surface_init_mesh(struct opacity_surface *surface, const struct scene_mesh *mesh);
bool opacity_surface_init_spheres(struct opacity_surface *surface, const struct scene_spheres *spheres);
/* `discs` are gpu_scene's, with their `material_ids`. */
bool opacity_surface_init_discs(struct opacity_surface *surface, const struct disc *discs,
                                const uint32_t *material_ids, uint32_t count);
void opacity_surface_finish(struct opacity_surface *surface); /* leaves it empty */
/* Looks up the surface's materials; must be called after each opacity_materials_init. */
void opacity_surface_bind(struct opacity_surface *surface, const struct opacity_materials *materials);
/* Whether some ray may pass: a closest-hit ray (cutouts), and an any-hit ray. */
bool opacity_surface_has_cutout(const struct opacity_surface *surface);
bool opacity_surface_lets_light_pass(const struct opacity_surface *surface);

/* Host versions of is_cut_out() and transmittance_of() in alpha.glsl. */
bool opacity_is_cut_out(const struct opacity_surface *surface, const struct opacity_point *point);
void opacity_transmittance(const struct opacity_surface *surface, const struct opacity_point *point, bool stops,
                           float transmittance[3]);

#endif
