/* SPDX-License-Identifier: MIT */
/* Loading of the module that makes palettes. */
#include "palette.h"
#include "helper/module.h"

#include <stdio.h>

#define MODULE "farlight-palette.so"

static const struct palette_maker *maker;
static char why_none[256] = "cannot be done: this program was started without --gif";

char *palette_folder(void)
{
    return module_folder(MODULE);
}

void palette_load(void)
{
    maker = module_load(MODULE, "palette_maker", why_none, sizeof(why_none));
}

const struct palette_maker *palette_loaded(char *reason, size_t reason_bytes)
{
    if (!maker)
        snprintf(reason, reason_bytes, "%s", why_none);
    return maker;
}
