/* SPDX-License-Identifier: MIT */
/* farlight verify: checks that the pictures of an animation exist and are unchanged. */
#include "commands.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"
#include "digest.h"
#include "lib/text.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/plain_text.h"

enum { KEY_FRAMES = 0x400, KEY_JSON, KEY_QUIET = 'q' };

struct verifying {
    const char *path;
    bool json, quiet, has_range;
    struct fl_frame_run range;
    struct cli_job job; /* holds an option's error */
    uint32_t counts[DIGEST_STATE_COUNT];
    json_t *bad;
};

static const struct argp_option options[] = {
    {"frames", KEY_FRAMES, "A-B[:STEP]", 0, "Frames that must exist; needs a pattern", 0},
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on one line", 0},
    {"quiet", KEY_QUIET, NULL, 0, "Print nothing; the exit status gives the result", 0},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct verifying *wanted = state->input;
    switch (key) {
    case KEY_FRAMES:
        wanted->has_range = true;
        if (fl_text_range(value, &wanted->range.first, &wanted->range.last, &wanted->range.step,
                          &wanted->job.error))
            return 0;
        snprintf(wanted->job.error.field, sizeof(wanted->job.error.field), "--frames");
        return EINVAL;
    case KEY_JSON:
        wanted->json = true;
        return 0;
    case KEY_QUIET:
        wanted->quiet = true;
        return 0;
    case ARGP_KEY_ARG:
        if (wanted->path)
            return cli_usage(&wanted->job, value, "is an argument too many");
        wanted->path = value;
        return 0;
    case ARGP_KEY_END:
        if (wanted->path)
            return 0;
        cli_usage(&wanted->job, "FOLDER", "no folder is named, and no pattern of pictures");
        fl_error_remedy(&wanted->job.error, "farlight verify FOLDER, or 'FOLDER/%%04d.exr' --frames 1-120");
        return EINVAL;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- pictures ---- */

static void check(struct verifying *wanted, const char *path)
{
    const enum digest_state state = digest_check(path);
    wanted->counts[state]++;
    if (state == DIGEST_AGREES || wanted->quiet)
        return;
    char plain[4400];
    plain_text_copy(plain, sizeof(plain), path);
    if (wanted->json)
        json_array_append_new(wanted->bad,
                              json_pack("{s:s,s:s}", "path", plain, "state", digest_state_text(state)));
    else
        printf("%s: %s\n", plain, digest_state_text(state));
}

static bool check_frames(struct verifying *wanted, struct fl_error *error)
{
    struct fl_pattern pattern;
    char path[4352];
    if (!fl_pattern_parse(wanted->path, &pattern, error))
        return false;
    const struct fl_frame_run *range = &wanted->range;
    for (uint64_t frame = range->first; frame <= range->last; frame += range->step) {
        if (!fl_pattern_path(&pattern, (uint32_t)frame, path, sizeof(path)))
            return fl_error_set(error, FL_ERROR_ARGUMENT, wanted->path, "the path of a frame is too long");
        check(wanted, path);
    }
    return true;
}

static int has_digest_ending(const struct dirent *entry)
{
    const size_t length = strlen(entry->d_name), ending = strlen(DIGEST_ENDING);
    return length > ending && strcmp(entry->d_name + length - ending, DIGEST_ENDING) == 0;
}

static bool check_folder(struct verifying *wanted, struct fl_error *error)
{
    struct dirent **entries = NULL;
    const int count = scandir(wanted->path, &entries, has_digest_ending, alphasort);
    if (count < 0)
        return fl_error_set(error, FL_ERROR_FILE, wanted->path, "cannot be read: %s", strerror(errno));
    for (int i = 0; i < count; i++) {
        char path[4352];
        const size_t length = strlen(entries[i]->d_name) - strlen(DIGEST_ENDING);
        if (snprintf(path, sizeof(path), "%s/%.*s", wanted->path, (int)length, entries[i]->d_name) <
            (int)sizeof(path))
            check(wanted, path);
        else
            wanted->counts[DIGEST_UNREADABLE]++;
        free(entries[i]);
    }
    free(entries);
    if (count > 0)
        return true;
    fl_error_set(error, FL_ERROR_FILE, wanted->path, "no picture in it has a digest");
    return fl_error_remedy(error, "'farlight animate --digests' writes them");
}

/* ---- the report ---- */

static uint32_t report(const struct verifying *wanted)
{
    uint32_t all = 0;
    for (int state = 0; state < DIGEST_STATE_COUNT; state++)
        all += wanted->counts[state];
    const uint32_t good = wanted->counts[DIGEST_AGREES];
    if (wanted->json) {
        json_t *object =
            json_pack("{s:I,s:I,s:O}", "pictures", (json_int_t)all, "good", (json_int_t)good, "bad", wanted->bad);
        json_dumpf(object, stdout, CLI_JSON);
        fputc('\n', stdout);
        json_decref(object);
    } else if (!wanted->quiet) {
        printf("%u picture%s, %u good\n", all, all == 1 ? "" : "s", good);
    }
    return all - good;
}

int cli_verify(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "FOLDER\n'FOLDER/%04d.exr' --frames A-B",
        .doc = "Check the pictures that 'farlight animate --digests' wrote against their digests: all of a folder "
               "that have one, or the frames that must be there."};
    struct verifying wanted = {0};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    struct fl_error error = {0};
    wanted.bad = json_array();
    const bool done = wanted.has_range ? check_frames(&wanted, &error) : check_folder(&wanted, &error);
    const uint32_t bad = done ? report(&wanted) : 0;
    json_decref(wanted.bad);
    return !done ? cli_report(&error) : bad > 0 ? CLI_FAILED : CLI_DONE;
}
