/* SPDX-License-Identifier: MIT */
/* A key, a picture with depths from the daemon, and the structure over it from which views are made. */
#ifndef FARLIGHT_VIEWER_VIEW_WARPED_KEY_H
#define FARLIGHT_VIEWER_VIEW_WARPED_KEY_H

#include "layer.h"

struct warped_key {
    struct fl_warp *warp;
    struct views_key key; /* without picture and depths */
    int width, height;
    uint64_t number; /* 0: none */
};

void views_key_finish(struct views_key *key);

/* Builds the structure; takes over the key. */
bool warped_key_set(struct warped_key *warped, struct views_key *came, struct fl_warp_error *error);
/* Adds a layer; takes it over. *added: it has the key's size. */
bool warped_key_add(struct warped_key *warped, struct views_layer *came, bool *added, struct fl_warp_error *error);

#endif
