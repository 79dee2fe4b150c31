/* SPDX-License-Identifier: MIT */
/* Writing of screenshots. */
#include "snapshot.h"

#include <stdio.h>
#include <string.h>

bool snapshot_write(const char *path, const struct pixmap *picture, struct fl_error *error)
{
    char folder[4096] = ".";
    const char *slash = strrchr(path, '/');
    if (slash)
        snprintf(folder, sizeof(folder), "%.*s", slash == path ? 1 : (int)(slash - path), path);
    const struct fl_frame frame = {.width = (uint32_t)picture->width,
                                   .height = (uint32_t)picture->height,
                                   .samples = 1,
                                   .format = PROTOCOL_PIXEL_FORMAT_RGBA8,
                                   .layers = 1u << PROTOCOL_LAYER_BEAUTY,
                                   .pixels = picture->pixels,
                                   .pixels_bytes = (size_t)picture->width * (size_t)picture->height * 4};
    struct fl_exporter *exporter =
        fl_exporter_start(&(struct fl_exporter_options){.folder = folder, .format = "png"}, error);
    const bool done =
        exporter &&
        fl_exporter_write(exporter, &frame, &(struct fl_export_options){.path = path, .format = "png"}, error) &&
        fl_exporter_wait(exporter, error);
    fl_exporter_destroy(exporter);
    return done;
}
