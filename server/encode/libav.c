/* SPDX-License-Identifier: MIT */
/* Symbols of libavcodec, loaded once. */
#include "encode/libav.h"

#include "base/log.h"

#include <dlfcn.h>
#include <pthread.h>
#include <string.h>

/* Name of a library in the version whose structs the headers describe. */
#define NAME_OF(library, version) library ".so." AV_STRINGIFY(version)

static struct libav functions;
static bool loaded;

static bool find(void *library, const char *name, void *function)
{
    void *address = library ? dlsym(library, name) : NULL;
    /* Copies bytes, as in C a data pointer does not convert to a function pointer. */
    memcpy(function, &address, sizeof(address));
    return address != NULL;
}

static void load(void)
{
    void *util = dlopen(NAME_OF("libavutil", LIBAVUTIL_VERSION_MAJOR), RTLD_NOW | RTLD_LOCAL);
    void *codec = dlopen(NAME_OF("libavcodec", LIBAVCODEC_VERSION_MAJOR), RTLD_NOW | RTLD_LOCAL);
    bool good = true;
#define FUNCTION(name) good = find(util, #name, &functions.name) && good;
    LIBAVUTIL_FUNCTIONS(FUNCTION)
#undef FUNCTION
#define FUNCTION(name) good = find(codec, #name, &functions.name) && good;
    LIBAVCODEC_FUNCTIONS(FUNCTION)
#undef FUNCTION
    if (good)
        functions.av_log_set_level(AV_LOG_QUIET); /* failures are returned as numbers */
    else
        log_write(LOG_INFO, "encode", "no video: %s", dlerror());
    loaded = good;
}

const struct libav *libav_load(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, load);
    return loaded ? &functions : NULL;
}
