/* SPDX-License-Identifier: MIT */
/* Signals that end a command in order. */
#ifndef FARLIGHT_OPTIONS_INTERRUPT_H
#define FARLIGHT_OPTIONS_INTERRUPT_H

#include "lib/farlight.h"

/* Makes Ctrl-C, SIGTERM and SIGHUP set the descriptor readable instead of ending the program; a second signal
 * ends it. */
bool cli_interrupt_begin(struct fl_error *error);
int cli_interrupt_fd(void);
int cli_interrupt_signal(void); /* the received signal; 0: none */

#endif
