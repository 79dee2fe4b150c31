/* SPDX-License-Identifier: MIT */
/* What rasterising a scene takes where nothing is kept but the nearest depth: the same draws into the same three
 * images as A-buffers are built by, and no list. As a tracer that is built and cannot be asked anything, so that
 * it takes turns with those that can. As many texels along a side as tracer_options.bench.baseline_side says; 0:
 * 1024.
 */
#ifndef FARLIGHT_TESTS_BENCH_PLAIN_PASS_H
#define FARLIGHT_TESTS_BENCH_PLAIN_PASS_H

#include "trace/tracer.h"

extern const struct tracer_impl plain_pass_impl;

#endif
