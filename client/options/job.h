/* SPDX-License-Identifier: MIT */
/* A job as typed: shared by render, animate, compare, the window and the page. */
#ifndef FARLIGHT_OPTIONS_JOB_H
#define FARLIGHT_OPTIONS_JOB_H

#include "lib/frame_set.h"
#include "daemon.h"
#include "image_path.h"
#include "progress.h"

#include <argp.h>

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
    bool is_chunk;                    /* the part consists of neighbouring frames */
    bool resume;                      /* skips frames whose files exist */
    bool digests;                     /* writes a file with its digest beside each picture */
    struct record_camera_key *keys;   /* from keys_file, once all options are read */
    double orbit_degrees;
    double orbit_seconds; /* time for these degrees; 0: the range */
    float *dolly_times;   /* times of the camera path's two keys, the second one at: */
    double dolly_seconds; /* 0: the last frame */
};

/* A clip of the model to play. */
struct cli_clip {
    const char *which; /* name or number */
    float start_s, speed;
    bool loop;
    unsigned line; /* line of the script; 0: the command line */
};
#define CLI_CLIPS_MAX 15 /* the protocol's limit, minus one clip of our own */
#define CLI_EDITS_MAX 64
#define CLI_LIGHT_GROUPS (PROTOCOL_LAYER_LIGHT_GROUP7 - PROTOCOL_LAYER_LIGHT_REST)
#define CLI_LIGHT_GROUP_NAME 32 /* bytes */

/* Options of several views in a picture, as typed. */
struct cli_views {
    bool has_stereo, has_light_field, has_baseline, has_layout, has_views, has_lens;
    enum cli_stereo { CLI_STEREO_SIDE, CLI_STEREO_OVER, CLI_STEREO_FILES } layout;
    float stereo_m, baseline_m; /* distance between the eyes */
    uint32_t across, down;      /* views of a light field */
    enum protocol_view_source views, lens;
};

struct fl_json;
struct fl_json_place;

/* A property that the script animates or sets. */
struct cli_channel {
    struct fl_channel channel; /* the object is looked up once the scene is loaded */
    enum protocol_object_kind kind;
    const char *target;                /* name or number; NULL: the view */
    const struct fl_json_place *place; /* position in the script, for messages */
};

/* The scene that is rendered. */
struct cli_input {
    const char *scene;                     /* a shared scene of the server, in place of the model */
    struct fl_model models[FL_MODELS_MAX]; /* models of the command line */
    size_t count;
    const char *model;  /* path of the first model, or of a script's model */
    int fd;             /* bytes of the model "-", once cli_read_input() has them */
    const char *format; /* format of the model "-"; NULL: by its first bytes */
    bool watch;         /* repeats the command when its files change */
    const char *environment;
    double environment_degrees, point_size;    /* see fl_load_options */
    const char *variant;                       /* see fl_load_options */
    bool without_studio;                       /* --studio off */
    struct fl_assignment edits[CLI_EDITS_MAX]; /* for a model's scene */
    size_t edit_count;
};

/* Destinations of pictures, and their form. */
struct cli_destination {
    const char *path;
    enum cli_image image;
    struct cli_output list[CLI_OUTPUTS_MAX]; /* `path`, or several of a script */
    size_t count;
    bool parents; /* a missing folder is made */
    bool float_pixels, half_pixels, dwaa;
    bool lossless;                                  /* videos only */
    bool full_metadata;                             /* includes times and paths */
    unsigned quality;                               /* quality of JPEG, WebP and video files; 0: default */
    const char *colour_space, *display_view, *ocio; /* NULL: none */
};

/* The camera and its lens. */
struct cli_camera {
    const char *name; /* camera of the model, name or number; NULL: none is chosen */
    const char *keys_file;
    bool has_eye, has_look_at, has_up, has_fov; /* set in `key` */
    bool has_aperture, has_focus;
    bool has_framing;   /* an option of the automatic camera is given */
    const char *framed; /* node that the automatic camera frames, name or number; NULL: all */
    bool is_orbit;
    struct record_camera_key key;
    double eye_rest[3], look_at_rest[3]; /* parts of --eye and --look-at that the key's floats lose */
    double origin[3];                    /* total that was subtracted from the camera's positions */
};

/* Animation of the scene. */
struct cli_clips {
    struct cli_clip list[CLI_CLIPS_MAX];
    size_t count;
    struct cli_channel *channels; /* the script's */
    size_t channel_count;
    struct record_clip_use uses[CLI_CLIPS_MAX + 1];
    bool once;      /* play the command line's clips once */
    double start_s; /* time at which the clips start */
    double speed;
    double time_s;    /* `render`: time of the clips */
    bool change_lens; /* clips open the lens, so the integrator must support lenses */
};

struct cli_sampling {
    bool has_samples, is_auto; /* --samples auto */
    uint32_t usual;            /* default for integrators without a number of their own; 0: 1 */
    bool progressive;          /* `render`: writes the picture repeatedly, with more samples */
    bool endless;              /* `render`: refines until it is interrupted */
    bool by_error;             /* a single picture: sampled in passes until its error is small */
    uint32_t pass_samples;     /* samples of a pass; 0: as many as there are already */
    bool has_denoise, filters; /* filters: 8-bit pictures are denoised by default */
};

struct cli_job {
    struct cli_input input;
    struct cli_daemon daemon;
    struct cli_destination output;
    struct cli_talk talk;
    struct cli_camera camera;
    struct cli_clips clips;
    struct cli_sampling sampling;
    struct cli_series series;
    struct cli_views views;
    struct {
        uint32_t number, count; /* `render`: which part of the picture, and the number of parts; 0: all of it */
        const char *name;       /* name in the part's file, once it is known */
    } part;
    struct {
        /* Names of groups; their nodes are in the input's edits */
        char names[CLI_LIGHT_GROUPS][CLI_LIGHT_GROUP_NAME];
        unsigned count;
    } light_groups;
    struct {
        bool encoding, primary, quality, integrator, clamp;
    } given;            /* values of `options` set by the command line */
    const char *script; /* path; NULL: none */
    const struct fl_json *script_json;
    char depth_field[24]; /* the option that has set the depth, for messages; empty: none */
    struct message_render options;
    struct fl_error error; /* error of an option */
};

/* Sets the job's error and returns EINVAL. */
error_t cli_usage(struct cli_job *job, const char *field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
