/* SPDX-License-Identifier: MIT */
/* Visible points (seen.h) are those that brute force counts between the eye and a point. */
#include "tests/tracers/contract.h"

/* From the eye, just past its own place, to just before the point. */
static int surfaces_before(const struct twin *twin, const double eye[3], const double point[3], bool *is_close)
{
    struct ray ray = {.origin_t_min = {0, 0, 0, 0}, .direction_t_max = {0, 0, 0, 1}};
    struct twin_answer answer;
    for (int k = 0; k < 3; k++) {
        ray.origin_t_min[k] = (float)eye[k];
        ray.direction_t_max[k] = (float)(point[k] - eye[k]);
    }
    twin_trace(&answer, twin, &ray);
    *is_close = answer.close_call;
    return (int)answer.surface_count;
}

static int shadows_over(const struct seen *seen, double distance)
{
    int count = 0;
    for (uint32_t i = 0; i < seen->event_count; i++)
        if (seen->events[i].at < distance)
            count += seen->events[i].narrow;
    return count;
}

static struct scene *scene_of_discs_and_balls(void)
{
    struct scene *scene = test_scene_spheres();
    struct test_edits edits = {.scene = scene};
    for (uint32_t i = 0; i < 3; i++) {
        struct scene_disc *disc = &test_add(&edits, OBJECT_DISC)->set.disc;
        disc->base.id = i + 1;
        disc->value.centre_world[i] = 0.7f * (float)i - 1;
        disc->value.normal_world[i] = 1;
        disc->value.radius = 1.5f;
    }
    test_commit(&edits);
    return scene;
}

void what_a_view_sees_is_what_brute_force_counts(void **state)
{
    struct scene *(*const create[])(void) = {test_scene_soup, scene_of_discs_and_balls};
    /* In front of it all; in the midst; within the largest ball, if there is one. */
    static const double eyes[][3] = {{0.3, 0.2, 5}, {0.13, 0.05, -0.1}, {2.1, 0.35, 0.02}};
    (void)state;
    for (size_t s = 0; s < 2; s++) {
        struct scene *scene = create[s]();
        struct twin twin;
        uint64_t seed = 5;
        uint32_t judged = 0, wrong = 0;
        int greatest = 0;
        twin_init(&twin, scene);
        twin.blur.near_world = 1e-12; /* counts the surfaces */
        for (size_t e = 0; e < sizeof(eyes) / sizeof(eyes[0]); e++) {
            struct seen_view view = {.layers = 3};
            seen_view_of_cube(&view, eyes[e], 0); /* texels of no size */
            struct seen *seen = seen_create(&twin, &view);
            for (uint32_t i = 0; i < RAY_COUNT; i++) {
                struct ray ray = {{0}, {0}};
                struct seen_answer answer;
                double point[3];
                const double distance = (double)test_uniform(&seed, 0.05f, 6);
                for (int k = 0; k < 3; k++) {
                    ray.origin_t_min[k] = test_uniform(&seed, -3, 3);
                    ray.direction_t_max[k] = test_uniform(&seed, -1, 1);
                    point[k] = (double)ray.origin_t_min[k] + distance * (double)ray.direction_t_max[k];
                }
                ray.direction_t_max[3] = 100;
                seen_trace(&answer, seen, &ray);
                bool is_close;
                const int counted = surfaces_before(&twin, eyes[e], point, &is_close);
                if (is_close)
                    continue;
                judged++;
                wrong += shadows_over(seen, distance) != counted;
                greatest = counted > greatest ? counted : greatest;
            }
            seen_destroy(seen);
        }
        twin_finish(&twin);
        scene_destroy(scene);
        /* A float tells where the twin's ray ends. */
        if (wrong > judged / 1000 || judged < 2 * RAY_COUNT || greatest < 5)
            fail_msg("scene %zu: of %u points %u have another number of surfaces before them; %d at most", s,
                     judged, wrong, greatest);
    }
}
