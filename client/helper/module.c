/* SPDX-License-Identifier: MIT */
#include "module.h"

#include <dlfcn.h>
#include <stdio.h>

void *module_load(const char *file, const char *symbol, char *reason, size_t reason_bytes)
{
    /* Lazily: most of the libraries' functions are never called. */
    void *module = dlopen(file, RTLD_LAZY | RTLD_LOCAL);
    void *found = module ? dlsym(module, symbol) : NULL;
    if (!found)
        snprintf(reason, reason_bytes, "%s", dlerror());
    return found;
}
