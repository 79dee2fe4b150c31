/* SPDX-License-Identifier: MIT */
/* Memory for keys. */
#include "protocol/sealed/secret.h"

#include "protocol/sanitized.h"

#include <sodium.h>
#include <string.h>
#include <sys/prctl.h>

/* sodium_malloc() aligns the end of the block with the end of a page. */
#define ALIGNMENT 16u

static size_t rounded(size_t bytes)
{
    return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

void *secret_create(size_t bytes)
{
    if (sodium_init() < 0) {
        return NULL;
    }
    void *secret = sodium_malloc(rounded(bytes));
    if (secret) {
        memset(secret, 0, rounded(bytes));
        if (!SANITIZED) {
            prctl(PR_SET_DUMPABLE, 0, 0, 0, 0); /* this call cannot fail */
        }
    }
    return secret;
}

void secret_destroy(void *secret)
{
    sodium_free(secret);
}

bool secret_is_locked(void *secret, size_t bytes)
{
    return sodium_mlock(secret, rounded(bytes)) == 0;
}
