/* SPDX-License-Identifier: MIT */
/* Stream reduction, four ways: by chunks as the descent of `rayspace` does it, by segments and by a geometry
 * shader as its paper does, and Horn's, which that one is compared with. bench reduce ELEMENTS [RUNS]
 *
 * Elements are slots of 16 bytes (shaders/rayspace/reduce.h), a third of which are not empty. All ways take turns,
 * run by run. One JSON object on standard output: {"elements", "kept", "rows": [{way, runs_ns, cpu_ns}]}. Exit
 * status 1 if something fails or a way leaves other elements than those that are not empty. */
#include "tests/accuracy/test_scenes.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_stats.h"

#include "base/clock.h"
#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/rayspace/reduce.h"

#include <epoxy/gl.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ELEMENTS_MAX (1u << 25)
#define GROUPS_X 65535u /* of a dispatch, at most */

enum way { CHUNK, SEGMENTS, GEOMETRY, HORN, WAYS };
static const char *const way_names[WAYS] = {"chunk", "segments", "geometry", "horn"};

struct bench {
    struct gpu_device *device;
    struct rayspace_reduction reductions[WAYS]; /* of SEGMENTS and GEOMETRY */
    struct gpu_buffer slots, control, pairs, leaves, sums[2];
    struct rayspace_control before;
    uint32_t slot_count, kept_count;
    uint64_t kept_sum; /* of all kept elements' numbers */
    struct bench_runs runs[WAYS], cpu[WAYS];
};

static void require(bool ok, const struct error *error)
{
    if (ok)
        return;
    fprintf(stderr, "bench reduce: %s %s\n", error->field, error->text);
    exit(1);
}

static void make_slots(struct bench *bench)
{
    struct error error = {0};
    uint64_t seed = 5;
    const size_t bytes = (size_t)bench->slot_count * RAYSPACE_PAIR_BYTES;
    uint32_t(*slots)[4] = gpu_buffer_map(bench->device, &bench->slots, bytes, &error);
    require(slots != NULL, &error);
    for (uint32_t i = 0; i < bench->slot_count; i++) {
        const bool kept = test_random(&seed) % 3 == 0;
        memcpy(slots[i], (const uint32_t[4]){i, 0, 0, kept ? 0 : RAYSPACE_SLOT_EMPTY}, RAYSPACE_PAIR_BYTES);
        bench->kept_count += kept;
        bench->kept_sum += kept ? i : 0;
    }
    gpu_buffer_unmap(bench->device, &bench->slots);
}

static void prepare(struct bench *bench, uint32_t elements)
{
    struct error error = {0};
    const uint32_t pairs = (elements - 1) / (RAYSPACE_CHILDREN + 1) + 1, chunks = (pairs - 1) / RAYSPACE_CHUNK + 1;
    const uint32_t groups = (chunks - 1) / 64 + 1, groups_x = groups < GROUPS_X ? groups : GROUPS_X;
    bench->slot_count = chunks * RAYSPACE_CHUNK_SLOTS;
    make_slots(bench);
    const size_t bytes = (size_t)bench->slot_count * RAYSPACE_PAIR_BYTES;
    require(gpu_buffer_reserve(bench->device, &bench->control, sizeof(bench->before), &error) &&
                gpu_buffer_reserve(bench->device, &bench->pairs, bytes, &error) &&
                gpu_buffer_reserve(bench->device, &bench->sums[0], bytes / 4, &error) &&
                gpu_buffer_reserve(bench->device, &bench->sums[1], bytes / 4, &error),
            &error);
    static const enum rayspace_reduce reduces[WAYS] = {
        [SEGMENTS] = RAYSPACE_REDUCE_SEGMENTS, [GEOMETRY] = RAYSPACE_REDUCE_GEOMETRY};
    for (int way = SEGMENTS; way <= GEOMETRY; way++) {
        struct rayspace_reduction *reduction = &bench->reductions[way];
        require(rayspace_reduction_reserve(bench->device, reduction, reduces[way], pairs, &error), &error);
        gpu_buffer_copy(bench->device, (struct gpu_buffer_place){&bench->slots, 0},
                        (struct gpu_buffer_place){&reduction->slots, 0}, bytes);
    }
    bench->before = (struct rayspace_control){.taken = pairs,
                                              .room = bench->slot_count,
                                              .pass_groups_x = groups_x,
                                              .pass_groups_y = (groups + groups_x - 1) / groups_x,
                                              .pass_groups_z = 1};
}

/* ---- the ways ---- */

static const struct gpu_program *get(struct bench *bench, const char *compute, const struct gpu_define *defines)
{
    struct error error = {0};
    const struct gpu_program_source source = {.compute = compute, .defines = defines};
    const struct gpu_program *program = gpu_program_get(bench->device, &source, &error);
    require(program != NULL, &error);
    gpu_buffer_bind_texels(bench->device, &bench->slots, UNIT_RAYSPACE_SLOTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&bench->control, BIND_RAYSPACE_CONTROL);
    gpu_buffer_bind_storage(&bench->pairs, BIND_RAYSPACE_PAIRS);
    gpu_uniform_uint(program, "slot_count", bench->slot_count);
    return program;
}

static void reduce_by_chunks(struct bench *bench)
{
    const struct gpu_program *program = get(bench, "reduce/chunk.comp", NULL);
    gpu_dispatch(bench->device, program, bench->slot_count / RAYSPACE_CHUNK_SLOTS);
}

static void horn_pass(struct bench *bench, const char *stage, uint32_t reach, unsigned from)
{
    const struct gpu_define defines[] = {{stage, "1"}, {0}};
    const struct gpu_program *program = get(bench, "reduce/horn.comp", defines);
    gpu_buffer_bind_texels(bench->device, &bench->sums[from], UNIT_TRACER_0, GL_R32UI);
    gpu_buffer_bind_storage(&bench->sums[1 - from], BIND_RAYSPACE_SEGMENTS);
    gpu_uniform_uint(program, "reach", reach);
    gpu_dispatch(bench->device, program, bench->slot_count);
}

static void reduce_as_horn(struct bench *bench)
{
    unsigned from = 1;
    horn_pass(bench, "HORN_COUNT", 0, from);
    for (uint32_t reach = 1; reach < bench->slot_count; reach *= 2) {
        from = 1 - from;
        horn_pass(bench, "HORN_ADD", reach, from);
    }
    horn_pass(bench, "HORN_GATHER", 0, 1 - from);
}

static void reduce(struct bench *bench, enum way way)
{
    struct error error = {0};
    const struct rayspace_lists lists = {
        .control = &bench->control, .pairs = &bench->pairs, .leaves = &bench->leaves, .put_off = &bench->leaves};
    if (way == CHUNK)
        reduce_by_chunks(bench);
    else if (way == HORN)
        reduce_as_horn(bench);
    else
        require(rayspace_reduction_run(bench->device, &bench->reductions[way], &lists, &error), &error);
    glFinish();
}

/* ---- measuring ---- */

static void begin(struct bench *bench)
{
    gpu_buffer_write(bench->device, &bench->control, 0, &bench->before, sizeof(bench->before));
    glFinish();
}

/* Compiles, too. */
static bool is_right(struct bench *bench, enum way way)
{
    struct rayspace_control told;
    const size_t bytes = (size_t)bench->kept_count * RAYSPACE_PAIR_BYTES;
    uint32_t(*pairs)[4] = malloc(bytes);
    uint64_t sum = 0;
    require(pairs != NULL, &(struct error){.text = "no memory"});
    gpu_buffer_clear(bench->device, &bench->pairs, 0);
    begin(bench);
    reduce(bench, way);
    gpu_buffer_read(bench->device, &bench->control, 0, &told, sizeof(told));
    gpu_buffer_read(bench->device, &bench->pairs, 0, pairs, bytes);
    for (uint32_t i = 0; i < bench->kept_count; i++)
        sum += pairs[i][0];
    free(pairs);
    if (told.written == bench->kept_count && sum == bench->kept_sum)
        return true;
    fprintf(stderr, "bench reduce: %s leaves %u elements of %u\n", way_names[way], told.written,
            bench->kept_count);
    return false;
}

static void measure(struct bench *bench, enum way way)
{
    begin(bench);
    const uint64_t start_ns = clock_now_ns(), start_cpu_ns = bench_processor_ns();
    reduce(bench, way);
    bench_add(&bench->runs[way], clock_now_ns() - start_ns);
    bench_add(&bench->cpu[way], bench_processor_ns() - start_cpu_ns);
}

static void tell(const struct bench *bench)
{
    json_t *rows = json_array();
    for (int way = 0; way < WAYS; way++)
        json_array_append_new(rows, json_pack("{s:s, s:o, s:o}", "way", way_names[way], "runs_ns",
                                              bench_times_json(&bench->runs[way]), "cpu_ns",
                                              bench_times_json(&bench->cpu[way])));
    json_t *whole = json_pack("{s:I, s:I, s:o}", "elements", (json_int_t)bench->slot_count, "kept",
                              (json_int_t)bench->kept_count, "rows", rows);
    json_dumpf(whole, stdout, JSON_INDENT(1));
    printf("\n");
    json_decref(whole);
}

static void finish(struct bench *bench)
{
    for (int way = 0; way < WAYS; way++)
        rayspace_reduction_finish(bench->device, &bench->reductions[way]);
    struct gpu_buffer *buffers[] = {&bench->slots, &bench->control, &bench->pairs, &bench->sums[0],
                                    &bench->sums[1]};
    for (size_t i = 0; i < sizeof(buffers) / sizeof(buffers[0]); i++)
        gpu_buffer_finish(bench->device, buffers[i]);
    gpu_device_destroy(bench->device);
}

BENCH(reduce)
{
    const long elements = argc > 1 ? strtol(argv[1], NULL, 10) : 0,
               runs = argc > 2 ? strtol(argv[2], NULL, 10) : 5;
    if (elements < 1 || elements > ELEMENTS_MAX || runs < 1 || runs > BENCH_RUNS_MAX) {
        fprintf(stderr, "usage: bench reduce ELEMENTS [RUNS]\n");
        return 2;
    }
    struct error error = {0};
    struct bench bench = {.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error)};
    bool right = true;
    require(bench.device != NULL, &error);
    prepare(&bench, (uint32_t)elements);
    for (int way = 0; way < WAYS; way++)
        right = is_right(&bench, (enum way)way) && right;
    for (long run = 0; run < runs; run++)
        for (int way = 0; way < WAYS; way++)
            measure(&bench, (enum way)way);
    require(gpu_check(bench.device, "reducing a stream", &error), &error);
    tell(&bench);
    finish(&bench);
    return right ? 0 : 1;
}
