/* SPDX-License-Identifier: MIT */
#include "net/attempts.h"

#define WINDOW_NS UINT64_C(60000000000)

static uint64_t last_failed_ns(const struct attempts_network *network)
{
    return network->failed_ns[(network->next + ATTEMPTS_LIMIT_MAX - 1) % ATTEMPTS_LIMIT_MAX];
}

/* The network's entry, or the oldest entry, which it replaces. */
static struct attempts_network *place_of(struct attempts *attempts, uint64_t network)
{
    struct attempts_network *oldest = &attempts->networks[0];
    for (size_t i = 0; i < ATTEMPTS_NETWORKS; i++) {
        struct attempts_network *each = &attempts->networks[i];
        if (last_failed_ns(each) && each->network == network)
            return each;
        if (last_failed_ns(each) < last_failed_ns(oldest))
            oldest = each;
    }
    *oldest = (struct attempts_network){.network = network};
    return oldest;
}

void attempts_add_failed(struct attempts *attempts, uint64_t network, uint64_t now_ns)
{
    struct attempts_network *place = place_of(attempts, network);
    place->failed_ns[place->next] = now_ns;
    place->next = (place->next + 1) % ATTEMPTS_LIMIT_MAX;
}

bool attempts_are_allowed(const struct attempts *attempts, uint64_t network, uint32_t limit, uint64_t now_ns)
{
    uint32_t failed = 0;
    for (size_t i = 0; i < ATTEMPTS_NETWORKS; i++) {
        const struct attempts_network *each = &attempts->networks[i];
        for (size_t j = 0; each->network == network && j < ATTEMPTS_LIMIT_MAX; j++)
            failed += each->failed_ns[j] && now_ns - each->failed_ns[j] < WINDOW_NS;
    }
    return failed < limit;
}
