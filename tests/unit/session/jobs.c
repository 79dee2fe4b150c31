/* SPDX-License-Identifier: MIT */
/* Batch jobs of a session, over a socketpair: their settings on the way to the engine, their frames on the way
 * back. */
#include "tests/unit/session/answering_engine.h"
#include "tests/unit/protocol/cases.h"

#include "session/frame_messages.h"
#include "session/frames.h"
#include "session/session.h"
#include "tests/harness/test.h"

#include <math.h>

static void expect_frame(uint32_t request, uint32_t number)
{
    expect(MESSAGE_FRAME_BEGIN, request);
    assert_int_equal(client.message.frame_begin.frame, number);
    assert_int_equal(client.message.frame_begin.size_bytes, FRAME_BYTES);
    for (size_t offset = 0; offset < FRAME_BYTES; offset += client.message.frame_data.data_bytes) {
        expect(MESSAGE_FRAME_DATA, request);
        const struct message_frame_data *data = &client.message.frame_data;
        assert_int_equal(client.header.channel, 2);
        assert_int_equal(data->offset_bytes, offset);
        for (size_t i = 0; i < data->data_bytes; i++) {
            if (data->data[i] != (uint8_t)((offset + i) * 31 + number))
                fail_msg("byte %zu of frame %u is %u", offset + i, number, data->data[i]);
        }
    }
    expect(MESSAGE_FRAME_END, request);
    assert_int_equal(client.message.frame_end.frame, number);
    bool queue = false, sent = false;
    for (uint32_t i = 0; i < client.message.frame_end.stages_count; i++) {
        queue = queue || client.message.frame_end.stages[i].stage == PROTOCOL_STAGE_QUEUE;
        sent = sent || client.message.frame_end.stages[i].stage == PROTOCOL_STAGE_SEND;
    }
    assert_true(queue && sent);
}

static void take_rest(void)
{
    while (receive()->type != MESSAGE_OK)
        continue;
}

SESSION_TEST(frames_arrive_complete_in_order_and_within_the_credit)
{
    open_scene(1, 1);
    struct message message = render_message(6, 2);
    send_message(2, 0, &message);
    expect_frame(2, 0);
    expect_frame(2, 1);
    expect_alive(3); /* and no third one */
    message = made(MESSAGE_CREDIT);
    message.credit.channel = 2;
    message.credit.total = 100;
    send_message(0, 2, &message);
    for (uint32_t frame = 2; frame <= 6; frame++)
        expect_frame(2, frame);
    expect(MESSAGE_OK, 2);
    assert_int_equal(atomic_load(&port.frames_sent), 7);
}

SESSION_TEST(a_cancelled_job_has_one_answer_and_nothing_follows_it)
{
    open_scene(1, 1);
    atomic_store(&engine.keep_jobs, true);
    struct message message = render_message(5, 10);
    send_message(2, 0, &message);
    cancel(3, 2);
    expect_error(2, PROTOCOL_ERROR_CANCELLED);
    expect(MESSAGE_OK, 3);
    cancel(4, 2); /* the job has ended already */
    expect(MESSAGE_OK, 4);
    expect_alive(5);
}

/* Cancelled in the middle of its frames: pieces may be in the socket, nothing comes after the answer. */
SESSION_TEST(exhausted_credit_is_reported_once)
{
    open_scene(1, 1);
    struct message message = render_message(2, 2);
    send_message(2, 0, &message);
    expect_frame(2, 0);
    expect_frame(2, 1);
    for (unsigned i = 0; !client.blocked && i < 6000; i++) {
        expect_alive(9);
        usleep(10000);
    }
    assert_string_equal(client.blocked_text, "the credit is used up");
    usleep(250000);
    expect_alive(9);
    assert_int_equal(client.blocked, 1);
    message = made(MESSAGE_CREDIT);
    message.credit.channel = 2;
    message.credit.total = 3;
    send_message(0, 0, &message);
    expect_frame(2, 2);
    expect(MESSAGE_OK, 2);
}

SESSION_TEST(a_job_cancelled_while_it_sends_ends_at_its_answer)
{
    open_scene(1, 1);
    struct message message = render_message(50, 51);
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    cancel(3, 2);
    bool answered = false;
    for (;;) {
        const struct message *got = receive();
        if (got->type == MESSAGE_OK)
            break;
        assert_int_equal(client.header.request, 2);
        assert_false(answered);
        answered = got->type == MESSAGE_ERROR;
    }
    assert_true(answered);
    assert_int_equal(client.header.request, 3);
    expect_alive(4);
}

SESSION_TEST(a_job_that_cannot_be_is_refused_by_its_field)
{
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.scene = 3;
    send_message(2, 0, &message);
    expect_error(2, PROTOCOL_ERROR_UNKNOWN_ID);
    message = render_message(0, 1);
    message.render.picture.width = 1024;
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_LIMIT);
    message = render_message(0, 1);
    message.render.first_frame = 1;
    send_message(4, 0, &message);
    expect_error(4, PROTOCOL_ERROR_INVALID);
    assert_string_equal(client.message.error.field, "render.last_frame");
    message = render_message(0, 1);
    message.render.encoding = PROTOCOL_ENCODING_JPEG;
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    send_message(5, 0, &message);
    expect_error(5, PROTOCOL_ERROR_UNSUPPORTED);
    message = render_message(0, 1);
    message.render.camera.camera_path = PROTOCOL_CAMERA_KEYS;
    send_message(6, 0, &message);
    expect_error(6, PROTOCOL_ERROR_INVALID);
}

/* The encoder would not let a wrong setting pass. */
static void send_unchecked(uint32_t request, const struct message *message)
{
    static struct plain_bytes payload;
    static uint8_t bytes[FRAMING_MESSAGE_MAX_BYTES];
    struct message valid = *message;
    struct writer writer;
    memset(&valid.render.tracing.settings, 0, sizeof(valid.render.tracing.settings));
    writer_init(&writer, bytes, sizeof(bytes));
    assert_true(message_write(&writer, request, 0, &valid));
    plain_encode(&payload, message);
    memcpy(bytes + FRAMING_HEADER_BYTES, payload.data, payload.count);
    send_bytes(bytes, writer.used_bytes);
}

SESSION_TEST(a_job_takes_its_clips_and_its_lens_along)
{
    open_scene(1, 1);
    struct record_clip_use clips[] = {{.clip = 4, .start_s = -2, .speed = 0.5f, .loop = 1},
                                      {.clip = 5, .speed = 3}};
    struct message message = render_message(0, 1);
    message.render.clips = clips;
    message.render.clips_count = 2;
    message.render.camera.aperture = 0.125f;
    message.render.camera.focus = 7;
    message.render.camera.shutter = 0.5f;
    message.render.sampling.pixel_filter = PROTOCOL_FILTER_TENT;
    message.render.tracing.settings.bvh.form = PROTOCOL_TRACER_FORM_PAPER;
    message.render.sampling.accumulate = PROTOCOL_ACCUMULATION_ON;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    const struct message_frame_begin *begin = &client.message.frame_begin;
    assert_true(begin->aperture == 0.125f && begin->focus == 7.0f && begin->shutter_s == 0.0625f);
    assert_int_equal(begin->samples, 5);
    const struct engine_job *job = &engine.job;
    assert_int_equal(job->clip_count, 2);
    assert_true(engine.job_clips[0].clip == 4 && engine.job_clips[0].start_s == -2.0f);
    assert_true(engine.job_clips[0].speed == 0.5f && engine.job_clips[0].loop);
    assert_true(engine.job_clips[1].clip == 5 && engine.job_clips[1].speed == 3.0f && !engine.job_clips[1].loop);
    assert_true(job->camera.shutter == 0.5f && job->frame.sampling.pixel_filter == FILTER_TENT &&
                job->frame.sampling.accumulate);
    assert_int_equal(job->frame.tracer_options.bvh.form, TRACER_FORM_PAPER);
    take_rest();
}

SESSION_TEST(a_job_starts_anew_where_it_asks_for_it_and_a_view_never)
{
    static const struct {
        enum protocol_accumulation wanted;
        enum protocol_job_kind kind;
        bool accumulates, starts_anew;
    } cases[] = {
        {PROTOCOL_ACCUMULATION_OFF, PROTOCOL_JOB_BATCH, false, false},
        {PROTOCOL_ACCUMULATION_ON, PROTOCOL_JOB_BATCH, true, false},
        {PROTOCOL_ACCUMULATION_ANEW, PROTOCOL_JOB_BATCH, true, true},
        {PROTOCOL_ACCUMULATION_ANEW, PROTOCOL_JOB_VIEW, true, false},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct message message = render_message(0, 1);
        message.render.sampling.accumulate = cases[i].wanted;
        message.render.kind = cases[i].kind;
        send_message(2 + 2 * i, 2 + i, &message);
        expect(MESSAGE_FRAME_BEGIN, 2 + 2 * i);
        assert_int_equal(engine.job.frame.sampling.accumulate != PROTOCOL_ACCUMULATION_OFF, cases[i].accumulates);
        assert_int_equal(engine.job.frame.starts_anew, cases[i].starts_anew);
        while (cases[i].kind == PROTOCOL_JOB_BATCH && receive()->type != MESSAGE_OK)
            continue;
    }
}

SESSION_TEST(settings_of_cubes_go_to_the_engine_with_the_daemons_limits)
{
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.tracing.tracer = PROTOCOL_TRACER_LDC;
    message.render.tracing.settings.ldc.resolution = 16;
    message.render.tracing.settings.ldc.form = PROTOCOL_TRACER_FORM_PAPER;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    assert_int_equal(client.message.frame_begin.tracer, PROTOCOL_TRACER_LDC);
    const struct tracer_options *options = &engine.job.frame.tracer_options;
    assert_int_equal(options->ldc.resolution, 16);
    assert_int_equal(options->ldc.form, TRACER_FORM_PAPER);
    assert_int_equal(options->limits.ldc_layers, 7);
    assert_int_equal(options->limits.ldc_mebibytes, 3);
    take_rest();
}

SESSION_TEST(layers_go_to_the_engine_and_come_with_the_frame)
{
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    message.render.encoding = PROTOCOL_ENCODING_ZSTD;
    message.render.picture.layers = 1u << PROTOCOL_LAYER_BEAUTY | 1u << PROTOCOL_LAYER_DEPTH;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    assert_int_equal(engine.job.frame.picture.layers, 1u << LAYER_BEAUTY | 1u << LAYER_DEPTH);
    assert_int_equal(client.message.frame_begin.layers, message.render.picture.layers);
    take_rest();
    message = render_message(0, 1); /* the picture alone has any format, named or not */
    message.render.picture.layers = 1u << PROTOCOL_LAYER_BEAUTY;
    message.render.encoding = PROTOCOL_ENCODING_JPEG;
    send_message(3, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 3);
    take_rest();
}

SESSION_TEST(layers_that_pixels_or_messages_do_not_hold_are_refused)
{
    static const struct {
        uint32_t layers, edge_pixels;
        enum protocol_pixel_format format;
        enum protocol_encoding encoding;
        enum protocol_error_code code;
        const char *remedy;
    } cases[] = {
        {3, 16, PROTOCOL_PIXEL_FORMAT_RGBA8, PROTOCOL_ENCODING_RAW, PROTOCOL_ERROR_UNSUPPORTED, "rgba32f"},
        {2, 16, PROTOCOL_PIXEL_FORMAT_RGBA16F, PROTOCOL_ENCODING_ZSTD, PROTOCOL_ERROR_UNSUPPORTED, "rgba32f"},
        {64, 16, PROTOCOL_PIXEL_FORMAT_RGBA8, PROTOCOL_ENCODING_JPEG, PROTOCOL_ERROR_UNSUPPORTED, "zstd"},
        {2, 16, PROTOCOL_PIXEL_FORMAT_RGBA32F, PROTOCOL_ENCODING_JPEG, PROTOCOL_ERROR_UNSUPPORTED, "zstd"},
        /* 8192 x 8192 x 16 bytes are 1 GiB */
        {15, 8192, PROTOCOL_PIXEL_FORMAT_RGBA32F, PROTOCOL_ENCODING_RAW, PROTOCOL_ERROR_LIMIT, "fewer layers"},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct message message = render_message(0, 1);
        message.render.picture.width = message.render.picture.height = cases[i].edge_pixels;
        message.render.picture.layers = cases[i].layers;
        message.render.picture.format = cases[i].format;
        message.render.encoding = cases[i].encoding;
        send_message(2 + i, 0, &message);
        expect_error(2 + i, cases[i].code);
        assert_string_equal(client.message.error.field, "render.layers");
        assert_non_null(strstr(client.message.error.remedy, cases[i].remedy));
    }
}

/* A render with fields of several views, and of pictures made from layers. */
struct views_case {
    uint32_t across, down, eyes_over, upsample, accumulate, compare, width;
    float baseline, shutter;
    enum protocol_view_source source;
    enum protocol_job_kind kind;
    const char *field, *remedy;
    enum protocol_error_code code;
};

static struct message views_message(const struct views_case *given)
{
    struct message message = render_message(0, 1);
    struct message_render *render = &message.render;
    render->picture.views_across = given->across ? given->across : 1;
    render->picture.views_down = given->down ? given->down : 1;
    render->picture.eyes_over = given->eyes_over;
    render->picture.upsample = given->upsample ? given->upsample : 1;
    render->sampling.accumulate = given->accumulate;
    render->comparison.compare = given->compare;
    render->picture.width = given->width ? given->width : render->picture.width;
    render->picture.baseline = given->baseline;
    render->camera.shutter = given->shutter;
    render->picture.view_source = given->source;
    render->kind = given->kind;
    return message;
}

SESSION_TEST(views_that_cannot_be_are_refused_by_their_field)
{
    static const struct views_case cases[] = {
        {.across = 2, .field = "render.baseline", .remedy = "distance", .code = PROTOCOL_ERROR_INVALID},
        {.down = 2, .field = "render.baseline", .remedy = "distance", .code = PROTOCOL_ERROR_INVALID},
        {.across = 2,
         .down = 2,
         .eyes_over = 1,
         .baseline = 1,
         .field = "render.eyes_over",
         .remedy = "views_across to 1",
         .code = PROTOCOL_ERROR_INVALID},
        {.eyes_over = 1, .field = "render.eyes_over", .remedy = "views_down to 2", .code = PROTOCOL_ERROR_INVALID},
        {.across = 3,
         .width = 4096,
         .baseline = 1,
         .field = "render.views_across",
         .remedy = "smaller views",
         .code = PROTOCOL_ERROR_LIMIT},
        {.upsample = 4,
         .field = "render.upsample",
         .remedy = "view_source to layers",
         .code = PROTOCOL_ERROR_INVALID},
        {.upsample = 4,
         .source = PROTOCOL_VIEW_SOURCE_LAYERS,
         .kind = PROTOCOL_JOB_VIEW,
         .field = "render.upsample",
         .remedy = "set it to 1",
         .code = PROTOCOL_ERROR_UNSUPPORTED},
        {.upsample = 4,
         .source = PROTOCOL_VIEW_SOURCE_LAYERS,
         .accumulate = 1,
         .field = "render.upsample",
         .remedy = "accumulate to off",
         .code = PROTOCOL_ERROR_UNSUPPORTED},
        {.source = PROTOCOL_VIEW_SOURCE_LAYERS,
         .compare = 1,
         .field = "render.compare",
         .remedy = "view_source to rays",
         .code = PROTOCOL_ERROR_UNSUPPORTED},
        {.source = PROTOCOL_VIEW_SOURCE_LAYERS,
         .shutter = 0.5f,
         .field = "render.shutter",
         .remedy = "view_source to rays",
         .code = PROTOCOL_ERROR_UNSUPPORTED},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        const struct message message = views_message(&cases[i]);
        send_message(2 + i, 0, &message);
        expect_error(2 + i, cases[i].code);
        assert_string_equal(client.message.error.field, cases[i].field);
        assert_non_null(strstr(client.message.error.remedy, cases[i].remedy));
    }
}

SESSION_TEST(settings_that_no_tracer_has_are_refused_by_their_field)
{
    static const struct {
        struct tracer_settings settings;
        const char *field, *allowed;
    } cases[] = {
        {{.ldc.resolution = 1}, "render.ldc_resolution", "16 to 4096"},
        {{.ldc.resolution = 15}, "render.ldc_resolution", "16 to 4096"},
        {{.ldc.form = 2}, "render.ldc_form", "fast, paper"},
        {{.abuffer.resolution = 15}, "render.abuffer_resolution", "16 to 4096"},
        {{.abuffer.voxels = 8}, "render.abuffer_voxels", "16, 32, 64"},
        {{.abuffer.voxels = 100}, "render.abuffer_voxels", "16, 32, 64"},
        {{.abuffer = {.resolution = 32, .voxels = 64}}, "render.abuffer_voxels", "the 32 texels"},
        {{.bvh.form = 7}, "render.bvh_form", "fast, paper"},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct message message = render_message(0, 1);
        message.render.tracing.settings = cases[i].settings;
        send_unchecked(2 + i, &message);
        expect_error(2 + i, PROTOCOL_ERROR_INVALID);
        assert_string_equal(client.message.error.field, cases[i].field);
        assert_non_null(strstr(client.message.error.text, cases[i].allowed));
    }
}

/* Pixels in the engine's job for a picture of 300 x 200. */
static uint32_t pixels_noted_for(const struct message *message)
{
    static uint32_t request = 2;
    send_message(request, 0, message);
    expect(MESSAGE_FRAME_BEGIN, request++);
    const uint32_t noted = engine.job.frame.tracer_options.picture_pixels;
    take_rest();
    return noted;
}

SESSION_TEST(the_pictures_size_goes_to_the_engine_where_a_resolution_is_chosen_by_it)
{
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.picture.width = 300;
    message.render.picture.height = 200;
    message.render.tracing.tracer = PROTOCOL_TRACER_LDC;
    assert_int_equal(pixels_noted_for(&message), 65536);
    message.render.tracing.settings.ldc.resolution = 1024;
    assert_int_equal(pixels_noted_for(&message), 0);
    message.render.tracing.tracer = PROTOCOL_TRACER_ABUFFER;
    assert_int_equal(pixels_noted_for(&message), 65536);
    message.render.tracing.tracer = PROTOCOL_TRACER_BVH;
    assert_int_equal(pixels_noted_for(&message), 0);
}

SESSION_TEST(settings_of_a_buffers_and_light_go_to_the_engine)
{
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.tracing.tracer = PROTOCOL_TRACER_ABUFFER;
    message.render.tracing.settings.abuffer.resolution = 64;
    message.render.tracing.settings.abuffer.voxels = 64;
    message.render.tracing.settings.abuffer.form = PROTOCOL_TRACER_FORM_PAPER;
    message.render.light.integrator = PROTOCOL_INTEGRATOR_PATH;
    message.render.light.brdf = PROTOCOL_BRDF_WARD;
    message.render.light.ao_distance = 2;
    message.render.light.ao_falloff = 0.5f;
    message.render.light.clamp = 8;
    message.render.light.ao_rays = 256;
    message.render.light.layer_opacity = 0.75f;
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    message.render.picture.layers = 1u << PROTOCOL_LAYER_ALBEDO | 1u << PROTOCOL_LAYER_ID;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    assert_int_equal(client.message.frame_begin.tracer, PROTOCOL_TRACER_ABUFFER);
    assert_int_equal(client.message.frame_begin.layers, message.render.picture.layers);
    const struct frame_request *request = &engine.job.frame;
    assert_int_equal(request->tracer_options.abuffer.resolution, 64);
    assert_int_equal(request->tracer_options.abuffer.voxels, 64);
    assert_int_equal(request->tracer_options.abuffer.form, TRACER_FORM_PAPER);
    assert_int_equal(request->tracer_options.limits.abuffer_mebibytes, 1);
    assert_int_equal(request->light.integrator, INTEGRATOR_PATH);
    assert_int_equal(request->light.brdf, BRDF_WARD);
    assert_true(request->light.clamp == 8);
    assert_true(request->light.ao_distance == 2 && request->light.ao_falloff == 0.5f &&
                request->light.layer_opacity == 0.75f);
    assert_int_equal(request->light.ao_rays, 256);
    assert_int_equal(request->picture.layers, message.render.picture.layers);
    take_rest();
}

SESSION_TEST(layers_count_as_pictures_in_the_memory_for_frames)
{
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    /* While a job runs, all layers are more than is left of the memory for frames; the picture is not. */
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    message.render.picture.width = message.render.picture.height = 128;
    message.render.picture.layers = 0;
    atomic_store(&engine.keep_jobs, true);
    send_message(3, 0, &message);
    for (uint32_t request = 4; request < 6; request++) {
        message.render.channel++;
        message.render.picture.layers = request == 4 ? 127 : 0;
        send_message(request, 0, &message);
    }
    expect_error(4, PROTOCOL_ERROR_BUSY);
    expect_alive(6);
}

SESSION_TEST(a_frame_tells_what_the_tracer_says_of_its_structure)
{
    open_scene(1, 1);
    structure_number(&engine.structure, "nodes", UINT64_MAX);
    engine.structure.part = 1;
    engine.structure.part_name = "dynamic";
    structure_metres(&engine.structure, "cell", INFINITY); /* the scene is too large */
    strcpy(structure_number(&engine.structure, "layers_kept", 255)->warning, "45 layers are missing");
    structure_built(&engine.structure, true);
    struct message message = render_message(0, 1);
    send_message(2, 0, &message);
    while (receive()->type != MESSAGE_FRAME_END)
        continue;
    assert_int_equal(client.message.frame_end.structure_count, 4);
    const struct record_structure_row *row = client.message.frame_end.structure;
    assert_string_equal(row[0].name, "nodes");
    assert_int_equal(row[0].part, 0);
    assert_int_equal(row[0].unit, PROTOCOL_UNIT_NUMBER);
    assert_true(row[0].number == UINT64_MAX);
    assert_string_equal(row[1].name, "dynamic/cell");
    assert_int_equal(row[1].part, 1);
    assert_int_equal(row[1].unit, PROTOCOL_UNIT_METRES);
    assert_true(row[1].measure > 1e38f && isfinite(row[1].measure));
    assert_string_equal(row[1].warning, "");
    assert_string_equal(row[2].warning, "45 layers are missing");
    assert_string_equal(row[3].name, "dynamic/built");
    assert_int_equal(row[3].unit, PROTOCOL_UNIT_BUILT);
    assert_int_equal(row[3].number, 1);
    expect(MESSAGE_OK, 2);
}

SESSION_TEST(a_job_whose_frames_do_not_fit_in_memory_waits_for_others_to_end)
{
    atomic_store(&engine.keep_jobs, true);
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.picture.width = message.render.picture.height =
        512; /* 7 MiB: 3 frames in the engine, 4 to be sent */
    send_message(2, 0, &message);
    message.render.channel = 3;
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_BUSY);
    assert_int_equal(client.message.error.retryable, 1);
    assert_non_null(strstr(client.message.error.remedy, "memory.frames"));
    cancel(4, 2);
    expect_error(2, PROTOCOL_ERROR_CANCELLED);
    expect(MESSAGE_OK, 4);
    message = render_message(0, 1);
    message.render.picture.width = message.render.picture.height = 512;
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F; /* more than there is, but it is the only one */
    message.render.picture.layers = 127;
    send_message(5, 0, &message);
    cancel(6, 5);
    expect_error(5, PROTOCOL_ERROR_CANCELLED);
    expect(MESSAGE_OK, 6);
    assert_int_equal(served.hub.frame_bytes, 0);
}

TEST(the_header_of_a_frame_chunk_is_what_the_codec_writes)
{
    static uint8_t data[FRAME_PIECE_BYTES], bytes[FRAMING_MESSAGE_MAX_BYTES];
    static const size_t sizes[] = {1, 7, 8, 1000, FRAME_PIECE_BYTES};
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        struct message message = made(MESSAGE_FRAME_DATA);
        message.frame_data.offset_bytes = UINT64_C(0xa1b2c3d4);
        message.frame_data.data = data;
        message.frame_data.data_bytes = (uint32_t)sizes[i];
        struct writer writer;
        writer_init(&writer, bytes, sizeof(bytes));
        assert_true(message_write(&writer, 77, 5, &message));
        uint8_t head[FRAME_DATA_HEAD_BYTES];
        frame_data_head(head, 77, 5, UINT64_C(0xa1b2c3d4), (uint32_t)sizes[i]);
        assert_memory_equal(head, bytes, sizeof(head));
        assert_int_equal(writer.used_bytes, (sizeof(head) + sizes[i] + 7) & ~(size_t)7);
    }
}
