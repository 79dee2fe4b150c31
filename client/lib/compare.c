/* SPDX-License-Identifier: MIT */
/* Compares images with the exporter program: two files in, figures and a picture of the errors out. */
#include "lib/connection.h"
#include "lib/text.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEFAULT_TIMEOUT_MS 600000u

/* A comparison and the program that makes it, which ends with it. */
struct judge {
    struct fl_stream stream;
    struct fl_process process;
    const struct fl_compare_options *options;
    uint64_t deadline_ns;
    char label_a[129], label_b[129];
};

/* ---- start ---- */

/* The protocol's texts are UTF-8: another path would not arrive unchanged. */
static bool check_path(const char *path, struct fl_error *error)
{
    char plain[4097];
    fl_text_utf8(path, plain, sizeof(plain));
    return strcmp(path, plain) == 0 ||
           fl_error_set(error, FL_ERROR_FILE, plain, "an image's path must be UTF-8 of at most 4096 bytes");
}

static bool check_options(const struct fl_compare_options *options, struct fl_error *error)
{
    if (!options->a || !options->b)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "two image files are needed");
    if (!check_path(options->a, error) || !check_path(options->b, error) ||
        (options->picture && !check_path(options->picture, error)))
        return false;
    if (!isfinite(options->threshold) || options->threshold > 1e9f)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "threshold", "must be a number up to 1e9");
    if (!(options->heat_top >= 0) || options->heat_top > 1e9f)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "heat_top", "must be a number from 0 to 1e9");
    return true;
}

static const char *file_part(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* The folder of the picture, as the program's argument. */
static bool folder_of(const char *path, char *folder, size_t folder_bytes, struct fl_error *error)
{
    const char *slash = strrchr(path, '/');
    const size_t length = !slash || slash == path ? 1 : (size_t)(slash - path);
    if (length >= folder_bytes)
        return fl_error_set(error, FL_ERROR_FILE, "", "the path of the picture is too long");
    memcpy(folder, !slash ? "." : path, length);
    folder[length] = '\0';
    return true;
}

static bool start(struct judge *judge, struct fl_error *error)
{
    const struct fl_compare_options *options = judge->options;
    char folder[4097];
    if (options->picture && !folder_of(options->picture, folder, sizeof(folder), error))
        return false;
    const char *const arguments[] = {
        "--read", options->a, "--read", options->b, options->picture ? "--folder" : NULL, folder, NULL};
    int fd = -1;
    return fl_process_start(&judge->process, "farlight-export", FL_WIRING_DESCRIPTOR, arguments, &fd, error) &&
           fl_stream_init(&judge->stream, fd, MESSAGE_FROM_SERVER | MESSAGE_FROM_LOCAL, "the image program",
                          error);
}

static bool send_request(struct judge *judge, struct fl_error *error)
{
    const struct fl_compare_options *options = judge->options;
    struct message message = {.type = MESSAGE_COMPARE_IMAGES};
    struct message_compare_images *wanted = &message.compare_images;
    const float threshold = options->threshold;
    wanted->ignore_alpha = options->ignore_alpha ? 1 : 0;
    wanted->threshold = threshold < 0 ? 0 : threshold > 0 ? threshold : FL_THRESHOLD_DEFAULT;
    wanted->heat_top = options->heat_top;
    wanted->layout = options->layout;
    wanted->tone_map = options->tone_map;
    wanted->a = options->a;
    wanted->b = options->b;
    wanted->picture = options->picture;
    wanted->format = options->picture_format;
    fl_text_utf8(options->label_a ? options->label_a : file_part(options->a), judge->label_a,
                 sizeof(judge->label_a));
    fl_text_utf8(options->label_b ? options->label_b : file_part(options->b), judge->label_b,
                 sizeof(judge->label_b));
    wanted->label_a = judge->label_a;
    wanted->label_b = judge->label_b;
    return fl_stream_push(&judge->stream, 1, 0, &message, error);
}

/* ---- the answer ---- */

static double psnr_db(float rms_error)
{
    return rms_error > 0 ? -20 * log10((double)rms_error) : (double)INFINITY;
}

static void take(struct fl_comparison *to, const struct message_images_compared *from)
{
    to->width = from->width;
    to->height = from->height;
    to->channels = from->channels;
    snprintf(to->channel_names, sizeof(to->channel_names), "%s", from->channel_names);
    to->space = from->space;
    to->pixels = (uint64_t)from->width * from->height;
    to->nonfinite_a = from->nonfinite_a;
    to->nonfinite_b = from->nonfinite_b;
    to->nonfinite = from->nonfinite;
    to->beyond = from->beyond;
    to->has_errors = from->nonfinite < to->pixels;
    to->identical = from->nonfinite == 0 && !(from->max_error > 0);
    to->mean_error = (double)from->mean_error;
    to->rms_error = (double)from->rms_error;
    to->psnr_db = psnr_db(from->rms_error);
    to->shown_psnr_db = psnr_db(from->shown_rms_error);
    to->max_error = (double)from->max_error;
    to->max_error_x = from->max_error_x;
    to->max_error_y = from->max_error_y;
    to->max_error_channel = from->max_error_channel;
    to->has_ssim = from->has_ssim != 0;
    to->ssim = (double)from->ssim;
    to->has_butteraugli = from->has_butteraugli != 0;
    to->butteraugli = (double)from->butteraugli;
    to->butteraugli_max = (double)from->butteraugli_max;
    to->visible = from->visible;
    to->heat_top = (double)from->heat_top;
    to->picture_width = from->picture_width;
    to->picture_height = from->picture_height;
}

/* False for impossible counts, which would give impossible shares and positions. */
static bool is_sound(const struct message_images_compared *answer)
{
    const uint64_t pixels = (uint64_t)answer->width * answer->height;
    return answer->nonfinite <= pixels && answer->nonfinite_a <= answer->nonfinite &&
           answer->nonfinite_b <= answer->nonfinite && answer->beyond <= pixels && answer->visible <= pixels &&
           answer->max_error_x < answer->width && answer->max_error_y < answer->height &&
           answer->max_error_channel < answer->channels;
}

static bool explain(struct judge *judge, struct fl_error *error)
{
    char words[520];
    fl_process_last_words(&judge->process, 1000, words, sizeof(words));
    return fl_error_set(error, FL_ERROR_SYSTEM, "farlight-export", "the image program failed%s%s",
                        words[0] != '\0' ? ": " : "", words);
}

static bool receive(struct judge *judge, struct fl_comparison *comparison, struct fl_error *error)
{
    for (;;) {
        struct frame frame;
        struct message message;
        const enum fl_stream_result result = fl_stream_next(&judge->stream, &frame, &message, error);
        if (result == FL_STREAM_ERROR)
            return false;
        if (result == FL_STREAM_MESSAGE) {
            if (message.type == MESSAGE_ERROR) {
                fl_error_from_message(error, &message.error);
                error->code = FL_ERROR_FILE;
                return false;
            }
            if (message.type != MESSAGE_IMAGES_COMPARED || !is_sound(&message.images_compared))
                return fl_error_set(error, FL_ERROR_PROTOCOL, "farlight-export",
                                    "the answer to a comparison has the wrong type (%s)",
                                    message_type_text(message.type));
            take(comparison, &message.images_compared);
            return true;
        }
        if (judge->stream.ended)
            return explain(judge, error);
        struct pollfd polled = {.fd = judge->stream.fd, .events = fl_stream_events(&judge->stream)};
        if (!fl_wait(&polled, 1, judge->options->interrupt_fd, judge->deadline_ns, error) ||
            !fl_stream_transfer(&judge->stream, error))
            return false;
    }
}

bool fl_compare(const struct fl_compare_options *options, struct fl_comparison *comparison, struct fl_error *error)
{
    if (!check_options(options, error))
        return false;
    const unsigned timeout_ms = options->timeout_ms > 0 ? options->timeout_ms : DEFAULT_TIMEOUT_MS;
    struct judge judge = {.stream = {.fd = -1},
                          .process = {.talk_fd = -1},
                          .options = options,
                          .deadline_ns = monotonic_now_ns() + timeout_ms * 1000000ull};
    const float threshold = options->threshold;
    *comparison = (struct fl_comparison){.threshold = threshold < 0   ? 0
                                                      : threshold > 0 ? threshold
                                                                      : FL_THRESHOLD_DEFAULT};
    const bool done = start(&judge, error) && send_request(&judge, error) && receive(&judge, comparison, error);
    fl_stream_finish(&judge.stream);
    /* After a failure the program may be drawing a picture that is no longer needed; it removes unfinished
     * files on a signal. */
    fl_process_end(&judge.process, done ? 5000 : 0);
    return done;
}
