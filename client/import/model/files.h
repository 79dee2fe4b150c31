/* SPDX-License-Identifier: MIT */
/* Reading of the model file and the files that it refers to. Only regular files below the model's own folder
 * are opened, and read completely into memory.
 *
 * A model in a home folder may refer to files that are no part of it, and the contents of its buffers become
 * visible
 * to other users of the scene. So names that begin with a dot, of a file or of a folder on the path, links
 * resolved,
 * are refused; so is a buffer whose content is text or of another known kind, and a library of materials that
 * is
 * not one. Images need no check here: only texels of decodable images (texture.h) leave the importer. */
#ifndef FARLIGHT_IMPORT_MODEL_FILES_H
#define FARLIGHT_IMPORT_MODEL_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FILES_BYTES_MAX (2ULL << 30) /* limit of a file */
#define FILES_TOTAL_MAX (4ULL << 30) /* limit of all files of a model */
#define FILES_REASON_BYTES 256
#define FILES_NAME_BYTES 256 /* limit of a name within a folder, with its NUL */
#define FILES_NAMED_MAX 4096

struct files {
    int folder;      /* descriptor of the model's folder; -1: none, as for standard input */
    int model;       /* descriptor of the model file */
    int environment; /* descriptor of the environment's image; -1: none */
    char **named;    /* names in the model, of existing files or not, relative to its folder */
    size_t named_count;
    uint64_t read_bytes, read_ns;
};

/* Opens folder and files by the user's paths (either may be NULL; "-" is standard input); must be called before
 * the sandbox is entered. False: `reason` names the file and the fault. */
bool files_open(struct files *files, const char *model_path, const char *environment_path,
                char reason[FILES_REASON_BYTES]);
void files_finish(struct files *files);

/* Folder part of a path, malloc'd: "." if it has none. NULL: out of memory. */
char *files_folder_of(const char *path);

/* Read a file: return malloc'd bytes with an additional NUL that is not counted, or NULL with the reason. */
unsigned char *files_read_descriptor(struct files *files, int descriptor, size_t *size_bytes,
                                     char reason[FILES_REASON_BYTES]);
/* Reads a file named relative to the model's folder; '\' also separates folders if there is no file of this
 * exact name. */
unsigned char *files_read(struct files *files, const char *name, size_t *size_bytes,
                          char reason[FILES_REASON_BYTES]);

/* Reads an image, whose name is often from the machine where the model was made: if there is no such file,
 * files_read_image looks for the last part of the name beside the model, ignoring case and quotes, and adds a
 * note to the scene. The reason of a failure is the one for the whole name. */
struct import_scene;
unsigned char *files_read_image(struct files *files, struct import_scene *scene, const char *name,
                                size_t *size_bytes, char reason[FILES_REASON_BYTES]);

/* True if the content may be vertices and the like: no text, archive, database, program or key. False: *kind
 * names its kind. */
bool files_is_buffer(const unsigned char *bytes, size_t size_bytes, const char **kind);
/* True for text with statements of MTL. `bytes` are followed by a NUL. */
bool files_is_material_library(const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
