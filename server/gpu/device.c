/* SPDX-License-Identifier: MIT */
/* Creation of a device: its place, facts and defaults; loss, and reservations of memory. */
#include "gpu/device.h"

#include "base/clock.h"
#include "base/log.h"
#include "gpu/binary_cache.h"
#include "gpu/debug.h"
#include "gpu/egl.h"
#include "gpu/program_ahead.h"
#include "gpu/program_cache.h"
#include "gpu/registry.h"
#include "gpu/uniforms.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Maximum of errors read: glGetError keeps one flag for each of a few kinds, and may report one for ever after
 * a loss. */
#define GL_ERRORS_READ_MAX 8

static _Thread_local struct gpu_device *current_device;

struct gpu_device *gpu_device_current(void)
{
    return current_device;
}

static void missing_function(void)
{
}

/* Handles a function that the driver lacks with an error message; epoxy's own handler ends the process. */
static void (*on_missing_function(const char *name))(void)
{
    log_write(LOG_ERROR, "gpu", "the driver has no %s", name);
    return missing_function;
}

static void copy_string(char *to, size_t size, GLenum name)
{
    const GLubyte *text = glGetString(name);
    snprintf(to, size, "%s", text ? (const char *)text : "");
}

static bool sounds_like_software(const char *renderer)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "swrast", "SWR"};
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++)
        if (strstr(renderer, names[i]))
            return true;
    return false;
}

/* Whether the current context renders in software. */
static bool renders_in_software(void)
{
    const GLubyte *renderer = glGetString(GL_RENDERER);
    return renderer && sounds_like_software((const char *)renderer);
}

/* Reads the names of the current context's driver. */
static void ask_info(struct gpu_device_info *info, const struct gpu_egl_place *place)
{
    *info = (struct gpu_device_info){.index = place->index};
    copy_string(info->name, sizeof(info->name), GL_RENDERER);
    copy_string(info->vendor, sizeof(info->vendor), GL_VENDOR);
    copy_string(info->version, sizeof(info->version), GL_VERSION);
    memcpy(info->drm_path, place->drm_path, sizeof(info->drm_path));
    info->software = place->software || sounds_like_software(info->name);
}

/* Whether software GL's sizes are chosen. Zink queues its work as GPUs do, on lavapipe too. FARLIGHT_LIKE_GPU=1
 * is for tests on machines without a GPU. */
static bool chooses_as_software(const struct gpu_device_info *info)
{
    const char *like_gpu = getenv("FARLIGHT_LIKE_GPU");
    return info->software && strncmp(info->name, "zink", 4) != 0 && !(like_gpu && strcmp(like_gpu, "1") == 0);
}

static uint64_t get_integer(GLenum name)
{
    GLint64 value = 0;
    glGetInteger64v(name, &value);
    return value < 0 ? 0 : (uint64_t)value;
}

void gpu_facts_choose(struct gpu_facts *facts, bool software)
{
    facts->software = facts->shares_memory = software;
    facts->step_scale = software ? 1 : 64;
    /* Software GL has no latency to hide, and its caches are the processor's; a GPU needs enough rays to fill it.
     */
    facts->slice_rays_max = software ? 1u << 16 : 1u << 20;
    facts->range_rays_first = software ? 4096 : UINT32_MAX;
    /* The limit is seconds of a slow GPU if every ray took all of its rounds, though a thousandth is usual. No
     * driver limits the time of a processor. */
    facts->dispatch_rounds_max = software ? 0 : (uint64_t)1 << 35;
    facts->packet_rays = software ? 8 : 1;
    /* Software GL takes some ten milliseconds for this many. A GPU's storage block holds at least twice its
     * number. */
    facts->band_slots_max = software ? 1u << 18 : 1u << 22;
    /* A ray of a large scene needs some hundred tests; with this many it finishes in one dispatch, unless the
     * scene is built to prevent it. Software GL leaves a loop after 65535 rounds. */
    facts->ray_tests_max = software ? 65000 : 1u << 16;
    /* With more primitives, a step of the smallest range of rays would take software GL longer than a cancel
     * may. */
    facts->primitives_max = software ? 65000 : 0;
    /* Software GL takes about 80 ms for as many lights, a slow GPU as long. */
    facts->list_tests_max = software ? 1u << 25 : (uint64_t)1 << 31;
    facts->axes_samples_max = (software ? 1 : 8) * (4ull * 3 * 1024 * 1024);
}

static void ask_facts(struct gpu_facts *facts, const struct gpu_device_info *info, bool robust, bool debug)
{
    GLint groups = 0, time_stamp_bits = 0;
    glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &time_stamp_bits);
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &groups);
    const char *renderer = (const char *)glGetString(GL_RENDERER);
    const bool compiles_at_dispatch = renderer && strncmp(renderer, "llvmpipe", 8) == 0;
    *facts = (struct gpu_facts){
        .robust = robust,
        .debug_output = debug,
        .has_program_binary = get_integer(GL_NUM_PROGRAM_BINARY_FORMATS) > 0,
        .compiles_together = !compiles_at_dispatch && epoxy_has_gl_extension("GL_KHR_parallel_shader_compile"),
        .compiles_at_dispatch = compiles_at_dispatch,
        .fetches_framebuffer = epoxy_has_gl_extension("GL_EXT_shader_framebuffer_fetch"),
        .time_stamp_bits = (uint32_t)time_stamp_bits,
        .storage_block_bytes_max = get_integer(GL_MAX_SHADER_STORAGE_BLOCK_SIZE),
        .work_groups_max = groups > 0 ? (uint32_t)groups : 65535,
    };
    gpu_facts_choose(facts, chooses_as_software(info));
    gpu_limits_ask(facts->limits);
    facts->texture_buffer_texels_max = facts->limits[GPU_MAX_TEXTURE_BUFFER_SIZE];
    facts->texture_size_max = (uint32_t)facts->limits[GPU_MAX_TEXTURE_SIZE];
    facts->texture_layers_max = (uint32_t)facts->limits[GPU_MAX_ARRAY_TEXTURE_LAYERS];
    const struct gpu_memory_answers answers = gpu_memory_ask(info->software);
    facts->memory = gpu_memory_from(&answers);
}

size_t gpu_device_list(struct gpu_device_info *list, size_t max)
{
    struct gpu_egl_place places[GPU_EGL_PLACES_MAX];
    size_t place_count = gpu_egl_places(places, GPU_EGL_PLACES_MAX);
    size_t count = 0;
    epoxy_set_resolver_failure_handler(on_missing_function);
    for (size_t i = 0; i < place_count && count < max; i++) {
        struct gpu_egl egl;
        if (!gpu_egl_open(&egl, &places[i], false, NULL))
            continue;
        ask_info(&list[count++], &places[i]);
        gpu_egl_close(&egl);
    }
    return count;
}

/* Opens the first place that fits the options: the named one, or else hardware before software, and among several
 * the least used. */
static bool open_place(struct gpu_egl *egl, struct gpu_egl_place *chosen, const struct gpu_options *options,
                       bool debug, struct error *error)
{
    struct gpu_egl_place places[GPU_EGL_PLACES_MAX];
    size_t count = gpu_egl_places(places, GPU_EGL_PLACES_MAX);
    struct error last = {0};
    _Static_assert(GPU_DEVICES_MAX == GPU_EGL_PLACES_MAX, "each place has a count");
    gpu_egl_sort_by_use(places, count, options->used_by);
    bool by_index = options->index >= 0 && !options->software;
    for (int software = by_index ? 0 : options->software; software < 2; software++) {
        for (size_t i = 0; i < count; i++) {
            bool fits = by_index ? places[i].index == options->index : places[i].software == software;
            /* Mesa's surfaceless platform has an unknown renderer until it is open, so it is tried last. */
            if (!by_index && !places[i].device)
                fits = software == 1;
            if (!fits)
                continue;
            last = (struct error){0};
            if (!gpu_egl_open(egl, &places[i], debug, &last)) {
                log_write(LOG_DEBUG, "gpu", "%s", last.text);
                continue;
            }
            *chosen = places[i];
            if (by_index || software || !renders_in_software())
                return true;
            /* Mesa lists devices that it cannot drive, such as those of another driver. */
            places[i].software = true;
            gpu_egl_close(egl);
        }
    }
    if (last.kind != ERROR_NONE)
        error_set(error, last.kind, "device", "%s", last.text);
    else if (by_index)
        error_set(error, ERROR_UNSUPPORTED, "device", "device %d does not exist; EGL lists %zu", options->index,
                  count);
    else
        error_set(error, ERROR_UNSUPPORTED, "device", "EGL knows no %sdevice",
                  options->software ? "software " : "");
    return error_remedy(error, "farlightd --list-devices lists the devices; Mesa's software renderer is in the "
                               "packages libegl-mesa0 and libgl1-mesa-dri");
}

/* Sets the state that every pass may rely on. */
static bool create_defaults(struct gpu_device *device, struct error *error)
{
    static const unsigned char zeros[GPU_EMPTY_BUFFER_BYTES];
    unsigned vertex_array = gpu_object_create(device->registry, GPU_VERTEX_ARRAY);
    device->empty_buffer = gpu_object_create(device->registry, GPU_BUFFER);
    if (!vertex_array || !device->empty_buffer || !gpu_uniforms_start(device))
        return error_set(error, ERROR_OUT_OF_MEMORY, "device", "no memory for the first objects");
    glBindVertexArray(vertex_array);
    glNamedBufferStorage(device->empty_buffer, sizeof(zeros), zeros, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    return gpu_check_reset(device, "gpu_device_create", error);
}

struct gpu_device *gpu_device_create(const struct gpu_options *options, struct error *error)
{
#ifdef FARLIGHT_DEBUG
    bool debug = true;
#else
    bool debug = options->debug;
#endif
    struct gpu_egl_place place;
    epoxy_set_resolver_failure_handler(on_missing_function);
    struct gpu_device *device = calloc(1, sizeof(*device));
    if (device)
        device->egl = calloc(1, sizeof(*device->egl));
    if (!device || !device->egl) {
        error_set(error, ERROR_OUT_OF_MEMORY, "device", "no memory for a device");
        goto fail;
    }
    if (!open_place(device->egl, &place, options, debug, error))
        goto fail;
    current_device = device;
    device->registry = gpu_registry_create();
    device->programs = gpu_program_cache_create();
    if (!device->registry || !device->programs) {
        error_set(error, ERROR_OUT_OF_MEMORY, "device", "no memory for a device");
        goto fail;
    }
    ask_info(&device->info, &place);
    if (options->software && !device->info.software) {
        error_set(error, ERROR_UNSUPPORTED, "device", "no software device was found, only %s", device->info.name);
        goto fail;
    }
    ask_facts(&device->facts, &device->info, device->egl->robust, debug);
    if (device->facts.has_program_binary)
        device->binaries = gpu_binary_cache_open(options->binaries_bytes);
    device->ahead = gpu_ahead_create(device);
    if (!device->ahead) {
        error_set(error, ERROR_OUT_OF_MEMORY, "device", "no memory for a device");
        goto fail;
    }
    device->memory_limit_bytes = device->facts.memory.bytes;
    device->compiles = options->compiles;
    device->measured = options->measured;
    if (!device->measured.known)
        gpu_measured_load(&device->info, &device->measured);
    if (debug)
        gpu_debug_start();
    if (!gpu_limits_check(device->facts.limits, error) || !create_defaults(device, error))
        goto fail;
    return device;
fail:
    gpu_device_destroy(device);
    return NULL;
}

void gpu_device_destroy(struct gpu_device *device)
{
    if (!device)
        return;
    gpu_ahead_destroy(device->ahead);
    gpu_binary_cache_close(device->binaries);
    if (device->registry)
        gpu_registry_destroy_all(device->registry);
    gpu_program_cache_destroy(device->programs);
    gpu_registry_destroy(device->registry);
    if (device->egl)
        gpu_egl_close(device->egl);
    free(device->egl);
    if (current_device == device)
        current_device = NULL;
    free(device);
}

size_t gpu_device_objects(const struct gpu_device *device)
{
    size_t count = 0;
    for (int kind = 0; device->registry && kind < GPU_OBJECT_KIND_COUNT; kind++)
        count += kind == GPU_PROGRAM ? 0 : gpu_registry_count(device->registry, (enum gpu_object_kind)kind);
    return count;
}

static const char *gl_error_name(GLenum code)
{
    switch (code) {
    case GL_INVALID_ENUM:
        return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
        return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
        return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
        return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
        return "GL_OUT_OF_MEMORY";
    default:
        return "an unknown error";
    }
}

/* Whether a reset was reported. A driver reports it only until it is over, while the context stays lost. */
static bool was_reset(struct gpu_device *device)
{
    device->lost = device->lost || (device->facts.robust && glGetGraphicsResetStatus() != GL_NO_ERROR);
    return device->lost;
}

void gpu_note_loss(struct gpu_device *device, struct error *error)
{
    for (int i = 0; !was_reset(device) && i < GL_ERRORS_READ_MAX; i++) {
        GLenum code = glGetError();
        if (code == GL_NO_ERROR)
            return;
        device->lost = code == GL_CONTEXT_LOST;
    }
    if (device->lost)
        error_set(error, ERROR_DEVICE_LOST, NULL, "the GL context was lost");
}

bool gpu_check(struct gpu_device *device, const char *what, struct error *error)
{
    if (device->lost)
        return error_set(error, ERROR_DEVICE_LOST, NULL, "%s: the GL context was lost", what);
    const char *misused = device->misused_uniform;
    device->misused_uniform = NULL;
    if (misused)
        return error_set(error, ERROR_INTERNAL, NULL, "%s: the uniform \"%s\" is of another type", what, misused);
    GLenum first = glGetError();
    if (first == GL_NO_ERROR)
        return true;
    GLenum next = first;
    for (int i = 1; i < GL_ERRORS_READ_MAX && next != GL_NO_ERROR; i++)
        next = glGetError();
    device->lost = first == GL_CONTEXT_LOST;
    if (device->lost)
        return error_set(error, ERROR_DEVICE_LOST, NULL, "%s: the GL context was lost", what);
    enum error_code kind = first == GL_OUT_OF_MEMORY ? ERROR_OUT_OF_MEMORY : ERROR_INTERNAL;
    return error_set(error, kind, NULL, "%s: %s (0x%04x)", what, gl_error_name(first), first);
}

bool gpu_check_reset(struct gpu_device *device, const char *what, struct error *error)
{
    (void)was_reset(device);
    return gpu_check(device, what, error);
}

void gpu_finish(struct gpu_device *device)
{
    device->waits++;
    glFinish();
}

bool gpu_memory_take(struct gpu_device *device, uint64_t size_bytes, const char *what, struct error *error)
{
    uint64_t limit = device->memory_limit_bytes;
    if (limit && (device->memory_used_bytes > limit || size_bytes > limit - device->memory_used_bytes))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "%s of %llu bytes; %llu of %llu bytes are in use", what,
                         (unsigned long long)size_bytes, (unsigned long long)device->memory_used_bytes,
                         (unsigned long long)limit);
    device->memory_used_bytes += size_bytes;
    return true;
}

void gpu_reserve_begin(struct gpu_device *device, uint64_t time_ns)
{
    device->reserve_until_ns = clock_now_ns() + time_ns;
    device->reserve_made = device->reserve_put_off = false;
}

bool gpu_reserve_end(struct gpu_device *device)
{
    bool put_off = device->reserve_put_off;
    device->reserve_until_ns = 0;
    device->reserve_put_off = false;
    return put_off;
}

bool gpu_reserve_in_time(struct gpu_device *device, struct error *error)
{
    if (!device->reserve_until_ns)
        return true;
    if (device->reserve_made && clock_now_ns() >= device->reserve_until_ns)
        device->reserve_put_off = true;
    device->reserve_made = true;
    return !device->reserve_put_off || error_set(error, ERROR_BUSY, NULL, "memory is reserved in steps");
}

bool gpu_reserve_memory(struct gpu_device *device, size_t bytes, const char *what, struct error *error)
{
    if (!gpu_memory_take(device, bytes, what, error))
        return false;
    if (gpu_reserve_in_time(device, error))
        return true;
    gpu_memory_give(device, bytes);
    return false;
}

void gpu_memory_give(struct gpu_device *device, uint64_t size_bytes)
{
    device->memory_used_bytes -= size_bytes <= device->memory_used_bytes ? size_bytes : device->memory_used_bytes;
}
