// SPDX-License-Identifier: MIT
// The models of a 3MF archive, whose bytes are in memory already.
#include "threemf.hpp"

#include <algorithm>
#include <cstring>
#include <memory>

#include <minizip/unzip.h>

namespace threemf
{
namespace
{
constexpr size_t part_bytes = 1 << 16;
constexpr size_t files_max = 65536;

struct memory {
    const unsigned char *bytes;
    uint64_t size_bytes, at;
};

void *open_memory(void *memory, const void *, int)
{
    return memory;
}

uLong read_memory(void *opaque, void *, void *to, uLong count)
{
    memory &m = *static_cast<memory *>(opaque);
    const uint64_t taken = std::min<uint64_t>(count, m.size_bytes - m.at);
    memcpy(to, m.bytes + m.at, taken);
    m.at += taken;
    return uLong(taken);
}

uLong write_nothing(void *, void *, const void *, uLong)
{
    return 0;
}

ZPOS64_T tell_memory(void *opaque, void *)
{
    return static_cast<memory *>(opaque)->at;
}

long seek_memory(void *opaque, void *, ZPOS64_T offset, int origin)
{
    memory &m = *static_cast<memory *>(opaque);
    const uint64_t from = origin == ZLIB_FILEFUNC_SEEK_SET   ? 0
                          : origin == ZLIB_FILEFUNC_SEEK_CUR ? m.at
                                                             : m.size_bytes;
    if (offset > m.size_bytes - from)
        return -1;
    m.at = from + offset;
    return 0;
}

int do_nothing(void *, void *)
{
    return 0;
}

struct close_archive {
    void operator()(void *zip) const
    {
        unzClose(zip);
    }
};

// Of the file where the archive stands.
std::string current_name(unzFile zip)
{
    char name[1024] = "";
    if (unzGetCurrentFileInfo64(zip, nullptr, name, sizeof(name) - 1, nullptr, 0, nullptr, 0) != UNZ_OK)
        return "";
    return name[0] == '/' ? name + 1 : name;
}

bool is_model(const std::string &name)
{
    const std::string ending = ".model";
    return name.size() > ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

template <typename Take>
void inflate_current(reader &r, unzFile zip, const std::string &name, uint64_t &left, Take take)
{
    std::vector<char> part(part_bytes);
    int got = 1;

    if (unzOpenCurrentFile(zip) != UNZ_OK)
        fail(r, name, "the 3MF file cannot be read: '%.100s' is packed in a way that is not known", name.c_str());
    while (got > 0) {
        got = unzReadCurrentFile(zip, part.data(), unsigned(part.size()));
        if (got < 0)
            fail(r, name, "the 3MF file cannot be read: '%.100s' is broken", name.c_str());
        if (uint64_t(got) > left)
            fail(r, name, "the models in the 3MF file are larger than %llu MiB", FILES_BYTES_MAX >> 20);
        left -= uint64_t(got);
        take(part.data(), size_t(got), got == 0);
    }
    if (unzCloseCurrentFile(zip) != UNZ_OK)
        fail(r, name, "the 3MF file cannot be read: the checksum of '%.100s' is wrong", name.c_str());
}

// By the archive's relations; the usual place where they do not say.
std::string main_model(reader &r, unzFile zip, uint64_t &left)
{
    std::string relations;

    if (unzLocateFile(zip, "_rels/.rels", 2) != UNZ_OK)
        fail(r, "", "it is no 3MF file: there is no '_rels/.rels' in it");
    inflate_current(r, zip, "_rels/.rels", left, [&](const char *bytes, size_t size_bytes, bool) {
        relations.append(bytes, std::min(size_bytes, part_bytes));
    });
    const size_t kind = relations.find("/3dmodel\""), begin = relations.rfind('<', kind);
    const std::string target = "Target=\"";
    const size_t at = kind == std::string::npos ? kind : relations.find(target, begin);
    if (at == std::string::npos || at > relations.find('>', kind))
        return "3D/3dmodel.model";
    const size_t name = at + target.size();
    const std::string found = relations.substr(name, relations.find('"', name) - name);
    return found.compare(0, 1, "/") == 0 ? found.substr(1) : found;
}
} // namespace

void each_model(reader &r, const unsigned char *bytes, size_t size_bytes,
                const std::function<taker(const std::string &name, bool is_main)> &begin)
{
    memory m = {bytes, size_bytes, 0};
    zlib_filefunc64_def functions = {open_memory, read_memory, write_nothing, tell_memory,
                                     seek_memory, do_nothing,  do_nothing,    &m};
    const std::unique_ptr<void, close_archive> zip(unzOpen2_64("", &functions));
    uint64_t left = FILES_BYTES_MAX;
    size_t count = 0;

    if (!zip)
        fail(r, "", "the 3MF file cannot be read: it is no zip archive, or is cut off");
    const std::string main = main_model(r, zip.get(), left);
    for (int at = unzGoToFirstFile(zip.get()); at == UNZ_OK && count < files_max;
         at = unzGoToNextFile(zip.get()), count++) {
        const std::string name = current_name(zip.get());
        if (is_model(name) && name != main)
            inflate_current(r, zip.get(), name, left, begin(name, false));
    }
    if (unzLocateFile(zip.get(), main.c_str(), 2) != UNZ_OK &&
        unzLocateFile(zip.get(), ("/" + main).c_str(), 2) != UNZ_OK)
        fail(r, "", "the 3MF file cannot be read: its model '%.100s' is not in it", main.c_str());
    inflate_current(r, zip.get(), main, left, begin(main, true));
}
} // namespace threemf
