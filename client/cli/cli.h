/* SPDX-License-Identifier: MIT */
/* What the subcommands of `farlight` share. */
#ifndef FARLIGHT_CLIENT_CLI_CLI_H
#define FARLIGHT_CLIENT_CLI_CLI_H

#include "lib/farlight.h"
#include "lib/frame_set.h"

#include <argp.h>
#include <jansson.h>
#include <stdio.h>

/* Exit statuses; 128 + signal besides. */
enum cli_status {
    CLI_DONE = 0,
    CLI_FAILED = 1, /* of `compare`: a figure is beyond its limit */
    CLI_USAGE = 2,
    CLI_TROUBLE = 2, /* of `compare`: there is no figure */
    CLI_TRY_AGAIN = 75
};

/* Subcommands: argv[0] is "farlight NAME". They return the exit status. */
int cli_render(int argc, char **argv);
int cli_animate(int argc, char **argv);
int cli_turntable(int argc, char **argv);
int cli_thumbnail(int argc, char **argv);
int cli_info(int argc, char **argv);
int cli_compare(int argc, char **argv);
int cli_compare_tracers(int argc, char **argv); /* where cli_compare finds --tracers */
int cli_compare_views(int argc, char **argv);   /* likewise --stereo and what else is made of depth layers */
int cli_serve(int argc, char **argv);
int cli_scenes(int argc, char **argv);
int cli_edit(int argc, char **argv);
int cli_stats(int argc, char **argv);
int cli_verify(int argc, char **argv);
int cli_merge(int argc, char **argv);
int cli_ping(int argc, char **argv);
int cli_bridge(int argc, char **argv);
int cli_view(int argc, char **argv);
int cli_key(int argc, char **argv);
int cli_tracers(int argc, char **argv);
int cli_complete(int argc, char **argv); /* for the shell: values of an option */

/* ---- key.c ---- */

/* The key file for a daemon: that of --key, else, for a TCP address, of FARLIGHT_KEY. NULL: none. */
const char *cli_key_file(const char *server, const char *given);

/* ---- parse.c ---- */

/* argp_parse(), which ends the program after a mistake, and tells which option was probably meant. */
error_t cli_parse(const struct argp *argp, int argc, char **argv, unsigned flags, void *input);

/* ---- talk.c: what people read ---- */

/* "farlight: FIELD: TEXT (REMEDY)"; returns the exit status that belongs to the error. */
int cli_report(const struct fl_error *error);
int cli_trouble(const struct fl_error *error); /* likewise, of `compare` (compare.c): 2 where others return 1 */
/* A note about a model: warnings always, plain information only if `chatty`. */
void cli_note(const struct fl_note *note, bool chatty);
/* On standard output; characters that could control a terminal or change the order of a line are not printed. */
void cli_print_name(const char *name);
bool cli_is_terminal(int fd); /* one that can move its cursor */
/* How JSON is written: names say all that they hold, in escapes that do nothing to a terminal. */
#define CLI_JSON (JSON_COMPACT | JSON_ENSURE_ASCII)

/* ---- interrupt.c ---- */

/* Ctrl-C, SIGTERM and SIGHUP make the descriptor readable instead of ending the program; a second one ends it. */
bool cli_interrupt_begin(struct fl_error *error);
int cli_interrupt_fd(void);
int cli_interrupt_signal(void); /* which one came; 0: none */

/* ---- image_path.c: where pictures go ---- */

enum cli_image {
    CLI_IMAGE_UNKNOWN,
    CLI_IMAGE_PNG,
    CLI_IMAGE_JPEG,
    CLI_IMAGE_EXR,
    CLI_IMAGE_HDR,
    CLI_IMAGE_WEBP,
    CLI_IMAGE_TIFF,
    CLI_IMAGE_GIF,
    CLI_IMAGE_MP4, /* from here on videos, of animations only */
    CLI_IMAGE_MKV,
    CLI_IMAGE_Y4M,
    CLI_IMAGE_MOVING_WEBP,
    CLI_IMAGE_MOVING_GIF,
    CLI_IMAGE_COUNT
};

/* By name ("png", ..) or by a path's ending; letter case does not matter. */
enum cli_image cli_image_by_name(const char *name);
enum cli_image cli_image_by_path(const char *path);
const char *cli_image_name(enum cli_image image);
bool cli_image_is_video(enum cli_image image);
/* Of a series: WebP and GIF are moving pictures where the name has no place for the frame's number. */
enum cli_image cli_image_of_series(enum cli_image image, const char *path);
/* The name of a file without its folders. */
const char *cli_base_name(const char *path);
/* Whether a file can be created at `path`, without creating it. `folder` gets its folder, which may be missing:
 * then it is one that can be made. */
bool cli_check_output(const char *path, char *folder, size_t folder_bytes, struct fl_error *error);
/* Refuses a folder that is missing, which may be misspelt or not mounted, unless `parents` says to make it. */
bool cli_check_folder(const char *path, const char *folder, bool parents, struct fl_error *error);
/* Makes the folder, and those around it, where they are missing. */
bool cli_make_folder(const char *folder, struct fl_error *error);
/* Replaces a file as a whole. */
bool cli_write_text(const char *path, const char *text, mode_t rights, struct fl_error *error);
/* Whether writing to `path`, named by `option`, overwrites none of the inputs; NULL among them is skipped. */
bool cli_check_not_input(const char *path, const char *option, const char *const *inputs, size_t count,
                         struct fl_error *error);
/* Whether a comparison of the inputs can write its picture to the path: PNG or JPEG, and not one of them. Makes
 * its folder. NULL: there is no picture. */
bool cli_check_error_picture(const char *picture, const char *const *inputs, size_t count, struct fl_error *error);
/* A folder in $TMPDIR for a file that is then copied to standard output or a device. */
bool cli_temporary_folder(char *folder, size_t folder_bytes, struct fl_error *error);
/* A terminal is refused; `what` would be written: "an image". */
bool cli_check_stdout(const char *what, struct fl_error *error);
/* False: errno says why. */
bool cli_write_all(int fd, const char *bytes, size_t count);
/* Copies a file to a device; NULL: standard output. */
bool cli_copy_to(const char *device, const char *path, struct fl_error *error);

/* ---- models.c: the models of a command line ---- */

struct cli_job;

/* An argument that is no option: "-" is standard input. Its place is set by a later option; one that has a place
 * is shown once more for each further place. */
error_t cli_set_model(struct cli_job *job, const char *path);
error_t cli_set_place(struct cli_job *job, const char *field, const char *value);
/* Turns the models so that --up, an axis of theirs, is y; those that are placed stay. */
bool cli_turn_models(struct cli_job *job);
bool cli_has_input(const struct cli_job *job); /* a model is standard input */
/* Whether the files of models and environment can be read. */
bool cli_check_models(const struct cli_job *job, struct fl_error *error);
/* Whether --watch, if it is given, has files to watch. */
bool cli_check_watch(struct cli_job *job);
/* Reads standard input, if a model is that, into a file in memory. Interruptible; refused on a terminal. */
bool cli_read_input(struct cli_job *job, struct fl_error *error);
bool cli_open_input(int *input_fd, struct fl_error *error); /* the same without a job */

/* ---- progress.c: progress on standard error ---- */

enum cli_progress_form {
    CLI_PROGRESS_LINES,
    CLI_PROGRESS_BAR,   /* drawn over and over on one line */
    CLI_PROGRESS_OPENJD /* what Open Job Description reads on standard output */
};

struct cli_progress {
    enum cli_progress_form form;
    bool silent;
    bool drawn;
    uint64_t begin_ns, shown_ns, first_ns;
    uint32_t total;
    float error;             /* as it was last told, that many seconds after the beginning */
    double error_s, slope;   /* it falls as that power of the time */
    uint64_t resident_bytes; /* the most that a line has told */
};

struct cli_job;
void cli_progress_begin(struct cli_progress *progress, const struct cli_job *job);
void cli_progress_import(struct cli_progress *progress, uint64_t done_bytes, uint64_t total_bytes,
                         const char *what);
/* From the first call on frames are counted. */
void cli_progress_frames(struct cli_progress *progress, uint32_t done, uint32_t total);
/* `done` of `total` steps of different length are finished; `what` is the current one. Without a terminal one line
 * per step, once it has taken a second. */
void cli_progress_step(struct cli_progress *progress, uint32_t done, uint32_t total, const char *what);
/* A progressive picture has `held` samples per pixel; `total` 0: only an interruption ends it. */
void cli_progress_samples(struct cli_progress *progress, uint32_t held, uint32_t total);
/* A picture has that error where it is largest, and goes on until it is `wanted`, or all have `total` samples. */
struct cli_noise {
    float error, wanted;
    uint32_t held, total;
};
void cli_progress_noise(struct cli_progress *progress, const struct cli_noise *noise);
/* A line in the log for a picture that is complete: its number, seconds, the most memory that the command and
 * what it has started had at any line, and its file. Nothing where a bar is drawn. */
void cli_progress_frame(struct cli_progress *progress, uint32_t frame, double seconds, const char *path);
/* Removes the bar, so that other output can be written. */
void cli_progress_clear(struct cli_progress *progress);
/* The bar of a finished command stays; any other is removed. */
void cli_progress_end(struct cli_progress *progress, bool done);

/* ---- job_options.c, job_fields.c: options that render and animate share ---- */

enum cli_timings_form { CLI_TIMINGS_NONE, CLI_TIMINGS_TABLE, CLI_TIMINGS_JSON };

#define CLI_OUTPUTS_MAX 8

struct cli_output {
    const char *path;
    enum cli_image image;
};

/* When a daemon counts as lost, and how long a lost one is waited for, without a new frame in between. */
struct cli_retries {
    bool has_count, has_duration;
    unsigned count; /* in a row */
    double for_s;
    unsigned lost_after_ms; /* as of fl_connect */
};

/* Options of an animation. */
struct cli_series {
    bool has_range;
    struct fl_frame_run range;
    uint32_t shard_part, shard_parts; /* 0 parts: all frames */
    bool is_chunk;                    /* the part is of neighbouring frames */
    bool resume;                      /* frames whose files exist are not rendered again */
    bool digests;                     /* a file with its digest beside each picture */
    struct record_camera_key *keys;   /* of the job's keys_file, once all options are read */
    double orbit_degrees;
    double orbit_seconds; /* for these degrees; 0: the range */
    float *dolly_times;   /* two keys of the camera's path, the second one at: */
    double dolly_seconds; /* 0: the last frame */
};

/* A clip of the model's that is played. */
struct cli_clip {
    const char *which; /* name or number */
    float start_s, speed;
    bool loop;
    unsigned line; /* of the script; 0: the command line */
};
#define CLI_CLIPS_MAX 15 /* the protocol's, and one of our own */
#define CLI_EDITS_MAX 64
#define CLI_LIGHT_GROUPS (PROTOCOL_LAYER_LIGHT_GROUP7 - PROTOCOL_LAYER_LIGHT_REST)
#define CLI_LIGHT_GROUP_NAME 32 /* bytes */

/* Several views in a picture, as typed. */
struct cli_views {
    bool has_stereo, has_light_field, has_baseline, has_layout, has_views, has_lens;
    enum cli_stereo { CLI_STEREO_SIDE, CLI_STEREO_OVER, CLI_STEREO_FILES } layout;
    float stereo_m, baseline_m; /* between the eyes */
    uint32_t across, down;      /* of a light field */
    enum protocol_view_source views, lens;
};

struct fl_json;
struct fl_json_place;

/* A value that the script animates, or sets. */
struct cli_channel {
    struct fl_channel channel; /* its object is looked up once the scene is loaded */
    enum protocol_object_kind kind;
    const char *target;                /* name or number; NULL: the view */
    const struct fl_json_place *place; /* in the script, for people */
};

struct cli_job {
    const char *scene; /* a shared scene of the server, in place of the model */
    struct fl_model
        models[FL_MODELS_MAX]; /* of the command line; `model` is the first one's path, or a script's */
    size_t model_count;
    int input_fd;             /* of a model "-": its bytes, once cli_read_input() has them */
    const char *model_format; /* of it; NULL: by its first bytes */
    bool watch;               /* again and again, as its files change */
    const char *model, *server, *key_file, *environment, *output, *camera, *keys_file, *trace_file;
    double environment_degrees, point_size; /* as of fl_load_options */
    const char *variant;                    /* likewise */
    enum cli_image image;
    struct cli_output
        outputs[CLI_OUTPUTS_MAX]; /* destinations of the pictures: `output`, or several of a script */
    size_t output_count;
    struct cli_series series;
    bool parents;      /* a missing folder of an output is made */
    bool has_progress; /* else by whether there is a terminal */
    enum cli_progress_form progress;
    struct cli_retries retries;
    const char *script; /* path; NULL: none */
    const struct fl_json *script_json;
    struct cli_clip clips[CLI_CLIPS_MAX];
    size_t clip_count;
    struct fl_assignment edits[CLI_EDITS_MAX]; /* of a model's scene */
    size_t edit_count;
    struct cli_channel *channels; /* the script's */
    size_t channel_count;
    struct record_clip_use clip_uses[CLI_CLIPS_MAX + 1];
    bool clip_once;      /* of the command line's clips, as is: */
    double clip_start_s; /* time at which they begin */
    double clip_speed;
    double time_s;         /* of `render`: the time of the clips */
    bool progressive;      /* of `render`: the picture is written repeatedly, with more samples */
    bool endless;          /* likewise, until it is interrupted */
    bool by_error;         /* of one picture: sampled in passes until its error is small */
    uint32_t pass_samples; /* more each time; 0: as many as there are */
    uint32_t part, parts;  /* of `render`: which one, of how many of the picture; 0 parts: all of it */
    const char *part_name; /* for its file, once it is known */
    bool lens_changes;     /* opened by clips: the integrator must support lenses */
    bool lossless;         /* of a video */
    bool full_metadata;    /* with times and paths */
    bool has_aperture, has_focus;
    struct cli_views views;
    bool has_eye, has_look_at, has_up, has_fov; /* in `key` */
    bool has_framing;                           /* something of the automatic camera is given */
    const char *framed;                         /* node that it shows, name or number; NULL: all */
    bool float_pixels, half_pixels, dwaa, has_encoding, has_primary, has_quality, has_integrator, has_clamp, quiet,
        is_orbit;
    char light_groups[CLI_LIGHT_GROUPS][CLI_LIGHT_GROUP_NAME]; /* their names; their nodes are in `edits` */
    unsigned light_group_count;
    const char *colour_space, *display_view, *ocio; /* NULL: none */
    bool has_samples, auto_samples;                 /* --samples auto */
    bool without_studio;                            /* --studio off */
    bool has_denoise, filters; /* filters: 8-bit pictures are denoised where nothing is said */
    uint32_t usual_samples;    /* where nothing is said and the integrator has no number of its own; 0: 1 */
    char depth_field[24];      /* the option that set the depth, for messages; empty: none */
    unsigned file_quality;     /* of JPEG, WebP and video files; 0: default */
    enum cli_timings_form timings;
    struct record_camera_key key;
    double eye_rest[3], look_at_rest[3]; /* what the key's floats lose of --eye and --look-at */
    double origin[3];                    /* subtracted from all places of the camera so far */
    struct message_render options;
    struct fl_error error; /* of what was typed */
};

/* ---- job_series.c: a series of frames ---- */

/* A child parser; its input is a struct cli_job. */
const struct argp *cli_series_argp(void);
/* As if "--OPTION VALUE" had been typed. ARGP_ERR_UNKNOWN: there is none. */
error_t cli_series_set(struct cli_job *job, const char *option, const char *value);
/* cli_job_complete() for a series, and what only a series has. */
bool cli_series_complete(struct cli_job *job);
void cli_series_finish(struct cli_job *job);

/* ---- job_views.c: several views in a picture, lenses and frames by depth layers ---- */

/* Sets what an option of views says; ARGP_ERR_UNKNOWN: it is none of them. */
error_t cli_views_set(struct cli_job *job, const char *option, const char *value);
/* Their fields of `render`, once all options are read. `is_series`: frames may be made from others. */
bool cli_views_complete(struct cli_job *job, bool is_series);
/* Whether the range, which is known, has frames to be made from others, if that is asked for. */
bool cli_views_check_range(const struct cli_job *job, struct fl_error *error);
/* Whether each view is a file of its own. */
bool cli_views_are_files(const struct cli_job *job);

/* A child parser; its input is a struct cli_job. */
const struct argp *cli_job_argp(void);
/* Likewise, without the options of output, tracer and first hits. */
const struct argp *cli_picture_argp(void);
/* Likewise, without the options of output. */
const struct argp *cli_views_argp(void);
/* Likewise, of pictures of many models. */
const struct argp *cli_thumbnail_argp(void);
/* Likewise for a window, without the options of files; samples, integrator and encoding have other defaults
 * there. */
const struct argp *cli_view_argp(void);
/* Likewise for a page in a browser, whose window has its size, and which chooses clips itself. */
const struct argp *cli_web_argp(void);
/* The defaults, then FARLIGHT_*; before the command line is read. */
bool cli_job_begin(struct cli_job *job, struct message_render defaults);
/* As if "--OPTION VALUE" had been typed; NULL for an option without a value. ARGP_ERR_UNKNOWN: there is none. */
error_t cli_job_set(struct cli_job *job, const char *option, const char *value);
/* Sets the job's error and returns EINVAL. */
error_t cli_usage(struct cli_job *job, const char *field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* "environment", "transparent" or a colour: "#rrggbb". */
error_t cli_set_background(struct cli_job *job, const char *field, const char *value);
error_t cli_set_environment_rotation(struct cli_job *job, const char *field, const char *value);
/* After the command line: settings that depend on several options. `is_series`: output is a pattern. */
bool cli_job_complete(struct cli_job *job, bool is_series);
/* The same for a window: there is no output. */
bool cli_job_complete_view(struct cli_job *job);

/* Settings that depend on the loaded scene: clips, the objects of the script's keys, the default range of frames,
 * and what follows from it. Call it for each scene. */
bool cli_settle(struct cli_job *job, struct fl_scene *scene, bool is_series, struct fl_error *error);
bool cli_writes_to_stdout(const struct cli_job *job);

/* ---- loading.c: loads the command line's scene into a daemon ---- */

/* `job`, `progress` and the sharing of the scene are the caller's; the rest is initially zero. */
struct cli_loading {
    const struct cli_job *job;
    struct cli_progress *progress;
    bool again; /* the notes about the model have been printed */
    enum protocol_sharing sharing;
    const char *scene_name;              /* NULL: the model's file name */
    const char *const *daemon_arguments; /* of a private one; NULL: none */
    unsigned timeout_ms;                 /* as of fl_connect */
    struct fl_load_options load;
    struct fl_connection *connection;
    struct fl_scene *scene;
    unsigned warnings;
    uint64_t import_begin_ns, connect_begin_ns; /* monotonic clock */
};

/* Checks that the files exist, starts the importer and the connection to the daemon. */
bool cli_loading_begin(struct cli_loading *loading, struct fl_error *error);
/* Waits for the scene. */
bool cli_loading_end(struct cli_loading *loading, struct fl_error *error);
/* Loads the files again over the same connection: the new scene takes the place of the old one, which stays where
 * that fails. What the daemon has already is not sent. */
bool cli_loading_again(struct cli_loading *loading, struct fl_error *error);
/* That `what` is new, and how much of it was sent; on standard error, unless the job is quiet. */
void cli_loading_print_sent(const struct cli_loading *loading, const char *what);
void cli_loading_close(struct cli_loading *loading);
/* Shows a ground beneath models that bring no light, in pictures to look at, unless a camera of theirs is used. */
void cli_choose_ground(const struct cli_job *job, struct message_render *render, const struct fl_scene *scene);
/* A camera by name or number; without one the model's first, unless keys or something else place it. `framed`: the
 * node that is to be in view, name or number; NULL: all. */
bool cli_find_camera(struct message_render *render, const char *camera, const char *framed, bool is_placed,
                     const struct fl_scene *scene, struct fl_error *error);
/* Places of the camera are the model's: moves them to the scene, whose origin may be another. */
void cli_move_camera(struct cli_job *job, const double origin[3]);
/* Sets the job's camera if the command line leaves it to the model. */
bool cli_choose_camera(struct cli_job *job, const struct fl_scene *scene, struct fl_error *error);

/* ---- retry.c: lost daemons that may come back ---- */

/* Whether the same command may succeed later: the daemon is lost, or says that its state will change. */
bool cli_is_temporary(const struct fl_error *error);
/* The pause before the next try after this number of failures in a row, at least 1: it doubles each time, within
 * bounds, and differs by a quarter by chance, so that many clients of one daemon do not come back at once. */
uint32_t cli_retry_pause_ms(unsigned failures, uint32_t min_ms);
bool cli_retry_wait(uint32_t pause_ms, struct fl_error *error); /* false: interrupted */
/* A value of --retry-for; false: the error says what is allowed. */
bool cli_read_retry_for(const char *value, struct cli_retries *retries, struct fl_error *error);
/* The same of --lost-after. */
bool cli_read_lost_after(const char *value, struct cli_retries *retries, struct fl_error *error);
/* The time for a connection of which `left_s` are left to retry: at least a second, at most the library's own
 * time, which 0 stands for. */
unsigned cli_connect_timeout_ms(double left_s);

/* ---- daemon.c: commands that only query a daemon ---- */

struct cli_daemon {
    const char *server, *key_file; /* as typed */
    struct cli_retries retries;
};
/* --server, --key, --retry-for and --lost-after: a child parser; its input is a struct cli_daemon. */
extern const struct argp cli_daemon_argp;
/* Interruptible from then on. Tries again for the time of --retry-for, if that was given. Without --server
 * FARLIGHT_SERVER counts; if neither names a daemon, a private one is started, or (`must_be_named`) it is
 * FL_ERROR_ARGUMENT. */
struct fl_connection *cli_daemon_connect(const struct cli_daemon *daemon, const char *name, bool must_be_named,
                                         struct fl_error *error);

/* ---- wave_table.c: results of comparing the waves of a frame ---- */

/* Tables with a legend of their columns, on standard output. */
void cli_print_waves(const struct fl_frame *frame, enum protocol_tracer reference, double far_share);
json_t *cli_waves_json(const struct fl_frame *frame);      /* an object a wave and kind of ray */
json_t *cli_wave_total_json(const struct fl_frame *frame); /* all of them together */
double cli_wave_agreement(const struct fl_frame *frame);   /* likewise; see fl_wave_agreement */

/* ---- structure.c: what a tracer says of its structure (structure_row in protocol/messages.def) ---- */

#define CLI_WARNED_MAX 16u

/* Sets "structure", an object of all rows, lengths as "static/cell_metres"; and "warnings", an array of strings.
 */
void cli_structure_set_json(json_t *object, const struct fl_frame *frame);

/* Names of rows whose warning was printed. */
struct cli_warned {
    char names[CLI_WARNED_MAX][FL_STRUCTURE_NAME_BYTES];
    size_t count;
};
/* Warns on standard error about what the picture lacks, once per row. */
void cli_structure_warn(const struct fl_frame *frame, struct cli_warned *warned, struct cli_progress *progress);

/* ---- timings.c ---- */

struct cli_client_times {
    uint64_t total_ns, start_ns, export_ns;
    const struct fl_import_stats *import;
};
struct cli_timings;

struct cli_timings *cli_timings_create(enum cli_timings_form form, bool to_stderr);
void cli_timings_frame(struct cli_timings *timings, const struct fl_frame *frame);
void cli_timings_end(struct cli_timings *timings, const struct cli_client_times *times);
void cli_timings_destroy(struct cli_timings *timings);

/* ---- session.c: from a model to image files ---- */

/* Renders the job's frames into its outputs: paths or "-", patterns if `is_series`. */
int cli_run_job(struct cli_job *job, bool is_series);
/* Checks what can be checked of an animation without a daemon. */
int cli_dry_run(struct cli_job *job);

#endif
