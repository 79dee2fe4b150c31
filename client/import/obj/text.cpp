// SPDX-License-Identifier: MIT
// Mending of OBJ text, and scanning of statements that tinyobjloader does not report.
#include "reader.hpp"
#include "import/model/origin.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace obj
{
namespace
{
bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

void append_utf8(std::string &out, uint32_t code)
{
    if (code < 0x80) {
        out += char(code);
    } else if (code < 0x800) {
        out += char(0xc0 | (code >> 6));
        out += char(0x80 | (code & 0x3f));
    } else {
        out += char(0xe0 | (code >> 12));         // code points beyond 0xffff are two surrogates and become
        out += char(0x80 | ((code >> 6) & 0x3f)); // two odd characters; they can only occur in names
        out += char(0x80 | (code & 0x3f));
    }
}

std::string from_utf16(const unsigned char *bytes, size_t size_bytes, bool big_endian)
{
    std::string out;
    out.reserve(size_bytes / 2);
    for (size_t i = 2; i + 1 < size_bytes; i += 2)
        append_utf8(out,
                    big_endian ? uint32_t(bytes[i]) << 8 | bytes[i + 1] : uint32_t(bytes[i + 1]) << 8 | bytes[i]);
    return out;
}

// Joins lines that end with a backslash.
void join_lines(std::string &text)
{
    for (size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
        const size_t end = text.find_first_not_of(" \t\r", at + 1);
        if (end != std::string::npos && text[end] == '\n')
            std::fill(text.begin() + std::ptrdiff_t(at), text.begin() + std::ptrdiff_t(end) + 1, ' ');
    }
}

bool has_continued_line(const char *begin, const char *end)
{
    while ((begin = static_cast<const char *>(memchr(begin, '\\', size_t(end - begin)))) != nullptr) {
        const char *next = begin + 1;
        while (next < end && (is_blank(*next) || *next == '\r'))
            next++;
        if (next < end && *next == '\n')
            return true;
        begin++;
    }
    return false;
}

bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

// Finds 1.#IND, 1.#QNAN and 1.#INF of older Windows programs by their '#'; tinyobjloader reads 1.
bool is_windows_nan(const char *begin, const char *at, const char *end)
{
    return *at == '#' && at - begin >= 2 && memcmp(at - 2, "1.", 2) == 0 && at + 1 < end && strchr("IQS", at[1]);
}

// Mends a line. Corners such as 1/2/ lose the useless slash: tinyobjloader takes the next corner's number for
// their normal's. Numbers with a decimal comma, as some countries write them, get a point.
void mend_line(char *at, char *end)
{
    while (at < end && is_blank(*at))
        at++;
    const bool is_face = end - at > 2 && at[0] == 'f' && is_blank(at[1]), is_vertex = end - at > 2 && at[0] == 'v';
    for (char *one = end - 1; is_face && one > at; one--)
        if (*one == '/' && (one + 1 == end || is_blank(one[1])))
            *one = ' ';
    for (char *one = at + 1; is_vertex && one + 1 < end; one++)
        if (*one == ',' && is_digit(one[-1]) && is_digit(one[1]))
            *one = '.';
        else if (is_windows_nan(at, one, end))
            memcpy(one - 2, "nan", 3);
}

void mend_lines(std::string &text)
{
    for (size_t at = 0; at < text.size();) {
        const size_t stop = std::min(text.find_first_of("\r\n", at), text.size());
        mend_line(&text[at], &text[0] + stop);
        at = stop + 1;
    }
}

// True for a slash at the end of a corner, a comma between digits, or a NaN of Windows.
bool has_odd_numbers(const char *begin, const char *end)
{
    for (const char *at = begin; at + 1 < end; at++)
        if ((*at == '/' && (is_blank(at[1]) || at[1] == '\r' || at[1] == '\n')) ||
            (*at == ',' && at > begin && is_digit(at[-1]) && is_digit(at[1])) || is_windows_nan(begin, at, end))
            return true;
    return begin < end && end[-1] == '/';
}

struct scan {
    reader &r;
    prepared &out;
    size_t line = 0;
    size_t vertices = 0;
    std::string material = {};
};

// Floats are a millimetre apart from here on.
constexpr double exact_max = 8192;

// Stores a position in doubles, if the first vertex needs them.
void keep_place(scan &s, const char *const *starts, size_t count)
{
    double place[3] = {0, 0, 0};

    if (s.vertices > 1 && s.out.places.empty())
        return;
    for (size_t c = 0; c < 3 && c < count; c++)
        place[c] = strtod(starts[c], nullptr);
    if (s.vertices > 1 || std::any_of(place, place + 3, [](double value) { return std::fabs(value) > exact_max; }))
        s.out.places.insert(s.out.places.end(), place, place + 3);
}

// Drops positions that floats hold well enough, or that surround the origin; the library's are used then.
void settle_places(prepared &out)
{
    double lower[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, upper[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

    for (size_t i = 0; i < out.places.size(); i++) {
        lower[i % 3] = std::min(lower[i % 3], out.places[i]);
        upper[i % 3] = std::max(upper[i % 3], out.places[i]);
    }
    if (!import_find_origin(lower, upper, out.origin))
        out.places.clear();
}

// Reads up to six numbers of a `v` line. tinyobjloader would read 0 for an invalid number, which must not be
// shown.
bool scan_vertex(scan &s, const char *at, const char *end)
{
    double values[6] = {0, 0, 0, 1, 1, 1};
    const char *starts[6];
    size_t count = 0;

    while (at < end && count < 6) {
        while (at < end && is_blank(*at))
            at++;
        if (at == end)
            break;
        starts[count] = at;
        for (; at < end && !is_blank(*at); at++) {
            const char c = *at;
            if (is_digit(c))
                continue;
            if (c != '.' && c != '-' && c != '+' && c != 'e' && c != 'E') {
                // The file is followed by a NUL, so strtod() ends.
                const double value = strtod(starts[count], nullptr);
                const std::string place = "line " + std::to_string(s.line),
                                  token(starts[count], std::find_if(at, end, is_blank));
                if (!std::isfinite(value))
                    return import_fail(s.r.scene, place.c_str(), "'%.20s' is not a finite number", token.c_str());
                if (count < 3)
                    import_note(s.r.scene, PROTOCOL_SEVERITY_WARNING, place.c_str(),
                                "a coordinate that is not a number was read up to the first wrong character");
            }
        }
        count++;
    }
    s.vertices++;
    keep_place(s, starts, count);
    if (count < 6 && s.out.colours.empty())
        return true;
    for (size_t i = 3; i < count && count == 6; i++)
        values[i] = strtod(starts[i], nullptr);
    s.out.colours.resize((s.vertices - 1) * 3, 1); // colours of the vertices before the first coloured one
    for (size_t i = 3; i < 6; i++)
        s.out.colours.push_back(float(values[i]));
    return true;
}

// Checks a face; the library would store all corners before it reports the face.
bool scan_face(scan &s, const char *at, const char *end)
{
    size_t corners = 0;

    if (size_t(end - at) < 2 * size_t(POLYGON_CORNERS_MAX))
        return true; // each corner takes a digit and a blank
    for (bool in_corner = false; at < end; at++) {
        corners += !in_corner && !is_blank(*at);
        in_corner = !is_blank(*at);
    }
    return corners <= POLYGON_CORNERS_MAX ||
           import_fail(s.r.scene, ("line " + std::to_string(s.line)).c_str(),
                       "a polygon of %zu corners; 3 to %u are allowed", corners, POLYGON_CORNERS_MAX);
}

// Reads vertices, each with or without texture coordinates after a slash: 1 2 3, 1/1 2/2, -2 -1.
bool scan_polyline(scan &s, const char *at, const char *end)
{
    std::vector<line_run> &lines = s.out.lines;
    uint32_t before = 0;

    if (lines.empty() || lines.back().material != s.material)
        lines.push_back({s.material, {}});
    for (size_t count = 0;; count++) {
        at = std::find_if_not(at, end, is_blank);
        if (at == end)
            return true;
        const long long index = strtoll(at, nullptr, 10),
                        vertex = index > 0 ? index - 1 : static_cast<long long>(s.vertices) + index;
        if (index == 0 || vertex < 0 || vertex >= static_cast<long long>(s.vertices))
            return import_fail(s.r.scene, ("line " + std::to_string(s.line)).c_str(),
                               "vertex %lld does not exist; there are %zu so far", index, s.vertices);
        if (count > 0)
            lines.back().ends.insert(lines.back().ends.end(), {before, uint32_t(vertex)});
        before = uint32_t(vertex);
        at = std::find_if(at, end, is_blank);
    }
}

bool scan_line(scan &s, const char *at, const char *end)
{
    while (at < end && is_blank(*at))
        at++;
    if (end - at < 2)
        return true;
    if (at[0] == 'v' && is_blank(at[1]))
        return scan_vertex(s, at + 2, end);
    if (at[0] == 'f' && is_blank(at[1]))
        return scan_face(s, at + 2, end);
    s.out.has_points = s.out.has_points || (at[0] == 'p' && is_blank(at[1]));
    if (at[0] == 'l' && is_blank(at[1]))
        return scan_polyline(s, at + 2, end);
    if (end - at > 7 && memcmp(at, "usemtl", 6) == 0 && is_blank(at[6]))
        s.material.assign(std::find_if_not(at + 7, end, is_blank), end);
    if (end - at > 7 && memcmp(at, "mtllib", 6) == 0 && is_blank(at[6])) {
        const char *from = at + 7, *to = end;
        while (from < to && is_blank(*from))
            from++;
        while (to > from && is_blank(to[-1]))
            to--;
        if (from < to)
            s.out.libraries.push_back(std::string(from, to));
    }
    return true;
}

bool scan_lines(scan &s, const char *at, const char *end)
{
    while (at < end) {
        const char *stop = static_cast<const char *>(memchr(at, '\n', size_t(end - at)));
        const char *next = stop ? stop + 1 : end;
        if (!stop)
            stop = end;
        s.line++;
        // A lone carriage return ends a line, too.
        for (const char *part = at; part < stop;) {
            const char *part_end = static_cast<const char *>(memchr(part, '\r', size_t(stop - part)));
            if (!part_end)
                part_end = stop;
            if (!scan_line(s, part, part_end))
                return false;
            part = part_end + 1;
        }
        at = next;
    }
    return true;
}
} // namespace

std::string memory_stream::place() const
{
    const std::ptrdiff_t lines = std::count(eback(), gptr(), '\n');
    return "line " + std::to_string(std::max<std::ptrdiff_t>(lines, 1));
}

prepared prepare(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    prepared out = {reinterpret_cast<const char *>(bytes), size_bytes, {}, {}, {}, {}, {}, false, {}};

    if (size_bytes >= 2 && ((bytes[0] == 0xfe && bytes[1] == 0xff) || (bytes[0] == 0xff && bytes[1] == 0xfe)))
        out.mended = from_utf16(bytes, size_bytes, bytes[0] == 0xfe);
    else if (size_bytes >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0)
        out.mended.assign(out.original + 3, size_bytes - 3);
    if (has_continued_line(out.begin(), out.begin() + out.size_bytes())) {
        if (out.mended.empty())
            out.mended.assign(out.original, size_bytes);
        join_lines(out.mended);
    }
    if (has_odd_numbers(out.begin(), out.begin() + out.size_bytes())) {
        if (out.mended.empty())
            out.mended.assign(out.original, size_bytes);
        mend_lines(out.mended);
    }
    scan s = {r, out};
    scan_lines(s, out.begin(), out.begin() + out.size_bytes());
    settle_places(out);
    return out;
}
} // namespace obj
