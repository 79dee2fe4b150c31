/* SPDX-License-Identifier: MIT */
/* Assembling frames from messages; every claim of a daemon about a frame is checked here. No I/O. */
#ifndef FARLIGHT_CLIENT_LIB_FRAME_H
#define FARLIGHT_CLIENT_LIB_FRAME_H

#include "lib/parts.h"

/* The request that a frame must match. */
struct fl_frame_expected {
    uint32_t width, height;
    enum protocol_pixel_format format;
    enum protocol_encoding encoding;
    unsigned layers; /* non-empty set of layers; see struct fl_frame */
    unsigned attachments;
    /* Views only: frames may be smaller and skip numbers, and frames at rest have another encoding. */
    bool is_view;
    enum protocol_encoding still_encoding;
    uint32_t margin_x_max, margin_y_max, hidden_layers;
    bool parts;
    bool stays_jpeg;      /* a JPEG is delivered undecoded */
    bool is_bare_at_rest; /* frames at rest have no attachments, as they show several views */
};

struct fl_assembly {
    struct fl_frame_expected expected;
    struct fl_frame *frame; /* begun; NULL: none */
    uint8_t *encoded;       /* received bytes; the pixels themselves when they are raw and alone */
    uint64_t encoded_bytes, received_bytes;
    struct message_frame_begin begin;
    struct fl_parts parts;
};

/* Process the messages of a frame. False: a message is not allowed, and the assembly must be finished. `number`
 * is the expected number of the frame; for a view its minimum. */
bool fl_assembly_begin(struct fl_assembly *assembly, const struct message_frame_begin *begin, uint32_t number,
                       uint64_t now_ns, struct fl_error *error);
bool fl_assembly_parts(struct fl_assembly *assembly, const struct message_frame_parts *told,
                       struct fl_error *error);
bool fl_assembly_data(struct fl_assembly *assembly, const struct message_frame_data *data, struct fl_error *error);
/* True if enough parts of a frame have arrived to show something, but not all. Never true for H.264, which is
 * decoded once. */
bool fl_assembly_has_first_parts(const struct fl_assembly *assembly);
/* Decodes those parts into a frame without costs; NULL on failure. */
struct fl_frame *fl_assembly_show(const struct fl_assembly *assembly, uint64_t now_ns, struct fl_error *error);
/* True if a frame that ends early has nothing to show. */
bool fl_assembly_is_void(const struct fl_assembly *assembly);
/* Decodes and checks the frame, which is then the caller's; NULL on failure. */
struct fl_frame *fl_assembly_end(struct fl_assembly *assembly, const struct message_frame_end *end,
                                 uint64_t now_ns, struct fl_error *error);
void fl_assembly_finish(struct fl_assembly *assembly);

/* Complete frames, ready for the caller; the daemon's credit is their limit. */
struct fl_frame_queue {
    struct fl_frame **frames; /* a ring */
    size_t first, count, capacity;
};

bool fl_frame_queue_init(struct fl_frame_queue *queue, size_t capacity, struct fl_error *error);
/* Takes the frame over, also on failure: more frames arrived than credit was given for. A frame whose first
 * parts are still in the queue replaces them. */
bool fl_frame_queue_push(struct fl_frame_queue *queue, struct fl_frame *frame, struct fl_error *error);
struct fl_frame *fl_frame_queue_pop(struct fl_frame_queue *queue); /* NULL: there is none */
void fl_frame_queue_clear(struct fl_frame_queue *queue);
void fl_frame_queue_finish(struct fl_frame_queue *queue);

/* The layers of a picture without a choice of layers. */
#define FL_LAYERS_PICTURE (1u << PROTOCOL_LAYER_BEAUTY)

#endif
