/* SPDX-License-Identifier: MIT */
/* Outages of the daemon, reported once for all seats. */
#include "web/outage.h"

void web_outage_init(struct web_outage *outage)
{
    *outage = (struct web_outage){0};
    pthread_mutex_init(&outage->lock, NULL);
}

bool web_outage_begins(struct web_outage *outage, uint64_t now_ns)
{
    pthread_mutex_lock(&outage->lock);
    const bool reports =
        !outage->is_reported && (outage->reported_ns == 0 || now_ns - outage->reported_ns >= OUTAGE_PAUSE_NS);
    if (reports) {
        outage->is_reported = true;
        outage->reported_ns = now_ns;
    }
    pthread_mutex_unlock(&outage->lock);
    return reports;
}

bool web_outage_ends(struct web_outage *outage)
{
    pthread_mutex_lock(&outage->lock);
    const bool reports = outage->is_reported;
    outage->is_reported = false;
    pthread_mutex_unlock(&outage->lock);
    return reports;
}
