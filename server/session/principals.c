/* SPDX-License-Identifier: MIT */
#include "session/principals.h"

/* Bit of unidentified clients, above the numbers of auth_owner_number(). */
#define SESSION_BIT (UINT64_C(1) << 32)

blob_principal principal_number(const struct auth_identity *identity, uint64_t session)
{
    return identity->has_key || identity->has_user ? auth_owner_number(identity, NULL) : SESSION_BIT + session;
}

blob_principal principal_for_next_process(blob_principal principal)
{
    return principal & AUTH_OWNER_KEY || principal < SESSION_BIT ? principal : PRINCIPAL_NOBODY;
}
