// SPDX-License-Identifier: MIT
// PLY files that the library reads wrong are written anew: places far from the origin, of which floats lose the
// most, strips of triangles, colours of faces, and Gaussians, whose colours have names of their own.
#include "assimp.hpp"
#include "origin.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace assimp
{
namespace
{
struct property {
    std::string name, type, count_type; // count_type: empty unless it is a list
};

struct element {
    std::string name;
    uint64_t count;
    std::vector<property> properties;

    // Its place among the properties; SIZE_MAX: there is none.
    size_t find(const char *wanted) const
    {
        for (size_t i = 0; i < properties.size(); i++)
            if (properties[i].name == wanted)
                return i;
        return SIZE_MAX;
    }
    bool has(const char *wanted) const
    {
        return find(wanted) != SIZE_MAX;
    }
    bool has_lists() const
    {
        return std::any_of(properties.begin(), properties.end(),
                           [](const property &p) { return !p.count_type.empty(); });
    }
};

using row = std::vector<std::vector<double>>; // of each property: one number, or those of a list

struct head {
    std::string format, comments; // the comments' lines
    std::vector<element> elements;
    size_t size_bytes = 0;

    const element *find(const char *wanted) const
    {
        for (const element &one : elements)
            if (one.name == wanted)
                return &one;
        return nullptr;
    }
};

// check_bytes() has seen each line.
head read_head(const unsigned char *bytes, size_t size_bytes)
{
    const char *const begin = reinterpret_cast<const char *>(bytes), *const end = begin + size_bytes;
    head out;

    for (const char *at = begin; at < end;) {
        const char *stop = std::find_if(at, end, [](char c) { return c == '\n' || c == '\r'; });
        const std::string line(at, stop);
        char words[5][64] = {};
        sscanf(line.c_str(), "%63s %63s %63s %63s %63s", words[0], words[1], words[2], words[3], words[4]);
        const std::string first = words[0];
        at = stop + (end - stop >= 2 && stop[0] == '\r' && stop[1] == '\n' ? 2 : 1);
        if (first == "format")
            out.format = words[1];
        else if (first == "comment")
            out.comments += line + "\n";
        else if (first == "element")
            out.elements.push_back({words[1], strtoull(words[2], nullptr, 10), {}});
        else if (first == "property" && !out.elements.empty() && strcmp(words[1], "list") == 0)
            out.elements.back().properties.push_back({words[4], words[3], words[2]});
        else if (first == "property" && !out.elements.empty())
            out.elements.back().properties.push_back({words[2], words[1], ""});
        if (first == "end_header") {
            out.size_bytes = size_t(std::min(at, end) - begin);
            break;
        }
    }
    return out;
}

size_t bytes_of(const std::string &type)
{
    return type == "double" || type == "float64"                                        ? 8
           : type == "char" || type == "uchar" || type == "int8" || type == "uint8"     ? 1
           : type == "short" || type == "ushort" || type == "int16" || type == "uint16" ? 2
                                                                                        : 4;
}

template <typename type> double value_of(const unsigned char *bytes)
{
    type value;
    memcpy(&value, bytes, sizeof(value));
    return double(value);
}

template <typename type> void append_as(std::string &out, double value)
{
    const type cut = type(value);
    out.append(reinterpret_cast<const char *>(&cut), sizeof(cut));
}

// The machine is little-endian, as everywhere here.
double number_of(const std::string &type, const unsigned char *bytes)
{
    const bool is_unsigned = type[0] == 'u';
    switch (bytes_of(type)) {
    case 1:
        return is_unsigned ? value_of<uint8_t>(bytes) : value_of<int8_t>(bytes);
    case 2:
        return is_unsigned ? value_of<uint16_t>(bytes) : value_of<int16_t>(bytes);
    case 8:
        return value_of<double>(bytes);
    default:
        return type[0] == 'f' ? value_of<float>(bytes)
               : is_unsigned  ? value_of<uint32_t>(bytes)
                              : value_of<int32_t>(bytes);
    }
}

void append(std::string &out, const std::string &type, double value)
{
    const bool is_unsigned = type[0] == 'u', is_real = type[0] == 'f' || type == "double";
    const double limit = is_unsigned ? 4294967295.0 : 2147483647.0;

    if (!is_real)
        value = value >= -limit ? std::min(value, limit) : 0; // NaN becomes 0
    switch (bytes_of(type)) {
    case 1:
        return append_as<uint8_t>(out, double(uint8_t(int64_t(value))));
    case 2:
        return append_as<uint16_t>(out, double(uint16_t(int64_t(value))));
    case 8:
        return append_as<double>(out, value);
    default:
        if (is_real)
            return append_as<float>(out, value);
        return append_as<uint32_t>(out, double(uint32_t(int64_t(value))));
    }
}

class data
{
  public:
    data(reader &of, const head &from, const unsigned char *bytes, size_t size_bytes)
        : r(of), is_text(from.format == "ascii"), is_swapped(from.format == "binary_big_endian"),
          at(bytes + from.size_bytes), end(bytes + size_bytes)
    {
    }
    row next(const element &of)
    {
        row out;
        for (const property &p : of.properties) {
            const double count = p.count_type.empty() ? 1 : next_number(p.count_type, of);
            if (!(count >= 0 && count <= double(end - at) + 1))
                fail(r, "", "the PLY file ends within its elements '%.60s'", of.name.c_str());
            out.emplace_back();
            for (size_t i = 0; i < size_t(count); i++)
                out.back().push_back(next_number(p.type, of));
        }
        return out;
    }

  private:
    reader &r;
    const bool is_text, is_swapped;
    const unsigned char *at, *const end;

    double next_number(const std::string &type, const element &of)
    {
        unsigned char bytes[8];
        const size_t size = bytes_of(type);
        if (is_text)
            return next_word(of);
        if (size_t(end - at) < size)
            fail(r, "", "the PLY file ends within its elements '%.60s'", of.name.c_str());
        std::copy(at, at + size, bytes);
        if (is_swapped)
            std::reverse(bytes, bytes + size);
        at += size;
        return number_of(type, bytes);
    }
    double next_word(const element &of)
    {
        char word[64];
        size_t length = 0;
        at = std::find_if(at, end, [](unsigned char c) { return c > ' '; });
        if (at == end)
            fail(r, "", "the PLY file ends within its elements '%.60s'", of.name.c_str());
        for (; at<end && * at> ' '; at++)
            if (length + 1 < sizeof(word))
                word[length++] = *at == ',' ? '.' : char(*at); // of countries with a decimal comma
        word[length] = '\0';
        return strtod(word, nullptr);
    }
};

// ---- what is changed

struct changes {
    bool is_far = false, is_gaussians = false, has_strips = false, has_face_colours = false;
    double origin[3] = {0, 0, 0};
};

bool holds_places(const element &vertices)
{
    return vertices.has("x") && vertices.has("y") && vertices.has("z") && !vertices.has_lists();
}

// Whether floats lose something of the places, and the origin of these. The first one says whether the others are
// looked at.
void find_far(reader &r, const head &from, const unsigned char *bytes, size_t size_bytes, changes &out)
{
    constexpr double exact_max = 8192; // from there on floats are a millimetre apart
    const element &vertices = from.elements[0];
    const size_t axes[3] = {vertices.find("x"), vertices.find("y"), vertices.find("z")};
    double lower[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, upper[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    data rows(r, from, bytes, size_bytes);

    if (from.format != "ascii" && bytes_of(vertices.properties[axes[0]].type) < 8)
        return;
    for (uint64_t i = 0; i < vertices.count; i++) {
        const row one = rows.next(vertices);
        bool is_large = i > 0;
        for (size_t c = 0; c < 3; c++) {
            const double value = one[axes[c]][0];
            is_large = is_large || std::fabs(value) > exact_max;
            lower[c] = std::min(lower[c], value);
            upper[c] = std::max(upper[c], value);
        }
        if (!is_large)
            return;
    }
    out.is_far = import_find_origin(lower, upper, out.origin);
}

changes find_changes(reader &r, const head &from, const unsigned char *bytes, size_t size_bytes)
{
    const element *vertices = from.find("vertex"), *faces = from.find("face");
    changes out;

    if (!vertices || vertices != &from.elements[0] || !holds_places(*vertices))
        return out;
    find_far(r, from, bytes, size_bytes, out);
    out.is_gaussians =
        vertices->has("f_dc_0") && vertices->has("f_dc_1") && vertices->has("f_dc_2") && !vertices->has("red");
    out.has_strips = from.find("tristrips") != nullptr;
    out.has_face_colours = faces && faces->has("red") && faces->has("green") && faces->has("blue") &&
                           !vertices->has("red") && !faces->has("texcoord");
    return out;
}

// ---- the file that is written

struct writer {
    const head &from;
    const changes &what;
    std::vector<row> vertices = {};
    std::string vertex_bytes = {}, face_bytes = {};
    uint64_t vertex_count = 0, face_count = 0;

    bool splits() const
    {
        return what.has_face_colours;
    }
};

void write_vertex(writer &w, const row &from, const double *colour)
{
    // The first part of a Gaussian's spherical harmonics, which has the same value in all directions.
    constexpr double constant_harmonic = 0.28209479177387814;
    const element &of = w.from.elements[0];
    const size_t axes[3] = {of.find("x"), of.find("y"), of.find("z")};

    for (size_t i = 0; i < of.properties.size(); i++) {
        const size_t axis = size_t(std::find(axes, axes + 3, i) - axes);
        append(w.vertex_bytes, axis < 3 ? "float" : of.properties[i].type,
               from[i][0] - (axis < 3 ? w.what.origin[axis] : 0));
    }
    for (size_t c = 0; w.what.is_gaussians && c < 3; c++) {
        const double value = 0.5 + constant_harmonic * from[of.find(("f_dc_" + std::to_string(c)).c_str())][0];
        append(w.vertex_bytes, "uchar", std::round(std::min(std::max(value, 0.0), 1.0) * 255));
    }
    for (size_t c = 0; colour && c < 3; c++)
        append(w.vertex_bytes, "uchar", colour[c]);
    w.vertex_count++;
}

void write_face(reader &r, writer &w, const std::vector<double> &corners, const double *colour)
{
    append(w.face_bytes, "int", double(corners.size()));
    for (double corner : corners) {
        if (w.splits()) {
            if (!(corner >= 0 && corner < double(w.vertices.size())))
                fail(r, "", "a face has the vertex %.0f, but there are %zu", corner, w.vertices.size());
            append(w.face_bytes, "int", double(w.vertex_count));
            write_vertex(w, w.vertices[size_t(corner)], colour);
        } else {
            append(w.face_bytes, "int", corner);
        }
    }
    w.face_count++;
}

// A strip ends at -1; every other triangle of one is turned.
void write_strip(reader &r, writer &w, const std::vector<double> &corners)
{
    size_t begin = 0;

    for (size_t i = 0; i < corners.size(); i++) {
        if (corners[i] < 0)
            begin = i + 1;
        else if (i >= begin + 2)
            write_face(r, w,
                       {corners[i - ((i - begin) % 2 == 0 ? 2 : 1)], corners[i - ((i - begin) % 2 == 0 ? 1 : 2)],
                        corners[i]},
                       nullptr);
    }
}

void write_element(reader &r, writer &w, const element &of, data &rows)
{
    const char *const lists[] = {"vertex_indices", "vertex_index"};
    const size_t list = std::min(of.find(lists[0]), of.find(lists[1]));
    const bool is_vertex = &of == &w.from.elements[0];
    const size_t colours[3] = {of.find("red"), of.find("green"), of.find("blue")};

    for (uint64_t i = 0; i < of.count; i++) {
        const row one = rows.next(of);
        double colour[3] = {255, 255, 255};
        for (size_t c = 0; !is_vertex && w.splits() && c < 3 && colours[c] != SIZE_MAX && !one[colours[c]].empty();
             c++)
            colour[c] = one[colours[c]][0] * (of.properties[colours[c]].type[0] == 'f' ? 255 : 1);
        if (is_vertex && w.splits())
            w.vertices.push_back(one);
        else if (is_vertex)
            write_vertex(w, one, nullptr);
        else if (of.name == "face" && list != SIZE_MAX)
            write_face(r, w, one[list], w.splits() ? colour : nullptr);
        else if (of.name == "tristrips" && list != SIZE_MAX && !w.splits())
            write_strip(r, w, one[list]);
    }
}

std::string written_head(const writer &w)
{
    std::string out = "ply\nformat binary_little_endian 1.0\n" + w.from.comments + "element vertex " +
                      std::to_string(w.vertex_count) + "\n";

    for (const property &p : w.from.elements[0].properties)
        out += "property " + (p.name == "x" || p.name == "y" || p.name == "z" ? std::string("float") : p.type) +
               " " + p.name + "\n";
    if (w.what.is_gaussians || w.splits())
        out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    if (w.face_count > 0)
        out += "element face " + std::to_string(w.face_count) + "\nproperty list int int vertex_indices\n";
    return out + "end_header\n";
}
} // namespace

void check_ply_rows(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    const head from = read_head(bytes, size_bytes);
    data rows(r, from, bytes, size_bytes);

    for (const element &one : from.elements)
        for (uint64_t i = 0; i < one.count && !one.properties.empty(); i++)
            rows.next(one);
}

std::string mend_ply(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    const head from = read_head(bytes, size_bytes);
    const changes what = find_changes(r, from, bytes, size_bytes);

    if (!what.is_far && !what.is_gaussians && !what.has_strips && !what.has_face_colours)
        return {};
    if (what.is_gaussians)
        import_note(
            r.scene, PROTOCOL_SEVERITY_WARNING, "",
            "it is a file of 3D Gaussians (3DGS), which are not rendered as such: their middles are shown as "
            "points in their colours");
    check_room(r, "", size_bytes, what.has_face_colours ? 32 : 4); // numbers of text are doubles here
    std::copy(what.origin, what.origin + 3, r.origin);
    writer w = {from, what};
    data rows(r, from, bytes, size_bytes);
    for (const element &one : from.elements)
        write_element(r, w, one, rows);
    return written_head(w) + w.vertex_bytes + w.face_bytes;
}
} // namespace assimp
