/* SPDX-License-Identifier: MIT */
#include "web/request.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#define SIDE_MIN 16
#define SHOWN_MAX 64
#define PLACE_MAX 1e9 /* metres */
#define PARALLEL 1e-6 /* sine between the view's direction and up, below which they are taken for parallel */
#define FOV_MIN 0.001
#define FOV_MAX 3.1
#define TIME_MAX 1e6

static bool refuse(struct fl_error *error, const char *field, const char *what)
{
    return fl_error_set(error, FL_ERROR_ARGUMENT, field, "%s", what);
}

static bool read_show(json_t *json, struct web_show *show, struct fl_error *error)
{
    json_error_t why;
    json_int_t width = 0, height = 0, clip = 0;
    const char *tracer = NULL, *integrator = NULL;
    int h264 = 0;
    if (json_unpack_ex(json, &why, JSON_STRICT, "{s:I,s:I,s:b,s?s,s?s,s:I}", "width", &width, "height", &height,
                       "h264", &h264, "tracer", &tracer, "integrator", &integrator, "clip", &clip) != 0)
        return refuse(error, "show", why.text);
    if (width < SIDE_MIN || width > (json_int_t)WEB_WIDTH_MAX || height < SIDE_MIN ||
        height > (json_int_t)WEB_HEIGHT_MAX)
        return refuse(error, "show.width", "no window has this size");
    if (clip < 0 || clip > UINT32_MAX)
        return refuse(error, "show.clip", "is no clip");
    show->has_tracer = tracer != NULL;
    show->has_integrator = integrator != NULL;
    if (tracer && !protocol_tracer_parse(tracer, &show->tracer))
        return refuse(error, "show.tracer", "there is no such tracer");
    if (integrator && !protocol_integrator_parse(integrator, &show->integrator))
        return refuse(error, "show.integrator", "there is no such integrator");
    show->width = (uint32_t)width;
    show->height = (uint32_t)height;
    show->h264 = h264 != 0;
    show->clip = (uint32_t)clip;
    return true;
}

/* A camera that the daemon would refuse ends its view. */
static bool is_sound(const double eye[3], const double at[3], const double up[3])
{
    double into[3], into_square = 0, up_square = 0;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(eye[i]) <= PLACE_MAX && fabs(at[i]) <= PLACE_MAX && fabs(up[i]) <= PLACE_MAX))
            return false;
        /* As it will be sent. */
        into[i] = (double)(float)at[i] - (double)(float)eye[i];
        into_square += into[i] * into[i];
        up_square += up[i] * up[i];
    }
    const double cross[3] = {into[1] * up[2] - into[2] * up[1], into[2] * up[0] - into[0] * up[2],
                             into[0] * up[1] - into[1] * up[0]};
    const double cross_square = cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2];
    return into_square > 0 && up_square > 0 && cross_square > PARALLEL * PARALLEL * into_square * up_square;
}

static bool read_look(json_t *json, struct web_request *request, struct fl_error *error)
{
    json_error_t why;
    json_int_t id = 0, node = 0;
    double eye[3], at[3], up[3], fov = 0, time = 0;
    int moving = 0;
    struct fl_view_camera *camera = &request->camera;
    if (json_unpack_ex(json, &why, JSON_STRICT, "{s:I,s:[F,F,F!],s:[F,F,F!],s:[F,F,F!],s:F,s:F,s:b,s:I}", "id",
                       &id, "eye", &eye[0], &eye[1], &eye[2], "at", &at[0], &at[1], &at[2], "up", &up[0], &up[1],
                       &up[2], "fov", &fov, "time", &time, "moving", &moving, "node", &node) != 0)
        return refuse(error, "look", why.text);
    if (id < 0 || id > UINT32_MAX || node < 0 || node > UINT32_MAX)
        return refuse(error, "look.id", "is no number of 32 bits");
    if (!is_sound(eye, at, up))
        return refuse(error, "look", "the camera looks nowhere");
    if (!(fov >= FOV_MIN && fov <= FOV_MAX) || !(fabs(time) <= TIME_MAX))
        return refuse(error, "look.fov", "field of view or time is out of range");
    for (int i = 0; i < 3; i++) {
        camera->eye_world[i] = (float)eye[i];
        camera->look_at_world[i] = (float)at[i];
        camera->up_world[i] = (float)up[i];
    }
    camera->fov_y = (float)fov;
    camera->time_s = (float)time;
    camera->moving = moving != 0;
    camera->node = (uint32_t)node;
    request->id = (uint32_t)id;
    return true;
}

static bool read_compare(json_t *json, struct web_request *request, struct fl_error *error)
{
    const json_int_t id = json_is_integer(json) ? json_integer_value(json) : -1;
    if (id < 0 || id > UINT32_MAX)
        return refuse(error, "compare", "is no number of 32 bits");
    request->kind = WEB_COMPARE;
    request->id = (uint32_t)id;
    return true;
}

static bool read_one(const char *name, json_t *value, struct web_request *request, struct fl_error *error)
{
    if (strcmp(name, "show") == 0) {
        request->kind = WEB_SHOW;
        return read_show(value, &request->show, error);
    }
    if (strcmp(name, "look") == 0) {
        request->kind = WEB_LOOK;
        return read_look(value, request, error);
    }
    if (strcmp(name, "key") == 0 && json_is_true(value)) {
        request->kind = WEB_KEY;
        return true;
    }
    if (strcmp(name, "compare") == 0)
        return read_compare(value, request, error);
    const json_int_t shown = json_integer_value(value);
    if (strcmp(name, "shown") != 0 || shown < 1 || shown > SHOWN_MAX)
        return refuse(error, "message", "nothing that a page sends");
    request->kind = WEB_SHOWN;
    request->shown = (uint32_t)shown;
    return true;
}

bool web_request_read(const char *text, size_t bytes, struct web_request *request, struct fl_error *error)
{
    json_error_t why;
    *request = (struct web_request){0};
    json_t *json = json_loadb(text, bytes, JSON_REJECT_DUPLICATES, &why);
    if (!json)
        return refuse(error, "message", "is no JSON");
    void *first = json_object_iter(json); /* NULL of what is no object */
    const bool good = json_object_size(json) == 1 && first
                          ? read_one(json_object_iter_key(first), json_object_iter_value(first), request, error)
                          : refuse(error, "message", "is no object of one member");
    json_decref(json);
    return good;
}
