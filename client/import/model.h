/* SPDX-License-Identifier: MIT */
/* Between the files that make up the growing scene; the format readers use import.h. */
#ifndef FARLIGHT_IMPORT_MODEL_H
#define FARLIGHT_IMPORT_MODEL_H

#include "import.h"

/* A new edit at the end of the list, all zero but for its type; NULL if the scene has failed. */
struct import_edit *import_append(struct import_scene *scene, enum message_type type);
/* A mended copy that the edit owns; NULL: out of memory, and the scene has failed. */
char *import_copy_name(struct import_scene *scene, const char *name);
uint32_t import_next_id(struct import_scene *scene, enum protocol_object_kind kind);
/* The same, at most out_bytes - 1 bytes long. */
void import_copy_text(char *out, size_t out_bytes, const char *text);

#endif
