/* SPDX-License-Identifier: MIT */
/* Tracers that sample against the reference: how far apart two pictures are, and the reference's waves of
 * secondary rays answered by both. What they measure is printed; what is asked of a tracer is in its own test. */
#ifndef FARLIGHT_TESTS_AGAINST_REFERENCE_H
#define FARLIGHT_TESTS_AGAINST_REFERENCE_H

#include "tests/fixtures/structure.h"
#include "tests/accuracy/ldc_scenes.h"

#include "trace/tracer.h"

#define SIDE 192u

/* The reference, or bvh where a build leaves it out: their hits are the same. */
static inline unsigned exact_tracer(void)
{
    return tracer_impl_by_number(TRACER_REFERENCE) ? TRACER_REFERENCE : TRACER_BVH;
}

/* ---- pictures ---- */

/* In dB, of the colours of two pictures of PIXEL_FORMAT_RGBA8. */
static inline double psnr(const struct frame_result *a, const struct frame_result *b)
{
    double sum = 0, count = 0;
    assert_int_equal(a->size_bytes, b->size_bytes);
    for (size_t i = 0; i < a->size_bytes; i++) {
        if (i % 4 == 3)
            continue;
        double difference = (double)a->pixels[i] - (double)b->pixels[i];
        sum += difference * difference;
        count++;
    }
    return sum > 0 ? 10 * log10(255.0 * 255.0 * count / sum) : INFINITY;
}

static inline void request_picture(struct fixture *fixture, uint32_t depth)
{
    struct frame_request *request = &fixture->request;
    request->width = request->height = SIDE;
    request->format = PIXEL_FORMAT_RGBA8;
    request->depth = depth;
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
}

/* Where a scene lies. */
struct extent {
    float lower_world[3], upper_world[3];
    float diagonal; /* metres; lamps belong to it */
};

static inline struct extent scene_extent(struct fixture *fixture)
{
    struct gpu_scene gpu;
    struct scene_changes changes;
    struct error error = {0};
    struct extent extent;
    gpu_scene_init(&gpu, fixture->device);
    assert_true(gpu_scene_update(&gpu, fixture->scene, NULL, &changes, NULL, &error));
    memcpy(extent.lower_world, gpu.lower_world, sizeof(extent.lower_world));
    memcpy(extent.upper_world, gpu.upper_world, sizeof(extent.upper_world));
    extent.diagonal = gpu.diagonal;
    gpu_scene_finish(&gpu);
    return extent;
}

/* ---- rays ---- */

/* Of secondary rays that two tracers answered. */
struct agreement {
    uint64_t rays;
    double agreed;       /* the share of them for which both have a hit, or none */
    double median_cells; /* of differences of distances, in the worst wave */
    double most_cells;   /* what 99 in 100 of them are below, in the worst wave */
};

/* The reference's own waves, its secondary rays answered by `tracer` too. */
static inline struct agreement compare_rays(struct fixture *fixture, unsigned tracer, const char *name,
                                            float cell_metres)
{
    double cells = (double)scene_extent(fixture).diagonal / (double)cell_metres; /* errors come in diagonals */
    fixture->request.tracer = exact_tracer();
    fixture->request.compare = true;
    fixture->request.compare_with = tracer;
    struct frame_result result = fixture_render(fixture);
    fixture->request.compare = false;
    struct agreement found = {0};
    uint64_t disagreed = 0, compared = 0;
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct wave_comparison *wave = &result.comparisons[i];
        static const char *const kinds[] = {"primary", "secondary", "shadow"};
        uint64_t apart = wave->only_first + wave->only_second;
        double agreed = 1 - (double)apart / (double)(wave->rays ? wave->rays : 1);
        double median_cells = (double)wave->distance_median * cells,
               most_cells = (double)wave->distance_p99 * cells;
        printf("%s, wave %u, %s: %llu rays, %.3f %% agree on hit or miss, median distance %.4f cells, 99 %% below "
               "%.3f\n",
               name, wave->wave, kinds[wave->kind], (unsigned long long)wave->rays, 100 * agreed, median_cells,
               most_cells);
        if (wave->kind != RAY_SECONDARY)
            continue;
        found.rays += wave->rays;
        disagreed += apart;
        if (wave->both_hit > 100) {
            found.median_cells = fmax(found.median_cells, median_cells);
            found.most_cells = fmax(found.most_cells, most_cells);
            compared++;
        }
    }
    frame_result_finish(&result);
    assert_in_range(found.rays, SIDE * SIDE / 20, UINT64_MAX); /* else nothing would have been shown */
    assert_true(compared > 0);
    found.agreed = 1 - (double)disagreed / (double)found.rays;
    return found;
}

static inline void expect_agreement(const char *name, const struct agreement *found, const struct agreement *asked)
{
    if (!(found->agreed >= asked->agreed))
        fail_msg("%s: %.3f %% of %llu rays agree on hit or miss", name, 100 * found->agreed,
                 (unsigned long long)found->rays);
    if (!(found->median_cells <= asked->median_cells))
        fail_msg("%s: the median distance is %.3f cells off", name, found->median_cells);
    if (!(found->most_cells <= asked->most_cells))
        fail_msg("%s: one in 100 distances is %.3f cells off", name, found->most_cells);
}

/* For each of some shapes, as mirrors and as glass, calls `check` with a scene of two of them, so that there is
 * something to be mirrored, a picture of it requested by `request`, and the size of a cell of `tracer`. */
static inline void with_pairs_of_shapes(void **state, unsigned tracer, void (*request)(struct fixture *fixture),
                                        void (*check)(struct fixture *fixture, const char *name,
                                                      float cell_metres))
{
    struct fixture *fixture = *state;
    static const struct {
        const char *name;
        enum shape shape;
        uint32_t steps;
    } rows[] = {
        {"a sphere", SHAPE_SPHERE, 128}, {"a torus", SHAPE_TORUS, 128}, {"a bumpy sphere", SHAPE_BUMPY, 224}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        for (int inside = 0; inside < 2; inside++) {
            char name[64];
            snprintf(name, sizeof(name), "%s%s", rows[i].name, inside ? " of glass" : "");
            fixture_clear(state);
            struct scene_material *material = fixture_material(fixture);
            uint32_t id = material->base.id;
            material->roughness = 0.05f;
            material->metallic = inside ? 0.0f : 1.0f;
            material->transmission = inside ? 1.0f : 0.0f;
            material->ior = 1.5f;
            add_shape(fixture, rows[i].shape, rows[i].steps, id, 1, 0.4f, -0.9f, 0, 0);
            add_shape(fixture, rows[i].shape, rows[i].steps, id, 1, 1.1f, 0.95f, 0.2f, 0.4f);
            fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
            request(fixture);
            fixture_look(fixture, 1.5f, 2.2f, 4.5f, 0.7f);
            fixture->request.tracer = tracer;
            fixture->request.width = fixture->request.height = 16; /* for the size of a cell */
            struct frame_result result = fixture_render(fixture);
            fixture->request.width = fixture->request.height = SIDE;
            float cell_metres =
                structure_row(&result.structure, tracer == TRACER_LDC ? "static/cell" : "cell").measure;
            frame_result_finish(&result);
            check(fixture, name, cell_metres);
        }
    }
}

#endif
