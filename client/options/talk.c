/* SPDX-License-Identifier: MIT */
/* Messages on standard error. */
#include "talk.h"
#include "interrupt.h"
#include "retry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "protocol/plain_text.h"

bool cli_is_terminal(int fd)
{
    const char *kind = getenv("TERM");
    return isatty(fd) == 1 && kind && kind[0] != '\0' && strcmp(kind, "dumb") != 0;
}

static bool use_colour(void)
{
    const char *refused = getenv("NO_COLOR");
    return (!refused || refused[0] == '\0') && cli_is_terminal(STDERR_FILENO);
}

static void say(const char *kind, const char *colour, const struct fl_error *what)
{
    char line[1200];
    const bool colourful = use_colour();
    fl_error_print(what, line, sizeof(line));
    fprintf(stderr, "farlight: %s%s%s%s\n", colourful ? colour : "", kind, colourful ? "\033[0m" : "", line);
}

void cli_print_name(const char *name)
{
    plain_text_print(stdout, name);
}

int cli_report(const struct fl_error *error)
{
    if (error->code == FL_ERROR_INTERRUPTED && cli_interrupt_signal() != 0) {
        say("", "", error);
        return 128 + cli_interrupt_signal();
    }
    say("", "", error);
    if (error->code == FL_ERROR_ARGUMENT)
        return CLI_USAGE;
    return cli_is_temporary(error) ? CLI_TRY_AGAIN : CLI_FAILED;
}

void cli_note(const struct fl_note *note, bool chatty)
{
    struct fl_error line;
    if (note->severity == PROTOCOL_SEVERITY_INFO && !chatty)
        return;
    if (note->severity == PROTOCOL_SEVERITY_ERROR)
        return; /* will be repeated as the reason of the failure */
    fl_error_set(&line, FL_ERROR_NONE, note->where, "%s", note->text);
    say(note->severity == PROTOCOL_SEVERITY_WARNING ? "warning: " : "note: ", "\033[33m", &line);
}
