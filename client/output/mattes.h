/* SPDX-License-Identifier: MIT */
/* Names of a picture's objects and materials, as Cryptomatte writes them. C++ behind C. */
#ifndef FARLIGHT_CLIENT_OUTPUT_MATTES_H
#define FARLIGHT_CLIENT_OUTPUT_MATTES_H

#include "protocol/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

struct mattes;

/* Adds or replaces a name; *mattes may be NULL before, and is for mattes_destroy. False: the sender breaks the
 * protocol: there are too many, or no memory. */
bool mattes_name(struct mattes **mattes, const struct message_export_name *name);
void mattes_destroy(struct mattes *mattes); /* accepts NULL */

#ifdef __cplusplus
}
#endif

#endif
