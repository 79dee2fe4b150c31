/* SPDX-License-Identifier: MIT */
/* Budget for hidden layers: a share of the time that passes while a view moves. A picture gets its layers when the
 * budget holds as much as they took the last time. Pure: the caller has the clock. */
#ifndef FARLIGHT_ENGINE_HIDDEN_BUDGET_H
#define FARLIGHT_ENGINE_HIDDEN_BUDGET_H

#include <stdbool.h>
#include <stdint.h>

#define HIDDEN_SHARE_PERCENT 15u

/* All-zero: nothing is known, and the first layers, which may have programs to compile, are rendered in spare
 * time. */
struct hidden_budget {
    int64_t saved_ns; /* below 0: layers took longer than expected */
    uint64_t cost_ns; /* cost of one picture's layers */
};

/* Adds the share of the time that passed between the begins of two pictures. */
void hidden_budget_earn(struct hidden_budget *budget, uint64_t passed_ns);
bool hidden_budget_suffices(const struct hidden_budget *budget);
/* Subtracts the cost of a picture's layers, all of which are rendered. `spare`: in time that nothing else needed,
 * so it is not charged. */
void hidden_budget_spend(struct hidden_budget *budget, uint64_t cost_ns, bool spare);

#endif
