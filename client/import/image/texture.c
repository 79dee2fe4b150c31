/* SPDX-License-Identifier: MIT */
/* Decoding of images, with the module if necessary. */
#include "texture.h"
#include "helper/module.h"
#include "plain.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#pragma weak texture_reader
/* NULL, unless the module is linked into the program itself. */
static const struct texture_reader *reader = &texture_reader;

/* Loads the module; false: the job has the reason. */
static bool load_for(struct texture_job *job)
{
    char reason[160];

    if (!reader)
        reader = module_load(TEXTURE_MODULE, "texture_reader", reason, sizeof(reason));
    if (!reader)
        snprintf(job->reason, sizeof(job->reason), "cannot be decoded: %s", reason);
    return reader;
}

static bool is_left(const struct texture_job *job)
{
    return job->bytes && !job->texels && job->reason[0] == '\0';
}

void texture_decode(struct texture_job *jobs, size_t count)
{
    size_t left = 0;

    texture_plain_decode(jobs, count);
    for (size_t i = 0; i < count; i++)
        left += is_left(&jobs[i]) && load_for(&jobs[i]);
    if (left > 0)
        reader->decode(jobs, count);
}

void texture_decode_environment(struct texture_job *job)
{
    if (!texture_plain_decode_environment(job) && load_for(job))
        reader->decode_environment(job);
}

void texture_explain_reduction(const struct texture_job *job, char text[200])
{
    snprintf(text, 200, "is larger than can be shown: it is reduced to a %s, %u x %u texels",
             job->reduced == 2   ? "half"
             : job->reduced == 4 ? "quarter"
                                 : "part",
             job->width, job->height);
}

unsigned char *texture_marker(void)
{
    static const unsigned char texels[16] = {255, 0, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 255, 255};
    unsigned char *copy = malloc(sizeof(texels));

    if (copy)
        memcpy(copy, texels, sizeof(texels));
    return copy;
}
