/* SPDX-License-Identifier: MIT */
/* Calls of the driver while a frame is made: calls that stall, or wait for more than they need, show in no
 * picture. Every device is treated as hardware. Programs that no run has left on the disk are compiled ahead
 * by other threads, on contexts of their own: only calls of the thread that makes the frame count. */
#include "protocol/tracers.h"
#include "shared/layers.h"
#include "render/passes/layers/layers.h"
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

#include <epoxy/gl.h>

/* In which passes access buffers. */
#define KINDS                                                                                                     \
    (GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |          \
     GL_UNIFORM_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT |                       \
     GL_BUFFER_UPDATE_BARRIER_BIT)

static struct gpu_facts facts_before;
static _Thread_local bool is_watched;
static PFNGLMEMORYBARRIERPROC barrier_of_driver;
static PFNGLDISPATCHCOMPUTEPROC dispatch_of_driver;
static PFNGLDISPATCHCOMPUTEINDIRECTPROC dispatch_indirect_of_driver;
static PFNGLGETUNIFORMLOCATIONPROC location_of_driver;
static struct {
    unsigned locations, resets, dispatches, barriers;
    GLbitfield kinds;     /* kinds that a barrier since the previous dispatch waited for */
    GLbitfield all_kinds; /* in all */
} calls;

static GLint noted_location(GLuint program, const GLchar *name)
{
    calls.locations += is_watched;
    return location_of_driver(program, name);
}

static GLenum noted_reset(void)
{
    calls.resets += is_watched;
    return GL_NO_ERROR;
}

static void noted_barrier(GLbitfield kinds)
{
    if (is_watched) {
        calls.barriers++;
        calls.kinds |= kinds;
        calls.all_kinds |= kinds;
    }
    barrier_of_driver(kinds);
}

static void note_dispatch(void)
{
    if (!is_watched)
        return;
    calls.dispatches++;
    calls.kinds = 0;
}

static void noted_dispatch(GLuint x, GLuint y, GLuint z)
{
    note_dispatch();
    dispatch_of_driver(x, y, z);
}

static void noted_dispatch_indirect(GLintptr offset)
{
    if (is_watched && !(calls.kinds & GL_COMMAND_BARRIER_BIT))
        fail_msg("a dispatch whose size the device has written waits for 0x%x", calls.kinds);
    note_dispatch();
    dispatch_indirect_of_driver(offset);
}

static int watch_driver(void **state)
{
    struct error error = {0};
    fixture_setup(state);
    facts_before = device->facts;
    gpu_facts_choose(&device->facts, false);
    /* epoxy finds a function at its first call, and writes it where ours is to stand. */
    const GLchar *nothing = "#version 450 core\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
    const GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &nothing);
    glUseProgram(program);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, device->empty_buffer);
    glDispatchCompute(1, 1, 1);
    glDispatchComputeIndirect(0);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    (void)glGetUniformLocation(program, "none");
    glDeleteProgram(program);
    if (!gpu_check_reset(device, "the first calls", &error))
        fail_msg("%s", error.text);
    barrier_of_driver = epoxy_glMemoryBarrier;
    dispatch_of_driver = epoxy_glDispatchCompute;
    dispatch_indirect_of_driver = epoxy_glDispatchComputeIndirect;
    location_of_driver = epoxy_glGetUniformLocation;
    epoxy_glMemoryBarrier = noted_barrier;
    epoxy_glDispatchCompute = noted_dispatch;
    epoxy_glDispatchComputeIndirect = noted_dispatch_indirect;
    epoxy_glGetUniformLocation = noted_location;
    epoxy_glGetGraphicsResetStatus = noted_reset;
    is_watched = true;
    return 0;
}

static int leave_driver(void **state)
{
    device->facts = facts_before;
    return fixture_teardown(state);
}

ALL_TESTS(watch_driver, leave_driver)
EACH_TEST(fixture_clear, NULL)

static void expect_few_calls(struct fixture *fixture, unsigned tracer, unsigned integrator, unsigned samples,
                             enum primary_kind primary)
{
    memset(&calls, 0, sizeof(calls));
    fixture->request.light.integrator = integrator;
    fixture->request.light.depth = 4;
    fixture->request.sampling.samples = samples;
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracing.primary = primary;
    struct frame_result result = fixture_render(fixture);
    frame_result_finish(&result);
    assert_int_equal(calls.locations, 0);
    assert_int_equal(calls.all_kinds & ~(GLbitfield)KINDS, 0);
    assert_in_range(calls.dispatches, 5, UINT32_MAX);
    assert_in_range(calls.barriers, 1, 2 * calls.dispatches);
}

TEST(passes_look_no_uniform_up_and_wait_for_kinds_of_access)
{
    fixture_mixture(*state);
    expect_few_calls(*state, TRACER_BVH, INTEGRATOR_WHITTED, 1, PRIMARY_RASTER);
}

TEST_LONG(so_do_those_of_other_tracers_integrators_and_layers)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_NAIVE, TRACER_BVH, TRACER_LDC, TRACER_ABUFFER},
                          integrators[] = {INTEGRATOR_WHITTED, INTEGRATOR_PATH, INTEGRATOR_AO};
    fixture_mixture(fixture);
    fixture->request.picture.layers = LAYER_BITS_SEEN | LAYER_BITS_CRYPTO;
    for (unsigned i = 0; i < 3; i++)
        for (unsigned k = 0; k < 4; k++)
            expect_few_calls(fixture, tracers[k], integrators[i], 2, (i + k) % 2 ? PRIMARY_TRACE : PRIMARY_RASTER);
}

/* Each slice has dozens of passes. */
TEST(the_driver_is_not_asked_for_a_reset_in_every_pass)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    fixture->request.light.depth = 4;
    fixture->request.tracing.tracer = TRACER_BVH;
    for (unsigned ahead = 0; ahead < 2; ahead++) {
        frame_renderer_queue_ahead(fixture->renderer, ahead);
        struct frame_result first = fixture_render(fixture);
        memset(&calls, 0, sizeof(calls));
        struct frame_result second = fixture_render(fixture);
        assert_in_range(calls.resets, 1, calls.dispatches / 8);
        frame_result_finish(&first);
        frame_result_finish(&second);
    }
}

static unsigned dispatches_of_frame(struct fixture *fixture)
{
    struct frame_result first = fixture_render(fixture); /* tells how many waves there are */
    frame_result_finish(&first);
    memset(&calls, 0, sizeof(calls));
    struct frame_result second = fixture_render(fixture);
    frame_result_finish(&second);
    return calls.dispatches;
}

/* Up to four, as far as the device has memory for their shadow rays. */
TEST(several_lights_take_no_more_passes_than_one)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture); /* two lights */
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    fixture->request.light.depth = 4;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    frame_renderer_queue_ahead(fixture->renderer, true);
    const unsigned with_two = dispatches_of_frame(fixture);
    fixture_light(fixture, LIGHT_POINT, 1.0f, 3.0f, 3.0f, 20.0f);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 3.0f, 3.0f, 20.0f);
    fixture_commit(fixture);
    assert_int_equal(dispatches_of_frame(fixture), with_two);
    frame_renderer_queue_ahead(fixture->renderer, false);
}
