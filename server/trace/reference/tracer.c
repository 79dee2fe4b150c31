/* SPDX-License-Identifier: MIT */
/* The tracer `reference`: Embree's device, its account of memory, and builds in a thread. */
#include "trace/reference/tracer.h"

#include "base/clock.h"
#include "base/host.h"
#include "shared/hit.h"
#include "shared/ray.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Interval at which an update polls the builder. */
#define BUILDER_LOOK_US 200

/* ---- callbacks of Embree ---- */

static void note_failure(void *context, enum RTCError code, const char *text)
{
    struct reference *reference = context;
    pthread_mutex_lock(&reference->failure_mutex);
    if (reference->failure == RTC_ERROR_NONE) {
        reference->failure = code;
        snprintf(reference->failure_text, sizeof(reference->failure_text), "%s", text ? text : "");
    }
    pthread_mutex_unlock(&reference->failure_mutex);
}

bool reference_check(struct reference *reference, const char *what, struct error *error)
{
    pthread_mutex_lock(&reference->failure_mutex);
    enum RTCError code = reference->failure;
    reference->failure = RTC_ERROR_NONE;
    pthread_mutex_unlock(&reference->failure_mutex);
    if (code == RTC_ERROR_NONE)
        return true;
    const struct gpu_device *gpu = reference->base.device;
    if (code == RTC_ERROR_OUT_OF_MEMORY && gpu && gpu->memory_limit_bytes > 0)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL,
                         "Embree's structures, %s; %llu of %llu bytes of device memory are in use without them",
                         what, (unsigned long long)(gpu->memory_used_bytes - reference->taken_bytes),
                         (unsigned long long)gpu->memory_limit_bytes);
    enum error_code kind = code == RTC_ERROR_OUT_OF_MEMORY     ? ERROR_OUT_OF_MEMORY
                           : code == RTC_ERROR_UNSUPPORTED_CPU ? ERROR_UNSUPPORTED
                                                               : ERROR_INTERNAL;
    return error_set(error, kind, NULL, "Embree, %s: %s (error %d)", what, reference->failure_text, (int)code);
}

/* Embree's memory counts as the device's, as this tracer has no buffers. Called before (or, with `post`,
 * after) an allocation, on any thread. */
static bool count_memory(void *context, ssize_t bytes, bool post)
{
    struct reference *reference = context;
    long long sum = atomic_fetch_add(&reference->device_bytes, bytes) + bytes;
    if (bytes <= 0 || reference->limit_bytes == 0)
        return true;
    bool fits = sum < 0 || reference->others_bytes + (uint64_t)sum <= reference->limit_bytes;
    if (!fits && !post) /* the allocation will not happen */
        atomic_fetch_sub(&reference->device_bytes, bytes);
    return fits;
}

/* Adjusts the device's account to Embree's current memory. */
static bool book_memory(struct reference *reference, struct error *error)
{
    struct gpu_device *gpu = reference->base.device;
    long long counted = atomic_load(&reference->device_bytes);
    uint64_t bytes = counted > 0 ? (uint64_t)counted : 0;
    reference->base.stats.device_bytes = bytes;
    if (!gpu)
        return true;
    gpu_memory_give(gpu, reference->taken_bytes);
    reference->taken_bytes = 0;
    if (!gpu_memory_take(gpu, bytes, "Embree's structures", error))
        return false;
    reference->taken_bytes = bytes;
    return true;
}

static void join_builder(struct reference *reference);
static void end_waves(struct reference *reference);

/* ---- life ---- */

static unsigned native_width(RTCDevice device)
{
    if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
        return 16;
    return rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8 : 4;
}

/* Checks that this build of Embree has all features needed: distributions leave some out. */
static bool check_features(RTCDevice device, struct error *error)
{
    static const struct {
        enum RTCDeviceProperty property;
        const char *name;
    } needed[] = {
        {RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED, "triangles"},
        {RTC_DEVICE_PROPERTY_POINT_GEOMETRY_SUPPORTED, "spheres and discs"},
        {RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED, "filter functions"},
    };
    for (size_t i = 0; i < sizeof(needed) / sizeof(needed[0]); i++)
        if (!rtcGetDeviceProperty(device, needed[i].property))
            return error_set(error, ERROR_UNSUPPORTED, NULL, "this Embree was built without %s", needed[i].name);
    return true;
}

static void reference_destroy(struct tracer *tracer)
{
    struct reference *reference = (struct reference *)tracer;
    atomic_store(&reference->is_abandoned, true);
    join_builder(reference);
    end_waves(reference);
    reference_scene_finish(reference);
    if (reference->base.device)
        gpu_memory_give(reference->base.device, reference->taken_bytes);
    if (reference->device)
        rtcReleaseDevice(reference->device);
    pthread_mutex_destroy(&reference->failure_mutex);
    free(reference);
}

static struct tracer *reference_create(struct gpu_device *device, const struct tracer_options *options,
                                       struct error *error)
{
    (void)options;
    struct reference *reference = calloc(1, sizeof(*reference));
    if (!reference) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    pthread_mutex_init(&reference->failure_mutex, NULL);
    reference->base.device = device;
    reference->device = rtcNewDevice(NULL);
    if (!reference->device) {
        error_set(error, ERROR_UNSUPPORTED, NULL, "Embree does not start (error %d)",
                  (int)rtcGetDeviceError(NULL));
        reference_destroy(&reference->base);
        return NULL;
    }
    rtcSetDeviceErrorFunction(reference->device, note_failure, reference);
    rtcSetDeviceMemoryMonitorFunction(reference->device, count_memory, reference);
    reference->width = native_width(reference->device);
    if (!check_features(reference->device, error)) {
        reference_destroy(&reference->base);
        return NULL;
    }
    return &reference->base;
}

/* ---- building ---- */

static void build(struct reference *reference)
{
    uint64_t start_ns = clock_now_ns();
    reference_scene_build(reference);
    reference->build_ns = clock_now_ns() - start_ns;
    atomic_store(&reference->is_built, true);
}

static void *run_builder(void *context)
{
    host_thread_lower_priority();
    build(context);
    return NULL;
}

/* Builds in a thread; without one, at once. */
static void begin_build(struct reference *reference)
{
    atomic_store(&reference->is_built, false);
    reference->is_building = pthread_create(&reference->builder, NULL, run_builder, reference) == 0;
    if (!reference->is_building)
        build(reference);
}

/* Ends waves in progress, whose results nobody waits for any more but whose threads read the structure. */
static void end_waves(struct reference *reference)
{
    atomic_store(&reference->ends_waves, true);
    while (atomic_load(&reference->waves_under_way))
        usleep(BUILDER_LOOK_US);
    atomic_store(&reference->ends_waves, false);
}

static void join_builder(struct reference *reference)
{
    if (reference->is_building)
        pthread_join(reference->builder, NULL);
    reference->is_building = false;
}

static void reference_abandon(struct tracer *tracer)
{
    struct reference *reference = (struct reference *)tracer;
    struct error error = {0}; /* error of the dropped work */
    atomic_store(&reference->is_abandoned, true);
    join_builder(reference);
    atomic_store(&reference->is_abandoned, false);
    end_waves(reference);
    reference_scene_finish(reference);
    reference_check(reference, "building", &error);
    book_memory(reference, &error);
}

static bool reference_waits(struct tracer *tracer)
{
    const struct reference *reference = (const struct reference *)tracer;
    return reference->is_building && !atomic_load(&reference->is_built);
}

static enum tracer_progress fail(struct reference *reference)
{
    struct error second = {0}; /* would repeat the first one */
    reference_scene_finish(reference);
    book_memory(reference, &second);
    return TRACER_FAILED;
}

/* Reads the scene on this thread, while Embree builds on another. */
static enum tracer_progress reference_update(struct tracer *tracer, struct gpu_scene *scene,
                                             const struct tracer_update *update, struct error *error)
{
    struct reference *reference = (struct reference *)tracer;
    uint64_t start_ns = clock_now_ns();
    if (!reference->is_building) {
        bool builds = false;
        end_waves(reference);
        const struct gpu_device *gpu = tracer->device;
        reference->others_bytes = gpu ? gpu->memory_used_bytes - reference->taken_bytes : 0;
        reference->limit_bytes = gpu ? gpu->memory_limit_bytes : 0;
        bool read = reference_scene_update(reference, scene, update->changed, &builds, error);
        stage_times_add(update->times, STAGE_BUILD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
        if (!read)
            return fail(reference);
        if (!builds)
            return reference_scene_built(reference, scene, error) && book_memory(reference, error)
                       ? TRACER_DONE
                       : fail(reference);
        start_ns = clock_now_ns();
        begin_build(reference);
    }
    while (reference_waits(tracer) && !step_is_over(tracer->step_end_ns))
        usleep(BUILDER_LOOK_US);
    if (reference_waits(tracer))
        return TRACER_MORE;
    join_builder(reference);
    stage_times_add(update->times, STAGE_BUILD, CLOCK_CPU, 0, clock_now_ns() - reference->build_ns,
                    reference->build_ns);
    bool built = reference_scene_built(reference, scene, error) && book_memory(reference, error);
    return built ? TRACER_DONE : fail(reference);
}

/* ---- the tracer ---- */

const struct tracer_impl tracer_reference_impl = {
    .name = "reference",
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES | CHANGED_DISCS | CHANGED_SHADING,
    .traces_on_host = true,
    .minimum_rays = REFERENCE_RAYS_MAX,
    .create = reference_create,
    .destroy = reference_destroy,
    .update = reference_update,
    .abandon = reference_abandon,
    .waits = reference_waits,
    .state_create = reference_state_create,
    .state_destroy = reference_state_destroy,
    .state_device_bytes = reference_state_device_bytes,
    .trace_begin = reference_trace_begin,
    .trace_range = reference_trace_range,
};
