/* SPDX-License-Identifier: MIT */
/* The options of a job (job_options.c), those of its tracers (job_tracer.c) and of its light (job_light.c). */
#ifndef FARLIGHT_CLIENT_CLI_JOB_OPTIONS_H
#define FARLIGHT_CLIENT_CLI_JOB_OPTIONS_H

#include "cli/cli.h"

enum job_key {
    KEY_SERVER = 's',
    KEY_OUTPUT = 'o',
    KEY_QUIET = 'q',
    KEY_TRACER = 0x100,
    KEY_KEY,
    KEY_BVH_BOUNDS,
    KEY_INTEGRATOR,
    KEY_PRIMARY,
    KEY_TONE_MAP,
    KEY_ENCODING,
    KEY_SIZE,
    KEY_SAMPLES,
    KEY_DEPTH,
    KEY_SEED,
    KEY_EXPOSURE,
    KEY_QUALITY,
    KEY_ENVIRONMENT,
    KEY_CAMERA,
    KEY_EYE,
    KEY_LOOK_AT,
    KEY_UP,
    KEY_FOV,
    KEY_FORMAT,
    KEY_HALF,
    KEY_FLOAT,
    KEY_TIMINGS,
    KEY_TRACE_FILE,
    KEY_APERTURE,
    KEY_FOCUS,
    KEY_SHUTTER,
    KEY_FILTER,
    KEY_BVH_RAYS,
    KEY_CLIP,
    KEY_CLIP_ONCE,
    KEY_CLIP_START,
    KEY_CLIP_SPEED,
    KEY_LDC_RESOLUTION,
    KEY_LDC_BLOCK,
    KEY_LDC_BUILD,
    KEY_LDC_LEVELS,
    KEY_LDC_IMAGES,
    KEY_LDC_TOLERANCE,
    KEY_LDC_RAYS,
    KEY_ABUFFER_RESOLUTION,
    KEY_VOXELS,
    KEY_SEARCH,
    KEY_BOUNCES,
    KEY_AO_DISTANCE,
    KEY_AO_FALLOFF,
    KEY_AO_RAYS,
    KEY_BRDF,
    KEY_LAYER_OPACITY,
    KEY_LAYERS
};

/* Of one option, typed as `value`; `field` is its name for people. ARGP_ERR_UNKNOWN: it is no tracer's. */
error_t job_set_tracer(struct cli_job *job, int key, const char *field, const char *value);
/* Likewise of integrators and of what a frame brings. */
error_t job_set_light(struct cli_job *job, int key, const char *field, const char *value);

/* "unknown bvh bounds 'cube'", and which are known. */
error_t job_unknown_value(struct cli_job *job, const char *field, const char *enum_name, const char *value);
error_t job_set_integer(struct cli_job *job, const char *field, const char *value, uint64_t least,
                        uint64_t greatest, uint64_t *number);
error_t job_set_real(struct cli_job *job, const char *field, const char *value, double least, double greatest,
                     double *number);

#endif
