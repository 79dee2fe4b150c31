// SPDX-License-Identifier: MIT
// Checks of files in advance, against faults that make the library loop, exhaust memory or read beyond its lines.
#include "reader.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>

namespace assimp
{
namespace
{
constexpr size_t head_max = 1 << 16;

bool is_type(const char *word)
{
    static const char *const types[] = {"char",  "uchar",  "short",   "ushort", "int",   "uint",
                                        "float", "double", "int8",    "uint8",  "int16", "uint16",
                                        "int32", "uint32", "float32", "float64"};
    return std::any_of(std::begin(types), std::end(types),
                       [&](const char *type) { return strcmp(word, type) == 0; });
}

// Checks a line of a PLY file's header.
void check_ply_line(reader &r, const std::string &line, const std::string &where)
{
    char words[5][64] = {};
    const int found =
        sscanf(line.c_str(), "%63s %63s %63s %63s %63s", words[0], words[1], words[2], words[3], words[4]);
    const std::string first = words[0];
    const bool is_list = strcmp(words[1], "list") == 0;

    if (first == "comment" || first == "obj_info" || (first == "format" && found == 3))
        return;
    if (first == "element" && found == 3 && isdigit(static_cast<unsigned char>(words[2][0])))
        return;
    if (first != "property" || found != (is_list ? 5 : 3) || !is_type(is_list ? words[2] : words[1]) ||
        (is_list && !is_type(words[3])))
        fail(r, where, "'%.40s' is no statement of a PLY file's head", line.c_str());
}

void check_ply(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    const std::string head(reinterpret_cast<const char *>(bytes), std::min(size_bytes, head_max));
    size_t at = 0;

    for (unsigned number = 1;; number++) {
        const size_t stop = head.find_first_of("\r\n", at);
        if (stop == std::string::npos)
            fail(r, "", "the head of the PLY file does not end within %zu bytes", head.size());
        const size_t last =
            stop > at ? head.find_last_not_of(" \t", stop - 1) : std::string::npos; // exporters leave blanks
        const std::string line = last == std::string::npos || last < at ? "" : head.substr(at, last + 1 - at);
        const std::string where = "line " + std::to_string(number);
        at = stop + (head.compare(stop, 2, "\r\n") == 0 ? 2 : 1);
        if (line == "end_header")
            return;
        if (number > 1)
            check_ply_line(r, line, where);
        else if (line != "ply")
            fail(r, "", "a PLY file begins with the line 'ply'");
    }
}

// The library cuts lines where its buffer ends, and continues to read behind it.
void check_off(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    constexpr size_t line_max = 4000;
    const unsigned char *const end = bytes + size_bytes;

    for (const unsigned char *at = bytes; at < end;) {
        const void *found = memchr(at, '\n', size_t(end - at));
        const unsigned char *stop = found ? static_cast<const unsigned char *>(found) : end;
        if (size_t(stop - at) > line_max)
            fail(r, "",
                 "a line of %zu characters; up to %zu are allowed: that is a polygon of some hundred corners",
                 size_t(stop - at), line_max);
        at = stop + 1;
    }
}
// Checks the depth of elements: the library is recursive and would exhaust its stack.
void check_xml(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    constexpr size_t depth_max = 2000;
    const unsigned char *const end = bytes + size_bytes;
    size_t depth = 0;

    for (const unsigned char *at = bytes; at < end; at++) {
        if (*at == '<' && end - at >= 4 && memcmp(at, "<!--", 4) == 0) {
            const void *stop = memmem(at, size_t(end - at), "-->", 3);
            if (!stop)
                return;
            at = static_cast<const unsigned char *>(stop);
        } else if (*at == '<' && end - at >= 2 && at[1] == '/') {
            depth -= depth > 0;
        } else if (*at == '<' && end - at >= 2 && at[1] != '!' && at[1] != '?') {
            depth++;
        } else if (*at == '/' && end - at >= 2 && at[1] == '>') {
            depth -= depth > 0;
        }
        if (depth > depth_max)
            fail(r, "", "elements are nested more than %zu deep", depth_max);
    }
}
} // namespace

void check_bytes(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    if (strcmp(r.format->ending, ".ply") == 0)
        check_ply(r, bytes, size_bytes);
    if (strcmp(r.format->ending, ".off") == 0)
        check_off(r, bytes, size_bytes);
    if (strcmp(r.format->ending, ".dae") == 0 || strcmp(r.format->ending, ".x3d") == 0)
        check_xml(r, bytes, size_bytes);
}
} // namespace assimp
