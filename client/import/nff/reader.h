/* SPDX-License-Identifier: MIT */
/* The parts of the NFF reader: import.c parses statements, material.c converts fills to materials, world.c adds
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
    struct shapes *shapes; /* collect the parsed shapes */
    struct nff_fill fill;  /* fill of the following shapes */
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

/* Sets the material of the following shapes from the fill. */
bool nff_use_fill(struct nff *nff);
/* Adds the used materials. */
bool nff_add_materials(struct nff *nff);

/* NFF's colours are display values, 0 to 1, as in renderers of its time. They stay unchanged in a scene with
 * only this model and with lights, and are converted to linear values in any other. */
bool nff_keeps_values(const struct nff *nff);
float nff_colour(const struct nff *nff, float shown);

bool nff_add_camera(struct nff *nff);
bool nff_add_lights(struct nff *nff);
void nff_add_background(struct nff *nff);

#endif
