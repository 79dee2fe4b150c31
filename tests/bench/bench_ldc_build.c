/* SPDX-License-Identifier: MIT */
/* The two ways to build a layered depth cube side by side: one pass with lists, and depth peeling.
 * Usage: bench_ldc_build [-r RESOLUTION] [-n RUNS] [-s SHEETS] [MODEL ..]     (default: 512, 5)
 * First stacks of 8 and of 48 bumpy sheets that fill one image (-s: one of them, or none), then each model. Of
 * RUNS builds of either kind, by turns, after some that compile and allocate, the median is told. Exit status 1 if
 * the two have not as many samples, or GL reports an error. */
#include "tests/accuracy/test_scenes.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/load_model.h"

#include "base/clock.h"
#include "gpu/device.h"
#include "trace/ldc_build.h"

#include <epoxy/gl.h>

/* They compile, allocate, and find out how deep the images are. */
#define WARM_UPS 5u
#define SHEET_CELLS 64 /* quads along a side of a sheet */

struct bench {
    struct gpu_device *device;
    uint32_t resolution, runs, sheets; /* sheets 0: both stacks */
    bool failed;
};

static void require(bool ok, const struct error *error)
{
    if (ok)
        return;
    fprintf(stderr, "bench_ldc_build: %s %s\n", error->field, error->text);
    exit(1);
}

/* Sheets across z, one behind the other, with slopes well below one: all samples are in one image. */
static struct scene *stack_scene(uint32_t sheets)
{
    struct test_edits edits = {.scene = test_scene_create()};
    const uint32_t side = SHEET_CELLS + 1, vertex_count = sheets * side * side;
    float(*positions)[3] = malloc(vertex_count * sizeof(*positions));
    uint32_t *indices = malloc((size_t)sheets * SHEET_CELLS * SHEET_CELLS * 6 * sizeof(*indices)), index_count = 0;
    for (uint32_t i = 0; i < vertex_count; i++) {
        uint32_t sheet = i / (side * side), x = i % side, y = i / side % side;
        float u = (float)x / SHEET_CELLS, v = (float)y / SHEET_CELLS;
        positions[i][0] = 2 * u - 1;
        positions[i][1] = 2 * v - 1;
        positions[i][2] = 1.8f * ((float)sheet / (float)sheets) - 0.9f +
                          0.4f / (float)sheets * sinf(12 * u + (float)sheet) * cosf(9 * v);
        if (x < SHEET_CELLS && y < SHEET_CELLS) {
            const uint32_t quad[6] = {i, i + 1, i + side, i + side, i + 1, i + side + 1};
            memcpy(&indices[index_count], quad, sizeof(quad));
            index_count += 6;
        }
    }
    test_mesh(&edits, 1, (const float(*)[3])positions, vertex_count, indices, index_count / 3);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    free(positions);
    free(indices);
    return edits.scene;
}

static void build(struct ldc_builder *builder, struct ldc_store *store, struct scene_gpu *gpu,
                  const struct bench *bench, const uint32_t *instances, const struct tracer_options *options,
                  struct bench_runs *runs)
{
    struct error error = {0};
    struct ldc_cube *cube = &store->cubes[TRACER_CUBE_STATIC];
    float longest = 0;
    for (int k = 0; k < 3; k++)
        longest = fmaxf(longest, gpu->upper_world[k] - gpu->lower_world[k]);
    cube->resolution = bench->resolution;
    cube->cell_world = longest / (float)bench->resolution;
    memcpy(cube->lower_world, gpu->lower_world, sizeof(cube->lower_world));
    glFinish();
    uint64_t begin_ns = clock_now_ns();
    require(ldc_build(builder, store, TRACER_CUBE_STATIC, gpu, instances, gpu->instance_count, options, &error),
            &error);
    glFinish();
    if (runs)
        bench_add(runs, clock_now_ns() - begin_ns);
}

static void compare(struct bench *bench, const char *name, struct scene *scene)
{
    static const struct tracer_options forms[2] = {{.ldc_build = LDC_BUILD_LISTS}, {.ldc_build = LDC_BUILD_PEEL}};
    struct error error = {0};
    struct scene_gpu gpu;
    struct scene_changes changes;
    struct ldc_store store;
    struct bench_runs runs[2] = {0};
    uint32_t samples[2] = {0};
    scene_gpu_init(&gpu, bench->device);
    require(scene_gpu_update(&gpu, scene, NULL, &changes, NULL, &error), &error);
    struct ldc_builder *builder = ldc_builder_create(bench->device, &error);
    require(builder != NULL, &error);
    ldc_store_init(&store, bench->device);
    uint32_t *instances = malloc((gpu.instance_count + 1) * sizeof(*instances));
    for (uint32_t i = 0; i < gpu.instance_count; i++)
        instances[i] = i;
    for (uint32_t run = 0; run < WARM_UPS + bench->runs; run++)
        for (int form = 0; form < 2; form++) {
            if (form == 1 && run > 0 && run < WARM_UPS)
                continue; /* once is enough for peeling */
            build(builder, &store, &gpu, bench, instances, &forms[form], run > WARM_UPS - 1 ? &runs[form] : NULL);
            samples[form] = store.cubes[TRACER_CUBE_STATIC].sample_count;
        }
    double lists = bench_figure(&runs[0]).median_ns, peel = bench_figure(&runs[1]).median_ns;
    printf("%-24s %5u layers %10u samples: lists %9.2f ms, peeling %9.2f ms, %6.2f times\n", name,
           store.cubes[TRACER_CUBE_STATIC].layers_needed, samples[0], lists / 1e6, peel / 1e6, peel / lists);
    fflush(stdout);
    bench->failed |= samples[0] != samples[1];
    ldc_builder_destroy(builder);
    ldc_store_finish(&store);
    scene_gpu_finish(&gpu);
    free(instances);
}

static void compare_model(struct bench *bench, const char *path)
{
    struct error error = {0};
    struct loaded_model model;
    require(load_model(&model, path, &error), &error);
    const char *name = strrchr(path, '/');
    compare(bench, name ? name + 1 : path, model.scene);
    load_model_finish(&model);
}

int main(int argc, char **argv)
{
    struct error error = {0};
    struct bench bench = {.resolution = 512, .runs = 5};
    int first = 1;
    for (; first + 1 < argc && argv[first][0] == '-'; first += 2) {
        if (argv[first][1] == 's')
            bench.sheets = (uint32_t)strtoul(argv[first + 1], NULL, 10);
        else if (argv[first][1] == 'r')
            bench.resolution = (uint32_t)strtoul(argv[first + 1], NULL, 10);
        else
            bench.runs = (uint32_t)strtoul(argv[first + 1], NULL, 10);
    }
    bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    require(bench.device != NULL, &error);
    static const uint32_t stacks[] = {8, 48};
    for (size_t i = 0; i < sizeof(stacks) / sizeof(stacks[0]); i++) {
        char name[32];
        if (bench.sheets > 0 && bench.sheets != stacks[i])
            continue;
        snprintf(name, sizeof(name), "%u sheets", stacks[i]);
        struct scene *scene = stack_scene(stacks[i]);
        compare(&bench, name, scene);
        scene_destroy(scene);
    }
    for (int i = first; i < argc; i++)
        compare_model(&bench, argv[i]);
    if (!gpu_check(bench.device, "bench_ldc_build", &error))
        require(false, &error);
    gpu_device_destroy(bench.device);
    return bench.failed;
}
