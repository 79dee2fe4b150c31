// SPDX-License-Identifier: MIT
// The models of a 3MF archive in memory.
#include "reader.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <memory>

#include <expat.h>
#include <minizip/unzip.h>

namespace threemf
{
std::string part_name(const std::string &name)
{
    std::string out = reading::decoded_uri(name);

    for (char &c : out)
        c = c == '\\' ? '/' : char(tolower(static_cast<unsigned char>(c)));
    return out.compare(0, 1, "/") == 0 ? out.substr(1) : out;
}

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

ZPOS64_T report_memory(void *opaque, void *)
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

// The name of the archive's current file.
std::string current_name(unzFile zip)
{
    char name[1024] = "";
    if (unzGetCurrentFileInfo64(zip, nullptr, name, sizeof(name) - 1, nullptr, 0, nullptr, 0) != UNZ_OK)
        return "";
    return name;
}

bool is_model(const std::string &name)
{
    const std::string ending = ".model", part = part_name(name);
    return part.size() > ending.size() && part.compare(part.size() - ending.size(), ending.size(), ending) == 0;
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

struct relations {
    std::string model; // the archive's main model; empty: not stated
};

void XMLCALL on_relation(void *user, const char *, const char **attributes)
{
    std::string &model = static_cast<relations *>(user)->model;
    const std::string ending = "/3dmodel";
    std::string type, target;

    for (; attributes[0]; attributes += 2) {
        if (strcmp(attributes[0], "Type") == 0)
            type = attributes[1];
        if (strcmp(attributes[0], "Target") == 0)
            target = attributes[1];
    }
    if (model.empty() && type.size() >= ending.size() &&
        type.compare(type.size() - ending.size(), ending.size(), ending) == 0)
        model = part_name(target);
}

// Finds the main model: by the archive's relations, else at the usual place, or the only model.
std::string main_model(reader &r, unzFile zip, const std::vector<std::string> &models, uint64_t &left)
{
    relations found;
    const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                         XML_ParserFree);

    if (!parser)
        throw std::bad_alloc();
    XML_SetUserData(parser.get(), &found);
    XML_SetStartElementHandler(parser.get(), on_relation);
    if (unzLocateFile(zip, "_rels/.rels", 2) == UNZ_OK)
        inflate_current(r, zip, "_rels/.rels", left, [&](const char *bytes, size_t size_bytes, bool is_last) {
            XML_Parse(parser.get(), bytes, int(size_bytes), is_last); // a broken file states nothing
        });
    for (const std::string &wanted : {found.model, std::string("3d/3dmodel.model")})
        if (std::find(models.begin(), models.end(), wanted) != models.end())
            return wanted;
    if (models.empty())
        fail(r, "", "it is no 3MF file: there is no model in it");
    if (models.size() > 1)
        fail(r, "", "the 3MF file cannot be read: its relationships name none of its %zu models", models.size());
    return models[0];
}

// Calls `visit` with the name of each file, with the archive positioned at it.
template <typename Visit> void each_file(unzFile zip, Visit visit)
{
    size_t count = 0;

    for (int at = unzGoToFirstFile(zip); at == UNZ_OK && count < files_max; at = unzGoToNextFile(zip), count++)
        visit(current_name(zip));
}
} // namespace

void each_model(reader &r, const unsigned char *bytes, size_t size_bytes,
                const std::function<taker(const std::string &name, bool is_main)> &begin)
{
    memory m = {bytes, size_bytes, 0};
    zlib_filefunc64_def functions = {open_memory, read_memory, write_nothing, report_memory,
                                     seek_memory, do_nothing,  do_nothing,    &m};
    const std::unique_ptr<void, close_archive> zip(unzOpen2_64("", &functions));
    uint64_t left = FILES_BYTES_MAX;
    std::vector<std::string> models;

    if (!zip)
        fail(r, "", "the 3MF file cannot be read: it is no zip archive, or is cut off");
    each_file(zip.get(), [&](const std::string &name) {
        if (is_model(name))
            models.push_back(part_name(name));
    });
    const std::string main = main_model(r, zip.get(), models, left);
    for (const bool is_main : {false, true})
        each_file(zip.get(), [&](const std::string &name) {
            if (is_model(name) && (part_name(name) == main) == is_main)
                inflate_current(r, zip.get(), name, left, begin(name, is_main));
        });
}
} // namespace threemf
