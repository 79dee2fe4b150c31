/* SPDX-License-Identifier: MIT */
/* The parts of the NFF reader: import.c parses statements, material.c makes materials of fills, world.c adds
 * the camera, lights and background. */
#ifndef FARLIGHT_IMPORT_NFF_READER_H
#define FARLIGHT_IMPORT_NFF_READER_H

#include "shapes.h"
#include "words.h"

struct nff_light {
    float position[3], colour[3];
    bool coloured;
};

struct nff_fill {
    float numbers[8]; /* red green blue Kd Ks shine T ior */
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
    bool has_view, has_background;
    float from[3], look_at[3], up[3], angle_degrees, hither;
    float background[3];
};

/* Gives what comes next the material of the fill. */
bool nff_use_fill(struct nff *nff);
/* Adds the materials that were in use. */
bool nff_add_materials(struct nff *nff);

/* NFF's colours are a display's, 0 to 1, as were those that renderers of its time computed with and showed. They
 * stay so in a scene of their own that has lights, and are made linear in any other. */
bool nff_keeps_values(const struct nff *nff);
float nff_colour(const struct nff *nff, float shown);

bool nff_add_camera(struct nff *nff);
bool nff_add_lights(struct nff *nff);
void nff_add_background(struct nff *nff);

#endif
