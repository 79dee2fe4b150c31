/* SPDX-License-Identifier: MIT */
/* What may be spent on pictures of what others hide: a share of the time that passes while a view moves. They are
 * made for a picture when as much is saved as they took the last time. Pure: the caller has the clock. */
#ifndef FARLIGHT_ENGINE_HIDDEN_BUDGET_H
#define FARLIGHT_ENGINE_HIDDEN_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

#define HIDDEN_SHARE_PERCENT 15u

/* All-zero: nothing is known, and the first ones, which may have programs to compile, are made in spare time. */
struct hidden_budget {
    int64_t saved_ns; /* below 0: they took longer than was thought */
    uint64_t cost_ns; /* of those of one picture */
};

/* Between the beginnings of two pictures. */
void hidden_budget_earn(struct hidden_budget *budget, uint64_t passed_ns);
bool hidden_budget_suffices(const struct hidden_budget *budget);
/* All those of a picture were made. `spare`: in time that nothing else needed. */
void hidden_budget_spend(struct hidden_budget *budget, uint64_t cost_ns, bool spare);

#endif
