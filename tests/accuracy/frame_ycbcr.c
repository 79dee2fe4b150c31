/* SPDX-License-Identifier: MIT */
/* Pictures that the device converts to Y'CbCr are those that it gives as RGBA8, converted. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/accuracy/ycbcr_exact.h"
#include "tests/harness/test.h"

/* The nearest code lies within a half; the rest is of single precision, which near 255 errs by some 2e-5 a step.
 */
#define TOLERANCE 0.501

/* A mirror, and colours of all kinds behind it, some beyond white, up to where nothing is. */
static void build_scene(struct fixture *fixture)
{
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.8f, 0.5f, mirror->base.id);
    for (int i = 0; i < 12; i++) {
        struct scene_material *glow = fixture_material(fixture);
        for (int k = 0; k < 3; k++)
            glow->value.emission[k] = (float)((i * (k + 3) + k) % 7) / (i < 9 ? 6.0f : 2.0f);
        float angle = (float)i * 0.5236f;
        fixture_sphere(fixture, 1.1f * cosf(angle), 1.1f * sinf(angle), 0.0f, 0.45f, glow->base.id);
    }
    fixture_commit(fixture);
    fixture->request.picture.format = PIXEL_FORMAT_RGBA8;
    fixture->request.sampling.samples = 4;
    fixture->request.light.depth = 2;
    fixture->request.tracing.tracer = TRACER_BVH;
}

static void assert_code(const char *plane, uint32_t x, uint32_t y, uint8_t code, double exact)
{
    double expected = exact < 255 ? exact : 255;
    if (fabs(code - expected) > TOLERANCE)
        fail_msg("%s at %u, %u is %u, and %.4f of the pixels", plane, x, y, code, expected);
}

static void assert_planes(const struct frame_result *result, const struct exact_picture *picture)
{
    const struct ycbcr_planes planes = ycbcr_planes_at(result->pixels, result->width);
    uint32_t columns = result->width + (result->width & 1), rows = ycbcr_row_count(result->height);
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x < columns; x++)
            assert_code("luma", x, y, planes.y[y * planes.y_stride_bytes + x], exact_luma(picture, x, y));
    for (uint32_t y = 0; y < rows / 2; y++) {
        for (uint32_t x = 0; x < columns / 2; x++) {
            assert_code("Cb", x, y, planes.cb[y * planes.c_stride_bytes + x], exact_chroma(picture, 0, x, y));
            assert_code("Cr", x, y, planes.cr[y * planes.c_stride_bytes + x], exact_chroma(picture, 1, x, y));
        }
    }
}

/* The picture that is there as RGBA8, once more in that form. */
static struct frame_result convert(struct fixture *fixture, enum ycbcr kind)
{
    fixture->request.ycbcr = kind;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.ycbcr, kind);
    assert_int_equal(result.format, PIXEL_FORMAT_RGBA8);
    fixture->request.ycbcr = YCBCR_NONE;
    return result;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(planes_are_those_of_the_pixels_at_any_size)
{
    struct fixture *fixture = *state;
    /* Odd ones, those that fill a tile or a word less or more by one, and one of several bands. */
    static const uint32_t sizes[][2] = {{1, 1}, {2, 2}, {7, 5}, {8, 8}, {9, 17}, {64, 31}, {701, 903}};
    const size_t count = sizeof(sizes) / sizeof(*sizes) - (getenv("FARLIGHT_TEST_LONG") ? 0 : 1);
    build_scene(fixture);
    for (size_t i = 0; i < count; i++) {
        fixture->request.picture.width = sizes[i][0];
        fixture->request.picture.height = sizes[i][1];
        struct frame_result pixels = fixture_render(fixture);
        assert_int_equal(pixels.ycbcr, YCBCR_NONE);
        for (enum ycbcr kind = YCBCR_VIDEO; kind <= YCBCR_JPEG; kind++) {
            struct frame_result planes = convert(fixture, kind);
            assert_int_equal(planes.size_bytes, (sizes[i][0] + 7) / 8 * 12 * ((sizes[i][1] + 1) / 2 * 2));
            assert_planes(&planes, &(struct exact_picture){pixels.pixels, sizes[i][0], sizes[i][1], kind});
            frame_result_finish(&planes);
        }
        frame_result_finish(&pixels);
    }
}

TEST(attachments_lie_behind_planes_as_behind_pixels)
{
    struct fixture *fixture = *state;
    const size_t bytes = (size_t)4 * 37 * 23;
    build_scene(fixture);
    fixture->request.picture.width = 37;
    fixture->request.picture.height = 23;
    fixture->request.attachments = 1u << ATTACHMENT_DEPTH | 1u << ATTACHMENT_NORMALS;
    struct frame_result pixels = fixture_render(fixture), planes = convert(fixture, YCBCR_VIDEO);
    assert_planes(&planes, &(struct exact_picture){pixels.pixels, 37, 23, YCBCR_VIDEO});
    assert_memory_equal(frame_result_attachment(&planes, ATTACHMENT_DEPTH),
                        frame_result_attachment(&pixels, ATTACHMENT_DEPTH), bytes);
    assert_memory_equal(frame_result_attachment(&planes, ATTACHMENT_NORMALS),
                        frame_result_attachment(&pixels, ATTACHMENT_NORMALS), bytes);
    frame_result_finish(&pixels);
    frame_result_finish(&planes);
}

/* A view that changes its encoding at rest does this. */
TEST(frames_add_up_whatever_form_each_comes_in)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    fixture->request.sampling.accumulate = true;
    struct frame_result first = convert(fixture, YCBCR_JPEG), second = fixture_render(fixture);
    assert_int_equal(second.samples, 8);
    struct frame_result third = convert(fixture, YCBCR_VIDEO);
    assert_int_equal(third.samples, 12);
    frame_result_finish(&first);
    frame_result_finish(&second);
    frame_result_finish(&third);
}

TEST(only_what_is_shown_in_8_bits_is_converted)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    build_scene(fixture);
    fixture->request.ycbcr = YCBCR_JPEG;
    fixture->request.picture.format = PIXEL_FORMAT_RGBA16F;
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(error.field, "format");
}
