/* SPDX-License-Identifier: MIT */
/* Links with tokens. */
#include "web/links.h"

#include <sodium.h>
#include <string.h>

#define TOKEN_BYTES 32

bool web_links_make(struct web_links *links, bool allow_edit)
{
    unsigned char bytes[TOKEN_BYTES];
    if (sodium_init() < 0)
        return false;
    for (int right = 0; right < WEB_RIGHT_COUNT; right++) {
        randombytes_buf(bytes, sizeof(bytes));
        sodium_bin2base64(links->tokens[right], sizeof(links->tokens[right]), bytes, sizeof(bytes),
                          sodium_base64_VARIANT_URLSAFE_NO_PADDING);
    }
    sodium_memzero(bytes, sizeof(bytes));
    links->allow_edit = allow_edit;
    return true;
}

const char *web_links_find(const struct web_links *links, const char *path, enum web_right *right)
{
    if (strlen(path) < WEB_TOKEN_LENGTH + 2 || path[0] != '/' || path[WEB_TOKEN_LENGTH + 1] != '/')
        return NULL;
    const bool reads = sodium_memcmp(path + 1, links->tokens[WEB_READS], WEB_TOKEN_LENGTH) == 0;
    const bool edits = sodium_memcmp(path + 1, links->tokens[WEB_EDITS], WEB_TOKEN_LENGTH) == 0;
    *right = edits && links->allow_edit ? WEB_EDITS : WEB_READS;
    return reads || *right == WEB_EDITS ? path + WEB_TOKEN_LENGTH + 2 : NULL;
}

void web_links_forget(struct web_links *links)
{
    sodium_memzero(links, sizeof(*links));
}
