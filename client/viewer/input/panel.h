/* SPDX-License-Identifier: MIT */
/* The settings of a tracer as the window lists and changes them: rows of protocol/tracers.def. Knows no window and
 * no daemon. */
#ifndef FARLIGHT_VIEWER_INPUT_PANEL_H
#define FARLIGHT_VIEWER_INPUT_PANEL_H

#include "lib/farlight.h"
#include "protocol/describe.h"

/* The settings of a tracer, in the order of the table; NULL: it has no more. */
const struct field_desc *panel_setting(enum protocol_tracer tracer, size_t index);
size_t panel_setting_count(enum protocol_tracer tracer);

/* "1024", "overlap", "0.01" */
void panel_value(const struct field_desc *setting, const struct tracer_settings *settings, char *text,
                 size_t text_bytes);
/* Goes to the next value (`step` 1) or the one before (-1): of choices and sets around, of ranges by a factor of
 * two up to their ends. False: there is no other. */
bool panel_change(const struct field_desc *setting, struct tracer_settings *settings, int step);

#endif
