// An image file as floats, as stored; and its display values.
#pragma once

#include "output/library.h"

#include <OpenImageIO/imagebuf.h>

#include <cstdint>
#include <string>

struct picture {
    OIIO::ImageBuf pixels; // floats without gaps, origin 0,0
    bool linear = false;   // linear light, colours multiplied by alpha; else sRGB, straight alpha
    int alpha = -1;        // channel; -1: none

    int width() const
    {
        return pixels.spec().width;
    }
    int height() const
    {
        return pixels.spec().height;
    }
    int channels() const
    {
        return pixels.spec().nchannels;
    }
    size_t count() const
    {
        return static_cast<size_t>(width()) * static_cast<size_t>(height());
    }
    float *data()
    {
        return static_cast<float *>(pixels.localpixels());
    }
    const float *data() const
    {
        return static_cast<const float *>(pixels.localpixels());
    }
    std::string channel_names() const; // "R,G,B,A"
};

// Floats of these dimensions, zero. Throws std::bad_alloc.
OIIO::ImageBuf make_plane(int width, int height, int channels);

// Decodes EXR, HDR, PNG or JPEG, known by their first bytes; the claims of the header are checked before a pixel
// is read. False: `reason` says why.
bool picture_decode(const uint8_t *file, size_t file_bytes, struct picture &made, std::string &reason);
// Leaves the colours alone.
void picture_drop_alpha(struct picture &picture);

// The colours, alpha aside, become those of a PNG of the renderer: divided by alpha, through the tone map and the
// sRGB curve. Does nothing to a picture that is not linear.
void picture_to_screen(struct picture &picture, enum protocol_tone_map tone_map);
// Red, green and blue of the display values, 0 to 1.
OIIO::ImageBuf picture_screen_colours(const struct picture &picture, enum protocol_tone_map tone_map);
