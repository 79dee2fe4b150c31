/* SPDX-License-Identifier: MIT */
/* The models of an import: their files, and their placement in the scene. Each of several models is below a
 * node of its own, and all names begin with that node's: "chair/seat", for a second one "chair-2/seat". The
 * first model's cameras and background are the scene's, those of further models are left out. */
#ifndef FARLIGHT_IMPORT_SOURCE_H
#define FARLIGHT_IMPORT_SOURCE_H

#include "import/model/files.h"
#include "format.h"
#include "import/model/scene.h"

#define SOURCES_MAX 64

struct source {
    const char *path;   /* "-": standard input, which is a file */
    const char *format; /* "glb", if the name does not show it; NULL: by the first bytes */
    bool is_placed;
    double position[3], degrees[3], scale; /* degrees about x, then y, then z */
    struct files files;                    /* valid, with the members below, once it is opened */
    unsigned char *bytes;
    size_t size_bytes;
    struct format of;
    size_t edit_begin, edit_end; /* range in the scene, once it is parsed */
    uint32_t node_begin, node_end, root;
    char prefix[IMPORT_PREFIX_MAX + 1];
};

/* Reads "X,Y,Z", "X,Y,Z:RX,RY,RZ" or "X,Y,Z:RX,RY,RZ:SCALE". */
bool source_place(struct source *source, const char *text);
/* The model's name for people. */
const char *source_name(const struct source *source);
/* Opens and reads the file, before the sandbox is entered. False: `reason` is set. */
bool source_read(struct source *source, char reason[FILES_REASON_BYTES]);
void source_finish(struct source *source);

/* Starts a model, one of `count`; objects that are added until source_end() belong to it. */
bool source_begin(struct import_scene *scene, struct source *sources, size_t index, size_t count);
void source_end(struct import_scene *scene, struct source *source);
/* Adds the model as instances of an earlier one from the same file. False: there is none, or it has parts that
 * cannot be shared (skins, animations), so the file must be parsed again. */
bool source_repeat(struct import_scene *scene, struct source *sources, size_t index, size_t count);

#endif
