/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_embree.h"

#include "base/clock.h"
#include "base/parallel.h"
#include "scene/affine.h"

#include <embree3/rtcore.h>

#include <math.h>
#include <pmmintrin.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

#define CHUNK_RAYS 2048u /* of one item of work; a multiple of every packet */
/* A sphere's transform may stray this much from a turn and one scale. */
#define SCALE_TOLERANCE 1e-4f

struct bench_embree {
    RTCDevice device;
    RTCScene scene;
    atomic_llong bytes;
    long long bytes_before; /* what the device and our own arrays take */
};

/* ---- the scene, flattened ---- */

struct flat {
    float (*vertices)[3]; /* three a triangle: shared vertices are no use once instances are laid out */
    uint32_t *triangles;  /* 0, 1, 2, .. */
    float (*spheres)[4], (*discs)[4], (*disc_normals)[3];
    size_t triangle_count, sphere_count;
};

static void flat_finish(struct flat *flat)
{
    free(flat->vertices);
    free(flat->triangles);
    free(flat->spheres);
    free(flat->discs);
    free(flat->disc_normals);
}

static bool flat_reserve(struct flat *flat, const struct gpu_scene *scene)
{
    size_t triangles = 0, spheres = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[scene->instances[i].geometry];
        *(geometry->mesh ? &triangles : &spheres) += geometry->device.primitive_count;
    }
    /* One more than is needed: Embree reads 16 bytes at the last vertex. */
    flat->vertices = malloc((3 * triangles + 2) * sizeof(*flat->vertices));
    flat->triangles = malloc((3 * triangles + 2) * sizeof(*flat->triangles));
    flat->spheres = malloc((spheres + 1) * sizeof(*flat->spheres));
    flat->discs = malloc((scene->disc_count + 1u) * sizeof(*flat->discs));
    flat->disc_normals = malloc((scene->disc_count + 2u) * sizeof(*flat->disc_normals));
    return flat->vertices && flat->triangles && flat->spheres && flat->discs && flat->disc_normals;
}

static void add_mesh(struct flat *flat, const float world_from_object[12], const struct scene_mesh *mesh)
{
    const float(*positions)[3] = (const float(*)[3])(const void *)mesh->arrays[MESH_POSITIONS]->data;
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    for (size_t i = 0; i < 3 * (size_t)mesh->triangle_count; i++) {
        size_t vertex = 3 * flat->triangle_count + i;
        affine_point(flat->vertices[vertex], world_from_object, positions[indices[i]]);
        flat->triangles[vertex] = (uint32_t)vertex;
    }
    flat->triangle_count += mesh->triangle_count;
}

static bool add_spheres(struct flat *flat, const float m[12], const struct scene_spheres *spheres)
{
    const float(*from)[4] = (const float(*)[4])(const void *)spheres->centres_radii->data;
    const float scale = sqrtf(m[0] * m[0] + m[4] * m[4] + m[8] * m[8]);
    for (int a = 0; a < 3; a++) {
        for (int b = a; b < 3; b++) {
            float dot = m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b];
            if (fabsf(dot - (a == b ? scale * scale : 0)) > SCALE_TOLERANCE * scale * scale)
                return false;
        }
    }
    for (uint32_t i = 0; i < spheres->sphere_count; i++) {
        float *to = flat->spheres[flat->sphere_count++];
        affine_point(to, m, from[i]);
        to[3] = from[i][3] * scale;
    }
    return true;
}

static bool flatten(struct flat *flat, const struct gpu_scene *scene, struct error *error)
{
    if (!flat_reserve(flat, scene))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for Embree's triangles");
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[scene->instances[i].geometry];
        float m[12];
        memcpy(m, scene->instances[i].world_from_object, sizeof(m));
        if (geometry->mesh)
            add_mesh(flat, m, geometry->mesh);
        else if (!add_spheres(flat, m, geometry->spheres))
            return error_set(error, ERROR_UNSUPPORTED, NULL, "a sphere is squeezed: Embree's points are round");
    }
    for (uint32_t i = 0; i < scene->disc_count; i++) {
        memcpy(flat->discs[i], &scene->discs[i].centre_radius, sizeof(flat->discs[i]));
        memcpy(flat->disc_normals[i], &scene->discs[i].normal, sizeof(flat->disc_normals[i]));
    }
    return true;
}

/* ---- Embree's scene ---- */

static bool note_memory(void *embree, ssize_t bytes, bool is_after)
{
    (void)is_after;
    atomic_fetch_add(&((struct bench_embree *)embree)->bytes, bytes);
    return true;
}

static void fill(RTCGeometry geometry, enum RTCBufferType type, enum RTCFormat format, const void *data,
                 size_t item_bytes, size_t count)
{
    memcpy(rtcSetNewGeometryBuffer(geometry, type, 0, format, item_bytes, count), data, item_bytes * count);
}

static void attach(struct bench_embree *embree, RTCGeometry geometry)
{
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree->scene, geometry);
    rtcReleaseGeometry(geometry);
}

static void describe_scene(struct bench_embree *embree, const struct flat *flat, uint32_t disc_count)
{
    if (flat->triangle_count > 0) {
        RTCGeometry geometry = rtcNewGeometry(embree->device, RTC_GEOMETRY_TYPE_TRIANGLE);
        fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, flat->vertices, 12, 3 * flat->triangle_count);
        fill(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, flat->triangles, 12, flat->triangle_count);
        attach(embree, geometry);
    }
    if (flat->sphere_count > 0) {
        RTCGeometry geometry = rtcNewGeometry(embree->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
        fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, flat->spheres, 16, flat->sphere_count);
        attach(embree, geometry);
    }
    if (disc_count > 0) {
        RTCGeometry geometry = rtcNewGeometry(embree->device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
        fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, flat->discs, 16, disc_count);
        fill(geometry, RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3, flat->disc_normals, 12, disc_count);
        attach(embree, geometry);
    }
}

struct bench_embree *bench_embree_create(const struct gpu_scene *scene, bool robust, uint64_t *build_ns,
                                         struct error *error)
{
    struct flat flat = {0};
    struct bench_embree *embree = calloc(1, sizeof(*embree));
    const unsigned flags = _mm_getcsr();
    *build_ns = 0;
    if (!embree || !flatten(&flat, scene, error)) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for Embree");
        flat_finish(&flat);
        free(embree);
        return NULL;
    }
    embree->device = rtcNewDevice(NULL);
    rtcSetDeviceMemoryMonitorFunction(embree->device, note_memory, embree);
    embree->scene = rtcNewScene(embree->device);
    rtcSetSceneFlags(embree->scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    describe_scene(embree, &flat, scene->disc_count);
    flat_finish(&flat);
    embree->bytes_before = embree->bytes;
    _mm_setcsr(flags | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
    const uint64_t start_ns = clock_now_ns();
    rtcCommitScene(embree->scene);
    *build_ns = clock_now_ns() - start_ns;
    _mm_setcsr(flags);
    if (rtcGetDeviceError(embree->device) == RTC_ERROR_NONE)
        return embree;
    bench_embree_destroy(embree);
    error_set(error, ERROR_INTERNAL, NULL, "Embree could not build the scene");
    return NULL;
}

void bench_embree_destroy(struct bench_embree *embree)
{
    if (!embree)
        return;
    rtcReleaseScene(embree->scene);
    rtcReleaseDevice(embree->device);
    free(embree);
}

uint64_t bench_embree_bytes(const struct bench_embree *embree)
{
    long long bytes = embree->bytes - embree->bytes_before;
    return bytes > 0 ? (uint64_t)bytes : 0;
}

void bench_embree_describe(const struct bench_embree *embree, char *text, size_t text_bytes)
{
    snprintf(text, text_bytes, "%zd.%zd.%zd, native packets of%s%s%s",
             rtcGetDeviceProperty(embree->device, RTC_DEVICE_PROPERTY_VERSION_MAJOR),
             rtcGetDeviceProperty(embree->device, RTC_DEVICE_PROPERTY_VERSION_MINOR),
             rtcGetDeviceProperty(embree->device, RTC_DEVICE_PROPERTY_VERSION_PATCH),
             rtcGetDeviceProperty(embree->device, RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED) ? " 4" : "",
             rtcGetDeviceProperty(embree->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? " 8" : "",
             rtcGetDeviceProperty(embree->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) ? " 16" : "");
}

/* ---- rays ---- */

struct tracing {
    const struct bench_embree *embree;
    const struct bench_embree_wave *wave;
};

static void store(const struct bench_embree_wave *wave, uint32_t i, float t_far, const uint32_t ids[2],
                  const float uv[2])
{
    if (!wave->intersections) {
        wave->visibilities[i] = t_far < 0 ? 0 : UINT32_MAX;
        return;
    }
    bool is_hit = ids[0] != RTC_INVALID_GEOMETRY_ID;
    wave->intersections[i] = (struct bench_intersection){is_hit ? t_far : -1, ids[1], ids[0], uv[0], uv[1]};
}

/* Embree must not be asked about a dead ray; a tracer answers that nothing is in its way. */
static bool skip_dead(const struct bench_embree_wave *wave, uint32_t i)
{
    static const uint32_t nothing[2] = {RTC_INVALID_GEOMETRY_ID, RTC_INVALID_GEOMETRY_ID};
    if (wave->rays[i].direction_t_max[3] > wave->rays[i].origin_t_min[3])
        return false;
    store(wave, i, 0, nothing, (const float[2]){0, 0});
    return true;
}

static void trace_single(const struct tracing *tracing, struct RTCIntersectContext *context, uint32_t i)
{
    const struct ray *from = &tracing->wave->rays[i];
    struct RTCRayHit one = {
        .ray = {.org_x = from->origin_t_min[0],
                .org_y = from->origin_t_min[1],
                .org_z = from->origin_t_min[2],
                .tnear = from->origin_t_min[3],
                .dir_x = from->direction_t_max[0],
                .dir_y = from->direction_t_max[1],
                .dir_z = from->direction_t_max[2],
                .tfar = from->direction_t_max[3],
                .mask = UINT32_MAX},
        .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}},
    };
    if (skip_dead(tracing->wave, i))
        return;
    if (tracing->wave->intersections)
        rtcIntersect1(tracing->embree->scene, context, &one);
    else
        rtcOccluded1(tracing->embree->scene, context, &one.ray);
    store(tracing->wave, i, one.ray.tfar, (const uint32_t[2]){one.hit.geomID, one.hit.primID},
          (const float[2]){one.hit.u, one.hit.v});
}

/* The same for 8 and 16 rays a call, whose structs differ in nothing but their length. */
#define DEFINE_TRACE_PACKET(N)                                                                                    \
    static void trace_packet_##N(const struct tracing *tracing, struct RTCIntersectContext *context,              \
                                 uint32_t first)                                                                  \
    {                                                                                                             \
        const struct bench_embree_wave *wave = tracing->wave;                                                     \
        _Alignas(64) int valid[N];                                                                                \
        struct RTCRayHit##N many;                                                                                 \
        memset(&many.hit, 0xff, sizeof(many.hit));                                                                \
        for (uint32_t k = 0; k < N; k++) {                                                                        \
            const struct ray *from = &wave->rays[first + k < wave->ray_count ? first + k : first];                \
            valid[k] = first + k < wave->ray_count && from->direction_t_max[3] > from->origin_t_min[3] ? -1 : 0;  \
            many.ray.org_x[k] = from->origin_t_min[0];                                                            \
            many.ray.org_y[k] = from->origin_t_min[1];                                                            \
            many.ray.org_z[k] = from->origin_t_min[2];                                                            \
            many.ray.tnear[k] = from->origin_t_min[3];                                                            \
            many.ray.dir_x[k] = from->direction_t_max[0];                                                         \
            many.ray.dir_y[k] = from->direction_t_max[1];                                                         \
            many.ray.dir_z[k] = from->direction_t_max[2];                                                         \
            many.ray.tfar[k] = from->direction_t_max[3];                                                          \
            many.ray.time[k] = 0;                                                                                 \
            many.ray.mask[k] = UINT32_MAX;                                                                        \
            many.ray.id[k] = many.ray.flags[k] = 0;                                                               \
        }                                                                                                         \
        if (wave->intersections)                                                                                  \
            rtcIntersect##N(valid, tracing->embree->scene, context, &many);                                       \
        else                                                                                                      \
            rtcOccluded##N(valid, tracing->embree->scene, context, &many.ray);                                    \
        for (uint32_t k = 0; k < N && first + k < wave->ray_count; k++)                                           \
            if (!skip_dead(wave, first + k))                                                                      \
                store(wave, first + k, many.ray.tfar[k],                                                          \
                      (const uint32_t[2]){many.hit.geomID[k], many.hit.primID[k]},                                \
                      (const float[2]){many.hit.u[k], many.hit.v[k]});                                            \
    }
DEFINE_TRACE_PACKET(8)
DEFINE_TRACE_PACKET(16)

static void trace_chunk(void *context, uint32_t chunk)
{
    const struct tracing *tracing = context;
    const uint32_t first = chunk * CHUNK_RAYS, count = tracing->wave->ray_count - first;
    const uint32_t end = first + (count < CHUNK_RAYS ? count : CHUNK_RAYS);
    const unsigned flags = _mm_getcsr();
    struct RTCIntersectContext embree_context;
    rtcInitIntersectContext(&embree_context);
    if (tracing->wave->coherent)
        embree_context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    _mm_setcsr(flags | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
    for (uint32_t i = first; i < end; i += tracing->wave->packet) {
        if (tracing->wave->packet == 1)
            trace_single(tracing, &embree_context, i);
        else if (tracing->wave->packet == 8)
            trace_packet_8(tracing, &embree_context, i);
        else
            trace_packet_16(tracing, &embree_context, i);
    }
    _mm_setcsr(flags);
}

void bench_embree_trace(const struct bench_embree *embree, const struct bench_embree_wave *wave)
{
    struct tracing tracing = {embree, wave};
    parallel_run(parallel_processors(), (wave->ray_count + CHUNK_RAYS - 1) / CHUNK_RAYS, trace_chunk, &tracing);
}
