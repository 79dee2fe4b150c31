/* SPDX-License-Identifier: MIT */
#include "job/scheduler.h"

static bool goes_before(const struct schedule_entry *a, const struct schedule_entry *b)
{
    if (a->client_served != b->client_served)
        return a->client_served < b->client_served;
    return a->job_served < b->job_served;
}

size_t schedule_pick(const struct schedule_entry *entries, size_t count)
{
    size_t best = SCHEDULE_NONE;
    for (size_t i = 0; i < count; i++) {
        if (entries[i].ready && (best == SCHEDULE_NONE || goes_before(&entries[i], &entries[best])))
            best = i;
    }
    return best;
}
