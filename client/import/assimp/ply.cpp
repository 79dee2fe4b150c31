// SPDX-License-Identifier: MIT
// PLY files that the library misreads are rewritten: distant positions, which floats round too much, strips of
// triangles, colours of faces, and truncated files. Gaussians are read here.
#include "reader.hpp"
#include "import/model/origin.h"
#include "import/model/splats.hpp"

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

    // Index among the properties; SIZE_MAX: there is none.
    size_t find(const char *wanted) const
    {
        for (size_t i = 0; i < properties.size(); i++)
            if (properties[i].name == wanted)
                return i;
        return SIZE_MAX;
    }
    bool has(std::initializer_list<const char *> wanted) const
    {
        return std::all_of(wanted.begin(), wanted.end(), [&](const char *one) { return find(one) != SIZE_MAX; });
    }
    bool has_lists() const
    {
        return std::any_of(properties.begin(), properties.end(),
                           [](const property &p) { return !p.count_type.empty(); });
    }
};

using row = std::vector<std::vector<double>>; // for each property a number, or those of a list

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

// check_bytes() has checked each line.
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

// Reads a number of a binary file; the machine is little-endian.
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
    data(const head &from, const unsigned char *bytes, size_t size_bytes)
        : is_text(from.format == "ascii"), is_swapped(from.format == "binary_big_endian"),
          at(bytes + from.size_bytes), end(bytes + size_bytes)
    {
    }
    // Reads a row. False: the file ends within it.
    bool next(const element &of, row &out)
    {
        out.resize(of.properties.size());
        for (size_t p = 0; p < out.size(); p++) {
            double count = 1;
            if (!of.properties[p].count_type.empty() && !next_number(of.properties[p].count_type, count))
                return false;
            if (!(count >= 0 && count <= double(end - at) + 1))
                return false;
            out[p].resize(size_t(count));
            for (double &value : out[p])
                if (!next_number(of.properties[p].type, value))
                    return false;
        }
        return true;
    }
    // Skips an element. False: the file ends within it. Binary rows of constant size are not read.
    bool skip(const element &of)
    {
        size_t bytes = 0;
        row one;
        for (const property &p : of.properties)
            bytes += bytes_of(p.type);
        if (!is_text && !of.has_lists() && bytes > 0) {
            const bool is_whole = of.count <= size_t(end - at) / bytes;
            at = is_whole ? at + of.count * bytes : end;
            return is_whole;
        }
        for (uint64_t i = 0; i < of.count && bytes > 0; i++)
            if (!next(of, one))
                return false;
        return true;
    }

  private:
    const bool is_text, is_swapped;
    const unsigned char *at, *const end;

    bool next_number(const std::string &type, double &out)
    {
        unsigned char bytes[8];
        const size_t size = bytes_of(type);
        if (is_text)
            return next_word(out);
        if (size_t(end - at) < size)
            return false;
        std::copy(at, at + size, bytes);
        if (is_swapped)
            std::reverse(bytes, bytes + size);
        at += size;
        out = number_of(type, bytes);
        return true;
    }
    bool next_word(double &out)
    {
        char word[64];
        size_t length = 0;
        at = std::find_if(at, end, [](unsigned char c) { return c > ' '; });
        if (at == end)
            return false;
        for (; at<end && * at> ' '; at++)
            if (length + 1 < sizeof(word))
                word[length++] = *at == ',' ? '.' : char(*at); // some countries write a decimal comma
        word[length] = '\0';
        out = strtod(word, nullptr);
        return true;
    }
};

// ---- what is changed

struct changes {
    bool is_far = false, is_cut = false, has_strips = false, has_face_colours = false;
    double origin[3] = {0, 0, 0};
};

bool holds_places(const element &vertices)
{
    return vertices.has({"x", "y", "z"}) && !vertices.has_lists();
}

// Finds out whether floats round the positions too much, and their origin. The first position decides whether the
// others are checked.
void find_far(const head &from, const unsigned char *bytes, size_t size_bytes, changes &out)
{
    constexpr double exact_max = 8192; // floats are a millimetre apart from there on
    const element &vertices = from.elements[0];
    const size_t axes[3] = {vertices.find("x"), vertices.find("y"), vertices.find("z")};
    double lower[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, upper[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    data rows(from, bytes, size_bytes);
    row one;

    if (from.format != "ascii" && bytes_of(vertices.properties[axes[0]].type) < 8)
        return;
    for (uint64_t i = 0; i < vertices.count && rows.next(vertices, one); i++) {
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

// True if the file is truncated, where the library silently shows zeros. Rows of text have a line each.
bool is_short(const head &from, const unsigned char *bytes, size_t size_bytes)
{
    const unsigned char *at = bytes + from.size_bytes, *const end = bytes + size_bytes, *last = at;
    uint64_t stated = 0, lines = 0;
    const element *last_element = nullptr;
    head only = from;
    row one;

    for (const element &of : from.elements) {
        if (of.count > size_bytes) // each row takes a byte at least
            return true;
        stated += of.properties.empty() ? 0 : of.count;
        last_element = of.properties.empty() || of.count == 0 ? last_element : &of;
    }
    if (from.format != "ascii") {
        data rows(from, bytes, size_bytes);
        return !std::all_of(from.elements.begin(), from.elements.end(),
                            [&](const element &of) { return rows.skip(of); });
    }
    while (at < end && lines < stated) {
        const unsigned char *stop = std::find(at, end, '\n');
        lines += std::any_of(at, stop, [](unsigned char c) { return c > ' '; });
        last = at;
        at = stop + (stop < end);
    }
    only.size_bytes = size_t(last - bytes);
    return last_element && (lines < stated || !data(only, bytes, size_bytes).next(*last_element, one));
}

bool can_be_written(const head &from)
{
    return !from.elements.empty() && from.elements[0].name == "vertex" && holds_places(from.elements[0]);
}

changes find_changes(const head &from, const unsigned char *bytes, size_t size_bytes)
{
    const element &vertices = from.elements[0], *faces = from.find("face");
    changes out;

    find_far(from, bytes, size_bytes, out);
    out.is_cut = is_short(from, bytes, size_bytes);
    out.has_strips = from.find("tristrips") != nullptr;
    out.has_face_colours =
        faces && faces->has({"red", "green", "blue"}) && !vertices.has({"red"}) && !faces->has({"texcoord"});
    return out;
}

// ---- the file that is written

struct writer {
    const head &from;
    const changes &what;
    std::vector<row> vertices = {};
    std::string vertex_bytes = {}, face_bytes = {};
    uint64_t vertex_count = 0, face_count = 0;
    bool has_ended = false; // before all data were read

    bool splits() const
    {
        return what.has_face_colours;
    }
};

void write_vertex(writer &w, const row &from, const double *colour)
{
    const element &of = w.from.elements[0];
    const size_t axes[3] = {of.find("x"), of.find("y"), of.find("z")};

    for (size_t i = 0; i < of.properties.size(); i++) {
        const size_t axis = size_t(std::find(axes, axes + 3, i) - axes);
        append(w.vertex_bytes, axis < 3 ? "float" : of.properties[i].type,
               from[i][0] - (axis < 3 ? w.what.origin[axis] : 0));
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

// Writes a strip, which ends at -1; every other triangle of it is reversed.
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

    row one;
    for (uint64_t i = 0; i < of.count && !of.properties.empty() && !w.has_ended; i++) {
        w.has_ended = !rows.next(of, one);
        if (w.has_ended) {
            import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "",
                        "it is cut off: it states %llu elements '%.60s' and has %llu whole ones, which are shown",
                        static_cast<unsigned long long>(of.count), of.name.c_str(),
                        static_cast<unsigned long long>(i));
            break;
        }
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
    if (w.splits())
        out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    if (w.face_count > 0)
        out += "element face " + std::to_string(w.face_count) + "\nproperty list int int vertex_indices\n";
    return out + "end_header\n";
}
} // namespace

std::string mend_ply(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    const head from = read_head(bytes, size_bytes);

    if (!can_be_written(from)) {
        if (is_short(from, bytes, size_bytes))
            fail(r, "", "it is cut off, and its first elements are no vertices with x, y and z");
        return {};
    }
    const changes what = find_changes(from, bytes, size_bytes);
    if (!what.is_far && !what.is_cut && !what.has_strips && !what.has_face_colours)
        return {};
    check_room(r, "", size_bytes, what.has_face_colours ? 32 : 4); // numbers of text become doubles
    std::copy(what.origin, what.origin + 3, r.origin);
    writer w = {from, what};
    data rows(from, bytes, size_bytes);
    for (const element &one : from.elements)
        write_element(r, w, one, rows);
    if (w.has_ended && w.vertex_count == 0 && w.vertices.empty())
        fail(r, "", "the file ends before the end of its first vertex");
    return written_head(w) + w.vertex_bytes + w.face_bytes;
}

bool add_ply_gaussians(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    const head from = read_head(bytes, size_bytes);

    if (!can_be_written(from) || !from.elements[0].has({"f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                                                        "scale_1", "rot_0", "rot_1", "rot_2", "rot_3"}))
        return false;
    const element &of = from.elements[0];
    splats::cloud cloud;
    data rows(from, bytes, size_bytes);
    row one;
    const auto place = [&](const char *name, size_t number) {
        return of.find((name + std::to_string(number)).c_str());
    };
    const size_t at[3] = {of.find("x"), of.find("y"), of.find("z")}, opacity = of.find("opacity"),
                 colours[3] = {place("f_dc_", 0), place("f_dc_", 1), place("f_dc_", 2)},
                 // Flat Gaussians have two
        scales[3] = {place("scale_", 0), place("scale_", 1), place("scale_", 2)},
                 turns[4] = {place("rot_", 1), place("rot_", 2), place("rot_", 3), place("rot_", 0)};

    check_room(r, "", std::min<uint64_t>(of.count, size_bytes), sizeof(splats::gaussian));
    for (uint64_t i = 0; i < of.count && rows.next(of, one); i++) {
        splats::gaussian made = {};
        for (size_t c = 0; c < 3; c++) {
            made.place[c] = float(one[at[c]][0]);
            made.colour[c] = splats::colour_of(one[colours[c]][0]);
            made.deviations[c] = scales[c] == SIZE_MAX ? 0 : float(std::exp(one[scales[c]][0]));
        }
        for (size_t c = 0; c < 4; c++)
            made.rotation[c] = float(one[turns[c]][0]);
        made.opacity = float(1 / (1 + std::exp(-one[opacity][0])));
        cloud.all.push_back(made);
    }
    if (cloud.all.size() < of.count)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "",
                    "it is cut off: it states %llu Gaussians and has %zu whole ones, which are shown",
                    static_cast<unsigned long long>(of.count), cloud.all.size());
    message_set_node set = {};
    set.value.object = splats::add(r, cloud, r.scene->file, "");
    set.value.kind = PROTOCOL_NODE_MESH;
    set.name = r.scene->file;
    import_identity(set.value.parent_from_node);
    if (set.value.object != 0)
        import_add_node(r.scene, &set);
    return true;
}
} // namespace assimp
