/* SPDX-License-Identifier: MIT */
/* Reading of the model file and the files that it refers to. */
#include "files.h"

#include "scene.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/openat2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#define OPEN_FLAGS (O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY) /* O_NONBLOCK: opening a FIFO must not block */

static bool is_regular(int descriptor, char reason[FILES_REASON_BYTES])
{
    struct stat status;

    if (fstat(descriptor, &status) != 0) {
        snprintf(reason, FILES_REASON_BYTES, "%s", strerror(errno));
        return false;
    }
    if (S_ISREG(status.st_mode))
        return true;
    snprintf(reason, FILES_REASON_BYTES, "is %s, not a regular file",
             S_ISDIR(status.st_mode)    ? "a folder"
             : S_ISFIFO(status.st_mode) ? "a FIFO"
             : S_ISSOCK(status.st_mode) ? "a socket"
                                        : "a device");
    return false;
}

static int open_regular(const char *path, char reason[FILES_REASON_BYTES])
{
    int descriptor = strcmp(path, "-") == 0 ? fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0) : open(path, OPEN_FLAGS);

    if (descriptor < 0) {
        snprintf(reason, FILES_REASON_BYTES, "%s", strerror(errno));
    } else if (!is_regular(descriptor, reason)) {
        close(descriptor);
        descriptor = -1;
    }
    return descriptor;
}

char *files_folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');

    if (!slash)
        return strdup(".");
    return slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

bool files_open(struct files *files, const char *model_path, const char *environment_path,
                char reason[FILES_REASON_BYTES])
{
    *files = (struct files){.folder = -1, .model = -1, .environment = -1};
    if (model_path) {
        char *folder;

        files->model = open_regular(model_path, reason);
        if (files->model < 0 || strcmp(model_path, "-") == 0)
            return files->model >= 0;
        folder = files_folder_of(model_path);
        if (folder)
            files->folder = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
        free(folder);
        if (files->folder < 0) {
            snprintf(reason, FILES_REASON_BYTES, "its folder cannot be opened: %s", strerror(errno));
            return false;
        }
    }
    if (environment_path) {
        files->environment = open_regular(environment_path, reason);
        return files->environment >= 0;
    }
    return true;
}

void files_finish(struct files *files)
{
    if (files->folder >= 0)
        close(files->folder);
    if (files->model >= 0)
        close(files->model);
    if (files->environment >= 0)
        close(files->environment);
    files->folder = files->model = files->environment = -1;
    for (size_t i = 0; i < files->named_count; i++)
        free(files->named[i]);
    free(files->named);
    files->named = NULL;
    files->named_count = 0;
}

/* Reads until the end; the size that the file system reports is only the buffer's first size. */
static unsigned char *read_all(int descriptor, uint64_t room_bytes, size_t *size_bytes,
                               char reason[FILES_REASON_BYTES])
{
    struct stat status;
    size_t capacity = 0, used = 0;
    unsigned char *bytes = NULL;

    if (fstat(descriptor, &status) == 0 && status.st_size > 0)
        capacity = ((uint64_t)status.st_size < room_bytes ? (size_t)status.st_size : (size_t)room_bytes) + 1;
    for (;;) {
        ssize_t got;

        if (!bytes || used == capacity) {
            unsigned char *grown;

            if (used > room_bytes) {
                snprintf(reason, FILES_REASON_BYTES, "is larger than %llu MiB",
                         (unsigned long long)(room_bytes >> 20));
                break;
            }
            if (bytes || capacity == 0)
                capacity += capacity / 2 + 4096;
            grown = realloc(bytes, capacity + 1);
            if (!grown) {
                snprintf(reason, FILES_REASON_BYTES, "out of memory");
                break;
            }
            bytes = grown;
        }
        got = read(descriptor, bytes + used, capacity - used);
        if (got == 0 || (got < 0 && errno != EINTR)) {
            if (got == 0 && used <= room_bytes) {
                bytes[used] = '\0';
                *size_bytes = used;
                return bytes;
            }
            snprintf(reason, FILES_REASON_BYTES, "%s", got == 0 ? "is too large" : strerror(errno));
            break;
        }
        if (got > 0)
            used += (size_t)got;
    }
    free(bytes);
    return NULL;
}

unsigned char *files_read_descriptor(struct files *files, int descriptor, size_t *size_bytes,
                                     char reason[FILES_REASON_BYTES])
{
    uint64_t start_ns = monotonic_now_ns();
    uint64_t room = files->read_bytes < FILES_TOTAL_MAX ? FILES_TOTAL_MAX - files->read_bytes : 0;
    unsigned char *bytes =
        read_all(descriptor, room < FILES_BYTES_MAX ? room : FILES_BYTES_MAX, size_bytes, reason);

    if (bytes)
        files->read_bytes += *size_bytes;
    files->read_ns += monotonic_now_ns() - start_ns;
    return bytes;
}

/* ---- names beneath the folder ---- */

#define LINKS_MAX 40 /* limit for one name, the kernel's own */

/* Replaces `rest` by a link's target, followed by the path behind the link. */
static bool put_before(char rest[PATH_MAX], const char *target, const char *behind)
{
    char joined[PATH_MAX];
    int length = snprintf(joined, sizeof(joined), "%s%s%s", target, behind[0] != '\0' ? "/" : "", behind);

    if (length < 0 || (size_t)length >= sizeof(joined)) {
        errno = ENAMETOOLONG;
        return false;
    }
    memcpy(rest, joined, (size_t)length + 1);
    return true;
}

/* Resolves a name beneath the folder to one without "..", "." and links, in `path`, which is empty for the
 * folder itself. */
static bool resolve_beneath(int folder, const char *name, char path[PATH_MAX])
{
    char rest[PATH_MAX], target[PATH_MAX];
    size_t used = 0;

    if (name[0] == '/') {
        errno = EXDEV;
        return false;
    }
    if (!put_before(rest, name, ""))
        return false;
    path[0] = '\0';
    for (unsigned links = 0; rest[0] != '\0';) {
        size_t length = strcspn(rest, "/");
        const char *behind = rest + length + (rest[length] == '/' ? 1 : 0);
        size_t before = used;
        ssize_t linked = -1;

        rest[length] = '\0';
        if (strcmp(rest, "..") == 0) {
            const char *slash = strrchr(path, '/');

            if (used == 0) {
                errno = EXDEV;
                return false;
            }
            used = slash ? (size_t)(slash - path) : 0;
            path[used] = '\0';
        } else if (length > 0 && strcmp(rest, ".") != 0) {
            if (used + length + 2 > PATH_MAX) {
                errno = ENAMETOOLONG;
                return false;
            }
            if (used > 0)
                path[used++] = '/';
            memcpy(path + used, rest, length + 1);
            used += length;
            linked = readlinkat(folder, path, target, sizeof(target) - 1);
            if (linked < 0 && errno != EINVAL) /* EINVAL: not a link */
                return false;
        }
        if (linked < 0) {
            memmove(rest, behind, strlen(behind) + 1);
            continue;
        }
        target[linked] = '\0';
        path[used = before] = '\0';
        if (target[0] == '/' || ++links > LINKS_MAX) {
            errno = target[0] == '/' ? EXDEV : ELOOP;
            return false;
        }
        if (!put_before(rest, target, behind))
            return false;
    }
    return true;
}

/* Hidden files (keys, tokens, histories) are no part of a model. */
static bool is_hidden(const char *path)
{
    return path[0] == '.' || strstr(path, "/.");
}

static int open_beneath(int folder, const char *name, char reason[FILES_REASON_BYTES])
{
    struct open_how how = {.flags = OPEN_FLAGS, .resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS};
    char path[PATH_MAX];
    int descriptor = -1;

    if (resolve_beneath(folder, name, path)) {
        if (is_hidden(path)) {
            snprintf(reason, FILES_REASON_BYTES,
                     "is hidden: a model may not name files or folders that begin with a dot");
            return -1;
        }
        descriptor = (int)syscall(SYS_openat2, folder, path[0] != '\0' ? path : ".", &how, sizeof(how));
        /* On kernels and in containers without openat2, the path was found to have no links, and only somebody
         * who may write in the folder could have added one since. */
        if (descriptor < 0 && (errno == ENOSYS || errno == EPERM))
            descriptor = openat(folder, path[0] != '\0' ? path : ".", OPEN_FLAGS | O_NOFOLLOW);
    }
    if (descriptor < 0)
        snprintf(reason, FILES_REASON_BYTES, "%s",
                 errno == EXDEV ? "lies outside the model's folder" : strerror(errno));
    return descriptor;
}

/* True for a file that may be a key of farlight, which only its size and mode show (protocol/sealed/key.h). */
static bool may_be_key(int descriptor)
{
    struct stat status;

    return fstat(descriptor, &status) == 0 && status.st_size == 32 && (status.st_mode & (S_IRWXG | S_IRWXO)) == 0;
}

/* Records a name, also of a missing file, as --watch waits for it. Without memory it is left out. */
static void remember(struct files *files, const char *name)
{
    char **grown = files->named_count < FILES_NAMED_MAX
                       ? realloc(files->named, (files->named_count + 1) * sizeof(*grown))
                       : NULL;

    if (!grown)
        return;
    files->named = grown;
    grown[files->named_count] = strdup(name);
    if (grown[files->named_count])
        files->named_count++;
}

unsigned char *files_read(struct files *files, const char *name, size_t *size_bytes,
                          char reason[FILES_REASON_BYTES])
{
    unsigned char *bytes = NULL;
    int descriptor;

    if (files->folder < 0) {
        snprintf(reason, FILES_REASON_BYTES, "cannot be found: a model from standard input has no folder");
        return NULL;
    }
    remember(files, name);
    descriptor = open_beneath(files->folder, name, reason);

    if (descriptor < 0 && strchr(name, '\\')) {
        char *slashed = strdup(name);

        for (char *at = slashed; at && *at; at++)
            if (*at == '\\')
                *at = '/';
        if (slashed)
            descriptor = open_beneath(files->folder, slashed, reason);
        free(slashed);
    }
    if (descriptor < 0)
        return NULL;
    if (may_be_key(descriptor))
        snprintf(reason, FILES_REASON_BYTES, "has the size and mode of a key");
    else if (is_regular(descriptor, reason))
        bytes = files_read_descriptor(files, descriptor, size_bytes, reason);
    close(descriptor);
    return bytes;
}

/* Extracts the last part of a path of any system, without blanks and quotes around it. False: it has none, or
 * is too long. */
static bool last_part(const char *path, char name[FILES_NAME_BYTES])
{
    static const char around[] = " \t\"'";
    size_t length = strlen(path);

    while (length > 0 && strchr(around, path[length - 1]))
        length--;
    size_t begin = length;
    while (begin > 0 && path[begin - 1] != '/' && path[begin - 1] != '\\')
        begin--;
    while (begin < length && strchr(around, path[begin]))
        begin++;
    if (begin == length || length - begin >= FILES_NAME_BYTES)
        return false;
    memcpy(name, path + begin, length - begin);
    name[length - begin] = '\0';
    return true;
}

/* Replaces the name by a file's beside the model that differs in case only; the first one in the order of
 * bytes, so that the same folder gives the same picture. */
static bool find_in_any_case(const struct files *files, char name[FILES_NAME_BYTES])
{
    const int descriptor = openat(files->folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = descriptor >= 0 ? fdopendir(descriptor) : NULL;
    char found[FILES_NAME_BYTES] = "";

    if (!folder) {
        if (descriptor >= 0)
            close(descriptor);
        return false;
    }
    for (const struct dirent *entry; (entry = readdir(folder));)
        if (strcasecmp(entry->d_name, name) == 0 && (found[0] == '\0' || strcmp(entry->d_name, found) < 0))
            snprintf(found, sizeof(found), "%s", entry->d_name);
    closedir(folder);
    if (found[0] != '\0')
        memcpy(name, found, sizeof(found));
    return found[0] != '\0';
}

unsigned char *files_read_image(struct files *files, struct import_scene *scene, const char *name,
                                size_t *size_bytes, char reason[FILES_REASON_BYTES])
{
    char found[FILES_NAME_BYTES], reason_last[FILES_REASON_BYTES];
    unsigned char *bytes = files_read(files, name, size_bytes, reason);

    if (bytes || files->folder < 0 || !last_part(name, found))
        return bytes;
    if (strcmp(found, name) != 0)
        bytes = files_read(files, found, size_bytes, reason_last);
    if (!bytes && find_in_any_case(files, found))
        bytes = files_read(files, found, size_bytes, reason_last);
    if (bytes)
        import_note(scene, PROTOCOL_SEVERITY_INFO, name,
                    "the image '%.200s' was found by its name alone, beside the model", found);
    return bytes;
}

/* ---- kinds of content ---- */

/* True for text, maybe cut within its last character. Vertices and indices contain zeros or other bytes that no
 * text has. */
static bool is_text(const unsigned char *bytes, size_t size_bytes)
{
    size_t at = 0;

    while (at < size_bytes) {
        uint32_t code = 0;
        size_t length = utf8_read(bytes + at, size_bytes - at, &code);
        bool is_blank = code == '\t' || code == '\n' || code == '\r' || code == '\f';

        if (length == 0)
            return at > 0 && bytes[at] >= 0xc2 && size_bytes - at < UTF8_BYTES_MAX;
        if ((code < 0x20 && !is_blank) || (code >= 0x7f && code <= 0x9f))
            return false;
        at += length;
    }
    return size_bytes > 0;
}

bool files_is_buffer(const unsigned char *bytes, size_t size_bytes, const char **kind)
{
    static const struct {
        const char *kind, *magic;
        size_t bytes;
    } kinds[] = {
        {"a program",
         "\x7f"
         "ELF",
         4},
        {"a database", "SQLite format 3", 16},
        {"an archive", "PK\3\4", 4},
        {"packed with gzip", "\x1f\x8b\x08", 3},
        {"packed with bzip2", "BZh", 3},
        {"packed with xz",
         "\xfd"
         "7zXZ",
         6},
        {"packed with zstd", "\x28\xb5\x2f\xfd", 4},
        {"a document", "%PDF-", 5},
        {"a database of keys", "\x03\xd9\xa2\x9a", 4},
        {"a store of keys", "\xfe\xed\xfe\xed", 4},
    };

    for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++) {
        *kind = kinds[i].kind;
        if (size_bytes >= kinds[i].bytes && memcmp(bytes, kinds[i].magic, kinds[i].bytes) == 0)
            return false;
    }
    /* DER: a sequence with two bytes of length that starts with the integer of a version, as private keys do. */
    *kind = "a key";
    if (size_bytes >= 7 && bytes[0] == 0x30 && bytes[1] == 0x82 && bytes[4] == 0x02 && bytes[5] == 0x01)
        return false;
    *kind = "text";
    return !is_text(bytes, size_bytes);
}

bool files_is_material_library(const unsigned char *bytes, size_t size_bytes)
{
    const char *text = (const char *)bytes; /* terminated */

    if (memchr(bytes, '\0', size_bytes))
        return false;
    for (const char *at = strstr(text, "newmtl"); at; at = strstr(at + 1, "newmtl")) {
        const char *before = at;

        while (before > text && (before[-1] == ' ' || before[-1] == '\t'))
            before--;
        if (before == text || before[-1] == '\n' || before[-1] == '\r' ||
            before[-1] == '\xbf') /* end of a byte order mark */
            return true;
    }
    return false;
}
