/* SPDX-License-Identifier: MIT */
/* farlight-video: takes frames over a socket that the program that started it has connected already, and writes
 * videos. A program of its own so that nothing else links libavcodec; it may write beneath one folder and open
 * nothing else. */
#include "encode.h"
#include "helper/sandbox.h"
#include "helper/file.h"
#include "palette.h"
#include "serve.h"
#include "protocol/version.h"

#include <argp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#define EXIT_USAGE 2
#define TEXT_MAX 512

/* The C library looks for it by name, past our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-video " FARLIGHT_VERSION;

enum { KEY_FD = 0x100, KEY_FOLDER, KEY_GIF };

struct options {
    const char *folder;
    int fd;
    bool gif;
};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct options *options = state->input;
    char *end = NULL;
    switch (key) {
    case KEY_FD: {
        const long fd = strtol(value, &end, 10);
        if (end == value || *end != '\0' || fd < 0 || fd > 1000000)
            argp_error(state, "--fd: '%s' is no descriptor", value);
        options->fd = (int)fd;
        return 0;
    }
    case KEY_FOLDER:
        options->folder = value;
        return 0;
    case KEY_GIF:
        options->gif = true;
        return 0;
    case ARGP_KEY_END:
        if (options->fd < 0 || !options->folder)
            argp_error(state, "--fd and --folder are needed: this program is started by farlight");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool enter_sandbox(const struct options *options)
{
    const char *const write_folders[] = {options->folder};
    char *modules = options->gif ? palette_folder() : NULL;
    const char *const read_folders[] = {modules};
    const struct sandbox_options sandbox = {.read_folders = read_folders,
                                            .read_folder_count = 1,
                                            .write_folders = write_folders,
                                            .write_folder_count = 1,
                                            .allow_rename = true,
                                            .file_bytes = file_bytes_limit(),
                                            .address_space_bytes = UINT64_C(16) << 30};
    char reason[TEXT_MAX] = "";
    const bool entered = sandbox_enter(&sandbox, reason, sizeof(reason));
    free(modules);
    if (!entered) {
        fprintf(stderr, "farlight-video: %s\n", reason);
        return false;
    }
    if (options->gif)
        palette_load();
    return true;
}

int main(int argc, char **argv)
{
    static const struct argp_option rows[] = {
        {"fd", KEY_FD, "N", 0, "Connected stream socket to speak over (needed)", 0},
        {"folder", KEY_FOLDER, "DIR", 0, "The one folder that may be written to (needed)", 0},
        {"gif", KEY_GIF, NULL, 0, "Load the libraries for GIF files", 0},
        {0}};
    static const struct argp argp = {
        .options = rows, .parser = parse, .doc = "Write videos for farlight, which starts this program."};
    struct options options = {.fd = -1};
    argp_err_exit_status = EXIT_USAGE;
    if (argp_parse(&argp, argc, argv, 0, NULL, &options) != 0)
        return EXIT_USAGE;
    /* A limit on file sizes makes write() fail instead of ending the process. */
    signal(SIGXFSZ, SIG_IGN);
    file_clean_up_on_end();
    video_keep_log();
    return enter_sandbox(&options) && video_serve(options.fd) ? EXIT_SUCCESS : EXIT_FAILURE;
}
