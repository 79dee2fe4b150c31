/* SPDX-License-Identifier: MIT */
/* Recognition of formats. */
#include "format.h"

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#define HEAD_BYTES 65536u /* limit of text that is examined */

static bool has_ending(const char *path, const char *ending)
{
    size_t path_length = strlen(path), length = strlen(ending);

    return path_length > length && strcasecmp(path + path_length - length, ending) == 0;
}

static bool contains(const unsigned char *bytes, size_t size_bytes, const char *text)
{
    return memmem(bytes, size_bytes, text, strlen(text)) != NULL;
}

static bool begins(const unsigned char *bytes, size_t size_bytes, const char *text)
{
    return size_bytes >= strlen(text) && memcmp(bytes, text, strlen(text)) == 0;
}

struct format format_of_name(const char *name)
{
    struct format format = {.reader = FORMAT_UNKNOWN, .assimp = assimp_format_of(name)};

    if (has_ending(name, ".gltf") || has_ending(name, ".glb"))
        format.reader = FORMAT_GLTF;
    else if (has_ending(name, ".obj"))
        format.reader = FORMAT_OBJ;
    else if (has_ending(name, ".nff"))
        format.reader = FORMAT_NFF;
    else if (has_ending(name, ".3mf"))
        format.reader = FORMAT_3MF;
    else if (format.assimp)
        format.reader = FORMAT_ASSIMP;
    return format;
}

/* ---- by the bytes ---- */

static uint32_t number_at(const unsigned char *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* Detects binary STL: a header of 80 bytes, the number of facets, 50 bytes for each. Many of these begin with
 * "solid", too. */
static bool is_binary_stl(const unsigned char *bytes, size_t size_bytes)
{
    return size_bytes > 84 && number_at(bytes + 80) > 0 && (size_bytes - 84) / 50 == number_at(bytes + 80) &&
           (size_bytes - 84) % 50 == 0;
}

/* Finds a word at the beginning of a line, followed by a blank or the line's end. */
static bool has_statement(const unsigned char *bytes, size_t size_bytes, const char *word)
{
    const unsigned char *const end = bytes + size_bytes;
    const size_t length = strlen(word);

    for (const unsigned char *line = bytes; line && line < end;) {
        if ((size_t)(end - line) > length && memcmp(line, word, length) == 0 && isspace(line[length]))
            return true;
        line = memchr(line, '\n', (size_t)(end - line));
        line = line ? line + 1 : NULL;
    }
    return false;
}

/* The ending of a text's format; NULL: unknown. */
static const char *ending_of_text(const unsigned char *bytes, size_t size_bytes)
{
    if (begins(bytes, size_bytes, "\xef\xbb\xbf")) { /* byte order mark */
        bytes += 3;
        size_bytes -= 3;
    }
    while (size_bytes > 0 && isspace(*bytes)) {
        bytes++;
        size_bytes--;
    }
    size_bytes = size_bytes < HEAD_BYTES ? size_bytes : HEAD_BYTES;
    if (begins(bytes, size_bytes, "{"))
        return ".gltf";
    if (begins(bytes, size_bytes, "<"))
        return contains(bytes, size_bytes, "<COLLADA") ? ".dae"
               : contains(bytes, size_bytes, "<X3D")   ? ".x3d"
                                                       : NULL;
    if (begins(bytes, size_bytes, "solid"))
        return ".stl";
    if (begins(bytes, size_bytes, "; FBX"))
        return ".fbx";
    if (begins(bytes, size_bytes, "OFF") || begins(bytes, size_bytes, "COFF") || begins(bytes, size_bytes, "NOFF"))
        return ".off";
    if (has_statement(bytes, size_bytes, "from") && has_statement(bytes, size_bytes, "resolution"))
        return ".nff";
    return has_statement(bytes, size_bytes, "v") ? ".obj" : NULL;
}

static const char *ending_of(const unsigned char *bytes, size_t size_bytes)
{
    if (begins(bytes, size_bytes, "ply\n") || begins(bytes, size_bytes, "ply\r"))
        return ".ply";
    if (begins(bytes, size_bytes, "Kaydara FBX Binary"))
        return ".fbx";
    if (begins(bytes, size_bytes, "PK\3\4"))
        return contains(bytes, size_bytes, "_rels/.rels") ? ".3mf" : NULL;
    if (begins(bytes, size_bytes, "AC3D"))
        return ".ac";
    if (size_bytes > 6 && begins(bytes, size_bytes, "MM") && number_at(bytes + 2) == size_bytes)
        return ".3ds";
    if (is_binary_stl(bytes, size_bytes))
        return ".stl";
    return ending_of_text(bytes, size_bytes);
}

struct format format_of(const char *name, const unsigned char *bytes, size_t size_bytes)
{
    struct format format = format_of_name(name);
    const char *ending;
    char model[16];

    if (begins(bytes, size_bytes, "glTF"))
        return (struct format){.reader = FORMAT_GLTF};
    if (format.reader != FORMAT_UNKNOWN)
        return format;
    ending = ending_of(bytes, size_bytes);
    if (!ending)
        return format;
    snprintf(model, sizeof(model), "model%s", ending);
    return format_of_name(model);
}

/* ---- unsupported content ---- */

#define AS_GLTF "write it as glTF "

static const struct {
    const char *ending, *magic; /* "": recognised by the ending alone */
    const char *what, *remedy;
} unread[] = {
    {".x", "xof ", "DirectX file", AS_GLTF "by 'assimp export IN.x OUT.glb' (package assimp-utils)"},
    {".blend", "BLENDER", "scene of Blender", AS_GLTF "in Blender by File, Export"},
    {".usdz", "", "USD file", AS_GLTF "with Blender"},
    {".usda", "#usda", "USD file", AS_GLTF "with Blender"},
    {".usdc", "PXR-USDC", "USD file", AS_GLTF "with Blender"},
    {".wrl", "#VRML ", "VRML file", AS_GLTF "with Blender, or as X3D"},
    {".step", "ISO-10303-21", "STEP file, which has no triangles",
     AS_GLTF "or STL with a program of CAD, such as FreeCAD"},
    {".max", "", "scene of 3ds Max", AS_GLTF "or FBX in 3ds Max"},
    {".c4d", "", "scene of Cinema 4D", AS_GLTF "or FBX in Cinema 4D"},
    {".mb", "", "scene of Maya", AS_GLTF "or FBX in Maya"},
    {".skp", "", "scene of SketchUp", AS_GLTF "or COLLADA in SketchUp"},
    {".zip", "PK\3\4", "zip archive without a 3MF model", "unpack it and name the model in it"},
};

static const char *endings_of_all(char out[256])
{
    size_t used = (size_t)snprintf(out, 256, ".gltf, .glb, .obj, .nff, .3mf");

    for (size_t i = 0; assimp_format_at(i) && used < 240; i++)
        used += (size_t)snprintf(out + used, 256 - used, "%s%s", assimp_format_at(i + 1) ? ", " : " and ",
                                 assimp_format_at(i)->ending);
    return out;
}

/* Describes DirectX as "version 3.3, txt": after "xof " follow four digits and the kind. */
static void describe_directx(const unsigned char *bytes, size_t size_bytes, char out[40])
{
    int major, minor;
    char head[13] = "", kind[5];

    out[0] = '\0';
    memcpy(head, bytes, size_bytes < 12 ? size_bytes : 12);
    if (sscanf(head, "xof %2d%2d%4[a-z]", &major, &minor, kind) == 3)
        snprintf(out, 40, " (version %d.%d, %s)", major, minor, kind);
}

void format_explain_unknown(const char *name, const char *format, const unsigned char *bytes, size_t size_bytes,
                            char out[FORMAT_REASON_BYTES])
{
    const char *dot = strrchr(name, '.');
    char endings[256], version[40] = "";

    for (size_t i = 0; !format && i < sizeof(unread) / sizeof(unread[0]); i++) {
        const bool is_it = unread[i].magic[0] != '\0' && begins(bytes, size_bytes, unread[i].magic);

        if (!is_it && !has_ending(name, unread[i].ending))
            continue;
        if (is_it && strcmp(unread[i].ending, ".x") == 0)
            describe_directx(bytes, size_bytes, version);
        snprintf(out, FORMAT_REASON_BYTES, "it is a %s%s, which is not read: %s", unread[i].what, version,
                 unread[i].remedy);
        return;
    }
    snprintf(out, FORMAT_REASON_BYTES, "unknown format %s%.40s; known are %s", format ? "." : "",
             format ? format
             : dot  ? dot
                    : "(no ending, unknown first bytes)",
             endings_of_all(endings));
}
