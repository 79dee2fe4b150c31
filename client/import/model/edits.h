/* SPDX-License-Identifier: MIT */
/* How edits are added to the scene under construction: for scene.c and its like, and readers that gather arrays.
 */
#ifndef FARLIGHT_IMPORT_MODEL_EDITS_H
#define FARLIGHT_IMPORT_MODEL_EDITS_H

#include "scene.h"

/* A new edit at the end of the list, all zero but for its type; NULL if the scene has failed. */
struct import_edit *import_append(struct import_scene *scene, enum message_type type);
/* A mended copy, behind the prefix of the current model, that the edit owns; NULL: out of memory, and the scene
 * has failed. */
char *import_copy_name(struct import_scene *scene, const char *name);
/* A copy that the edit owns; NULL: none, or the scene has failed: out of memory, or a weight that is not allowed.
 */
struct record_morph_weight *import_copy_weights(struct import_scene *scene, const struct record_morph_weight *from,
                                                uint32_t count);
/* The array, moved where it has no room for one more element; it grows by half. NULL: out of memory, and the scene
 * has failed. */
void *import_grow(struct import_scene *scene, void *array, size_t count, size_t *capacity, size_t element_bytes);
uint32_t import_next_id(struct import_scene *scene, enum protocol_object_kind kind);
/* A mended copy, at most out_bytes - 1 bytes long. */
void import_copy_text(char *out, size_t out_bytes, const char *text);
/* The same of a name, behind the prefix. */
void import_prefix_name(const struct import_scene *scene, char out[IMPORT_NAME_MAX + 1], const char *name);

#endif
