/* SPDX-License-Identifier: MIT */
/* The order of a frame's bytes on the wire. */
#include "lib/parts.h"

#include "protocol/pixels/coarse_depth.h"

#include <string.h>

static void add(struct fl_parts *parts, enum protocol_frame_part_kind kind, uint64_t bytes)
{
    if (bytes == 0)
        return;
    parts->parts[parts->count++] = (struct record_frame_part){kind, bytes};
    parts->bytes.of[kind] += bytes;
}

void fl_parts_init(struct fl_parts *parts, const struct message_frame_begin *begin)
{
    *parts = (struct fl_parts){0};
    add(parts, PROTOCOL_FRAME_PART_COLOURS, begin->size_bytes);
    add(parts, PROTOCOL_FRAME_PART_DEPTH, begin->depth_bytes);
    add(parts, PROTOCOL_FRAME_PART_NORMALS, begin->normal_bytes);
    add(parts, PROTOCOL_FRAME_PART_STICKING, begin->sticking_bytes);
}

/* ---- announced parts ---- */

/* Number of parts after which there are some colours and, for frames with depth, some depth; 0: there never
 * are. */
static uint32_t first_parts(const struct fl_parts *parts)
{
    bool needs_colours = true, needs_depth = parts->bytes.of[PROTOCOL_FRAME_PART_DEPTH] > 0;
    for (uint32_t i = 0; i < parts->count; i++) {
        const enum protocol_frame_part_kind kind = parts->parts[i].kind;
        needs_colours = needs_colours && kind != PROTOCOL_FRAME_PART_COLOURS;
        needs_depth = needs_depth && kind != PROTOCOL_FRAME_PART_DEPTH && kind != PROTOCOL_FRAME_PART_COARSE_DEPTH;
        if (!needs_colours && !needs_depth)
            return i + 1;
    }
    return 0;
}

/* True if only colours of a JPEG come in several parts, sizes add up to the whole frame, and coarse depth has a
 * possible size. */
static bool are_sound(const struct fl_parts *announced, const struct fl_parts *whole,
                      const struct message_frame_begin *begin)
{
    uint32_t counts[PROTOCOL_FRAME_PART_COUNT] = {0};
    for (uint32_t i = 0; i < announced->count; i++)
        counts[announced->parts[i].kind]++;
    for (enum protocol_frame_part_kind kind = 0; kind < PROTOCOL_FRAME_PART_COUNT; kind++) {
        const bool may_be_cut = kind == PROTOCOL_FRAME_PART_COLOURS && begin->encoding == PROTOCOL_ENCODING_JPEG;
        const bool is_coarse = kind == PROTOCOL_FRAME_PART_COARSE_DEPTH;
        if ((counts[kind] > 1 && !may_be_cut) ||
            (!is_coarse && announced->bytes.of[kind] != whole->bytes.of[kind]))
            return false;
    }
    const uint64_t coarse = announced->bytes.of[PROTOCOL_FRAME_PART_COARSE_DEPTH];
    return coarse == 0 || (begin->depth_step > 0 && coarse <= coarse_depth_bound(begin->width, begin->height));
}

bool fl_parts_set(struct fl_parts *parts, const struct message_frame_begin *begin,
                  const struct message_frame_parts *announced, struct fl_error *error)
{
    struct fl_parts made = {.in_parts = true};
    bool sound = announced->frame == begin->frame && !parts->in_parts && parts->come == 0 &&
                 parts->come_bytes == 0 && announced->parts_count <= FL_PARTS_MAX;
    for (uint32_t i = 0; sound && i < announced->parts_count; i++)
        add(&made, announced->parts[i].kind, announced->parts[i].size_bytes);
    if (!sound || !are_sound(&made, parts, begin) || first_parts(&made) == 0)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_parts.parts", "frame %u cannot have those %u parts",
                            begin->frame, announced->parts_count);
    *parts = made;
    return true;
}

/* ---- received parts ---- */

struct fl_parts_bytes fl_parts_received(const struct fl_parts *parts)
{
    struct fl_parts_bytes come = {0};
    for (uint32_t i = 0; i < parts->come; i++)
        come.of[parts->parts[i].kind] += parts->parts[i].size_bytes;
    return come;
}

uint64_t fl_parts_sum(const struct fl_parts *parts)
{
    uint64_t sum = 0;
    for (enum protocol_frame_part_kind kind = 0; kind < PROTOCOL_FRAME_PART_COUNT; kind++)
        sum += parts->bytes.of[kind];
    return sum;
}

void fl_parts_put(struct fl_parts *parts, uint8_t *to, const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        const struct record_frame_part *part = &parts->parts[parts->come];
        const uint64_t left = part->size_bytes - parts->come_bytes;
        const size_t taken = left < count ? (size_t)left : count;
        uint64_t place = fl_parts_received(parts).of[part->kind] + parts->come_bytes;
        for (enum protocol_frame_part_kind kind = 0; kind < part->kind; kind++)
            place += parts->bytes.of[kind];
        memcpy(to + place, bytes, taken);
        bytes += taken;
        count -= taken;
        parts->come_bytes += taken;
        if (parts->come_bytes == part->size_bytes) {
            parts->come++;
            parts->come_bytes = 0;
        }
    }
}

bool fl_parts_are_enough(const struct fl_parts *parts)
{
    return parts->come >= (parts->in_parts ? first_parts(parts) : parts->count);
}
