/* SPDX-License-Identifier: MIT */
#include "lib/link.h"
#include "lib/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define RATE_MAX 1e10
#define PART_BYTES_MAX 40u

enum part { PART_RATE, PART_ROUND_TRIP, PART_RESETS, PART_SEED, PART_COUNT };

static const struct {
    double minimum, maximum;
    const char *allowed;
} parts[PART_COUNT] = {[PART_RATE] = {1e3, RATE_MAX, "a rate of 1kbit to 10gbit a second"},
                       [PART_ROUND_TRIP] = {0, 1e10, "a round trip of 0ms to 10s"},
                       [PART_RESETS] = {0, 0.99, "a chance of 0% to 99%"},
                       [PART_SEED] = {0, UINT32_MAX, "a seed of 0 to 4294967295"}};

static const struct {
    const char *before, *after; /* the number */
    enum part part;
    double factor;
} units[] = {{"", "kbit", PART_RATE, 1e3},     {"", "mbit", PART_RATE, 1e6},    {"", "gbit", PART_RATE, 1e9},
             {"", "ms", PART_ROUND_TRIP, 1e6}, {"", "s", PART_ROUND_TRIP, 1e9}, {"", "%", PART_RESETS, 0.01},
             {"seed=", "", PART_SEED, 1}};

/* Finds the unit of "100ms" and reads the number beside it. */
static bool read_part(const char *text, enum part *part, double *value, struct fl_error *error)
{
    for (size_t i = 0; i < sizeof(units) / sizeof(units[0]); i++) {
        const size_t before = strlen(units[i].before), digits = strspn(text + before, "0123456789.");
        char number[PART_BYTES_MAX];
        if (strncmp(text, units[i].before, before) != 0 || strcmp(text + before + digits, units[i].after) != 0)
            continue;
        *part = units[i].part;
        snprintf(number, sizeof(number), "%.*s", (int)digits, text + before);
        if (fl_text_real(number, 0, 1e10, value, NULL)) {
            *value *= units[i].factor;
            if (*value >= parts[*part].minimum && *value <= parts[*part].maximum)
                return true;
        }
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not %s", text, parts[*part].allowed);
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "",
                 "'%s' is not a rate (kbit, mbit, gbit), a round trip (ms, s), a chance of resets (%%) or seed=N",
                 text);
    return fl_error_remedy(error, "write it like 2mbit,100ms,1%%");
}

bool fl_link_parse(const char *text, struct fl_link *link, struct fl_error *error)
{
    double values[PART_COUNT] = {[PART_RATE] = RATE_MAX, [PART_SEED] = 1};
    bool is_given[PART_COUNT] = {false};
    for (const char *at = text;;) {
        char one[PART_BYTES_MAX];
        enum part part = PART_COUNT;
        double value = 0;
        const size_t length = strcspn(at, ",");
        snprintf(one, sizeof(one), "%.*s", (int)(length < sizeof(one) ? length : sizeof(one)), at);
        if (!read_part(one, &part, &value, error))
            return false;
        if (is_given[part])
            return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is the second of its kind", one);
        is_given[part] = true;
        values[part] = value;
        if (at[length] == '\0')
            break;
        at += length + 1;
    }
    *link = (struct fl_link){.bits_per_second = (uint64_t)values[PART_RATE],
                             .round_trip_ns = (uint64_t)values[PART_ROUND_TRIP],
                             .reset_chance = values[PART_RESETS],
                             .seed = (uint64_t)values[PART_SEED]};
    return true;
}

/* splitmix64 (Steele, Lea and Flood: Fast splittable pseudorandom number generators. 2014), in [0, 1). */
static double random_at(uint64_t seed, uint64_t index)
{
    uint64_t bits = seed + (index + 1) * UINT64_C(0x9e3779b97f4a7c15);
    bits = (bits ^ bits >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    bits = (bits ^ bits >> 27) * UINT64_C(0x94d049bb133111eb);
    return (double)((bits ^ bits >> 31) >> 11) * 0x1p-53;
}

/* A wait without memory: the chance to be over within a second is the same in each. */
uint64_t fl_link_reset_ns(const struct fl_link *link, uint64_t index)
{
    if (link->reset_chance <= 0)
        return UINT64_MAX;
    const double seconds = log1p(-random_at(link->seed, index)) / log1p(-link->reset_chance);
    return seconds < 1e9 ? (uint64_t)(seconds * 1e9) : UINT64_MAX;
}

size_t fl_link_packets(const struct fl_link *link)
{
    const double held_s = (double)(link->round_trip_ns / 2 + FL_LINK_QUEUE_NS) * 1e-9;
    const double bytes = fmin((double)link->bits_per_second / 8 * held_s, FL_LINK_IN_FLIGHT_MAX);
    const size_t packets = (size_t)(bytes / FL_LINK_PACKET_BYTES) + 1;
    return packets > FL_LINK_PACKETS_MIN ? packets : FL_LINK_PACKETS_MIN;
}

uint64_t fl_link_opens_ns(uint64_t free_ns)
{
    return free_ns > FL_LINK_QUEUE_NS ? free_ns - FL_LINK_QUEUE_NS : 0;
}

uint64_t fl_link_enter(const struct fl_link *link, uint64_t *free_ns, size_t bytes, uint64_t now_ns)
{
    *free_ns = (*free_ns > now_ns ? *free_ns : now_ns) + bytes * UINT64_C(8000000000) / link->bits_per_second;
    return *free_ns + link->round_trip_ns / 2;
}
