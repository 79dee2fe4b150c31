/* SPDX-License-Identifier: MIT */
/* Pictures of tracers that sample against those of the reference. What is primary is rasterised in both, as in
 * every frame without a lens. */
#ifndef FARLIGHT_TESTS_AGAINST_REFERENCE_H
#define FARLIGHT_TESTS_AGAINST_REFERENCE_H

#include "tests/accuracy/sampled_scenes.h"
#include "tests/fixtures/structure.h"

#include "trace/tracer.h"

#define SIDE 192u

/* The reference, or bvh where a build leaves it out: their hits are the same. */
static inline unsigned exact_tracer(void)
{
    return tracer_impl_by_number(TRACER_REFERENCE) ? TRACER_REFERENCE : TRACER_BVH;
}

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
    request->picture.width = request->picture.height = SIDE;
    request->picture.format = PIXEL_FORMAT_RGBA8;
    request->light.depth = depth;
    fixture_set_camera(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
}

#endif
