/* SPDX-License-Identifier: MIT */
/* The thread that owns GL and the pool that encodes, seen from outside: commands in, events out.
 *
 * The network thread submits commands and takes events; both go through bounded queues. The engine owns the
 * contents of an accepted command; the receiver of an event owns the event's contents. Clients, scenes, requests
 * and channels are numbers that the network side chose. */
#ifndef FARLIGHT_ENGINE_ENGINE_H
#define FARLIGHT_ENGINE_ENGINE_H

#include "base/error.h"
#include "base/stage_times.h"
#include "encode/encoder.h"
#include "encode/parts.h"
#include "gpu/device.h"
#include "render/context/camera.h"
#include "render/frame/frame.h"
#include "scene/pose.h"
#include "scene/scene.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct engine;
struct engine_backend;
struct view_mailbox;

#define ENGINE_LINGERING_SCENES 16u                     /* default of lingering_scenes */
#define ENGINE_FRAME_WINDOW_BYTES ((uint64_t)512 << 20) /* default of frame_window_bytes */

/* Limits that may change while the engine runs. */
struct engine_limits {
    struct scene_limits scene; /* host_bytes also limits the tables of all scenes together */
    uint64_t scene_linger_ms;  /* how long an attachable scene lingers without a holder; 0: it ends at once */
    uint32_t lingering_scenes; /* maximum of lingering scenes; beyond it, the client with most of them loses its
                                  oldest; 0: default */
};

/* Storage of attachable scenes for the next process. */
struct engine_keeper {
    void *context;
    /* read() and write() are called on a thread of their own, one after the other. read() copies from the scene,
     * which does not change in that time, what write() is to store; NULL: there is nothing to store. Both end soon
     * once *abandoned is set; write() releases the record in any case. */
    void *(*read)(void *context, const struct scene *scene, uint64_t principal, enum sharing sharing,
                  const atomic_bool *abandoned);
    void (*write)(void *context, void *record, const atomic_bool *abandoned);
    /* The scene has ended. Called on the same thread, after earlier writes. */
    void (*forget)(void *context, uint64_t principal, const char *name);
};

#define ENGINE_FRAMES_IN_FLIGHT 3 /* the default */

struct engine_options {
    struct gpu_options gpu;
    unsigned encode_threads;     /* 0: one per core, at most 4 */
    size_t queue_capacity;       /* commands and events; 0: 1024 */
    uint32_t frames_in_flight;   /* per job, rendered and not yet fetched; 0: the default */
    uint64_t frame_window_bytes; /* limit of the same frames' pixels, which may allow fewer of them, but at least
                                    one; 0: default */
    struct engine_limits limits;
    uint64_t device_bytes_limit;          /* 0: gpu_memory_default_limit() */
    const struct engine_backend *backend; /* NULL: the GPU; for tests */
    const struct engine_keeper *keeper;   /* NULL: scenes end with the process */
};

/* A job's terms; engine/shot.h makes the request and the poses of each frame from them. */
struct engine_job {
    enum job_kind kind;
    uint32_t scene; /* ignored: the command's scene counts */
    uint32_t first_frame, last_frame, frame_step;
    float frames_per_second;
    uint32_t time_origin_frame;
    struct frame_request frame; /* camera, lens, ground and seed are filled per frame */
    enum encoding encoding;
    unsigned quality;
    struct record_shot camera;
    struct record_camera_key *keys; /* owned */
    uint32_t key_count;
    struct record_clip_use *clips; /* owned */
    uint32_t clip_count;
    struct record_view view; /* for a view */
    /* Frames that may be handed out so far, absolute. Without credit, nothing is rendered or reserved. Beyond it,
     * a batch renders as many frames as may be in flight and keeps them; a view begins none, so that none becomes
     * stale. */
    uint64_t credit;
    /* A view's mailbox, see engine/view_mailbox.h; owned: a reference. The view replaces a view with the same
     * mailbox, which ends with ENGINE_DONE; frame numbers, counted from first_frame on, continue. */
    struct view_mailbox *mailbox;
    unsigned weight; /* its share of the device's time among the jobs of all clients; 0: 1 */
};

enum engine_command_kind {
    ENGINE_SCENE_OPEN,
    ENGINE_SCENE_ATTACH,   /* answered by ENGINE_DONE with its revision; ENGINE_SCENE_CHANGED may follow */
    ENGINE_SCENE_CLOSE,    /* the client's jobs on the scene fail with ERROR_CANCELLED just before the answer */
    ENGINE_SCENE_LIST,     /* answered by ENGINE_SCENES_LISTED */
    ENGINE_SCENE_DESCRIBE, /* answered by ENGINE_SCENE_DESCRIBED */
    ENGINE_OBJECTS_LIST,   /* answered by ENGINE_OBJECTS_LISTED */
    ENGINE_OBJECT_READ,    /* answered by ENGINE_OBJECT_IS */
    ENGINE_SCENES_TRIM,    /* ends scenes without a holder until blobs of trim_bytes are unused; no answer */
    ENGINE_COMMIT, /* waits for the scene's frames in progress; later commands for that scene wait behind it */
    /* Answered by ENGINE_DONE after the last frame, or by ENGINE_FAILED, which follows the finished frames that
     * have credit. A view has no last frame: it is done when another view replaces it. */
    ENGINE_JOB_START,
    ENGINE_JOB_CREDIT, /* no answer */
    ENGINE_JOB_CANCEL, /* answered by ENGINE_DONE; the job's own request fails with ERROR_CANCELLED just before */
    ENGINE_VIEW_CHANGED, /* a view's requests have changed: wakes the engine; no answer */
    ENGINE_STATS,
    ENGINE_LIMITS,      /* new limits; a scene that is open keeps its limit of nodes. No answer */
    ENGINE_CLIENT_GONE, /* forgets its scenes and jobs; no answer, and no event for that client comes after
                           ENGINE_CLIENT_FORGOTTEN */
};

struct engine_command {
    struct engine_command *next; /* for the caller: the engine does not read it */
    enum engine_command_kind kind;
    uint64_t client;
    uint32_t request;
    uint32_t scene;
    char name[SCENE_NAME_MAX + 1]; /* scene_open, scene_attach, objects_list */
    enum sharing sharing;          /* scene_open */
    uint64_t kept_revision;        /* scene_open: the next transaction has this revision, and the keeper has it; 0:
                                      the scene is new */
    /* scene_open, _attach, _list, stats: the principal of the asking client, to whom kept scenes belong. */
    uint64_t principal;
    uint64_t trim_bytes;      /* scenes_trim */
    struct scene_edit *edits; /* commit; malloc'ed array */
    size_t edit_count;
    uint64_t base_revision;       /* commit: above 0: see scene_edits_are_current() */
    enum object_kind object_kind; /* objects_list, object_read */
    uint32_t object;              /* objects_list: 0: all; object_read */
    uint32_t list_from;           /* objects_list: 0, or engine_object_list.next */
    struct engine_job job;
    uint32_t target_request; /* job_cancel, job_credit: the job's request */
    uint64_t credit;
    struct engine_limits limits; /* limits */
};
void engine_command_destroy(struct engine_command *command); /* frees it with all it holds; accepts NULL */
void engine_command_release_edits(struct engine_command *command);

struct engine_scene_stat {
    bool is_known; /* for the asking client: its own scene, or one that it may attach to */
    uint64_t client;
    uint32_t scene;
    char name[SCENE_NAME_MAX + 1];
    uint64_t revision, triangles, spheres, host_bytes, device_bytes;
    uint32_t nodes, instances;
};
struct engine_stats {
    struct gpu_device_info device;
    uint64_t device_bytes, device_limit_bytes, host_bytes, frames, rays;
    uint32_t jobs, device_objects;
    struct engine_scene_stat *scenes; /* owned */
    uint32_t scene_count;
    struct {
        uint64_t count, total_ns, max_ns;
    } stages[STAGE_COUNT][2]; /* by stage and clock */
};

#define ENGINE_DESCRIPTION_MAX 256 /* cameras, and clips */

struct engine_scene_entry {
    uint64_t revision, triangles;
    uint32_t clients;
    enum sharing sharing;
    char name[SCENE_NAME_MAX + 1];
};
struct engine_scene_list {
    size_t count;
    struct engine_scene_entry scenes[]; /* by name */
};
struct engine_camera_entry {
    uint32_t node;
    float fov_y; /* 0: orthographic */
    char name[SCENE_NAME_MAX + 1];
};
struct engine_clip_entry {
    uint32_t clip, channels;
    float duration_s;
    char name[SCENE_NAME_MAX + 1];
};
struct engine_scene_description {
    uint64_t revision, triangles, spheres;
    uint32_t nodes;
    bool empty;
    float lower_world[3], upper_world[3]; /* finite */
    uint32_t camera_count, clip_count;    /* the first ones, ascending */
    struct engine_camera_entry cameras[ENGINE_DESCRIPTION_MAX];
    struct engine_clip_entry clips[ENGINE_DESCRIPTION_MAX];
};

#define ENGINE_OBJECTS_MAX 256 /* maximum of objects in one answer */

struct engine_object_entry {
    uint32_t object;
    uint32_t parent, shows; /* a node's parent, and the object that it shows */
    enum node_kind shows_kind;
    char name[SCENE_NAME_MAX + 1];
};
struct engine_object_list {
    uint64_t revision;
    uint32_t total; /* objects of the kind in the scene */
    uint32_t next;  /* 0: there are no more */
    uint32_t count;
    struct engine_object_entry objects[ENGINE_OBJECTS_MAX];
};

enum engine_event_kind {
    ENGINE_DONE,
    ENGINE_FAILED,
    ENGINE_FRAME,
    ENGINE_STATS_READY,
    ENGINE_SCENES_LISTED,
    ENGINE_SCENE_DESCRIBED,
    ENGINE_OBJECTS_LISTED,
    ENGINE_OBJECT_IS,     /* at `revision` */
    ENGINE_SCENE_CHANGED, /* by another client; `scene` is the client's number for it */
    ENGINE_SCENE_ENDED,   /* a scene without a holder: blobs may be unused now. Client 0 */
    ENGINE_CLIENT_FORGOTTEN,
    /* The device is lost for good: too many losses, or it cannot be opened again. All jobs have failed. Client 0
     */
    ENGINE_DEVICE_GONE
};

struct engine_frame {
    uint32_t frame;               /* number in the job's range */
    struct frame_request request; /* the request that it was rendered with, camera included */
    struct frame_result result;   /* pixels are gone, the rest is there; times include encode */
    enum encoding encoding;
    uint8_t *bytes; /* owned, malloc'ed */
    size_t size_bytes;
    uint64_t digest; /* XXH3-64 of the pixels before encoding, as they came: see result.ycbcr */
    float time_s, shutter_s;
    uint64_t encoded_ns;         /* clock_now_ns() when it was ready to be sent */
    unsigned quality;            /* quality of the encoding; 0: lossless */
    unsigned scale_32nds;        /* share of the job's width and height; 0: all */
    unsigned margin_halves_less; /* part of the margin that was dropped, as in struct view_effort */
    unsigned depth_less;         /* bounces that were dropped, as in struct view_effort */
    uint64_t wanted_bytes;       /* target size, for an encoder with rate control; 0: not known */
    bool wants_key;              /* whether it must be encoded as a key frame .. */
    bool key_frame;              /* .. and whether it was */
    /* Sizes of encoded attachments, which are the end of `bytes` in this order, .. */
    size_t depth_bytes, normal_bytes;
    size_t sticking_bytes;       /* .. followed by these .. */
    bool in_parts;               /* .. unless the frame is encoded in parts .. */
    struct part_list parts;      /* .. which this list describes; empty: it could not be divided */
    size_t coarse_bytes;         /* size of its coarse depths, a part of size_bytes */
    struct record_view view;     /* requested form of depths .. */
    float depth_step;            /* .. and the step that was used, in 1 / metres; 0: depths are metres */
    uint32_t margin_x, margin_y; /* pixels on each side beyond what the job asks for */
    uint32_t of_frame;           /* request.hidden_layer above 0: the frame to which the layer belongs */
    /* The latest camera command that a view's frame shows, and its arrival; 0 before the first. */
    uint64_t command, received_ns;
    bool moving;
    uint64_t applied_ns, rendered_ns; /* clock_now_ns() at its begin, and when it was read back */
};

struct engine_event {
    enum engine_event_kind kind;
    uint64_t client;
    uint32_t request;
    uint64_t revision;  /* done, for a commit or an attach; scene_changed; object_is */
    uint32_t scene;     /* scene_changed */
    struct error error; /* failed */
    struct engine_frame *frame;
    struct engine_stats *stats;
    struct engine_scene_list *list;
    struct engine_scene_description *description;
    struct engine_object_list *objects;
    struct scene_edit *object;
    struct job_output *output; /* private to engine/ */
};
void engine_event_destroy(struct engine_event *event); /* accepts NULL */
void engine_stats_destroy(struct engine_stats *stats); /* accepts NULL */

/* Starts the threads; the device is opened before it returns, so that a missing GPU is an error here. */
struct engine *engine_create(const struct engine_options *options, struct error *error);
/* Stops after the current slice and drops waiting commands. Accepts NULL. */
void engine_destroy(struct engine *engine);
const struct gpu_device_info *engine_device(const struct engine *engine);
/* The limit of device memory, 0: none. For the creator of the engine, right after its creation. */
uint64_t engine_device_limit_bytes(const struct engine *engine);
/* False with ERROR_BUSY (retryable) when the queue is full; the command then still belongs to the caller. */
bool engine_submit(struct engine *engine, struct engine_command *command, struct error *error);
int engine_event_fd(const struct engine *engine);              /* readable while events wait */
struct engine_event *engine_next_event(struct engine *engine); /* NULL: none waits */
/* Whether the thread that owns GL has made progress since the last call, within long work too (base/progress.h),
 * or has nothing to do. *turns belongs to the caller, 0 at first. */
bool engine_is_alive(const struct engine *engine, uint64_t *turns);
/* Adds send and queue time of a frame to the totals, once the network side knows them. */
void engine_report_sent(struct engine *engine, uint64_t queue_ns, uint64_t send_ns);

#endif
