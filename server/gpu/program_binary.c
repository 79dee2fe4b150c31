/* SPDX-License-Identifier: MIT */
#include "gpu/program_cache.h"

#include <epoxy/gl.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

/* A file is this header and the driver's bytes. A file that was cut short or changed is as good as none. */
struct binary_header {
    char magic[8];
    uint32_t format, size_bytes;
    uint64_t checksum;
};
static const char binary_magic[8] = "FLPROG1";
#define BINARY_BYTES_MAX (64u << 20)

bool gpu_cache_folder(char *path, size_t size)
{
    const char *cache = getenv("XDG_CACHE_HOME");
    const char *home = getenv("HOME");
    int n = -1;
    if (cache && cache[0] == '/')
        n = snprintf(path, size, "%s", cache);
    else if (home && home[0] == '/')
        n = snprintf(path, size, "%s/.cache", home);
    if (n < 0 || (size_t)n + sizeof("/farlight") > size)
        return false;
    (void)mkdir(path, 0700);
    memcpy(path + n, "/farlight", sizeof("/farlight"));
    return mkdir(path, 0700) == 0 || errno == EEXIST;
}

static bool file_path(char *path, size_t size, const struct gpu_binary_key *key)
{
    char folder[3072];
    if (!gpu_cache_folder(folder, sizeof(folder)))
        return false;
    int n = snprintf(path, size, "%s/%016llx%016llx.program", folder, (unsigned long long)key->high,
                     (unsigned long long)key->low);
    return n > 0 && (size_t)n < size;
}

static void *read_binary(FILE *file, struct binary_header *header)
{
    if (fread(header, sizeof(*header), 1, file) != 1 || memcmp(header->magic, binary_magic, 8) != 0 ||
        header->size_bytes == 0 || header->size_bytes > BINARY_BYTES_MAX)
        return NULL;
    void *data = malloc(header->size_bytes);
    if (data && (fread(data, header->size_bytes, 1, file) != 1 ||
                 XXH3_64bits(data, header->size_bytes) != header->checksum)) {
        free(data);
        return NULL;
    }
    return data;
}

bool gpu_binary_load(const struct gpu_binary_key *key, unsigned program)
{
    char path[4096];
    struct binary_header header;
    if (!file_path(path, sizeof(path), key))
        return false;
    FILE *file = fopen(path, "rbe");
    if (!file)
        return false;
    void *data = read_binary(file, &header);
    fclose(file);
    if (!data)
        return false;
    GLint linked = GL_FALSE;
    glProgramBinary(program, header.format, data, (GLsizei)header.size_bytes);
    free(data);
    /* A format of another driver is an error of GL and no more than a miss here. */
    if (glGetError() == GL_NO_ERROR)
        glGetProgramiv(program, GL_LINK_STATUS, &linked);
    return linked == GL_TRUE;
}

static bool write_file(const char *path, const struct binary_header *header, const void *data)
{
    FILE *file = fopen(path, "wbe");
    if (!file)
        return false;
    bool ok = fwrite(header, sizeof(*header), 1, file) == 1 && fwrite(data, header->size_bytes, 1, file) == 1;
    return fclose(file) == 0 && ok;
}

void gpu_binary_store(const struct gpu_binary_key *key, unsigned program)
{
    char path[4096], fresh[4128];
    GLint size_bytes = 0;
    glGetProgramiv(program, GL_PROGRAM_BINARY_LENGTH, &size_bytes);
    if (size_bytes <= 0 || (uint32_t)size_bytes > BINARY_BYTES_MAX || !file_path(path, sizeof(path), key))
        return;
    void *data = malloc((size_t)size_bytes);
    if (!data)
        return;
    GLenum format = 0;
    GLsizei written = 0;
    glGetProgramBinary(program, size_bytes, &written, &format, data);
    struct binary_header header = {.format = format, .size_bytes = (uint32_t)written};
    memcpy(header.magic, binary_magic, sizeof(header.magic));
    header.checksum = written > 0 ? XXH3_64bits(data, (size_t)written) : 0;
    /* Under a name of its own first: another daemon may read at any moment. */
    snprintf(fresh, sizeof(fresh), "%s.%ld", path, (long)getpid());
    if (glGetError() == GL_NO_ERROR && written > 0 &&
        (!write_file(fresh, &header, data) || rename(fresh, path) != 0))
        (void)unlink(fresh);
    free(data);
}
