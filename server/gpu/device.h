/* SPDX-License-Identifier: MIT */
/* A device: EGL without a window system, and one OpenGL 4.5 core context. Everything in gpu/, trace/ and
 * render/ runs on the one thread that made the device current. */
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
    int index;      /* value of --device */
    bool software;  /* no GPU renders, whatever facts.software is */
    char name[128]; /* GL_RENDERER */
    char vendor[64];
    char version[128]; /* GL_VERSION */
    char drm_path[64]; /* "" if unknown */
};

#define GPU_DEVICES_MAX 32 /* devices in a list */
#define GPU_TEXEL_UNITS 32

/* Formats of the buffer textures that frames bind, by unit: GL_RGBA8 .., or 0: four floats or words per texel.
 * A sampler of the other kind of numbers at the unit has four, too. */
struct gpu_texel_formats {
    unsigned of_unit[GPU_TEXEL_UNITS];
};

/* Facts about a device, read once. */
struct gpu_facts {
    /* Whether the numbers below are those for llvmpipe (gpu_facts_choose). False for zink, and for software GL
     * too if the environment has FARLIGHT_LIKE_GPU=1, so that tests on any machine run the way of GPUs. */
    bool software;
    bool robust; /* the context reports its loss */
    bool debug_output;
    bool has_program_binary;
    bool compiles_together;    /* the driver compiles several programs at once, in threads of its own */
    bool compiles_at_dispatch; /* llvmpipe: a compute program is compiled at its dispatch, for the formats that
                                  are bound */
    bool fetches_framebuffer;  /* fragments can read the framebuffer at their place:
                                  GL_EXT_shader_framebuffer_fetch */
    uint32_t time_stamp_bits;  /* 0: the device cannot measure its time */
    uint64_t texture_buffer_texels_max;
    uint64_t storage_block_bytes_max;
    uint32_t work_groups_max;  /* along x; more is a GL error */
    uint32_t texture_size_max; /* texels along an edge of a 2D texture */
    uint32_t texture_layers_max;
    /* Numbers by which passes choose sizes, see gpu_facts_choose. */
    uint32_t step_scale;     /* factor of a step's items over those that suit two cores with software GL */
    uint32_t slice_rays_max; /* maximum for a slice of a picture */
    /* Rays of a wave that are traced before the host reads the clock; UINT32_MAX: it cannot, as a dispatch
     * returns before it is complete. */
    uint32_t range_rays_first;
    uint64_t dispatch_rounds_max; /* maximum of rounds of rays' loops in a dispatch, beyond which the driver
                                     ends it; 0: no limit */
    uint32_t packet_rays;         /* size of a packet in bvh where packets pay; 1: they never do */
    uint32_t band_slots_max;      /* samples in a band of a picture, which one step turns into pixels */
    uint32_t ray_tests_max;       /* maximum of elements or primitives per ray and dispatch */
    uint32_t primitives_max;      /* maximum for naive, which tests all of them with every ray; 0: no limit */
    uint64_t list_tests_max;      /* maximum of a dispatch: rays times lights or discs, which no structure holds */
    uint64_t axes_samples_max;    /* maximum in a structure of samples along axes: ldc, abuffer */
    bool shares_memory;           /* buffers are mapped memory of the host, which writes them in place */
    uint64_t limits[GPU_LIMIT_COUNT];
    struct gpu_memory memory;
};

/* Buffer whose ranges hold the uniforms of passes; private to uniforms.c. */
struct gpu_uniform_ring {
    unsigned name;
    uint32_t alignment_bytes; /* alignment of a range */
    uint32_t end_bytes;       /* end of the last range */
    uint32_t turn;            /* number of exchanges for fresh memory */
};

/* Accesses, GL_*_BARRIER_BITs, that cannot yet see the output of shaders; private to barrier.c. */
struct gpu_unseen {
    unsigned before, together; /* output of passes that the next one waits for, and of those that it does not */
    bool are_together;
};

#define GPU_EMPTY_BUFFER_BYTES 768 /* a capacity that looks like those of other buffers: see buffer.c */

struct gpu_device {
    struct gpu_device_info info;
    struct gpu_facts facts;
    struct gpu_egl *egl;                           /* private to device.c */
    struct gpu_registry *registry;                 /* every living GL object, see registry.h */
    struct gpu_program_cache *programs;            /* private to program.c */
    struct gpu_binary_cache *binaries;             /* cache on the disk; NULL: no binary is kept */
    struct gpu_ahead *ahead;                       /* compiles programs before their first use */
    bool announces;                                /* see gpu_program_announce */
    const struct gpu_texel_formats *texel_formats; /* NULL: no program was announced */
    unsigned empty_buffer;                         /* zeros, bound in place of an empty buffer */
    struct gpu_uniform_ring uniform_ring;
    struct gpu_unseen unseen;
    const char *misused_uniform; /* name of one that was set with another type; NULL: none */
    uint64_t memory_used_bytes;  /* counted by gpu_memory_take: buffers, textures, Embree */
    uint64_t memory_limit_bytes; /* 0: no limit; facts.memory.bytes at first */
    uint64_t reserve_until_ns;   /* see gpu_reserve_begin; 0: no deadline */
    bool reserve_made, reserve_put_off;
    uint64_t waits;                /* number of times that this thread has waited for the device */
    uint64_t dispatches, barriers; /* number queued so far */
    struct gpu_watch *watch;       /* measures dispatches, see watch.h; NULL: none are measured */
    bool compiles;                 /* see gpu_options */
    struct gpu_measured measured;
    bool lost; /* the context is lost and nothing works any more, see gpu_note_loss */
};

/* Chooses numbers and ways of passes for software GL on two cores, or for a GPU. On a GPU a SIMD group already
 * traverses together, and several rays per invocation cost registers. */
void gpu_facts_choose(struct gpu_facts *facts, bool software);

struct gpu_options {
    int index;     /* index in gpu_device_list; -1: hardware, else software */
    bool software; /* insist on software */
    bool debug;    /* debug context, messages to the log */
    /* Processes that use each device, by index: among hardware, the least used is chosen. */
    uint16_t used_by[GPU_DEVICES_MAX];
    /* Measurements of this device by an earlier context; not known: the disk's are used. */
    struct gpu_measured measured;
    bool compiles;           /* compiles every program, though all are still written to the disk */
    uint64_t binaries_bytes; /* maximum of bytes for programs on the disk; 0: no limit */
};

/* Lists devices with an OpenGL 4.5 core context; each is opened briefly to read its name. Returns the number,
 * at most `max`. */
size_t gpu_device_list(struct gpu_device_info *list, size_t max);
/* Makes a context and makes it current on this thread, with an empty vertex array bound (a pass that fetches
 * its own vertices can draw at once). NULL and *error on failure. */
struct gpu_device *gpu_device_create(const struct gpu_options *options, struct error *error);
void gpu_device_destroy(struct gpu_device *device); /* accepts NULL; on the same thread */
/* Number of living GL objects, without programs: each stays once it was needed. */
size_t gpu_device_objects(const struct gpu_device *device);
/* Returns ERROR_INTERNAL for a GL error (a bounded number is read), ERROR_DEVICE_LOST if the context is known
 * to be lost or the error says so, else true. `what` names the caller. Cheap enough for once a pass. */
bool gpu_check(struct gpu_device *device, const char *what, struct error *error);
/* Checks as gpu_check() does, and asks the driver whether the context was lost, which may involve the kernel:
 * once for each slice and each step of building, and before data read from the device is sent. */
bool gpu_check_reset(struct gpu_device *device, const char *what, struct error *error);
/* Sets ERROR_DEVICE_LOST if another failure than gpu_check()'s is due to a loss, else nothing, so that the
 * caller sets its own error afterwards (the first one stands). Unread GL errors are dropped. */
void gpu_note_loss(struct gpu_device *device, struct error *error);

/* The device that is current on this thread, NULL: none. */
struct gpu_device *gpu_device_current(void);
/* Counts memory before the driver allocates it: ERROR_OUT_OF_MEMORY if the limit would be exceeded. */
bool gpu_memory_take(struct gpu_device *device, uint64_t size_bytes, const char *what, struct error *error);
void gpu_memory_give(struct gpu_device *device, uint64_t size_bytes);

/* Begins to limit the time of reservations: software GL clears new memory at once, which takes a second or more
 * per gigabyte. Until gpu_reserve_end(), reservations beyond `time_ns` are postponed: they fail with
 * ERROR_BUSY, and the caller repeats them all later; those that were made stay. The first reservation after
 * each gpu_reserve_begin() is always made. */
void gpu_reserve_begin(struct gpu_device *device, uint64_t time_ns);
/* Whether a reservation was postponed. */
bool gpu_reserve_end(struct gpu_device *device);
/* Called before a reservation on the device or the host, or other work of milliseconds for it. False:
 * postponed. */
bool gpu_reserve_in_time(struct gpu_device *device, struct error *error);
/* Takes memory of the device, unless that is postponed or too little is left. */
bool gpu_reserve_memory(struct gpu_device *device, size_t bytes, const char *what, struct error *error);

/* Waits until the device is idle. */
void gpu_finish(struct gpu_device *device);

/* Begins a GL debug group for the scope of a pass; driver messages and frame debuggers show its name. */
void gpu_push_group(struct gpu_device *device, const char *name);
void gpu_pop_group(struct gpu_device *device);

#endif
