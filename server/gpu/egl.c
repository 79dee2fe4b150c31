/* SPDX-License-Identifier: MIT */
/* EGL: devices, displays and contexts. */
#include "gpu/egl.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <link.h>
#include <stdio.h>
#include <string.h>

/* Keeps the driver loaded: Mesa's maps 10 MiB for code once it is used, and leaves them when it is unloaded.
 * Leak reports also recognise a driver by its name, which only a loaded one has. */
static int pin_driver(struct dl_phdr_info *info, size_t size, void *data)
{
    (void)size, (void)data;
    if (strstr(info->dlpi_name, "_dri.so"))
        (void)dlopen(info->dlpi_name, RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE);
    return 0;
}

/* Whether the list has the whole word: one extension's name may be the start of another's. */
static bool has_word(const char *words, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = words; at && (at = strstr(at, word)); at += length) {
        bool starts = at == words || at[-1] == ' ';
        if (starts && (at[length] == ' ' || at[length] == '\0'))
            return true;
    }
    return false;
}

static const char *client_extensions(void)
{
    const char *extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!extensions)
        (void)eglGetError();
    return extensions ? extensions : "";
}

static void describe_device(struct gpu_egl_place *place, EGLDeviceEXT device)
{
    const char *extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    place->device = device;
    place->software = has_word(extensions, "EGL_MESA_device_software");
    if (has_word(extensions, "EGL_EXT_device_drm")) {
        const char *path = eglQueryDeviceStringEXT(device, EGL_DRM_DEVICE_FILE_EXT);
        snprintf(place->drm_path, sizeof(place->drm_path), "%s", path ? path : "");
    }
}

size_t gpu_egl_places(struct gpu_egl_place *places, size_t max)
{
    const char *extensions = client_extensions();
    size_t count = 0;
    bool any_software = false;
    if (has_word(extensions, "EGL_EXT_platform_device") &&
        (has_word(extensions, "EGL_EXT_device_enumeration") || has_word(extensions, "EGL_EXT_device_base"))) {
        EGLDeviceEXT devices[GPU_EGL_PLACES_MAX];
        EGLint device_count = 0;
        if (!eglQueryDevicesEXT(GPU_EGL_PLACES_MAX, devices, &device_count))
            device_count = 0;
        for (EGLint i = 0; i < device_count && count < max; i++) {
            places[count] = (struct gpu_egl_place){.index = i};
            describe_device(&places[count], devices[i]);
            any_software |= places[count++].software;
        }
    }
    /* The surfaceless platform would only list Mesa's software renderer a second time. */
    if (!any_software && count < max && has_word(extensions, "EGL_MESA_platform_surfaceless"))
        places[count] = (struct gpu_egl_place){.index = (int)count}, count++;
    return count;
}

static EGLDisplay open_display(const struct gpu_egl_place *place)
{
    if (!place->device)
        return eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    return eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, place->device, NULL);
}

static EGLConfig choose_config(EGLDisplay display)
{
    static const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                    EGL_NONE};
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint count = 0;
    if (!eglChooseConfig(display, wanted, &config, 1, &count) || count == 0)
        return EGL_NO_CONFIG_KHR;
    return config;
}

static EGLContext create_context(EGLDisplay display, EGLConfig config, bool robust, bool debug)
{
    EGLint attributes[16] = {EGL_CONTEXT_MAJOR_VERSION,       4,
                             EGL_CONTEXT_MINOR_VERSION,       5,
                             EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
    size_t n = 6;
    if (debug) {
        attributes[n++] = EGL_CONTEXT_OPENGL_DEBUG;
        attributes[n++] = EGL_TRUE;
    }
    if (robust) {
        attributes[n++] = EGL_CONTEXT_OPENGL_ROBUST_ACCESS;
        attributes[n++] = EGL_TRUE;
        attributes[n++] = EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY;
        attributes[n++] = EGL_LOSE_CONTEXT_ON_RESET;
    }
    attributes[n] = EGL_NONE;
    return eglCreateContext(display, config, EGL_NO_CONTEXT, attributes);
}

/* Creates a context, preferably a robust one; without a configuration, as it never draws to a surface. */
static bool create_any_context(struct gpu_egl *egl, const char *extensions, bool debug)
{
    bool any_config = has_word(extensions, "EGL_KHR_no_config_context");
    for (int chosen = any_config ? 0 : 1; chosen < 2; chosen++) {
        EGLConfig config = chosen ? choose_config(egl->display) : EGL_NO_CONFIG_KHR;
        for (int robust = 1; robust >= 0; robust--) {
            egl->robust = robust != 0;
            egl->context = create_context(egl->display, config, egl->robust, debug);
            if (egl->context)
                return true;
        }
    }
    return false;
}

void gpu_egl_sort_by_use(struct gpu_egl_place *places, size_t count, const uint16_t used_by[GPU_EGL_PLACES_MAX])
{
    for (size_t i = 1; i < count; i++) {
        const struct gpu_egl_place place = places[i];
        size_t k = i;
        for (; k > 0 && used_by[places[k - 1].index] > used_by[place.index]; k--)
            places[k] = places[k - 1];
        places[k] = place;
    }
}

bool gpu_egl_open(struct gpu_egl *egl, const struct gpu_egl_place *place, bool debug, struct error *error)
{
    EGLint major = 0, minor = 0;
    *egl = (struct gpu_egl){0};
    egl->display = open_display(place);
    if (!egl->display || !eglInitialize(egl->display, &major, &minor)) {
        egl->display = NULL;
        return error_set(error, ERROR_UNSUPPORTED, NULL, "device %d gives no EGL display (0x%04x)", place->index,
                         (unsigned)eglGetError());
    }
    const char *extensions = eglQueryString(egl->display, EGL_EXTENSIONS);
    const char *lacking = NULL;
    if (major == 1 && minor < 5)
        lacking = "EGL 1.5";
    else if (!has_word(extensions, "EGL_KHR_surfaceless_context"))
        lacking = "EGL_KHR_surfaceless_context";
    else if (!eglBindAPI(EGL_OPENGL_API))
        lacking = "desktop OpenGL";
    if (lacking) {
        gpu_egl_close(egl);
        return error_set(error, ERROR_UNSUPPORTED, NULL, "device %d lacks %s", place->index, lacking);
    }
    if (!create_any_context(egl, extensions, debug) ||
        !eglMakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl->context)) {
        unsigned code = (unsigned)eglGetError();
        gpu_egl_close(egl);
        return error_set(error, ERROR_UNSUPPORTED, NULL, "device %d gives no OpenGL 4.5 core context (0x%04x)",
                         place->index, code);
    }
    dl_iterate_phdr(pin_driver, NULL);
    return true;
}

bool gpu_egl_open_beside(struct gpu_egl *beside, const struct gpu_egl *egl)
{
    *beside = (struct gpu_egl){.display = egl->display};
    if (eglBindAPI(EGL_OPENGL_API) &&
        create_any_context(beside, eglQueryString(egl->display, EGL_EXTENSIONS), false) &&
        eglMakeCurrent(beside->display, EGL_NO_SURFACE, EGL_NO_SURFACE, beside->context))
        return true;
    gpu_egl_close_beside(beside);
    return false;
}

void gpu_egl_close_beside(struct gpu_egl *beside)
{
    eglMakeCurrent(beside->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (beside->context)
        eglDestroyContext(beside->display, beside->context);
    eglReleaseThread();
    *beside = (struct gpu_egl){0};
}

void gpu_egl_close(struct gpu_egl *egl)
{
    if (!egl->display)
        return;
    eglMakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (egl->context)
        eglDestroyContext(egl->display, egl->context);
    eglTerminate(egl->display);
    eglReleaseThread();
    *egl = (struct gpu_egl){0};
}
