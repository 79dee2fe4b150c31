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

// A stream over bytes that knows its position.
class memory_stream : public std::streambuf
{
  public:
    memory_stream(const char *begin, size_t size_bytes)
    {
        char *from = const_cast<char *>(begin);
        setg(from, from, from + size_bytes);
    }
    // The last line that was read, as "line 17".
    std::string place() const;
};

// ---- text.cpp: mending of the text for tinyobjloader
// Lines of one material, which the library does not report.
struct line_run {
    std::string material;       // empty: none
    std::vector<uint32_t> ends; // two vertices each
};
struct prepared {
    const char *original;
    size_t original_bytes;
    std::string mended; // read instead of the original, if not empty
    const char *begin() const
    {
        return mended.empty() ? original : mended.data();
    }
    size_t size_bytes() const
    {
        return mended.empty() ? original_bytes : mended.size();
    }
    std::vector<double> places;         // 3 a vertex, if floats round them too much; else empty
    double origin[3];                   // subtracted from `places`
    std::vector<float> colours;         // 3 a vertex, sRGB, as in the file; empty: it has none
    std::vector<std::string> libraries; // whole arguments of mtllib: several names, or one with spaces
    bool has_points;
    std::vector<line_run> lines; // from l statements
};
// Mends a text: UTF-16 becomes UTF-8, continued lines become one, decimal commas become points, and corners lose
// trailing slashes; invalid numbers are reported with their line.
prepared prepare(reader &r, const unsigned char *bytes, size_t size_bytes);

// ---- material.cpp
// The materials of the libraries, in order; a note lists unusable libraries.
std::vector<tinyobj::material_t> read_libraries(reader &r, const std::vector<std::string> &libraries);
// Reads an image by its name in a material, as files_read() does.
using image_source = std::function<unsigned char *(const std::string &name, size_t *size_bytes, char *reason)>;
// The set of texture coordinates of each map of a material.
using texcoord_sets = std::array<uint32_t, PROTOCOL_MATERIAL_COUNT>;
// Adds materials, also for readers that convert other formats to them. `sets`, in parallel, may be empty: MTL has
// one set. Returns identifiers in parallel; 0: none.
std::vector<uint32_t> add_materials(import_scene *scene, const image_source &read_image,
                                    const std::vector<const tinyobj::material_t *> &materials,
                                    const std::vector<texcoord_sets> &sets = {});
} // namespace obj

#endif
