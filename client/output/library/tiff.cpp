// SPDX-License-Identifier: MIT
// Encoding of TIFF files in memory.
#include "tiff.hpp"
#include "protocol/version.h"

#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <memory>

namespace
{

struct memory_file {
    std::vector<unsigned char> &bytes;
    size_t at;
};

tmsize_t read_memory(thandle_t handle, void *to, tmsize_t count)
{
    memory_file &file = *static_cast<memory_file *>(handle);
    const size_t left = file.bytes.size() - std::min(file.at, file.bytes.size());
    const size_t taken = std::min(left, static_cast<size_t>(count));
    std::memcpy(to, file.bytes.data() + file.at, taken);
    file.at += taken;
    return static_cast<tmsize_t>(taken);
}

tmsize_t write_memory(thandle_t handle, void *from, tmsize_t count)
{
    memory_file &file = *static_cast<memory_file *>(handle);
    const size_t end = file.at + static_cast<size_t>(count);
    if (end > file.bytes.size())
        file.bytes.resize(end);
    std::memcpy(file.bytes.data() + file.at, from, static_cast<size_t>(count));
    file.at = end;
    return count;
}

toff_t seek_memory(thandle_t handle, toff_t offset, int from)
{
    memory_file &file = *static_cast<memory_file *>(handle);
    file.at = offset + (from == SEEK_CUR ? file.at : from == SEEK_END ? file.bytes.size() : 0);
    return file.at;
}

int close_memory(thandle_t)
{
    return 0;
}

toff_t memory_size(thandle_t handle)
{
    return static_cast<memory_file *>(handle)->bytes.size();
}

void set_text(TIFF *tiff, uint32_t tag, const char *text)
{
    if (text[0] != '\0')
        TIFFSetField(tiff, tag, text);
}

} // namespace

bool tiff_encode(const struct library_image &image, std::vector<unsigned char> &file, std::string &why)
{
    const struct raster &raster = image.raster;
    memory_file memory = {file, 0};
    TIFFSetErrorHandler(nullptr); // keeps libtiff from writing to the terminal
    const std::unique_ptr<TIFF, void (*)(TIFF *)> tiff(TIFFClientOpen("picture", "wl", &memory, read_memory,
                                                                      write_memory, seek_memory, close_memory,
                                                                      memory_size, nullptr, nullptr),
                                                       TIFFClose);
    why = "libtiff cannot write it";
    if (!tiff)
        return false;
    const size_t row_bytes = static_cast<size_t>(raster.width) * raster.channels;
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, raster.width);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, raster.height);
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, raster.channels);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, raster.height);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff.get(), TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
    const uint16_t straight_alpha = EXTRASAMPLE_UNASSALPHA;
    if (raster.channels == 4)
        TIFFSetField(tiff.get(), TIFFTAG_EXTRASAMPLES, 1, &straight_alpha);
    set_text(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, image.description);
    set_text(tiff.get(), TIFFTAG_DATETIME, image.date);
    set_text(tiff.get(), TIFFTAG_SOFTWARE, "farlight " FARLIGHT_VERSION);
    const auto *rows = static_cast<const unsigned char *>(raster.pixels);
    std::vector<unsigned char> row(row_bytes); // the predictor works in place
    for (uint32_t y = 0; y < raster.height; y++) {
        std::memcpy(row.data(), rows + y * row_bytes, row_bytes);
        if (TIFFWriteScanline(tiff.get(), row.data(), y, 0) < 0)
            return false;
    }
    return TIFFFlush(tiff.get()) != 0;
}
