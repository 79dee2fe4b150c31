/* SPDX-License-Identifier: MIT */
/* The module that chooses the colours of a GIF file: it needs libavfilter, which takes a fifth of a second to
 * load, so that only the runs that write one load it. */
#ifndef FARLIGHT_CLIENT_VIDEO_PALETTE_H
#define FARLIGHT_CLIENT_VIDEO_PALETTE_H

#include <libavutil/frame.h>
#include <stddef.h>

struct palette;

/* Exported under the name `palette_maker`. Its functions return the library's error numbers. */
struct palette_maker {
    int (*create)(struct palette **palette, int width, int height);
    /* A picture of the format BGRA, without alpha, which the palette refers to from now on; NULL: that was all. */
    int (*put)(struct palette *palette, AVFrame *picture);
    /* After that, the pictures as they came, of the format PAL8; AVERROR_EOF after the last. */
    int (*take)(struct palette *palette, AVFrame *picture);
    void (*destroy)(struct palette *palette);
};
extern const struct palette_maker palette_maker __attribute__((visibility("default")));

/* The folder of the module, which the sandbox must let it read; the caller frees it. NULL: as module_folder. */
char *palette_folder(void);
/* Loads the module, to be called within the sandbox, as its libraries may start threads. */
void palette_load(void);
/* NULL: `reason` says why. */
const struct palette_maker *palette_loaded(char *reason, size_t reason_bytes);

#endif
