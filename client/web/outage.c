/* SPDX-License-Identifier: MIT */
#include "web/outage.h"

void web_outage_init(struct web_outage *outage)
{
    *outage = (struct web_outage){0};
    pthread_mutex_init(&outage->lock, NULL);
}

bool web_outage_begins(struct web_outage *outage, uint64_t now_ns)
{
    pthread_mutex_lock(&outage->lock);
    const bool tells = !outage->is_told && (outage->told_ns == 0 || now_ns - outage->told_ns >= OUTAGE_PAUSE_NS);
    if (tells) {
        outage->is_told = true;
        outage->told_ns = now_ns;
    }
    pthread_mutex_unlock(&outage->lock);
    return tells;
}

bool web_outage_ends(struct web_outage *outage)
{
    pthread_mutex_lock(&outage->lock);
    const bool tells = outage->is_told;
    outage->is_told = false;
    pthread_mutex_unlock(&outage->lock);
    return tells;
}
