/* SPDX-License-Identifier: MIT */
/* The session in the document, written out byte by byte. */
#ifndef FARLIGHT_PROTOCOL_DOCS_EXAMPLE_H
#define FARLIGHT_PROTOCOL_DOCS_EXAMPLE_H

/* Prints it to standard output, in Markdown. */
void docgen_print_example(void);

#endif
