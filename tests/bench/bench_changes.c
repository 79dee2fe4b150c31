/* SPDX-License-Identifier: MIT */
/* What a change of the scene costs the tracer `bvh`. One JSON object on standard output; bench.py makes the
 * tables. bench changes instances [COUNT [FRAMES]]   all instances of a small mesh move each frame, 640x480 pixels
 *   bench changes refit [TRIANGLES [RUNS]]     a mesh bends as a skin would bend it: its tree refitted, and
 * rebuilt Exit status 1 if something fails or a refitted tree answers otherwise than one that is built for the
 * pose. */
#include "tests/accuracy/test_scenes.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_stats.h"

#include "base/clock.h"
#include "gpu/device.h"
#include "render/frame.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/bvh/tracer.h"

#include <epoxy/gl.h>
#include <jansson.h>

#define PI_F 3.14159265f
#define RAY_COUNT 65536u
#define DIFFERING_MAX (RAY_COUNT / 10000)

static void require(bool ok, const struct error *error)
{
    if (ok)
        return;
    fprintf(stderr, "bench changes: %s %s\n", error->field, error->text);
    exit(1);
}

static json_t *figure_json(const struct bench_runs *runs)
{
    const struct bench_figure figure = bench_figure(runs);
    return json_pack("{s:f, s:f, s:f, s:f, s:i}", "median", figure.median_ns / 1e6, "deviation",
                     figure.deviation_ns / 1e6, "min", figure.min_ns / 1e6, "max", figure.max_ns / 1e6, "runs",
                     (int)runs->count);
}

static void add_sphere(struct test_edits *edits, uint32_t id, uint32_t steps)
{
    uint32_t vertex_count = (steps + 1) * (steps + 1), triangle_count = 2 * steps * steps;
    float(*vertices)[3] = malloc(vertex_count * sizeof(*vertices));
    uint32_t *indices = malloc(3 * (size_t)triangle_count * sizeof(*indices)), *next = indices;
    for (uint32_t i = 0; i < vertex_count; i++) {
        float theta = PI_F * (float)(i / (steps + 1)) / (float)steps,
              phi = 2 * PI_F * (float)(i % (steps + 1)) / (float)steps;
        vertices[i][0] = sinf(theta) * cosf(phi);
        vertices[i][1] = cosf(theta);
        vertices[i][2] = sinf(theta) * sinf(phi);
    }
    for (uint32_t i = 0; i < steps; i++) {
        for (uint32_t j = 0; j < steps; j++, next += 6) {
            uint32_t a = i * (steps + 1) + j, b = a + steps + 1;
            memcpy(next, (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, 6 * sizeof(*next));
        }
    }
    test_mesh(edits, id, (const float(*)[3])vertices, vertex_count, indices, triangle_count);
    free(vertices);
    free(indices);
}

/* ---- instances ---- */

/* One transaction. Returns what it took. */
static uint64_t move_all(struct scene *scene, uint32_t count, float time)
{
    struct error error = {0};
    struct scene_edit *edits = calloc(count, sizeof(*edits));
    uint32_t side = (uint32_t)ceilf(sqrtf((float)count));
    for (uint32_t i = 0; i < count; i++) {
        edits[i].kind = EDIT_SET;
        edits[i].object = OBJECT_NODE;
        struct scene_node *node = &edits[i].set.node;
        node->base.id = i + 1;
        node->kind = NODE_MESH;
        node->object = 1;
        test_transform(node->parent_from_node, 1, 0.7f, 1.2f, (int)(i % 3), time + (float)i,
                       3 * (float)(i % side) + sinf(time + (float)i), cosf(time * 2 + (float)i),
                       3 * (float)(i / side));
    }
    uint64_t start_ns = clock_now_ns();
    require(scene_commit(scene, edits, count, &error), &error);
    uint64_t took_ns = clock_now_ns() - start_ns;
    for (uint32_t i = 0; i < count; i++)
        scene_edit_finish(&edits[i]);
    free(edits);
    return took_ns;
}

static json_t *bench_instances(struct gpu_device *device, uint32_t count, uint32_t frames)
{
    struct error error = {0};
    struct test_edits edits = {.scene = test_scene_create()};
    struct frame_scene *shared = frame_scene_create(device, &error);
    require(shared != NULL, &error);
    struct frame_renderer *renderer = frame_renderer_create(shared, &error);
    require(renderer != NULL, &error);
    add_sphere(&edits, 1, 16);
    test_commit(&edits);
    move_all(edits.scene, count, 0);
    float middle = 1.5f * sqrtf((float)count);
    struct frame_request request = {
        .width = 640, .height = 480, .samples = 1, .depth = 3, .format = PIXEL_FORMAT_RGBA8};
    frame_camera_look_at(&request.camera, (float[3]){middle, 1.2f * middle, 3 * middle},
                         (float[3]){middle, 0, middle}, (float[3]){0, 1, 0}, 0.8f);
    struct bench_runs apply = {0}, upload = {0}, build = {0}, whole = {0}, together = {0};
    uint64_t bytes = 0;
    for (uint32_t frame = 0; frame < frames + 2; frame++) { /* the first two build and compile */
        uint64_t apply_ns = move_all(edits.scene, count, 0.05f * (float)frame), start_ns = clock_now_ns();
        struct frame_result result = {0};
        require(frame_begin(renderer, edits.scene, NULL, &request, &error), &error);
        enum frame_progress progress;
        while ((progress = frame_step(renderer, &result, &error)) == FRAME_MORE)
            continue;
        require(progress == FRAME_DONE, &error);
        uint64_t frame_ns = clock_now_ns() - start_ns + apply_ns;
        uint64_t upload_ns = stage_times_sum_ns(&result.times, STAGE_UPLOAD, CLOCK_CPU);
        uint64_t build_ns = stage_times_sum_ns(&result.times, STAGE_BUILD, CLOCK_CPU);
        bytes = result.uploaded_bytes;
        frame_result_finish(&result);
        if (frame < 2)
            continue;
        bench_add(&apply, apply_ns);
        bench_add(&upload, upload_ns);
        bench_add(&build, build_ns);
        bench_add(&whole, frame_ns);
        bench_add(&together, apply_ns + upload_ns + build_ns);
    }
    frame_renderer_destroy(renderer);
    frame_scene_destroy(shared);
    scene_destroy(edits.scene);
    return json_pack("{s:i, s:i, s:i, s:I, s:o, s:o, s:o, s:o, s:o}", "instances", (int)count, "width", 640,
                     "height", 480, "uploaded_bytes", (json_int_t)bytes, "apply_ms", figure_json(&apply),
                     "upload_ms", figure_json(&upload), "build_ms", figure_json(&build), "update_ms",
                     figure_json(&together), "frame_ms", figure_json(&whole));
}

/* ---- refit ---- */

struct bent {
    struct gpu_device *device;
    struct scene *scene;
    struct gpu_scene gpu;
    struct tracer *refitted, *rebuilt;
    float *vertices; /* 4 each, as the device has them */
    uint32_t vertex_count;
};

/* Two bones along y, the upper one turned about z: each vertex between them by its height. Where a skin's pass
 * would write the vertices, they are written from here, which is not in the times. */
static void bend(struct bent *bent, float radians)
{
    const struct scene_mesh *mesh = bent->gpu.geometries[0].mesh;
    const float *rest = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    for (uint32_t i = 0; i < bent->vertex_count; i++) {
        const float *in = rest + 3 * i;
        float *out = bent->vertices + 4 * i;
        float weight = fminf(fmaxf(0.5f + in[1], 0), 1), c = cosf(radians), s = sinf(radians);
        out[0] = in[0] + weight * (c * in[0] - s * in[1] - in[0]);
        out[1] = in[1] + weight * (s * in[0] + c * in[1] - in[1]);
        out[2] = in[2];
    }
    gpu_buffer_write(bent->device, &bent->gpu.positions, 0, bent->vertices,
                     bent->vertex_count * 4 * sizeof(*bent->vertices));
    bent->gpu.geometries[0].deformed_revision++;
    glFinish();
}

static uint64_t update(struct bent *bent, struct tracer *tracer)
{
    struct error error = {0};
    uint64_t start_ns = clock_now_ns();
    require(tracer_update(tracer, &bent->gpu, &(struct tracer_update){.changed = CHANGED_DEFORMED}, &error),
            &error);
    glFinish();
    return clock_now_ns() - start_ns;
}

/* A tree that was built without wear is worn out at once. */
static void wear_out(struct tracer *tracer)
{
    ((struct bvh *)tracer)->tree.store.entries[0].built_wear = 0;
}

static struct hit *trace(struct bent *bent, struct tracer *tracer, struct gpu_buffer *rays, uint64_t *time_ns)
{
    struct error error = {0};
    struct gpu_buffer answers = {0};
    struct hit *hits = malloc(RAY_COUNT * sizeof(*hits));
    require(gpu_buffer_reserve(bent->device, &answers, RAY_COUNT * sizeof(*hits), &error), &error);
    gpu_scene_bind(&bent->gpu);
    const struct wave wave = {.ray_count = RAY_COUNT, .rays = rays, .hits = &answers};
    for (int run = 0; run < 4; run++) {
        uint64_t start_ns = clock_now_ns();
        require(tracer_intersect(tracer, &bent->gpu, &wave, &error), &error);
        glFinish();
        uint64_t took_ns = clock_now_ns() - start_ns;
        *time_ns = run == 0 || took_ns < *time_ns ? took_ns : *time_ns;
    }
    gpu_buffer_read(bent->device, &answers, 0, hits, RAY_COUNT * sizeof(*hits));
    gpu_buffer_finish(bent->device, &answers);
    return hits;
}

/* From all around at the bent mesh. Rays whose answers differ; what tracing took, refitted and rebuilt. */
static uint32_t compare(struct bent *bent, uint64_t times_ns[2])
{
    struct error error = {0};
    struct gpu_buffer buffer = {0};
    struct ray *rays = calloc(RAY_COUNT, sizeof(*rays));
    uint64_t seed = 3;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = test_uniform(&seed, -3, 3);
            rays[i].direction_t_max[k] = test_uniform(&seed, -0.8f, 0.8f) - rays[i].origin_t_min[k];
        }
        rays[i].direction_t_max[3] = 1e9f;
    }
    require(gpu_buffer_upload(bent->device, &buffer, rays, RAY_COUNT * sizeof(*rays), &error), &error);
    struct hit *a = trace(bent, bent->refitted, &buffer, &times_ns[0]);
    struct hit *b = trace(bent, bent->rebuilt, &buffer, &times_ns[1]);
    uint32_t differing = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        differing += fabsf(a[i].distance - b[i].distance) <= 1e-5f * fabsf(b[i].distance) ? 0 : 1;
    gpu_buffer_finish(bent->device, &buffer);
    free(rays);
    free(a);
    free(b);
    return differing;
}

static void bent_init(struct bent *bent, struct gpu_device *device, uint32_t triangles)
{
    struct error error = {0};
    struct scene_changes changes;
    struct test_edits edits = {.scene = test_scene_create()};
    add_sphere(&edits, 1, (uint32_t)lrintf(sqrtf((float)triangles / 2)));
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    *bent = (struct bent){.device = device, .scene = edits.scene};
    gpu_scene_init(&bent->gpu, device);
    require(gpu_scene_update(&bent->gpu, bent->scene, NULL, &changes, NULL, &error), &error);
    bent->gpu.geometries[0].node = 1; /* as if it had a skin */
    bent->vertex_count = bent->gpu.geometries[0].device.vertex_count;
    bent->vertices = calloc(bent->vertex_count, 4 * sizeof(*bent->vertices));
    bent->refitted = tracer_create(&tracer_bvh_impl, device, NULL, &error);
    bent->rebuilt = tracer_create(&tracer_bvh_impl, device, NULL, &error);
    require(bent->refitted && bent->rebuilt && bent->vertices, &error);
    require(tracer_update(bent->refitted, &bent->gpu, &(struct tracer_update){0}, &error) &&
                tracer_update(bent->rebuilt, &bent->gpu, &(struct tracer_update){0}, &error),
            &error);
}

static json_t *bench_refit(struct gpu_device *device, uint32_t triangles, uint32_t count, bool *failed)
{
    struct bent bent;
    struct bench_runs refits = {0}, rebuilds = {0};
    bent_init(&bent, device, triangles);
    for (uint32_t run = 0; run < count + 1; run++) { /* the first compiles */
        bend(&bent, 0.2f + 0.1f * (float)(run % 8));
        uint64_t refit_ns = update(&bent, bent.refitted);
        wear_out(bent.rebuilt);
        uint64_t rebuild_ns = update(&bent, bent.rebuilt);
        if (run == 0)
            continue;
        bench_add(&refits, refit_ns);
        bench_add(&rebuilds, rebuild_ns);
        *failed = *failed || bent.refitted->stats.nodes_rebuilt > 0 || bent.rebuilt->stats.nodes_rebuilt == 0;
    }
    uint64_t times_ns[2];
    uint32_t differing = compare(&bent, times_ns);
    *failed = *failed || differing > DIFFERING_MAX;
    json_t *result = json_pack("{s:i, s:i, s:i, s:o, s:o, s:f, s:f, s:i, s:i}", "triangles",
                               (int)bent.gpu.geometries[0].device.primitive_count, "elements",
                               (int)((struct bvh *)bent.refitted)->tree.store.entries[0].element_count, "steps",
                               (int)((struct bvh *)bent.refitted)->tree.store.entries[0].refit.step_count,
                               "refit_ms", figure_json(&refits), "rebuild_ms", figure_json(&rebuilds),
                               "trace_refitted_ms", (double)times_ns[0] / 1e6, "trace_rebuilt_ms",
                               (double)times_ns[1] / 1e6, "rays", (int)RAY_COUNT, "differing", (int)differing);
    tracer_destroy(bent.refitted);
    tracer_destroy(bent.rebuilt);
    gpu_scene_finish(&bent.gpu);
    scene_destroy(bent.scene);
    free(bent.vertices);
    return result;
}

static uint32_t number(int argc, char **argv, int i, uint32_t usual, uint32_t maximum)
{
    if (i >= argc)
        return usual;
    long value = strtol(argv[i], NULL, 10);
    if (value >= 1 && value <= (long)maximum)
        return (uint32_t)value;
    fprintf(stderr, "bench changes: %s: between 1 and %u\n", argv[i], maximum);
    exit(2);
}

BENCH(changes)
{
    bool instances = argc > 1 && strcmp(argv[1], "instances") == 0, failed = false;
    if (argc < 2 || (!instances && strcmp(argv[1], "refit") != 0)) {
        fprintf(stderr, "usage: bench changes instances [COUNT [FRAMES]] | refit [TRIANGLES [RUNS]]\n");
        return 2;
    }
    uint32_t size = number(argc, argv, 2, instances ? 1000 : 100000, instances ? 50000 : 10000000);
    uint32_t runs = number(argc, argv, 3, 15, BENCH_RUNS_MAX);
    struct error error = {0};
    struct gpu_device *device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    require(device != NULL, &error);
    json_t *result = instances ? bench_instances(device, size, runs) : bench_refit(device, size, runs, &failed);
    json_dumpf(result, stdout, JSON_INDENT(1));
    printf("\n");
    json_decref(result);
    gpu_device_destroy(device);
    return failed ? 1 : 0;
}
