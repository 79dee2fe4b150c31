/* SPDX-License-Identifier: MIT */
/* libfarlight: a client of the farlight daemon.
 *
 *   struct fl_error error = {0};
 *   struct fl_connection *connection = fl_connect(&(struct fl_connect_options){0}, &error);   a private daemon
 *   struct fl_scene *scene = fl_scene_load(connection, &(struct fl_load_options){.model = "a.glb"}, &error);
 *   struct message_render render = fl_render_defaults();
 *   render.samples = 4;
 *   struct fl_job *job = fl_render_start(scene, &render, &error);
 *   struct fl_frame *frame;
 *   while ((frame = fl_render_next(job, &error))) { ... fl_frame_destroy(frame); }
 *   fl_render_destroy(job); fl_scene_destroy(scene); fl_connection_destroy(connection);
 *
 * Installed as <farlight/client.h>; libfarlight(3) is its overview. Zero is the default of every option. Errors
 * are values: a function that can fail takes a struct fl_error, says so by false or NULL, and fills it; what the
 * call made until then is undone. A lost connection is FL_ERROR_CONNECTION from then on. `destroy` takes NULL.
 * Destroy jobs before their scene and scenes before their connection; frames stand alone.
 *
 * Calls block and serve one connection at a time: a connection and all that hangs on it belong to one thread
 * at a time. Several connections may live in one process. The library installs no signal handler; helper
 * programs and private daemons are its children and it waits for them by their process ids only.
 *
 * Bytes from a daemon or a helper program are not trusted: sizes are checked before anything is allocated,
 * pixels are checked against their digest, and a peer that breaks the protocol is FL_ERROR_PROTOCOL. */
#ifndef FARLIGHT_CLIENT_LIB_FARLIGHT_H
#define FARLIGHT_CLIENT_LIB_FARLIGHT_H

#include "protocol/messages.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "warp/warp.h" /* views that a client makes */

#define FL_API __attribute__((visibility("default")))

/* ---- errors -------------------------------------------------------------------------------------- */

enum fl_error_code {
    FL_ERROR_NONE,
    FL_ERROR_ARGUMENT,    /* what the caller gave cannot be meant */
    FL_ERROR_FILE,        /* a file cannot be read or written */
    FL_ERROR_CONNECTION,  /* no daemon there, or it went away */
    FL_ERROR_PROTOCOL,    /* the peer sent what the protocol forbids */
    FL_ERROR_REFUSED,     /* the daemon answered with an error: see `server_code` */
    FL_ERROR_MODEL,       /* the importer refused the model */
    FL_ERROR_TIMEOUT,     /* a deadline passed */
    FL_ERROR_INTERRUPTED, /* the interrupt descriptor became readable */
    FL_ERROR_MEMORY,
    FL_ERROR_SYSTEM /* a system call failed that does not fail */
};

struct fl_error {
    enum fl_error_code code;
    enum protocol_error_code server_code; /* of FL_ERROR_REFUSED */
    bool retryable;                       /* the same call may succeed later */
    uint32_t retry_after_ms;              /* 0: unknown */
    char field[160];                      /* option, file or field at fault; may be empty */
    char text[640];                       /* what is wrong */
    char remedy[256];                     /* what to do about it; may be empty */
};

/* Sets *error (may be NULL) and returns false. */
FL_API bool fl_error_set(struct fl_error *error, enum fl_error_code code, const char *field, const char *format,
                         ...) __attribute__((format(printf, 4, 5)));
/* Adds a remedy to an error that is set; returns false. */
FL_API bool fl_error_remedy(struct fl_error *error, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* "FIELD: TEXT (REMEDY)", control characters made harmless; always terminated. */
FL_API void fl_error_print(const struct fl_error *error, char *line, size_t line_bytes);

/* ---- connections --------------------------------------------------------------------------------- */

struct fl_connection;

struct fl_connect_options {
    /* "unix:PATH", "tcp:HOST:PORT" or "ssh:HOST[:SOCKET]"; NULL: a private daemon over a socketpair, which
     * ends with the connection. ssh runs `farlight bridge unix:SOCKET` on HOST and speaks through it. */
    const char *server;
    const char *name; /* the client's name in the daemon's statistics; NULL: "libfarlight" */
    /* File of the 32 random bytes that the daemon has as well, mode 0600: the connection is sealed with it, and
     * fails if the daemon does not have it. TCP beyond loopback needs it; NULL: nothing is sealed. Of no effect
     * for a private daemon. With a key the calling process can no longer be dumped or traced by its user. */
    const char *key_file;
    bool can_h264;       /* frames of views may come in H.264, for the caller to decode */
    int interrupt_fd;    /* > 0: calls give up with FL_ERROR_INTERRUPTED when it becomes readable */
    unsigned timeout_ms; /* to connect, start and shake hands; 0: 30 s */
    /* Silence after which the daemon counts as lost, though calls ping it: FL_ERROR_CONNECTION. A daemon answers
     * pings however long it renders. 0: 60 s. */
    unsigned lost_after_ms;
    const char *const *daemon_arguments; /* for a private daemon, NULL-terminated, at most 28; NULL: none */
};

FL_API struct fl_connection *fl_connect(const struct fl_connect_options *options, struct fl_error *error);
/* Says goodbye, which ends a private daemon, and waits for nothing: scenes and jobs can only be destroyed now. */
FL_API void fl_connection_end(struct fl_connection *connection);
/* Ends it, waits for a private daemon (it is killed after a few seconds), and frees it. */
FL_API void fl_connection_destroy(struct fl_connection *connection);
/* From now on; 0: nothing interrupts. For cleaning up after an interruption. */
FL_API void fl_connection_set_interrupt(struct fl_connection *connection, int interrupt_fd);
/* From the call of fl_connect until the daemon was ready. */
FL_API uint64_t fl_connection_start_ns(const struct fl_connection *connection);
/* Private or on a Unix socket: bytes cost next to nothing. */
FL_API bool fl_connection_is_local(const struct fl_connection *connection);
/* Frames of views may be asked for in H.264: the caller said so, and the daemon has an encoder for it. */
FL_API bool fl_connection_can_h264(const struct fl_connection *connection);
FL_API const char *fl_connection_address(const struct fl_connection *connection);

/* An address on which a private daemon also listens (`--listen` among its arguments), with the port that it chose.
 * False: there is no address of that index. */
FL_API bool fl_connection_listens_at(const struct fl_connection *connection, size_t index, char *address,
                                     size_t address_bytes);
/* Serves the connection for this long, as every call does while it waits: it receives changes of scenes, answers
 * the daemon's pings, and pings a silent daemon, so that neither takes the other for lost. False: it was
 * interrupted, or the daemon is gone. */
FL_API bool fl_connection_wait(struct fl_connection *connection, unsigned timeout_ms, struct fl_error *error);

FL_API bool fl_ping(struct fl_connection *connection, uint64_t *round_trip_ns, struct fl_error *error);
/* The daemon lets this client look, but edit nothing. */
FL_API bool fl_connection_is_read_only(const struct fl_connection *connection);

struct fl_limit {
    const char *name, *what; /* what it limits, in words; static */
    uint64_t value;          /* in the unit of its name or `what`; 0: the daemon has none */
};

/* The daemon's limits, from the handshake, in the protocol's order. False: there is no limit of that index. */
FL_API bool fl_connection_limit(const struct fl_connection *connection, size_t index, struct fl_limit *limit);
/* *reply is valid until the next call on the connection. */
FL_API bool fl_stats(struct fl_connection *connection, const struct message_stats_reply **reply,
                     struct fl_error *error);

/* ---- scenes -------------------------------------------------------------------------------------- */

struct fl_scene;

struct fl_camera_info {
    uint32_t node;
    char name[129]; /* the node's name, or the camera's where the node has none */
};

/* The notes, counts and costs of an import. Times of the importer overlap with those of the upload. */
struct fl_import_stats {
    uint64_t read_bytes, read_ns, parse_ns, hash_ns; /* of the model's files, as the importer measured */
    uint64_t import_ns;                              /* the importer's life */
    uint64_t load_ns;                                /* all of it, as the caller waited */
    uint64_t offered_bytes;                          /* of the blobs that the scene uses */
    uint64_t uploaded_bytes;                         /* of those that the daemon did not have */
    uint64_t upload_ns; /* from sending the first to the acknowledgement of the last */
    uint64_t commit_ns; /* from commit to the answer: the daemon's work */
    uint64_t revision;
    /* Subtracted from all places of models that are far from the origin; 0: nothing was. A place of the model is
     * one of the scene and this. */
    double origin[3];
};

struct fl_note {
    enum protocol_severity severity;
    const char *where;
    const char *text;
};

/* An importer that was started ahead, to read the model while the daemon starts. */
struct fl_import;

/* One of several models, and where it stands: turned about x, then y, then z, and scaled. */
struct fl_model {
    const char *path;
    bool is_placed;
    float position[3]; /* metres */
    float degrees[3];
    float scale; /* 0: 1 */
};
#define FL_MODELS_MAX 64

struct fl_load_options {
    const char *model; /* path */
    /* Models of one scene, in place of `model`, if there are any; at most FL_MODELS_MAX. Of several, each is below
     * a node of its own, and all names begin with that node's: "chair/seat", "chair-2/seat". Cameras, variant and
     * background are the first model's. */
    const struct fl_model *models;
    size_t model_count;
    int input_fd;               /* > 0: a file with the bytes of the model whose path is "-" */
    const char *input_format;   /* its format, as "glb"; NULL: by its first bytes */
    const char *environment;    /* equirectangular image file all around, or NULL; alone (model NULL) allowed */
    double environment_degrees; /* its turn about +y, -360 to 360; 0: its middle column is +x, as glTF viewers have
                                   it */
    double point_size;          /* diameter of points without faces, metres; 0: chosen by their distances */
    unsigned timeout_ms;        /* after this the importer is killed; 0: 10 minutes */
    /* Called during the load; may be NULL. Strings live as long as the call. */
    void (*note)(void *user, const struct fl_note *note);
    void (*progress)(void *user, uint64_t done_bytes, uint64_t total_bytes, const char *what);
    void *user;
    enum protocol_sharing sharing; /* who else can come to the scene .. */
    const char *scene_name;        /* .. and by what name; NULL: the model's file name */
    struct fl_import *started;     /* by fl_import_start; the load takes it over, also when it fails. `model`,
                                      its environment and `timeout_ms` are those given at its start */
    const char *variant;           /* of the model's materials, by name; NULL: the file's choice */
    bool without_studio;           /* a model with lights has these alone, and no sky beside them */
    bool will_reload;              /* for fl_scene_reload: what is loaded is remembered, some bytes an object */
};

/* The options' strings must live until the load. Destroy an importer that is not loaded. */
FL_API struct fl_import *fl_import_start(const struct fl_load_options *options, struct fl_error *error);
FL_API void fl_import_destroy(struct fl_import *started);

/* Runs the importer and passes its edits to the daemon. */
FL_API struct fl_scene *fl_scene_load(struct fl_connection *connection, const struct fl_load_options *options,
                                      struct fl_error *error);
/* Loads the models again and passes on what has changed since, in one transaction, so that structures of what
 * stays are kept; a scene that was attached to gets all of it. Returns the same scene, or another one in its
 * place, where it was loaded without will_reload, or something is gone that cannot be removed, as others use it.
 * NULL: it is as it was before. Edits of others that the models do not contradict stay. What the scene has told of
 * its files, cameras and clips is not valid any more. options->started must be NULL. */
FL_API struct fl_scene *fl_scene_reload(struct fl_scene *scene, const struct fl_load_options *options,
                                        struct fl_error *error);
FL_API void fl_scene_destroy(struct fl_scene *scene); /* lets go of it on the daemon, too */

/* Attaches to an existing scene; its cameras and clips are requested at once and known as those of a loaded one.
 * Materials and lights, whose names only an import tells, are not. A scene of another user's needs a connection
 * that has no other scene and no request in flight. */
FL_API struct fl_scene *fl_scene_attach(struct fl_connection *connection, const char *name,
                                        struct fl_error *error);
/* The scenes that may be attached to. *list is malloc'ed, for free(). */
struct fl_scene_entry {
    char name[129];
    uint64_t revision, triangles;
    uint32_t clients;
    enum protocol_sharing sharing;
};
FL_API bool fl_scene_list(struct fl_connection *connection, struct fl_scene_entry **list, size_t *count,
                          struct fl_error *error);
struct fl_scene_bounds {
    bool empty; /* nothing is visible */
    float lower_world[3], upper_world[3];
    uint64_t revision, triangles, spheres;
};
FL_API bool fl_scene_get_bounds(struct fl_scene *scene, struct fl_scene_bounds *bounds, struct fl_error *error);
/* The same of a scene that was attached to, whose cameras and clips are learned again: what it has told of them is
 * not valid any more. */
FL_API bool fl_scene_refresh(struct fl_scene *scene, struct fl_scene_bounds *bounds, struct fl_error *error);
/* The highest revision that the daemon has reported, of an own edit or another client's. */
FL_API uint64_t fl_scene_revision(const struct fl_scene *scene);
/* The path of a file that a loaded scene is made of: its models, its environment, and what the models name, which
 * need not exist. NULL beyond the last; valid until the scene is destroyed. */
FL_API const char *fl_scene_file(const struct fl_scene *scene, size_t index);
FL_API const struct fl_import_stats *fl_scene_import_stats(const struct fl_scene *scene);
FL_API size_t fl_scene_camera_count(const struct fl_scene *scene);
FL_API const struct fl_camera_info *fl_scene_camera(const struct fl_scene *scene, size_t index);
/* `which` is a camera's name, or its number counted from 0; a name has precedence over a number. */
FL_API bool fl_scene_find_camera(const struct fl_scene *scene, const char *which, uint32_t *node,
                                 struct fl_error *error);

struct fl_clip_info {
    uint32_t clip; /* its identifier; 0: it cannot be played */
    uint32_t channels;
    float duration_s; /* time of its last key */
    char name[129];
};
FL_API size_t fl_scene_clip_count(const struct fl_scene *scene); /* at most 65536 are remembered */
/* NULL beyond the last; valid until the scene is destroyed. */
FL_API const struct fl_clip_info *fl_scene_clip(const struct fl_scene *scene, size_t index);
/* `which` is a clip's name, or its number counted from 0; a name has precedence over a number. *info (may be NULL)
 * as of fl_scene_clip. FL_ERROR_ARGUMENT, field "--clip": there is no such clip, or it cannot be played; the
 * remedy lists the clips, as far as they fit. */
FL_API bool fl_scene_find_clip(const struct fl_scene *scene, const char *which, uint32_t *clip,
                               const struct fl_clip_info **info, struct fl_error *error);

/* The identifier of a node, a material or a light. `which` is its name, or its number counted from 0 in the order
 * of the import; a name has precedence over a number, and the first of several with one name counts. A light is
 * known by its own name and by those of the nodes that show it. The first 1 Mi of each kind are remembered.
 * FL_ERROR_ARGUMENT, field "node", "material" or "light": there is none, and the remedy lists the names, as far as
 * they fit; other kinds are not known by name. */
FL_API bool fl_scene_find_object(const struct fl_scene *scene, enum protocol_object_kind kind, const char *which,
                                 uint32_t *id, struct fl_error *error);
/* Whether the models, as they were loaded, brought lights or an environment, or one was given. */
FL_API bool fl_scene_is_lit(const struct fl_scene *scene);
/* Whether such a light has a size that can change: a rectangle or a sphere. */
FL_API bool fl_scene_light_has_size(const struct fl_scene *scene, uint32_t light);
/* An unused identifier for an edit of the caller's, a new one at each call; 0: none left.
 */
FL_API uint32_t fl_scene_new_id(struct fl_scene *scene, enum protocol_object_kind kind);

/* One property of one object over time; the numbers are the caller's and only read. */
struct fl_channel {
    enum protocol_channel_path path;
    uint32_t object; /* node, light or material; 0 for the view */
    enum protocol_interpolation interpolation;
    uint32_t width, key_count; /* as of set_channel in messages.def */
    const float *times;        /* seconds, ascending */
    const float *values;       /* width numbers per key, three times that for cubic spline and bezier */
};
/* Adds a clip of the caller's to the scene, for jobs that are started later; *clip is its identifier. Uploads its
 * data if the daemon lacks it, and waits until the edit is applied. */
FL_API bool fl_scene_add_clip(struct fl_scene *scene, const char *name, const struct fl_channel *channels,
                              size_t channel_count, uint32_t *clip, struct fl_error *error);

/* ---- objects of a scene and their fields, also of other clients ---- */

struct fl_object {
    uint32_t id;
    uint32_t parent, shows; /* of a node: the one above it, 0: none; the identifier of what it shows .. */
    enum protocol_node_kind shows_kind; /* .. and its kind */
    char name[129];
};
/* The objects of a kind as the daemon has them now, ascending by id; *objects is malloc'ed. */
FL_API bool fl_scene_objects(struct fl_scene *scene, enum protocol_object_kind kind, struct fl_object **objects,
                             size_t *count, struct fl_error *error);
/* One of them by its identifier, such as a picture's layer `id` has of nodes and materials; of any kind but
 * `environment`. */
FL_API bool fl_scene_object(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                            struct fl_object *object, struct fl_error *error);

/* The identifiers of the objects that are meant, at least one; *ids is malloc'ed. `which` is a name, a number or
 * "#" and an identifier, as of fl_assignment. FL_ERROR_ARGUMENT, field empty: there is none; the remedy has a name
 * that is near, or all as far as they fit. Of the kind `environment` there is one, 1, whatever `which` says. */
FL_API bool fl_scene_find_objects(struct fl_scene *scene, enum protocol_object_kind kind, const char *which,
                                  uint32_t **ids, size_t *count, struct fl_error *error);

#define FL_FIELDS_MAX 64u       /* of one kind of object */
#define FL_FIELD_VALUES_MAX 12u /* of one field */

enum fl_field_form {
    FL_FIELD_NUMBERS,
    FL_FIELD_COLOUR, /* red, green, blue, linear; with a fourth value alpha */
    FL_FIELD_FLAG,   /* 0 or 1 */
    FL_FIELD_WORD,   /* the number of a word: fl_field_word */
};

/* A field that can be edited, of nodes, materials, lights, cameras or the environment. Angles are degrees. */
struct fl_field {
    char name[48]; /* "roughness" */
    enum fl_field_form form;
    unsigned count;         /* values */
    double min, max;        /* of each */
    const char *unit, *doc; /* static; may be empty */
    unsigned source;        /* this and what follows: for the library */
    double scale;
    const struct field_desc *wire;
};
/* Those of a kind of object, in the order for people; at most FL_FIELDS_MAX. Returns how many there are: 0 of
 * other kinds. */
FL_API size_t fl_fields(enum protocol_object_kind kind, struct fl_field fields[FL_FIELDS_MAX]);
/* "blend"; NULL: there is no word of that number. */
FL_API const char *fl_field_word(const struct fl_field *field, unsigned number);

struct fl_field_value {
    struct fl_field field;
    double values[FL_FIELD_VALUES_MAX];
};
/* An object as it is, whatever clips do to it: the fields that it has, such as of a light those of its kind. */
struct fl_object_state {
    enum protocol_object_kind kind;
    uint32_t id;
    char name[129];
    uint64_t revision; /* of the scene, when it was read */
    size_t count;
    struct fl_field_value fields[FL_FIELDS_MAX];
};
FL_API bool fl_scene_read(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                          struct fl_object_state *state, struct fl_error *error);

/* ---- edits ---- */

enum fl_assignment_way { FL_ASSIGN, FL_ASSIGN_SUM, FL_ASSIGN_PRODUCT };

/* A field of an object gets a value. */
struct fl_assignment {
    enum protocol_object_kind kind; /* node, material, light, camera or environment */
    uint32_t id;                    /* 0: `which` says which objects; of the environment neither counts */
    /* A name, or a number counted from 0 by ascending identifiers; a name has precedence over a number, and the
     * first of several with one name counts. A light or a camera is known by the nodes that show it, too. "*"
     * stands for any characters, and then all that match are meant. "#7" is the object with identifier 7. */
    char which[129];
    char field[48];
    enum fl_assignment_way way;
    unsigned count; /* 1 of several values stands for all; 3 of a colour leave its alpha */
    double values[FL_FIELD_VALUES_MAX];
};
/* Reads "material.Steel.roughness=0.2", "light.Sun.intensity*=2", "node.Door.rotate+=0,30,0",
 * "material.#7.base_colour=#ff8000", "environment.rotation=90", "hide=Roof" or "show=Roof". FL_ERROR_ARGUMENT
 * names the assignment. */
FL_API bool fl_assignment_parse(const char *text, struct fl_assignment *assignment, struct fl_error *error);
/* As fl_assignment_parse() reads it; values keep their floats. Cut off where it does not fit. Returns text. */
FL_API const char *fl_assignment_print(const struct fl_assignment *assignment, char *text, size_t text_bytes);

struct fl_edited {
    uint64_t revision; /* that has the change; the one before if nothing changed */
    size_t objects;    /* changed */
    /* What sets the changed fields back, in any order; fields that others change meanwhile stay. malloc'ed, to be
     * freed in any case. */
    struct fl_assignment *undo;
    size_t undo_count;
};
/* Applies all assignments, in order, or none, in one transaction. Fields that others change meanwhile stay as they
 * are: the daemon refuses an edit of an object that has changed since it was read, and it is made anew. A clip
 * that plays has precedence over an edit of what it moves. Waits until the daemon has applied it, which is after
 * the frame that it is rendering; a view's refinement is given up for it. *edited may be NULL. */
FL_API bool fl_scene_edit(struct fl_scene *scene, const struct fl_assignment *assignments, size_t count,
                          struct fl_edited *edited, struct fl_error *error);

/* The contents of a model file, without a daemon. */
struct fl_model_note {
    enum protocol_severity severity;
    char where[257];
    char text[513];
};
/* A node, material or light, in the order of the file. */
struct fl_model_object {
    const char *name; /* may be empty */
    bool has_bounds;  /* a node that shows a mesh or spheres: */
    float lower_world[3], upper_world[3];
};
/* A set of materials that fl_load_options.variant may name. */
struct fl_variant_info {
    char name[129];
};
struct fl_model_info {
    uint64_t nodes, meshes, triangles, sphere_sets, spheres, discs, materials, textures, lights;
    uint64_t skins, joints, morph_targets; /* joints of all skins, targets of all meshes */
    uint64_t closed_meshes;                /* those whose triangles bound a body */
    struct fl_import_stats import;
    size_t camera_count, clip_count, note_count;
    struct fl_camera_info *cameras;
    struct fl_clip_info *clips;
    struct fl_model_note *notes; /* at most 1000; `notes_left_out` more */
    uint64_t notes_left_out;
    /* At most 1 M of each. */
    struct fl_model_object *node_list, *material_list, *light_list;
    size_t node_list_count, material_list_count, light_list_count;
    char *names; /* what the lists' names are in */
    /* Of all nodes with meshes or spheres, as they are before clips, skins and morph targets move anything. */
    bool has_bounds;
    float lower_world[3], upper_world[3];
    size_t variant_count;
    struct fl_variant_info *variants; /* at most 65536 */
};
/* options->note is not called: the notes are in the result. `interrupt_fd` as in the connection's options. */
FL_API struct fl_model_info *fl_model_info(const struct fl_load_options *options, int interrupt_fd,
                                           struct fl_error *error);
FL_API void fl_model_info_destroy(struct fl_model_info *info);

/* ---- rendering ----------------------------------------------------------------------------------- */

struct fl_job;

/* What is rendered is the protocol's own message: protocol/messages.def and tracers.def say what each field means
 * and allows, or `farlight tracers` and farlight(1). These return it with the defaults of the table. The library
 * sets `kind`, `scene` and `channel`; of a job `credit` is the number of frames that the daemon may send ahead.
 * Keys and clips are only read. */
FL_API struct message_render fl_render_defaults(void);

/* One picture and what it cost. */
struct fl_frame {
    uint32_t frame, width, height, samples;
    float noise; /* largest error of a tile, if `render` has noise; 1e6: not known yet */
    uint64_t revision;
    enum protocol_pixel_format format;
    enum protocol_encoding encoding; /* as it travelled; pixels are decoded */
    enum protocol_tracer tracer;
    enum protocol_integrator integrator;
    bool digest_checked; /* lossless: the pixels have the digest that the daemon computed */
    uint64_t digest;
    float exposure_stops, world_from_view[12], fov_y, ortho_height, time_s;
    float aperture, focus; /* of the lens, metres; focus 0: there is none */
    float shutter_s;       /* how long the shutter was open, seconds */
    unsigned layers;       /* set of layers that `pixels` has, in the order of their numbers */
    uint64_t primary_rays, shadow_rays, secondary_rays, splits, uploaded_bytes, structure_bytes;
    uint32_t device_waits;         /* how often the daemon has waited for the device */
    uint32_t dispatches, barriers; /* that it has queued: compute passes; waits of a pass for those before it */
    uint64_t wire_bytes;           /* of the encoded pixels and what is attached */
    uint64_t depth_bytes;          /* the depths' share of it */
    /* A frame in parts comes coarse first, and may end after any: what is there is decoded. With fewer than all
     * colours are coarser, depths may be, and normals may be missing. */
    unsigned parts_come, parts;     /* 1 of 1: it came as a whole */
    bool more_follows;              /* it comes again with more parts: see fl_view_deliver_parts */
    uint64_t receive_ns, decode_ns; /* first byte to last; decoding and checking */
    uint64_t wait_ns;               /* how long fl_render_next waited for it */
    size_t stage_count;
    struct record_stage_time *stages;
    size_t wave_comparison_count;                    /* 0: the job does not compare */
    struct record_wave_comparison *wave_comparisons; /* ascending by wave and kind of ray; see messages.def */
    size_t structure_count;
    struct record_structure_row
        *structure; /* what the tracer says of its structure; with the strings, one block */
    /* Of a view. Times of the daemon's clock are as fl_ping's answer has it; `command_sent_ns`,
     * `begun_ns` and `whole_ns` are of this process' monotonic clock. */
    uint64_t command; /* the last one that it shows; 0: none yet, and the times of it are 0 */
    uint64_t command_received_ns, command_applied_ns, rendered_ns; /* the daemon's clock */
    uint64_t command_sent_ns;                                      /* when fl_view_look was called for it */
    uint64_t begun_ns, whole_ns;                                   /* first byte, and decoded */
    uint64_t change; /* how many fl_view_change came before what it shows */
    bool moving, key_frame;
    unsigned frame_quality; /* as encoded; 0: lossless */
    uint8_t *encoded;       /* H.264 access unit, or see fl_view_keep_jpeg; NULL: pixels are decoded */
    size_t encoded_bytes;
    float *depth;         /* width * height, metres along the view; 0 where nothing is; NULL: none */
    float depth_step;     /* 1 / depth was rounded to multiples of it, 1 / metres; 0: it was not */
    bool depth_is_coarse; /* of a frame's first parts: bilinear where the surface is one, else that of what is
                             nearest in 8 x 8 pixels */
    float depth_error; /* 1 / depth is off by at most this, 1 / metres: half a step, or, where it is coarse, that
                          at the worst edge: it is no noise */
    /* Of what moves: pixels on each side beyond the picture that was asked for; width, height and fov_y are of
     * all. */
    uint32_t margin_x, margin_y;
    uint32_t depth_less; /* bounces fewer than were asked for, for the moving_rate */
    /* How many surfaces hide what it shows, of the picture of_frame, at half of its width and height, rounded up;
     * 0: it is a picture. */
    uint32_t hidden_layer;
    uint32_t of_frame;
    uint8_t *normals;    /* width * height * 4; see messages.def; NULL: none */
    uint8_t *sticking;   /* width * height; likewise */
    size_t pixels_bytes; /* layers times width * height * 4, 8 or 16 */
    uint8_t *pixels;     /* rows from the top, without gaps, in `format` */
};

#define FL_STRUCTURE_NAME_BYTES 64

/* A part of a frame's structure, as a line for people. */
struct fl_structure_part {
    uint32_t number;
    char name[FL_STRUCTURE_NAME_BYTES]; /* empty: the structure has no parts */
    char text[512];                     /* "resolution 128, cell 1.2 mm" */
    bool is_kept;                       /* from frame to frame, unless it is rebuilt */
    bool built;                         /* for this frame */
};
/* The part whose rows begin at *at (0: the first), which moves behind them; false: there is none. */
FL_API bool fl_structure_next(const struct fl_frame *frame, size_t *at, struct fl_structure_part *part);

/* One job at a time per connection. */
FL_API struct fl_job *fl_render_start(struct fl_scene *scene, const struct message_render *wanted,
                                      struct fl_error *error);
/* The next frame, in order; NULL with error->code FL_ERROR_NONE after the last. The caller destroys it. */
FL_API struct fl_frame *fl_render_next(struct fl_job *job, struct fl_error *error);
/* The same, waiting at most timeout_ms for it, 0: not at all. NULL with error->code FL_ERROR_NONE: none so far, or
 * with *done none any more. */
FL_API struct fl_frame *fl_render_poll(struct fl_job *job, unsigned timeout_ms, bool *done,
                                       struct fl_error *error);
FL_API void fl_frame_destroy(struct fl_frame *frame);
/* Ends the job early and waits until the daemon confirms it; what was sent meanwhile is dropped. */
FL_API bool fl_render_cancel(struct fl_job *job, struct fl_error *error);
FL_API void fl_render_destroy(struct fl_job *job); /* cancels what still runs */

/* ---- views: pictures that follow a camera ---------------------------------------------------------- */

/* One per connection, beside at most one job of fl_render_start. Its frames arrive when there is something to
 * show; between calls they wait in the socket. */
struct fl_view;

enum fl_attachment { /* bits */
                     FL_ATTACH_DEPTH = 1 << PROTOCOL_ATTACHMENT_DEPTH,
                     FL_ATTACH_NORMALS = 1 << PROTOCOL_ATTACHMENT_NORMALS,
                     /* A daemon that does not know it leaves it out. */
                     FL_ATTACH_STICKING = 1 << PROTOCOL_ATTACHMENT_STICKING
};

/* Likewise of a view. Of the fields that only a range of frames has, none is used; `frames_per_second` is the most
 * that is wanted, 60 here; `samples` what a picture gets at most while nothing moves, 64 here; the format is
 * rgba8; `encoding` is that of motion; `credit` 4; `attachments` enum fl_attachment bits. */
FL_API struct message_render fl_view_defaults(void);

struct fl_view_camera {
    float eye_world[3], look_at_world[3], up_world[3];
    float fov_y;
    float time_s;
    bool moving; /* more will follow soon */
    /* A camera of the scene (fl_camera_info.node): the view looks through it, where clips have brought it at
     * time_s, and the four fields at the top do not count, but must be sound. 0: they do. */
    uint32_t node;
};

FL_API struct fl_view *fl_view_start(struct fl_scene *scene, const struct message_render *options,
                                     struct fl_error *error);
/* Changes what it shows (size, tracer, integrator, exposure ..); camera and frame numbers continue. */
FL_API bool fl_view_change(struct fl_view *view, const struct message_render *options, struct fl_error *error);
/* Sends it and returns; *command (may be NULL) is its number in frames. */
FL_API bool fl_view_look(struct fl_view *view, const struct fl_view_camera *camera, uint64_t *command,
                         struct fl_error *error);
/* The next complete frame; waits at most timeout_ms for it, 0: not at all. NULL with error->code FL_ERROR_NONE:
 * none so far. The caller destroys it. A frame in H.264 comes undecoded: `encoded` instead of `pixels`. */
FL_API struct fl_frame *fl_view_next(struct fl_view *view, unsigned timeout_ms, struct fl_error *error);
/* From now on, if the view asks for parts: a frame comes as soon as its first parts show something, with
 * more_follows, and again with all that has come, under the same number. Those in H.264 come once. It costs a
 * second decoding. */
FL_API void fl_view_deliver_parts(struct fl_view *view, bool deliver);
/* From now on: a frame in JPEG comes undecoded and unchecked, as one in H.264 does, for a caller that passes it
 * on. */
FL_API void fl_view_keep_jpeg(struct fl_view *view, bool keep);
/* Reports that the caller could not decode a frame: the next one will be a key frame. */
FL_API bool fl_view_want_key_frame(struct fl_view *view, struct fl_error *error);
FL_API void fl_view_destroy(struct fl_view *view);
/* Views that the caller makes from a frame: `fl_warp_*` of warp/warp.h, with no connection, window or GL. Ask for
 * FL_ATTACH_DEPTH, and for depth_form inverse, with depth_pixels and depth_radius for a bound, and a margin. Then
 * the key view has the frame's width, height and camera (world_from_view, fov_y), its pixels in RGBA8 as colours,
 * and w = unit / depth (0 where depth is 0) with w_error = unit * depth_step / 2. With FL_ATTACH_STICKING its
 * layer has `sticking` as well, and views are marked where their colours stick. */

/* For the caller's own poll(): readable when something may have arrived. The connection keeps it. */
FL_API int fl_connection_fd(const struct fl_connection *connection);

/* The share of rays on which both tracers agree, of those that are on no edge; 1 without rays. A hit on another
 * surface is no agreement. Shading does not matter. */
FL_API double fl_wave_agreement(const struct record_wave_comparison *comparison);
/* Sums of the counts and times of several waves, and their maximum errors; medians and percentiles, which cannot
 * be added, are 0. `into` may be all zero. */
FL_API void fl_wave_add(struct record_wave_comparison *into, const struct record_wave_comparison *from);

FL_API uint32_t fl_bytes_per_pixel(enum protocol_pixel_format format);

/* Reads an array of {"time", "eye", "look_at", "up", "fov"} (seconds; world; degrees) from a JSON file.
 * *keys is malloc'ed. Errors name the file, the line or the entry, and the field. */
FL_API bool fl_camera_keys_load(const char *path, struct record_camera_key **keys, size_t *key_count,
                                struct fl_error *error);

/* ---- image files --------------------------------------------------------------------------------- */

/* The exporter: a helper program that writes image files; one for many files. */
struct fl_exporter;

struct fl_exporter_options {
    const char *folder;      /* the folder of the files: the program can write nowhere else */
    const char *model;       /* named in the files; may be NULL */
    float frames_per_second; /* named in EXR files; 0: unknown */
    int interrupt_fd;
    const char *format; /* of all files, as below: some start faster; NULL: any */
    bool full_metadata; /* date, times of stages and revision too: then no two files are the same */
    bool draws_text;    /* pictures come with text */
    /* EXR: "key,fill": names of the layers light_group1 and so on; NULL: light_group1.. */
    const char *light_groups;
    bool dwaa; /* EXR: colours are compressed with loss (DWAA), all else by zip as a part of its own; else zip */
    /* The colours that are written. Frames of the format rgba32f are linear Rec. 709; all NULL: so are the files.
     */
    const char
        *colour_space; /* EXR: ACEScg, ACES2065-1, Linear Rec.2020, Linear P3-D65 or one of the configuration */
    const char *display_view; /* pictures of 8 bits: "VIEW" or "DISPLAY/VIEW" of the configuration */
    const char *ocio;         /* the configuration of OpenColorIO, a file */
    struct {
        uint32_t x, y, width, height;
    } window; /* frames are the part from (x, y) on of pictures of width x height, as EXR files say; all 0: all of
                 it */
};
/* A line of text in the middle of a box, of about 14 pixels' height; the beginning of one that is too long for the
 * box is left out. Without an installed font none is drawn. */
struct fl_export_text {
    uint32_t x, baseline, width; /* pixels */
    uint32_t colour;             /* 0xrrggbb, as a screen has it */
    const char *text;            /* at most 256 bytes are drawn */
};
struct fl_export_options {
    const char *path;
    const char *format; /* "png", "jpeg", "exr", "hdr", "webp", "tiff", "gif" where the path's ending does not say;
                           may be NULL */
    bool half;          /* EXR: half floats; layers of distances, positions and object numbers stay 32-bit */
    unsigned quality;   /* JPEG and WebP; 0: 95 */
    const struct fl_export_text *texts; /* to be drawn into it, if it has the format rgba8 */
    size_t text_count;
    double origin[3]; /* for the metadata: that of the scene's import statistics */
    const char *part; /* EXR: the frame is a part of a picture, "K/N DIGEST DEVICE" for `farlight merge`; NULL: it
                         is whole */
};

FL_API struct fl_exporter *fl_exporter_start(const struct fl_exporter_options *options, struct fl_error *error);
/* Names of nodes and materials for Cryptomatte in EXR files, until others come: those of the scene; those that
 * share one have the names of what they hang below before it, "car/wheel", and where that is not enough or there
 * is no name their identifiers, "wheel#12". Files without such layers do not need them. */
FL_API bool fl_exporter_names(struct fl_exporter *exporter, struct fl_scene *scene, struct fl_error *error);
/* Hands the frame over and returns; the file is complete, or has failed, by the next call of this or of
 * fl_exporter_wait, which report the failure of the one before. The frame may be destroyed at once. */
FL_API bool fl_exporter_write(struct fl_exporter *exporter, const struct fl_frame *frame,
                              const struct fl_export_options *options, struct fl_error *error);
FL_API bool fl_exporter_wait(struct fl_exporter *exporter, struct fl_error *error);
/* Ends the program; an unfinished file is removed. */
FL_API void fl_exporter_destroy(struct fl_exporter *exporter);

/* ---- videos -------------------------------------------------------------------------------------- */

/* The video writer: a helper program that writes one video, from frames of pixel format rgba8 and one size. */
struct fl_video;

struct fl_video_options {
    const char *path;        /* its folder is the only one that the program can write to */
    const char *format;      /* "mp4", "mkv", "webp", "gif" where the path's ending does not say; may be NULL */
    const char *codec;       /* "h264", "mpeg4", "ffv1"; NULL: H.264 where libavcodec has an encoder for it, else
                                MPEG-4; lossless: FFV1 */
    const char *model;       /* named in the file; may be NULL */
    float frames_per_second; /* 0: 24; 23.976, 29.97 and so on mean 24000/1001, 30000/1001 and so on */
    unsigned quality;        /* x264's rate factor, 1 (best) to 51; 0: 18. WebP: 1 to 100 (best); 0: 90 */
    bool lossless;           /* every pixel as it is, .mkv and .webp only */
    int interrupt_fd;        /* as of fl_connect_options */
};

struct fl_video_info {
    char encoder[33];       /* libavcodec's name: "libx264"; known from the start on */
    uint32_t frames;        /* this and what follows: once fl_video_finish has returned true */
    uint32_t width, height; /* those of the frames, but 4:2:0 has even ones: it repeats the last column or row */
    uint64_t size_bytes;
};

/* Fails early: when this returns, the folder can be written to and there is an encoder. The video is 8-bit 4:2:0,
 * tagged as what it is: primaries and matrix of BT.709, the transfer curve of sRGB, limited range; lossless: RGB.
 * Transparent pixels are composited over black. WebP keeps red, green, blue and alpha, GIF 255 colours over black;
 * both are shown over and over, and GIF counts hundredths of a second. The same frames and options make the same
 * file on the same machine (x264 encodes a little differently with another number of processors). */
FL_API struct fl_video *fl_video_start(const struct fl_video_options *options, struct fl_error *error);
/* Hands the frame over and returns; the frame may be destroyed at once. Frames are shown in the order in which
 * they come, whatever their numbers. A frame that fails in the program is reported by a later call of this or by
 * fl_video_finish; the video is then removed, and no frame can be written any more. */
FL_API bool fl_video_write(struct fl_video *video, const struct fl_frame *frame, struct fl_error *error);
/* Makes the file complete: it appears under its name, in place of one that was there. At least one frame must have
 * been written. After FL_ERROR_INTERRUPTED from fl_video_write (and with fl_video_set_interrupt, since the
 * descriptor is still readable) this keeps the frames before the one that was interrupted. */
FL_API bool fl_video_finish(struct fl_video *video, struct fl_error *error);
/* Valid until the video is destroyed. */
FL_API const struct fl_video_info *fl_video_info(const struct fl_video *video);
/* From now on; 0: nothing interrupts. */
FL_API void fl_video_set_interrupt(struct fl_video *video, int interrupt_fd);
/* Ends the program; an unfinished video is removed. */
FL_API void fl_video_destroy(struct fl_video *video);

/* ---- raw video ----------------------------------------------------------------------------------- */

/* A YUV4MPEG2 stream (.y4m), which ffmpeg, mpv and x264 read from a pipe; written by the library itself. */
struct fl_y4m;

enum fl_y4m_chroma {
    FL_Y4M_444, /* C444: every pixel's colour */
    FL_Y4M_420, /* C420mpeg2: half the columns and rows, (width + 1) / 2 by (height + 1) / 2 */
};

struct fl_y4m_options {
    int fd;                  /* pipe, socket or file; stays the caller's */
    float frames_per_second; /* as of fl_video_options */
    enum fl_y4m_chroma chroma;
    int interrupt_fd; /* as of fl_connect_options */
};

/* Nothing is written before the first frame. The samples are 8-bit Y'CbCr by BT.709 in limited range (said in the
 * header: XCOLORRANGE=LIMITED) of the frame's sRGB values; the format has no word for matrix, primaries and
 * transfer curve, so a tool must be told (ffmpeg: -colorspace bt709 -color_primaries bt709 -color_trc
 * iec61966-2-1). */
FL_API struct fl_y4m *fl_y4m_begin(const struct fl_y4m_options *options, struct fl_error *error);
/* Writes the whole frame; pixel format rgba8, all of one size; transparent pixels are composited over black. A
 * reader that has closed is FL_ERROR_FILE, "Broken pipe", without a signal. After a failure on the way the stream
 * ends within a frame and takes no more. */
FL_API bool fl_y4m_write(struct fl_y4m *y4m, const struct fl_frame *frame, struct fl_error *error);
/* The stream needs no end of its own: this frees memory. */
FL_API void fl_y4m_end(struct fl_y4m *y4m);

/* ---- comparison of images ------------------------------------------------------------------------ */

#define FL_THRESHOLD_NONE (-1.0f)
#define FL_THRESHOLD_DEFAULT 0.01f

/* Files are read by a helper program without rights, which may open nothing but the two. Both must have the same
 * size and the same channels, one to four of them, at most 8192 pixels each way. */
struct fl_compare_options {
    const char *a, *b;          /* image files: EXR, HDR, PNG or JPEG, by their content */
    bool ignore_alpha;          /* colours only; also where only one of the files has alpha */
    float threshold;            /* a pixel is beyond where a channel differs by more; 0: FL_THRESHOLD_DEFAULT,
                                   FL_THRESHOLD_NONE: any difference */
    const char *picture;        /* where the picture of the errors goes, PNG or JPEG; NULL: nowhere */
    const char *picture_format; /* "png" or "jpeg" where the path's ending does not say; may be NULL */
    enum protocol_comparison_layout layout;
    const char *label_a, *label_b;   /* over the pictures of the layout `side`; NULL: the files' names */
    float heat_top;                  /* the error with the brightest colour; 0: the maximum error, at most 1 */
    enum protocol_tone_map tone_map; /* by which a screen shows linear files */
    unsigned timeout_ms;             /* 0: 10 minutes */
    int interrupt_fd;                /* as of fl_connect_options */
};

/* The difference of two images. An error is the difference of one channel of one pixel, without sign, in units of
 * `space`: linear light where both files are linear (EXR, HDR), else what a screen shows, 0 to 1. Alpha counts as
 * a channel. Pixels with NaN or infinity in either file count as beyond and are left out of everything else. */
struct fl_comparison {
    uint32_t width, height, channels;
    char channel_names[257]; /* "R,G,B,A" */
    enum protocol_comparison_space space;
    float threshold;                              /* that was used */
    uint64_t pixels;                              /* all of them */
    uint64_t nonfinite_a, nonfinite_b, nonfinite; /* pixels with NaN or infinity; in either */
    uint64_t beyond;                              /* pixels beyond the threshold */
    bool has_errors;                              /* false: no pixel is finite, the next seven mean nothing */
    bool identical;                               /* no error at all, and no pixel that is not finite */
    double psnr_db; /* peak signal to noise ratio, 20 log10(1 / rms_error): the peak is white, 1, in both spaces;
                       INFINITY without error */
    double shown_psnr_db; /* the same of the red, green and blue that a screen shows: of linear files through the
                             tone map and the sRGB curve, so that no highlight exceeds the peak */
    double mean_error, rms_error, max_error;
    uint32_t max_error_x, max_error_y, max_error_channel; /* from the top left; counted from 0 */
    /* Structural similarity (Wang, Bovik, Sheikh, Simoncelli. Image quality assessment: from error visibility to
     * structural similarity. 2004): 11x11 Gaussian window of sigma 1.5, K1 0.01, K2 0.03, range 1, on the luma of
     * what a screen shows (linear files: tone map and sRGB curve, as in a PNG of the renderer); the mean
     * over all windows that lie within the picture. */
    bool has_ssim; /* the picture is at least 11x11 */
    double ssim;
    /* Butteraugli distance as libjxl computes it, of what a screen of 80 cd/m2 shows: about 1 where a difference
     * is just seen. */
    bool has_butteraugli;                /* the picture is at least 8x8 and has at most 2^24 pixels */
    double butteraugli, butteraugli_max; /* 3-norm over the picture; maximum */
    uint64_t visible;                    /* pixels with a distance above 1 */
    /* The picture: black is no error, the brightest colour `heat_top` and above, in between by the square root of
     * the error (the maximum of a pixel's channels); pixels that are not finite are magenta. */
    double heat_top;
    uint32_t picture_width, picture_height; /* 0: none */
};

/* The picture is complete when this returns true. Fails with FL_ERROR_FILE where a file cannot be read or written
 * or the two cannot be compared; `field` names the file at fault. */
FL_API bool fl_compare(const struct fl_compare_options *options, struct fl_comparison *comparison,
                       struct fl_error *error);

/* ---- elsewhere ----------------------------------------------------------------------------------- */

/* Copies bytes both ways between descriptors and the socket at `address` ("unix:PATH", "tcp:HOST:PORT") until
 * both directions have ended: what runs at the far end of an ssh connection. */
FL_API bool fl_bridge(const char *address, int in_fd, int out_fd, struct fl_error *error);

#ifdef __cplusplus
}
#endif

#endif
