/* SPDX-License-Identifier: MIT */
/* Samples: {"name", "structure", "bytes", "build_ns": [..]} of a cube's samples alone, from triangles to packed
 * and sorted samples with their surfaces: what peeling and lists do each in its way. What leads over emptiness,
 * which is built behind either, is left out. */
#include "tests/bench/bench_forms.h"

#include "base/clock.h"
#include "trace/ldc/build.h"

#include <epoxy/gl.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RESOLUTION_DEFAULT 1024u
/* Lists learn from build to build how deep the images are. Peeling has only programs to compile. */
#define WARM_UPS_LISTS 5u
#define WARM_UPS_PEEL 1u

struct sampled {
    struct ldc_builder *builder;
    struct ldc_store store;
    struct bench_runs runs;
};

static void place(struct ldc_cube *cube, const struct gpu_scene *gpu, uint32_t resolution)
{
    float longest = 0;
    for (int k = 0; k < 3; k++)
        longest = fmaxf(longest, gpu->upper_world[k] - gpu->lower_world[k]);
    *cube = (struct ldc_cube){.resolution = resolution ? resolution : RESOLUTION_DEFAULT};
    cube->cell_world = longest / (float)(cube->resolution - 2);
    for (int k = 0; k < 3; k++)
        cube->lower_world[k] = gpu->lower_world[k] - cube->cell_world;
}

static bool build(struct bench_forms *bench, const struct bench_form *form, struct sampled *sampled,
                  const uint32_t *instances, bool counts, struct error *error)
{
    struct gpu_scene *gpu = &bench->scene.gpu;
    place(&sampled->store.cubes[LDC_CUBE_STATIC], gpu, form->options.ldc.resolution);
    glFinish();
    const uint64_t start_ns = clock_now_ns();
    gpu_scene_bind(gpu);
    enum tracer_progress progress = ldc_build_begin(sampled->builder, &sampled->store, LDC_CUBE_STATIC, gpu,
                                                    instances, gpu->instance_count, &form->options, error);
    while (progress == TRACER_MORE)
        progress = ldc_build_go_on(sampled->builder, true, error);
    glFinish();
    const bool built = progress == TRACER_DONE;
    if (built && counts)
        bench_add(&sampled->runs, clock_now_ns() - start_ns);
    return built;
}

/* The forms take turns. */
static bool build_all(struct bench_forms *bench, struct sampled *sampled, const uint32_t *instances,
                      struct error *error)
{
    for (unsigned run = 0; run < WARM_UPS_LISTS + bench->runs; run++) {
        for (unsigned i = 0; i < bench->form_count; i++) {
            const struct bench_form *form = &bench->forms[i];
            const bool peels = form->options.ldc.build == LDC_BUILD_PEEL;
            if (peels && run >= WARM_UPS_PEEL && run < WARM_UPS_LISTS)
                continue;
            if (!build(bench, form, &sampled[i], instances, run >= WARM_UPS_LISTS, error))
                return false;
        }
    }
    return gpu_check(bench->device, "bench_forms samples", error);
}

static json_t *describe(const struct bench_form *form, const struct sampled *sampled)
{
    struct structure_rows structure = {0};
    ldc_cube_tell(&sampled->store, LDC_CUBE_STATIC, true, &structure);
    return json_pack("{s:s, s:o, s:I, s:o}", "name", form->name, "structure", bench_structure_json(&structure),
                     "bytes", (json_int_t)(ldc_store_bytes(&sampled->store) + ldc_builder_bytes(sampled->builder)),
                     "build_ns", bench_times_json(&sampled->runs));
}

static bool begin(struct bench_forms *bench, struct sampled *sampled, struct error *error)
{
    for (unsigned i = 0; i < bench->form_count; i++) {
        if (bench->forms[i].tracer != TRACER_LDC)
            return error_set(error, ERROR_INVALID, "--form", "%s has no samples", bench->forms[i].name);
        ldc_store_init(&sampled[i].store, bench->device);
        sampled[i].builder = ldc_builder_create(bench->device, error);
        if (!sampled[i].builder)
            return false;
    }
    return true;
}

json_t *bench_forms_samples(struct bench_forms *bench, struct error *error)
{
    const uint32_t count = bench->scene.gpu.instance_count;
    struct sampled sampled[BENCH_FORMS_MAX] = {0};
    json_t *list = NULL;
    uint32_t *instances = malloc(((size_t)count + 1) * sizeof(*instances));
    for (uint32_t i = 0; instances && i < count; i++)
        instances[i] = i;
    if (!instances)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a list of instances");
    else if (begin(bench, sampled, error) && build_all(bench, sampled, instances, error)) {
        list = json_array();
        for (unsigned i = 0; i < bench->form_count; i++)
            json_array_append_new(list, describe(&bench->forms[i], &sampled[i]));
    }
    for (unsigned i = 0; i < bench->form_count; i++) {
        ldc_builder_destroy(sampled[i].builder);
        if (sampled[i].store.device)
            ldc_store_finish(&sampled[i].store);
    }
    free(instances);
    return list;
}
