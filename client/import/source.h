/* SPDX-License-Identifier: MIT */
/* The models of an import: where each comes from, and where it stands in the scene. Each of several models is
 * below a node of its own, and all names begin with that node's: "chair/seat", and of a second one "chair-2/seat".
 * The first model's cameras and background are the scene's, those of further models are left out. */
#ifndef FARLIGHT_IMPORT_SOURCE_H
#define FARLIGHT_IMPORT_SOURCE_H

#include "import/model/files.h"
#include "format.h"
#include "import/model/scene.h"

#define SOURCES_MAX 64

struct source {
    const char *path;   /* "-": standard input, which is a file */
    const char *format; /* "glb", where the name does not say it; NULL: by its first bytes */
    bool is_placed;
    double position[3], degrees[3], scale; /* degrees about x, then y, then z */
    struct files files;                    /* from here on: once it is opened */
    unsigned char *bytes;
    size_t size_bytes;
    struct format of;
    size_t edit_begin, edit_end; /* in the scene, once it is parsed */
    uint32_t node_begin, node_end, root;
    char prefix[IMPORT_PREFIX_MAX + 1];
};

/* "X,Y,Z", "X,Y,Z:RX,RY,RZ" or "X,Y,Z:RX,RY,RZ:SCALE". */
bool source_place(struct source *source, const char *text);
/* The model's name for people. */
const char *source_name(const struct source *source);
/* Opens and reads it, before the sandbox is entered. False: `reason` says why. */
bool source_read(struct source *source, char reason[FILES_REASON_BYTES]);
void source_finish(struct source *source);

/* What is added to the scene until source_end() is of this model, one of `count`. */
bool source_begin(struct import_scene *scene, struct source *sources, size_t index, size_t count);
void source_end(struct import_scene *scene, struct source *source);
/* Adds the model as instances of what an earlier one, of the same file, has added. False: there is none, or it has
 * what belongs to one model alone (skins, animations): the file is to be parsed again. */
bool source_repeat(struct import_scene *scene, struct source *sources, size_t index, size_t count);

#endif
