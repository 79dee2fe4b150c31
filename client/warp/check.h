/* SPDX-License-Identifier: MIT */
/* Complete checks of everything that a caller passes to a context. */
#ifndef FARLIGHT_CLIENT_WARP_CHECK_H
#define FARLIGHT_CLIENT_WARP_CHECK_H

#include "warp/warp.h"

/* Fills *error, which may be NULL, and returns false. */
bool warp_error_set(struct fl_warp_error *error, enum fl_warp_error_code code, const char *field,
                    const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Check an argument. False: *error has the reason. */
bool warp_check_key(const struct fl_warp_key *key, struct fl_warp_error *error);
bool warp_check_layer(const struct fl_warp_layer *layer, uint32_t width, uint32_t height,
                      struct fl_warp_error *error);
/* Checks a part of a layer of this size. */
bool warp_check_part(const struct fl_warp_part *part, uint32_t width, uint32_t height,
                     struct fl_warp_error *error);
bool warp_check_view(const struct fl_warp_view *view, const struct fl_warp_picture *picture,
                     struct fl_warp_error *error);

#endif
