/* SPDX-License-Identifier: MIT */
/* Internals of the viewer, shared by its files. */
#ifndef FARLIGHT_CLIENT_VIEWER_VIEWER_STATE_H
#define FARLIGHT_CLIENT_VIEWER_VIEWER_STATE_H

#include "viewer/view/decode.h"
#include "viewer/overlay/hud.h"
#include "viewer/input/replay.h"
#include "viewer/view/session.h"
#include "viewer/viewer.h"
#include "viewer/viewer_edit.h"
#include "viewer/view/views.h"
#include "viewer/overlay/window.h"

/* What a job beside the view is for. */
enum viewer_task {
    TASK_NONE,
    TASK_HOME,      /* the initial camera, from the command line, the model or the scene's extent */
    TASK_CAMERA,    /* where a camera of the scene is */
    TASK_FOCUS,     /* where what is under the pointer is */
    TASK_PICK,      /* which object it is */
    TASK_REFERENCE, /* the resting picture, by the reference */
    TASK_OUTLINE    /* where in it is what the panel changes */
};

struct viewer {
    const struct viewer_options *options;
    struct message_render view; /* of one eye: from the options, completed by the scene */
    struct session *session;
    unsigned times_live;        /* of the session, as of when its view was started */
    unsigned times_read;        /* likewise; what is known of cameras and clips is as of then */
    char *model;                /* that was dropped, and is shown; NULL: that of the options */
    struct session *next;       /* that of a dropped model, until it is there; NULL: there is none */
    char *next_model;           /* its path */
    char refused[HUD_TEXT_MAX]; /* why a dropped model is not shown, though it is there; empty: it is */
    struct window *window;      /* NULL: headless */
    int width, height;
    double scale;
    bool quit;

    struct settings settings, taken; /* `taken`: with which frames came */
    struct settings first;           /* as they were at first */
    struct tour tour;
    char camera_name[129], clip_name[129]; /* of those that the tour is at */
    struct controls controls;
    double pointer_x, pointer_y;

    struct viewer_camera camera, home;
    bool has_camera, has_home;
    uint32_t followed; /* node of the camera that the view follows, for clips to move; 0: none */
    struct viewer_camera glide_from, glide_to; /* from .. to, since then; 0: it does not glide */
    uint64_t glide_begin_ns;

    /* What the daemon was told last. */
    bool must_show, must_look;
    uint64_t change, command, looked_ns, moved_ns;
    bool told_moving, has_looked;

    struct decoder *decoder;
    struct pixmap arrived;                                     /* the last frame, while it is decided on .. */
    struct pixmap live;                                        /* .. and the last one that can be shown */
    struct fl_frame frame;                                     /* what it told, without its arrays */
    char structure[HUD_STRUCTURE_MAX][HUD_STRUCTURE_TEXT_MAX]; /* of its tracer */
    size_t structure_count;
    uint64_t frames;
    struct metrics metrics;
    bool must_draw;
    uint64_t drawn_ns;

    /* Views that are made here. */
    struct plan_switch local_switch;
    struct plan_motion motion; /* up to .. */
    struct viewer_camera followed_camera;
    struct plan_pace pace;
    bool local_asked, local_granted; /* the stream was asked to have depths; it has had them since then */
    bool has_keys;                   /* views can be made */
    uint32_t key_frame;              /* number of the frame that the last key was */
    float local_radius;              /* of the sphere that their bound holds in */
    bool is_live;                    /* the last frame is in `live` */
    struct views *views;             /* NULL: none was needed */
    struct views_wish wished;
    uint64_t wish; /* its number; 0: none */
    struct pixmap made;
    struct views_made made_of;
    bool has_made;        /* since views are wanted */
    bool shows_made;      /* in place of `live` */
    uint64_t local_views; /* so many */

    enum viewer_task task, wanted; /* the current one; the next one */
    double focus_x, focus_y;       /* what is pointed at; shares of the picture */
    uint32_t camera_node;
    struct pixmap compared, heat; /* the picture as it was; its errors */
    struct heat_figures heat_figures;
    uint64_t heat_command, heat_change, heat_revision; /* of what was compared */
    bool has_heat, heat_refused;

    struct viewer_edit edit;
    struct viewer_outline {
        uint64_t command, change, revision; /* of the picture .. */
        size_t tab;
        uint32_t id; /* .. and the object that it was asked for last */
        bool is_answered;
        uint8_t *marks; /* its pixels; NULL: there is none */
        int width, height;
        struct pixmap picture; /* the live one with it, .. */
        uint64_t of_version;   /* .. of which it is this version, .. */
        bool is_drawn;         /* .. once it is there */
    } outline;

    char notice[HUD_TEXT_MAX];
    uint64_t notice_ns; /* until then */
    unsigned screenshots;

    struct viewer_shot {
        const char *path;
        struct pixmap picture;
    } * shots; /* screenshots of the replay that are not written yet */
    size_t shot_count;
    struct replay replay;
    size_t replay_next;
    uint64_t replay_ns;       /* since when the next event is looked at */
    uint64_t replay_revision; /* of the scene, after the last event */
    uint64_t tick_ns;
    struct fl_error failure; /* why it ends */
};

#define HEAT_TOP 0.25 /* a quarter of white is the brightest colour of the error map */

__attribute__((format(printf, 2, 3))) void viewer_say(struct viewer *viewer, const char *format, ...);

/* ---- viewer_open.c ---- */

/* Of a dropped model, whose path must live as long, or NULL: of the command line's. */
struct session *viewer_open_session(struct viewer *viewer, const char *dropped, struct fl_error *error);
const char *viewer_scene_name(const struct viewer *viewer);
/* Begins to open a model in place of the one that is shown. */
void viewer_open(struct viewer *viewer, const char *path);
/* It is there, and its first picture is not possible: a dropped one says so and waits for other settings. */
void viewer_refuse_scene(struct viewer *viewer, const struct fl_error *refusal);
void viewer_step_opening(struct viewer *viewer, uint64_t now_ns);
void viewer_abandon_opening(struct viewer *viewer);

/* ---- viewer_show.c ---- */

void viewer_tell(struct viewer *viewer, uint64_t now_ns); /* of the view and the camera, where they changed */
void viewer_receive(struct viewer *viewer, unsigned timeout_ms);
/* The frame has that many samples, or an error that is as small as is wanted. */
bool viewer_has_samples(const struct viewer *viewer, const struct fl_frame *frame, unsigned enough);
/* The frame shows the last request, and will not get more than `samples` samples (0: all). */
bool viewer_is_at_rest(const struct viewer *viewer, unsigned samples);
/* Makes a request for a picture of width x height pixels one of both eyes, where there are two. */
void viewer_use_eyes(const struct viewer *viewer, struct message_render *view);
/* The pixels that the daemon renders for the window, for one eye or two. */
void viewer_render_size(const struct viewer *viewer, uint32_t *width, uint32_t *height);

/* ---- viewer_local.c ---- */

bool viewer_has_local(const struct viewer *viewer); /* views are made while the camera moves */
/* Decides it, after a frame. */
void viewer_plan_local(struct viewer *viewer, uint64_t now_ns);
/* Completes a request for a view with what is needed for them. */
void viewer_ask_local(struct viewer *viewer, struct message_render *view);
bool viewer_asks_otherwise(const struct viewer *viewer); /* than it did */
/* Takes back what may be why the view was refused. */
void viewer_refuse_local(struct viewer *viewer);
/* The camera that the daemon is told: while it moves, where it will be when the picture is here. */
void viewer_aim(const struct viewer *viewer, bool moving, uint64_t now_ns, struct viewer_camera *camera);
/* What the picture of a key hides. */
void viewer_take_hidden(struct viewer *viewer, struct fl_frame *frame);
/* The frame that has `arrived`, which is without its margin afterwards. */
bool viewer_take_picture(struct viewer *viewer, struct fl_frame *frame);
/* Wants a view where it is needed, and shows what has been made. */
void viewer_step_local(struct viewer *viewer, uint64_t now_ns);
void viewer_forget_local(struct viewer *viewer); /* of a connection that is gone */
/* The picture is of the newest camera, and the best one until another frame comes. */
bool viewer_shows_camera(const struct viewer *viewer);

/* ---- viewer_tasks.c ---- */

void viewer_step_tasks(struct viewer *viewer);
void viewer_drop_tasks(struct viewer *viewer); /* of a connection that is gone */
/* Moves there; gliding, unless in a replay. `node`: the scene's camera there, which the view then follows while a
 * clip is chosen; 0: none. */
void viewer_go(struct viewer *viewer, const struct viewer_camera *camera, uint32_t node);
/* The picture is seen through the camera `followed`: `camera` only repeats the last frame's. */
bool viewer_follows(const struct viewer *viewer);
/* How first hits are found, in the view and in the reference that it is compared with: rasterised samples lie
 * elsewhere than traced ones, so it is not left to the daemon. */
uint32_t viewer_primary(const struct viewer *viewer);
uint32_t viewer_home_node(const struct viewer *viewer); /* of the initial camera; 0: it is none of the scene's */

/* ---- viewer_outline.c ---- */

bool viewer_outline_is_due(const struct viewer *viewer);   /* it can be asked for, and was not yet */
bool viewer_outline_is_asked(const struct viewer *viewer); /* what was asked for is what is wanted */
/* Completes a request for identifiers. */
void viewer_outline_ask(struct viewer *viewer, struct message_render *job);
void viewer_outline_take(struct viewer *viewer, const struct fl_frame *frame);
void viewer_outline_refuse(struct viewer *viewer); /* this picture has none */
bool viewer_outline_is_shown(const struct viewer *viewer);
void viewer_step_outline(struct viewer *viewer);
void viewer_outline_forget(struct viewer *viewer);

/* ---- viewer_act.c ---- */

void viewer_input(struct viewer *viewer, const struct input *input);
void viewer_replay(struct viewer *viewer, uint64_t now_ns);
/* Chooses a clip of the scene, TOUR_NONE: none. */
void viewer_choose_clip(struct viewer *viewer, int clip);

/* ---- viewer_draw.c ---- */

const struct pixmap *viewer_picture(const struct viewer *viewer); /* that is shown */
void viewer_hud(struct viewer *viewer, struct hud_state *state);
bool viewer_screenshot(struct viewer *viewer, const char *path, struct fl_error *error);
/* One that is written before the next state or wait, so that a replay goes on in time. The path must live until
 * then. */
bool viewer_keep_screenshot(struct viewer *viewer, const char *path, struct fl_error *error);
/* Of those that are kept; frees them. */
bool viewer_write_screenshots(struct viewer *viewer, struct fl_error *error);
void viewer_print_state(struct viewer *viewer, const char *name);

#endif
