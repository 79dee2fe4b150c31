/* SPDX-License-Identifier: MIT */
/* Comparison of a tracer with the reference, as a map of errors. */
#include "web/error_map.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WEIGHT 8u /* a view has 4; it is refined further while the comparison runs */

static void shrink(struct message_render *render)
{
    const double pixels = (double)render->picture.width * render->picture.height;
    const double share = pixels > ERROR_MAP_PIXELS_MAX ? sqrt(ERROR_MAP_PIXELS_MAX / pixels) : 1;
    render->picture.width = (uint32_t)fmax(1, render->picture.width * share);
    render->picture.height = (uint32_t)fmax(1, render->picture.height * share);
}

/* A job's first frame is at its time 0, so the clip starts earlier by the view's time. */
static void place(struct error_map *map, const struct fl_view_camera *camera)
{
    struct message_render *render = &map->render;
    if (render->clips_count > 0) {
        map->clip = render->clips[0];
        map->clip.start_s -= camera->time_s;
        render->clips = &map->clip;
        render->clips_count = 1;
    }
    if (camera->node != 0) {
        render->camera.camera_path = PROTOCOL_CAMERA_NODE;
        render->camera.camera_node = camera->node;
        return;
    }
    memcpy(map->key.eye_world, camera->eye_world, sizeof(map->key.eye_world));
    memcpy(map->key.look_at_world, camera->look_at_world, sizeof(map->key.look_at_world));
    memcpy(map->key.up_world, camera->up_world, sizeof(map->key.up_world));
    map->key.fov_y = camera->fov_y;
    render->camera.camera_path = PROTOCOL_CAMERA_KEYS;
    render->keys = &map->key;
    render->keys_count = 1;
}

bool error_map_begin(struct error_map *map, struct fl_scene *scene, const struct message_render *view,
                     const struct fl_view_camera *camera, struct fl_error *error)
{
    error_map_end(map);
    map->render = *view;
    struct message_render *render = &map->render;
    shrink(render);
    render->sampling.samples = ERROR_MAP_SAMPLES;
    render->tracing.primary = PROTOCOL_PRIMARY_TRACE;
    render->comparison.compare = 1;
    render->comparison.compare_with = PROTOCOL_TRACER_REFERENCE;
    render->encoding = render->view.still_encoding =
        PROTOCOL_ENCODING_PREDICTED;                /* errors of a lossy encoding would count */
    render->picture.denoise = PROTOCOL_DENOISE_OFF; /* a filter would hide errors */
    render->view.adapt = 0;
    render->weight = WEIGHT;
    render->view.moving_rate = render->sampling.noise = 0;
    if (camera)
        place(map, camera);
    map->job = fl_render_start(scene, render, error);
    return map->job != NULL;
}

static void mark(struct fl_frame *frame, const struct fl_frame *reference)
{
    const size_t pixels = (size_t)frame->width * frame->height;
    for (size_t i = 0; i < pixels; i++) {
        int largest = 0;
        for (size_t c = 0; c < 3; c++) {
            const int difference = abs(frame->pixels[i * 4 + c] - reference->pixels[i * 4 + c]);
            largest = difference > largest ? difference : largest;
        }
        /* Maximum over this pixel's channels; earlier pixels are overwritten */
        frame->pixels[i] = (uint8_t)largest;
    }
}

/* Starts the same picture with the reference. */
static bool start_reference(struct error_map *map, struct fl_scene *scene, struct fl_error *error)
{
    map->render.comparison.compare = 0;
    map->render.tracing.tracer = PROTOCOL_TRACER_REFERENCE;
    map->job = fl_render_start(scene, &map->render, error);
    return map->job != NULL;
}

bool error_map_step(struct error_map *map, struct fl_scene *scene, struct fl_error *error)
{
    bool done = false;
    struct fl_frame *frame = map->job ? fl_render_poll(map->job, 0, &done, error) : NULL;
    if (!frame)
        return false;
    fl_render_destroy(map->job);
    map->job = NULL;
    if (!map->frame) {
        map->frame = frame;
        start_reference(map, scene, error);
        return false;
    }
    const bool fits = frame->width == map->frame->width && frame->height == map->frame->height &&
                      frame->format == PROTOCOL_PIXEL_FORMAT_RGBA8 && map->frame->format == frame->format;
    const bool is_same = frame->revision == map->frame->revision;
    if (fits && is_same)
        mark(map->frame, frame);
    fl_frame_destroy(frame);
    if (!fits)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "", "two frames of one picture differ in their form");
    return is_same ||
           fl_error_set(error, FL_ERROR_REFUSED, "", "the scene has changed while its tracers were compared");
}

void error_map_end(struct error_map *map)
{
    fl_render_destroy(map->job);
    fl_frame_destroy(map->frame);
    *map = (struct error_map){0};
}
