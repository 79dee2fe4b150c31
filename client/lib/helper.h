/* SPDX-License-Identifier: MIT */
/* A helper program that receives frames: shared by the client's sides of the image writer and the video writer.
 */
#ifndef FARLIGHT_CLIENT_LIB_HELPER_H
#define FARLIGHT_CLIENT_LIB_HELPER_H

#include "lib/connection.h"

struct fl_helper {
    struct fl_stream stream;
    struct fl_process process;
    const char *program; /* "farlight-export" */
    const char *what;    /* "the image writer" */
    int interrupt_fd;    /* 0: nothing interrupts */
    uint64_t answer_ns;  /* maximum time without an answer; 0: 5 minutes */
    uint32_t request;    /* number of the current request */
    bool lost;           /* the program has ended */
};

/* `program`, `what` and `interrupt_fd` are set by the caller. fl_helper_finish must follow, also after a failure.
 */
bool fl_helper_start(struct fl_helper *helper, const char *const *arguments, struct fl_error *error);
/* Closes the socket, which ends the program; kills it if it does not end. */
void fl_helper_finish(struct fl_helper *helper);

/* Appends the message to the queue. */
bool fl_helper_send(struct fl_helper *helper, const struct message *message, struct fl_error *error);
/* Appends a whole frame with raw pixels to the queue. */
bool fl_helper_send_frame(struct fl_helper *helper, const struct fl_frame *frame, struct fl_error *error);
/* Waits until the kernel has everything, so that the program can work while the caller continues. */
bool fl_helper_flush(struct fl_helper *helper, struct fl_error *error);
/* The next answer to the current request, if it has arrived. */
enum fl_stream_result fl_helper_poll(struct fl_helper *helper, struct message *message, struct fl_error *error);
/* Waits for the next answer to the current request. */
bool fl_helper_receive(struct fl_helper *helper, struct message *message, struct fl_error *error);

/* Copies the path, or the end of a long one, for errors that name a file. */
void fl_shorten_path(const char *path, char *out, size_t out_bytes);

#endif
