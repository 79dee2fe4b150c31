/* SPDX-License-Identifier: MIT */
/* The engine as sessions see it: a table of functions, so that tests can stand in for it. */
#ifndef FARLIGHT_SESSION_ENGINE_PORT_H
#define FARLIGHT_SESSION_ENGINE_PORT_H

#include "engine/engine.h"

struct engine_port {
    void *context;
    const struct gpu_device_info *(*device)(void *context);
    bool (*submit)(void *context, struct engine_command *command, struct error *error);
    int (*event_fd)(void *context);
    struct engine_event *(*next_event)(void *context);
    void (*report_sent)(void *context, uint64_t queue_ns, uint64_t send_ns);
    bool (*is_alive)(void *context, uint64_t *turns);
};

struct engine_port engine_port(struct engine *engine);

#endif
