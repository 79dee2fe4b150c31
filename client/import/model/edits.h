/* SPDX-License-Identifier: MIT */
/* Adding of edits to the scene under construction, for scene.c and its like, and for readers that gather
 * arrays. */
#ifndef FARLIGHT_IMPORT_MODEL_EDITS_H
#define FARLIGHT_IMPORT_MODEL_EDITS_H

#include "scene.h"

/* Appends a new edit, all zero except its type; NULL if the scene has failed. */
struct import_edit *import_append(struct import_scene *scene, enum message_type type);
/* Copies a name with the current model's prefix, mended to UTF-8; the edit owns the copy. NULL: out of memory,
 * and the scene has failed. */
char *import_copy_name(struct import_scene *scene, const char *name);
/* A copy that the edit owns; NULL: none, or the scene has failed: out of memory, or a weight that is not allowed.
 */
struct record_morph_weight *import_copy_weights(struct import_scene *scene, const struct record_morph_weight *from,
                                                uint32_t count);
/* Grows the array by half if it has no space for another element. NULL: out of memory, and the scene has
 * failed. */
void *import_grow(struct import_scene *scene, void *array, size_t count, size_t *capacity, size_t element_bytes);
uint32_t import_next_id(struct import_scene *scene, enum protocol_object_kind kind);
/* Copies a text, mended to UTF-8, at most out_bytes - 1 bytes long. */
void import_copy_text(char *out, size_t out_bytes, const char *text);
/* Copies a name after the prefix, mended to UTF-8. */
void import_prefix_name(const struct import_scene *scene, char out[IMPORT_NAME_MAX + 1], const char *name);

#endif
