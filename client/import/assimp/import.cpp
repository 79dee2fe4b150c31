// SPDX-License-Identifier: MIT
// Import of files through Assimp.
#include "import.h"
#include "reader.hpp"

#include "protocol/common/srgb.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>

namespace assimp
{
std::string text(const aiString &from)
{
    return {from.data, std::min<size_t>(from.length, sizeof(from.data) - 1)};
}

float linear(float value)
{
    return linear_from_srgb_f(std::min(std::max(value, 0.0f), 1.0f)); // NaN becomes 0
}

namespace
{
// ---- what the library says

const char *const too_large =
    "the file needs more memory than a model may have: it is broken, or should be split into parts";

bool begins(const char *words, const char *with)
{
    return strncmp(words, with, strlen(with)) == 0;
}

// The version of an FBX file, such as 6100 for 6.1: after 23 bytes of a binary file, else stated in the header. 0:
// unknown.
unsigned fbx_version(const unsigned char *bytes, size_t size_bytes)
{
    constexpr size_t version_at = 23;
    const std::string head(reinterpret_cast<const char *>(bytes), std::min<size_t>(size_bytes, 4096));
    const size_t stated = head.find("FBXVersion:");

    if (size_bytes >= version_at + 4 && begins(head.c_str(), "Kaydara FBX Binary"))
        return unsigned(bytes[version_at]) | unsigned(bytes[version_at + 1]) << 8 |
               unsigned(bytes[version_at + 2]) << 16 | unsigned(bytes[version_at + 3]) << 24;
    return stated == std::string::npos ? 0 : unsigned(strtoul(head.c_str() + stated + 11, nullptr, 10));
}

[[noreturn]] void explain(reader &r, const char *said, const unsigned char *bytes, size_t size_bytes)
{
    if (begins(said, "std::bad_alloc") || begins(said, "vector::") || begins(said, "basic_string::"))
        fail(r, "", "%s", too_large);
    if (strstr(said, "old format version")) {
        const unsigned version = fbx_version(bytes, size_bytes);
        fail(r, "",
             "it is an FBX file of version %u.%u, but only 7.1 (FBX 2011) and newer are read: write it again with "
             "a "
             "newer version, as Autodesk's FBX Converter does, or as glTF",
             version / 1000, version / 100 % 10);
    }
    fail(r, "", "the %s file cannot be read: %s; if other programs can, write it with one of them as glTF",
         r.format->name, said[0] != '\0' ? said : "the library does not say why");
}

struct library_scene {
    const struct assimp_library *library;
    void *keep = nullptr;
    ~library_scene()
    {
        if (keep)
            library->release(keep);
    }
};

void import(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    char reason[ASSIMP_REASON_BYTES] = "";
    library_scene owner = {assimp_load(reason)};

    if (!owner.library)
        fail(r, "", "%s", reason);
    check_bytes(r, bytes, size_bytes);
    const bool is_ply = strcmp(r.format->ending, ".ply") == 0;
    if (is_ply && add_ply_gaussians(r, bytes, size_bytes))
        return;
    std::string mended;
    if (strcmp(r.format->ending, ".dae") == 0)
        mended = mend_collada(r, bytes, size_bytes);
    else if (is_ply)
        mended = mend_ply(r, bytes, size_bytes);
    else if (strcmp(r.format->ending, ".stl") == 0)
        mended = mend_stl(r, bytes, size_bytes);
    if (!mended.empty()) {
        bytes = reinterpret_cast<const unsigned char *>(mended.data());
        size_bytes = mended.size();
    }
    r.source = owner.library->read(r.format->ending, r.format, bytes, size_bytes, &owner.keep, reason);
    if (!r.source || !r.source->mRootNode)
        explain(r, reason, bytes, size_bytes);
    add_materials(r);
    add_scene(r);
    add_skins(r);
    add_clips(r);
}
} // namespace
} // namespace assimp

extern "C" bool assimp_import(struct import_scene *scene, struct files *files, const struct assimp_format *format,
                              const unsigned char *bytes, size_t size_bytes)
{
    return reading::run(scene, assimp::too_large, [&] {
        assimp::reader r = {{scene}, files, format};
        assimp::import(r, bytes, size_bytes);
    });
}
