/* SPDX-License-Identifier: MIT */
/* The document's session, written out byte by byte. */
#ifndef FARLIGHT_PROTOCOL_DOCS_EXAMPLE_H
#define FARLIGHT_PROTOCOL_DOCS_EXAMPLE_H

/* To standard output, in Markdown. */
void docgen_print_example(void);

#endif
