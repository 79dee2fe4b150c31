/* SPDX-License-Identifier: MIT */
/* Parts of a picture, as squares. */
#include "picture_part.h"
#include "lib/frame_part.h"
#include "lib/imported.h"
#include "protocol/codec.h"
#include "protocol/version.h"
#include "options/image_path.h"
#include "options/job.h"
#include "options/models.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define HEADER_BYTES 65536 /* limit of a file's header; all layers need less */

/* ---- options ---- */

/* The option that is incompatible with parts, and why; NULL: none. */
static const char *find_conflict(const struct cli_job *job, const char **why)
{
    const struct message_render *wanted = &job->options;
    const struct {
        bool is_given;
        const char *option, *why;
    } conflicts[] = {
        {job->input.scene, "--scene", "whose contents may change between two parts"},
        {cli_has_input(job), "a model from standard input", "which no other part can read"},
        {wanted->picture.crop_width > 0, "--crop", "which is a part already"},
        {job->sampling.is_auto, "--samples auto", "which reads neighbouring pixels"},
        {wanted->sampling.noise > 0.0f, "--noise", "which reads neighbouring pixels"},
        {wanted->picture.denoise != PROTOCOL_DENOISE_OFF, "--denoise", "which reads neighbouring pixels"},
        {job->views.has_stereo, "--stereo", "whose picture is of several views"},
        {job->views.has_light_field, "--light-field", "whose picture is of several views"},
        {wanted->picture.view_source == PROTOCOL_VIEW_SOURCE_LAYERS, "--lens quadtree",
         "which reads neighbouring pixels"},
        {job->sampling.progressive, "--progressive", "which shows the whole picture"},
        {job->input.watch, "--watch", "which shows the whole picture"},
        {job->output.dwaa, "--exr-compression dwaa", "which loses something of each part"},
        {job->output.full_metadata, "--metadata full", "whose times differ from part to part"},
    };
    for (size_t i = 0; i < sizeof(conflicts) / sizeof(conflicts[0]); i++) {
        *why = conflicts[i].why;
        if (conflicts[i].is_given)
            return conflicts[i].option;
    }
    return NULL;
}

bool cli_picture_part_complete(struct cli_job *job)
{
    struct message_render *wanted = &job->options;
    const char *why = NULL, *other = job->part.count > 0 ? find_conflict(job, &why) : NULL;
    if (job->part.count == 0 && job->series.resume) {
        cli_usage(job, "--resume", "only a part of a picture is left out where it exists");
        return fl_error_remedy(&job->error, "add --part K/N");
    }
    if (job->part.count == 0)
        return true;
    if (job->output.list[0].image != CLI_IMAGE_EXR) {
        cli_usage(job, "--part", "a part of a picture is an EXR file, and no %s file",
                  cli_image_name(job->output.list[0].image));
        return fl_error_remedy(&job->error, "-o part.exr; 'farlight merge' joins all parts");
    }
    if (other) {
        cli_usage(job, "--part", "cannot be combined with %s, %s", other, why);
        return fl_error_remedy(&job->error, "leave out one of them");
    }
    const struct squares squares = squares_of(wanted->picture.width, wanted->picture.height, job->part.count);
    const uint32_t most = squares.count < SQUARES_PARTS_MAX ? squares.count : SQUARES_PARTS_MAX;
    if (job->part.count > most) {
        cli_usage(job, "--part", "%u parts are more than a picture of %ux%u can have", job->part.count,
                  wanted->picture.width, wanted->picture.height);
        return fl_error_remedy(&job->error, "divide it into at most %u", most);
    }
    /* `auto` would choose by the device, and a rasteriser would draw the whole picture for each square */
    if (wanted->tracing.primary == PROTOCOL_PRIMARY_AUTO)
        wanted->tracing.primary = PROTOCOL_PRIMARY_TRACE;
    return true;
}

/* ---- digest of the picture's inputs ---- */

static void add_text(XXH3_state_t *state, const char *text)
{
    XXH3_64bits_update(state, text, strlen(text) + 1);
}

/* Hashes the job's request, without fields that only affect the transport of frames. */
static bool add_job(XXH3_state_t *state, const struct cli_job *job, struct fl_error *error)
{
    static uint8_t bytes[CODEC_CONTROL_PAYLOAD_MAX_BYTES];
    const struct message_render defaults = fl_render_defaults();
    struct message message = {.type = MESSAGE_RENDER, .render = job->options};
    struct writer writer;
    message.render.scene = 1; /* the smallest valid numbers */
    message.render.channel = 2;
    message.render.encoding = defaults.encoding;
    message.render.quality = defaults.quality;
    message.render.credit = defaults.credit;
    writer_init(&writer, bytes, sizeof(bytes));
    if (!message_encode(&writer, &message))
        return fl_error_set(error, FL_ERROR_ARGUMENT, writer.error.field, "%s", writer.error.text);
    XXH3_64bits_update(state, bytes, writer.used_bytes);
    for (size_t i = 0; i < job->input.edit_count; i++) {
        char text[512];
        add_text(state, fl_assignment_print(&job->input.edits[i], text, sizeof(text)));
    }
    return true;
}

/* Hashes options of the file that change its pixels, and the names of its layers. */
static void add_file(XXH3_state_t *state, const struct cli_job *job)
{
    add_text(state, FARLIGHT_VERSION);
    add_text(state, job->output.float_pixels ? "float" : "half");
    add_text(state, job->output.colour_space ? job->output.colour_space : "");
    for (size_t i = 0; i < job->light_groups.count; i++)
        add_text(state, job->light_groups.names[i]);
}

static bool digest_of(const struct cli_job *job, const struct fl_scene *scene, uint64_t *digest,
                      struct fl_error *error)
{
    const uint64_t scene_digest = fl_scene_import_digest(scene);
    XXH3_state_t *state = XXH3_createState();
    if (!state)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    XXH3_64bits_reset(state);
    XXH3_64bits_update(state, &scene_digest, sizeof(scene_digest));
    const bool added = add_job(state, job, error);
    add_file(state, job);
    *digest = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    return added;
}

/* ---- squares ---- */

bool cli_picture_part_begin(struct cli_picture_part *part, struct cli_job *job, struct fl_connection *connection,
                            const struct fl_scene *scene, struct fl_error *error)
{
    const struct message_stats_reply *stats = NULL;
    uint64_t digest = 0;
    char name[sizeof(part->name)];
    if (!fl_stats(connection, &stats, error) || !digest_of(job, scene, &digest, error))
        return false;
    snprintf(name, sizeof(name), "%u/%u %016" PRIx64 " %s, %s", job->part.number, job->part.count, digest,
             stats->device, stats->driver);
    if (strcmp(name, part->name) == 0)
        return true;
    cli_picture_part_finish(part);
    part->squares = squares_of(job->options.picture.width, job->options.picture.height, job->part.count);
    part->first = part->next = squares_first(&part->squares, job->part.number - 1, job->part.count);
    part->end = squares_first(&part->squares, job->part.number, job->part.count);
    memcpy(part->name, name, sizeof(part->name));
    job->part.name = part->name;
    return true;
}

/* Checks the header; files appear only when they are complete. */
bool cli_picture_part_is_there(const struct cli_picture_part *part, const char *path)
{
    static const char begin[] = "farlight/part\0string";
    const uint32_t length = (uint32_t)strlen(part->name); /* files are little-endian, as hosts are */
    char wanted[sizeof(begin) + sizeof(length) + sizeof(part->name)], header[HEADER_BYTES];
    FILE *file = fopen(path, "re");
    const size_t got = file ? fread(header, 1, sizeof(header), file) : 0;
    memcpy(wanted, begin, sizeof(begin));
    memcpy(wanted + sizeof(begin), &length, sizeof(length));
    memcpy(wanted + sizeof(begin) + sizeof(length), part->name, length);
    if (file)
        fclose(file);
    return memmem(header, got, wanted, sizeof(begin) + sizeof(length) + length) != NULL;
}

bool cli_picture_part_next(const struct cli_picture_part *part, struct message_render *render)
{
    if (part->next == part->end)
        return false;
    const struct square square = squares_at(&part->squares, part->next);
    render->picture.crop_x = square.x;
    render->picture.crop_y = square.y;
    render->picture.crop_width = square.width;
    render->picture.crop_height = square.height;
    return true;
}

static size_t layers_of(const struct fl_frame *frame)
{
    return (size_t)__builtin_popcount(frame->layers);
}

/* Makes the whole picture, with the metadata of the first square. */
static struct fl_frame *begin_frame(const struct squares *squares, struct fl_frame *square, struct fl_error *error)
{
    struct fl_frame *frame = malloc(sizeof(*frame));
    const size_t bytes = layers_of(square) * squares->width * squares->height * fl_bytes_per_pixel(square->format);
    uint8_t *pixels = calloc(1, bytes);
    if (!frame || !pixels) {
        free(frame);
        free(pixels);
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    fl_frame_alike(frame, square, squares->width, squares->height);
    frame->structure = square->structure; /* now owned by the picture */
    frame->structure_count = square->structure_count;
    square->structure = NULL;
    square->structure_count = 0;
    frame->pixels = pixels;
    frame->pixels_bytes = bytes;
    frame->primary_rays = frame->shadow_rays = frame->secondary_rays = 0;
    return frame;
}

bool cli_picture_part_take(struct cli_picture_part *part, struct fl_frame *square, struct fl_error *error)
{
    const struct square place = squares_at(&part->squares, part->next);
    const size_t pixel_bytes = fl_bytes_per_pixel(square->format), row_bytes = place.width * pixel_bytes;
    if (!part->frame)
        part->frame = begin_frame(&part->squares, square, error);
    if (!part->frame)
        return false;
    const uint8_t *from = square->pixels;
    for (size_t layer = 0; layer < layers_of(square); layer++) {
        for (size_t y = 0; y < place.height; y++, from += row_bytes) {
            const size_t row = layer * part->squares.height + place.y + y;
            memcpy(part->frame->pixels + (row * part->squares.width + place.x) * pixel_bytes, from, row_bytes);
        }
    }
    part->frame->primary_rays += square->primary_rays;
    part->frame->shadow_rays += square->shadow_rays;
    part->frame->secondary_rays += square->secondary_rays;
    part->next++;
    return true;
}

void cli_picture_part_finish(struct cli_picture_part *part)
{
    fl_frame_destroy(part->frame);
    *part = (struct cli_picture_part){0};
}
