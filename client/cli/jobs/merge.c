/* SPDX-License-Identifier: MIT */
/* Joins the parts of a picture that `farlight render --part` has written. */
#include "commands.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"
#include "lib/merge.h"
#include "protocol/common/squares.h"

#include <stdio.h>
#include <string.h>

enum { KEY_ANY_DEVICE = 0x400, KEY_PARENTS };

struct merging {
    const char *parts[SQUARES_PARTS_MAX];
    const char *output;
    bool parents;
    struct fl_merge_options wanted;
    struct cli_job job; /* holds the error of the arguments */
};

static const struct argp_option options[] = {
    {"output", 'o', "IMAGE.exr", 0, "Write the picture here", 0},
    {"parents", KEY_PARENTS, NULL, 0, "Make the folder of the picture if it is missing", 0},
    {"any-device", KEY_ANY_DEVICE, NULL, 0,
     "Merge parts that different devices or drivers have rendered, whose pixels differ by rounding", 0},
    {0}};

static error_t check_all(struct merging *merging)
{
    if (merging->wanted.part_count == 0) {
        cli_usage(&merging->job, "PART", "no part is named");
        fl_error_remedy(&merging->job.error, "farlight merge parts/*.exr -o picture.exr");
        return EINVAL;
    }
    if (!merging->output || cli_image_by_path(merging->output) != CLI_IMAGE_EXR) {
        cli_usage(&merging->job, "--output", "the picture of all parts is an EXR file, as they are");
        fl_error_remedy(&merging->job.error, "-o picture.exr");
        return EINVAL;
    }
    return 0;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct merging *merging = state->input;
    switch (key) {
    case 'o':
        merging->output = value;
        return 0;
    case KEY_PARENTS:
        merging->parents = true;
        return 0;
    case KEY_ANY_DEVICE:
        merging->wanted.any_device = true;
        return 0;
    case ARGP_KEY_ARG:
        if (merging->wanted.part_count == SQUARES_PARTS_MAX)
            return cli_usage(&merging->job, value, "is more than the %u parts that a picture can have",
                             SQUARES_PARTS_MAX);
        merging->parts[merging->wanted.part_count++] = value;
        return 0;
    case ARGP_KEY_END:
        return check_all(merging);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool merge(struct merging *merging, struct fl_error *error)
{
    struct fl_merge_options *wanted = &merging->wanted;
    char folder[4097];
    wanted->parts = merging->parts;
    wanted->path = merging->output;
    wanted->folder = folder;
    wanted->interrupt_fd = cli_interrupt_fd();
    return cli_check_not_input(wanted->path, "--output", wanted->parts, wanted->part_count, error) &&
           cli_check_output(wanted->path, folder, sizeof(folder), error) &&
           cli_check_folder(wanted->path, folder, merging->parents, error) && cli_make_folder(folder, error) &&
           fl_merge(wanted, error);
}

int cli_merge(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "PART... -o IMAGE.exr",
        .doc =
            "Join the parts of a picture that 'farlight render --part' wrote, in any order. Each of them must be "
            "there once, and all must be of the same model, camera, options and version."};
    struct merging merging = {0};
    struct fl_error error = {0};
    if (cli_parse(&argp, argc, argv, 0, &merging) != 0)
        return cli_report(&merging.job.error);
    return cli_interrupt_begin(&error) && merge(&merging, &error) ? CLI_DONE : cli_report(&error);
}
