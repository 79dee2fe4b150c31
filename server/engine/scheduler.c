/* SPDX-License-Identifier: MIT */
#include "engine/scheduler.h"

static uint64_t at_most(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static uint64_t turn_ns(uint32_t ready_count)
{
    return SCHEDULE_TURN_NS + ready_count * (uint64_t)SCHEDULE_TURN_EACH_NS;
}

/* Maximum distance of an entry above the minimum. It does not shorten turns, or entries with long ones would get
 * more. */
static uint64_t debt_max_ns(uint32_t ready_count)
{
    uint64_t waited_ns = SCHEDULE_WAIT_MAX_NS / ready_count, two_turns_ns = 2 * turn_ns(ready_count);
    return waited_ns > two_turns_ns ? waited_ns : two_turns_ns;
}

static void group_begin(struct schedule_group *group)
{
    group->next_ns = UINT64_MAX;
    group->ready_count = 0;
}

static bool was_ready(const struct scheduler *scheduler, const struct schedule_share *share)
{
    return share->ready_in + 1 == scheduler->picks && share->ready_in > 0;
}

/* Entries that were ready and still are define the group's time. */
static void group_add(struct schedule_group *group, const struct scheduler *scheduler,
                      const struct schedule_share *share)
{
    if (share->ready && was_ready(scheduler, share))
        group->next_ns = at_most(group->next_ns, share->virtual_ns);
}

static void group_advance(struct schedule_group *group)
{
    if (group->next_ns != UINT64_MAX && group->next_ns > group->min_ns)
        group->min_ns = group->next_ns;
}

/* Settles a share for this pick; a client with several jobs is settled once. */
static void share_settle(struct schedule_share *share, const struct scheduler *scheduler,
                         const struct schedule_group *group)
{
    if (!share->ready || share->ready_in == scheduler->picks)
        return;
    if (!was_ready(scheduler, share) && share->virtual_ns < group->min_ns)
        share->virtual_ns = group->min_ns;
    share->virtual_ns = at_most(share->virtual_ns, group->min_ns + debt_max_ns(group->ready_count));
    share->ready_in = scheduler->picks;
}

static bool goes_before(const struct schedule_share *a, const struct schedule_share *b)
{
    return a->virtual_ns != b->virtual_ns ? a->virtual_ns < b->virtual_ns : a->turn < b->turn;
}

static void begin(struct scheduler *scheduler, const struct schedule_entry *entries, size_t count)
{
    group_begin(&scheduler->clients);
    for (size_t i = 0; i < count; i++) {
        entries[i].client->share.ready = false;
        group_begin(&entries[i].client->jobs);
    }
}

static void mark_ready(struct scheduler *scheduler, const struct schedule_entry *entries, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct schedule_client *client = entries[i].client;
        scheduler->clients.ready_count += entries[i].ready && !client->share.ready;
        client->jobs.ready_count += entries[i].ready;
        client->share.ready |= entries[i].ready;
        entries[i].job->ready = entries[i].ready;
        group_add(&client->jobs, scheduler, entries[i].job);
    }
    for (size_t i = 0; i < count; i++)
        group_add(&scheduler->clients, scheduler, &entries[i].client->share);
}

static bool entry_precedes(const struct schedule_entry *a, const struct schedule_entry *b)
{
    return a->client != b->client ? goes_before(&a->client->share, &b->client->share)
                                  : goes_before(a->job, b->job);
}

size_t schedule_pick(struct scheduler *scheduler, const struct schedule_entry *entries, size_t count)
{
    size_t best = SCHEDULE_NONE;
    scheduler->picks++;
    begin(scheduler, entries, count);
    mark_ready(scheduler, entries, count);
    group_advance(&scheduler->clients);
    for (size_t i = 0; i < count; i++) {
        const struct schedule_entry *entry = &entries[i];
        group_advance(&entry->client->jobs);
        share_settle(&entry->client->share, scheduler, &scheduler->clients);
        share_settle(entry->job, scheduler, &entry->client->jobs);
        if (entry->ready && (best == SCHEDULE_NONE || entry_precedes(entry, &entries[best])))
            best = i;
    }
    scheduler->turn_ns = 0;
    scheduler->turn_end_ns = turn_ns(scheduler->clients.ready_count);
    return best;
}

static uint64_t without_outliers(struct schedule_client *client, uint64_t slice_ns)
{
    if (!client->mean_ns)
        client->mean_ns = slice_ns;
    uint64_t max_ns = SCHEDULE_OUTLIER * client->mean_ns;
    client->mean_ns = client->mean_ns - client->mean_ns / 16 + slice_ns / 16;
    return at_most(slice_ns, max_ns > SCHEDULE_OUTLIER_MIN_NS ? max_ns : SCHEDULE_OUTLIER_MIN_NS);
}

static void charge(struct schedule_share *share, uint64_t virtual_ns, uint64_t turn)
{
    share->virtual_ns += virtual_ns;
    share->turn = turn;
}

void schedule_charge(struct scheduler *scheduler, const struct schedule_entry *entry, uint64_t slice_ns,
                     uint32_t weight)
{
    uint64_t charged_ns = without_outliers(entry->client, slice_ns);
    uint64_t turn = ++scheduler->turns;
    scheduler->turn_ns += slice_ns;
    /* A slice below the clock's resolution is charged a little, or its job would have every turn. */
    charge(&entry->client->share, charged_ns / weight + 1, turn);
    charge(entry->job, charged_ns / weight + 1, turn);
}

bool schedule_turn_lasts(const struct scheduler *scheduler)
{
    return scheduler->turn_ns < scheduler->turn_end_ns;
}
