/* SPDX-License-Identifier: MIT */
/* Child programs that speak over a stream socket: the private daemon, the importer, the exporter, ssh. */
#ifndef FARLIGHT_CLIENT_LIB_PROCESS_H
#define FARLIGHT_CLIENT_LIB_PROCESS_H

#include "lib/farlight.h"

#include <sys/types.h>

enum fl_wiring {
    FL_WIRING_DESCRIPTOR, /* the socket is descriptor 3 ("--fd 3" comes first); output is recorded */
    /* The socket is standard input and output; the program writes to our standard error and may ask the
     * terminal for a passphrase. */
    FL_WIRING_STANDARD,
};

struct fl_process {
    pid_t pid;    /* 0: none */
    int input_fd; /* > 0: the program's standard input; the caller sets it and keeps it; 0: none */
    int talk_fd;  /* memory file with the program's standard output and error; -1: none */
    /* Set by the caller: the program's memory comes in huge pages, if the C library can do that. */
    bool has_large_arrays;
    /* Set by the caller: the program gets all variables, as it reads no files of other people. */
    bool keeps_environment;
    char name[32];
};

/* The path of a helper program: searched in $FARLIGHT_LIBEXEC, the folder of the running program, PATH. */
bool fl_find_program(const char *name, char *path, size_t path_bytes, struct fl_error *error);

/* Starts `name` with `arguments` (NULL-terminated; without the program's name). *socket_fd is our end. */
bool fl_process_start(struct fl_process *process, const char *name, enum fl_wiring wiring,
                      const char *const *arguments, int *socket_fd, struct fl_error *error);
/* Waits until the program ends by itself, sends SIGTERM after `grace_ms`, kills it 2 s later. Returns its wait
 * status; 0 if there is none. Closes the log: call `fl_process_last_words` before. */
int fl_process_end(struct fl_process *process, unsigned grace_ms);
/* True if the program has ended, after a wait of at most timeout_ms; it is not reaped. */
bool fl_process_has_ended(const struct fl_process *process, unsigned timeout_ms);
void fl_process_kill(struct fl_process *process); /* kills at once; fl_process_end must follow */
/* Waits up to `grace_ms` for the program's end, then writes how it ended and its last line into `text`:
 * "farlightd was ended by signal 11: ..."; the last line alone if it is still running. An error and its remedy
 * are in lines of their own. */
void fl_process_last_words(struct fl_process *process, unsigned grace_ms, char *text, size_t text_bytes);
/* True if the program has ended by itself with a status that another start would repeat: neither success, nor
 * 75, nor a signal's, nor the 255 of ssh without a connection. */
bool fl_process_has_refused(const struct fl_process *process);

/* Copies the rest of the index-th recorded line that begins with `start`. False: there is none. */
bool fl_process_find_line(const struct fl_process *process, const char *start, size_t index, char *text,
                          size_t text_bytes);

#endif
