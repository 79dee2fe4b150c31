/* SPDX-License-Identifier: MIT */
/* The stream of requests: pictures to be written, files to be compared. */
#include "serve.h"
#include "file.h"
#include "image.h"
#include "protocol/framing.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#define TEXT_MAX 512
#define FIELD_MAX 128

/* What has come of the file that is being received. */
struct request {
    uint32_t number;
    char path[4097], format[17], model[4097];
    bool half, named, begun;
    unsigned quality;
    struct message_frame_begin begin;
    uint8_t *pixels;
    uint64_t received_bytes;
    char reason[TEXT_MAX]; /* why nothing will come of it; empty: nothing yet */
};

struct exporter {
    const struct serve_options *options;
    uint8_t *buffer;
    size_t start, end;
    struct scratch scratch;
    struct request request;
};

#define BUFFER_BYTES (2u * FRAMING_MESSAGE_MAX_BYTES)

/* ---- answers ---- */

/* The longest beginning that does not end within a UTF-8 character. */
static void cut_text(char *text, size_t greatest)
{
    size_t length = strlen(text);
    if (length <= greatest)
        return;
    length = greatest;
    while (length > 0 && ((unsigned char)text[length] & 0xc0) == 0x80)
        length--;
    text[length] = '\0';
}

static bool send_all(int fd, const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        const ssize_t sent = send(fd, bytes, count, MSG_NOSIGNAL);
        if (sent < 0 && errno != EINTR)
            return false;
        if (sent > 0) {
            bytes += sent;
            count -= (size_t)sent;
        }
    }
    return true;
}

static bool send_message(struct exporter *exporter, uint32_t number, const struct message *message)
{
    uint8_t bytes[2048];
    struct writer writer;
    writer_init(&writer, bytes, sizeof bytes);
    return message_write(&writer, number, 0, message) && send_all(exporter->options->fd, bytes, writer.used_bytes);
}

/* `field` and `reason` are shortened to what a message holds; `remedy` may be NULL. */
static bool send_failure(struct exporter *exporter, uint32_t number, char *field, char *reason, const char *remedy)
{
    struct message message = {.type = MESSAGE_ERROR};
    cut_text(field, FIELD_MAX);
    cut_text(reason, TEXT_MAX - 1);
    message.error.code = PROTOCOL_ERROR_CODE_INVALID;
    message.error.field = field;
    message.error.text = reason;
    message.error.remedy = remedy != NULL ? remedy : "";
    if (send_message(exporter, number, &message))
        return true;
    /* The library's text was no UTF-8. */
    message.error.field = "";
    message.error.text = "no more can be said";
    return send_message(exporter, number, &message);
}

static bool answer(struct exporter *exporter)
{
    struct request *request = &exporter->request;
    char field[] = "";
    if (request->reason[0] != '\0')
        return send_failure(exporter, request->number, field, request->reason, NULL);
    return send_message(exporter, request->number, &(struct message){.type = MESSAGE_OK});
}

/* ---- one file ---- */

static void start_request(struct request *request, uint32_t number, const struct message_export_image *wanted)
{
    free(request->pixels);
    *request = (struct request){.number = number, .named = true};
    request->half = wanted->half != 0;
    request->quality = wanted->quality;
    snprintf(request->path, sizeof request->path, "%s", wanted->path);
    snprintf(request->format, sizeof request->format, "%s", wanted->format);
    snprintf(request->model, sizeof request->model, "%s", wanted->model);
    if (image_format_of(request->path, request->format) == IMAGE_UNKNOWN)
        snprintf(request->reason, sizeof request->reason, "the ending names no format that can be written");
}

static size_t bytes_per_pixel(enum protocol_pixel_format format)
{
    return format == PROTOCOL_PIXEL_FORMAT_RGBA8 ? 4 : format == PROTOCOL_PIXEL_FORMAT_RGBA16F ? 8 : 16;
}

/* False: the sender breaks the protocol. */
static bool begin_frame(struct request *request, const struct message_frame_begin *begin)
{
    const uint64_t bytes = (uint64_t)begin->width * begin->height * bytes_per_pixel(begin->format);
    if (!request->named || request->begun || begin->encoding != PROTOCOL_ENCODING_RAW ||
        begin->size_bytes != bytes)
        return false;
    request->begun = true;
    request->begin = *begin;
    request->pixels = malloc((size_t)bytes);
    if (request->pixels == NULL && request->reason[0] == '\0')
        snprintf(request->reason, sizeof request->reason, "no memory for a picture of %ux%u", begin->width,
                 begin->height);
    return true;
}

static bool take_data(struct request *request, const struct message_frame_data *data)
{
    if (!request->begun || data->offset_bytes != request->received_bytes ||
        data->data_bytes > request->begin.size_bytes - request->received_bytes)
        return false;
    if (request->pixels != NULL && data->data_bytes > 0)
        memcpy(request->pixels + request->received_bytes, data->data, data->data_bytes);
    request->received_bytes += data->data_bytes;
    return true;
}

static void write_image(struct exporter *exporter, const struct message_frame_end *end)
{
    struct request *request = &exporter->request;
    const struct image image = {.format = image_format_of(request->path, request->format),
                                .half = request->half,
                                .quality = request->quality,
                                .frames_per_second = exporter->options->frames_per_second,
                                .model = request->model,
                                .begin = &request->begin,
                                .end = end,
                                .pixels = request->pixels};
    uint8_t *file = NULL;
    size_t file_bytes = 0;
    if (image_encode(&image, &file, &file_bytes, request->reason, sizeof request->reason))
        file_write(request->path, file, file_bytes, request->reason, sizeof request->reason);
    else if (request->reason[0] == '\0')
        snprintf(request->reason, sizeof request->reason, "cannot be encoded");
    free(file);
}

static bool end_frame(struct exporter *exporter, const struct message_frame_end *end)
{
    struct request *request = &exporter->request;
    if (!request->begun || request->received_bytes != request->begin.size_bytes)
        return false;
    if (request->reason[0] == '\0')
        write_image(exporter, end);
    const bool answered = answer(exporter);
    free(request->pixels);
    *request = (struct request){0};
    return answered;
}

/* ---- one comparison ---- */

/* The files are those that were named at the start: a message opens nothing. */
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
    if (a == NULL || b == NULL)
        return false;
    if (!compare_images(wanted, a, b, &result))
        return send_failure(exporter, number, result.field, result.reason, result.remedy);
    const struct message message = {.type = MESSAGE_IMAGES_COMPARED, .images_compared = result.answer};
    return send_message(exporter, number, &message);
}

static bool handle(struct exporter *exporter, uint32_t number, const struct message *message)
{
    if (message->type == MESSAGE_COMPARE_IMAGES)
        return !exporter->request.named && compare(exporter, number, &message->compare_images);
    if (message->type != MESSAGE_EXPORT_IMAGE && number != exporter->request.number)
        return false;
    switch (message->type) {
    case MESSAGE_EXPORT_IMAGE:
        if (exporter->request.named)
            return false;
        start_request(&exporter->request, number, &message->export_image);
        return true;
    case MESSAGE_FRAME_BEGIN:
        return begin_frame(&exporter->request, &message->frame_begin);
    case MESSAGE_FRAME_DATA:
        return take_data(&exporter->request, &message->frame_data);
    case MESSAGE_FRAME_END:
        return end_frame(exporter, &message->frame_end);
    default:
        return false;
    }
}

/* ---- the stream ---- */

/* Reads what is there; 0 at its end, -1 on failure. */
static int read_more(struct exporter *exporter)
{
    memmove(exporter->buffer, exporter->buffer + exporter->start, exporter->end - exporter->start);
    exporter->end -= exporter->start;
    exporter->start = 0;
    for (;;) {
        const ssize_t got =
            recv(exporter->options->fd, exporter->buffer + exporter->end, BUFFER_BYTES - exporter->end, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got > 0)
            exporter->end += (size_t)got;
        return got > 0 ? 1 : got < 0 ? -1 : 0;
    }
}

static bool refuse(const char *field, const char *text)
{
    fprintf(stderr, "farlight-export: %s%s%s\n", field, field[0] != '\0' ? ": " : "", text);
    return false;
}

static bool answer_requests(struct exporter *exporter)
{
    for (;;) {
        struct frame frame;
        struct message message;
        struct decode_error why = {0};
        const enum framing_result result =
            framing_parse(&frame, exporter->buffer + exporter->start, exporter->end - exporter->start,
                          MESSAGE_FROM_SERVER | MESSAGE_FROM_LOCAL, &why);
        if (result == FRAMING_FATAL)
            return refuse(why.field, why.text);
        if (result == FRAMING_NEED_MORE) {
            const int got = read_more(exporter);
            if (got < 0)
                return refuse("", strerror(errno));
            if (got == 0) /* an unfinished picture is dropped: nothing of it is on the disk */
                return true;
            continue;
        }
        exporter->start += frame.consumed_bytes;
        if (frame.info == NULL)
            continue;
        scratch_reset(&exporter->scratch);
        if (!message_decode(&message, frame.header.type, frame.payload, frame.header.payload_bytes,
                            &exporter->scratch, &why))
            return refuse(why.field, why.text);
        if (!handle(exporter, frame.header.request, &message))
            return refuse(frame.info->name, "does not belong here");
    }
}

bool serve(const struct serve_options *options)
{
    struct exporter exporter = {.options = options};
    uint8_t *scratch = malloc(SCRATCH_BYTES);
    exporter.buffer = malloc(BUFFER_BYTES);
    bool good = scratch != NULL && exporter.buffer != NULL;
    if (good) {
        scratch_init(&exporter.scratch, scratch, SCRATCH_BYTES);
        good = answer_requests(&exporter);
    } else {
        refuse("", "out of memory");
    }
    free(exporter.request.pixels);
    free(exporter.buffer);
    free(scratch);
    return good;
}
