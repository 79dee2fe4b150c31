/* SPDX-License-Identifier: MIT */
/* EGL without a window system, and one OpenGL 4.5 core context. Everything in gpu/, trace/ and render/
 * runs on the one thread that made the device current. */
#ifndef FARLIGHT_GPU_DEVICE_H
#define FARLIGHT_GPU_DEVICE_H

#include "base/error.h"
#include "gpu/limits.h"
#include "gpu/measured.h"
#include "gpu/memory.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct gpu_device_info {
    int index;      /* what --device takes */
    bool software;  /* no GPU renders, whatever facts.software is */
    char name[128]; /* GL_RENDERER */
    char vendor[64];
    char version[128]; /* GL_VERSION */
    char drm_path[64]; /* "" if the driver tells none */
};

#define GPU_DEVICES_MAX 32 /* that are told apart */
#define GPU_TEXEL_UNITS 32

/* Of the buffer textures that frames bind to units, by unit: GL_RGBA8 .., or 0: four floats or words a texel. A
 * sampler of the other kind of numbers at the unit has these four, too. */
struct gpu_texel_formats {
    unsigned of_unit[GPU_TEXEL_UNITS];
};

/* Facts asked once. */
struct gpu_facts {
    /* The numbers below are those of llvmpipe (gpu_facts_choose). False for software GL as well where the
     * environment has FARLIGHT_LIKE_GPU=1, so that tests try what GPUs do on any machine, and for zink. */
    bool software;
    bool robust; /* context tells of its loss */
    bool debug_output;
    bool has_program_binary;
    bool compiles_together;    /* the driver compiles several programs at a time, in threads of its own */
    bool compiles_at_dispatch; /* llvmpipe: a compute program, and for the formats of what is bound */
    bool fetches_framebuffer;  /* fragments read what is in their place: GL_EXT_shader_framebuffer_fetch */
    uint32_t time_stamp_bits;  /* 0: the device does not measure its time */
    uint64_t texture_buffer_texels_max;
    uint64_t storage_block_bytes_max;
    uint32_t work_groups_max;  /* on x; more is a GL error */
    uint32_t texture_size_max; /* texels along an edge of a 2D texture */
    uint32_t texture_layers_max;
    /* Numbers by which passes choose sizes, see gpu_facts_choose. */
    uint32_t step_scale; /* a step of a pass has so many times the items that suit two cores with software GL */
    uint32_t slice_rays_max; /* of a slice of a picture */
    /* Rays of a wave that are traced before the host looks at the clock; UINT32_MAX: it cannot, because a dispatch
     * returns before it is done. */
    uint32_t range_rays_first;
    uint64_t dispatch_rounds_max; /* rounds of rays' loops in a dispatch, or the driver ends it; 0: no limit */
    uint32_t packet_rays;         /* of a packet that bvh traverses where packets pay; 1: they never do */
    uint32_t band_slots_max; /* samples' places in a band of a picture, which is turned into pixels in one step */
    uint32_t ray_tests_max;  /* elements or primitives that a ray may have of a dispatch */
    uint32_t primitives_max; /* that naive tests every ray with; 0: no limit */
    uint64_t axes_samples_max; /* of a structure of samples along axes: ldc, abuffer */
    bool shares_memory;        /* buffers are mapped memory of the host: it writes to them in place */
    uint64_t limits[GPU_LIMIT_COUNT];
    struct gpu_memory memory;
};

/* Ranges of a buffer that passes have their uniforms in; private to uniforms.c. */
struct gpu_uniform_ring {
    unsigned name;
    uint32_t alignment_bytes; /* of a range */
    uint32_t end_bytes;       /* of the last range */
    uint32_t turn;            /* how often its memory was exchanged for fresh memory */
};

/* Ways in which what shaders wrote cannot be accessed yet, GL_*_BARRIER_BITs; private to barrier.c. */
struct gpu_unseen {
    unsigned before, together; /* by passes that the next one waits for, and that it does not */
    bool are_together;
};

#define GPU_EMPTY_BUFFER_BYTES 768 /* a capacity like those of buffers: see buffer.c */

struct gpu_device {
    struct gpu_device_info info;
    struct gpu_facts facts;
    struct gpu_egl *egl;                           /* private to device.c */
    struct gpu_registry *registry;                 /* every GL object that lives, see registry.h */
    struct gpu_program_cache *programs;            /* private to program.c */
    struct gpu_binary_cache *binaries;             /* on the disk; NULL: none are kept */
    struct gpu_ahead *ahead;                       /* compiles programs before their first use */
    bool announces;                                /* see gpu_program_announce */
    const struct gpu_texel_formats *texel_formats; /* NULL: nothing was announced */
    unsigned empty_buffer;                         /* zeros, bound in place of an empty buffer */
    struct gpu_uniform_ring uniform_ring;
    struct gpu_unseen unseen;
    const char *misused_uniform; /* one that was given a value of another type; NULL: none */
    uint64_t memory_used_bytes;  /* counted by gpu_memory_take: buffers, textures, Embree */
    uint64_t memory_limit_bytes; /* 0: none; facts.memory.bytes at first */
    uint64_t reserve_until_ns;   /* see gpu_reserve_begin; 0: whenever */
    bool reserve_made, reserve_put_off;
    uint64_t waits; /* how often this thread has waited for the device to come to an end with something */
    uint64_t dispatches, barriers; /* that it has queued */
    struct gpu_watch *watch;       /* of dispatches; NULL: none is watched, see watch.h */
    bool compiles;                 /* see gpu_options */
    struct gpu_measured measured;
    bool lost; /* the context; nothing works any more, see gpu_note_loss */
};

/* Numbers and ways by which passes suit software GL on two cores, or a GPU. On the latter a SIMD group traverses
 * together already, and several rays an invocation cost registers. */
void gpu_facts_choose(struct gpu_facts *facts, bool software);

struct gpu_options {
    int index;     /* of gpu_device_list; -1: hardware, else software */
    bool software; /* insist on software */
    bool debug;    /* debug context, messages to the log */
    uint16_t
        used_by[GPU_DEVICES_MAX]; /* processes that use each device, by index: among hardware, the least used */
    struct gpu_measured measured; /* of this device by an earlier context; not known: of the disk */
    bool compiles;           /* no program is taken from the disk, where all that are compiled go nevertheless */
    uint64_t binaries_bytes; /* the most that programs may take on the disk; 0: no limit */
};

/* Devices that give an OpenGL 4.5 core context; each is opened for a moment to be asked its name.
 * Returns the number, at most `max`. */
size_t gpu_device_list(struct gpu_device_info *list, size_t max);
/* Makes a context and makes it current on this thread, with an empty vertex array bound (a pass that pulls its
 * vertices draws at once). NULL and *error on failure. */
struct gpu_device *gpu_device_create(const struct gpu_options *options, struct error *error);
void gpu_device_destroy(struct gpu_device *device); /* accepts NULL; on the same thread */
/* How many GL objects live in it, programs aside: each stays once it was needed. */
size_t gpu_device_objects(const struct gpu_device *device);
/* ERROR_INTERNAL with the GL error if there is one (a bounded number is read), ERROR_DEVICE_LOST if the context is
 * known to be lost or the error says so, else true. `what` names the caller. Cheap enough for once a pass. */
bool gpu_check(struct gpu_device *device, const char *what, struct error *error);
/* The same after the driver was asked whether the context was lost, which may go as far as the kernel: once for
 * each slice and each step of building, and before what was read from the device goes out. */
bool gpu_check_reset(struct gpu_device *device, const char *what, struct error *error);
/* For where something else failed than gpu_check: sets ERROR_DEVICE_LOST if that is why, else nothing, so that the
 * caller sets its own error behind it (the first one stands). GL errors that were not read yet are gone. */
void gpu_note_loss(struct gpu_device *device, struct error *error);

/* The device that is current on this thread, NULL: none. */
struct gpu_device *gpu_device_current(void);
/* Counts memory before it is asked of the driver: ERROR_OUT_OF_MEMORY if the limit would be passed. */
bool gpu_memory_take(struct gpu_device *device, uint64_t size_bytes, const char *what, struct error *error);
void gpu_memory_give(struct gpu_device *device, uint64_t size_bytes);

/* Software GL clears new memory at once, which takes a second a gigabyte and more. From here to gpu_reserve_end(),
 * reservations beyond `time_ns` are put off: they fail with ERROR_BUSY, and the caller comes again with the same
 * ones, of which those that were made stay. The first reservation after each gpu_reserve_begin() is made in any
 * case. */
void gpu_reserve_begin(struct gpu_device *device, uint64_t time_ns);
/* Whether anything was put off. */
bool gpu_reserve_end(struct gpu_device *device);
/* Before a reservation on the device or of the host, or other work of milliseconds for it. False: it is put off.
 */
bool gpu_reserve_goes_on(struct gpu_device *device, struct error *error);
/* The same for memory of the device, which is taken, unless it is put off or there is too little. */
bool gpu_reserve_memory(struct gpu_device *device, size_t bytes, const char *what, struct error *error);

/* Waits until the device has nothing to do. */
void gpu_finish(struct gpu_device *device);

/* GL debug group for the scope of a pass; shows in driver messages and frame debuggers. */
void gpu_push_group(struct gpu_device *device, const char *name);
void gpu_pop_group(struct gpu_device *device);

#endif
