/* SPDX-License-Identifier: MIT */
/* Views in the engine, with a renderer that the tests control: the newest camera, refinement, replacing, credit.
 */
#include "engine_fake.h"

#include "base/clock.h"
#include "job/view_wishes.h"

/* Frames need 1 sample of 4, so that they refine; the bound of frames a second is out of the way. */
static struct engine_command *view(uint64_t client, uint32_t request, struct view_wishes *wishes)
{
    struct engine_command *made = render(client, request, 0, UINT32_MAX);
    made->job.kind = JOB_VIEW;
    made->job.frames_per_second = 100000;
    made->job.frame.samples = 4;
    made->job.pass_samples = 1;
    made->job.weight = 1;
    made->job.encoding = ENCODING_JPEG;
    made->job.quality = 80;
    made->job.still_encoding = ENCODING_RAW;
    made->job.wishes = view_wishes_ref(wishes);
    return made;
}

/* From 5 m away, at the height of the command's number. */
static struct view_camera camera(uint64_t number, bool moving)
{
    return (struct view_camera){
        .command = number,
        .received_ns = 1000 + number,
        .moving = moving,
        .key = {.eye_world = {0, (float)number, 5}, .up_world = {0, 1, 0}, .fov_y = 1},
    };
}

static void look(struct engine *engine, struct view_wishes *wishes, uint64_t number, bool moving)
{
    struct view_camera made = camera(number, moving);
    if (view_wishes_look(wishes, &made))
        submit(engine, command(ENGINE_VIEW_LOOK, 1, 0));
}

static struct engine_frame *take(struct engine_event *event)
{
    struct engine_frame *frame = event->frame;
    event->frame = NULL;
    engine_event_destroy(event);
    return frame;
}

static void drop(struct engine_frame *frame)
{
    frame_result_finish(&frame->result);
    free(frame->bytes);
    free(frame);
}

static void a_frame_tells_of_the_camera_that_it_shows(void **state)
{
    (void)state;
    struct engine *engine = start((struct engine_options){0});
    struct view_wishes *wishes = view_wishes_create();
    open_scene(engine, 1, 1);
    struct engine_command *made = view(1, 2, wishes);
    made->job.first_frame = 5;
    made->job.frame.samples = 1;
    submit(engine, made);
    struct engine_frame *first = take(expect_frame(engine, 1, 2, 5));
    assert_int_equal(first->command, 0);
    assert_int_equal(first->received_ns, 0);
    assert_false(first->moving);
    assert_true(first->key_frame);
    drop(first);
    expect_silence(engine); /* nothing changes, and there are enough samples */
    uint64_t before_ns = clock_now_ns();
    look(engine, wishes, 7, true);
    struct engine_frame *frame = take(expect_frame(engine, 1, 2, 6));
    assert_int_equal(frame->command, 7);
    assert_int_equal(frame->received_ns, 1007);
    assert_true(frame->moving);
    assert_true(before_ns <= frame->applied_ns && frame->applied_ns <= frame->rendered_ns);
    assert_true(frame->rendered_ns <= frame->encoded_ns && frame->encoded_ns <= clock_now_ns());
    /* The eye is the camera's place. */
    assert_true(frame->request.camera.world_from_view[7] == 7.0f);
    assert_true(frame->request.camera.world_from_view[11] == 5.0f);
    drop(frame);
    expect_silence(engine);
    view_wishes_unref(wishes);
    stop(engine);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_frame_tells_of_the_camera_that_it_shows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
