/* SPDX-License-Identifier: MIT */
/* EGL displays without a window system. */
#ifndef FARLIGHT_GPU_EGL_H
#define FARLIGHT_GPU_EGL_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define GPU_EGL_PLACES_MAX 32

/* A source of displays. */
struct gpu_egl_place {
    int index;     /* in the order of EGL; stable while the machine's devices stay */
    void *device;  /* EGLDeviceEXT; NULL: Mesa's surfaceless platform */
    bool software; /* according to the driver; unknown for the surfaceless platform */
    char drm_path[64];
};

struct gpu_egl {
    void *display; /* EGLDisplay */
    void *context; /* EGLContext */
    bool robust;
};

size_t gpu_egl_places(struct gpu_egl_place *places, size_t max);
/* Sorts places by how many processes use the device of each index, the least used first; equals stay in order. */
void gpu_egl_sort_by_use(struct gpu_egl_place *places, size_t count, const uint16_t used_by[GPU_EGL_PLACES_MAX]);
/* Opens a display, makes an OpenGL 4.5 core context and makes it current. On failure nothing stays open. */
bool gpu_egl_open(struct gpu_egl *egl, const struct gpu_egl_place *place, bool debug, struct error *error);
/* Makes another context on the same display and makes it current on the calling thread. It shares no objects. The
 * same thread closes it, before the display is closed. */
bool gpu_egl_open_beside(struct gpu_egl *beside, const struct gpu_egl *egl);
void gpu_egl_close_beside(struct gpu_egl *beside);
/* Closes both context and display. */
void gpu_egl_close(struct gpu_egl *egl);

#endif
