/* SPDX-License-Identifier: MIT */
/* Sandbox of a process that serves: its access to the system's libraries, the GPU's devices, and its own files. */
#include "confine.h"

#include "base/log.h"
#include "base/confinement.h"
#include "gpu/binary_cache.h"

#include <fcntl.h>
#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Libraries and drivers, their configuration, and the kernel's files about the machine. Nobody's home is among
 * them, nor the rest of /etc, where keys lie. */
static const char *const read_paths[] = {"/usr",
                                         "/bin",
                                         "/lib",
                                         "/lib32",
                                         "/lib64",
                                         "/opt",
                                         "/nix/store",
                                         "/gnu/store",
                                         "/run/opengl-driver",
                                         "/run/current-system",
                                         "/run/nvidia-persistenced",
                                         "/proc",
                                         "/sys",
                                         "/etc/alternatives",
                                         "/etc/drirc",
                                         "/etc/egl",
                                         "/etc/glvnd",
                                         "/etc/group",
                                         "/etc/ld.so.*",
                                         "/etc/localtime",
                                         "/etc/nsswitch.conf",
                                         "/etc/nvidia",
                                         "/etc/passwd",
                                         "/etc/vulkan"};
static const char *const devices[] = {"/dev/null",    "/dev/zero",    "/dev/full",    "/dev/random",
                                      "/dev/urandom", "/dev/dri",     "/dev/kfd",     "/dev/dxg",
                                      "/dev/mali*",   "/dev/nvidia*", "/dev/udmabuf", "/dev/dma_heap"};
/* Environment variables with the places of drivers, separated by colons. */
static const char *const driver_variables[] = {"GBM_BACKENDS_PATH",
                                               "LD_LIBRARY_PATH",
                                               "LIBGL_DRIVERS_PATH",
                                               "VK_DRIVER_FILES",
                                               "VK_ICD_FILENAMES",
                                               "__EGL_VENDOR_LIBRARY_DIRS",
                                               "__EGL_VENDOR_LIBRARY_FILENAMES"};
/* Environment variables with drivers' caches, each of which is one folder. */
static const char *const cache_variables[] = {"MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH"};
/* Drivers' caches beside ours. */
static const char *const caches[] = {"mesa_shader_cache", "mesa_shader_cache_db", "nvidia"};

static void allow_matches(struct confinement *confinement, enum confined_access access, const char *pattern)
{
    glob_t found;
    if (glob(pattern, GLOB_NOSORT, NULL, &found) == 0) {
        for (size_t i = 0; i < found.gl_pathc; i++)
            confinement_allow(confinement, access, found.gl_pathv[i]);
        globfree(&found);
    }
}

static void allow_all(struct confinement *confinement, enum confined_access access, const char *const *patterns,
                      size_t count)
{
    for (size_t i = 0; i < count; i++)
        allow_matches(confinement, access, patterns[i]);
}

static void allow_list(struct confinement *confinement, const char *paths)
{
    char *copy = paths ? strdup(paths) : NULL, *rest = copy;
    for (char *path; rest && (path = strsep(&rest, ":"));) {
        if (path[0] == '/')
            confinement_allow(confinement, CONFINED_READ, path);
    }
    free(copy);
}

static void allow_folder(struct confinement *confinement, const char *path)
{
    (void)mkdir(path, S_IRWXU);
    confinement_allow(confinement, CONFINED_WRITE, path);
}

static void allow_caches(struct confinement *confinement)
{
    char own[4096], path[4096 + 64];
    if (!gpu_cache_folder(own, sizeof(own)))
        return;
    confinement_allow(confinement, CONFINED_WRITE, own);
    const int parent_bytes = (int)(strrchr(own, '/') - own);
    for (size_t i = 0; i < sizeof(caches) / sizeof(caches[0]); i++) {
        snprintf(path, sizeof(path), "%.*s/%s", parent_bytes, own, caches[i]);
        allow_folder(confinement, path);
    }
    for (size_t i = 0; i < sizeof(cache_variables) / sizeof(cache_variables[0]); i++) {
        const char *folder = getenv(cache_variables[i]);
        if (folder && folder[0] == '/')
            allow_folder(confinement, folder);
    }
}

/* Creates the file beforehand, so that the sandbox need not allow new files in its folder. */
static void allow_file(struct confinement *confinement, const char *path)
{
    const int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0644);
    if (fd < 0)
        return; /* the code that opens the file reports this */
    close(fd);
    confinement_allow(confinement, CONFINED_WRITE, path);
}

bool confine(const struct config *config, const char *trace_path, const char *store_path, struct error *error)
{
    bool has_files;
    if (!config->sandbox)
        return true;
    struct confinement *confinement = confinement_create();
    if (!confinement)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    allow_all(confinement, CONFINED_READ, read_paths, sizeof(read_paths) / sizeof(read_paths[0]));
    allow_all(confinement, CONFINED_DEVICE, devices, sizeof(devices) / sizeof(devices[0]));
    for (size_t i = 0; i < sizeof(driver_variables) / sizeof(driver_variables[0]); i++)
        allow_list(confinement, getenv(driver_variables[i]));
    allow_caches(confinement);
    if (trace_path[0])
        allow_file(confinement, trace_path);
    if (store_path[0])
        allow_folder(confinement, store_path);
    const bool ok = confinement_enter(confinement, &has_files, error);
    confinement_destroy(confinement);
    if (!ok)
        return error_remedy(error, "server.sandbox = no serves without a sandbox");
    if (!has_files)
        log_write(LOG_INFO, "server", "this kernel has no Landlock: which files are opened is not confined");
    return true;
}
