// SPDX-License-Identifier: MIT
// Cryptomatte's identifiers and metadata.
#include "mattes.h"
#include "mattes.hpp"

#include <cstdio>
#include <cstring>
#include <map>
#include <new>

namespace
{

constexpr size_t names_max = size_t(1) << 22; // limit for a scene; our clients send fewer

struct matte {
    std::string name;
    float identifier;
};

uint32_t turned(uint32_t value, unsigned bits)
{
    return value << bits | value >> (32 - bits);
}

// MurmurHash3_x86_32 with seed 0. Appleby. SMHasher. 2011.
uint32_t murmur3(const std::string &text)
{
    uint32_t hash = 0, tail = 0;
    const size_t whole = text.size() / 4 * 4;
    for (size_t i = 0; i < text.size(); i++) {
        tail |= uint32_t(uint8_t(text[i])) << 8 * (i % 4);
        const bool is_last = i + 1 == text.size();
        if (i % 4 != 3 && !is_last)
            continue;
        hash ^= turned(tail * 0xcc9e2d51u, 15) * 0x1b873593u;
        if (i < whole)
            hash = turned(hash, 13) * 5 + 0xe6546b64u;
        tail = 0;
    }
    hash ^= uint32_t(text.size());
    hash = (hash ^ hash >> 16) * 0x85ebca6bu;
    hash = (hash ^ hash >> 13) * 0xc2b2ae35u;
    return hash ^ hash >> 16;
}

// Infinity, NaN and denormal numbers are avoided by flipping the lowest bit of such exponents, as the
// specification demands.
float identifier_of(const std::string &name)
{
    uint32_t bits = murmur3(name);
    const uint32_t exponent = bits >> 23 & 255;
    if (exponent == 0 || exponent == 255)
        bits ^= 1u << 23;
    float identifier;
    std::memcpy(&identifier, &bits, sizeof(identifier));
    return identifier;
}

std::string hex_of(uint32_t value)
{
    char text[9];
    std::snprintf(text, sizeof(text), "%08x", value);
    return text;
}

std::string hex_of(float identifier)
{
    uint32_t bits;
    std::memcpy(&bits, &identifier, sizeof(bits));
    return hex_of(bits);
}

// Quotes a string for JSON; bytes above 127 are kept, as names are UTF-8.
std::string quoted(const std::string &text)
{
    std::string out = "\"";
    for (const char c : text) {
        char escaped[8];
        std::snprintf(escaped, sizeof(escaped), "\\u%04x", uint8_t(c));
        if (uint8_t(c) < 0x20)
            out += escaped;
        else
            out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    }
    return out + "\"";
}

} // namespace

struct mattes {
    std::map<uint32_t, matte> objects, materials;
};

bool mattes_name(struct mattes **mattes, const struct message_export_name *name)
{
    if (!*mattes)
        *mattes = new (std::nothrow) struct mattes;
    const bool is_node = name->kind == PROTOCOL_OBJECT_NODE;
    if (!*mattes || (!is_node && name->kind != PROTOCOL_OBJECT_MATERIAL))
        return false;
    auto &names = is_node ? (*mattes)->objects : (*mattes)->materials;
    try {
        if (names.size() < names_max)
            names[name->object] = {name->name, identifier_of(name->name)};
        return names.size() < names_max;
    } catch (const std::bad_alloc &) {
        return false;
    }
}

void mattes_destroy(struct mattes *mattes)
{
    delete mattes;
}

float matte_identifier(const struct mattes *mattes, enum protocol_object_kind kind, uint32_t object)
{
    if (!mattes)
        return 0;
    const auto &names = kind == PROTOCOL_OBJECT_NODE ? mattes->objects : mattes->materials;
    const auto found = names.find(object);
    return found != names.end() ? found->second.identifier : 0;
}

static std::string manifest_of(const std::map<uint32_t, matte> &names)
{
    std::string manifest;
    for (const auto &each : names)
        manifest += (manifest.empty() ? "{" : ",") + quoted(each.second.name) + ":\"" +
                    hex_of(each.second.identifier) + "\"";
    return manifest.empty() ? "{}" : manifest + "}";
}

std::vector<metadata_entry> matte_metadata(const struct mattes *mattes, unsigned layers)
{
    const struct {
        enum protocol_layer layer;
        const char *name;
        std::string manifest;
    } kinds[] = {{PROTOCOL_LAYER_CRYPTO_OBJECT0, "CryptoObject",
                  manifest_of(mattes ? mattes->objects : std::map<uint32_t, matte>())},
                 {PROTOCOL_LAYER_CRYPTO_MATERIAL0, "CryptoMaterial",
                  manifest_of(mattes ? mattes->materials : std::map<uint32_t, matte>())}};
    std::vector<metadata_entry> entries;
    for (const auto &kind : kinds) {
        if ((layers >> kind.layer & 7u) == 0)
            continue;
        const std::string key = "cryptomatte/" + hex_of(murmur3(kind.name)).substr(0, 7) + "/";
        entries.push_back({key + "name", kind.name, false, 0});
        entries.push_back({key + "hash", "MurmurHash3_32", false, 0});
        entries.push_back({key + "conversion", "uint32_to_float32", false, 0});
        entries.push_back({key + "manifest", kind.manifest, false, 0});
    }
    return entries;
}
