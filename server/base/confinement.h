/* SPDX-License-Identifier: MIT */
/* Confinement of this process before it reads data from clients: the files that it can open (Landlock), and the
 * system calls that it can make (seccomp: no network, no other programs, no access to other processes). Cannot be
 * undone. */
#ifndef FARLIGHT_BASE_CONFINEMENT_H
#define FARLIGHT_BASE_CONFINEMENT_H

#include "base/error.h"

#include <stdbool.h>

enum confined_access {
    CONFINED_READ,   /* files are read and mapped as code */
    CONFINED_DEVICE, /* files are read, written and asked by ioctl() */
    CONFINED_WRITE,  /* files are made, read, written and removed, also in new folders */
};

struct confinement; /* rules that are not yet in force */

/* Creates an empty set of rules. NULL: out of memory. */
struct confinement *confinement_create(void);
/* Allows access to a file, or to a folder with everything below it. A path that does not exist allows nothing. */
void confinement_allow(struct confinement *confinement, enum confined_access access, const char *path);
/* Enforces the rules for this thread, which must be the only one, and those that it starts. True with
 * *has_files false: the kernel has no Landlock, so files are not confined. False and *error: the rules were
 * refused, or there are other threads. */
bool confinement_enter(const struct confinement *confinement, bool *has_files, struct error *error);
void confinement_destroy(struct confinement *confinement); /* accepts NULL */

#endif
