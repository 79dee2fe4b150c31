/* SPDX-License-Identifier: MIT */
/* The part of a helper program that needs hundreds of libraries: a shared object, loaded only by the runs that use
 * it. */
#ifndef FARLIGHT_CLIENT_HELPER_MODULE_H
#define FARLIGHT_CLIENT_HELPER_MODULE_H

#include <stddef.h>

/* Loads the module `file`, which is beside the program or in ../lib/farlight, and returns the address of `symbol`
 * in it; it stays loaded. Within a sandbox that folder must be readable. NULL: `reason` says why. */
void *module_load(const char *file, const char *symbol, char *reason, size_t reason_bytes);
/* The folder in which it lies; the caller frees it. NULL: it does not exist, or there is no memory. */
char *module_folder(const char *file);

#endif
