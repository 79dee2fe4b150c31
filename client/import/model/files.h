/* SPDX-License-Identifier: MIT */
/* Reads the model file and the files that it refers to. These are opened beneath the model's own folder and
 * nowhere else, must be regular files, and are read completely into memory.
 *
 * A model that lies in a home folder may name what is no part of it, and its buffers end in a scene that others
 * may have. So nothing is read whose name, or a folder's on the way, begins with a dot, links resolved; a buffer
 * is refused if its content is text or of a known other kind; a library of materials must be one. Images need no
 * check here: only texels of what can be decoded (texture.h) leave the importer. */
#ifndef FARLIGHT_IMPORT_MODEL_FILES_H
#define FARLIGHT_IMPORT_MODEL_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FILES_BYTES_MAX (2ULL << 30) /* of one file */
#define FILES_TOTAL_MAX (4ULL << 30) /* of all files of a model */
#define FILES_REASON_BYTES 256
#define FILES_NAME_BYTES 256 /* of a name within a folder, with its NUL */
#define FILES_NAMED_MAX 4096

struct files {
    int folder;      /* descriptor of the model's folder, -1: it has none, as it is standard input */
    int model;       /* descriptor of the model file */
    int environment; /* likewise, -1: none */
    char **named;    /* what the model named, there or not, relative to its folder */
    size_t named_count;
    uint64_t read_bytes, read_ns;
};

/* Opens folder and files by the paths that the user gave (either may be NULL; "-" is standard input); to be called
 * before the sandbox is entered. False: `reason` names the file and says why. */
bool files_open(struct files *files, const char *model_path, const char *environment_path,
                char reason[FILES_REASON_BYTES]);
void files_finish(struct files *files);

/* Folder part of a path, malloc'd: "." if it has none. NULL: out of memory. */
char *files_folder_of(const char *path);

/* Each returns malloc'd bytes with a NUL behind them that is not counted, or NULL with the reason. */
unsigned char *files_read_descriptor(struct files *files, int descriptor, size_t *size_bytes,
                                     char reason[FILES_REASON_BYTES]);
/* `name` is relative to the model's folder; '\' also separates folders if there is no file of that very name. */
unsigned char *files_read(struct files *files, const char *name, size_t *size_bytes,
                          char reason[FILES_REASON_BYTES]);

/* files_read(), for images, whose names are often those of the machine where the model was made: where there is no
 * such file, one beside the model with the name's last part, in any case and without quotes, is read, and a note
 * in the scene says so. The reason is that of the whole name. */
struct import_scene;
unsigned char *files_read_image(struct files *files, struct import_scene *scene, const char *name,
                                size_t *size_bytes, char reason[FILES_REASON_BYTES]);

/* Whether the content may be vertices and the like: no text, archive, database, program or key. False: *kind says
 * what. */
bool files_is_buffer(const unsigned char *bytes, size_t size_bytes, const char **kind);
/* Whether it is text with statements of MTL. `bytes` has a NUL behind it. */
bool files_is_material_library(const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
