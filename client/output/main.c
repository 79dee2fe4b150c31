/* SPDX-License-Identifier: MIT */
/* farlight-export: receives pictures over a socket that its parent has connected, and writes image files;
 * compares and merges image files. It is a program of its own so that nothing else links the libraries of image
 * formats; its sandbox allows writing below one folder and reading the files named at its start. */
#include "helper/file.h"
#include "image.h"
#include "library.h"
#include "helper/sandbox.h"
#include "serve.h"
#include "protocol/common/squares.h"
#include "protocol/version.h"

#include <argp.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define EXIT_USAGE 2
#define TEXT_MAX 512

/* argp finds this variable by name, despite our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-export " FARLIGHT_VERSION;

enum {
    KEY_FD = 0x100,
    KEY_FOLDER,
    KEY_FPS,
    KEY_FORMAT,
    KEY_READ,
    KEY_MERGE,
    KEY_FULL_METADATA,
    KEY_TEXT,
    KEY_WINDOW,
    KEY_DWAA,
    KEY_LIGHT_GROUPS,
    KEY_OCIO,
    KEY_COLOUR_SPACE,
    KEY_DISPLAY_VIEW
};

#define READ_MAX SQUARES_PARTS_MAX

struct options {
    const char *folder;
    enum image_format format; /* format of all files; unknown: any */
    bool draws_text, merges;
    struct compare_file files[READ_MAX];
    struct serve_options serve;
};

static bool read_window(const char *value, struct image_window *window)
{
    int length = 0;
    return sscanf(value, "%5u,%5u,%5u,%5u%n", &window->x, &window->y, &window->width, &window->height, &length) ==
               4 &&
           value[length] == '\0' && window->width > 0 && window->height > 0;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct options *options = state->input;
    char *end = NULL;
    switch (key) {
    case KEY_FD: {
        const long fd = strtol(value, &end, 10);
        if (end == value || *end != '\0' || fd < 0 || fd > 1000000)
            argp_error(state, "--fd: '%s' is no descriptor", value);
        options->serve.fd = (int)fd;
        return 0;
    }
    case KEY_FOLDER:
        options->folder = value;
        return 0;
    case KEY_FORMAT:
        options->format = image_format_of("", value);
        if (options->format == IMAGE_UNKNOWN)
            argp_error(state, "--format: '%s' is no format", value);
        return 0;
    case KEY_MERGE:
        options->merges = true;
        return 0;
    case KEY_READ:
    case ARGP_KEY_ARG:
        if (options->serve.file_count == (options->merges ? READ_MAX : 2))
            argp_error(state, "more files than are compared, 2, or merged, %u", READ_MAX);
        options->files[options->serve.file_count++].path = value;
        return 0;
    case KEY_FULL_METADATA:
        options->serve.full_metadata = true;
        return 0;
    case KEY_DWAA:
        options->serve.dwaa = true;
        return 0;
    case KEY_LIGHT_GROUPS:
        options->serve.light_groups = value;
        return 0;
    case KEY_OCIO:
        options->serve.colour.config = value;
        return 0;
    case KEY_COLOUR_SPACE:
        options->serve.colour.space = value;
        return 0;
    case KEY_DISPLAY_VIEW:
        options->serve.colour.view = value;
        return 0;
    case KEY_TEXT:
        options->draws_text = true;
        return 0;
    case KEY_WINDOW:
        if (!read_window(value, &options->serve.window))
            argp_error(state, "--window: '%s' is no part of a picture", value);
        return 0;
    case KEY_FPS:
        options->serve.frames_per_second = strtof(value, &end);
        if (end == value || *end != '\0' || !(options->serve.frames_per_second > 0))
            argp_error(state, "--fps: '%s' is no rate", value);
        return 0;
    case ARGP_KEY_END:
        if (options->serve.fd < 0 || (!options->folder && options->serve.file_count == 0))
            argp_error(state, "--fd, and --folder or --read, are needed: this program is started by farlight");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Opens the files; the request that needs a file reports its error. */
static void open_files(struct options *options)
{
    for (size_t i = 0; i < options->serve.file_count; i++) {
        struct compare_file *file = &options->files[i];
        file->fd = file_open(file->path, file->reason, sizeof(file->reason));
    }
}

static bool draws_text(const struct options *options)
{
    return options->draws_text || (options->serve.file_count > 0 && !options->merges);
}

static bool needs_library(const struct options *options)
{
    return draws_text(options) || colour_needs_library(&options->serve.colour) ||
           (options->folder && image_needs_library(options->format));
}

/* The folder of the configuration and its tables, which the caller frees. Replaces the configuration's path by
 * its name in there. */
static char *configuration_folder(struct options *options)
{
    static char path[PATH_MAX];
    struct colour_wanted *wanted = &options->serve.colour;
    if (!wanted->config || !colour_needs_library(wanted) || !realpath(wanted->config, path))
        return NULL;
    wanted->config = path;
    return strndup(path, (size_t)(strrchr(path, '/') - path + 1));
}

/* Enters the sandbox, then loads the module, whose libraries start threads. */
static bool enter_sandbox(struct options *options)
{
    const char *const write_folders[] = {options->folder};
    char *modules = needs_library(options) ? library_folder() : NULL;
    char *configuration = configuration_folder(options);
    const bool draws = draws_text(options);
    const char *const read_folders[] = {modules, configuration, draws ? COMPARE_FONT_FOLDER : NULL,
                                        draws ? COMPARE_LOCAL_FONT_FOLDER : NULL};
    const bool writes = options->folder != NULL;
    const struct sandbox_options sandbox = {.read_folders = read_folders,
                                            .read_folder_count = sizeof(read_folders) / sizeof(read_folders[0]),
                                            .write_folders = write_folders,
                                            .write_folder_count = writes ? 1 : 0,
                                            .allow_rename = writes,
                                            .file_bytes = writes ? file_bytes_limit() : 0,
                                            .address_space_bytes = UINT64_C(16) << 30};
    char reason[TEXT_MAX] = "";
    open_files(options);
    tzset(); /* reads the time zone, for dates, which the sandbox forbids later */
    const bool entered = sandbox_enter(&sandbox, reason, sizeof(reason));
    free(modules);
    free(configuration);
    if (!entered) {
        fprintf(stderr, "farlight-export: %s\n", reason);
        return false;
    }
    if (needs_library(options))
        library_load(draws);
    return true;
}

int main(int argc, char **argv)
{
    static const struct argp_option rows[] = {
        {"fd", KEY_FD, "N", 0, "Connected stream socket to speak over (needed)", 0},
        {"folder", KEY_FOLDER, "DIR", 0, "The one folder that may be written to", 0},
        {"format", KEY_FORMAT, "NAME", 0,
         "Formats: png, jpeg, exr, hdr, webp, tiff or gif, only (default: any, which takes longer to start)", 0},
        {"read", KEY_READ, "FILE", 0, "An image that may be read and compared; twice", 0},
        {"merge", KEY_MERGE, NULL, 0, "The files FILE.. are parts of a picture that becomes one file", 0},
        {"text", KEY_TEXT, NULL, 0, "Text may be drawn into pictures", 0},
        {"fps", KEY_FPS, "N", 0, "Frames per second, for the metadata of EXR files", 0},
        {"window", KEY_WINDOW, "X,Y,W,H", 0, "Pictures are the part from X, Y on of W x H pixels", 0},
        {"light-groups", KEY_LIGHT_GROUPS, "NAME,..", 0, "Name the layers of light groups in EXR files", 0},
        {"dwaa", KEY_DWAA, NULL, 0, "Compress colours of EXR files with loss", 0},
        {"ocio", KEY_OCIO, "FILE", 0, "Configuration of OpenColorIO", 0},
        {"colour-space", KEY_COLOUR_SPACE, "NAME", 0, "Convert the colours of EXR files to this space", 0},
        {"display-view", KEY_DISPLAY_VIEW, "VIEW", 0, "Make pictures of 8 bits by this view of a display", 0},
        {"full-metadata", KEY_FULL_METADATA, NULL, 0,
         "Store metadata that differs between runs, too: date, times of stages, revision", 0},
        {0}};
    static const struct argp argp = {.options = rows,
                                     .parser = parse,
                                     .args_doc = "[-- FILE...]",
                                     .doc =
                                         "Write and compare image files for farlight, which starts this program."};
    struct options options = {.serve = {.fd = -1, .files = options.files}};
    argp_err_exit_status = EXIT_USAGE;
    if (argp_parse(&argp, argc, argv, 0, NULL, &options) != 0)
        return EXIT_USAGE;
    /* A limit on file sizes becomes an error of write() instead of ending the program. */
    signal(SIGXFSZ, SIG_IGN);
    file_clean_up_on_end();
    return enter_sandbox(&options) && serve(&options.serve) ? EXIT_SUCCESS : EXIT_FAILURE;
}
