/* SPDX-License-Identifier: MIT */
/* The module on OpenImageIO, libtiff and libjxl: writes HDR, WebP, TIFF and GIF, and compares images. Its
 * libraries take a third of a second to load, so only runs that need it load it. */
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
    float aces_from_rec709[9]; /* row by row, linear values; ACES is the space that configurations share */
};

/* Functions of the program that the module calls, since only the program accesses files. */
struct library_host {
    bool (*read)(int fd, size_t max_bytes, uint8_t **bytes, size_t *count, char *reason, size_t reason_bytes);
    /* Writes the requested picture of errors. */
    bool (*write)(const struct message_compare_images *wanted, const struct raster *picture,
                  const char *description, char *reason, size_t reason_bytes);
};

/* Exported under the name `image_library`. */
struct image_library {
    /* Sets the libraries up, and tries the encoders. */
    bool (*prepare)(bool draws_text, char *reason, size_t reason_bytes);
    /* *file is malloc'ed. False: `reason` is set. */
    bool (*encode)(const struct library_image *image, uint8_t **file, size_t *file_bytes, char *reason,
                   size_t reason_bytes);
    /* Implements compare_images. */
    bool (*compare)(const struct library_host *host, const struct message_compare_images *wanted,
                    const struct compare_file *a, const struct compare_file *b, struct compare_result *result);
    /* Draws a line of text into a picture of bytes with four channels; draws nothing if no font is installed. */
    bool (*draw)(const struct raster *raster, const struct message_export_text *wanted, char *reason,
                 size_t reason_bytes);
    /* Reads the configuration. False: `reason` is set and lists the choices. */
    bool (*colour_open)(const struct library_colour *wanted, char *reason, size_t reason_bytes);
    /* Converts RGBA of linear Rec. 709, straight alpha, to the space or the view, in place; after colour_open. */
    void (*colour_apply)(float *pixels, size_t count);
};
extern const struct image_library image_library __attribute__((visibility("default")));

/* The folder of the module, which the sandbox must allow for reading; the caller frees it. NULL: as for
 * module_folder. */
char *library_folder(void);
/* Loads the module; must be called within the sandbox, as its libraries start threads. `draws_text`: a font is
 * needed. */
void library_load(bool draws_text);
/* The loaded module; NULL: `reason` is set. */
const struct image_library *library_loaded(char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
