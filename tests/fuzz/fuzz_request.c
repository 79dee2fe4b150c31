/* SPDX-License-Identifier: MIT */
/* Any bytes as a message of a page to farlight-web, and as the Host that a browser names. */
#include "tests/fuzz/fuzz.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "web/address.h"
#include "web/request.h"

static void check_show(const struct web_show *show)
{
    FUZZ_REQUIRE(show->width > 0 && show->width <= WEB_WIDTH_MAX);
    FUZZ_REQUIRE(show->height > 0 && show->height <= WEB_HEIGHT_MAX);
    FUZZ_REQUIRE(!show->has_tracer || protocol_tracer_text(show->tracer));
    FUZZ_REQUIRE(!show->has_integrator || protocol_integrator_text(show->integrator));
}

/* The daemon ends a view whose camera looks nowhere. */
static void check_camera(const struct fl_view_camera *camera)
{
    double into[3], square = 0, up_square = 0, cross_square = 0;
    for (int i = 0; i < 3; i++) {
        FUZZ_REQUIRE(fabsf(camera->eye_world[i]) <= 1e12f && fabsf(camera->up_world[i]) <= 1e12f);
        into[i] = (double)camera->look_at_world[i] - (double)camera->eye_world[i];
        square += into[i] * into[i];
        up_square += (double)camera->up_world[i] * (double)camera->up_world[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double part = into[j] * (double)camera->up_world[k] - into[k] * (double)camera->up_world[j];
        cross_square += part * part;
    }
    FUZZ_REQUIRE(square > 0 && up_square > 0 && cross_square > 0);
    FUZZ_REQUIRE(camera->fov_y >= 0.001f && camera->fov_y <= 3.1f && fabsf(camera->time_s) <= 1e6f);
}

static void check_assignment(const struct web_request *request)
{
    const struct fl_assignment *wanted = &request->assignment;
    FUZZ_REQUIRE(wanted->kind == PROTOCOL_OBJECT_NODE || wanted->kind == PROTOCOL_OBJECT_MATERIAL ||
                 wanted->kind == PROTOCOL_OBJECT_LIGHT || wanted->kind == PROTOCOL_OBJECT_ENVIRONMENT);
    FUZZ_REQUIRE(memchr(wanted->which, '\0', sizeof(wanted->which)));
    FUZZ_REQUIRE(memchr(wanted->field, '\0', sizeof(wanted->field)));
    FUZZ_REQUIRE(request->kind == WEB_LIST || wanted->id > 0);
    FUZZ_REQUIRE(wanted->count <= FL_FIELD_VALUES_MAX && (request->kind != WEB_EDIT || wanted->count > 0));
    for (unsigned i = 0; i < wanted->count; i++)
        FUZZ_REQUIRE(isfinite(wanted->values[i]));
}

static void check_request(const uint8_t *data, size_t size)
{
    struct web_request request;
    struct fl_error error = {0};
    if (!web_request_read((const char *)data, size, &request, &error)) {
        FUZZ_REQUIRE(error.code == FL_ERROR_ARGUMENT && error.field[0] != '\0');
        return;
    }
    FUZZ_REQUIRE(error.code == FL_ERROR_NONE);
    if (request.kind == WEB_SHOW)
        check_show(&request.show);
    else if (request.kind == WEB_CAMERA)
        check_camera(&request.camera);
    else if (request.kind == WEB_SHOWN)
        FUZZ_REQUIRE(request.shown > 0);
    else if (web_request_edits(request.kind) && request.kind != WEB_UNDO)
        check_assignment(&request);
}

/* Nothing that could be looked up as a name is answered, but for the names that are ours. */
static void check_host(const char *host)
{
    static const char *const names[] = {"view.example"};
    struct web_address address;
    struct fl_error error = {0};
    if (web_address_read(host, &address, &error))
        FUZZ_REQUIRE(address.port >= 0 && address.port <= 65535 && web_host_is_ours(host, NULL, 0));
    if (web_host_is_ours(host, names, 1) && !web_host_is_ours(host, NULL, 0))
        FUZZ_REQUIRE(strncasecmp(host, names[0], strlen(names[0])) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    check_request(data, size);
    char *host = malloc(size + 1);
    if (!host)
        return 0;
    memcpy(host, data, size);
    host[size] = '\0';
    check_host(host);
    free(host);
    return 0;
}
