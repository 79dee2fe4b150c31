/* SPDX-License-Identifier: MIT */
/* Checks of single edits, and the names of edits in errors. Private to scene/. */
#ifndef FARLIGHT_SCENE_EDIT_H
#define FARLIGHT_SCENE_EDIT_H

#include "scene/scene.h"

/* Edit that an error is about: "edits[17] (mesh 3)". */
struct edit_place {
    size_t index;
    const struct scene_edit *edit;
    struct error *error;
};

const char *object_kind_name(enum object_kind kind);
/* Identifier of the object that the edit sets or removes; 0 for the environment. */
uint32_t edit_object_id(const struct scene_edit *edit);
/* `path` names the part of the edit: ".ranges[2].material", or "" for the whole edit. Returns false. */
bool edit_error(const struct edit_place *place, enum error_code kind, const char *path, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Check the shape of one object, without references: counts, the presence of arrays, and their sizes. They are
 * quick. */
bool mesh_check_shape(const struct scene_mesh *mesh, const struct edit_place *place);
bool spheres_check_shape(const struct scene_spheres *spheres, const struct edit_place *place);
bool texture_check(const struct scene_texture *texture, const struct edit_place *place);
bool light_check(const struct scene_light *light, const struct edit_place *place);
bool camera_check(const struct scene_camera *camera, const struct edit_place *place);
bool disc_check(const struct scene_disc *disc, const struct edit_place *place);
bool node_check(const struct scene_node *node, const struct edit_place *place);
bool skin_check_shape(const struct scene_skin *skin, const struct edit_place *place);
bool clip_check_shape(const struct scene_clip *clip, const struct edit_place *place);
bool channel_check(const struct scene_channel *channel, const struct edit_place *place);
bool environment_check_shape(const struct scene_environment *environment, const struct edit_place *place);
/* Check the contents of arrays with the right sizes, which may take a second; they fill in bounds. */
bool mesh_check_content(struct scene_mesh *mesh, const struct edit_place *place);
bool spheres_check_content(struct scene_spheres *spheres, const struct edit_place *place);
bool skin_check_content(const struct scene_skin *skin, const struct edit_place *place);
bool clip_check_content(const struct scene_clip *clip, const struct edit_place *place);
bool environment_check_content(const struct scene_environment *environment, const struct edit_place *place);

/* Helpers that several kinds of edits share. */
#define COORDINATE_MAX 1e18f /* beyond it, squares leave the range of floats */
bool ranges_check(const struct record_material_range *ranges, uint32_t range_count, uint32_t primitive_count,
                  const struct edit_place *place);
/* Weights of morph targets. */
bool weights_check(const float *weights, uint32_t count, const struct edit_place *place);
/* Checks that the blob holds `count` elements of `element_bytes`, neither more nor less. */
bool array_size_check(const struct blob *blob, uint64_t count, uint64_t element_bytes, const char *path,
                      const struct edit_place *place);
/* Index of the first float that is not finite, or whose magnitude is above `maximum`; `count` if there is none.
 */
size_t first_bad_float(const float *values, size_t count, float maximum);

/* Host memory that an object counts for. */
uint64_t object_bytes(enum object_kind kind, const void *object);
uint64_t object_table_bytes(enum object_kind kind, const void *object); /* without its blobs */
uint64_t environment_bytes(const struct scene_environment *environment);
/* Size of the struct of a kind. */
size_t object_struct_bytes(enum object_kind kind);
/* Releases blobs and ranges of an object and clears them, not the struct. */
void object_release(enum object_kind kind, void *object);

#endif
