// SPDX-License-Identifier: MIT
// Loading of files into tinygltf's structures: input that would harm the parser is rejected in advance.
#include "reader.hpp"

#include <algorithm>
#include <cstring>

namespace gltf
{
namespace
{
constexpr size_t json_depth_max = 256;
constexpr size_t json_bytes_max = 1u << 30;

uint32_t u32_at(const unsigned char *bytes)
{
    return uint32_t(bytes[0]) | uint32_t(bytes[1]) << 8 | uint32_t(bytes[2]) << 16 | uint32_t(bytes[3]) << 24;
}

// The parser is recursive and needs stack for every level, so the depth is counted in advance without recursion.
void check_json_depth(reader &r, const unsigned char *json, size_t size_bytes)
{
    size_t depth = 0;
    bool in_string = false;

    if (size_bytes > json_bytes_max)
        fail(r, "", "the JSON part is larger than %zu MiB", json_bytes_max >> 20);
    for (size_t i = 0; i < size_bytes; i++) {
        const unsigned char c = json[i];
        if (in_string) {
            if (c == '\\')
                i++;
            else if (c == '"')
                in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            if (++depth > json_depth_max)
                fail(r, "", "the JSON is nested more than %zu deep, at byte %zu", json_depth_max, i);
        } else if ((c == ']' || c == '}') && depth > 0) {
            depth--;
        }
    }
}

// Finds the JSON chunk and the binary chunk, in place; the rest of the file is skipped.
struct chunks {
    const unsigned char *json = nullptr, *binary = nullptr;
    size_t json_bytes = 0, binary_bytes = 0;
};

chunks cut_binary(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    chunks result;

    if (size_bytes < 20)
        fail(r, "", "the file is cut off within its header: %zu bytes", size_bytes);
    const uint32_t version = u32_at(bytes + 4), length = u32_at(bytes + 8);
    if (version != 2)
        fail(r, "", "binary glTF of version %u is not supported; use version 2", version);
    if (length > size_bytes || length < 20)
        fail(r, "", "the header states %u bytes, the file has %zu", length, size_bytes);
    for (size_t at = 12; length - at >= 8;) {
        const uint32_t chunk = u32_at(bytes + at), type = u32_at(bytes + at + 4);
        at += 8;
        if (chunk > length - at)
            fail(r, "", "the chunk at byte %zu states %u bytes, %zu are left", at - 8, chunk, length - at);
        if (at == 20 && type != 0x4e4f534a)
            fail(r, "", "the first chunk is not JSON");
        if (at == 20) {
            result.json = bytes + at;
            result.json_bytes = chunk;
        } else if (type == 0x004e4942 && !result.binary) {
            result.binary = bytes + at;
            result.binary_bytes = chunk;
        }
        at += std::min<size_t>((size_t(chunk) + 3) & ~size_t(3), length - at);
    }
    return result;
}

// Rebuilds a binary file with two adjacent chunks of whole words, as tinygltf requires; most files have this form.
std::vector<unsigned char> rebuild_binary(const chunks &parts)
{
    const size_t json_bytes = (parts.json_bytes + 3) & ~size_t(3),
                 binary_bytes = (parts.binary_bytes + 3) & ~size_t(3);
    const size_t total = 20 + json_bytes + (binary_bytes > 0 ? 8 + binary_bytes : 0);
    std::vector<unsigned char> out(total, 0);
    const auto put = [&out](size_t at, size_t value) {
        for (size_t i = 0; i < 4; i++)
            out[at + i] = static_cast<unsigned char>(value >> (8 * i));
    };
    memcpy(out.data(), "glTF", 4);
    put(4, 2);
    put(8, total);
    put(12, json_bytes);
    put(16, 0x4e4f534a);
    memset(out.data() + 20, ' ', json_bytes);
    memcpy(out.data() + 20, parts.json, parts.json_bytes);
    if (binary_bytes > 0) {
        put(20 + json_bytes, binary_bytes);
        put(24 + json_bytes, 0x004e4942);
        memcpy(out.data() + 28 + json_bytes, parts.binary, parts.binary_bytes);
    }
    return out;
}

// ---- callbacks of tinygltf

bool file_exists(const std::string &, void *)
{
    return true; // reading the file decides
}

std::string expand_path(const std::string &path, void *)
{
    return path;
}

int base64_value(char c)
{
    return c >= 'A' && c <= 'Z'   ? c - 'A'
           : c >= 'a' && c <= 'z' ? c - 'a' + 26
           : c >= '0' && c <= '9' ? c - '0' + 52
           : c == '+'             ? 62
           : c == '/'             ? 63
                                  : -1;
}

// Decodes data URIs whose media type tinygltf does not know, and which it therefore takes for file names.
bool read_data_uri(std::vector<unsigned char> *out, std::string *error, const std::string &uri)
{
    const size_t comma = uri.find(',');
    const std::string ending = ";base64";
    uint32_t bits = 0;
    int count = 0;

    if (comma == std::string::npos) {
        *error += "a data URI without a comma";
        return false;
    }
    if (comma < ending.size() || uri.compare(comma - ending.size(), ending.size(), ending) != 0) {
        out->assign(uri.begin() + std::ptrdiff_t(comma) + 1, uri.end()); // percent signs are resolved already
        return true;
    }
    for (size_t i = comma + 1; i < uri.size() && uri[i] != '='; i++) {
        const int value = base64_value(uri[i]);
        if (value < 0) {
            *error += "a data URI with characters that are not base64";
            return false;
        }
        bits = bits << 6 | uint32_t(value);
        count += 6;
        if (count >= 8) {
            count -= 8;
            out->push_back(static_cast<unsigned char>(bits >> count));
        }
    }
    return true;
}

bool read_file(std::vector<unsigned char> *out, std::string *error, const std::string &path, void *user)
{
    reader &r = *static_cast<reader *>(user);
    if (path.compare(0, 5, "data:") == 0)
        return read_data_uri(out, error, path);
    char reason[FILES_REASON_BYTES] = "";
    size_t size_bytes = 0;
    unsigned char *bytes = files_read(r.files, path.c_str(), &size_bytes, reason);
    const auto raw = r.raw_names.find(path);

    if (!bytes && raw != r.raw_names.end())
        bytes = files_read(r.files, raw->second.c_str(), &size_bytes, reason);
    if (!bytes) {
        if (error)
            *error += "'" + path + "' " + reason + "\n";
        return false;
    }
    try {
        const auto cut = r.buffer_sizes.find(path);
        if (cut != r.buffer_sizes.end())
            size_bytes = std::min(size_bytes, cut->second);
        out->assign(bytes, bytes + size_bytes);
    } catch (...) {
        free(bytes);
        throw;
    }
    free(bytes);
    return true;
}

// Keeps the encoded bytes of images outside of buffers; images in buffers are found there later.
bool keep_image(tinygltf::Image *image, const int, std::string *, std::string *, int, int,
                const unsigned char *bytes, int size, void *)
{
    image->as_is = true;
    if (image->bufferView < 0 && bytes && size > 0)
        image->image.assign(bytes, bytes + size);
    return true;
}

std::string one_line(std::string text)
{
    std::replace(text.begin(), text.end(), '\n', ' ');
    while (!text.empty() && text.back() == ' ')
        text.pop_back();
    // A data URI is unreadable, so it is cut.
    const size_t data = text.find("data:");
    if (data != std::string::npos && text.size() - data > 60)
        text = text.substr(0, data + 40) + "..";
    return text;
}

// Contents of buffers end up in a scene that others may see, so other kinds of files are refused.
void check_buffers(reader &r)
{
    for (size_t i = 0; i < r.model.buffers.size(); i++) {
        const tinygltf::Buffer &buffer = r.model.buffers[i];
        const char *kind = nullptr;
        if (!buffer.uri.empty() && buffer.uri.compare(0, 5, "data:") != 0 &&
            !files_is_buffer(buffer.data.data(), buffer.data.size(), &kind))
            fail(r, place("buffers", i),
                 "'%.200s' is %s; a buffer must hold vertices and other data in binary form", buffer.uri.c_str(),
                 kind);
    }
}

void check_version(reader &r)
{
    const std::string &version = r.model.asset.version, &minimum = r.model.asset.minVersion;

    if (version.compare(0, 2, "2.") != 0)
        fail(r, "asset", "glTF version '%.32s' is not supported; use 2.0", version.c_str());
    if (!minimum.empty() && minimum != "2.0")
        fail(r, "asset", "the file needs glTF version '%.32s'; only 2.0 is supported", minimum.c_str());
}
} // namespace

std::string place(const char *array, size_t index)
{
    return std::string(array) + "[" + std::to_string(index) + "]";
}

namespace
{
// A file may be longer than its buffer (section 3.6.1), which tinygltf refuses; its message contains the size, to
// which the next attempt limits the buffer. False: the error is another one.
bool learn_buffer_size(reader &r, const std::string &error)
{
    const std::string begin = "File size mismatch : ", middle = ", requestedBytes ", end = ", but got ";
    const size_t from = error.find(begin), to = error.rfind(middle), got = error.rfind(end);

    if (from == std::string::npos || to == std::string::npos || got == std::string::npos || got < to)
        return false;
    const std::string path = error.substr(from + begin.size(), to - from - begin.size());
    const unsigned long long wanted = strtoull(error.c_str() + to + middle.size(), nullptr, 10);
    const unsigned long long present = strtoull(error.c_str() + got + end.size(), nullptr, 10);
    return wanted < present && r.buffer_sizes.emplace(path, size_t(wanted)).second;
}

bool load_once(reader &r, const unsigned char *bytes, size_t size_bytes, bool binary, std::string &error)
{
    tinygltf::TinyGLTF loader;
    std::string warning;

    r.model = tinygltf::Model();
    error.clear();
    loader.SetFsCallbacks({file_exists, expand_path, read_file, nullptr, &r});
    loader.SetImageLoader(keep_image, &r);
    if (binary)
        return loader.LoadBinaryFromMemory(&r.model, &error, &warning, bytes, unsigned(size_bytes));
    return loader.LoadASCIIFromString(&r.model, &error, &warning, reinterpret_cast<const char *>(bytes),
                                      unsigned(size_bytes), "");
}
} // namespace

void load(reader &r, const unsigned char *bytes, size_t size_bytes)
{
    const bool binary = size_bytes >= 4 && memcmp(bytes, "glTF", 4) == 0;
    std::vector<unsigned char> rebuilt;
    std::string error, completed;

    if (binary) {
        chunks parts = cut_binary(r, bytes, size_bytes);
        check_json_depth(r, parts.json, parts.json_bytes);
        completed = complete_json(r, parts.json, parts.json_bytes, binary);
        if (!completed.empty()) {
            parts.json = reinterpret_cast<const unsigned char *>(completed.data());
            parts.json_bytes = completed.size();
        }
        if (!completed.empty() || parts.json_bytes % 4 != 0 || parts.binary_bytes % 4 != 0 ||
            parts.binary_bytes == 0 || parts.binary != parts.json + parts.json_bytes + 8) {
            rebuilt = rebuild_binary(parts);
            bytes = rebuilt.data();
            size_bytes = rebuilt.size();
        }
    } else {
        check_json_depth(r, bytes, size_bytes);
        completed = complete_json(r, bytes, size_bytes, binary);
        if (!completed.empty()) {
            bytes = reinterpret_cast<const unsigned char *>(completed.data());
            size_bytes = completed.size();
        }
    }
    bool loaded = load_once(r, bytes, size_bytes, binary, error);
    for (int again = 0; !loaded && again < 16 && learn_buffer_size(r, error); again++)
        loaded = load_once(r, bytes, size_bytes, binary, error);
    check_required_extensions(r); // an unknown extension explains a failure better than the parser's error
    if (!loaded)
        fail(r, "", "%s", error.empty() ? "the file cannot be parsed" : one_line(error).substr(0, 400).c_str());
    if (!error.empty()) // the parser continued after an error
        import_note(r.scene, PROTOCOL_SEVERITY_WARNING, "", "%s", one_line(error).substr(0, 400).c_str());
    check_version(r);
    check_buffers(r);
}
} // namespace gltf
