/* SPDX-License-Identifier: MIT */
/* Principals: to whom blobs and kept scenes belong. */
#ifndef FARLIGHT_SESSION_PRINCIPALS_H
#define FARLIGHT_SESSION_PRINCIPALS_H

#include "net/auth.h"
#include "session/blob_store.h"

/* The principal of a client, the same of all clients of a user or key; a client that nobody knows shares with no
 * other. */
blob_principal principal_number(const struct auth_identity *identity, uint64_t session);
/* As the next process knows it: sessions are counted from 1 there, too, so theirs become nobody's. */
#define PRINCIPAL_NOBODY (UINT64_C(1) << 32)
blob_principal principal_for_next_process(blob_principal principal);

#endif
