/* SPDX-License-Identifier: MIT */
/* The state behind engine.h. Private to job/; all of it belongs to the thread that owns GL but where it says so.
 */
#ifndef FARLIGHT_ENGINE_ENGINE_PRIVATE_H
#define FARLIGHT_ENGINE_ENGINE_PRIVATE_H

#include "base/hashmap.h"
#include "base/queue.h"
#include "engine/animation.h"
#include "engine/backend.h"
#include "engine/encode_pool.h"
#include "engine/engine.h"
#include "engine/output.h"
#include "engine/scheduler.h"
#include "engine/shot.h"
#include "engine/totals.h"
#include "engine/view_wishes.h"

#include <pthread.h>
#include <stdatomic.h>

#define DEVICE_REBUILDS_MAX 3
#define DEVICE_REBUILDS_WINDOW_NS (300 * 1000000000ull)

struct engine_client {
    uint64_t client, principal;
    struct hashmap references; /* struct engine_reference *, by the client's number */
    struct schedule_client schedule;
};

/* A client's hold on a scene. */
struct engine_reference {
    struct engine_reference *next; /* on the same scene, in the order of their coming */
    struct engine_client *client;
    struct engine_scene *scene;
    uint32_t id; /* the client's number for it */
    /* Owned: what the last job that has ended had, and the next one goes on from, its samples included; NULL:
     * there is none, or it made room. */
    struct frame_renderer *idle;
};

struct engine_scene {
    struct engine_scene *next;           /* of the engine's, in the order of their opening */
    struct engine_reference *references; /* NULL: nobody holds it; it ends, or lingers for a while */
    uint64_t left_ns;                    /* since when nobody does */
    enum engine_sharing sharing;
    uint64_t principal; /* who opened it */
    struct scene *scene;
    struct frame_scene *shared; /* NULL until the first frame, and after the device was lost */
    uint32_t frames;            /* in progress, of all jobs */
    uint64_t frames_ended;      /* and one */
    /* Its frame may not begin beside those, and others do not keep it waiting; NULL: there is none. */
    struct job *put_off;
    struct engine_command **waiting; /* owned: commands for when no frame is in progress, in order */
    size_t waiting_count;
    uint64_t apply_start_ns, apply_ns; /* of the commits since the last frame */
    /* For stats, as of that revision: a large scene is not gone through each time that somebody asks. */
    uint64_t counted_revision, triangles, spheres;
    uint32_t instances;
    struct engine_scene_description *description; /* as of its revision; NULL: nobody has asked */
};

/* What a view shows, and what it may show next; see view.c. */
struct view {
    uint64_t credit, made;           /* frames that may be begun, and that were made */
    uint64_t due_ns;                 /* no frame is begun before */
    uint64_t render_ns, rendered_ns; /* of its last frame: how long it took, and until when; 0: there is none */
    /* Of its last frame; `shown`: there is one. */
    bool shown;
    uint64_t shown_command, shown_revision;
    bool shown_moving;
    uint32_t held_samples;
    /* Of the frame in progress. */
    struct view_wish wish;
    bool refining; /* it shows nothing that was not shown */
    /* If some of its frames are a stream; NULL: none are. */
    struct encode_lane *lane;
    bool owes_key_frame; /* it was wished and has not come */
};

struct job {
    uint64_t client;
    uint32_t request;
    struct engine_job spec;             /* its keys are owned */
    struct engine_reference *reference; /* by which it was started; it ends before that does */
    struct engine_scene *scene;         /* that of the reference */
    struct frame_renderer *renderer;    /* owned; NULL until the first frame, and after the device was lost */
    struct job_output *output;
    uint64_t next_frame; /* number in the range; beyond its end: all rendered */
    struct schedule_share schedule;
    struct animation_bounds bounds;
    uint64_t losses_ns[DEVICE_REBUILDS_MAX]; /* when the device was lost over its frames, a ring */
    unsigned losses;
    uint64_t refused_after; /* frames_ended of its scene when its frame could not begin beside others */
    /* of the frame in progress */
    bool rendering;
    bool evicted; /* others gave way once already for its memory */
    struct frame_request frame;
    float time_s, shutter_s;
    uint64_t begin_ns;
    struct view view; /* of kind JOB_VIEW */
};

struct engine {
    struct engine_options options;
    const struct engine_backend *backend;
    struct gpu_device_info device_info; /* constant after the start; any thread */
    struct queue *commands, *events;    /* any thread */
    atomic_bool stop, nudged;           /* any thread */
    atomic_uint_fast64_t turns;         /* of the thread; any thread */
    atomic_bool waits;                  /* it has nothing to do; any thread */
    struct stage_totals totals;         /* any thread */
    struct encode_pool *pool;
    pthread_t thread;
    bool has_thread;

    /* What the start came to, for engine_create. */
    pthread_mutex_t start_lock;
    pthread_cond_t start_changed;
    enum { START_PENDING, START_DONE, START_FAILED } start;
    struct error start_error;

    struct gpu_device *device; /* NULL while it is lost */
    uint64_t device_bytes_limit;
    uint64_t rebuilds_ns[DEVICE_REBUILDS_MAX]; /* when it was made anew, a ring */
    unsigned rebuilds;
    struct hashmap clients;      /* struct engine_client *, by number */
    struct engine_scene *scenes; /* owned */
    struct job **jobs;           /* owned, in the order of their start */
    size_t job_count, job_capacity;
    struct scheduler scheduler;
    struct schedule_entry *entries; /* owned; room for as many as there is for jobs */
    /* There was no memory for its frame beside those in progress, so none begins before it; NULL: there is none.
     */
    struct job *needs_all;
    struct job *turn_of; /* who had the last slice; NULL: it has ended, or nobody was ready */
    uint64_t frames, rays;
    uint64_t table_bytes; /* of all scenes */
};

/* engine.c */
void engine_post(struct engine *engine, struct engine_event *event); /* NULL: logged as lost */
void engine_post_done(struct engine *engine, uint64_t client, uint32_t request, uint64_t revision);
void engine_post_failed(struct engine *engine, uint64_t client, uint32_t request, const struct error *error);
void engine_post_device_gone(struct engine *engine);
void engine_set_limits(struct engine *engine, const struct engine_limits *limits);
void engine_nudge(struct engine *engine); /* any thread: there may be something to do */

/* The failure of what somebody ended; NULL: out of memory. */
struct engine_event *engine_cancelled(uint64_t client, uint32_t request, const char *why);

/* commands.c: carries a command out, or keeps it until its scene's frames are done. Takes it over. */
void engine_handle(struct engine *engine, struct engine_command *command);
/* Carries out what waited for a scene, if no frame of it is in progress. */
void engine_run_waiting(struct engine *engine, struct engine_scene *scene);
/* Of those that wait, the first that has come by the reference; NULL: none. Takes it out. */
struct engine_command *engine_take_waiting(struct engine_scene *scene, const struct engine_reference *reference);

/* scenes.c: scenes and who holds them. Each answers its command, and leaves it to the caller. */
void engine_scene_open(struct engine *engine, const struct engine_command *command);
void engine_scene_attach(struct engine *engine, const struct engine_command *command);
void engine_scene_close(struct engine *engine, struct engine_reference *reference,
                        const struct engine_command *command);
/* NULL: the client has no scene of that number. */
struct engine_reference *engine_find_reference(struct engine *engine, uint64_t client, uint32_t id);
/* Ends the jobs that were started by a reference, with ERROR_CANCELLED; `why` NULL: nobody is told. */
void engine_abort_jobs(struct engine *engine, const struct engine_reference *reference, const char *why);
void engine_forget_client(struct engine *engine, struct engine_client *client);
/* Tells all who hold a scene, but for who changed it. */
void engine_scene_changed(struct engine *engine, const struct engine_reference *by);
/* Lets go of scenes that nobody holds, once they have lingered. The time until the next one ends, UINT64_MAX: none
 * does. */
uint64_t engine_reap_scenes(struct engine *engine);
/* Lets go of all that nobody holds, without lingering. */
void engine_end_left_scenes(struct engine *engine);
/* What tables of scenes take that nobody holds. */
uint64_t engine_left_table_bytes(const struct engine *engine);
/* Scenes that nobody holds give way to who asks, until the tables of all are within their limit, or so many bytes
 * of blobs are used no more; nothing ends if all of them would not do. His own go first, then those of
 * whoever left most. */
void engine_trim_tables(struct engine *engine, uint64_t principal);
void engine_trim_blobs(struct engine *engine, uint64_t principal, uint64_t bytes);

/* describe.c: what is in scenes, and which there are. */
void engine_count_contents(struct engine_scene *scene);
void engine_scene_list(struct engine *engine, const struct engine_command *command);
void engine_scene_describe(struct engine *engine, struct engine_scene *scene,
                           const struct engine_command *command);
/* Whether who asks can come to it. */
bool engine_scene_is_open_to(const struct engine_scene *scene, uint64_t principal);

/* batch.c: jobs. */
bool job_start(struct engine *engine, struct engine_reference *reference, struct engine_command *command,
               struct error *error); /* takes the keys over on success */
/* A job that is not answered yet; NULL: there is none. */
struct job *job_find(struct engine *engine, uint64_t client, uint32_t request);
bool job_is_ready(const struct engine *engine, const struct job *job);
/* How long until one is ready, if nothing happens before; UINT64_MAX: for ever. */
uint64_t jobs_idle_ns(const struct engine *engine);
/* One slice: takes up a frame, or goes on with it. Does not run what waits for its scene. */
void job_step(struct engine *engine, struct job *job);
/* Ends it now; nothing comes after `final` (may be NULL). Does not run what waits for its scene. */
void job_abort(struct engine *engine, struct job *job, struct engine_event *final);
/* Lets go of jobs whose last event is out. */
void jobs_reap(struct engine *engine);
void job_credit(struct job *job, uint64_t credit); /* absolute */

/* view.c: what batch.c asks where the job is a view. */
/* Goes on where the view left off that `job` takes the place of. */
void view_follow(struct job *job, const struct job *before);
/* When its next frame may begin; in the past: now. UINT64_MAX: not before something happens. */
uint64_t view_due_ns(const struct job *job);
/* Whether there is something to show that no frame has shown. */
bool view_has_news(const struct job *job);
/* What its next frame shows. */
bool view_take_up(struct job *job, struct shot *shot, struct error *error);
/* Of the frame that was taken up: which planes its encoder will take for certain. */
enum ycbcr view_ycbcr(const struct job *job);
/* Whether the frame in progress is not worth its end any more. */
bool view_is_stale(const struct job *job);
/* Its frame is made: fills in what a view's frame tells. */
void view_done(struct job *job, struct engine_frame *frame);

/* device.c: the device and what scenes keep on it. */
bool engine_open_device(struct engine *engine, struct error *error);
/* The device, made anew where it was lost and that is still allowed. */
bool engine_need_device(struct engine *engine, struct error *error);
/* Notes that the device was lost over a frame of the job. False: that happens too often, it may not go on; *error
 * says so. */
bool engine_job_may_go_on(struct job *job, struct error *error);
/* Lets go of everything on the device and of the device. */
void engine_drop_device(struct engine *engine);
/* Lets go of what is kept on the device and no frame in progress needs, nor the next one of `keep`. False: nothing
 * was there. */
bool engine_evict_idle(struct engine *engine, const struct job *keep);
/* A renderer for a job that has none: what its reference has, or a new one. */
bool job_need_renderer(struct engine *engine, struct job *job, struct error *error);
/* Leaves it to the next job by its reference. */
void job_leave_renderer(struct engine *engine, struct job *job);
/* False: there was none. */
bool reference_drop_idle(struct engine *engine, struct engine_reference *reference);
/* Everything of it on the device; its jobs have ended, or no frame is in progress. */
void scene_drop_shared(struct engine *engine, struct engine_scene *scene);
uint64_t scene_device_bytes(const struct engine *engine, const struct engine_scene *scene);
uint64_t engine_device_bytes(const struct engine *engine);

/* stats.c */
/* NULL: out of memory. */
struct engine_stats *engine_stats_collect(const struct engine *engine, uint64_t principal);

#endif
