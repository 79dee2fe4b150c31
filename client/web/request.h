/* SPDX-License-Identifier: MIT */
/* Requests of the page, read once and checked: JSON with one of "show", "camera", "shown", "key", "compare",
 * "list", "read", "edit", "undo", "redo". No I/O. */
#ifndef FARLIGHT_CLIENT_WEB_REQUEST_H
#define FARLIGHT_CLIENT_WEB_REQUEST_H

#include "lib/farlight.h"

#define WEB_REQUEST_BYTES_MAX 2048u
#define WEB_WIDTH_MAX 3840u
#define WEB_HEIGHT_MAX 2160u

enum web_request_kind {
    WEB_NONE,    /* no request */
    WEB_SHOW,    /* {"show": {"width", "height", "h264", "tracer", "integrator", "clip"}} */
    WEB_CAMERA,  /* {"camera": {"id", "eye", "at", "up", "fov", "time", "moving", "node"}} */
    WEB_SHOWN,   /* {"shown": N}: another N frames are visible */
    WEB_KEY,     /* {"key": true}: a frame in H.264 could not be decoded */
    WEB_COMPARE, /* {"compare": N}: compare the picture's tracer with the reference; the answer carries N */
    /* Only for browsers that may edit; one at a time. */
    WEB_LIST, /* {"list": {"kind", "match"}}: objects of this kind whose names contain the text */
    WEB_READ, /* {"read": {"kind", "id"}} */
    WEB_EDIT, /* {"edit": {"kind", "id", "field", "values"}} */
    WEB_UNDO, /* {"undo": true}: undo the newest change of this browser */
    WEB_REDO  /* {"redo": true}: repeat the newest change that it has undone */
};

static inline bool web_request_edits(enum web_request_kind kind)
{
    return kind >= WEB_LIST;
}

/* The requested picture. */
struct web_show {
    uint32_t width, height;                /* pixels */
    bool h264, has_tracer, has_integrator; /* false: the gateway's defaults */
    enum protocol_tracer tracer;
    enum protocol_integrator integrator;
    uint32_t clip; /* 0: none */
};

struct web_request {
    enum web_request_kind kind;
    struct web_show show;
    struct fl_view_camera camera;
    uint32_t id; /* the page's number of the camera, which frames carry, or of the comparison */
    uint32_t shown;
    struct fl_assignment assignment; /* WEB_LIST: `kind` and `which`; WEB_READ: `kind` and `id`; WEB_EDIT: all */
};

/* Reads a request. False: *error names the wrong field. */
bool web_request_read(const char *text, size_t bytes, struct web_request *request, struct fl_error *error);

#endif
