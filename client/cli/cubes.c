/* SPDX-License-Identifier: MIT */
/* What the tracers ldc and abuffer made of a scene: how finely it is sampled, and whether all of it is there. */
#include "cli/cli.h"

#include <inttypes.h>
#include <stdio.h>

#define LAYERS_MAX 255u /* that can be kept, whatever the limits */

/* A length, with a unit that suits it. */
static void print_length(FILE *out, double metres)
{
    if (metres >= 1000)
        fprintf(out, "%.4g km", metres * 1e-3);
    else if (metres >= 0.1)
        fprintf(out, "%.4g m", metres);
    else
        fprintf(out, "%.4g mm", metres * 1e3);
}

static void print_lists(FILE *out, const struct record_layered_cube *lists)
{
    fprintf(out, "%u texels of ", lists->resolution);
    print_length(out, (double)lists->cell_metres);
    fprintf(out, "; %" PRIu64 " samples, at most %u in a list", lists->samples, lists->layers_kept);
}

const char *cli_cube_title(enum protocol_tracer tracer)
{
    return tracer == PROTOCOL_TRACER_ABUFFER ? "lists" : "cubes";
}

const char *cli_cube_name(enum protocol_tracer tracer, enum protocol_cube_part part)
{
    return tracer == PROTOCOL_TRACER_ABUFFER ? "" : protocol_cube_part_text(part);
}

void cli_cube_print(FILE *out, enum protocol_tracer tracer, const struct record_layered_cube *cube)
{
    if (tracer == PROTOCOL_TRACER_ABUFFER) {
        print_lists(out, cube);
        return;
    }
    fprintf(out, "%u cells of ", cube->resolution);
    print_length(out, (double)cube->cell_metres);
    fprintf(out, "; %u", cube->layers_kept);
    if (cube->layers_kept < cube->layers_needed)
        fprintf(out, " of %u", cube->layers_needed);
    fprintf(out, " layer%s, %" PRIu64 " samples", cube->layers_needed == 1 ? "" : "s", cube->samples);
    if (cube->samples_lost > 0)
        fprintf(out, ", %" PRIu64 " more are missing", cube->samples_lost);
}

void cli_cubes_warn(const struct fl_frame *frame, bool warned[PROTOCOL_CUBE_PART_COUNT],
                    struct cli_progress *progress)
{
    for (size_t i = 0; i < frame->cube_count; i++) {
        const struct record_layered_cube *cube = &frame->cubes[i];
        if (cube->layers_kept >= cube->layers_needed || warned[cube->part])
            continue;
        warned[cube->part] = true;
        cli_progress_clear(progress);
        fprintf(stderr,
                "farlight: warning: frame %u: the %s cube has %u of %u layers: %" PRIu64
                " samples of what lies farther are missing",
                frame->frame, protocol_cube_part_text(cube->part), cube->layers_kept, cube->layers_needed,
                cube->samples_lost);
        fputs(cube->layers_kept >= LAYERS_MAX
                  ? " (no more can be kept: choose another tracer)\n"
                  : " (raise limits.ldc_layers or memory.ldc in the daemon's configuration, or choose a lower "
                    "--ldc-resolution)\n",
              stderr);
    }
}

json_t *cli_cubes_json(const struct fl_frame *frame)
{
    json_t *array = json_array();
    for (size_t i = 0; i < frame->cube_count; i++) {
        const struct record_layered_cube *cube = &frame->cubes[i];
        json_array_append_new(
            array, json_pack("{s:s,s:I,s:f,s:I,s:I,s:I,s:I,s:b}", "part", protocol_cube_part_text(cube->part),
                             "resolution", (json_int_t)cube->resolution, "cell_metres", (double)cube->cell_metres,
                             "layers_needed", (json_int_t)cube->layers_needed, "layers_kept",
                             (json_int_t)cube->layers_kept, "samples", (json_int_t)cube->samples, "samples_lost",
                             (json_int_t)cube->samples_lost, "rebuilt", cube->rebuilt != 0));
    }
    return array;
}
