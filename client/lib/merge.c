/* SPDX-License-Identifier: MIT */
/* Merging the parts of a picture, in the program that writes images. */
#include "lib/merge.h"
#include "lib/helper.h"
#include "protocol/common/squares.h"

#define ANSWER_NS 3600000000000ull /* enough for 512 parts of the largest pictures */

static bool take_answer(struct fl_helper *helper, struct fl_error *error)
{
    struct message message;
    if (!fl_helper_receive(helper, &message, error))
        return false;
    if (message.type == MESSAGE_OK)
        return true;
    if (message.type != MESSAGE_ERROR)
        return fl_error_set(error, FL_ERROR_PROTOCOL, helper->program,
                            "the answer to a merge has the wrong type: %s", message_type_text(message.type));
    fl_error_from_message(error, &message.error);
    error->code = FL_ERROR_FILE;
    return false;
}

bool fl_merge(const struct fl_merge_options *options, struct fl_error *error)
{
    static const char *const first[] = {"--merge", "--format", "exr", "--folder"};
    const char *arguments[sizeof(first) / sizeof(first[0]) + 2 + SQUARES_PARTS_MAX + 1];
    size_t count = 0;
    if (options->part_count == 0 || options->part_count > SQUARES_PARTS_MAX)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "%zu parts cannot be merged: 1 to %u can",
                            options->part_count, SQUARES_PARTS_MAX);
    for (; count < sizeof(first) / sizeof(first[0]); count++)
        arguments[count] = first[count];
    arguments[count++] = options->folder;
    arguments[count++] = "--";
    for (size_t i = 0; i < options->part_count; i++)
        arguments[count++] = options->parts[i];
    arguments[count] = NULL;
    struct fl_helper helper = {.stream = {.fd = -1},
                               .process = {.talk_fd = -1},
                               .program = "farlight-export",
                               .what = "the image writer",
                               .interrupt_fd = options->interrupt_fd,
                               .answer_ns = ANSWER_NS,
                               .request = 1};
    struct message message = {.type = MESSAGE_MERGE_IMAGES};
    message.merge_images.any_device = options->any_device ? 1 : 0;
    message.merge_images.path = options->path;
    const bool merged = fl_helper_start(&helper, arguments, error) && fl_helper_send(&helper, &message, error) &&
                        fl_helper_flush(&helper, error) && take_answer(&helper, error);
    fl_helper_finish(&helper);
    return merged;
}
