/* SPDX-License-Identifier: MIT */
/* The yardstick of `make bench`: reads a file, hashes it, and lets Embree build the triangles that lie in it.
 * Usage: bench embree_build FILE POSITIONS_OFFSET VERTEX_COUNT INDICES_OFFSET TRIANGLE_COUNT
 * Prints one JSON object with nanoseconds, the minimum of five runs of each. */
#include "tests/bench/bench.h"

#include "base/blob.h"
#include "base/clock.h"

#include <embree3/rtcore.h>

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <xmmintrin.h>

enum { RUNS = 5 };

static uint8_t *read_file(const char *path, size_t *size_bytes)
{
    FILE *file = fopen(path, "rb");
    struct stat stat;
    if (!file || fstat(fileno(file), &stat) != 0 || stat.st_size <= 0) {
        fprintf(stderr, "bench embree_build: %s: %s\n", path, strerror(errno));
        if (file)
            fclose(file);
        return NULL;
    }
    *size_bytes = (size_t)stat.st_size;
    uint8_t *data = malloc(*size_bytes + 16); /* Embree may read a little past the last vertex */
    if (data && fread(data, 1, *size_bytes, file) != *size_bytes) {
        free(data);
        data = NULL;
    }
    fclose(file);
    return data;
}

static uint64_t build_ns(RTCDevice device, uint8_t *data, size_t positions, size_t vertex_count, size_t indices,
                         size_t triangle_count)
{
    const uint64_t begin = clock_now_ns();
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, data, positions, 12,
                               vertex_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, data, indices, 12,
                               triangle_count);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    const uint64_t end = clock_now_ns();
    rtcReleaseScene(scene);
    return end - begin;
}

BENCH(embree_build)
{
    if (argc != 6) {
        fprintf(stderr,
                "usage: bench embree_build FILE POSITIONS_OFFSET VERTEX_COUNT INDICES_OFFSET TRIANGLE_COUNT\n");
        return 2;
    }
    size_t numbers[4];
    for (int i = 0; i < 4; i++)
        numbers[i] = strtoull(argv[i + 2], NULL, 10);
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    RTCDevice device = rtcNewDevice(NULL);
    uint64_t read_best_ns = UINT64_MAX, hash_best_ns = UINT64_MAX, build_best_ns = UINT64_MAX;
    for (int run = 0; run < RUNS; run++) {
        const uint64_t begin = clock_now_ns();
        size_t size_bytes = 0;
        uint8_t *data = read_file(argv[1], &size_bytes);
        if (!data || numbers[0] > size_bytes || numbers[1] > (size_bytes - numbers[0]) / 12 ||
            numbers[2] > size_bytes || numbers[3] > (size_bytes - numbers[2]) / 12) {
            fprintf(stderr, "bench embree_build: %s: shorter than the arguments say\n", argv[1]);
            free(data);
            return 1;
        }
        const uint64_t read = clock_now_ns();
        uint8_t hash[BLOB_HASH_BYTES];
        blob_hash(hash, data, size_bytes);
        const uint64_t hashed = clock_now_ns();
        const uint64_t build = build_ns(device, data, numbers[0], numbers[1], numbers[2], numbers[3]);
        free(data);
        read_best_ns = read - begin < read_best_ns ? read - begin : read_best_ns;
        hash_best_ns = hashed - read < hash_best_ns ? hashed - read : hash_best_ns;
        build_best_ns = build < build_best_ns ? build : build_best_ns;
    }
    const bool failed = rtcGetDeviceError(device) != RTC_ERROR_NONE;
    rtcReleaseDevice(device);
    if (failed) {
        fprintf(stderr, "bench embree_build: Embree reports an error\n");
        return 1;
    }
    printf("{\"read_ns\": %llu, \"hash_ns\": %llu, \"build_ns\": %llu}\n", (unsigned long long)read_best_ns,
           (unsigned long long)hash_best_ns, (unsigned long long)build_best_ns);
    return 0;
}
