/* SPDX-License-Identifier: MIT */
/* The parts of the AFF reader: aff.c parses statements and includes files, aff_block.c has transforms, aff_mesh.c
 * triangles, aff_morph.c those whose vertices move, aff_texture.c images, aff_keys.c keys; aff_scene.c adds all
 * that to the scene, aff_clip.c the keys, which aff_channel.c turns into channels. */
#ifndef FARLIGHT_IMPORT_AFF_H
#define FARLIGHT_IMPORT_AFF_H

#include "files.h"
#include "nff.h"
#include "spline.h"

#define AFF_BLOCKS_MAX 64      /* open at one time: half of what the server's nodes can be deep */
#define AFF_GROUPS_MAX 16384u  /* and names that have keys */
#define AFF_TEXTURES_MAX 4096u /* different images */
#define AFF_MORPHS_MAX 1024u   /* different times and materials of moving triangles */

typedef char aff_name[IMPORT_NAME_MAX + 1];

/* Triangles of one material whose vertices move by the same times. */
struct aff_morph {
    float *times;
    uint32_t time_count, material;
    float *floats; /* triangle by triangle, time by time, corner by corner: position, normal */
    size_t triangle_count, triangle_capacity;
    uint32_t node; /* once it is added */
};

/* What is moved together: the root, first, and the content of each `x NAME { }`. */
struct aff_group {
    aff_name name; /* empty: does not move */
    uint32_t parent;
    struct placement parent_from_group; /* by what is static between */
    struct shapes shapes;
    struct aff_morph *morphs;
    size_t morph_count, morph_capacity;
    uint32_t node; /* once it is added; 0 for the root */
};

/* An open `{`. */
struct aff_block {
    uint32_t group;
    struct placement group_from_block;
    uint32_t spheres; /* a group for spheres that are scaled unevenly; 0: none so far */
};

enum aff_property { AFF_TRANSL, AFF_ROT, AFF_SCALE, AFF_VISIBILITY, AFF_PROPERTY_COUNT };

/* Of a `k`; a property without keys has count 0. Visibility: value[0] is 1 or 0. */
struct aff_curve {
    struct spline_key *keys;
    size_t count;
};

struct aff_keys {
    aff_name name;
    struct aff_curve curves[AFF_PROPERTY_COUNT];
    bool used; /* something has the name */
};

struct aff_named_light {
    aff_name name;
    size_t light;
};

struct aff_file {
    char *name;
    unsigned char *bytes;
    size_t size_bytes;
    bool open; /* is being read */
};

struct aff {
    struct nff nff;
    struct files *files;
    struct aff_group **groups;
    size_t group_count, group_capacity;
    struct aff_block blocks[AFF_BLOCKS_MAX + 1];
    size_t block;           /* the innermost */
    struct aff_file *texts; /* included ones */
    size_t text_count, text_capacity;
    uint32_t include_count, include_depth, detail;
    uint64_t included_bytes;
    char **textures; /* names; number 1 first */
    size_t texture_count, texture_capacity;
    size_t morph_count; /* of all groups */
    struct aff_keys *keys;
    size_t key_count, key_capacity;
    struct aff_named_light *named_lights;
    size_t named_light_count, named_light_capacity;
    bool has_animation; /* `a` */
    float start_s, end_s;
    uint32_t frames;
};

/* Each false: the scene has failed. */
bool aff_read_name(struct aff *aff, aff_name name, const char *of);
bool aff_read_static_transform(struct aff *aff);              /* xs and its { */
bool aff_read_moving_transform(struct aff *aff);              /* x and its { */
void aff_close_block(struct aff *aff);                        /* } */
bool aff_read_sphere(struct aff *aff, struct word word);      /* s */
bool aff_read_mesh(struct aff *aff);                          /* m */
bool aff_read_textured_triangle(struct aff *aff, bool patch); /* tt, ttp */
bool aff_read_moving_triangle(struct aff *aff);               /* tpa */
bool aff_read_keys(struct aff *aff);                          /* k */

/* A new one with the place of the innermost block; NULL: the scene has failed. */
struct aff_group *aff_add_group(struct aff *aff);
void aff_group_finish(struct aff_group *group);

/* The number of the image that the next word names. */
bool aff_read_texture(struct aff *aff, uint32_t *texture, const char *of);
/* ids[i] is texture i; from the caller, with room for texture_count + 1. */
bool aff_add_textures(struct aff *aff, uint32_t *ids);

void aff_morph_finish(struct aff_morph *morph);
/* The pose that it has at the animation's start. */
bool aff_add_morph(struct aff *aff, struct aff_group *group, struct aff_morph *morph);
/* The weights of its targets at one of its times: all are 0 at the first, else one is 1. */
void aff_morph_weights(const struct aff_morph *morph, double time_s, float *weights);

/* The keys of a name, NULL: it has none. Of several the last ones count. */
struct aff_keys *aff_find_keys(const struct aff *aff, const char *name);
void aff_keys_finish(struct aff_keys *keys);
/* The transform that keys (or NULL) give a group at a time. */
struct placement aff_pose_at(const struct aff_keys *keys, double time_s);
bool aff_visible_at(const struct aff_keys *keys, double time_s);
/* Turns all keys into one clip, once nodes are added. */
bool aff_add_clip(struct aff *aff);
/* Adds all that has been read. */
bool aff_add_all(struct aff *aff);

#endif
