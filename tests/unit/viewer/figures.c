/* SPDX-License-Identifier: MIT */
/* Figures about frames: rates, latencies, two clocks on one axis, errors as heat; and the overlay stays
 * within the window. */
#include "viewer/overlay/hud.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MS UINT64_C(1000000)
#define DAEMON_AHEAD (UINT64_C(5000) * MS) /* its clock shows more than ours */

static struct metrics metrics;

/* A frame that took 8 ms on the way from a camera sent at `sent_ns`: 1 ms to the daemon, 4 ms there, 1 ms back,
 * 1 ms to receive, 1 ms to decode. */
static void add(uint32_t number, uint64_t command, uint64_t sent_ns)
{
    struct record_stage_time stages[] = {
        {.stage = PROTOCOL_STAGE_TRACE, .start_ns = 1 * MS, .duration_ns = 2 * MS},
        {.stage = PROTOCOL_STAGE_FRAME, .start_ns = 0, .duration_ns = 4 * MS},
    };
    const struct fl_frame frame = {.frame = number,
                                   .command = command,
                                   .command_sent_ns = command > 0 ? sent_ns : 0,
                                   .command_received_ns = sent_ns + 1 * MS + DAEMON_AHEAD,
                                   .command_applied_ns = sent_ns + 1 * MS + DAEMON_AHEAD,
                                   .rendered_ns = sent_ns + 5 * MS + DAEMON_AHEAD,
                                   .begun_ns = sent_ns + 6 * MS,
                                   .receive_ns = 1 * MS,
                                   .wire_bytes = 1000,
                                   .stages = stages,
                                   .stage_count = 2};
    metrics_add(&metrics, &frame, sent_ns + 8 * MS);
}

static void add_frames(uint32_t count, uint64_t pause_ms)
{
    for (uint32_t i = 0; i < count; i++)
        add(i, i + 1, (1000 + i * pause_ms) * MS);
}

static int begin(void **state)
{
    (void)state;
    memset(&metrics, 0, sizeof(metrics));
    return 0;
}

EACH_TEST(begin, NULL)

TEST(rates_and_latency_are_those_of_the_last_second)
{
    struct metrics_summary summary;
    metrics_summarise(&metrics, 1000 * MS, &summary);
    assert_true(summary.frames_per_second == 0 && !summary.has_latency);
    for (uint32_t i = 0; i < 30; i++) {
        add(i, i + 1, (1000 + i * 100) * MS);
        metrics_show(&metrics, (1000 + i * 100 + 12) * MS); /* the screen took 4 ms more */
    }
    metrics_summarise(&metrics, 3913 * MS, &summary);
    assert_true(summary.frames_per_second == 10);
    assert_true(summary.bits_per_second == 10 * 8000);
    assert_true(summary.has_latency && fabs(summary.latency_s - 0.012) < 1e-9);
    /* Long after the last one its latency is still told. */
    metrics_summarise(&metrics, 60000 * MS, &summary);
    assert_true(summary.frames_per_second == 0 && fabs(summary.latency_s - 0.012) < 1e-9);
}

TEST(what_a_picture_takes_on_its_way_is_that_of_the_last_ones)
{
    struct metrics_summary summary;
    metrics_summarise(&metrics, 1000 * MS, &summary);
    assert_int_equal(summary.round_frames, 0);
    for (uint32_t i = 0; i < 20; i++) {
        add(i, i + 1, (1000 + i * 100) * MS);
        metrics_show(&metrics, (1000 + i * 100 + 50) * MS); /* when it is shown does not matter */
    }
    metrics_summarise(&metrics, 3000 * MS, &summary);
    assert_in_range(summary.round_frames, 3, 20);
    assert_true(fabs(summary.round_s - 0.008) < 1e-9);
}

TEST(views_that_are_made_here_have_a_rate_and_a_latency_of_their_own)
{
    struct metrics_summary summary;
    add(0, 1, 1000 * MS);
    for (uint64_t i = 0; i < 300; i++) { /* more than are remembered, 100 a second */
        const uint64_t moved_ns = (1000 + 10 * i) * MS;
        metrics_add_view(&metrics, i % 2 == 0 ? moved_ns : 0, moved_ns + 5 * MS);
        metrics_show(&metrics, moved_ns + (i == 298 ? 40 : 7) * MS);
    }
    metrics_summarise(&metrics, 4000 * MS, &summary);
    assert_true(summary.views_per_second == 100 && summary.frames_per_second == 0);
    assert_true(fabs(summary.view_latency_s - 0.007) < 1e-9);
    assert_true(fabs(summary.view_latency_99_s - 0.040) < 1e-9);
    metrics_summarise(&metrics, 9000 * MS, &summary);
    assert_true(summary.views_per_second == 0 && summary.view_latency_s == 0);
}

TEST(frames_that_refine_have_no_latency)
{
    struct metrics_summary summary;
    add(0, 1, 1000 * MS);
    add(1, 1, 1400 * MS);
    metrics_summarise(&metrics, 1410 * MS, &summary);
    assert_true(summary.frames_per_second == 2);
    assert_true(fabs(summary.latency_s - 0.008) < 1e-9);
    assert_true(metrics_frame(&metrics, 1)->first_of_command);
    assert_false(metrics_frame(&metrics, 0)->first_of_command);
}

/* The ways there and back took 1 ms each, so the middle is the truth. */
TEST(the_daemons_clock_is_found)
{
    assert_true(metrics_clock_offset_ns(&metrics) == 0);
    add_frames(5, 100);
    assert_int_equal(metrics_clock_offset_ns(&metrics), -(int64_t)DAEMON_AHEAD);
    const struct metrics_frame *frame = metrics_frame(&metrics, 0);
    struct span span;
    assert_true(metrics_span(frame, LANE_TRACE, -(int64_t)DAEMON_AHEAD, &span));
    assert_int_equal(span.begin_ns, 1402 * (int64_t)MS);
    assert_int_equal(span.end_ns, 1404 * (int64_t)MS);
    assert_true(metrics_span(frame, LANE_INPUT, -(int64_t)DAEMON_AHEAD, &span));
    assert_int_equal(span.begin_ns, 1400 * (int64_t)MS);
    assert_int_equal(span.end_ns, 1401 * (int64_t)MS);
    assert_true(metrics_span(frame, LANE_RECEIVE, -(int64_t)DAEMON_AHEAD, &span));
    assert_int_equal(span.begin_ns, 1406 * (int64_t)MS);
    assert_false(metrics_span(frame, LANE_ENCODE, 0, &span));
}

/* Waves are added up, and what both clocks measured counts once. */
TEST(a_lane_is_as_long_as_all_of_its_work)
{
    struct record_stage_time stages[400];
    for (uint64_t i = 0; i < 400; i++)
        stages[i] = (struct record_stage_time){.stage = i < 300 ? PROTOCOL_STAGE_TRACE : PROTOCOL_STAGE_SHADE,
                                               .clock = i % 2 == 0 ? PROTOCOL_CLOCK_CPU : PROTOCOL_CLOCK_GPU,
                                               .start_ns = (500 - i) * MS,
                                               .duration_ns = i % 2 == 0 ? MS : MS / 2};
    const struct fl_frame frame = {.rendered_ns = 1, .stages = stages, .stage_count = 400};
    struct span span;
    metrics_add(&metrics, &frame, 5);
    metrics_show(&metrics, 6);
    const struct metrics_frame *kept = metrics_frame(&metrics, 0);
    assert_true(metrics_span(kept, LANE_TRACE, 0, &span));
    assert_int_equal(span.begin_ns, 1 + 201 * (int64_t)MS);
    assert_int_equal(span.end_ns - span.begin_ns, 150 * (int64_t)MS);
    assert_true(metrics_span(kept, LANE_SHADE, 0, &span));
    assert_int_equal(span.begin_ns, 1 + 101 * (int64_t)MS);
    assert_int_equal(span.end_ns - span.begin_ns, 50 * (int64_t)MS);
    assert_true(metrics_span(kept, LANE_SHOW, 0, &span));
    assert_true(span.begin_ns == 5 && span.end_ns == 6);
}

/* ---- heat ---- */

TEST_WITH(errors_become_colours_and_figures, NULL, NULL)
{
    const uint8_t a[4][4] = {{10, 20, 30, 255}, {10, 20, 30, 0}, {0, 0, 0, 255}, {51, 2, 3, 255}};
    const uint8_t b[4][4] = {{10, 20, 30, 255}, {10, 20, 30, 255}, {0, 255, 0, 255}, {0, 2, 3, 255}};
    uint8_t made[4][4], black[3], brightest[3], middle[3];
    struct heat_figures figures;
    heat_map(a[0], b[0], 4, 0.8, made[0], &figures);
    heat_colour(0, black);
    heat_colour(1, brightest);
    heat_colour(0.5, middle);
    assert_memory_equal(made[0], black, 3);
    assert_memory_equal(made[1], black, 3); /* alpha does not count */
    assert_memory_equal(made[2], brightest, 3);
    assert_memory_equal(made[3], middle, 3); /* a quarter of the top: half way */
    assert_int_equal(made[0][3], 255);
    assert_true(figures.max == 1);
    assert_true(fabs(figures.mean - (1 + 0.2) / 4) < 1e-12);
    assert_true(fabs(figures.beyond - 0.5) < 1e-12);
    heat_map(a[0], b[0], 0, 1, made[0], &figures);
    assert_true(figures.mean == 0 && figures.max == 0 && figures.beyond == 0);
}

TEST_WITH(hotter_is_brighter, NULL, NULL)
{
    unsigned before = 0;
    for (int i = 0; i <= 100; i++) {
        uint8_t colour[3];
        heat_colour(i / 100.0, colour);
        const unsigned luma = 2126u * colour[0] + 7152u * colour[1] + 722u * colour[2];
        assert_true(luma >= before);
        before = luma;
    }
}

/* ---- the overlay ---- */

/* A font whose every letter is half as wide as high. */
static double measure(void *user, enum hud_font font, double height, const char *text)
{
    (void)user;
    (void)font;
    return (double)strlen(text) * height / 2;
}

static struct settings settings;
static struct tour tour;
static struct hud hud;

static struct hud_state some_state(double width, double height)
{
    settings = (struct settings){.overlay = OVERLAY_ALL};
    tour = (struct tour){.camera = TOUR_NONE, .clip = TOUR_NONE, .speed = 1};
    return (struct hud_state){.width = width,
                              .height = height,
                              .scale = 1,
                              .status = HUD_LIVE,
                              .status_text = "",
                              .notice = "",
                              .scene = "teapot.glb",
                              .server = "",
                              .camera = "",
                              .clip = "",
                              .settings = &settings,
                              .tour = &tour,
                              .metrics = &metrics,
                              .now_ns = 2000 * MS,
                              .picture_width = 640,
                              .picture_height = 360,
                              .samples = 3,
                              .samples_wanted = 16};
}

static bool tells(const char *part)
{
    for (size_t i = 0; i < hud.count; i++)
        if (strstr(hud.marks[i].text, part))
            return true;
    return false;
}

static void check_within(const struct hud_state *state)
{
    for (size_t i = 0; i < hud.count; i++) {
        const struct hud_mark *mark = &hud.marks[i];
        const double width =
            mark->text[0] != '\0' ? measure(NULL, mark->font, mark->height, mark->text) : mark->width;
        const double left = mark->is_right ? mark->x - width : mark->x;
        if (left < -0.01 || left + width > state->width + 2 || mark->y < -0.01 ||
            mark->y + mark->height > state->height + 2)
            fail_msg("'%s' at %g, %g, %g wide, is not within %gx%g", mark->text, left, mark->y, width,
                     state->width, state->height);
    }
}

static void lay_out(const struct hud_state *shown)
{
    hud_layout(&hud, shown, measure, NULL);
    check_within(shown);
}

TEST(the_overlay_shows_its_figures_within_the_window)
{
    add_frames(20, 20);
    struct hud_state shown = some_state(1280, 720);
    lay_out(&shown);
    assert_true(tells("teapot.glb") && tells("bvh, whitted") && tells("refining: 3 of 16 samples"));
    assert_true(tells("8.0 ms") && tells("640x360") && tells("trace") && !tells("errors"));
    assert_false(tells("views made here") || tells("depth"));
    shown.local = (struct hud_local){.on = true};
    lay_out(&shown);
    assert_true(tells("none: the newest picture") && !tells("not seen yet"));
    shown.local = (struct hud_local){
        .on = true, .shown = true, .age_s = 0.25, .bound_pixels = 0.75, .unseen = 0.031, .depth_bytes = 12000};
    shown.wire_bytes = 46000;
    lay_out(&shown);
    assert_true(tells("0.25 s old, off by 0.75 pixels") && tells("3.1 %") && tells("34 kB, raw; depth 12 kB"));
    shown.local.bound_pixels = INFINITY;
    lay_out(&shown);
    assert_true(tells("0.25 s old, no bound"));
    shown.local = (struct hud_local){0};
    shown.structure[0] = "nodes 10806";
    lay_out(&shown);
    assert_true(tells("structure") && tells("nodes 10806"));
    shown.structure[1] =
        "shadow: cone tests 69.4 a ray, triangle tests 28.1 a ray, waves 12, sorted 0, turned 12, "
        "pairs max 16777216, passes 1234, halvings 0";
    lay_out(&shown);
    assert_true(tells("shadow: cone tests 69.4 a ray") && tells("halvings 0") && !tells("apart"));
    settings.stereo = true;
    settings.views = PROTOCOL_VIEW_SOURCE_LAYERS;
    shown.stereo_m = 0.065;
    lay_out(&shown);
    assert_true(tells("65 mm apart, from layers"));
    settings.views = PROTOCOL_VIEW_SOURCE_RAYS;
    lay_out(&shown);
    assert_true(tells("65 mm apart, rendered"));
    settings.help = settings.error_map = true;
    shown.heat = HUD_HEAT_SHOWN;
    shown.heat_figures.mean = 0.125;
    shown.notice = "a notice";
    shown.moving = true;
    lay_out(&shown);
    assert_true(tells("mean 0.12") && tells("a notice") && tells("moving") && tells("Shift+T"));
}

/* Elements that do not fit are left out; only help and status cover others. */
TEST(a_small_window_shows_less)
{
    add_frames(20, 20);
    struct hud_state shown = some_state(360, 180); /* the widest line has 27 letters */
    lay_out(&shown);
    assert_true(tells("refining") && !tells("input to picture") && !tells("resolve"));
    shown = some_state(700, 180);
    lay_out(&shown);
    assert_true(tells("input to picture") && !tells("resolve"));
    shown = some_state(700, 420);
    settings.help = true;
    lay_out(&shown);
    assert_true(tells("resolve") && tells("full screen"));
    for (double height = 60; height < 480; height += 60) {
        shown = some_state(300, height);
        settings.tracer = PROTOCOL_TRACER_LDC;
        settings.panel = true;
        hud_layout(&hud, &shown, measure, NULL);
        assert_true(tells("ldc_resolution"));
    }
}

TEST(it_begins_with_one_line_and_the_rest_is_a_key_away)
{
    add_frames(20, 40);
    struct hud_state shown = some_state(1280, 720);
    settings = (struct settings){0};
    lay_out(&shown);
    assert_true(tells("20 fps") && tells("teapot.glb") && tells("bvh, whitted") && tells("3 of 16 samples") &&
                tells("F1"));
    assert_false(tells("input to picture") || tells("trace"));
    for (size_t i = 1; i < hud.count; i++) /* behind its panel */
        assert_true(hud.marks[i].y >= hud.marks[0].y && hud.marks[i].y + hud.marks[i].height < 50);
    shown.local.shown = true; /* views are made on this machine: none yet */
    lay_out(&shown);
    assert_true(tells("0 fps") && !tells("20 fps"));
    shown = some_state(200, 100); /* elements that do not fit are left out */
    settings = (struct settings){0};
    shown.notice = "a notice that is longer than the window is wide";
    lay_out(&shown);
    assert_true(tells("20 fps") && tells("teapot.glb") && !tells("F1") && tells("a notice"));
    settings_act(&settings, ACTION_OVERLAY);
    shown = (struct hud_state){0};
    assert_int_equal(settings.overlay, OVERLAY_ALL);
    settings_act(&settings, ACTION_OVERLAY_BACK);
    settings_act(&settings, ACTION_OVERLAY_BACK);
    assert_int_equal(settings.overlay, OVERLAY_NONE);
}

TEST(an_object_is_edited_beside_the_figures)
{
    static struct hud_edit edit;
    add(0, 1, 1000 * MS);
    edit = (struct hud_edit){.shown = true,
                             .tabs = {"node", "material", "light", "environment"},
                             .title = "a material with a name that is longer than its panel is wide",
                             .hint = "what it means, in a line that is longer than its panel is wide, too",
                             .typed = "0.25",
                             .count = 40,
                             .chosen = 20};
    for (size_t i = 0; i < edit.count; i++) {
        edit.rows[i] = (struct hud_edit_row){.share = i % 2 == 0 ? 0.5 : -1, .has_colour = i % 4 == 0};
        snprintf(edit.rows[i].name, sizeof(edit.rows[i].name), "row %zu", i);
        snprintf(edit.rows[i].value, sizeof(edit.rows[i].value), "value %zu", i);
    }
    for (int small = 0; small < 2; small++) {
        struct hud_state shown = some_state(small ? 400 : 1280, small ? 200 : 720);
        shown.edit = &edit;
        lay_out(&shown);
        assert_true(tells("material") && tells("row 20") && tells("0.25_") && !tells("value 20") &&
                    tells("value 19"));
        assert_int_equal(tells("input to picture"), !small);
    }
}

static bool has_box_of(uint8_t grey)
{
    for (size_t i = 0; i < hud.count; i++)
        if (hud.marks[i].colour.r == grey && hud.marks[i].colour.g == grey && hud.marks[i].colour.b == grey)
            return true;
    return false;
}

TEST(the_line_of_figures_ends_before_the_panel_whose_swatches_are_as_the_picture_is)
{
    static struct hud_edit edit;
    add(0, 1, 1000 * MS);
    edit = (struct hud_edit){.shown = true, .count = 1};
    edit.rows[0] = (struct hud_edit_row){.share = -1, .has_colour = true, .colour = {0.5f, 0.5f, 0.5f}};
    for (int width = 600; width <= 1280; width += 10) {
        struct hud_state shown = some_state(width, 480);
        settings = (struct settings){0};
        shown.edit = &edit;
        lay_out(&shown);
        assert_true(tells("teapot.glb") || width < 700);
        const double right = width - hud_edit_width(&edit, width, shown.scale);
        for (size_t i = 0; i < hud.count; i++) /* elements that begin beside the panel end there */
            assert_true(hud.marks[i].y >= 50 || hud.marks[i].x >= right || hud.marks[i].is_right ||
                        hud.marks[i].x + hud.marks[i].width <= right);
        assert_true(has_box_of(188) && !has_box_of(128)); /* sRGB of 0.5 */
    }
    edit.rows[0].is_shown_as_it_is = true;
    struct hud_state shown = some_state(1280, 480);
    shown.edit = &edit;
    lay_out(&shown);
    assert_true(has_box_of(128) && !has_box_of(188));
}

TEST(what_is_not_wanted_is_not_drawn_but_a_loss_is)
{
    add(0, 1, 1000 * MS);
    struct hud_state shown = some_state(700, 480);
    settings.overlay = OVERLAY_FIGURES;
    lay_out(&shown);
    assert_true(tells("input to picture") && !tells("resolve"));
    settings.overlay = OVERLAY_NONE;
    lay_out(&shown);
    assert_int_equal(hud.count, 0);
    shown.status = HUD_LOST;
    shown.status_text = "the daemon closed the connection; trying again in 1.0 s";
    lay_out(&shown);
    assert_true(tells("The connection is lost") && tells("trying again in 1.0 s"));
}

TEST(the_timeline_has_times_on_its_axis_that_do_not_overlap)
{
    static const uint64_t pauses_ms[] = {1, 3, 7, 15, 33, 70, 78};
    for (size_t p = 0; p < sizeof(pauses_ms) / sizeof(pauses_ms[0]); p++) {
        begin(NULL);
        add_frames(20, pauses_ms[p]);
        struct hud_state shown = some_state(900, 600);
        double end = 0;
        unsigned labels = 0;
        lay_out(&shown);
        for (size_t i = 0; i < hud.count; i++) {
            const struct hud_mark *mark = &hud.marks[i];
            const size_t length = strlen(mark->text);
            if (!mark->is_right || mark->y < 400 || length < 4 || strcmp(mark->text + length - 3, " ms") != 0)
                continue;
            const double width = measure(NULL, mark->font, mark->height, mark->text);
            assert_true(mark->x - width > end);
            end = mark->x;
            labels++;
        }
        assert_in_range(labels, 2, 12);
    }
}
