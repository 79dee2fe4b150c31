/* SPDX-License-Identifier: MIT */
/* The options of the tracers, as a client sends them. */
#ifndef FARLIGHT_SESSION_TRACER_SETTINGS_H
#define FARLIGHT_SESSION_TRACER_SETTINGS_H

#include "base/error.h"
#include "protocol/messages.h"
#include "render/frame.h"
#include "session/limits.h"

#include <stdbool.h>

/* False: one has a value that it cannot have, though the message allows it. */
bool tracer_settings_check(const struct message_render *render, struct error *error);
struct tracer_options tracer_settings(const struct session_limits *limits, const struct message_render *render);

#endif
