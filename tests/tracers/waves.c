/* SPDX-License-Identifier: MIT */
/* Waves: of any number of rays, in parts, with rays that are none, and such as do not fit. */
#include "tests/tracers/contract.h"

#include "shared/wave.h"

#include <float.h>

#define FAR 1e30f

static void expect_same_until(const void *got, const void *whole, size_t item_bytes, uint32_t count,
                              const char *what)
{
    const uint8_t *a = got, *b = whole;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const uint32_t *words = (const uint32_t *)(const void *)(a + i * item_bytes);
        if (i < count && memcmp(a + i * item_bytes, b + i * item_bytes, item_bytes) != 0)
            fail_msg("%s, a wave of %u: ray %u has another answer", what, count, i);
        for (size_t word = 0; i >= count && word < item_bytes / 4; word++)
            if (words[word] != UNTOUCHED)
                fail_msg("%s, a wave of %u: something is written for ray %u", what, count, i);
    }
}

CHECK(a_wave_of_any_size_has_the_answers_of_its_rays_and_no_others, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    static const uint32_t counts[] = {1, 2, 63, 193, 777};
    struct fixture fixture;
    fixture_init(&fixture, of->tracer, test_scene_translucent());
    struct hit *hits = fixture_trace(&fixture, WAVE_CLOSEST, RAY_COUNT);
    uint32_t *visibilities = fixture_trace(&fixture, WAVE_ANY, RAY_COUNT);
    for (size_t i = 0; i < sizeof(counts) / sizeof(counts[0]); i++) {
        struct hit *some_hits = fixture_trace(&fixture, WAVE_CLOSEST, counts[i]);
        uint32_t *some_visibilities = fixture_trace(&fixture, WAVE_ANY, counts[i]);
        expect_same_until(some_hits, hits, sizeof(*hits), counts[i], "closest");
        expect_same_until(some_visibilities, visibilities, sizeof(*visibilities), counts[i], "any");
        free(some_hits);
        free(some_visibilities);
    }
    free(hits);
    free(visibilities);
    fixture_finish(&fixture);
}

CHECK(a_wave_in_steps_has_the_answers_of_the_whole, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    const uint32_t count = 1777; /* no multiple of anything */
    struct fixture fixture;
    fixture_init(&fixture, of->tracer, test_scene_translucent());
    for (int any = 0; any < 2; any++) {
        const enum wave_kind kind = any ? WAVE_ANY : WAVE_CLOSEST;
        const size_t item_bytes = any ? sizeof(uint32_t) : sizeof(struct hit);
        void *whole = fixture_trace(&fixture, kind, count);
        for (uint32_t step_rays = 0; step_rays <= 768; step_rays += 768) {
            void *answers = fixture_trace_in_steps(&fixture, kind, count, step_rays);
            expect_same_until(answers, whole, item_bytes, count, any ? "any" : "closest");
            free(answers);
        }
        free(whole);
    }
    fixture_finish(&fixture);
}

/* Those that are dead, or not a number, in any place; beside them one that lives. */
CHECK(dead_rays_and_directions_that_are_none_hit_nothing, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    const float bad[] = {NAN, INFINITY, -INFINITY, 0},
                extreme[] = {1e-42f, FLT_MAX}; /* lengths that floats lack */
    const float middle[3] = {0.1f, 0.2f, 0.03f}, right[3] = {1, 0, 0};
    struct ray rays[64];
    struct hit hits[64];
    uint32_t visibilities[64], count = 0;
    struct fixture fixture;
    fixture_init(&fixture, of->tracer, scene_of_boxes(1));
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
        rays[count++] = ray_from(middle, (const float[3]){bad[i], bad[i], bad[i]}, 0, FAR);
    for (int k = 0; k < 3; k++) {
        float origin[3] = {0.1f, 0.2f, 0.03f}, direction[3] = {0.5f, 0.6f, 0.7f};
        direction[k] = NAN;
        rays[count++] = ray_from(middle, direction, 0, FAR);
        direction[k] = 0.5f;
        origin[k] = NAN;
        rays[count++] = ray_from(origin, direction, 0, FAR);
        origin[k] = INFINITY;
        rays[count++] = ray_from(origin, direction, 0, FAR);
    }
    /* From where a float's step is larger than the scene. */
    rays[count++] = ray_from((const float[3]){-1e20f, -1e20f, -1e20f}, (const float[3]){1, 0.9f, 1.1f}, 0, FAR);
    rays[count++] = ray_from((const float[3]){3e11f, 0.1f, 0.2f}, (const float[3]){-1, 0.2f, 0.1f}, 0, FAR);
    rays[count++] = ray_from(middle, right, 1, 1);
    rays[count++] = ray_from(middle, right, 0, -1);
    rays[count++] = ray_from(middle, right, 0, NAN);
    rays[count++] = ray_from(middle, right, NAN, FAR);
    const uint32_t living = count;
    rays[count++] = ray_from(middle, right, 0, FAR);
    rays[count++] = ray_from(middle, right, 0, INFINITY);
    const uint32_t known = count;
    for (size_t i = 0; i < sizeof(extreme) / sizeof(extreme[0]); i++) /* may do as they like */
        rays[count++] = ray_from(middle, (const float[3]){extreme[i], extreme[i], extreme[i]}, 0, FAR);
    fixture_trace_rays(&fixture, WAVE_CLOSEST, rays, count, hits);
    fixture_trace_rays(&fixture, WAVE_ANY, rays, count, visibilities);
    for (uint32_t i = 0; i < known; i++) {
        if (hits[i].material & HIT_UNKNOWN) { /* a view may not see there */
            const struct seen_answer seen = fixture_seen(&fixture, &rays[i]);
            if (seen_knows(&seen, i < living ? (double)rays[i].direction_t_max[3] : 0.4))
                fail_msg("ray %u: it is not known", i);
            continue;
        }
        if ((hits[i].distance < 0) != (i < living))
            fail_msg("ray %u: distance %g", i, (double)hits[i].distance);
        if (visibilities[i] != (i < living ? 0xffffffffu : 0))
            fail_msg("ray %u: visibility %08x", i, visibilities[i]);
    }
    fixture_finish(&fixture);
}

CHECK(a_wave_that_does_not_fit_its_buffers_is_refused, 0)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, of->tracer, test_scene_soup());
    free(fixture_trace(&fixture, WAVE_CLOSEST, 1));
    struct wave wave = {.ray_count = RAY_COUNT + 1, .rays = &fixture.rays, .hits = &fixture.answers};
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    wave.ray_count = 0;
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, NULL));
    wave.ray_count = RAY_COUNT;
    wave.family = WAVE_FAMILIES;
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, NULL));
    fixture_finish(&fixture);
}

/* The host knows no more than how many there are at most. */
CHECK(rays_that_the_device_counts_get_the_same_answers, 0)
{
    const struct contract_case *of = *state;
    const struct wave_counts counts = {.count = 1000, .groups_x = 16, .groups_y = 1, .groups_z = 1};
    struct gpu_buffer small = {0}, buffer = {0};
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, of->tracer, test_scene_soup());
    struct hit *expected = fixture_trace(&fixture, WAVE_CLOSEST, RAY_COUNT);
    struct hit *hits = malloc(RAY_COUNT * sizeof(*hits));
    expect_ok(gpu_buffer_upload(device, &small, &counts, sizeof(counts) - 4, &error) &&
                  gpu_buffer_upload(device, &buffer, &counts, sizeof(counts), &error),
              &error);
    struct wave wave = {.ray_count = RAY_COUNT, .counts = &small, .rays = &fixture.rays, .hits = &fixture.answers};
    gpu_scene_bind(&fixture.gpu);
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    wave.counts = &buffer;
    expect_ok(tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error), &error);
    gpu_buffer_read(device, &fixture.answers, 0, hits, counts.count * sizeof(*hits));
    assert_memory_equal(hits, expected, counts.count * sizeof(*hits));
    gpu_buffer_finish(device, &small);
    gpu_buffer_finish(device, &buffer);
    free(hits);
    free(expected);
    fixture_finish(&fixture);
}

CHECK(a_structure_that_is_not_up_to_date_is_not_traced, 0)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, of->tracer, test_scene_soup());
    free(fixture_trace(&fixture, WAVE_CLOSEST, 1));
    const struct wave wave = {.ray_count = RAY_COUNT, .rays = &fixture.rays, .hits = &fixture.answers};
    tracer_outdate(fixture.tracer);
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    fixture_update(&fixture);
    free(fixture_trace(&fixture, WAVE_CLOSEST, RAY_COUNT));
    fixture_finish(&fixture);
}
