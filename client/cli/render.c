/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"

#include <stdlib.h>

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct cli_job *job = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case ARGP_KEY_ARG:
        if (job->model != NULL)
            return cli_usage(job, value, "only one model can be rendered");
        job->model = value;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

int cli_render(int argc, char **argv)
{
    static const struct argp_child children[] = {{&cli_job_argp, 0, NULL, 0}, {0}};
    static const struct argp argp = {.parser = parse,
                                     .args_doc = "MODEL -o IMAGE",
                                     .doc = "Render one picture of a model.\v"
                                            "MODEL is glTF, GLB, OBJ or NFF. FARLIGHT_SERVER, FARLIGHT_SIZE, "
                                            "FARLIGHT_SAMPLES and so on give defaults.",
                                     .children = children};
    struct cli_job job;
    if (!cli_job_begin(&job) || argp_parse(&argp, argc, argv, 0, NULL, &job) != 0 ||
        !cli_job_complete(&job, false))
        return cli_report(&job.error);
    return cli_run_job(&job, false);
}
