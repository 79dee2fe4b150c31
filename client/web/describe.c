/* SPDX-License-Identifier: MIT */
/* Messages to the page, as JSON. */
#include "web/describe.h"
#include "options/wave_table.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#define NAMES_MAX 256u /* limit of cameras or clips in a menu */
#define STAGES_MAX 96u

static json_t *cameras(const struct fl_scene *scene)
{
    json_t *list = json_array();
    const size_t count = fl_scene_camera_count(scene);
    for (size_t i = 0; i < count && i < NAMES_MAX; i++) {
        const struct fl_camera_info *camera = fl_scene_camera(scene, i);
        json_array_append_new(list,
                              json_pack("{s:I,s:s}", "node", (json_int_t)camera->node, "name", camera->name));
    }
    return list;
}

static json_t *clips(const struct fl_scene *scene)
{
    json_t *list = json_array();
    const size_t count = fl_scene_clip_count(scene);
    for (size_t i = 0; i < count && i < NAMES_MAX; i++) {
        const struct fl_clip_info *clip = fl_scene_clip(scene, i);
        if (clip->clip != 0)
            json_array_append_new(list, json_pack("{s:I,s:s,s:f}", "clip", (json_int_t)clip->clip, "name",
                                                  clip->name, "seconds", (double)clip->duration_s));
    }
    return list;
}

static json_t *tracers(void)
{
    json_t *list = json_array();
    for (size_t i = 0; i < tracer_desc_count; i++)
        if (!tracer_descs[i].is_for_tests)
            json_array_append_new(list, json_string(tracer_descs[i].name));
    return list;
}

static json_t *integrators(void)
{
    json_t *list = json_array();
    for (int i = 0; i < PROTOCOL_INTEGRATOR_COUNT; i++)
        json_array_append_new(list, json_string(protocol_integrator_text((enum protocol_integrator)i)));
    return list;
}

static json_t *numbers(const float *values, size_t count)
{
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(list, json_real((double)values[i]));
    return list;
}

static char *print(json_t *json)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(json);
    return text;
}

char *web_describe_scene(struct fl_scene *scene, const char *name, const struct message_render *render,
                         const struct fl_scene_bounds *bounds, bool can_h264, bool may_edit)
{
    return print(json_pack(
        "{s:{s:s,s:b,s:I,s:I,s:b,s:o,s:o,s:o,s:o,s:s,s:s,s:o,s:o}}", "scene", "name", name, "edit", may_edit,
        "node", (json_int_t)(render->camera.camera_path == PROTOCOL_CAMERA_NODE ? render->camera.camera_node : 0),
        "triangles", (json_int_t)bounds->triangles, "h264", can_h264, "cameras", cameras(scene), "clips",
        clips(scene), "tracers", tracers(), "integrators", integrators(), "tracer",
        protocol_tracer_text(render->tracing.tracer), "integrator",
        protocol_integrator_text(render->light.integrator), "lower", numbers(bounds->lower_world, 3), "upper",
        numbers(bounds->upper_world, 3)));
}

static json_t *stages(const struct fl_frame *frame)
{
    json_t *list = json_array();
    for (size_t i = 0; i < frame->stage_count && i < STAGES_MAX; i++) {
        const struct record_stage_time *stage = &frame->stages[i];
        json_array_append_new(list, json_pack("[s,s,f,f]", protocol_stage_text(stage->stage),
                                              protocol_clock_text(stage->clock), (double)stage->start_ns * 1e-6,
                                              (double)stage->duration_ns * 1e-6));
    }
    return list;
}

char *web_describe_frame(const struct fl_frame *frame, uint32_t id)
{
    return print(
        json_pack("{s:I,s:I,s:I,s:I,s:I,s:I,s:s,s:b,s:b,s:s,s:s,s:f,s:f,s:o,s:o}", "frame",
                  (json_int_t)frame->frame, "revision", (json_int_t)frame->revision, "id", (json_int_t)id, "width",
                  (json_int_t)frame->width, "height", (json_int_t)frame->height, "samples",
                  (json_int_t)frame->samples, "encoding", protocol_encoding_text(frame->encoding), "key",
                  frame->key_frame, "moving", frame->moving, "tracer", protocol_tracer_text(frame->tracer),
                  "integrator", protocol_integrator_text(frame->integrator), "fov", (double)frame->fov_y, "time",
                  (double)frame->time_s, "camera", numbers(frame->world_from_view, 12), "stages", stages(frame)));
}

char *web_describe_errors(const struct fl_frame *frame, double far_share, uint32_t id)
{
    return print(json_pack("{s:{s:I,s:I,s:I,s:I,s:I,s:s,s:s,s:f,s:o,s:o}}", "errors", "compare", (json_int_t)id,
                           "width", (json_int_t)frame->width, "height", (json_int_t)frame->height, "samples",
                           (json_int_t)frame->samples, "revision", (json_int_t)frame->revision, "tracer",
                           protocol_tracer_text(frame->tracer), "reference",
                           protocol_tracer_text(PROTOCOL_TRACER_REFERENCE), "far_share", far_share, "waves",
                           cli_waves_json(frame), "all", cli_wave_total_json(frame)));
}

char *web_describe_refusal(const struct fl_error *error, uint32_t id)
{
    char line[1200];
    fl_error_print(error, line, sizeof(line));
    return print(json_pack("{s:{s:I,s:s}}", "refused", "compare", (json_int_t)id, "text", line));
}

char *web_describe_edit_refusal(const struct fl_error *error)
{
    char line[1200];
    fl_error_print(error, line, sizeof(line));
    return print(json_pack("{s:{s:b,s:s}}", "refused", "edit", 1, "text", line));
}

char *web_describe_error(const struct fl_error *error, bool again)
{
    char line[1200];
    fl_error_print(error, line, sizeof(line));
    const bool is_of_clip = strncmp(error->field, "render.clips", strlen("render.clips")) == 0;
    return print(json_pack("{s:{s:s,s:b,s:b}}", "error", "text", line, "again", again, "clip", is_of_clip));
}
