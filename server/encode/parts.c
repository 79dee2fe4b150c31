/* SPDX-License-Identifier: MIT */
/* Cuts of encoded data: scans of a JPEG, and colours before depth. */
#include "encode/parts.h"

#include <stdbool.h>
#include <string.h>

/* ---- scans of a JPEG (ITU-T T.81, B.1.1) ---- */

#define MARKER 0xff
#define START_OF_SCAN 0xda

/* Scans of libjpeg's progression for Y'CbCr: means and the lowest frequencies of luma; then all chroma and the
 * other frequencies, without their last bits; then those bits. In rendered pictures at quality 75 the first two
 * parts are 25 and 10 % of the bytes, and give 32 and 35 dB where the whole gives 39. */
#define SCANS 10u
#define COLOURS_MAX 3u
static const unsigned scans_of_parts[COLOURS_MAX - 1] = {2, 5};

/* Skips from a marker or the bytes of a scan to the next marker that begins a segment. */
static size_t next_segment(const uint8_t *bytes, size_t size_bytes, size_t at)
{
    while (at + 1 < size_bytes) {
        const uint8_t *found = memchr(bytes + at, MARKER, size_bytes - 1 - at);
        if (!found)
            break;
        at = (size_t)(found - bytes);
        const bool is_within = found[1] == 0 || found[1] == MARKER || (found[1] >= 0xd0 && found[1] < 0xd9);
        if (!is_within)
            return at;
        at += found[1] == MARKER ? 1 : 2;
    }
    return size_bytes;
}

/* Finds the ends of scans, except the last one, which ends the file; returns their number. */
static unsigned find_scans(const uint8_t *bytes, size_t size_bytes, size_t ends[SCANS])
{
    unsigned count = 0;
    bool in_scan = false;
    size_t at = next_segment(bytes, size_bytes, 2);
    while (at + 3 < size_bytes) {
        if (in_scan && count < SCANS)
            ends[count++] = at;
        in_scan = bytes[at + 1] == START_OF_SCAN;
        at = next_segment(bytes, size_bytes, at + 2 + ((size_t)bytes[at + 2] << 8 | bytes[at + 3]));
    }
    return count + in_scan;
}

/* Finds where the colours may be cut; returns the number of parts. */
static unsigned cut_colours(const struct parts_source *source, size_t ends[COLOURS_MAX])
{
    const uint8_t *bytes = source->bytes[FRAME_PART_COLOURS];
    const size_t size_bytes = source->size_bytes[FRAME_PART_COLOURS];
    size_t scans[SCANS];
    const bool is_cut = source->encoding == ENCODING_JPEG && find_scans(bytes, size_bytes, scans) == SCANS;
    const unsigned count = is_cut ? COLOURS_MAX : 1;
    for (unsigned i = 0; i + 1 < count; i++)
        ends[i] = scans[scans_of_parts[i] - 1];
    ends[count - 1] = size_bytes;
    return count;
}

/* ---- order ---- */

struct arrangement {
    uint8_t *out;
    struct part_list *list;
};

static void add(struct arrangement *arrangement, enum frame_part_kind kind, const uint8_t *from, size_t bytes)
{
    if (!bytes)
        return;
    memcpy(arrangement->out, from, bytes);
    arrangement->out += bytes;
    arrangement->list->parts[arrangement->list->count++] = (struct part){kind, bytes};
}

static void add_all(struct arrangement *arrangement, const struct parts_source *source, enum frame_part_kind kind)
{
    add(arrangement, kind, source->bytes[kind], source->size_bytes[kind]);
}

void parts_arrange(const struct parts_source *source, uint8_t *out, struct part_list *list)
{
    struct arrangement arrangement = {.out = out, .list = list};
    const uint8_t *colours = source->bytes[FRAME_PART_COLOURS];
    const bool has_coarse = source->size_bytes[FRAME_PART_COARSE_DEPTH] > 0;
    size_t ends[COLOURS_MAX];
    const unsigned count = cut_colours(source, ends);
    list->count = 0;
    add(&arrangement, FRAME_PART_COLOURS, colours, ends[0]);
    add_all(&arrangement, source, has_coarse ? FRAME_PART_COARSE_DEPTH : FRAME_PART_DEPTH);
    for (unsigned i = 1; i < count; i++) {
        add(&arrangement, FRAME_PART_COLOURS, colours + ends[i - 1], ends[i] - ends[i - 1]);
        if (i == 1 && has_coarse)
            add_all(&arrangement, source, FRAME_PART_DEPTH);
    }
    if (count == 1 && has_coarse)
        add_all(&arrangement, source, FRAME_PART_DEPTH);
    add_all(&arrangement, source, FRAME_PART_NORMALS);
    add_all(&arrangement, source, FRAME_PART_STICKING);
}

size_t parts_end(const struct part_list *list, size_t at_bytes)
{
    size_t end = 0;
    for (uint32_t i = 0; i < list->count && (i == 0 || end < at_bytes); i++)
        end += list->parts[i].bytes;
    return end;
}

size_t parts_needed_bytes(const struct part_list *list)
{
    size_t end = 0, needed = 0;
    bool has_colours = false, has_depth = false;
    for (uint32_t i = 0; i < list->count; i++) {
        const enum frame_part_kind kind = list->parts[i].kind;
        const bool is_depth = kind == FRAME_PART_DEPTH || kind == FRAME_PART_COARSE_DEPTH;
        bool *has = kind == FRAME_PART_COLOURS ? &has_colours : is_depth ? &has_depth : NULL;
        end += list->parts[i].bytes;
        if (has && !*has)
            needed = end;
        if (has)
            *has = true;
    }
    return needed;
}
