/* SPDX-License-Identifier: MIT */
/* A job as typed: what render, animate, compare, a window and a page share. */
#ifndef FARLIGHT_OPTIONS_JOB_H
#define FARLIGHT_OPTIONS_JOB_H

#include "lib/frame_set.h"
#include "options/image_path.h"
#include "options/progress.h"
#include "options/retry.h"

#include <argp.h>

enum cli_timings_form { CLI_TIMINGS_NONE, CLI_TIMINGS_TABLE, CLI_TIMINGS_JSON };

#define CLI_OUTPUTS_MAX 8

struct cli_output {
    const char *path;
    enum cli_image image;
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

/* Sets the job's error and returns EINVAL. */
error_t cli_usage(struct cli_job *job, const char *field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
