/* SPDX-License-Identifier: MIT */
/* The file of a device's measurements, and the rules for software GL. */
#include "gpu/measured.h"

#include "gpu/binary_cache.h"
#include "gpu/device.h"
#include "protocol/version.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <xxhash.h>

#define LINE                                                                                                      \
    "first hits are traced from %f primitives a pixel on, from %f with several samples; nodes of eight: %u\n"

/* Rules for software GL. Rasterising, for which one of its threads transforms all vertices, is as fast as tracing
 * at 0.6 primitives a pixel, and takes 1.8 times as long at 3 (one sample and four of scans of 47K to 871K
 * triangles, 320x240 and 640x480). With fewer primitives in all neither takes long, and pictures stay the same as
 * in views, which rasterise. Nodes of eight take single waves of incoherent rays faster than links do (871K
 * triangles: shadows 1.3 of the rate, bounces 1.2, reflections 1.1), but coherent ones slower, for which links
 * have packets (0.6 to 0.9); whole pictures take 0.99 to 1.12 of the processor's time, and a build 1.3. */
static const struct gpu_measured of_software = {
    .known = true, .traced_from = {0.6f, 0.6f}, .primitives_min = 100000};

static bool file_path(char *path, size_t size, const struct gpu_device_info *info)
{
    char folder[3072], text[512];
    if (!gpu_cache_folder(folder, sizeof(folder)))
        return false;
    int length =
        snprintf(text, sizeof(text), "%s\n%s\n%s\n%s", info->vendor, info->name, info->version, FARLIGHT_VERSION);
    const XXH128_hash_t hash = XXH3_128bits(text, (size_t)length);
    int n = snprintf(path, size, "%s/%016llx%016llx.measured", folder, (unsigned long long)hash.high64,
                     (unsigned long long)hash.low64);
    return n > 0 && (size_t)n < size;
}

bool gpu_measured_load(const struct gpu_device_info *info, struct gpu_measured *measured)
{
    char path[4096];
    struct gpu_measured read = {.known = true};
    *measured = info->software ? of_software : (struct gpu_measured){0};
    if (info->software)
        return true;
    FILE *file = file_path(path, sizeof(path), info) ? fopen(path, "re") : NULL;
    if (!file)
        return false;
    unsigned nodes_of_eight = 0;
    bool whole = fscanf(file, LINE, &read.traced_from[0], &read.traced_from[1], &nodes_of_eight) == 3;
    read.nodes_of_eight = nodes_of_eight != 0;
    fclose(file);
    for (int i = 0; i < 2; i++)
        whole = whole && isfinite(read.traced_from[i]) && read.traced_from[i] >= 0;
    if (whole)
        *measured = read;
    return whole;
}

bool gpu_measured_store(const struct gpu_device_info *info, const struct gpu_measured *measured)
{
    char path[4096], fresh[4128];
    if (!file_path(path, sizeof(path), info))
        return false;
    /* The file gets its name when it is complete: another daemon may read at any moment. */
    snprintf(fresh, sizeof(fresh), "%s.%ld", path, (long)getpid());
    FILE *file = fopen(fresh, "we");
    if (!file)
        return false;
    bool written = fprintf(file, LINE, (double)measured->traced_from[0], (double)measured->traced_from[1],
                           (unsigned)measured->nodes_of_eight) > 0;
    written = fclose(file) == 0 && written && rename(fresh, path) == 0;
    if (!written)
        (void)unlink(fresh);
    return written;
}

bool gpu_measured_traces(const struct gpu_measured *measured, bool several_samples, uint64_t primitives,
                         uint64_t pixels)
{
    return measured->known && primitives >= measured->primitives_min &&
           (double)primitives >= (double)measured->traced_from[several_samples] * (double)pixels;
}
