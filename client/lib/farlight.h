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
    FL_ERROR_ARGUMENT,    /* the caller passed something that is not allowed */
    FL_ERROR_FILE,        /* a file cannot be read or written */
    FL_ERROR_CONNECTION,  /* no daemon answers at the address, or the connection is lost */
    FL_ERROR_PROTOCOL,    /* the peer violated the protocol */
    FL_ERROR_REFUSED,     /* the daemon answered with an error: see `server_code` */
    FL_ERROR_MODEL,       /* the importer refused the model */
    FL_ERROR_TIMEOUT,     /* a deadline passed */
    FL_ERROR_INTERRUPTED, /* the interrupt descriptor became readable */
    FL_ERROR_MEMORY,
    FL_ERROR_SYSTEM /* a system call failed unexpectedly */
};

struct fl_error {
    enum fl_error_code code;
    enum protocol_error_code server_code; /* the daemon's code, for FL_ERROR_REFUSED */
    bool retryable;                       /* a later call may succeed */
    uint32_t retry_after_ms;              /* 0: unknown */
    char field[160];                      /* option, file or field at fault; may be empty */
    char text[640];                       /* a sentence for people: the fault, with the value */
    char remedy[256];                     /* advice for people; may be empty */
};

/* Sets *error (may be NULL) and returns false. */
FL_API bool fl_error_set(struct fl_error *error, enum fl_error_code code, const char *field, const char *format,
                         ...) __attribute__((format(printf, 4, 5)));
/* Adds a remedy to an error that is set; returns false. */
FL_API bool fl_error_remedy(struct fl_error *error, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Writes "FIELD: TEXT (REMEDY)" with control characters replaced; `line` is always terminated. */
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
    bool can_h264;       /* the caller decodes H.264, so views may be requested in it */
    int interrupt_fd;    /* > 0: calls give up with FL_ERROR_INTERRUPTED when it becomes readable */
    unsigned timeout_ms; /* for connecting, starting and the handshake; 0: 30 s */
    /* Silence after which the daemon counts as lost, though calls ping it: FL_ERROR_CONNECTION. A daemon answers
     * pings however long it renders. 0: 60 s. */
    unsigned lost_after_ms;
    /* Arguments of a private daemon, NULL-terminated, at most 28; NULL: none. */
    const char *const *daemon_arguments;
};

FL_API struct fl_connection *fl_connect(const struct fl_connect_options *options, struct fl_error *error);
/* Says goodbye, which ends a private daemon, and waits for nothing: scenes and jobs can only be destroyed now. */
FL_API void fl_connection_end(struct fl_connection *connection);
/* Ends the connection, waits for a private daemon (killed after a few seconds), and frees everything. */
FL_API void fl_connection_destroy(struct fl_connection *connection);
/* Replaces the interrupt descriptor for later calls; 0: nothing interrupts. Cleaning up after an interruption
 * needs this. */
FL_API void fl_connection_set_interrupt(struct fl_connection *connection, int interrupt_fd);
/* Time from the call of fl_connect until the daemon was ready. */
FL_API uint64_t fl_connection_start_ns(const struct fl_connection *connection);
/* True for a private daemon or a Unix socket, where bytes cost next to nothing. */
FL_API bool fl_connection_is_local(const struct fl_connection *connection);
/* True if views may be requested in H.264: the caller set can_h264, and the daemon has an encoder. */
FL_API bool fl_connection_can_h264(const struct fl_connection *connection);
FL_API const char *fl_connection_address(const struct fl_connection *connection);

/* An address on which a private daemon also listens (`--listen` among its arguments), with the port that it chose.
 * False: there is no address of that index. */
FL_API bool fl_connection_listens_at(const struct fl_connection *connection, size_t index, char *address,
                                     size_t address_bytes);
/* Serves the connection for timeout_ms, as every call does while it waits: receives changes of scenes, answers
 * the daemon's pings, and pings a silent daemon, so that neither side counts the other as lost. False: the wait
 * was interrupted, or the daemon is lost. */
FL_API bool fl_connection_wait(struct fl_connection *connection, unsigned timeout_ms, struct fl_error *error);

FL_API bool fl_ping(struct fl_connection *connection, uint64_t *round_trip_ns, struct fl_error *error);
/* True if the daemon lets this client view scenes but not edit them. */
FL_API bool fl_connection_is_read_only(const struct fl_connection *connection);

struct fl_limit {
    const char *name, *what; /* identifier, and a description for people; both static */
    uint64_t value;          /* unit as the name or the description says; 0: the daemon sets no limit */
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

/* Notes, counts and costs of an import. The importer's times overlap with those of the upload. */
struct fl_import_stats {
    uint64_t read_bytes, read_ns, parse_ns, hash_ns; /* the importer's measurements of the model's files */
    uint64_t import_ns;                              /* the importer's lifetime */
    uint64_t load_ns;                                /* the whole load, as the caller waited for it */
    uint64_t offered_bytes;                          /* size of the blobs that the scene uses */
    uint64_t uploaded_bytes;                         /* size of the blobs that the daemon lacked */
    uint64_t upload_ns;                              /* first byte sent to last one acknowledged */
    uint64_t commit_ns;                              /* commit to the daemon's answer */
    uint64_t revision;
    /* Subtracted from all positions of models far from the origin; 0: nothing was. Position in the model =
     * position in the scene + origin. */
    double origin[3];
};

struct fl_note {
    enum protocol_severity severity;
    const char *where;
    const char *text;
};

/* An importer that was started in advance, to read the model while the daemon starts. */
struct fl_import;

/* A model and its placement in a scene: scaled, then turned about x, y and z in this order, then moved. */
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
    /* Models of one scene, in place of `model`, if model_count > 0; at most FL_MODELS_MAX. Each of several
     * models is below a node of its own, and all names begin with that node's: "chair/seat", "chair-2/seat".
     * Cameras, variant and background are the first model's. */
    const struct fl_model *models;
    size_t model_count;
    int input_fd;             /* > 0: a file with the bytes of the model whose path is "-" */
    const char *input_format; /* the format of those bytes, such as "glb"; NULL: recognised by the first bytes */
    const char *environment;  /* equirectangular image file; NULL: none. Allowed without a model */
    /* Rotation of the environment about +y, -360 to 360; 0: its middle column is +x, as in glTF viewers. */
    double environment_degrees;
    double point_size;   /* diameter of points without faces, metres; 0: derived from their distances */
    unsigned timeout_ms; /* the importer is killed after this time; 0: 10 minutes */
    /* Callbacks during the load; may be NULL. Strings are valid during the call. */
    void (*note)(void *user, const struct fl_note *note);
    void (*progress)(void *user, uint64_t done_bytes, uint64_t total_bytes, const char *what);
    void *user;
    enum protocol_sharing sharing; /* which other clients can attach to the scene .. */
    const char *scene_name;        /* .. and under which name; NULL: the model's file name */
    /* Result of fl_import_start, owned by the load from now on, also when it fails. `model`, `environment` and
     * `timeout_ms` are the ones given to fl_import_start. NULL: the load starts an importer. */
    struct fl_import *started;
    const char *variant; /* name of a set of materials in the model; NULL: the file's default */
    bool without_studio; /* a model with lights gets no sky in addition to them */
    bool will_reload;    /* fl_scene_reload will be called: the load records digests, some bytes per object */
};

/* Starts an importer in advance. The options' strings must stay valid until the load. An importer that is never
 * loaded must be destroyed. */
FL_API struct fl_import *fl_import_start(const struct fl_load_options *options, struct fl_error *error);
FL_API void fl_import_destroy(struct fl_import *started);

/* Runs the importer and passes its edits to the daemon. NULL: failure. */
FL_API struct fl_scene *fl_scene_load(struct fl_connection *connection, const struct fl_load_options *options,
                                      struct fl_error *error);
/* Loads the models again and sends the differences in one transaction, so that the daemon keeps the structures
 * of unchanged objects; a scene from fl_scene_attach is replaced whole. Returns the same scene, or a new one in
 * its place if it was loaded without will_reload or if an object that other clients use would have to be
 * removed. NULL: failure, and the scene is unchanged. Other clients' edits stay unless the models contradict
 * them. Pointers that the scene has returned (files, cameras, clips) are invalid afterwards. options->started
 * must be NULL. */
FL_API struct fl_scene *fl_scene_reload(struct fl_scene *scene, const struct fl_load_options *options,
                                        struct fl_error *error);
FL_API void fl_scene_destroy(struct fl_scene *scene); /* releases the daemon's copy, too */

/* Attaches to an existing scene and requests its cameras and clips at once, so that they are known as after a
 * load. Materials and lights are not known by name, since only an import brings their names. Another user's
 * scene needs a connection that has no other scene and no request in flight. */
FL_API struct fl_scene *fl_scene_attach(struct fl_connection *connection, const char *name,
                                        struct fl_error *error);
/* The scenes that this client may attach to. *list is malloc'ed and the caller's to free(). */
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
/* fl_scene_get_bounds for an attached scene that also requests its cameras and clips again. Pointers to cameras
 * and clips from before are invalid afterwards. */
FL_API bool fl_scene_refresh(struct fl_scene *scene, struct fl_scene_bounds *bounds, struct fl_error *error);
/* The highest revision that the daemon has reported, of this client's edits or another client's. */
FL_API uint64_t fl_scene_revision(const struct fl_scene *scene);
/* The path of a file of a loaded scene: its models, its environment, and the files that the models name,
 * which need not exist. NULL beyond the last; valid until the scene is destroyed. */
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
FL_API size_t fl_scene_clip_count(const struct fl_scene *scene); /* at most 65536 are recorded */
/* NULL beyond the last; valid until the scene is destroyed. */
FL_API const struct fl_clip_info *fl_scene_clip(const struct fl_scene *scene, size_t index);
/* `which` is a clip's name, or its number counted from 0; a name has precedence over a number. *info (may be NULL)
 * as of fl_scene_clip. FL_ERROR_ARGUMENT, field "--clip": there is no such clip, or it cannot be played; the
 * remedy lists the clips, as far as they fit. */
FL_API bool fl_scene_find_clip(const struct fl_scene *scene, const char *which, uint32_t *clip,
                               const struct fl_clip_info **info, struct fl_error *error);

/* The identifier of a node, a material or a light. `which` is its name, or its number counted from 0 in the
 * order of the import; a name has precedence over a number, and the first of several objects with one name
 * counts. A light has its own name and those of the nodes that show it. The first 1 Mi objects of each kind are
 * recorded. FL_ERROR_ARGUMENT, field "node", "material" or "light": no such object, and the remedy lists the
 * names, as far as they fit; other kinds have no names here. */
FL_API bool fl_scene_find_object(const struct fl_scene *scene, enum protocol_object_kind kind, const char *which,
                                 uint32_t *id, struct fl_error *error);
/* True if the models brought lights or an environment when they were loaded, or an environment was given. */
FL_API bool fl_scene_is_lit(const struct fl_scene *scene);
/* True if the light has a size that can change: a rectangle or a sphere. */
FL_API bool fl_scene_light_has_size(const struct fl_scene *scene, uint32_t light);
/* A new, unused identifier for an edit of the caller's; 0: none is left. */
FL_API uint32_t fl_scene_new_id(struct fl_scene *scene, enum protocol_object_kind kind);

/* A property of an object over time. The arrays are the caller's and only read. */
struct fl_channel {
    enum protocol_channel_path path;
    uint32_t object; /* node, light or material; 0: the view */
    enum protocol_interpolation interpolation;
    uint32_t width, key_count; /* set_channel in messages.def defines both */
    const float *times;        /* seconds, ascending */
    const float *values;       /* `width` numbers per key; three times as many for cubic spline and bezier */
};
/* Adds the caller's clip to the scene, for jobs that are started later; *clip is its identifier. Uploads the
 * data if the daemon lacks it, and waits until the edit is applied. */
FL_API bool fl_scene_add_clip(struct fl_scene *scene, const char *name, const struct fl_channel *channels,
                              size_t channel_count, uint32_t *clip, struct fl_error *error);

/* ---- objects of a scene and their fields, also of other clients ---- */

struct fl_object {
    uint32_t id;
    uint32_t parent, shows; /* nodes only: the parent, 0: none; the identifier of the shown object .. */
    enum protocol_node_kind shows_kind; /* .. and its kind */
    char name[129];
};
/* The objects of a kind as the daemon has them now, ascending by id; *objects is malloc'ed. */
FL_API bool fl_scene_objects(struct fl_scene *scene, enum protocol_object_kind kind, struct fl_object **objects,
                             size_t *count, struct fl_error *error);
/* Gets an object by its identifier, such as a pixel of the layer `id` holds for nodes and materials. Every kind
 * but `environment` is allowed. */
FL_API bool fl_scene_object(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                            struct fl_object *object, struct fl_error *error);

/* The identifiers of all objects that `which` selects, at least one; *ids is malloc'ed. `which` is a name, a
 * number, or "#" and an identifier, as in fl_assignment. FL_ERROR_ARGUMENT, field empty: no such object; the
 * remedy has a similar name, or all names as far as they fit. The kind `environment` has one object, 1,
 * whatever `which` says. */
FL_API bool fl_scene_find_objects(struct fl_scene *scene, enum protocol_object_kind kind, const char *which,
                                  uint32_t **ids, size_t *count, struct fl_error *error);

#define FL_FIELDS_MAX 64u       /* maximum number of fields of one kind of object */
#define FL_FIELD_VALUES_MAX 12u /* maximum number of values of one field */

enum fl_field_form {
    FL_FIELD_NUMBERS,
    FL_FIELD_COLOUR, /* red, green, blue, linear; a fourth value is alpha */
    FL_FIELD_FLAG,   /* 0 or 1 */
    FL_FIELD_WORD,   /* a number that fl_field_word translates */
};

/* A field that can be edited, of nodes, materials, lights, cameras or the environment. Angles are degrees. */
struct fl_field {
    char name[48]; /* "roughness" */
    enum fl_field_form form;
    unsigned count;         /* values */
    double min, max;        /* bounds of each value */
    const char *unit, *doc; /* static; may be empty */
    unsigned source;        /* private to the library, with all members below */
    double scale;
    const struct field_desc *wire;
};
/* Fills in the fields of a kind of object, in the order for people. Returns how many there are, at most
 * FL_FIELDS_MAX; 0 for kinds without fields. */
FL_API size_t fl_fields(enum protocol_object_kind kind, struct fl_field fields[FL_FIELDS_MAX]);
/* The word with this number, such as "blend"; NULL: none. */
FL_API const char *fl_field_word(const struct fl_field *field, unsigned number);

struct fl_field_value {
    struct fl_field field;
    double values[FL_FIELD_VALUES_MAX];
};
/* An object's own values, before clips animate it, and only the fields that it has: those of a light depend on
 * its kind. */
struct fl_object_state {
    enum protocol_object_kind kind;
    uint32_t id;
    char name[129];
    uint64_t revision; /* the scene's revision at the time of reading */
    size_t count;
    struct fl_field_value fields[FL_FIELDS_MAX];
};
FL_API bool fl_scene_read(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                          struct fl_object_state *state, struct fl_error *error);

/* ---- edits ---- */

enum fl_assignment_way { FL_ASSIGN, FL_ASSIGN_SUM, FL_ASSIGN_PRODUCT };

/* A field of one or several objects and its new value. */
struct fl_assignment {
    enum protocol_object_kind kind; /* node, material, light, camera or environment */
    uint32_t id; /* identifier; 0: `which` selects the objects. Neither counts for the environment */
    /* A name, or a number counted from 0 by ascending identifiers; a name has precedence over a number, and the
     * first of several objects with one name counts. Lights and cameras are also found by the names of the
     * nodes that show them. "*" stands for any characters and selects every match. "#7" is the object with
     * identifier 7. */
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
/* Writes the assignment as fl_assignment_parse() reads it; floats survive the round trip. Text that does not
 * fit is cut off. Returns `text`. */
FL_API const char *fl_assignment_print(const struct fl_assignment *assignment, char *text, size_t text_bytes);

struct fl_edited {
    uint64_t revision; /* the first with the change; the current one if nothing changed */
    size_t objects;    /* number of changed objects */
    /* Assignments that restore the changed fields, in any order; fields that other clients change meanwhile
     * stay. malloc'ed; the caller frees it in any case. */
    struct fl_assignment *undo;
    size_t undo_count;
};
/* Applies all assignments, in order, or none, in one transaction. Fields that other clients change meanwhile
 * keep those values: the daemon refuses an edit of an object that has changed since it was read, and the
 * library then reads it and tries again. A playing clip has precedence over an edit of the property that it
 * animates. The call waits until the daemon has applied the edit, after the frame that it is rendering; a
 * view's refinement is cancelled for it. *edited may be NULL. */
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
    bool has_bounds;  /* true for a node that shows a mesh or spheres: */
    float lower_world[3], upper_world[3];
};
/* A set of materials that fl_load_options.variant may name. */
struct fl_variant_info {
    char name[129];
};
struct fl_model_info {
    uint64_t nodes, meshes, triangles, sphere_sets, spheres, discs, materials, textures, lights;
    uint64_t skins, joints, morph_targets; /* joints of all skins, targets of all meshes */
    uint64_t closed_meshes;                /* meshes whose triangles enclose a volume */
    struct fl_import_stats import;
    size_t camera_count, clip_count, note_count;
    struct fl_camera_info *cameras;
    struct fl_clip_info *clips;
    struct fl_model_note *notes; /* at most 1000; `notes_left_out` counts the rest */
    uint64_t notes_left_out;
    /* Objects in the order of the file; at most 1 M of each kind. */
    struct fl_model_object *node_list, *material_list, *light_list;
    size_t node_list_count, material_list_count, light_list_count;
    char *names; /* storage of the names in the lists */
    /* Bounds of all nodes with meshes or spheres, before clips, skins and morph targets move anything. */
    bool has_bounds;
    float lower_world[3], upper_world[3];
    size_t variant_count;
    struct fl_variant_info *variants; /* at most 65536 */
};
/* Reads a model file without a daemon. options->note is not called: the notes are in the result, which the
 * caller destroys. `interrupt_fd` is as in fl_connect_options. */
FL_API struct fl_model_info *fl_model_info(const struct fl_load_options *options, int interrupt_fd,
                                           struct fl_error *error);
FL_API void fl_model_info_destroy(struct fl_model_info *info);

/* ---- rendering ----------------------------------------------------------------------------------- */

struct fl_job;

/* A render request is the protocol's own message: protocol/messages.def and tracers.def define each field and
 * its range, and so do `farlight tracers` and farlight(1). fl_render_defaults() returns the defaults of the
 * table. The library sets `kind`, `scene` and `channel`; `credit` is the number of frames that the daemon may
 * send ahead. Keys and clips are only read. */
FL_API struct message_render fl_render_defaults(void);

/* A picture and its costs. The caller owns it; every pointer in it lives as long as it does. */
struct fl_frame {
    uint32_t frame, width, height, samples;
    float noise; /* largest error of a tile, if the request sets `noise`; 1e6: not known yet */
    uint64_t revision;
    enum protocol_pixel_format format;
    enum protocol_encoding encoding; /* the encoding on the wire; `pixels` are decoded */
    enum protocol_tracer tracer;
    enum protocol_integrator integrator;
    bool digest_checked; /* lossless only: the pixels match the digest that the daemon computed */
    uint64_t digest;
    float exposure_stops, world_from_view[12], fov_y, ortho_height, time_s;
    float aperture, focus; /* the lens, metres; focus 0: a pinhole */
    float shutter_s;       /* exposure time of the shutter, seconds */
    unsigned layers;       /* set of the layers in `pixels`, stored in the order of their numbers */
    uint64_t primary_rays, shadow_rays, secondary_rays, splits, uploaded_bytes, structure_bytes;
    uint32_t device_waits;         /* number of times that the daemon waited for the device */
    uint32_t dispatches, barriers; /* compute passes queued, and waits between passes */
    uint64_t wire_bytes;           /* encoded pixels and attachments */
    uint64_t depth_bytes;          /* the part of wire_bytes that is depth */
    /* A frame in parts starts coarse and may end after any part; the parts that arrived are decoded. With fewer
     * than all parts, colours are coarser, depths may be, and normals may be missing. */
    unsigned parts_come, parts;     /* 1 of 1: the frame arrived as a whole */
    bool more_follows;              /* the frame arrives again with more parts: see fl_view_deliver_parts */
    uint64_t receive_ns, decode_ns; /* first byte to last; decoding and checking */
    uint64_t wait_ns;               /* time that fl_render_next waited for the frame */
    size_t stage_count;
    struct record_stage_time *stages;
    size_t wave_comparison_count;                    /* 0: the job does not compare */
    struct record_wave_comparison *wave_comparisons; /* ascending by wave and kind of ray; see messages.def */
    size_t structure_count;
    struct record_structure_row
        *structure; /* the tracer's report on its structure; one block of memory with its strings */
    /* Views only, down to `sticking`. Times of the daemon's clock compare with fl_ping's; `command_sent_ns`,
     * `begun_ns` and `whole_ns` are of this process' monotonic clock. */
    uint64_t command; /* the last fl_view_set_camera that the frame shows; 0: none yet, and its times are 0 */
    uint64_t command_received_ns, command_applied_ns, rendered_ns; /* the daemon's clock */
    uint64_t command_sent_ns;                                      /* time of that fl_view_set_camera */
    uint64_t begun_ns, whole_ns;                                   /* first byte, and decoded */
    uint64_t change; /* number of fl_view_change calls that the frame shows */
    bool moving, key_frame;
    unsigned frame_quality; /* quality of the encoding; 0: lossless */
    uint8_t *encoded;       /* H.264 access unit, or see fl_view_keep_jpeg; NULL: pixels are decoded */
    size_t encoded_bytes;
    float *depth;     /* width * height, metres along the view; 0 where nothing is; NULL: none */
    float depth_step; /* 1 / depth was rounded to multiples of it, 1 / metres; 0: it was not */
    /* Depth comes from a frame's first parts: bilinear on one surface, the nearest surface's elsewhere, in
     * blocks of 8 x 8 pixels. */
    bool depth_is_coarse;
    float depth_error; /* 1 / depth is off by at most this, 1 / metres: half a step, or, where it is coarse, that
                          at the worst edge: it is no noise */
    /* Pixels on each side beyond the requested picture while the camera moves; width, height and fov_y include
     * them. */
    uint32_t margin_x, margin_y;
    uint32_t depth_less; /* bounces omitted to reach moving_rate */
    /* Number of surfaces in front of the shown one, for the picture of_frame, at half its width and height,
     * rounded up; 0: a picture. */
    uint32_t hidden_layer;
    uint32_t of_frame;
    uint8_t *normals;    /* width * height * 4; see messages.def; NULL: none */
    uint8_t *sticking;   /* width * height; see messages.def; NULL: none */
    size_t pixels_bytes; /* layers times width * height * 4, 8 or 16 */
    uint8_t *pixels;     /* rows from the top, without gaps, in `format` */
};

#define FL_STRUCTURE_NAME_BYTES 64

/* A part of a tracer's structure, described in a line for people. */
struct fl_structure_part {
    uint32_t number;
    char name[FL_STRUCTURE_NAME_BYTES]; /* empty: the structure has no parts */
    char text[512];                     /* "resolution 128, cell 1.2 mm" */
    bool is_kept;                       /* reused from frame to frame until it is rebuilt */
    bool built;                         /* rebuilt for this frame */
};
/* Fills in the part whose rows begin at *at (0: the first) and moves *at behind them. False: there are no more
 * parts. */
FL_API bool fl_structure_next(const struct fl_frame *frame, size_t *at, struct fl_structure_part *part);

/* Starts a job; a connection runs one job at a time. NULL: failure. */
FL_API struct fl_job *fl_render_start(struct fl_scene *scene, const struct message_render *wanted,
                                      struct fl_error *error);
/* The next frame, in order; NULL with error->code FL_ERROR_NONE after the last. The caller destroys it. */
FL_API struct fl_frame *fl_render_next(struct fl_job *job, struct fl_error *error);
/* The next frame, after a wait of at most timeout_ms; 0: no wait. NULL with error->code FL_ERROR_NONE: none so
 * far, or, if *done is set, no more frames. */
FL_API struct fl_frame *fl_render_poll(struct fl_job *job, unsigned timeout_ms, bool *done,
                                       struct fl_error *error);
FL_API void fl_frame_destroy(struct fl_frame *frame);
/* Ends the job early and waits until the daemon confirms it; frames that arrive meanwhile are dropped. */
FL_API bool fl_render_cancel(struct fl_job *job, struct fl_error *error);
FL_API void fl_render_destroy(struct fl_job *job); /* cancels a running job */

/* ---- views: pictures that follow a camera ---------------------------------------------------------- */

/* A view; a connection has at most one, beside at most one job of fl_render_start. Frames arrive when there is
 * something new to show and wait in the socket between calls. */
struct fl_view;

enum fl_attachment { /* bits */
                     FL_ATTACH_DEPTH = 1 << PROTOCOL_ATTACHMENT_DEPTH,
                     FL_ATTACH_NORMALS = 1 << PROTOCOL_ATTACHMENT_NORMALS,
                     /* Daemons that do not know it leave it out. */
                     FL_ATTACH_STICKING = 1 << PROTOCOL_ATTACHMENT_STICKING
};

/* Returns the defaults of a view. Fields that only a range of frames has are ignored; `frames_per_second` is a
 * maximum, 60 here; `samples` is the maximum that a picture gets while nothing moves, 64 here; the format is
 * rgba8; `encoding` applies while the camera moves; `credit` is 4; `attachments` are enum fl_attachment bits. */
FL_API struct message_render fl_view_defaults(void);

struct fl_view_camera {
    float eye_world[3], look_at_world[3], up_world[3];
    float fov_y;
    float time_s;
    bool moving; /* more cameras will follow soon */
    /* A camera of the scene (fl_camera_info.node): the view is this camera's, as clips have placed it at
     * time_s, and the four fields at the top are ignored, but must be valid. 0: they are used. */
    uint32_t node;
};

FL_API struct fl_view *fl_view_start(struct fl_scene *scene, const struct message_render *options,
                                     struct fl_error *error);
/* Changes the request (size, tracer, integrator, exposure ..); camera and frame numbers continue. */
FL_API bool fl_view_change(struct fl_view *view, const struct message_render *options, struct fl_error *error);
/* Sends a camera and returns; *command (may be NULL) is the number under which frames report it. */
FL_API bool fl_view_set_camera(struct fl_view *view, const struct fl_view_camera *camera, uint64_t *command,
                               struct fl_error *error);
/* The next complete frame, after a wait of at most timeout_ms; 0: no wait. NULL with error->code FL_ERROR_NONE:
 * none so far. The caller destroys it. A frame in H.264 is not decoded: it has `encoded` instead of `pixels`. */
FL_API struct fl_frame *fl_view_next(struct fl_view *view, unsigned timeout_ms, struct fl_error *error);
/* If the view requests parts and `deliver` is set, later frames are delivered as soon as their first parts show
 * something, with more_follows, and again when the rest has arrived, under the same number. Frames in H.264 are
 * delivered once. Costs a second decoding. */
FL_API void fl_view_deliver_parts(struct fl_view *view, bool deliver);
/* If `keep` is set, later frames in JPEG are neither decoded nor checked, like those in H.264, for a caller
 * that forwards them. */
FL_API void fl_view_keep_jpeg(struct fl_view *view, bool keep);
/* Reports that the caller could not decode a frame: the next one will be a key frame. */
FL_API bool fl_view_want_key_frame(struct fl_view *view, struct fl_error *error);
FL_API void fl_view_destroy(struct fl_view *view);
/* A client can warp a frame to nearby views with the fl_warp_* functions of warp/warp.h, without connection,
 * window or GL. The request needs FL_ATTACH_DEPTH and depth_form inverse, with depth_pixels and depth_radius
 * for a bound, and a margin. The key view then has the frame's width, height and camera (world_from_view,
 * fov_y), its pixels in RGBA8 as colours, and w = unit / depth (0 where depth is 0) with w_error = unit *
 * depth_step / 2. With FL_ATTACH_STICKING its layer has `sticking` as well, and warped views mark the pixels
 * whose colours do not move with the surface. */

/* A descriptor for the caller's own poll(): readable when something may have arrived. The connection owns it. */
FL_API int fl_connection_fd(const struct fl_connection *connection);

/* The share of rays off edges on which both tracers agree; 1 without rays. Hits of different surfaces disagree;
 * shading does not matter. */
FL_API double fl_wave_agreement(const struct record_wave_comparison *comparison);
/* Adds counts and times of a wave to `into`, which may be all zero, and keeps the larger of each maximum error;
 * medians and percentiles, which cannot be added, are set to 0. */
FL_API void fl_wave_add(struct record_wave_comparison *into, const struct record_wave_comparison *from);

FL_API uint32_t fl_bytes_per_pixel(enum protocol_pixel_format format);

/* Reads an array of {"time", "eye", "look_at", "up", "fov"} (seconds; world; degrees) from a JSON file. *keys
 * is malloc'ed. Errors name the file, the line or the entry, and the field. */
FL_API bool fl_camera_keys_load(const char *path, struct record_camera_key **keys, size_t *key_count,
                                struct fl_error *error);

/* ---- image files --------------------------------------------------------------------------------- */

/* The exporter: a helper program that writes image files, one after another. */
struct fl_exporter;

struct fl_exporter_options {
    const char *folder;      /* folder of the files, the only one that the program can write to */
    const char *model;       /* named in the files; may be NULL */
    float frames_per_second; /* named in EXR files; 0: unknown */
    int interrupt_fd;
    /* The format of all files, as in fl_export_options: some formats start faster; NULL: any. */
    const char *format;
    /* Date, times of stages and revision are written too; equal pictures then give different files. */
    bool full_metadata;
    bool draws_text; /* pictures come with text */
    /* EXR: "key,fill": names of the layers light_group1 and so on; NULL: light_group1.. */
    const char *light_groups;
    /* EXR: colours are compressed with loss (DWAA), other layers by zip in a part of their own; else all by zip */
    bool dwaa;
    /* Colours of the files. Frames of the format rgba32f are linear Rec. 709, and so are the files if all three
     * are NULL. */
    const char
        *colour_space; /* EXR: ACEScg, ACES2065-1, Linear Rec.2020, Linear P3-D65 or one of the configuration */
    const char *display_view; /* pictures of 8 bits: "VIEW" or "DISPLAY/VIEW" of the configuration */
    const char *ocio;         /* the configuration of OpenColorIO, a file */
    struct {
        uint32_t x, y, width, height;
        /* Position of the frames in a picture of width x height, as EXR files record it; all 0: frames are whole
         * pictures. */
    } window;
};
/* A line of text, about 14 pixels high, in the middle of a box; the beginning of a text that is too long for
 * the box is cut off. Without an installed font nothing is drawn. */
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
    const struct fl_export_text *texts; /* texts drawn into the picture, if its format is rgba8 */
    size_t text_count;
    double origin[3]; /* for the metadata: `origin` of the scene's import statistics */
    const char *part; /* EXR: the frame is a part of a picture, "K/N DIGEST DEVICE" for `farlight merge`; NULL: it
                         is whole */
};

FL_API struct fl_exporter *fl_exporter_start(const struct fl_exporter_options *options, struct fl_error *error);
/* Sets the names of nodes and materials for Cryptomatte in EXR files to the scene's, until the next call.
 * Objects that share a name are qualified by their parents', "car/wheel", and where that is not enough or a
 * name is missing by identifiers, "wheel#12". Files without such layers need no names. */
FL_API bool fl_exporter_names(struct fl_exporter *exporter, struct fl_scene *scene, struct fl_error *error);
/* Hands the frame to the program and returns; the frame may be destroyed at once. The file is complete or has
 * failed by the next call of this function or of fl_exporter_wait, which reports that failure. */
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
    int interrupt_fd;        /* see fl_connect_options */
};

struct fl_video_info {
    char encoder[33];       /* libavcodec's name: "libx264"; known from the start on */
    uint32_t frames;        /* valid, with the members below, once fl_video_finish has returned true */
    uint32_t width, height; /* the frames' size; 4:2:0 needs even numbers and repeats the last column or row */
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
/* Replaces the interrupt descriptor for later calls; 0: nothing interrupts. */
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
    float frames_per_second; /* see fl_video_options */
    enum fl_y4m_chroma chroma;
    int interrupt_fd; /* see fl_connect_options */
};

/* Nothing is written before the first frame. The samples are 8-bit Y'CbCr by BT.709 in limited range (the
 * header has XCOLORRANGE=LIMITED) of the frame's sRGB values; the format has no word for matrix, primaries
 * and transfer curve, so tools need options (ffmpeg: -colorspace bt709 -color_primaries bt709 -color_trc
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
    enum protocol_tone_map tone_map; /* tone map for showing linear files */
    unsigned timeout_ms;             /* 0: 10 minutes */
    int interrupt_fd;                /* see fl_connect_options */
};

/* The difference of two images. An error is the difference of one channel of one pixel, without sign, in units of
 * `space`: linear light where both files are linear (EXR, HDR), else what a screen shows, 0 to 1. Alpha counts as
 * a channel. Pixels with NaN or infinity in either file count as beyond and are left out of everything else. */
struct fl_comparison {
    uint32_t width, height, channels;
    char channel_names[257]; /* "R,G,B,A" */
    enum protocol_comparison_space space;
    float threshold;                              /* the threshold that was used */
    uint64_t pixels;                              /* total number of pixels */
    uint64_t nonfinite_a, nonfinite_b, nonfinite; /* pixels with NaN or infinity; in either */
    uint64_t beyond;                              /* pixels beyond the threshold */
    bool has_errors;                              /* false: no pixel is finite, the next seven mean nothing */
    bool identical;                               /* no error at all, and no pixel that is not finite */
    /* Peak signal-to-noise ratio, 20 log10(1 / rms_error): the peak is white, 1, in both spaces; INFINITY
     * without error. */
    double psnr_db;
    /* Peak signal-to-noise ratio of red, green and blue as shown on a screen: linear files through the tone map
     * and the sRGB curve, so that no highlight exceeds the peak. */
    double shown_psnr_db;
    double mean_error, rms_error, max_error;
    uint32_t max_error_x, max_error_y, max_error_channel; /* position from the top left; all count from 0 */
    /* Structural similarity (Wang, Bovik, Sheikh, Simoncelli. Image quality assessment: from error visibility to
     * structural similarity. 2004): 11x11 Gaussian window of sigma 1.5, K1 0.01, K2 0.03, range 1, on the luma of
     * what a screen shows (linear files: tone map and sRGB curve, as in a PNG of the renderer); the mean
     * over all windows that lie within the picture. */
    bool has_ssim; /* true if the picture is at least 11x11 */
    double ssim;
    /* Butteraugli distance as libjxl computes it, of the display values on a screen of 80 cd/m2: about 1
     * where a difference is just visible. */
    bool has_butteraugli;                /* true if the picture is at least 8x8 and has at most 2^24 pixels */
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
 * both directions have ended: the far end of an ssh connection. */
FL_API bool fl_bridge(const char *address, int in_fd, int out_fd, struct fl_error *error);

#ifdef __cplusplus
}
#endif

#endif
