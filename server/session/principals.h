/* SPDX-License-Identifier: MIT */
/* Principals, the owners of blobs and kept scenes. */
#ifndef FARLIGHT_SESSION_PRINCIPALS_H
#define FARLIGHT_SESSION_PRINCIPALS_H

#include "net/auth.h"
#include "session/blob_store.h"

/* Principal of a client, common to the clients of a user or key; an unidentified client shares its principal with
 * no other. */
blob_principal principal_number(const struct auth_identity *identity, uint64_t session);
/* Principal in the next process, which counts sessions from 1 again, so that those of sessions become nobody's. */
#define PRINCIPAL_NOBODY (UINT64_C(1) << 32)
blob_principal principal_for_next_process(blob_principal principal);

#endif
