/* SPDX-License-Identifier: MIT */
/* The page's files, which are part of the program. */
#ifndef FARLIGHT_CLIENT_WEB_PAGE_H
#define FARLIGHT_CLIENT_WEB_PAGE_H

#include <stddef.h>

struct page_file {
    const char *name; /* below the link; "" is the page itself */
    const char *type;
    const unsigned char *bytes, *end;
};

/* NULL: there is none. */
const struct page_file *page_find(const char *name);
/* What is seen without the right link, and by another name than this machine's. */
extern const struct page_file page_denied, page_misdirected;

#endif
