/* SPDX-License-Identifier: MIT */
#include "cli/job_options.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define RESOLUTION_LEAST 16u

static error_t set_name(struct cli_job *job, int key, const char *field, const char *value)
{
    struct fl_job_options *wanted = &job->options;
    switch (key) {
    case KEY_TRACER:
        return protocol_tracer_parse(value, &wanted->tracer) ? 0 : job_unknown_value(job, field, "tracer", value);
    case KEY_BVH_BOUNDS:
        return protocol_bvh_bounds_parse(value, &wanted->bvh_bounds)
                   ? 0
                   : job_unknown_value(job, field, "bvh_bounds", value);
    case KEY_LDC_BUILD:
        return protocol_ldc_build_parse(value, &wanted->ldc_build)
                   ? 0
                   : job_unknown_value(job, field, "ldc_build", value);
    case KEY_LDC_LEVELS:
        return protocol_ldc_levels_parse(value, &wanted->ldc_levels)
                   ? 0
                   : job_unknown_value(job, field, "ldc_levels", value);
    case KEY_LDC_IMAGES:
        return protocol_ldc_images_parse(value, &wanted->ldc_images)
                   ? 0
                   : job_unknown_value(job, field, "ldc_images", value);
    case KEY_SEARCH:
        return protocol_abuffer_search_parse(value, &wanted->abuffer_search)
                   ? 0
                   : job_unknown_value(job, field, "abuffer_search", value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* 0: it is left to the daemon, which takes `usual`. */
static error_t set_resolution(struct cli_job *job, const char *field, const char *value, uint32_t usual,
                              uint32_t *resolution)
{
    uint64_t cells = 0;
    const error_t status = job_set_integer(job, field, value, 0, 4096, &cells);
    if (status == 0 && cells > 0 && cells < RESOLUTION_LEAST) {
        cli_usage(job, field, "%s are too few", value);
        fl_error_remedy(&job->error, "%u to 4096, or 0 for %u", RESOLUTION_LEAST, usual);
        return EINVAL;
    }
    *resolution = (uint32_t)cells;
    return status;
}

static error_t set_voxels(struct cli_job *job, const char *field, const char *value)
{
    uint64_t voxels = 0;
    const bool chosen = strcmp(value, "auto") == 0;
    if (!chosen && fl_text_integer(value, 0, UINT64_MAX, &voxels, &job->error) &&
        (voxels < 16 || voxels > 256 || (voxels & (voxels - 1)) != 0) && voxels != 0)
        cli_usage(job, field, "a grid has no side of %s voxels", value);
    if (job->error.code != FL_ERROR_NONE) {
        snprintf(job->error.field, sizeof job->error.field, "%s", field);
        fl_error_remedy(&job->error, "known: auto, 16, 32, 64, 128, 256");
        return EINVAL;
    }
    job->options.abuffer_voxels = (unsigned)voxels;
    return 0;
}

static error_t set_block(struct cli_job *job, const char *field, const char *value)
{
    uint64_t texels = 0;
    const error_t status = job_set_integer(job, field, value, 0, 32, &texels);
    if (status == 0 && (texels == 1 || (texels & (texels - 1)) != 0)) {
        cli_usage(job, field, "a block has no side of %s texels", value);
        fl_error_remedy(&job->error, "known: 2, 4, 8, 16, 32, or 0 for 8");
        return EINVAL;
    }
    job->options.ldc_block = (unsigned)texels;
    return status;
}

static error_t set_bvh_rays(struct cli_job *job, const char *field, const char *value)
{
    uint64_t rays = 0;
    const error_t status = job_set_integer(job, field, value, 0, 8, &rays);
    if (status == 0 && rays > 4 && rays < 8)
        return cli_usage(job, field, "%s rays cannot walk together (known: 0, 1, 2, 3, 4, 8)", value);
    job->options.bvh_rays_together = (unsigned)rays;
    return status;
}

static error_t set_ldc_rays(struct cli_job *job, const char *field, const char *value)
{
    uint64_t rays = 0;
    const error_t status = job_set_integer(job, field, value, 0, 4, &rays);
    if (status == 0 && rays > 1 && rays < 4)
        return cli_usage(job, field, "%s rays cannot walk together (known: 0, 1, 4)", value);
    job->options.ldc_rays_together = (unsigned)rays;
    return status;
}

error_t job_set_tracer(struct cli_job *job, int key, const char *field, const char *value)
{
    double real = 0;
    error_t status = 0;
    switch (key) {
    case KEY_BVH_RAYS:
        return set_bvh_rays(job, field, value);
    case KEY_LDC_RESOLUTION:
        return set_resolution(job, field, value, 1024, &job->options.ldc_resolution);
    case KEY_ABUFFER_RESOLUTION:
        return set_resolution(job, field, value, 1280, &job->options.abuffer_resolution);
    case KEY_VOXELS:
        return set_voxels(job, field, value);
    case KEY_LDC_BLOCK:
        return set_block(job, field, value);
    case KEY_LDC_RAYS:
        return set_ldc_rays(job, field, value);
    case KEY_LDC_TOLERANCE:
        status = job_set_real(job, field, value, 0, 1e6, &real);
        job->options.ldc_tolerance = (float)real;
        return status;
    default:
        return set_name(job, key, field, value);
    }
}
