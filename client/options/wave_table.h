/* SPDX-License-Identifier: MIT */
/* Results of comparing the waves of a frame. */
#ifndef FARLIGHT_OPTIONS_WAVE_TABLE_H
#define FARLIGHT_OPTIONS_WAVE_TABLE_H

#include "lib/farlight.h"

#include <jansson.h>

/* Prints tables with a legend of their columns. */
void cli_print_waves(const struct fl_frame *frame, enum protocol_tracer reference, double far_share);
json_t *cli_waves_json(const struct fl_frame *frame);      /* an object for each wave and kind of ray */
json_t *cli_wave_total_json(const struct fl_frame *frame); /* totals over all waves */
double cli_wave_agreement(const struct fl_frame *frame);   /* see fl_wave_agreement */

#endif
