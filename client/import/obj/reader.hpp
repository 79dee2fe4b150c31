// SPDX-License-Identifier: MIT
// The parts of the OBJ reader.
#ifndef FARLIGHT_IMPORT_OBJ_READER_HPP
#define FARLIGHT_IMPORT_OBJ_READER_HPP

#include "import/model/files.h"
#include "import/model/grouping.h"

#include <tiny_obj_loader.h>

#include <array>
#include <functional>
#include <istream>
#include <map>
#include <streambuf>
#include <string>
#include <vector>

namespace obj
{
struct reader {
    import_scene *scene;
    struct files *files;
};

// Bytes as a stream that knows where it is.
class memory_stream : public std::streambuf
{
  public:
    memory_stream(const char *begin, size_t size_bytes)
    {
        char *from = const_cast<char *>(begin);
        setg(from, from, from + size_bytes);
    }
    // "line 17": the line that was read last.
    std::string place() const;
};

// ---- text.cpp: what is done to the text before tinyobjloader sees it
// Lines of one material, which the library does not tell of.
struct line_run {
    std::string material;       // empty: none
    std::vector<uint32_t> ends; // two vertices each
};
struct prepared {
    const char *original;
    size_t original_bytes;
    std::string mended; // not empty: to be read instead
    const char *begin() const
    {
        return mended.empty() ? original : mended.data();
    }
    size_t size_bytes() const
    {
        return mended.empty() ? original_bytes : mended.size();
    }
    std::vector<double> places;         // 3 a vertex, where floats would lose something of them; else empty
    double origin[3];                   // to be subtracted from these
    std::vector<float> colours;         // 3 a vertex, sRGB, as the file has them; empty: it has none
    std::vector<std::string> libraries; // whole arguments of mtllib: several names, or one with spaces
    bool has_points;
    std::vector<line_run> lines; // of l statements
};
// UTF-16 becomes UTF-8, continued lines become one, decimal commas become points, and corners lose the slashes at
// their end; numbers that are none are reported with their line.
prepared prepare(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- material.cpp
// What the libraries define, in their order; a note says which cannot be used.
std::vector<tinyobj::material_t> read_libraries(reader &r, const std::vector<std::string> &libraries);
// Reads an image by the name that a material has for it, as files_read() does.
using image_source = std::function<unsigned char *(const std::string &name, size_t *size_bytes, char *reason)>;
// Which texture coordinates each map of a material uses.
using texcoord_sets = std::array<uint32_t, PROTOCOL_MATERIAL_COUNT>;
// Also for readers that fill such materials from other formats. `sets`, by position, may be empty: MTL has one
// set. Identifiers by position; 0 where there is none.
std::vector<uint32_t> add_materials(import_scene *scene, const image_source &read_image,
                                    const std::vector<const tinyobj::material_t *> &materials,
                                    const std::vector<texcoord_sets> &sets = {});
} // namespace obj

#endif
