/* SPDX-License-Identifier: MIT */
/* Requests of the page, read from JSON and checked. */
#include "web/request.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#define SIDE_MIN 16
#define SHOWN_MAX 64
#define PLACE_MAX 1e9 /* metres */
/* Sine of the angle between the view's direction and up below which they count as parallel */
#define PARALLEL 1e-6
#define FOV_MIN 0.001
#define FOV_MAX 3.1
#define TIME_MAX 1e6
#define VALUE_MAX 1e30 /* limit of all fields; the library checks each field's own */

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

/* False for a camera that the daemon would refuse, since a refusal ends the view. */
static bool is_sound(const double eye[3], const double at[3], const double up[3])
{
    double into[3], into_square = 0, up_square = 0;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(eye[i]) <= PLACE_MAX && fabs(at[i]) <= PLACE_MAX && fabs(up[i]) <= PLACE_MAX))
            return false;
        /* Rounded to floats as in the message. */
        into[i] = (double)(float)at[i] - (double)(float)eye[i];
        into_square += into[i] * into[i];
        up_square += up[i] * up[i];
    }
    const double cross[3] = {into[1] * up[2] - into[2] * up[1], into[2] * up[0] - into[0] * up[2],
                             into[0] * up[1] - into[1] * up[0]};
    const double cross_square = cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2];
    return into_square > 0 && up_square > 0 && cross_square > PARALLEL * PARALLEL * into_square * up_square;
}

static bool read_camera(json_t *json, struct web_request *request, struct fl_error *error)
{
    json_error_t why;
    json_int_t id = 0, node = 0;
    double eye[3], at[3], up[3], fov = 0, time = 0;
    int moving = 0;
    struct fl_view_camera *camera = &request->camera;
    if (json_unpack_ex(json, &why, JSON_STRICT, "{s:I,s:[F,F,F!],s:[F,F,F!],s:[F,F,F!],s:F,s:F,s:b,s:I}", "id",
                       &id, "eye", &eye[0], &eye[1], &eye[2], "at", &at[0], &at[1], &at[2], "up", &up[0], &up[1],
                       &up[2], "fov", &fov, "time", &time, "moving", &moving, "node", &node) != 0)
        return refuse(error, "camera", why.text);
    if (id < 0 || id > UINT32_MAX || node < 0 || node > UINT32_MAX)
        return refuse(error, "camera.id", "is no number of 32 bits");
    if (!is_sound(eye, at, up))
        return refuse(error, "camera", "the camera looks nowhere");
    if (!(fov >= FOV_MIN && fov <= FOV_MAX) || !(fabs(time) <= TIME_MAX))
        return refuse(error, "camera.fov", "field of view or time is out of range");
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

static bool read_kind(const char *name, enum protocol_object_kind *kind, struct fl_error *error)
{
    if (protocol_object_kind_parse(name, kind) &&
        (*kind == PROTOCOL_OBJECT_NODE || *kind == PROTOCOL_OBJECT_MATERIAL || *kind == PROTOCOL_OBJECT_LIGHT ||
         *kind == PROTOCOL_OBJECT_ENVIRONMENT))
        return true;
    return refuse(error, "kind", "cannot be edited");
}

static bool read_list(json_t *json, struct fl_assignment *wanted, struct fl_error *error)
{
    json_error_t why;
    const char *kind = NULL, *match = NULL;
    if (json_unpack_ex(json, &why, JSON_STRICT, "{s:s,s:s}", "kind", &kind, "match", &match) != 0)
        return refuse(error, "list", why.text);
    if (strlen(match) >= sizeof(wanted->which))
        return refuse(error, "list.match", "is longer than a name");
    memcpy(wanted->which, match, strlen(match) + 1);
    return read_kind(kind, &wanted->kind, error);
}

/* Reads "field" and "values" of an edit. */
static bool read_change(const char *field, json_t *values, struct fl_assignment *wanted, struct fl_error *error)
{
    if (strlen(field) >= sizeof(wanted->field))
        return refuse(error, "edit.field", "there is no such field");
    memcpy(wanted->field, field, strlen(field) + 1);
    const size_t count = json_array_size(values); /* 0 if `values` is no array */
    if (count < 1 || count > FL_FIELD_VALUES_MAX)
        return refuse(error, "edit.values", "no field has this many values");
    wanted->way = FL_ASSIGN;
    wanted->count = (unsigned)count;
    for (size_t i = 0; i < count; i++) {
        const json_t *value = json_array_get(values, i);
        wanted->values[i] = json_number_value(value);
        if (!json_is_number(value) || !(fabs(wanted->values[i]) <= VALUE_MAX))
            return refuse(error, "edit.values", "is no number, or a huge one");
    }
    return true;
}

static bool read_object(json_t *json, bool is_edit, struct fl_assignment *wanted, struct fl_error *error)
{
    json_error_t why;
    const char *kind = NULL, *field = NULL;
    json_int_t id = 0;
    json_t *values = NULL;
    if (json_unpack_ex(json, &why, JSON_STRICT, is_edit ? "{s:s,s:I,s:s,s:o}" : "{s:s,s:I}", "kind", &kind, "id",
                       &id, "field", &field, "values", &values) != 0)
        return refuse(error, is_edit ? "edit" : "read", why.text);
    if (id < 1 || id > UINT32_MAX)
        return refuse(error, "id", "is no identifier");
    wanted->id = (uint32_t)id;
    return read_kind(kind, &wanted->kind, error) && (!is_edit || read_change(field, values, wanted, error));
}

/* Reads the requests that only browsers with the right to edit may send. */
static bool read_editing(const char *name, json_t *value, struct web_request *request, struct fl_error *error)
{
    if (strcmp(name, "list") == 0) {
        request->kind = WEB_LIST;
        return read_list(value, &request->assignment, error);
    }
    if (strcmp(name, "read") == 0 || strcmp(name, "edit") == 0) {
        request->kind = name[0] == 'e' ? WEB_EDIT : WEB_READ;
        return read_object(value, request->kind == WEB_EDIT, &request->assignment, error);
    }
    const bool is_redo = strcmp(name, "redo") == 0;
    request->kind = is_redo ? WEB_REDO : WEB_UNDO;
    return ((is_redo || strcmp(name, "undo") == 0) && json_is_true(value)) ||
           refuse(error, "message", "not a request of a page");
}

static bool read_one(const char *name, json_t *value, struct web_request *request, struct fl_error *error)
{
    if (strcmp(name, "show") == 0) {
        request->kind = WEB_SHOW;
        return read_show(value, &request->show, error);
    }
    if (strcmp(name, "camera") == 0) {
        request->kind = WEB_CAMERA;
        return read_camera(value, request, error);
    }
    if (strcmp(name, "key") == 0 && json_is_true(value)) {
        request->kind = WEB_KEY;
        return true;
    }
    if (strcmp(name, "compare") == 0)
        return read_compare(value, request, error);
    const json_int_t shown = json_integer_value(value);
    if (strcmp(name, "shown") != 0)
        return read_editing(name, value, request, error);
    if (shown < 1 || shown > SHOWN_MAX)
        return refuse(error, "shown", "is no number of frames");
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
    void *first = json_object_iter(json); /* NULL for JSON that is not an object */
    const bool good = json_object_size(json) == 1 && first
                          ? read_one(json_object_iter_key(first), json_object_iter_value(first), request, error)
                          : refuse(error, "message", "is no object of one member");
    json_decref(json);
    return good;
}
