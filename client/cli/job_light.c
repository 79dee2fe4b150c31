/* SPDX-License-Identifier: MIT */
/* Options of a job that say how light goes and what of it a frame brings. */
#include "cli/job_options.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of an option's name: where it was given. What is typed on the command line overrules a script, and that the
 * environment; in one place the two names of one thing must agree. */
static bool is_same_place(const char *field, const char *other)
{
    static const char environment[] = "FARLIGHT_";
    const size_t length = sizeof environment - 1;
    const bool typed = field[0] == '-', from_environment = strncmp(field, environment, length) == 0;
    return typed == (other[0] == '-') && from_environment == (strncmp(other, environment, length) == 0);
}

/* --depth and --bounces. */
static error_t set_depth(struct cli_job *job, const char *field, const char *value)
{
    uint64_t number = 0;
    const error_t status = job_set_integer(job, field, value, 0, 32, &number);
    const int depth = number == 0 ? FL_DEPTH_NONE : (int)number;
    if (status != 0)
        return status;
    if (job->depth_field[0] != '\0' && strcmp(job->depth_field, field) != 0 && depth != job->options.depth &&
        is_same_place(job->depth_field, field)) {
        cli_usage(job, field, "%s contradicts %s %d, which is the same", value, job->depth_field,
                  job->options.depth == FL_DEPTH_NONE ? 0 : job->options.depth);
        fl_error_remedy(&job->error, "leave out one of them");
        return EINVAL;
    }
    job->options.depth = depth;
    snprintf(job->depth_field, sizeof job->depth_field, "%s", field);
    return 0;
}

/* 0 would be the daemon's default. */
static error_t set_opacity(struct cli_job *job, const char *field, const char *value)
{
    double share = 0;
    const error_t status = job_set_real(job, field, value, 0, 1, &share);
    if (status == 0 && !((float)share > 0)) {
        cli_usage(job, field, "nothing would be seen of surfaces that hide nothing");
        fl_error_remedy(&job->error, "give a number above 0, up to 1");
        return EINVAL;
    }
    job->options.layer_opacity = (float)share;
    return status;
}

/* "beauty,depth". The picture alone is 0, as without the option. */
static error_t set_layers(struct cli_job *job, const char *field, const char *value)
{
    unsigned layers = 0;
    const char *at = value;
    for (;;) {
        char name[24];
        enum protocol_layer layer = PROTOCOL_LAYER_BEAUTY;
        const size_t length = strcspn(at, ",");
        snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name), at);
        if (!protocol_layer_parse(name, &layer))
            return job_unknown_value(job, field, "layer", name);
        layers |= 1u << layer;
        if (at[length] == '\0')
            break;
        at += length + 1;
    }
    job->options.layers = layers == 1u << PROTOCOL_LAYER_BEAUTY ? 0 : layers;
    return 0;
}

error_t job_set_light(struct cli_job *job, int key, const char *field, const char *value)
{
    struct fl_job_options *wanted = &job->options;
    uint64_t number = 0;
    double real = 0;
    error_t status = 0;
    switch (key) {
    case KEY_INTEGRATOR:
        job->has_integrator = true;
        return protocol_integrator_parse(value, &wanted->integrator)
                   ? 0
                   : job_unknown_value(job, field, "integrator", value);
    case KEY_DEPTH:
    case KEY_BOUNCES:
        return set_depth(job, field, value);
    case KEY_BRDF:
        return protocol_brdf_parse(value, &wanted->brdf) ? 0 : job_unknown_value(job, field, "brdf", value);
    case KEY_AO_DISTANCE:
        status = job_set_real(job, field, value, 0, 1e12, &real);
        wanted->ao_distance = (float)real;
        return status;
    case KEY_AO_FALLOFF:
        status = job_set_real(job, field, value, 0, 64, &real);
        wanted->ao_falloff = (float)real;
        return status;
    case KEY_AO_RAYS:
        status = job_set_integer(job, field, value, 1, 256, &number);
        wanted->ao_rays = (unsigned)number;
        return status;
    case KEY_LAYER_OPACITY:
        return set_opacity(job, field, value);
    case KEY_LAYERS:
        return set_layers(job, field, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}
