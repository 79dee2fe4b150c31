/* SPDX-License-Identifier: MIT */
/* The tracer `reference`: Embree on the CPU, the ground truth for the other tracers. Private to this room, which
 * is built only if Embree 3 is found.
 *
 * Of two surfaces in one place it may report the other one than bvh does.
 *
 * Embree: Wald, Woop, Benthin, Johnson, Ernst. Embree: A Kernel Framework for Efficient CPU Ray Tracing. 2014. */
#ifndef FARLIGHT_TRACE_REFERENCE_TRACER_H
#define FARLIGHT_TRACE_REFERENCE_TRACER_H

#include "trace/reference/opacity.h"
#include "trace/tracer.h"

#include <embree3/rtcore.h>
#include <pthread.h>
#include <stdatomic.h>

#define REFERENCE_RAYS_MAX 16u /* a call of Embree */
/* A quarter of what Embree takes for a coordinate, for what its own arithmetic rounds. */
#define REFERENCE_COORDINATE_MAX 4.6e17f

/* A geometry of the scene, built; one Embree scene of one geometry, which any number of instances show. */
struct reference_entry {
    bool is_mesh;
    uint32_t id;
    uint32_t node; /* that deforms it; 0: it is rigid */
    uint64_t revision, deformed_revision;
    bool is_wanted; /* the scene still has it, in this revision */
    bool is_stale;  /* its Embree scene has to be committed */
    bool is_fresh;  /* by this update: its instances have to be committed too */
    bool filters_closest, filters_any;
    uint32_t primitive_count;
    RTCScene scene;
    RTCGeometry geometry;
    struct blob *shape[2];          /* what Embree reads: positions (unless it deforms) and indices, or centres and
                                       radii */
    struct opacity_surface surface; /* what the filter functions read */
};

/* An instance of the scene, by its index; in the top scene it has the number index + 1. */
struct reference_instance {
    RTCGeometry geometry;                /* NULL: none yet */
    const struct reference_entry *entry; /* what the geometry shows */
    float (*world_from_object)[12];      /* in each pose */
    uint32_t pose_count;
    uint32_t first_primitive; /* scene-wide */
};

/* The discs' number in the top scene. */
#define REFERENCE_DISCS 0u

struct reference {
    struct tracer base;
    RTCDevice device;
    struct reference_entry **entries; /* each by itself: Embree keeps their addresses */
    uint32_t entry_count;
    struct opacity_materials materials;
    RTCScene top;
    struct reference_instance *instances;
    uint32_t instance_count;
    float coordinate_max;      /* of a ray's origin and direction; what lies beyond hits nothing */
    RTCGeometry disc_geometry; /* NULL: no discs */
    struct opacity_surface disc_surface;
    unsigned width;       /* rays a call */
    uint64_t taken_bytes; /* of the device's memory, in its books */
    /* The builder's thread, between two steps of an update. */
    pthread_t builder;
    bool is_building, top_changed;
    atomic_bool is_built, is_abandoned;
    uint64_t build_ns; /* how long it took */
    /* Of the device's memory, as the update began: what is not Embree's, and the limit. */
    uint64_t others_bytes, limit_bytes;
    /* What Embree's callbacks write, from any thread. */
    atomic_llong device_bytes;
    pthread_mutex_t failure_mutex;
    enum RTCError failure; /* the first since it was last asked */
    char failure_text[256];
    /* Waves of any state that threads traverse, which an update ends. */
    atomic_uint waves_under_way;
    atomic_bool ends_waves;
};

/* True if Embree has reported nothing since the last call; else fills *error. */
bool reference_check(struct reference *reference, const char *what, struct error *error);

/* scene.c: brings all of the above to the scene, in three steps. The first one reads the scene; *builds: the
 * second one, which takes long and may run on any thread, is to be done. After a failure reference_scene_finish is
 * due. */
bool reference_scene_update(struct reference *reference, const struct gpu_scene *scene, unsigned changed,
                            bool *builds, struct error *error);
void reference_scene_build(struct reference *reference);
bool reference_scene_built(struct reference *reference, const struct gpu_scene *scene, struct error *error);
void reference_scene_finish(struct reference *reference); /* leaves it empty */
/* instance.c. `look`: some may have moved, or show geometry that is rebuilt; *changed is set if so. */
bool reference_update_instances(struct reference *reference, const struct gpu_scene *scene, bool look,
                                bool *changed, struct error *error);
void reference_drop_instances(struct reference *reference);

/* The state of a wave: what Embree reads and writes, and the range that a thread traverses. */
struct reference_wave {
    struct trace_state base;
    struct ray *rays; /* they grow and stay */
    float *times;     /* of those rays */
    void *answers;
    uint32_t ray_capacity;
    struct reference *reference; /* whose thread is to be joined; NULL: none */
    pthread_t thread;
    atomic_bool is_cancelled;
    struct wave traversed; /* the wave, for the thread */
    struct ray_range range;
    uint64_t step_end_ns;
    pthread_mutex_t lock; /* of what follows */
    pthread_cond_t landed;
    bool has_landed;
    uint32_t end; /* of the rays that have answers */
};

/* wave.c: functions of struct tracer_impl. */
struct trace_state *reference_state_create(struct gpu_device *device, const struct tracer_options *options,
                                           struct error *error);
void reference_state_destroy(struct trace_state *state);
uint64_t reference_state_device_bytes(const struct trace_state *state);
bool reference_trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                           struct error *error);
bool reference_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                           const struct ray_range *rays, struct error *error);

/* traversal.c: traces the range of the wave; intersections or visibilities go to `answers`. Returns where it
 * ended: a ray through a million triangles in one place takes milliseconds, its neighbour none. */
uint32_t reference_traverse(struct reference *reference, struct reference_wave *wave);
/* Embree asks these about each candidate on a geometry that has cutouts (closest), or lets light pass (any). */
void reference_filter_closest(const struct RTCFilterFunctionNArguments *arguments);
void reference_filter_any(const struct RTCFilterFunctionNArguments *arguments);

#endif
