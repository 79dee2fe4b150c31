/* SPDX-License-Identifier: MIT */
/* Loading of modules with large libraries. */
#include "module.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Finds the module beside the program or where it is installed. A run path would do so too, except under the
 * address sanitizer, whose dlopen replaces the C library's. */
static bool find(const char *file, char path[PATH_MAX], char *reason, size_t reason_bytes)
{
    static const char *const folders[] = {"", "../lib/farlight/"};
    char self[PATH_MAX];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);
    self[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(self, '/');
    if (slash)
        slash[1] = '\0';
    for (size_t i = 0; slash && i < sizeof(folders) / sizeof(folders[0]); i++) {
        const int written = snprintf(path, PATH_MAX, "%s%s%s", self, folders[i], file);
        if (written < PATH_MAX && access(path, R_OK) == 0)
            return true;
    }
    snprintf(reason, reason_bytes, "%s is neither beside this program nor in ../lib/farlight", file);
    return false;
}

void *module_load(const char *file, const char *symbol, char *reason, size_t reason_bytes)
{
    char path[PATH_MAX];
    if (!find(file, path, reason, reason_bytes))
        return NULL;
    /* Lazy binding: most functions of the libraries are never called. */
    void *module = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
    void *found = module ? dlsym(module, symbol) : NULL;
    if (!found)
        snprintf(reason, reason_bytes, "%s", dlerror());
    return found;
}

char *module_folder(const char *file)
{
    char path[PATH_MAX], reason[1];
    if (!find(file, path, reason, sizeof(reason)))
        return NULL;
    *strrchr(path, '/') = '\0';
    return strdup(path);
}
