/* SPDX-License-Identifier: MIT */
/* Rate of handshakes by network. */
#include "net/attempts.h"

#define SECOND_NS UINT64_C(1000000000)

/* Entry of a network; it replaces the one that has been quiet for longest, if it is new. */
static struct attempts_network *place_of(struct attempts *attempts, uint64_t network)
{
    struct attempts_network *quietest = &attempts->networks[0];
    for (struct attempts_network *each = attempts->networks; each < attempts->networks + ATTEMPTS_NETWORKS;
         each++) {
        if (each->next_ns && each->network == network)
            return each;
        if (each->next_ns < quietest->next_ns)
            quietest = each;
    }
    *quietest = (struct attempts_network){.network = network};
    return quietest;
}

/* Generic cell rate algorithm (ITU-T I.371) with a tolerance of a second. */
uint64_t attempts_wait_ns(struct attempts *attempts, uint64_t network, uint32_t per_second, uint64_t now_ns)
{
    struct attempts_network *place = place_of(attempts, network);
    uint64_t next_ns = place->next_ns > now_ns ? place->next_ns : now_ns;
    uint64_t after_ns = next_ns + SECOND_NS / per_second;
    if (after_ns - now_ns > SECOND_NS)
        return after_ns - now_ns - SECOND_NS;
    place->next_ns = after_ns;
    return 0;
}
