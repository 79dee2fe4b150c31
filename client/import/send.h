/* SPDX-License-Identifier: MIT */
/* The importer's side of the protocol: sends a scene to its parent over a connected stream socket, without
 * handshake. */
#ifndef FARLIGHT_IMPORT_SEND_H
#define FARLIGHT_IMPORT_SEND_H

#include "import/model/scene.h"

struct sender {
    int socket;
    uint8_t *out; /* not sent yet */
    size_t out_used;
    uint8_t *in; /* not parsed yet */
    size_t in_used;
    uint64_t credit_bytes; /* total for channel 1 */
    uint64_t sent_bytes;   /* bytes of blob data */
    uint32_t last_request;
    uint32_t first_upload, uploads_open; /* requests first_upload .. last_request, and how many lack an answer */
    uint32_t awaited;                    /* the request whose answer is awaited; 0: none */
    bool answered;
    bool *needed; /* flags of the offered blobs */
    uint32_t offered;
    bool gone; /* the peer has hung up: no error can be sent */
    struct import_scene *scene;
};

bool sender_init(struct sender *sender, int socket, struct import_scene *scene);
void sender_finish(struct sender *sender);

/* Send a message. False: the scene has failed or the peer has hung up. */
bool sender_progress(struct sender *sender, uint64_t done_bytes, uint64_t total_bytes, const char *text);
/* Sends the name of a file that this model refers to, relative to its folder. */
bool sender_file(struct sender *sender, uint32_t model, const char *name);
bool sender_notes(struct sender *sender); /* sends notes and clips */
bool sender_blobs(struct sender *sender); /* offers blobs, sends missing ones, waits for all confirmations */
bool sender_edits(struct sender *sender, uint32_t scene_id); /* sends the transaction and waits for its answer */
bool sender_done(struct sender *sender, const struct message_import_done *done);
/* Sends the scene's failure. */
void sender_failure(struct sender *sender);

#endif
