/* SPDX-License-Identifier: MIT */
/* The state behind engine.h, private to engine/. It belongs to the thread that owns GL, except where it says
 * otherwise. */
#ifndef FARLIGHT_ENGINE_ENGINE_PRIVATE_H
#define FARLIGHT_ENGINE_ENGINE_PRIVATE_H

#include "base/hashmap.h"
#include "base/queue.h"
#include "engine/animation.h"
#include "engine/aside.h"
#include "engine/backend.h"
#include "engine/encode_pool.h"
#include "engine/engine.h"
#include "engine/hidden_budget.h"
#include "engine/keep.h"
#include "engine/output.h"
#include "engine/scheduler.h"
#include "engine/shot.h"
#include "engine/totals.h"
#include "engine/view_mailbox.h"

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
    struct engine_reference *next; /* next holder of the same scene, in order of attachment */
    struct engine_client *client;
    struct engine_scene *scene;
    uint32_t id; /* the client's number for it */
    /* Owned: the renderer of the last job that ended, from whose samples the next job continues; NULL: none, or
     * evicted. */
    struct frame_renderer *idle;
};

/* Facts of a scene that stay readable while another thread changes it. */
struct scene_known {
    uint64_t revision, host_bytes, table_bytes;
    uint32_t nodes;
};

struct engine_scene {
    struct engine_scene *next;           /* next scene of the engine, in order of opening */
    struct engine_reference *references; /* NULL: it has no holder, and ends or lingers */
    uint64_t left_ns;                    /* time at which its last holder left */
    bool is_restored; /* restored, and not held since: it does not count against the limit of lingering scenes */
    enum sharing sharing;
    uint64_t principal; /* owner who opened it */
    struct scene *scene;
    /* Task of another thread on `scene`, from which this thread keeps away; NULL: none. */
    struct aside_commit *commit;
    struct scene_known known;   /* facts after its last transaction */
    struct frame_scene *shared; /* NULL until the first frame, and after the device was lost */
    uint32_t frames;            /* frames in progress, of all jobs */
    uint64_t frames_ended;      /* frames ended so far, plus 1 */
    /* A job whose frame cannot begin beside those in progress; others do not begin before it. NULL: none. */
    struct job *put_off;
    struct engine_command **waiting; /* owned: commands for when no frame is in progress, in order */
    size_t waiting_count;
    uint64_t kept_revision, keep_due_ns; /* revision that the keeper has, and the time of the next save */
    uint64_t apply_start_ns, apply_ns;   /* time of the commits since the last frame */
    /* Counts for statistics at counted_revision, so that a large scene is not traversed for each request. */
    struct engine_scene_stat *stat; /* the scene's entry while statistics are collected */
    uint64_t counted_revision, triangles, spheres;
    uint32_t instances;
    struct engine_scene_description *description; /* description at its own revision; NULL: not requested yet */
};

/* State of a view: its last frame, and the one in progress; see view.c. */
struct view {
    uint64_t credit, made;           /* frames that may be begun, and frames made so far */
    uint64_t due_ns;                 /* earliest begin of the next frame */
    uint64_t render_ns, rendered_ns; /* duration and end of its last frame; 0: none */
    /* Facts of its last frame, if `shown`. */
    bool shown;
    uint64_t shown_command, shown_revision;
    bool shown_moving;
    uint32_t held_samples;
    /* Facts of the frame in progress. */
    struct view_request latest;
    bool refining;               /* whether it only adds samples to the last picture */
    uint32_t margin_x, margin_y; /* pixels on each side */
    uint32_t hidden_layer;       /* layer of the frame in progress or the next one; 0: a picture */
    bool hidden_is_paid; /* whether the budget pays for such frames; if not, they wait until nothing else is to be
                            done */
    struct hidden_budget hidden_budget;
    uint64_t hidden_ns; /* time of this picture's hidden layers so far */
    uint64_t begun_ns;  /* begin of the last picture while the camera moved; 0: none */
    uint32_t picture;   /* number of the last frame that was no hidden layer */
    /* Lane of the frames that form a stream; NULL: none do. */
    struct encode_lane *lane;
    bool needs_key_frame; /* whether a requested key frame is still missing */
};

struct job {
    uint64_t client;
    uint32_t request;
    struct engine_job spec;             /* its keys are owned */
    struct engine_reference *reference; /* the client's reference, which outlives the job */
    struct engine_scene *scene;         /* the reference's scene */
    struct frame_renderer *renderer;    /* owned; NULL until the first frame, and after the device was lost */
    struct job_output *output;
    uint64_t next_frame; /* number in the range; beyond its end: all rendered */
    struct schedule_share schedule;
    struct animation_bounds bounds;
    uint64_t losses_ns[DEVICE_REBUILDS_MAX]; /* when the device was lost over its frames, a ring */
    unsigned losses;
    uint64_t refused_after; /* frames_ended of its scene when its frame could not begin beside others */
    /* the frame in progress */
    bool rendering;
    bool evicted;               /* whether idle structures were evicted for its memory already */
    struct scene_motion motion; /* owned */
    struct frame_request frame;
    float time_s, shutter_s;
    uint64_t begin_ns;
    struct view view; /* JOB_VIEW only */
};

struct engine {
    struct engine_options options;
    const struct engine_backend *backend;
    struct gpu_device_info device_info; /* constant after the start; any thread */
    struct queue *commands, *events;    /* any thread */
    atomic_bool stop, nudged;           /* any thread */
    atomic_uint_fast64_t turns;         /* turns of the thread so far; any thread */
    atomic_bool waits;                  /* whether it has nothing to do; any thread */
    struct stage_totals totals;         /* any thread */
    struct encode_pool *pool;
    struct aside *aside;
    struct keep *keep; /* NULL: there is no keeper */
    pthread_t thread;
    bool has_thread;

    /* The result of the start, for engine_create. */
    pthread_mutex_t start_lock;
    pthread_cond_t start_changed;
    enum { START_PENDING, START_DONE, START_FAILED } start;
    struct error start_error;

    struct gpu_device *device; /* NULL while it is lost */
    uint64_t device_bytes_limit;
    uint64_t rebuilds_ns[DEVICE_REBUILDS_MAX]; /* times of its reopenings, a ring */
    unsigned rebuilds;
    struct hashmap clients;          /* struct engine_client *, by number */
    struct engine_scene *scenes;     /* owned */
    struct engine_scene *read_scene; /* scene that the keeper reads, which no transaction may change; NULL: none */
    bool read_scene_ended;           /* whether it ended meanwhile: it is in no list, and owned here */
    struct job **jobs;               /* owned, in the order of their start */
    size_t job_count, job_capacity;
    struct scheduler scheduler;
    struct schedule_entry *entries; /* owned; as many entries as there may be jobs */
    /* Job that lacked memory for its frame beside those in progress; no other frame begins before its. NULL: none.
     */
    struct job *needs_memory;
    struct job *turn_of; /* the job of the last slice; NULL: it has ended, or none was ready */
    uint64_t frames, rays;
    uint64_t table_bytes;    /* bytes of the tables of all scenes */
    uint64_t promised_bytes; /* bytes promised to transactions on other threads */
};

/* engine.c */
void engine_post(struct engine *engine, struct engine_event *event); /* NULL: logged as lost */
void engine_post_done(struct engine *engine, uint64_t client, uint32_t request, uint64_t revision);
void engine_post_failed(struct engine *engine, uint64_t client, uint32_t request, const struct error *error);
void engine_post_device_gone(struct engine *engine);
void engine_set_limits(struct engine *engine, const struct engine_limits *limits);

/* The error of a cancelled command; NULL: out of memory. */
struct engine_event *engine_cancelled(uint64_t client, uint32_t request, const char *why);

/* commands.c: carries a command out, or keeps it until its scene's frames are done. Takes it over. */
void engine_handle(struct engine *engine, struct engine_command *command);
/* Runs the commands that waited for a scene, if no frame of it is in progress. */
void engine_run_waiting(struct engine *engine, struct engine_scene *scene);
/* Answers the transactions that are finished beside this thread. */
void engine_finish_commits(struct engine *engine);
/* Updates the scene's known facts, and the sum of tables, after a transaction. */
void engine_scene_note(struct engine *engine, struct engine_scene *scene);
/* Removes and returns the first waiting command that names the reference; NULL: none. */
struct engine_command *engine_take_waiting(struct engine_scene *scene, const struct engine_reference *reference);

/* scenes.c: scenes and their holders. Each function answers its command; the caller keeps it. */
void engine_scene_open(struct engine *engine, const struct engine_command *command);
void engine_scene_attach(struct engine *engine, const struct engine_command *command);
void engine_scene_close(struct engine *engine, struct engine_reference *reference,
                        const struct engine_command *command);
/* NULL: the client has no scene of that number. */
struct engine_reference *engine_find_reference(struct engine *engine, uint64_t client, uint32_t id);
/* Ends the jobs that were started through a reference, with ERROR_CANCELLED; `why` NULL: without an answer. */
void engine_abort_jobs(struct engine *engine, const struct engine_reference *reference, const char *why);
void engine_forget_client(struct engine *engine, struct engine_client *client);
/* Notifies every holder of a scene except the one that changed it (NULL: it is gone). */
void engine_scene_changed(struct engine *engine, const struct engine_scene *scene,
                          const struct engine_reference *by);
/* Releases scenes without a holder whose time is over. Returns the time until the next one ends, UINT64_MAX: none.
 */
uint64_t engine_reap_scenes(struct engine *engine);
/* Releases all scenes without a holder at once. */
void engine_end_left_scenes(struct engine *engine);
/* Bytes of the tables of scenes without a holder. */
uint64_t engine_left_table_bytes(const struct engine *engine);
/* Evicts scenes without a holder, the oldest first, until the tables of all scenes are within their limit, or that
 * many bytes of blobs are unused; evicts none if all of them would not suffice. */
void engine_trim_tables(struct engine *engine);
void engine_trim_blobs(struct engine *engine, uint64_t bytes);

/* Whether the scene may change now: no frame is in progress, and no other thread changes or reads it. */
bool engine_scene_may_change(const struct engine *engine, const struct engine_scene *scene);
/* Releases a scene that is in no list. */
void engine_scene_free(struct engine *engine, struct engine_scene *scene);

/* kept.c: scenes that outlive the process; nothing happens without a keeper. */
/* Saves a changed scene. Returns the time until the next save is due, UINT64_MAX: none waits. */
uint64_t engine_keep_scenes(struct engine *engine);
void engine_forget_kept(struct engine *engine, const struct engine_scene *scene);
/* Saves unsaved scenes at the end of the thread, within a limited time. */
void engine_stop_keeping(struct engine *engine);

/* describe.c: contents of a scene, and the list of scenes. */
void engine_count_contents(struct engine_scene *scene);
void engine_scene_list(struct engine *engine, const struct engine_command *command);
void engine_scene_describe(struct engine *engine, struct engine_scene *scene,
                           const struct engine_command *command);

/* objects.c: lists a scene's objects by name, and reads a single one. */

void engine_objects_list(struct engine *engine, const struct engine_scene *from,
                         const struct engine_command *command);
void engine_object_read(struct engine *engine, const struct engine_scene *from,
                        const struct engine_command *command);
/* Whether the principal may attach to the scene. */
bool engine_scene_is_open_to(const struct engine_scene *scene, uint64_t principal);

/* batch.c: jobs. */
/* `bounds`: the scene's bounds if they are known already, else NULL. Takes over the keys on success. */
bool job_start(struct engine *engine, struct engine_reference *reference, struct engine_command *command,
               const struct animation_bounds *bounds, struct error *error);
/* A job that is not answered yet; NULL: none. */
struct job *job_find(struct engine *engine, uint64_t client, uint32_t request);
bool job_is_ready(const struct engine *engine, const struct job *job);
/* Time until a job is ready, if nothing happens before; UINT64_MAX: unlimited. */
uint64_t jobs_idle_ns(const struct engine *engine);
/* Runs one slice, which begins a frame or continues it. Does not run the commands that wait for its scene. */
void job_step(struct engine *engine, struct job *job);
/* Ends the job now; no event follows `final` (may be NULL). Does not run the commands that wait for its scene. */
void job_abort(struct engine *engine, struct job *job, struct engine_event *final);
/* Releases jobs whose last event is sent. */
void jobs_reap(struct engine *engine);
void job_credit(struct job *job, uint64_t credit); /* absolute */
/* Whether the job has a frame to begin, and a free place for it. */
bool job_wants_frame(const struct job *job);
/* Abandons its frame in progress, if there is one; it will be rendered again. */
void job_abandon_frame(struct engine *engine, struct job *job);
/* Ends its frame in progress. */
void job_end_frame(struct job *job);

/* view.c: what differs for views. */
/* Continues frame numbers and pace of the view `before`, which `job` replaces. */
void view_follow(struct job *job, const struct job *before);
/* Time at which its next frame may begin; in the past: now. UINT64_MAX: not before something happens. */
uint64_t view_due_ns(const struct job *job);
/* Whether the view has changed since its last frame. */
bool view_has_news(const struct job *job);
/* Makes the shot of its next frame from the latest requests. */
bool view_begin_frame(struct job *job, struct shot *shot, struct error *error);
/* Planes that the encoder of the frame in progress will certainly accept. */
enum ycbcr view_ycbcr(const struct job *job);
/* Whether the frame in progress is no longer worth finishing. */
bool view_is_stale(const struct job *job);
/* Fills in the fields of a view's frame after it was rendered. */
void view_done(struct job *job, struct engine_frame *frame);
/* Drops hidden layers from the view after one has failed. False: the failed frame was no hidden layer. */
bool view_drop_hidden_layers(struct job *job, const struct error *error);

/* device.c: the device and the scenes' resources on it. */
bool engine_open_device(struct engine *engine, struct error *error);
/* Makes sure that the device is open; reopens it after a loss if that is still allowed. */
bool engine_need_device(struct engine *engine, struct error *error);
/* Counts a loss of the device during a frame of the job. False and *error: too many, the job must end. */
bool engine_job_may_continue(struct job *job, struct error *error);
/* Releases everything on the device, and the device. */
void engine_drop_device(struct engine *engine);
/* Evicts resources on the device that neither a frame in progress nor the next frame of `keep` needs. False: there
 * were none. */
bool engine_evict_idle(struct engine *engine, const struct job *keep);
/* Gets the job a renderer if it has none: its reference's idle one, or a new one. */
bool job_need_renderer(struct engine *engine, struct job *job, struct error *error);
/* Leaves the job's renderer to the next job of its reference. */
void job_leave_renderer(struct engine *engine, struct job *job);
/* Drops the reference's idle renderer. False: there was none. */
bool reference_drop_idle(struct engine *engine, struct engine_reference *reference);
/* Releases everything of the scene on the device; its jobs have ended, or no frame is in progress. */
void scene_drop_shared(struct engine *engine, struct engine_scene *scene);
/* Device memory of the scene, without that of its jobs. */
uint64_t scene_own_device_bytes(const struct engine *engine, const struct engine_scene *scene);
uint64_t job_device_bytes(const struct engine *engine, const struct job *job);
uint64_t engine_device_bytes(const struct engine *engine);

/* memory.c: frames that lack memory on the device. */
/* Frees device memory for a job whose frame was abandoned for lack of it. Whether another try is worthwhile, at
 * once or when other frames have ended. */
bool engine_free_memory(struct engine *engine, struct job *job);
/* Whether a frame of the job may begin without taking memory that another job waits for. */
bool engine_memory_lets_begin(const struct engine *engine, const struct job *job);
void engine_needs_no_memory(struct engine *engine, const struct job *job); /* clears the job's need */

/* stats.c */
/* NULL: out of memory. */
struct engine_stats *engine_stats_collect(const struct engine *engine, uint64_t principal);

#endif
