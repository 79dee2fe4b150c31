/* SPDX-License-Identifier: MIT */
/* Speaks the protocol to the program that started this one, over a connected stream socket and without handshake.
 */
#ifndef FARLIGHT_IMPORT_SEND_H
#define FARLIGHT_IMPORT_SEND_H

#include "import/model/scene.h"

struct sender {
    int socket;
    uint8_t *out; /* not yet sent */
    size_t out_used;
    uint8_t *in; /* not yet parsed */
    size_t in_used;
    uint64_t credit_bytes; /* of channel 1, in all */
    uint64_t sent_bytes;   /* of blob data */
    uint32_t last_request;
    uint32_t first_upload,
        uploads_open; /* requests first_upload .. last_request, and how many lack their answer */
    uint32_t awaited; /* request whose answer is waited for; 0: none */
    bool answered;
    bool *needed; /* of the lot that is offered */
    uint32_t offered;
    bool gone; /* the peer has hung up: no error can be sent */
    struct import_scene *scene;
};

bool sender_init(struct sender *sender, int socket, struct import_scene *scene);
void sender_finish(struct sender *sender);

/* Each false: the scene has failed or the peer is gone. */
bool sender_progress(struct sender *sender, uint64_t done_bytes, uint64_t total_bytes, const char *text);
/* A file that the model of that number names, relative to its folder. */
bool sender_file(struct sender *sender, uint32_t model, const char *name);
bool sender_notes(struct sender *sender); /* notes and clips */
bool sender_blobs(struct sender *sender); /* offers, sends what is needed, waits until all are confirmed */
bool sender_edits(struct sender *sender, uint32_t scene_id); /* one transaction; waits for its answer */
bool sender_done(struct sender *sender, const struct message_import_done *done);
/* Tells the scene's failure. */
void sender_failure(struct sender *sender);

#endif
