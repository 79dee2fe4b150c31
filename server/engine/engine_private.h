/* SPDX-License-Identifier: MIT */
/* The state behind engine.h. Private to job/; all of it belongs to the thread that owns GL but where it says so.
 */
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
    /* Owned: the renderer of the last job that ended, from whose samples the next job continues; NULL: none, or
     * evicted. */
    struct frame_renderer *idle;
};

/* What all may know of a scene while another thread changes it. */
struct scene_known {
    uint64_t revision, host_bytes, table_bytes;
    uint32_t nodes;
};

struct engine_scene {
    struct engine_scene *next;           /* of the engine's, in the order of their opening */
    struct engine_reference *references; /* NULL: it has no holder, and ends or lingers */
    uint64_t left_ns;                    /* since when it has had no holder */
    bool is_restored;                    /* and has had none since: the last process had that many */
    enum sharing sharing;
    uint64_t principal; /* that opened it */
    struct scene *scene;
    struct aside_commit
        *commit;                /* that changes `scene` beside this thread, which keeps away from it; NULL: none */
    struct scene_known known;   /* as of its last transaction */
    struct frame_scene *shared; /* NULL until the first frame, and after the device was lost */
    uint32_t frames;            /* in progress, of all jobs */
    uint64_t frames_ended;      /* and one */
    /* A job whose frame cannot begin beside those in progress; others do not begin before it. NULL: none. */
    struct job *put_off;
    struct engine_command **waiting; /* owned: commands for when no frame is in progress, in order */
    size_t waiting_count;
    uint64_t kept_revision, keep_due_ns; /* that the keeper has, and when it may have the next */
    uint64_t apply_start_ns, apply_ns;   /* of the commits since the last frame */
    /* For stats, as of that revision: a large scene is not traversed for each request. */
    struct engine_scene_stat *stat; /* while it is filled in */
    uint64_t counted_revision, triangles, spheres;
    uint32_t instances;
    struct engine_scene_description *description; /* as of its revision; NULL: not asked for yet */
};

/* What a view shows now and may show next; see view.c. */
struct view {
    uint64_t credit, made;           /* frames that may be begun, and that were made */
    uint64_t due_ns;                 /* no frame is begun before */
    uint64_t render_ns, rendered_ns; /* of its last frame: its duration and end; 0: none */
    /* Of its last frame, if `shown`. */
    bool shown;
    uint64_t shown_command, shown_revision;
    bool shown_moving;
    uint32_t held_samples;
    /* Of the frame in progress. */
    struct view_wish wish;
    bool refining;               /* it shows nothing that was not shown */
    uint32_t margin_x, margin_y; /* pixels on each side */
    uint32_t hidden_layer;       /* of the frame in progress, or the next one */
    bool hidden_is_paid;         /* such frames need not wait until nothing else is to be done */
    struct hidden_budget hidden_budget;
    uint64_t hidden_ns; /* that the layers of this picture took so far */
    uint64_t begun_ns;  /* of the last picture while it moved; 0: none */
    uint32_t picture;   /* number of the last frame that was none of a hidden layer */
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
    bool evicted;               /* others gave way once already for its memory */
    struct scene_motion motion; /* owned */
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
    struct engine_scene *read_scene; /* that the keeper reads; no transaction changes it. NULL: none */
    bool read_scene_ended;           /* it is in no list, and owned here */
    struct job **jobs;               /* owned, in the order of their start */
    size_t job_count, job_capacity;
    struct scheduler scheduler;
    struct schedule_entry *entries; /* owned; as many entries as there may be jobs */
    /* The job that lacked memory for its frame beside those in progress: no other frame begins before its. NULL:
     * none.
     */
    struct job *needs_memory;
    struct job *turn_of; /* the job of the last slice; NULL: it has ended, or none was ready */
    uint64_t frames, rays;
    uint64_t table_bytes;    /* of all scenes */
    uint64_t promised_bytes; /* for those that change beside this thread */
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
/* Notes what all may know of the scene. */
void engine_scene_note(struct engine *engine, struct engine_scene *scene);
/* Of those that wait, the first that has come by the reference; NULL: none. Takes it out. */
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

/* Whether it may change now: no frame of it is in progress, nothing else changes it, and nobody reads it. */
bool engine_scene_may_change(const struct engine *engine, const struct engine_scene *scene);
/* Releases a scene that is in no list. */
void engine_scene_free(struct engine *engine, struct engine_scene *scene);

/* kept.c: scenes that outlive the process; nothing happens without a keeper. */
/* Gives the keeper what has changed. Returns the time until it may have more, UINT64_MAX: nothing waits for that.
 */
uint64_t engine_keep_scenes(struct engine *engine);
void engine_forget_kept(struct engine *engine, const struct engine_scene *scene);
/* At the end of the thread: what is not kept yet, as far as there is time. */
void engine_stop_keeping(struct engine *engine);

/* describe.c: contents of a scene, and the list of scenes. */
void engine_count_contents(struct engine_scene *scene);
void engine_scene_list(struct engine *engine, const struct engine_command *command);
void engine_scene_describe(struct engine *engine, struct engine_scene *scene,
                           const struct engine_command *command);

/* objects.c: objects of a scene by name, and one as it is. */

void engine_objects_list(struct engine *engine, const struct engine_scene *from,
                         const struct engine_command *command);
void engine_object_read(struct engine *engine, const struct engine_scene *from,
                        const struct engine_command *command);
/* Whether the principal may attach to it. */
bool engine_scene_is_open_to(const struct engine_scene *scene, uint64_t principal);

/* batch.c: jobs. */
/* `bounds`: of the scene, if they were searched already; NULL: not. Takes the keys over on success. */
bool job_start(struct engine *engine, struct engine_reference *reference, struct engine_command *command,
               const struct animation_bounds *bounds, struct error *error);
/* A job that is not answered yet; NULL: none. */
struct job *job_find(struct engine *engine, uint64_t client, uint32_t request);
bool job_is_ready(const struct engine *engine, const struct job *job);
/* How long until one is ready, if nothing happens before; UINT64_MAX: for ever. */
uint64_t jobs_idle_ns(const struct engine *engine);
/* One slice: begins a frame, or continues it. Does not run the commands that wait for its scene. */
void job_step(struct engine *engine, struct job *job);
/* Ends the job now; no event follows `final` (may be NULL). Does not run the commands that wait for its scene. */
void job_abort(struct engine *engine, struct job *job, struct engine_event *final);
/* Releases jobs whose last event is sent. */
void jobs_reap(struct engine *engine);
void job_credit(struct job *job, uint64_t credit); /* absolute */
/* Whether the job has a frame to begin, and a free place for it. */
bool job_wants_frame(const struct job *job);
/* Gives up its frame in progress, if there is one, which begins again. */
void job_abandon_frame(struct engine *engine, struct job *job);
/* Its frame is in progress no longer. */
void job_end_frame(struct job *job);

/* view.c: what differs for views. */
/* Goes on where the view left off that `job` takes the place of. */
void view_follow(struct job *job, const struct job *before);
/* When its next frame may begin; in the past: now. UINT64_MAX: not before something happens. */
uint64_t view_due_ns(const struct job *job);
/* Whether the view has changed since its last frame. */
bool view_has_news(const struct job *job);
/* The content of its next frame. */
bool view_take_up(struct job *job, struct shot *shot, struct error *error);
/* The planes that the encoder of the frame in progress will certainly accept. */
enum ycbcr view_ycbcr(const struct job *job);
/* Whether the frame in progress is not worth its end any more. */
bool view_is_stale(const struct job *job);
/* After rendering: fills in the fields of a view's frame. */
void view_done(struct job *job, struct engine_frame *frame);
/* A frame of what is hidden has failed: the view has none of them from now on. False: it was no such frame. */
bool view_goes_without(struct job *job, const struct error *error);

/* device.c: the device and the scenes' resources on it. */
bool engine_open_device(struct engine *engine, struct error *error);
/* The device, opened again after a loss if that is still allowed. */
bool engine_need_device(struct engine *engine, struct error *error);
/* Notes that the device was lost over a frame of the job. False: that happens too often, it may not go on; *error
 * says so. */
bool engine_job_may_go_on(struct job *job, struct error *error);
/* Releases everything on the device, and the device. */
void engine_drop_device(struct engine *engine);
/* Evicts resources on the device that neither a frame in progress nor the next frame of `keep` needs. False: there
 * were none. */
bool engine_evict_idle(struct engine *engine, const struct job *keep);
/* A renderer for a job without one: its reference's, or a new one. */
bool job_need_renderer(struct engine *engine, struct job *job, struct error *error);
/* Leaves it to the next job by its reference. */
void job_leave_renderer(struct engine *engine, struct job *job);
/* False: there was none. */
bool reference_drop_idle(struct engine *engine, struct engine_reference *reference);
/* Everything of it on the device; its jobs have ended, or no frame is in progress. */
void scene_drop_shared(struct engine *engine, struct engine_scene *scene);
/* Without its jobs. */
uint64_t scene_own_device_bytes(const struct engine *engine, const struct engine_scene *scene);
uint64_t job_device_bytes(const struct engine *engine, const struct job *job);
uint64_t engine_device_bytes(const struct engine *engine);

/* memory.c: frames that lack memory on the device. */
/* For a job whose frame, given up by now, lacked memory. Whether it is worth another try, at once or when others
 * have ended. */
bool engine_make_room(struct engine *engine, struct job *job);
/* Whether it would take memory that another job waits for. */
bool engine_memory_lets_begin(const struct engine *engine, const struct job *job);
void engine_needs_no_memory(struct engine *engine, const struct job *job); /* any more */

/* stats.c */
/* NULL: out of memory. */
struct engine_stats *engine_stats_collect(const struct engine *engine, uint64_t principal);

#endif
