/* SPDX-License-Identifier: MIT */
/* The loop of requests: pictures to write, files to compare or merge. */
#include "serve.h"
#include "helper/channel.h"
#include "helper/file.h"
#include "image.h"
#include "helper/incoming.h"
#include "library.h"
#include "mattes.h"
#include "merge.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT_MAX 512

#define TEXTS_MAX 16384u

struct text {
    struct message_export_text wanted;
    char text[257];
};

/* The request whose picture is being received. */
struct request {
    uint32_t number;
    char path[4097], format[17], model[4097], part[401];
    bool half, named;
    float origin[3];
    unsigned quality;
    struct text *texts; /* drawn into the picture */
    size_t text_count;
    struct incoming incoming;
    char reason[TEXT_MAX]; /* reason of a failure; empty: none */
};

struct exporter {
    const struct serve_options *options;
    struct channel channel;
    struct request request;
    struct mattes *mattes; /* owned; NULL: no names have arrived */
};

/* ---- one file ---- */

static void start_request(struct request *request, uint32_t number, const struct message_export_image *wanted)
{
    *request = (struct request){.number = number, .named = true};
    request->half = wanted->half != 0;
    request->quality = wanted->quality;
    memcpy(request->origin, wanted->origin, sizeof(request->origin));
    snprintf(request->path, sizeof(request->path), "%s", wanted->path);
    snprintf(request->format, sizeof(request->format), "%s", wanted->format);
    snprintf(request->model, sizeof(request->model), "%s", wanted->model);
    snprintf(request->part, sizeof(request->part), "%s", wanted->part);
    if (image_format_of(request->path, request->format) == IMAGE_UNKNOWN)
        snprintf(request->reason, sizeof(request->reason), "the ending names no format that can be written");
}

/* False: the sender breaks the protocol. */
static bool begin_frame(struct request *request, const struct message_frame_begin *begin)
{
    if (!request->named || !incoming_begin(&request->incoming, begin, true))
        return false;
    if (!request->incoming.pixels && request->reason[0] == '\0')
        snprintf(request->reason, sizeof(request->reason), "no memory for a picture of %ux%u", begin->width,
                 begin->height);
    return true;
}

/* False: the sender breaks the protocol. */
static bool take_text(struct request *request, const struct message_export_text *wanted)
{
    if (!request->named || request->incoming.begun || request->text_count == TEXTS_MAX)
        return false;
    struct text *grown = realloc(request->texts, (request->text_count + 1) * sizeof(*grown));
    if (!grown) {
        snprintf(request->reason, sizeof(request->reason), "no memory for text");
        return true;
    }
    request->texts = grown;
    struct text *text = &grown[request->text_count++];
    text->wanted = *wanted;
    snprintf(text->text, sizeof(text->text), "%s", wanted->text);
    return true;
}

static bool draw_texts(struct request *request)
{
    const struct message_frame_begin *begin = &request->incoming.begin;
    const struct raster raster = {begin->width, begin->height, 4, 1, request->incoming.pixels};
    const struct image_library *library =
        request->text_count > 0 ? library_loaded(request->reason, sizeof(request->reason)) : NULL;
    if (request->text_count == 0)
        return true;
    if (!library)
        return false;
    if (begin->format != PROTOCOL_PIXEL_FORMAT_RGBA8) {
        snprintf(request->reason, sizeof(request->reason), "text can be drawn into 8-bit pictures only");
        return false;
    }
    for (size_t i = 0; i < request->text_count; i++) {
        request->texts[i].wanted.text = request->texts[i].text;
        if (!library->draw(&raster, &request->texts[i].wanted, request->reason, sizeof(request->reason)))
            return false;
    }
    return true;
}

static void write_image(struct exporter *exporter, const struct message_frame_end *end)
{
    struct request *request = &exporter->request;
    const struct image image = {.format = image_format_of(request->path, request->format),
                                .half = request->half,
                                .dwaa = exporter->options->dwaa,
                                .light_groups = exporter->options->light_groups,
                                .quality = request->quality,
                                .frames_per_second = exporter->options->frames_per_second,
                                .full_metadata = exporter->options->full_metadata,
                                .window = exporter->options->window,
                                .model = request->model,
                                .part = request->part,
                                .mattes = exporter->mattes,
                                .colour_space = exporter->options->colour.space,
                                .display_view = exporter->options->colour.view,
                                .chromaticities = colour_chromaticities(),
                                .origin = request->origin,
                                .begin = &request->incoming.begin,
                                .end = end,
                                .pixels = request->incoming.pixels};
    uint8_t *file = NULL;
    size_t file_bytes = 0;
    if (image_encode(&image, &file, &file_bytes, request->reason, sizeof(request->reason)))
        file_write(request->path, file, file_bytes, request->reason, sizeof(request->reason));
    else if (request->reason[0] == '\0')
        snprintf(request->reason, sizeof(request->reason), "cannot be encoded");
    free(file);
}

static bool answer(struct exporter *exporter)
{
    const struct request *request = &exporter->request;
    if (request->reason[0] != '\0')
        return channel_send_failure(
            &exporter->channel, request->number,
            &(struct channel_failure){.field = "", .reason = request->reason, .retryable = file_lacked_space()});
    return channel_send(&exporter->channel, request->number, &(struct message){.type = MESSAGE_OK});
}

static bool end_frame(struct exporter *exporter, const struct message_frame_end *end)
{
    struct request *request = &exporter->request;
    if (!incoming_is_whole(&request->incoming))
        return false;
    if (request->reason[0] == '\0' &&
        colour_convert(&request->incoming.begin, request->incoming.pixels, request->reason,
                       sizeof(request->reason)) &&
        draw_texts(request))
        write_image(exporter, end);
    const bool answered = answer(exporter);
    incoming_finish(&request->incoming);
    free(request->texts);
    *request = (struct request){0};
    return answered;
}

/* ---- one comparison ---- */

/* Files were named at the start, so that a message opens nothing. */
static const struct compare_file *find_file(const struct exporter *exporter, const char *path)
{
    for (size_t i = 0; i < exporter->options->file_count; i++)
        if (strcmp(exporter->options->files[i].path, path) == 0)
            return &exporter->options->files[i];
    return NULL;
}

static bool compare(struct exporter *exporter, uint32_t number, const struct message_compare_images *wanted)
{
    struct compare_result result = {0};
    const struct compare_file *a = find_file(exporter, wanted->a), *b = find_file(exporter, wanted->b);
    if (!a || !b)
        return false;
    if (!compare_images(wanted, a, b, &result))
        return channel_send_failure(&exporter->channel, number,
                                    &(struct channel_failure){.field = result.field,
                                                              .reason = result.reason,
                                                              .remedy = result.remedy,
                                                              .retryable = file_lacked_space()});
    const struct message message = {.type = MESSAGE_IMAGES_COMPARED, .images_compared = result.answer};
    return channel_send(&exporter->channel, number, &message);
}

/* ---- one picture of many parts ---- */

static bool merge(struct exporter *exporter, uint32_t number, const struct message_merge_images *wanted)
{
    struct merge_result result = {0};
    if (merge_images(wanted, exporter->options->files, exporter->options->file_count, &result))
        return channel_send(&exporter->channel, number, &(struct message){.type = MESSAGE_OK});
    return channel_send_failure(&exporter->channel, number,
                                &(struct channel_failure){.field = result.field,
                                                          .reason = result.reason,
                                                          .remedy = result.remedy,
                                                          .retryable = file_lacked_space()});
}

/* ---- any message ---- */

static bool handle(void *user, uint32_t number, const struct message *message)
{
    struct exporter *exporter = user;
    struct request *request = &exporter->request;
    if (message->type == MESSAGE_COMPARE_IMAGES)
        return !request->named && compare(exporter, number, &message->compare_images);
    if (message->type == MESSAGE_MERGE_IMAGES)
        return !request->named && merge(exporter, number, &message->merge_images);
    if (message->type == MESSAGE_EXPORT_NAME)
        return !request->named && mattes_name(&exporter->mattes, &message->export_name);
    if (message->type != MESSAGE_EXPORT_IMAGE && number != request->number)
        return false;
    switch (message->type) {
    case MESSAGE_EXPORT_IMAGE:
        if (request->named)
            return false;
        start_request(request, number, &message->export_image);
        return true;
    case MESSAGE_EXPORT_TEXT:
        return take_text(request, &message->export_text);
    case MESSAGE_FRAME_BEGIN:
        return begin_frame(request, &message->frame_begin);
    case MESSAGE_FRAME_DATA:
        return incoming_take(&request->incoming, &message->frame_data);
    case MESSAGE_FRAME_END:
        return end_frame(exporter, &message->frame_end);
    default:
        return false;
    }
}

/* False: the other side has closed. */
static bool answer_for_colours(const struct exporter *exporter)
{
    char reason[TEXT_MAX] = "";
    const struct colour_wanted *wanted = &exporter->options->colour;
    if (!colour_is_wanted(wanted))
        return true;
    if (colour_prepare(wanted, reason, sizeof(reason)))
        return channel_send(&exporter->channel, 0, &(struct message){.type = MESSAGE_OK});
    return channel_send_failure(
        &exporter->channel, 0,
        &(struct channel_failure){.field = wanted->view ? "display_view" : "colour_space", .reason = reason});
}

bool serve(const struct serve_options *options)
{
    struct exporter exporter = {.options = options};
    exporter.channel =
        (struct channel){.fd = options->fd, .program = "farlight-export", .handle = handle, .user = &exporter};
    /* An unfinished picture is dropped; it has no file yet. */
    const bool good = answer_for_colours(&exporter) && channel_run(&exporter.channel);
    incoming_finish(&exporter.request.incoming);
    free(exporter.request.texts);
    mattes_destroy(exporter.mattes);
    return good;
}
