/* SPDX-License-Identifier: MIT */
#include "engine/hidden_budget.h"

/* Maximum that counts of the time between two pictures. */
#define PASSED_MAX_NS UINT64_C(1000000000)

void hidden_budget_earn(struct hidden_budget *budget, uint64_t passed_ns)
{
    const uint64_t counted_ns = passed_ns < PASSED_MAX_NS ? passed_ns : PASSED_MAX_NS;
    const int64_t saved_max_ns =
        (int64_t)budget->cost_ns * 2; /* else many layers would follow one another after a pause */
    budget->saved_ns += (int64_t)(counted_ns * HIDDEN_SHARE_PERCENT / 100);
    if (budget->saved_ns > saved_max_ns)
        budget->saved_ns = saved_max_ns;
}

bool hidden_budget_suffices(const struct hidden_budget *budget)
{
    return budget->cost_ns > 0 && budget->saved_ns >= (int64_t)budget->cost_ns;
}

void hidden_budget_spend(struct hidden_budget *budget, uint64_t cost_ns, bool spare)
{
    budget->cost_ns = cost_ns;
    if (!spare)
        budget->saved_ns -= (int64_t)cost_ns;
}
