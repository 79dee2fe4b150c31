/* SPDX-License-Identifier: MIT */
/* The page's files, embedded in the program. */
#ifndef FARLIGHT_CLIENT_WEB_PAGE_H
#define FARLIGHT_CLIENT_WEB_PAGE_H

#include <stddef.h>

struct page_file {
    const char *name; /* path below the link; "" is the page itself */
    const char *type;
    const unsigned char *bytes, *end;
};

/* Finds a file; NULL: there is none. */
const struct page_file *page_find(const char *name);
/* Pages for requests without the right link, and for another Host than this machine's. */
extern const struct page_file page_denied, page_misdirected;

#endif
