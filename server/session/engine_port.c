/* SPDX-License-Identifier: MIT */
#include "session/engine_port.h"

static const struct gpu_device_info *device(void *context)
{
    return engine_device(context);
}

static bool submit(void *context, struct engine_command *command, struct error *error)
{
    return engine_submit(context, command, error);
}

static int event_fd(void *context)
{
    return engine_event_fd(context);
}

static struct engine_event *next_event(void *context)
{
    return engine_next_event(context);
}

static void report_sent(void *context, uint64_t queue_ns, uint64_t send_ns)
{
    engine_report_sent(context, queue_ns, send_ns);
}

static bool is_alive(void *context, uint64_t *turns)
{
    return engine_is_alive(context, turns);
}

struct engine_port engine_port(struct engine *engine)
{
    return (struct engine_port){
        .context = engine,
        .device = device,
        .submit = submit,
        .event_fd = event_fd,
        .next_event = next_event,
        .report_sent = report_sent,
        .is_alive = is_alive,
    };
}
