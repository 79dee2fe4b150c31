/* SPDX-License-Identifier: MIT */
/* What the readers of NFF and of AFF, which is NFF with more, share: nff.c parses statements, nff_material.c makes
 * materials of fills, nff_world.c adds the camera, lights and background. */
#ifndef FARLIGHT_IMPORT_NFF_H
#define FARLIGHT_IMPORT_NFF_H

#include "shapes.h"
#include "word_reader.h"

struct nff_light {
    float position[3], colour[3];
    bool coloured;
    uint32_t node; /* once it is added */
};

struct nff_fill {
    float numbers[12]; /* `f`: red green blue Kd Ks shine T ior; `fm`: ambient, diffuse, specular, shine T ior */
    uint32_t extended; /* 1: `fm` */
    uint32_t texture;  /* from 1 on, as the reader numbers them; 0: none */
};

struct nff_material {
    struct nff_fill fill;
    char name[64];
};

struct nff {
    struct import_scene *scene;
    struct word_reader reader;
    struct shapes *shapes; /* take what is read */
    struct nff_fill fill;  /* of what comes next */
    struct nff_light *lights;
    size_t light_count, light_capacity;
    struct nff_material *materials; /* number 1 first */
    size_t material_count, material_capacity;
    uint32_t *slots; /* open addressing: numbers of materials; 0: free */
    size_t slot_count;
    uint32_t *material_ids; /* by number, once they are added */
    uint64_t polygon_budget;
    float ambient[3]; /* the light that an `fm` shows by its ambient colour */
    bool has_view, has_background;
    float from[3], look_at[3], up[3], angle_degrees, hither;
    float background[3];
    uint32_t camera_node; /* once it is added; 0: there is no view */
};

void nff_init(struct nff *nff, struct import_scene *scene, const unsigned char *bytes, size_t size_bytes);
void nff_free(struct nff *nff);

/* Whether the word begins a statement that both formats have. If so it is read; *read is false if the scene has
 * failed. */
bool nff_statement(struct nff *nff, struct word word, bool *read);
/* Position and colour of a light. */
bool nff_read_light(struct nff *nff);

/* Gives what comes next the material of the fill. */
bool nff_use_fill(struct nff *nff);
/* Adds the materials that were in use. textures[i] is the identifier of texture i. */
bool nff_add_materials(struct nff *nff, const uint32_t *textures);

/* NFF's colours are a display's, 0 to 1, as were those that renderers of its time computed with and showed. They
 * stay so in a scene of their own that has lights, and are made linear in any other. */
bool nff_keeps_values(const struct nff *nff);
float nff_colour(const struct nff *nff, float shown);

bool nff_add_camera(struct nff *nff);
bool nff_add_lights(struct nff *nff);
void nff_add_background(struct nff *nff);

#endif
