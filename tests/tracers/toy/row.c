/* SPDX-License-Identifier: MIT */
#include "tests/tracers/contract.h"

static const struct tracer_row toy[] = {
    {.name = "toy", .number = 60},
    {.name = "toy, backward", .number = 60, .is_form = true, .options.toy.order = TOY_ORDER_BACKWARD},
};
TRACER_ROWS(toy)
