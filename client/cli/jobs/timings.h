/* SPDX-License-Identifier: MIT */
/* Times of a command, as a table or JSON. */
#ifndef FARLIGHT_CLI_JOBS_TIMINGS_H
#define FARLIGHT_CLI_JOBS_TIMINGS_H

#include "options/job.h"

struct cli_client_times {
    uint64_t total_ns, start_ns, export_ns;
    const struct fl_import_stats *import;
};
struct cli_timings;

struct cli_timings *cli_timings_create(enum cli_timings_form form, bool to_stderr);
void cli_timings_frame(struct cli_timings *timings, const struct fl_frame *frame);
void cli_timings_end(struct cli_timings *timings, const struct cli_client_times *times);
void cli_timings_destroy(struct cli_timings *timings);

#endif
