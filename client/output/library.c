/* SPDX-License-Identifier: MIT */
/* Loading of the module of library.h. */
#include "library.h"
#include "helper/module.h"

#include <stdio.h>

#define MODULE "farlight-images.so"

static const struct image_library *library;
static char why_none[256] = "cannot be done: this program was started for other formats";

char *library_folder(void)
{
    return module_folder(MODULE);
}

void library_load(bool draws_text)
{
    const struct image_library *found = module_load(MODULE, "image_library", why_none, sizeof(why_none));
    if (found && found->prepare(draws_text, why_none, sizeof(why_none)))
        library = found;
}

const struct image_library *library_loaded(char *reason, size_t reason_bytes)
{
    if (!library)
        snprintf(reason, reason_bytes, "%s", why_none);
    return library;
}
