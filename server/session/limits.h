/* SPDX-License-Identifier: MIT */
/* Limits of a single client, and of all clients together. Each is a row of the configuration. */
#ifndef FARLIGHT_SESSION_LIMITS_H
#define FARLIGHT_SESSION_LIMITS_H

#include "protocol/tracers.h"

#include <stdint.h>

struct session_limits {
    uint32_t clients;
    uint32_t share_percent;               /* share of `clients` that a single user or key may have */
    uint32_t unauthenticated;             /* connections whose handshake is not done, all together */
    uint32_t unauthenticated_per_address; /* from one TCP peer */
    uint32_t handshakes_a_second;         /* sealed ones, from one network; further ones wait */
    uint32_t requests_in_flight;
    uint32_t scenes_per_client;
    uint32_t jobs_per_client;
    uint32_t blobs_per_client;
    uint32_t transaction_edits; /* edits of a client in its unanswered transactions */
    uint32_t nodes;
    uint32_t depth; /* maximum depth of the node hierarchy */
    uint32_t texture_edge_texels;
    uint32_t width_pixels, height_pixels;
    uint32_t samples;
    struct tracer_limits tracers;
    uint64_t blob_bytes;        /* blobs of all clients, including arriving ones */
    uint64_t blob_cache_bytes;  /* part of blob_bytes for unused blobs */
    uint64_t transaction_bytes; /* memory of the edits of all clients */
    uint64_t upload_window_bytes;
    uint64_t frame_bytes;      /* maximum of the frames of all jobs before they are sent; one job may always run */
    uint32_t frames_in_flight; /* the engine's limit for one job */
    uint64_t frame_window_bytes; /* rendered frames of one job that wait to be sent, as far as more than one */
};

#endif
