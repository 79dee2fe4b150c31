/* SPDX-License-Identifier: MIT */
/* Assembling a frame from a daemon's messages, and checking each of them. */
#include "lib/frame.h"
#include "lib/frame_decode.h"
#include "lib/stream.h"
#include "protocol/common/clock.h"

#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>

/* The size of a JPEG beyond the worst case of its pixels: tables and markers. */
#define JPEG_EXTRA_BYTES 65536u
#define H264_EXTRA_BYTES 65536u /* tables and markers, as of a JPEG */
#define ATTACHMENT_PIXEL_BYTES 4u

/* Bytes of all layers together; 0: more than a size_t holds. */
static size_t pixels_bytes_of(const struct message_frame_begin *begin)
{
    const uint64_t layers =
        (uint64_t)__builtin_popcount(begin->layers); /* at most 31 layers of 8192 x 8192 x 16 bytes */
    const uint64_t bytes = layers * begin->width * begin->height * fl_bytes_per_pixel(begin->format);
    return bytes <= SIZE_MAX ? (size_t)bytes : 0;
}

void fl_frame_destroy(struct fl_frame *frame)
{
    if (!frame)
        return;
    free(frame->pixels);
    free(frame->stages);
    free(frame->wave_comparisons);
    free(frame->structure);
    free(frame->encoded);
    free(frame->depth);
    free(frame->normals);
    free(frame->sticking);
    free(frame);
}

void fl_assembly_finish(struct fl_assembly *assembly)
{
    if (assembly->frame && assembly->encoded != assembly->frame->pixels)
        free(assembly->encoded);
    fl_frame_destroy(assembly->frame);
    assembly->frame = NULL;
    assembly->encoded = NULL;
}

/* The maximum size of a correctly encoded picture. */
static uint64_t encoded_bytes_max(const struct message_frame_begin *begin, size_t pixels_bytes)
{
    switch (begin->encoding) {
    case PROTOCOL_ENCODING_RAW:
        return pixels_bytes;
    case PROTOCOL_ENCODING_ZSTD:
    case PROTOCOL_ENCODING_PREDICTED:
        return ZSTD_compressBound(pixels_bytes);
    case PROTOCOL_ENCODING_JPEG:
        return tjBufSize((int)begin->width, (int)begin->height, TJSAMP_444) + JPEG_EXTRA_BYTES;
    case PROTOCOL_ENCODING_H264: /* even its uncompressed blocks are no larger than the pixels */
        return pixels_bytes + H264_EXTRA_BYTES;
    default:
        return 0;
    }
}

/* True if the sizes of attachments match the flags; `maximum` is the size of the largest. */
static bool check_attachments(const struct fl_assembly *assembly, const struct message_frame_begin *begin,
                              struct fl_error *error)
{
    const uint64_t maximum = ZSTD_compressBound((size_t)begin->width * begin->height * ATTACHMENT_PIXEL_BYTES);
    const bool has_depth = (begin->attachments & FL_ATTACH_DEPTH) != 0;
    const bool has_normals = (begin->attachments & FL_ATTACH_NORMALS) != 0;
    const bool has_sticking = (begin->attachments & FL_ATTACH_STICKING) != 0;
    const struct fl_frame_expected *const wanted = &assembly->expected;
    const unsigned expected = wanted->is_bare_at_rest && !begin->moving ? 0 : wanted->attachments;
    if (begin->attachments != expected)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.attachments",
                            "attachments %#x arrived, but %#x were expected", begin->attachments, expected);
    if (has_depth != (begin->depth_bytes > 0) || begin->depth_bytes > maximum)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.depth_bytes", "%llu bytes cannot be depths",
                            (unsigned long long)begin->depth_bytes);
    if ((begin->depth_form == PROTOCOL_DEPTH_FORM_INVERSE) != (begin->depth_step > 0.0f) ||
        (begin->depth_step > 0.0f && !has_depth))
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.depth_step", "depths cannot have the step %g",
                            (double)begin->depth_step);
    if (has_normals != (begin->normal_bytes > 0) || begin->normal_bytes > maximum)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.normal_bytes", "%llu bytes cannot be normals",
                            (unsigned long long)begin->normal_bytes);
    return (has_sticking == (begin->sticking_bytes > 0) && begin->sticking_bytes <= maximum) ||
           fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.sticking_bytes",
                        "the sticking map cannot have %llu bytes", (unsigned long long)begin->sticking_bytes);
}

static bool is_expected_size(const struct fl_frame_expected *expected, const struct message_frame_begin *begin)
{
    if (expected->is_view)
        return begin->margin_x <= expected->margin_x_max && begin->margin_y <= expected->margin_y_max &&
               begin->width > 2 * begin->margin_x && begin->width - 2 * begin->margin_x <= expected->width &&
               begin->height > 2 * begin->margin_y && begin->height - 2 * begin->margin_y <= expected->height;
    return begin->width == expected->width && begin->height == expected->height;
}

static bool is_expected_encoding(const struct fl_frame_expected *expected, const struct message_frame_begin *begin)
{
    if (begin->hidden_layer > 0 && expected->encoding == PROTOCOL_ENCODING_H264)
        return begin->encoding == PROTOCOL_ENCODING_JPEG;
    return begin->encoding == expected->encoding ||
           (expected->is_view && begin->encoding == expected->still_encoding);
}

static bool check_begin(const struct fl_assembly *assembly, const struct message_frame_begin *begin,
                        uint32_t number, struct fl_error *error)
{
    const struct fl_frame_expected *expected = &assembly->expected;
    if (assembly->frame)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin",
                            "a frame began before the previous one ended");
    if (expected->is_view ? begin->frame < number : begin->frame != number)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.frame",
                            "frame %u arrived, but frame %u was expected", begin->frame, number);
    if (!is_expected_size(expected, begin) || begin->format != expected->format ||
        !is_expected_encoding(expected, begin))
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin",
                            "%ux%u %s %s arrived, but %ux%u %s %s was expected", begin->width, begin->height,
                            protocol_pixel_format_text(begin->format), protocol_encoding_text(begin->encoding),
                            expected->width, expected->height, protocol_pixel_format_text(expected->format),
                            protocol_encoding_text(expected->encoding));
    if (begin->hidden_layer > expected->hidden_layers ||
        (begin->hidden_layer > 0 && begin->of_frame >= begin->frame))
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.hidden_layer",
                            "hidden layer %u of frame %u arrived, but %u were expected", begin->hidden_layer,
                            begin->of_frame, expected->hidden_layers);
    if (begin->layers != expected->layers)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.layers",
                            "layers %#x arrived, but %#x were expected", begin->layers, expected->layers);
    const size_t pixels_bytes = pixels_bytes_of(begin);
    const uint64_t maximum = encoded_bytes_max(begin, pixels_bytes);
    const bool exact = begin->encoding == PROTOCOL_ENCODING_RAW;
    if (begin->size_bytes == 0 || begin->size_bytes > maximum || (exact && begin->size_bytes != maximum))
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin.size_bytes",
                            "%llu bytes cannot be a picture of %ux%u", (unsigned long long)begin->size_bytes,
                            begin->width, begin->height);
    return check_attachments(assembly, begin, error);
}

/* True for frames that the caller decodes. */
static bool stays_encoded(const struct fl_frame_expected *expected, const struct message_frame_begin *begin)
{
    return begin->encoding == PROTOCOL_ENCODING_H264 ||
           (begin->encoding == PROTOCOL_ENCODING_JPEG && expected->stays_jpeg);
}

static struct fl_frame *new_frame(const struct fl_frame_expected *expected,
                                  const struct message_frame_begin *begin)
{
    struct fl_frame *frame = calloc(1, sizeof(*frame));
    if (!frame)
        return NULL;
    frame->frame = begin->frame;
    frame->width = begin->width;
    frame->height = begin->height;
    frame->samples = begin->samples;
    frame->noise = begin->noise;
    frame->revision = begin->revision;
    frame->format = begin->format;
    frame->encoding = begin->encoding;
    frame->tracer = begin->tracer;
    frame->integrator = begin->integrator;
    frame->digest = begin->digest;
    frame->exposure_stops = begin->exposure_stops;
    memcpy(frame->world_from_view, begin->world_from_view, sizeof(frame->world_from_view));
    frame->fov_y = begin->fov_y;
    frame->ortho_height = begin->ortho_height;
    frame->time_s = begin->time_s;
    frame->aperture = begin->aperture;
    frame->focus = begin->focus;
    frame->shutter_s = begin->shutter_s;
    frame->layers = begin->layers;
    frame->command = begin->command;
    frame->command_received_ns = begin->received_ns;
    frame->command_applied_ns = begin->applied_ns;
    frame->rendered_ns = begin->rendered_ns;
    frame->moving = begin->moving != 0;
    frame->key_frame = begin->key_frame != 0;
    frame->frame_quality = begin->quality;
    frame->depth_step = begin->depth_step;
    frame->margin_x = begin->margin_x;
    frame->margin_y = begin->margin_y;
    frame->depth_bytes = begin->depth_bytes;
    frame->hidden_layer = begin->hidden_layer;
    frame->depth_less = begin->depth_less;
    frame->of_frame = begin->of_frame;
    frame->wire_bytes = begin->size_bytes + begin->depth_bytes + begin->normal_bytes + begin->sticking_bytes;
    frame->parts = 1;
    if (stays_encoded(expected, begin))
        return frame;
    frame->pixels_bytes = pixels_bytes_of(begin);
    frame->pixels = malloc(frame->pixels_bytes);
    if (!frame->pixels) {
        free(frame);
        return NULL;
    }
    return frame;
}

bool fl_assembly_begin(struct fl_assembly *assembly, const struct message_frame_begin *begin, uint32_t number,
                       uint64_t now_ns, struct fl_error *error)
{
    if (!check_begin(assembly, begin, number, error))
        return false;
    const bool in_place = begin->encoding == PROTOCOL_ENCODING_RAW && begin->attachments == 0;
    assembly->frame = new_frame(&assembly->expected, begin);
    if (assembly->frame)
        assembly->encoded = in_place ? assembly->frame->pixels : malloc((size_t)assembly->frame->wire_bytes);
    if (!assembly->frame || !assembly->encoded)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "no memory for a picture of %ux%u", begin->width,
                            begin->height);
    assembly->begin = *begin;
    assembly->encoded_bytes = assembly->frame->wire_bytes;
    assembly->received_bytes = 0;
    fl_parts_init(&assembly->parts, begin);
    assembly->frame->begun_ns = now_ns;
    return true;
}

bool fl_assembly_parts(struct fl_assembly *assembly, const struct message_frame_parts *announced,
                       struct fl_error *error)
{
    if (!assembly->frame || !assembly->expected.parts)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_parts", "parts of a frame arrived unasked");
    if (!fl_parts_set(&assembly->parts, &assembly->begin, announced, error))
        return false;
    const uint64_t bytes = fl_parts_sum(&assembly->parts);
    uint8_t *encoded =
        bytes > assembly->encoded_bytes ? realloc(assembly->encoded, (size_t)bytes) : assembly->encoded;
    if (!encoded)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    assembly->encoded = encoded;
    assembly->encoded_bytes = bytes;
    assembly->frame->parts = announced->parts_count;
    return true;
}

bool fl_assembly_data(struct fl_assembly *assembly, const struct message_frame_data *data, struct fl_error *error)
{
    if (!assembly->frame)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_data", "data arrived outside a frame");
    if (data->offset_bytes != assembly->received_bytes ||
        data->data_bytes > assembly->encoded_bytes - assembly->received_bytes)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_data.offset_bytes",
                            "%u bytes arrived for offset %llu, but %llu of %llu bytes are there", data->data_bytes,
                            (unsigned long long)data->offset_bytes, (unsigned long long)assembly->received_bytes,
                            (unsigned long long)assembly->encoded_bytes);
    fl_parts_put(&assembly->parts, assembly->encoded, data->data, data->data_bytes);
    assembly->received_bytes += data->data_bytes;
    return true;
}

/* Copies into malloc'ed memory; NULL also for no bytes. */
static void *copy(const void *data, size_t bytes)
{
    void *made = bytes > 0 ? malloc(bytes) : NULL;
    if (made)
        memcpy(made, data, bytes);
    return made;
}

/* The strings lie behind the rows. */
static bool copy_structure(struct fl_frame *frame, const struct message_frame_end *end)
{
    size_t bytes = end->structure_count * sizeof(*frame->structure);
    for (uint32_t i = 0; i < end->structure_count; i++)
        bytes += strlen(end->structure[i].name) + strlen(end->structure[i].warning) + 2;
    if (bytes == 0)
        return true;
    struct record_structure_row *rows = malloc(bytes);
    if (!rows)
        return false;
    char *string = (char *)(rows + end->structure_count);
    for (uint32_t i = 0; i < end->structure_count; i++) {
        rows[i] = end->structure[i];
        rows[i].name = string;
        string = stpcpy(string, end->structure[i].name) + 1;
        rows[i].warning = string;
        string = stpcpy(string, end->structure[i].warning) + 1;
    }
    frame->structure = rows;
    frame->structure_count = end->structure_count;
    return true;
}

static bool take_costs(struct fl_frame *frame, const struct message_frame_end *end, struct fl_error *error)
{
    frame->primary_rays = end->primary_rays;
    frame->shadow_rays = end->shadow_rays;
    frame->secondary_rays = end->secondary_rays;
    frame->splits = end->splits;
    frame->device_waits = end->device_waits;
    frame->dispatches = end->dispatches;
    frame->barriers = end->barriers;
    frame->uploaded_bytes = end->uploaded_bytes;
    frame->structure_bytes = end->structure_bytes;
    frame->stages = copy(end->stages, end->stages_count * sizeof(*frame->stages));
    frame->wave_comparisons = copy(end->comparisons, end->comparisons_count * sizeof(*frame->wave_comparisons));
    if ((end->stages_count > 0 && !frame->stages) || (end->comparisons_count > 0 && !frame->wave_comparisons) ||
        !copy_structure(frame, end))
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    frame->stage_count = end->stages_count;
    frame->wave_comparison_count = end->comparisons_count;
    return true;
}

/* Decodes the parts that have arrived. */
static bool decode(const struct fl_assembly *assembly, struct fl_frame *frame, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    const struct fl_parts *parts = &assembly->parts;
    const uint8_t *depth = assembly->encoded + parts->bytes.of[PROTOCOL_FRAME_PART_COLOURS];
    const uint8_t *normals = depth + parts->bytes.of[PROTOCOL_FRAME_PART_DEPTH];
    const uint8_t *coarse_depth = normals + parts->bytes.of[PROTOCOL_FRAME_PART_NORMALS];
    const struct fl_encoded encoded = {.colours = assembly->encoded,
                                       .depth = depth,
                                       .normals = normals,
                                       .coarse_depth = coarse_depth,
                                       .sticking =
                                           coarse_depth + parts->bytes.of[PROTOCOL_FRAME_PART_COARSE_DEPTH],
                                       .come = fl_parts_received(parts),
                                       .all = parts->bytes};
    frame->parts_come = parts->in_parts ? parts->come : 1;
    frame->wire_bytes = assembly->received_bytes;
    frame->depth_bytes =
        encoded.come.of[PROTOCOL_FRAME_PART_DEPTH] + encoded.come.of[PROTOCOL_FRAME_PART_COARSE_DEPTH];
    if (!fl_frame_decode(frame, &encoded, error))
        return false;
    frame->whole_ns = monotonic_now_ns();
    frame->decode_ns = frame->whole_ns - begin_ns;
    return true;
}

bool fl_assembly_has_first_parts(const struct fl_assembly *assembly)
{
    return assembly->frame && assembly->frame->pixels && assembly->parts.in_parts &&
           assembly->parts.come < assembly->parts.count && fl_parts_are_enough(&assembly->parts);
}

struct fl_frame *fl_assembly_show(const struct fl_assembly *assembly, uint64_t now_ns, struct fl_error *error)
{
    struct fl_frame *frame = malloc(sizeof(*frame));
    uint8_t *pixels = malloc(assembly->frame->pixels_bytes);
    if (!frame || !pixels) {
        free(frame);
        free(pixels);
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    *frame = *assembly->frame;
    frame->pixels = pixels;
    frame->more_follows = true;
    frame->receive_ns = now_ns - frame->begun_ns;
    if (decode(assembly, frame, error))
        return frame;
    fl_frame_destroy(frame);
    return NULL;
}

bool fl_assembly_is_void(const struct fl_assembly *assembly)
{
    return !fl_parts_are_enough(&assembly->parts);
}

struct fl_frame *fl_assembly_end(struct fl_assembly *assembly, const struct message_frame_end *end,
                                 uint64_t now_ns, struct fl_error *error)
{
    struct fl_frame *frame = assembly->frame;
    const bool is_whole = frame && assembly->received_bytes == assembly->encoded_bytes;
    if (!frame || end->frame != frame->frame || is_whole == (end->abandoned != 0) ||
        fl_assembly_is_void(assembly)) {
        fl_error_set(error, FL_ERROR_PROTOCOL, "frame_end", "an incomplete frame ended");
        return NULL;
    }
    if (!take_costs(frame, end, error) || !decode(assembly, frame, error))
        return NULL;
    frame->receive_ns = now_ns - frame->begun_ns;
    if (!frame->pixels) {
        frame->encoded = assembly->encoded;
        frame->encoded_bytes = (size_t)assembly->parts.bytes.of[PROTOCOL_FRAME_PART_COLOURS];
    } else if (assembly->encoded != frame->pixels) {
        free(assembly->encoded);
    }
    assembly->frame = NULL;
    assembly->encoded = NULL;
    return frame;
}

/* ---- frames that wait ---- */

bool fl_frame_queue_init(struct fl_frame_queue *queue, size_t capacity, struct fl_error *error)
{
    *queue = (struct fl_frame_queue){.frames = calloc(capacity, sizeof(struct fl_frame *)), .capacity = capacity};
    return queue->frames || fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
}

bool fl_frame_queue_push(struct fl_frame_queue *queue, struct fl_frame *frame, struct fl_error *error)
{
    struct fl_frame **last = &queue->frames[(queue->first + queue->count + queue->capacity - 1) % queue->capacity];
    if (queue->count > 0 && (*last)->more_follows && (*last)->frame == frame->frame) {
        fl_frame_destroy(*last);
        *last = frame;
        return true;
    }
    if (queue->count == queue->capacity) {
        fl_frame_destroy(frame);
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_end", "more frames arrived than were requested");
    }
    queue->frames[(queue->first + queue->count++) % queue->capacity] = frame;
    return true;
}

struct fl_frame *fl_frame_queue_pop(struct fl_frame_queue *queue)
{
    if (queue->count == 0)
        return NULL;
    struct fl_frame *frame = queue->frames[queue->first];
    queue->first = (queue->first + 1) % queue->capacity;
    queue->count--;
    return frame;
}

void fl_frame_queue_clear(struct fl_frame_queue *queue)
{
    while (queue->count > 0)
        fl_frame_destroy(fl_frame_queue_pop(queue));
}

void fl_frame_queue_finish(struct fl_frame_queue *queue)
{
    fl_frame_queue_clear(queue);
    free(queue->frames);
    *queue = (struct fl_frame_queue){0};
}
