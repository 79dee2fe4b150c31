/* SPDX-License-Identifier: MIT */
/* The links that open the page: a token for each right. */
#ifndef FARLIGHT_CLIENT_WEB_LINKS_H
#define FARLIGHT_CLIENT_WEB_LINKS_H

#include <stdbool.h>

enum web_right { WEB_READS, WEB_EDITS, WEB_RIGHT_COUNT };

#define WEB_TOKEN_LENGTH 43 /* 32 random bytes in base 64 without padding */

struct web_links {
    char tokens[WEB_RIGHT_COUNT][WEB_TOKEN_LENGTH + 1];
    bool allow_edit; /* false: no token grants WEB_EDITS */
};

/* Makes the tokens. False: there are no random numbers. */
bool web_links_make(struct web_links *links, bool allow_edit);
/* Finds the rest of the path "/TOKEN/..", and the token's right; NULL: not one of ours. Takes the same time for
 * all tokens. */
const char *web_links_find(const struct web_links *links, const char *path, enum web_right *right);
void web_links_forget(struct web_links *links);

#endif
