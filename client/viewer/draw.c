/* SPDX-License-Identifier: MIT */
/* Outputs of the viewer: picture and overlay, screenshots, and its state as JSON. */
#include "viewer/overlay/paint.h"
#include "viewer/overlay/snapshot.h"
#include "state.h"
#include "protocol/common/clock.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void fill_names(struct viewer *viewer, struct hud_state *state)
{
    struct view *view = &viewer->view;
    const struct viewer_options *options = viewer->options;
    state->scene = viewer_scene_name(viewer);
    state->server = options->server ? options->server : "";
    state->camera = view->eye.tour.camera != TOUR_NONE ? view->eye.camera_name : "";
    state->clip = view->eye.tour.clip != TOUR_NONE ? view->eye.clip_name : "";
}

static void fill_status(struct viewer *viewer, struct hud_state *state)
{
    struct view *view = &viewer->view;
    static char text[HUD_TEXT_MAX];
    const bool was_live = viewer->times_live > 0;
    text[0] = '\0';
    state->status_text = text;
    if (view->refused[0] != '\0') {
        state->status = HUD_REFUSED;
        state->status_text = view->refused;
        return;
    }
    if (session_has_scene(view->session)) {
        state->status = view->frames.count > 0 ? HUD_LIVE : HUD_LOADING;
        snprintf(text, sizeof(text), "rendering the first picture");
        return;
    }
    const struct fl_error *error = session_error(view->session);
    state->status = was_live ? HUD_LOST : HUD_LOADING;
    if (error->code != FL_ERROR_NONE) {
        const uint64_t retry_ns = session_retry_ns(view->session), now_ns = state->now_ns;
        const double left_s = retry_ns > now_ns ? (double)(retry_ns - now_ns) * 1e-9 : 0;
        snprintf(text, sizeof(text), "%.80s; trying again in %.1f s", error->text, left_s);
        return;
    }
    const char *what = session_progress(view->session, &state->progress);
    snprintf(text, sizeof(text), "%s%.100s", was_live ? "trying again: " : "", what);
}

static void fill_local(const struct viewer *viewer, struct hud_state *state)
{
    const struct view *view = &viewer->view;
    const struct views_made *made = &view->local.made_of;
    state->local = (struct hud_local){.on = view_has_local(view),
                                      .shown = view->local.shows_made,
                                      .depth_bytes = view->frames.last.depth_bytes,
                                      .quality = made->quality};
    if (!view->local.shows_made)
        return;
    state->local.age_s = (double)(state->now_ns - made->key_came_ns) * 1e-9;
    state->local.bound_pixels = (double)made->counts.bound_pixels;
    state->local.unseen = (double)views_unseen(made);
    state->local.sticking = (double)made->counts.sticking;
    state->local.view_s = (double)made->counts.processor_ns * 1e-9;
}

void viewer_hud(struct viewer *viewer, struct hud_state *state)
{
    struct view *view = &viewer->view;
    *state = (struct hud_state){
        .width = viewer->screen.width,
        .height = viewer->screen.height,
        .scale = viewer->screen.scale,
        .notice = "",
        .settings = &view->settings,
        .exposure_stops = (double)view->render.picture.exposure_stops + view->settings.exposure_thirds / 3.0,
        .stereo_m = (double)viewer->options->view.stereo_m,
        .tour = &view->eye.tour,
        .metrics = &view->frames.metrics,
        .now_ns = monotonic_now_ns(),
        .picture_width = view->frames.last.width,
        .picture_height = view->frames.last.height,
        .samples = view->frames.last.samples,
        .samples_wanted = view_has_samples(view, &view->frames.last, view->render.sampling.samples)
                              ? view->frames.last.samples
                              : view->render.sampling.samples,
        .depth = view->render.light.depth,
        .depth_less = view->frames.last.depth_less < view->render.light.depth ? view->frames.last.depth_less
                                                                              : view->render.light.depth,
        .moving = view->frames.last.moving,
        .revision = view->frames.last.revision,
        .wire_bytes = view->frames.last.wire_bytes,
        .encoding = view->frames.last.encoding,
        .quality = view->frames.last.frame_quality,
        .heat = view->heat.is_there        ? HUD_HEAT_SHOWN
                : view->settings.error_map ? HUD_HEAT_WAITING
                                           : HUD_HEAT_NONE,
        .heat_figures = view->heat.figures,
        .heat_top = HEAT_TOP};
    for (size_t i = 0; i < view->frames.structure_count; i++)
        state->structure[i] = view->frames.structure[i];
    fill_names(viewer, state);
    fill_status(viewer, state);
    fill_local(viewer, state);
    state->edit = editor_hud(&viewer->edit);
    if (viewer->screen.notice_ns > state->now_ns)
        state->notice = viewer->screen.notice;
}

static bool paint(struct viewer *viewer, struct pixmap *made, struct fl_error *error)
{
    struct hud_state state;
    viewer_hud(viewer, &state);
    return paint_in_memory(viewer->screen.width, viewer->screen.height, view_picture(&viewer->view), &state, made,
                           error);
}

bool viewer_screenshot(struct viewer *viewer, const char *path, struct fl_error *error)
{
    struct pixmap made = {0};
    const bool done = paint(viewer, &made, error) && snapshot_write(path, &made, error);
    pixmap_finish(&made);
    return done;
}

bool viewer_keep_screenshot(struct viewer *viewer, const char *path, struct fl_error *error)
{
    struct viewer_shot *shots =
        realloc(viewer->replaying.shots, (viewer->replaying.shot_count + 1) * sizeof(*shots));
    if (!shots)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    viewer->replaying.shots = shots;
    struct viewer_shot *shot = &shots[viewer->replaying.shot_count];
    *shot = (struct viewer_shot){.path = path};
    if (!paint(viewer, &shot->picture, error))
        return false;
    viewer->replaying.shot_count++;
    return true;
}

bool viewer_write_screenshots(struct viewer *viewer, struct fl_error *error)
{
    bool done = true;
    for (size_t i = 0; i < viewer->replaying.shot_count; i++) {
        done = done && snapshot_write(viewer->replaying.shots[i].path, &viewer->replaying.shots[i].picture, error);
        pixmap_finish(&viewer->replaying.shots[i].picture);
    }
    free(viewer->replaying.shots);
    viewer->replaying.shots = NULL;
    viewer->replaying.shot_count = 0;
    return done;
}

static json_t *vector_json(const double vector[3])
{
    return json_pack("[f,f,f]", vector[0], vector[1], vector[2]);
}

static json_t *settings_json(const struct settings *settings)
{
    json_t *object = json_object();
    const struct field_desc *setting;
    char value[40];
    for (size_t i = 0; (setting = panel_setting(settings->tracer, i)); i++) {
        panel_value(setting, &settings->tracers, value, sizeof(value));
        json_object_set_new(object, setting->name, json_string(value));
    }
    return object;
}

static json_t *structure_json(const struct viewer *viewer)
{
    json_t *list = json_array();
    for (size_t i = 0; i < viewer->view.frames.structure_count; i++)
        json_array_append_new(list, json_string(viewer->view.frames.structure[i]));
    return list;
}

static json_t *local_json(const struct viewer *viewer, const struct hud_state *state,
                          const struct metrics_summary *summary)
{
    const struct view *view = &viewer->view;
    const struct hud_local *local = &state->local;
    json_t *object =
        json_pack("{s:s, s:b, s:b, s:I, s:f, s:f, s:f, s:s, s:I, s:I, s:i}", "views",
                  local_views_names[view->settings.local], "on", (int)local->on, "shown", (int)local->shown,
                  "made", (json_int_t)view->local.count, "views_per_second", summary->views_per_second,
                  "latency_s", summary->view_latency_s, "latency_99_s", summary->view_latency_99_s, "holes",
                  view->settings.holes == FL_WARP_FILL ? "fill" : "pattern", "picture_bytes",
                  (json_int_t)(state->wire_bytes - local->depth_bytes), "depth_bytes",
                  (json_int_t)local->depth_bytes, "layers", (int)view->local.made_of.layers);
    if (!object || !local->shown)
        return object;
    json_object_set_new(object, "quality", json_string(local->quality == FL_WARP_TREE ? "tree" : "iterative"));
    json_object_set_new(object, "age_s", json_real(local->age_s));
    json_object_set_new(object, "unseen", json_real(local->unseen));
    json_object_set_new(object, "sticking", json_real(local->sticking));
    json_object_set_new(object, "processor_s", json_real(local->view_s));
    json_object_set_new(object, "build_s", json_real((double)view->local.made_of.build_ns * 1e-9));
    if (isfinite(local->bound_pixels))
        json_object_set_new(object, "bound_pixels", json_real(local->bound_pixels));
    return object;
}

/* The content of the panel. */
static json_t *edit_json(const struct editor *edit)
{
    const struct fl_object_state *state = &edit->state;
    json_t *fields = json_object();
    for (size_t i = 0; edit->has_state && i < state->count; i++) {
        json_t *values = json_array();
        for (unsigned k = 0; k < state->fields[i].field.count; k++)
            json_array_append_new(values, json_real(state->fields[i].values[k]));
        json_object_set_new(fields, state->fields[i].field.name, values);
    }
    return json_pack("{s:s, s:s, s:i, s:s, s:s, s:o}", "kind", edit->hud.tabs[edit->choice.tab], "title",
                     edit->hud.title, "object", edit->has_state ? (int)state->id : 0, "name",
                     edit->has_state ? state->name : "", "row", edit->hud.rows[edit->chosen].name, "fields",
                     fields);
}

void viewer_print_state(struct viewer *viewer, const char *name)
{
    struct view *view = &viewer->view;
    static const char *const statuses[] = {"loading", "live", "lost", "refused"};
    struct hud_state state;
    struct metrics_summary summary;
    viewer_hud(viewer, &state);
    metrics_summarise(&view->frames.metrics, state.now_ns, &summary);
    json_t *line = json_pack(
        "{s:s, s:s, s:s, s:s, s:s, s:s, s:s, s:f, s:i, s:i, s:b, s:i, s:i, s:I, s:i, s:I, s:s, s:s, s:f, s:b, "
        "s:o, "
        "s:o, s:o, s:o, s:f, s:f, s:f, s:b, s:s, s:o, s:i}",
        "state", name, "scene", state.scene, "status", statuses[state.status], "tracer",
        protocol_tracer_text(view->frames.last.tracer), "integrator",
        protocol_integrator_text(view->frames.last.integrator), "tone_map",
        protocol_tone_map_text(view->settings.tone_map), "encoding",
        protocol_encoding_text(view->frames.last.encoding), "exposure_stops",
        (double)view->frames.last.exposure_stops, "samples", (int)state.samples, "samples_wanted",
        (int)state.samples_wanted, "moving", (int)state.moving, "width", (int)state.picture_width, "height",
        (int)state.picture_height, "frames", (json_int_t)view->frames.count, "times_live", (int)viewer->times_live,
        "revision", (json_int_t)state.revision, "camera", state.camera, "clip", state.clip, "time_s",
        (double)view->frames.last.time_s, "playing", (int)view->eye.tour.playing, "eye",
        vector_json(view->eye.camera.eye), "look_at", vector_json(view->eye.camera.look_at), "settings",
        settings_json(&view->settings), "structure", structure_json(viewer), "fov_y", view->eye.camera.fov_y,
        "frames_per_second", summary.frames_per_second, "latency_s", summary.latency_s, "stereo",
        (int)view->settings.stereo, "eyes", protocol_view_source_text(view->settings.views), "local",
        local_json(viewer, &state, &summary), "depth_less", (int)state.depth_less);
    if (line && view->heat.is_there)
        json_object_set_new(line, "errors",
                            json_pack("{s:f, s:f, s:f}", "mean", view->heat.figures.mean, "max",
                                      view->heat.figures.max, "beyond", view->heat.figures.beyond));
    if (line && viewer->edit.choice.shown)
        json_object_set_new(line, "edit", edit_json(&viewer->edit));
    if (line && viewer->screen.notice_ns > state.now_ns)
        json_object_set_new(line, "notice", json_string(viewer->screen.notice));
    char *text = json_dumps(line, JSON_COMPACT | JSON_ENSURE_ASCII | JSON_REAL_PRECISION(9));
    if (text)
        puts(text);
    fflush(stdout);
    free(text);
    json_decref(line);
}
