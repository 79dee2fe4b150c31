/* SPDX-License-Identifier: MIT */
/* Confines this process before it reads what clients send: which files it can open (Landlock), and which system
 * calls it can make (seccomp: no network, no other programs, nothing of other processes). Cannot be undone. */
#ifndef FARLIGHT_BASE_CONFINEMENT_H
#define FARLIGHT_BASE_CONFINEMENT_H

#include "base/error.h"

#include <stdbool.h>

enum confined_access {
    CONFINED_READ,   /* files are read and mapped as code */
    CONFINED_DEVICE, /* files are read, written and asked by ioctl() */
    CONFINED_WRITE,  /* files are made, read, written and removed, also in folders that are made */
};

struct confinement; /* the rules, before they are in force */

/* NULL: out of memory. */
struct confinement *confinement_create(void);
/* Allows access to a file, or to a folder and all below it. A path that does not exist allows nothing. */
void confinement_allow(struct confinement *confinement, enum confined_access access, const char *path);
/* Puts the rules in force for this thread, the only one there may be, and those that it starts. True with
 * *has_files false: the kernel has no Landlock, so files are not confined. False and *error: the rules were
 * refused, or there are other threads. */
bool confinement_enter(const struct confinement *confinement, bool *has_files, struct error *error);
void confinement_destroy(struct confinement *confinement); /* accepts NULL */

#endif
