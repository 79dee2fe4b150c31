/* SPDX-License-Identifier: MIT */
/* The client's side of the importer program: starts it, receives its messages, ends it. Independent of the
 * daemon. */
#ifndef FARLIGHT_CLIENT_LIB_IMPORTER_H
#define FARLIGHT_CLIENT_LIB_IMPORTER_H

#include "lib/catalogue.h"
#include "lib/process.h"
#include "lib/stream.h"

/* A camera object's name, until the end of the import shows which nodes have no name of their own. */
struct fl_camera_object {
    uint32_t camera;
    char name[129];
};

struct fl_importer {
    struct fl_stream stream;
    struct fl_process process;
    struct fl_load_options options; /* `model` is one of `models` here */
    struct fl_model only;           /* storage of a single model in `models` */
    uint64_t begin_ns, deadline_ns;
    bool done; /* the importer has reported success */
    struct fl_import_stats stats;
    struct fl_camera_info *cameras;
    uint32_t *camera_objects; /* parallel to `cameras` */
    size_t camera_count, camera_capacity;
    struct fl_camera_object *objects;
    size_t object_count, object_capacity;
    struct fl_catalogue catalogue;
    char **files; /* paths: those of the options, then those that the models name */
    size_t file_count, file_capacity;
    struct fl_error complaint; /* the importer's last note of severity error */
};

/* False, with a reason, if the file cannot be read; this reports a fault before a program is started for it. */
bool fl_importer_check_file(const char *path, struct fl_error *error);
/* Starts the program; it begins to read at once and waits only for the answers that it needs. */
bool fl_importer_start(struct fl_importer *importer, const struct fl_load_options *options,
                       struct fl_error *error);
/* The path of the first model, or of the environment if there is no model, for people. */
const char *fl_importer_name(const struct fl_importer *importer);
/* Records cameras, clips and names; notes and progress go to the options' callbacks. */
bool fl_importer_observe(struct fl_importer *importer, const struct message *message, struct fl_error *error);
/* Sets the error of a program that ended without `done`: its own message, else its exit status. Returns false. */
bool fl_importer_explain(struct fl_importer *importer, struct fl_error *error);
/* Ends the program (at once unless it is done) and completes names and stats. */
void fl_importer_stop(struct fl_importer *importer);
void fl_importer_finish(struct fl_importer *importer);

#endif
