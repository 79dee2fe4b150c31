/* SPDX-License-Identifier: MIT */
/* Checks of output paths, and writing of files. */
#include "image_path.h"
#include "lib/text.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum cli_image cli_image_by_name(const char *name)
{
    static const struct {
        const char *name;
        enum cli_image image;
    } known[] = {{"png", CLI_IMAGE_PNG},   {"jpg", CLI_IMAGE_JPEG}, {"jpeg", CLI_IMAGE_JPEG},
                 {"exr", CLI_IMAGE_EXR},   {"hdr", CLI_IMAGE_HDR},  {"webp", CLI_IMAGE_WEBP},
                 {"tiff", CLI_IMAGE_TIFF}, {"tif", CLI_IMAGE_TIFF}, {"gif", CLI_IMAGE_GIF},
                 {"mp4", CLI_IMAGE_MP4},   {"mkv", CLI_IMAGE_MKV},  {"y4m", CLI_IMAGE_Y4M}};
    for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++)
        if (strcasecmp(known[i].name, name) == 0)
            return known[i].image;
    return CLI_IMAGE_UNKNOWN;
}

enum cli_image cli_image_by_path(const char *path)
{
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(path, '.');
    if (!dot || (slash && dot < slash))
        return CLI_IMAGE_UNKNOWN;
    return cli_image_by_name(dot + 1);
}

const char *cli_image_name(enum cli_image image)
{
    static const char *const names[] = {"",    "png", "jpeg", "exr", "hdr",  "webp", "tiff",
                                        "gif", "mp4", "mkv",  "y4m", "webp", "gif"};
    return names[image];
}

bool cli_image_is_video(enum cli_image image)
{
    return image >= CLI_IMAGE_MP4 && image < CLI_IMAGE_COUNT;
}

enum cli_image cli_image_of_series(enum cli_image image, const char *path)
{
    if (strchr(path, '%'))
        return image;
    return image == CLI_IMAGE_WEBP ? CLI_IMAGE_MOVING_WEBP : image == CLI_IMAGE_GIF ? CLI_IMAGE_MOVING_GIF : image;
}

const char *cli_base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* Opens a file without a name, which leaves nothing in the folder if this process is killed. Where the file
 * system needs a name, the file has one for a moment. -1: errno has the reason. */
static int open_probe(const char *folder)
{
    const int fd = open(folder, O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
    if (fd >= 0 || (errno != EOPNOTSUPP && errno != EISDIR))
        return fd;
    char path[4200];
    if ((size_t)snprintf(path, sizeof(path), "%s/.farlight-XXXXXX", folder) >= sizeof(path)) {
        errno = ENAMETOOLONG;
        return -1;
    }
    const int named = mkostemp(path, O_CLOEXEC);
    if (named >= 0)
        unlink(path);
    return named;
}

/* Tests a folder by an attempt, since only that shows rights, read-only file systems and quotas. */
static bool try_folder(const char *path, const char *folder, struct fl_error *error)
{
    const int fd = open_probe(folder);
    if (fd < 0)
        return fl_error_set(error, FL_ERROR_FILE, path, "its folder cannot be written: %s", strerror(errno));
    close(fd);
    return true;
}

/* Shortens "a/b" to "a", "a" to ".", "/a" to "/". */
static void outer_folder(char *path)
{
    char *slash = strrchr(path, '/');
    if (!slash)
        snprintf(path, 2, ".");
    else
        slash[slash == path ? 1 : 0] = '\0';
}

bool cli_check_output(const char *path, char *folder, size_t folder_bytes, struct fl_error *error)
{
    char plain[4097];
    fl_text_utf8(path, plain, sizeof(plain));
    if (strcmp(path, plain) != 0)
        return fl_error_set(error, FL_ERROR_FILE, plain, "the image's path must be UTF-8 of at most 4096 bytes");
    const char *slash = strrchr(path, '/');
    const size_t length = !slash ? 1 : slash == path ? 1 : (size_t)(slash - path);
    if (length >= folder_bytes)
        return fl_error_set(error, FL_ERROR_FILE, "", "the path of the image is too long");
    memcpy(folder, !slash ? "." : path, length);
    folder[length] = '\0';
    char present[4097];
    struct stat status;
    snprintf(present, sizeof(present), "%s", folder);
    while (stat(present, &status) < 0 && errno == ENOENT)
        outer_folder(present);
    if (stat(present, &status) < 0)
        return fl_error_set(error, FL_ERROR_FILE, path, "its folder cannot be used: %s", strerror(errno));
    if (!S_ISDIR(status.st_mode))
        return fl_error_set(error, FL_ERROR_FILE, path, "'%s' is not a folder", present);
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode))
        return fl_error_set(error, FL_ERROR_FILE, path, "exists and is not a regular file");
    return try_folder(path, present, error);
}

bool cli_check_folder(const char *path, const char *folder, bool parents, struct fl_error *error)
{
    struct stat status;
    if (parents || stat(folder, &status) == 0)
        return true;
    fl_error_set(error, FL_ERROR_FILE, path, "there is no folder '%.200s'", folder);
    return fl_error_remedy(error, "make it first; --parents of render, animate, turntable and thumbnail does");
}

bool cli_make_folder(const char *folder, struct fl_error *error)
{
    char path[4097];
    snprintf(path, sizeof(path), "%s", folder);
    for (char *slash = path; slash;) {
        slash = strchr(slash + 1, '/');
        if (slash)
            *slash = '\0';
        if (mkdir(path, 0777) < 0 && errno != EEXIST)
            return fl_error_set(error, FL_ERROR_FILE, path, "this folder cannot be made: %s", strerror(errno));
        if (slash)
            *slash = '/';
    }
    return true;
}

/* Writes an unfinished file beside the path, then renames it, so that a reader sees the old text or the whole
 * new one. */
bool cli_write_text(const char *path, const char *text, mode_t rights, struct fl_error *error)
{
    char unfinished[4200];
    if ((size_t)snprintf(unfinished, sizeof(unfinished), "%s.XXXXXX", path) >= sizeof(unfinished))
        return fl_error_set(error, FL_ERROR_FILE, "", "the path of the file is too long");
    const int fd = mkostemp(unfinished, O_CLOEXEC);
    if (fd < 0)
        return fl_text_write_error(error, path, "cannot be written", errno);
    FILE *file = fdopen(fd, "w");
    bool done = file && fputs(text, file) >= 0 && fchmod(fd, rights) == 0;
    if (file)
        done = fclose(file) == 0 && done;
    else
        close(fd);
    if (done && rename(unfinished, path) == 0)
        return true;
    fl_text_write_error(error, path, "cannot be written", errno);
    unlink(unfinished);
    return false;
}

static bool is_same_file(const char *a, const char *b)
{
    struct stat first, second;
    return stat(a, &first) == 0 && stat(b, &second) == 0 && first.st_dev == second.st_dev &&
           first.st_ino == second.st_ino;
}

bool cli_check_not_input(const char *path, const char *option, const char *const *inputs, size_t count,
                         struct fl_error *error)
{
    for (size_t i = 0; i < count; i++)
        if (inputs[i] && is_same_file(path, inputs[i]))
            return fl_error_set(error, FL_ERROR_ARGUMENT, option, "would replace '%s'", inputs[i]);
    return true;
}

bool cli_check_error_picture(const char *picture, const char *const *inputs, size_t count, struct fl_error *error)
{
    char folder[4097];
    if (!picture)
        return true;
    const enum cli_image image = cli_image_by_path(picture);
    if (image != CLI_IMAGE_PNG && image != CLI_IMAGE_JPEG) {
        fl_error_set(error, FL_ERROR_ARGUMENT, picture, "a picture of errors must be PNG or JPEG");
        return fl_error_remedy(error, "known endings: .png .jpg .jpeg");
    }
    return cli_check_not_input(picture, "--output", inputs, count, error) &&
           cli_check_output(picture, folder, sizeof(folder), error) &&
           cli_check_folder(picture, folder, false, error);
}

bool cli_temporary_folder(char *folder, size_t folder_bytes, struct fl_error *error)
{
    const char *parent = getenv("TMPDIR");
    if (!parent || parent[0] == '\0')
        parent = P_tmpdir;
    const int length = snprintf(folder, folder_bytes, "%s/farlight-XXXXXX", parent);
    if (length < 0 || (size_t)length >= folder_bytes || !mkdtemp(folder))
        return fl_error_set(error, FL_ERROR_FILE, parent, "cannot create a temporary folder: %s", strerror(errno));
    return true;
}

bool cli_check_stdout(const char *what, struct fl_error *error)
{
    if (isatty(STDOUT_FILENO) != 1)
        return true;
    fl_error_set(error, FL_ERROR_ARGUMENT, "--output", "%s would be written to the terminal", what);
    return fl_error_remedy(error, "redirect it, or name a file");
}

bool cli_write_all(int to, const char *bytes, size_t count)
{
    while (count > 0) {
        const ssize_t wrote = write(to, bytes, count);
        if (wrote < 0 && errno != EINTR)
            return false;
        bytes += wrote > 0 ? wrote : 0;
        count -= wrote > 0 ? (size_t)wrote : 0;
    }
    return true;
}

bool cli_copy_to(const char *device, const char *path, struct fl_error *error)
{
    static char piece[65536];
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %s", strerror(errno));
    const int to = device ? open(device, O_WRONLY | O_NOCTTY | O_CLOEXEC) : STDOUT_FILENO;
    ssize_t got = 0;
    bool good = to >= 0;
    while (good && (got = read(fd, piece, sizeof(piece))) > 0)
        good = cli_write_all(to, piece, (size_t)got);
    if (!good)
        fl_error_set(error, FL_ERROR_FILE, device ? device : "standard output", "cannot be written: %s",
                     strerror(errno));
    else if (got < 0)
        good = fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %s", strerror(errno));
    close(fd);
    if (device && to >= 0)
        close(to);
    return good;
}
