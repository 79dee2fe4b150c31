/* SPDX-License-Identifier: MIT */
/* The module that does what needs OpenImageIO, libtiff and libjxl: it writes HDR, WebP, TIFF and GIF, and
 * compares images. Their libraries take a third of a second to load, so that only the runs that need it load it.
 */
#ifndef FARLIGHT_CLIENT_OUTPUT_LIBRARY_H
#define FARLIGHT_CLIENT_OUTPUT_LIBRARY_H

#include "compare.h"
#include "image.h"
#include "raster.h"

#ifdef __cplusplus
extern "C" {
#endif

struct library_image {
    enum image_format format; /* HDR, WEBP, TIFF or GIF */
    struct raster raster;
    unsigned quality;        /* WebP */
    const char *description; /* lines of text */
    const char *date;        /* "YYYY:MM:DD hh:mm:ss"; may be empty */
};

struct library_colour {
    const char *config; /* file of an OpenColorIO configuration */
    const char *space;  /* NULL: the view, "VIEW" of the default display or "DISPLAY/VIEW" */
    const char *view;
    float aces_from_rec709[9]; /* row by row, of linear values: the space that configurations have in common */
};

/* What the module needs of the program, for files are the program's. */
struct library_host {
    bool (*read)(int fd, size_t max_bytes, uint8_t **bytes, size_t *count, char *reason, size_t reason_bytes);
    /* Writes the picture of errors that the request names. */
    bool (*write)(const struct message_compare_images *wanted, const struct raster *picture,
                  const char *description, char *reason, size_t reason_bytes);
};

/* Exported under the name `image_library`. */
struct image_library {
    /* Sets the libraries up, and tries those that encode. */
    bool (*prepare)(bool draws_text, char *reason, size_t reason_bytes);
    /* *file is malloc'ed. False: `reason` says why. */
    bool (*encode)(const struct library_image *image, uint8_t **file, size_t *file_bytes, char *reason,
                   size_t reason_bytes);
    /* As compare_images. */
    bool (*compare)(const struct library_host *host, const struct message_compare_images *wanted,
                    const struct compare_file *a, const struct compare_file *b, struct compare_result *result);
    /* Draws a line of text into a picture of bytes with four channels, which is changed; nothing where no font is
     * installed. */
    bool (*draw)(const struct raster *raster, const struct message_export_text *wanted, char *reason,
                 size_t reason_bytes);
    /* Reads the configuration. False: `reason` says why, and what there is. */
    bool (*colour_open)(const struct library_colour *wanted, char *reason, size_t reason_bytes);
    /* After that: RGBA of linear Rec. 709, straight, to the space or the view, in place. */
    void (*colour_apply)(float *pixels, size_t count);
};
extern const struct image_library image_library __attribute__((visibility("default")));

/* The folder of the module, which the sandbox must let it read; the caller frees it. NULL: as module_folder. */
char *library_folder(void);
/* Loads the module, to be called within the sandbox, as its libraries start threads; `draws_text`: with a font. */
void library_load(bool draws_text);
/* NULL: `reason` says why. */
const struct image_library *library_loaded(char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
