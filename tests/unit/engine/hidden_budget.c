/* SPDX-License-Identifier: MIT */
/* The share of time for layers of hidden surfaces. */
#include "engine/hidden_budget.h"
#include "tests/harness/test.h"

#define MS UINT64_C(1000000)

TEST(what_is_hidden_is_made_when_its_cost_is_saved)
{
    struct hidden_budget budget = {0};
    hidden_budget_earn(&budget, 1000 * MS);
    assert_false(hidden_budget_suffices(&budget)); /* its cost is unknown */
    hidden_budget_spend(&budget, 30 * MS, true);
    unsigned made = 0;
    for (int i = 0; i < 100; i++) {
        hidden_budget_earn(&budget, 100 * MS);
        if (!hidden_budget_suffices(&budget))
            continue;
        hidden_budget_spend(&budget, 30 * MS, false);
        made++;
    }
    assert_int_equal(made, 50); /* 15 of 30 ms a picture */
}

TEST(what_costs_less_than_its_share_is_always_made)
{
    struct hidden_budget budget = {.cost_ns = 15 * MS};
    for (int i = 0; i < 100; i++) {
        hidden_budget_earn(&budget, 100 * MS);
        assert_true(hidden_budget_suffices(&budget));
        hidden_budget_spend(&budget, 15 * MS, false);
    }
}

TEST(a_rest_does_not_save_for_many_and_spare_time_costs_nothing)
{
    struct hidden_budget budget = {.cost_ns = 50 * MS};
    hidden_budget_earn(&budget, 3600000 * MS);
    hidden_budget_spend(&budget, 50 * MS, false);
    hidden_budget_spend(&budget, 50 * MS, true);
    assert_true(hidden_budget_suffices(&budget));
    hidden_budget_spend(&budget, 50 * MS, false);
    assert_false(hidden_budget_suffices(&budget));
}
