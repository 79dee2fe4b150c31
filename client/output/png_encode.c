/* SPDX-License-Identifier: MIT */
/* Encoding of PNG files. */
#include "png_encode.h"

#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define COMPRESSION_LEVEL 4 /* half the time of 6 for 2 % more bytes */

/* Destination of libpng's output, and the reason of a failure. */
struct sink {
    uint8_t *bytes;
    size_t count, capacity;
    char *reason;
    size_t reason_bytes;
};

static void append(png_structp writer, png_bytep bytes, size_t count)
{
    struct sink *sink = png_get_io_ptr(writer);
    if (count > sink->capacity - sink->count) {
        const size_t capacity = 2 * sink->capacity + count + 4096;
        uint8_t *grown = realloc(sink->bytes, capacity);
        if (!grown)
            png_error(writer, "out of memory");
        sink->bytes = grown;
        sink->capacity = capacity;
    }
    memcpy(sink->bytes + sink->count, bytes, count);
    sink->count += count;
}

static void flush(png_structp writer)
{
    (void)writer;
}

static void keep_error(png_structp writer, png_const_charp text)
{
    struct sink *sink = png_get_error_ptr(writer);
    snprintf(sink->reason, sink->reason_bytes, "%s", text);
    png_longjmp(writer, 1);
}

static void ignore_warning(png_structp writer, png_const_charp text)
{
    (void)writer;
    (void)text;
}

static void set_header(png_structp writer, png_infop info, const struct png *png)
{
    png_set_compression_level(writer, COMPRESSION_LEVEL);
    png_set_compression_strategy(writer, Z_DEFAULT_STRATEGY);
    /* Takes a third less time than all five filters; four test pictures became up to 6 % smaller and 2 %
     * larger. */
    png_set_filter(writer, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP);
    png_set_IHDR(writer, info, png->width, png->height, 8,
                 png->channels == 4 ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (!png->other_display)
        png_set_sRGB_gAMA_and_cHRM(writer, info, PNG_sRGB_INTENT_ABSOLUTE);
    if (png->date) {
        png_time time;
        png_convert_from_struct_tm(&time, png->date);
        png_set_tIME(writer, info, &time);
    }
    for (size_t i = 0; i < png->text_count; i++) {
        const struct png_text *each = &png->texts[i];
        png_text text = {.compression = PNG_TEXT_COMPRESSION_NONE,
                         .key = (char *)(uintptr_t)each->key, /* key and text are only read */
                         .text = (char *)(uintptr_t)each->text};
        png_set_text(writer, info, &text, 1);
    }
}

/* Errors of libpng jump out of this function, so it owns nothing. */
static bool write_all(png_structp writer, png_infop info, const struct png *png, struct sink *sink)
{
    if (setjmp(png_jmpbuf(writer)))
        return false;
    png_set_write_fn(writer, sink, append, flush);
    set_header(writer, info, png);
    png_write_info(writer, info);
    for (uint32_t y = 0; y < png->height; y++)
        png_write_row(writer, png->pixels + (size_t)y * png->width * png->channels);
    png_write_end(writer, NULL);
    return true;
}

bool png_encode(const struct png *png, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    struct sink sink = {.reason = reason, .reason_bytes = reason_bytes};
    png_structp writer = png_create_write_struct(PNG_LIBPNG_VER_STRING, &sink, keep_error, ignore_warning);
    png_infop info = writer ? png_create_info_struct(writer) : NULL;
    const bool done = info && write_all(writer, info, png, &sink);
    if (!info)
        snprintf(reason, reason_bytes, "out of memory");
    png_destroy_write_struct(&writer, &info);
    if (!done) {
        free(sink.bytes);
        return false;
    }
    *file = sink.bytes;
    *file_bytes = sink.count;
    return true;
}
