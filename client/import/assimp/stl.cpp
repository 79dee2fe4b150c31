// SPDX-License-Identifier: MIT
// STL files that the library takes for the other kind, or refuses without the reason.
#include "reader.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>

namespace assimp
{
namespace
{
constexpr size_t head_bytes = 84, count_at = 80, facet_bytes = 50;

// Text has no zeros; a binary file has some in its head or its first facet.
bool is_binary(const unsigned char *bytes, size_t size_bytes)
{
    return memchr(bytes, 0, std::min<size_t>(size_bytes, 1024)) != nullptr;
}

// Keeps the facets that the file states and has, and nothing behind them.
std::string mend_binary(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    uint32_t stated = 0;

    if (size_bytes < head_bytes)
        fail(r, "", "it is a binary STL file that is cut off within its head: it has %zu of %zu bytes", size_bytes,
             head_bytes);
    memcpy(&stated, bytes + count_at, sizeof(stated));
    const size_t whole = (size_bytes - head_bytes) / facet_bytes;
    const uint32_t used =
        uint32_t(stated == 0 ? std::min<size_t>(whole, UINT32_MAX) : std::min<size_t>(whole, stated));
    if (used == 0 && stated == 0)
        fail(r, "", "it is a binary STL file without facets");
    if (used == 0)
        fail(r, "", "it is a binary STL file that states %u facets, but is cut off before the end of the first",
             stated);
    if (stated == 0)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "", "it states 0 facets; the %u that it has are shown",
                    used);
    else if (used < stated)
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "",
                    "it is cut off: it states %u facets and has %u whole ones, which are shown", stated, used);
    if (used == stated && size_bytes == head_bytes + used * facet_bytes)
        return {};
    std::string out(reinterpret_cast<const char *>(bytes), head_bytes + used * facet_bytes);
    memcpy(&out[count_at], &used, sizeof(used));
    return out;
}

// The corners of text whose words the library does not recognise: other letters, or no facets around them. Three
// make a triangle, whose normal is found later.
std::string from_corners(const unsigned char *bytes, size_t size_bytes)
{
    const char *const end = reinterpret_cast<const char *>(bytes) + size_bytes, word[] = "vertex";
    std::string out(head_bytes, ' ');
    std::vector<float> corners;
    uint32_t count = 0;

    for (const char *at = reinterpret_cast<const char *>(bytes); end - at > 6; at++) {
        if (!std::equal(word, word + 6, at,
                        [](char a, char b) { return a == tolower(static_cast<unsigned char>(b)); }))
            continue;
        at += 6;
        for (int c = 0; c < 3; c++) {
            char number[64];
            size_t length = 0;
            at = std::find_if(at, end, [](char one) { return !isspace(static_cast<unsigned char>(one)); });
            for (; at < end && !isspace(static_cast<unsigned char>(*at)); at++)
                if (length + 1 < sizeof(number))
                    number[length++] = *at == ',' ? '.' : *at;
            number[length] = '\0';
            corners.push_back(float(strtod(number, nullptr)));
        }
        if (corners.size() < 9)
            continue;
        out.append(12, '\0');
        out.append(reinterpret_cast<const char *>(corners.data()), corners.size() * sizeof(float));
        out.append(2, '\0');
        corners.clear();
        count++;
    }
    memcpy(&out[count_at], &count, sizeof(count));
    return count > 0 ? out : std::string();
}
} // namespace

std::string mend_stl(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    if (is_binary(bytes, size_bytes))
        return mend_binary(r, bytes, size_bytes);
    const bool is_usual =
        size_bytes > 5 && memcmp(bytes, "solid", 5) == 0 && memmem(bytes, size_bytes, "facet normal", 12);
    return is_usual ? std::string() : from_corners(bytes, size_bytes);
}
} // namespace assimp
