/* SPDX-License-Identifier: MIT */
/* The tracer `reference`: Embree on the CPU, the ground truth for the other tracers. Private to this room, which
 * is built only if Embree 3 is found.
 *
 * Where two surfaces coincide it may report a different one than bvh.
 *
 * Embree: Wald, Woop, Benthin, Johnson, Ernst. Embree: A Kernel Framework for Efficient CPU Ray Tracing. 2014. */
#ifndef FARLIGHT_TRACE_REFERENCE_TRACER_H
#define FARLIGHT_TRACE_REFERENCE_TRACER_H

#include "trace/reference/opacity.h"
#include "trace/tracer.h"

#include <embree3/rtcore.h>
#include <pthread.h>
#include <stdatomic.h>

#define REFERENCE_RAYS_MAX 16u /* rays per call of Embree */
/* Maximum coordinate of a ray: a quarter of Embree's own limit, as a margin for the rounding of its arithmetic. */
#define REFERENCE_COORDINATE_MAX 4.6e17f

/* A geometry of the scene, built: an Embree scene of one geometry, which any number of instances show. */
struct reference_entry {
    bool is_mesh;
    uint32_t id;
    uint32_t node; /* the node that deforms it; 0: it is rigid */
    uint64_t revision, deformed_revision;
    bool is_wanted; /* the scene still has it, in this revision */
    bool is_stale;  /* its Embree scene must be committed */
    bool is_fresh;  /* rebuilt by this update: its instances must be committed too */
    bool filters_closest, filters_any;
    uint32_t primitive_count;
    RTCScene scene;
    RTCGeometry geometry;
    struct blob *shape[2];          /* positions (unless it deforms) and indices, or centres and radii, which
                                       Embree reads */
    struct opacity_surface surface; /* read by the filter functions */
};

/* An instance of the scene, by its index; in the top scene it has the number index + 1. */
struct reference_instance {
    RTCGeometry geometry;                /* NULL: none yet */
    const struct reference_entry *entry; /* geometry shown */
    float (*world_from_object)[12];      /* transform in each pose */
    uint32_t pose_count;
    uint32_t first_primitive; /* scene-wide */
};

/* Number of the discs in the top scene. */
#define REFERENCE_DISCS 0u

struct reference {
    struct tracer base;
    RTCDevice device;
    struct reference_entry **entries; /* allocated singly: Embree keeps their addresses */
    uint32_t entry_count;
    struct opacity_materials materials;
    RTCScene top;
    struct reference_instance *instances;
    uint32_t instance_count;
    float coordinate_max;      /* limit for a ray's origin and direction; a ray beyond it hits nothing */
    RTCGeometry disc_geometry; /* NULL: no discs */
    struct opacity_surface disc_surface;
    unsigned width;       /* rays per call */
    uint64_t taken_bytes; /* bytes that the device's account has for it */
    /* The builder's thread, between two steps of an update. */
    pthread_t builder;
    bool is_building, top_changed;
    atomic_bool is_built, is_abandoned;
    uint64_t build_ns; /* its duration */
    /* Device memory at the beginning of the update: bytes that are not Embree's, and the limit. */
    uint64_t others_bytes, limit_bytes;
    /* Written by Embree's callbacks, on any thread. */
    atomic_llong device_bytes;
    pthread_mutex_t failure_mutex;
    enum RTCError failure; /* the first one since the last check */
    char failure_text[256];
    /* Number of waves that threads traverse, of any state; an update ends them. */
    atomic_uint waves_under_way;
    atomic_bool ends_waves;
};

/* True if Embree has reported nothing since the last call; else fills *error. */
bool reference_check(struct reference *reference, const char *what, struct error *error);

/* scene.c: brings the members above to the scene, in three steps. The first one reads the scene and sets
 * *builds if the second one is needed, which takes long and may run on any thread. After a failure the caller
 * must call reference_scene_finish. */
bool reference_scene_update(struct reference *reference, const struct gpu_scene *scene, unsigned changed,
                            bool *builds, struct error *error);
void reference_scene_build(struct reference *reference);
bool reference_scene_built(struct reference *reference, const struct gpu_scene *scene, struct error *error);
void reference_scene_finish(struct reference *reference); /* leaves it empty */
/* instance.c: updates instances if some may have moved, or show geometry that is rebuilt; *changed is set if any
 * did. */
bool reference_update_instances(struct reference *reference, const struct gpu_scene *scene, bool may_have_moved,
                                bool *changed, struct error *error);
void reference_drop_instances(struct reference *reference);

/* State of a wave: Embree's input and output, and the range that a thread traverses. */
struct reference_wave {
    struct trace_state base;
    struct ray *rays; /* grow with the range; kept */
    float *times;     /* times of those rays */
    void *answers;
    uint32_t ray_capacity;
    struct reference *reference; /* the owner of the thread to join; NULL: none */
    pthread_t thread;
    atomic_bool is_cancelled;
    struct wave traversed; /* copy of the wave, for the thread */
    struct ray_range range;
    uint64_t step_end_ns;
    pthread_mutex_t lock; /* guards the members below */
    pthread_cond_t done;
    bool is_done;
    uint32_t end; /* end of the rays that have answers */
};

/* wave.c: implement functions of struct tracer_impl. */
struct trace_state *reference_state_create(struct gpu_device *device, const struct tracer_options *options,
                                           struct error *error);
void reference_state_destroy(struct trace_state *state);
uint64_t reference_state_device_bytes(const struct trace_state *state);
bool reference_trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                           struct error *error);
bool reference_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                           const struct ray_range *rays, struct error *error);

/* traversal.c: traces the range of the wave; intersections or visibilities go to `answers`. Returns where it
 * stopped: a ray through a million triangles in one place takes milliseconds, its neighbour none. */
uint32_t reference_traverse(struct reference *reference, struct reference_wave *wave);
/* Filter functions: Embree calls them for each candidate on a geometry with cutouts (closest) or one that lets
 * light pass (any). */
void reference_filter_closest(const struct RTCFilterFunctionNArguments *arguments);
void reference_filter_any(const struct RTCFilterFunctionNArguments *arguments);

#endif
