/* SPDX-License-Identifier: MIT */
/* How long a client waits for the answer to a cancel while its frame is rendered, over a socket.
 * Usage: bench cancel ADDRESS MODEL [CANCELS [TRACER]]   (default: 20, tracer 0 of the protocol's)
 *
 * Path tracing at 1280x720 with 64 samples is asked for, and cancelled after something between 0.1 and 1 s, which
 * is far from its end. A small picture before brings the daemon the programs and the structure.
 * Prints JSON: {"cancels_ns": [..]}: from the call to the confirmed end. */
#include "tests/bench/bench.h"

#include "lib/farlight.h"
#include "protocol/common/clock.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define WAIT_NS 100000000u
#define WAITS 10u

static bool cancel_after(struct fl_scene *scene, enum protocol_tracer tracer, uint64_t wait_ns,
                         uint64_t *cancel_ns, struct fl_error *error)
{
    struct message_render options = fl_render_defaults();
    options.samples = 64;
    options.integrator = PROTOCOL_INTEGRATOR_PATH;
    options.tracer = tracer;
    struct fl_job *job = fl_render_start(scene, &options, error);
    if (!job)
        return false;
    nanosleep(&(struct timespec){(time_t)(wait_ns / 1000000000u), (long)(wait_ns % 1000000000u)}, NULL);
    const uint64_t start_ns = monotonic_now_ns();
    bool cancelled = fl_render_cancel(job, error);
    *cancel_ns = monotonic_now_ns() - start_ns;
    fl_render_destroy(job);
    return cancelled;
}

static bool warm_up(struct fl_scene *scene, enum protocol_tracer tracer, struct fl_error *error)
{
    struct message_render options = fl_render_defaults();
    options.width = 160;
    options.height = 90;
    options.integrator = PROTOCOL_INTEGRATOR_PATH;
    options.tracer = tracer;
    struct fl_job *job = fl_render_start(scene, &options, error);
    struct fl_frame *frame = job ? fl_render_next(job, error) : NULL;
    bool rendered = frame != NULL;
    fl_frame_destroy(frame);
    fl_render_destroy(job);
    return rendered;
}

static bool measure(struct fl_scene *scene, enum protocol_tracer tracer, unsigned cancels, json_t *list,
                    struct fl_error *error)
{
    uint64_t cancel_ns;
    if (!warm_up(scene, tracer, error))
        return false;
    for (unsigned i = 0; i < cancels; i++) {
        if (!cancel_after(scene, tracer, WAIT_NS + i * 7 % WAITS * WAIT_NS, &cancel_ns, error))
            return false;
        json_array_append_new(list, json_integer((json_int_t)cancel_ns));
    }
    return true;
}

BENCH(cancel)
{
    if (argc < 3) {
        fputs("usage: bench cancel ADDRESS MODEL [CANCELS [TRACER]]\n", stderr);
        return 2;
    }
    const unsigned cancels = argc > 3 ? (unsigned)strtoul(argv[3], NULL, 10) : 20;
    const enum protocol_tracer tracer = argc > 4 ? (enum protocol_tracer)strtoul(argv[4], NULL, 10) : 0;
    struct fl_error error = {0};
    json_t *list = json_array();
    struct fl_connection *connection = fl_connect(&(struct fl_connect_options){.server = argv[1]}, &error);
    struct fl_scene *scene =
        connection ? fl_scene_load(connection, &(struct fl_load_options){.model = argv[2]}, &error) : NULL;
    bool ok = scene && measure(scene, tracer, cancels, list, &error);
    if (ok) {
        json_t *all = json_pack("{s:O}", "cancels_ns", list);
        ok = all && json_dumpf(all, stdout, 0) == 0 && putchar('\n') == '\n' && fflush(stdout) == 0;
        json_decref(all);
    } else {
        char line[1200];
        fl_error_print(&error, line, sizeof(line));
        fprintf(stderr, "bench cancel: %s\n", line);
    }
    fl_scene_destroy(scene);
    fl_connection_destroy(connection);
    json_decref(list);
    return ok ? 0 : 1;
}
