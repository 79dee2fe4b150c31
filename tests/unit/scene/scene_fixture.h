/* SPDX-License-Identifier: MIT */
/* A scene and a transaction in the making, for each test anew. */
#ifndef FARLIGHT_TESTS_SCENE_FIXTURE_H
#define FARLIGHT_TESTS_SCENE_FIXTURE_H

#include "tests/unit/scene/drafts.h"
#include "tests/harness/test.h"

#include <math.h>

static struct scene *scene;
static struct draft_list list;

static inline int begin_scene(void **state)
{
    (void)state;
    scene = new_scene();
    list = (struct draft_list){0};
    return 0;
}

static inline int end_scene(void **state)
{
    (void)state;
    scene_destroy(scene);
    return 0;
}

static inline void expect_near(const char *what, const float *got, const double *expected, int count,
                               double tolerance)
{
    for (int i = 0; i < count; i++) {
        if (!(fabs((double)got[i] - expected[i]) <= tolerance))
            fail_msg("%s, number %d: %.9g, expected %.9g", what, i, (double)got[i], expected[i]);
    }
}

#endif
