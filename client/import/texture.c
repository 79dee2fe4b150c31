/* SPDX-License-Identifier: MIT */
#include "texture.h"
#include "helper/module.h"
#include "texture_plain.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#pragma weak texture_reader
/* NULL, unless the module is linked to the program itself. */
static const struct texture_reader *reader = &texture_reader;
static char why_none[200] =
    "is neither PNG nor JPEG, and nothing in the model says so, by an ending, a MIME type or its first bytes";

void texture_load(void)
{
    char reason[160];

    if (reader)
        return;
    reader = module_load("farlight-textures.so", "texture_reader", reason, sizeof(reason));
    if (!reader)
        snprintf(why_none, sizeof(why_none), "cannot be decoded: %s", reason);
}

void texture_decode(struct texture_job *jobs, size_t count)
{
    texture_plain_decode(jobs, count);
    if (reader)
        reader->decode(jobs, count);
    else
        for (size_t i = 0; i < count; i++)
            if (jobs[i].bytes && !texture_is_plain(&jobs[i]))
                snprintf(jobs[i].reason, sizeof(jobs[i].reason), "%s", why_none);
}

void texture_decode_environment(struct texture_job *job)
{
    if (reader)
        reader->decode_environment(job);
    else
        snprintf(job->reason, sizeof(job->reason), "%s", why_none);
}

unsigned char *texture_marker(void)
{
    static const unsigned char texels[16] = {255, 0, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 0, 255, 255};
    unsigned char *copy = malloc(sizeof(texels));

    if (copy)
        memcpy(copy, texels, sizeof(texels));
    return copy;
}
