/* SPDX-License-Identifier: MIT */
/* Promises of every tracer, checked for each row of a table (rows.c). To add a tracer, add its row; to add a
 * scene, a row of scenes.c; to add a promise, a CHECK to a file of this folder.  All run on one device, and
 * brute force in double precision (naive_twin.h) answers each scene once for all tracers. */
#ifndef FARLIGHT_TESTS_TRACERS_CONTRACT_H
#define FARLIGHT_TESTS_TRACERS_CONTRACT_H

#include "tests/tracers/naive_twin.h"
#include "tests/tracers/seen.h"

#include "tests/accuracy/motion_scenes.h"
#include "tests/accuracy/test_scenes.h"

#include "gpu/device.h"
#include "gpu_scene/scene.h"
#include "shared/hit.h"
#include "shared/material.h"
#include "trace/tracer.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* ---- rows ---- */

struct tracer_row {
    const char *name;
    unsigned number; /* the protocol's */
    struct tracer_options options;
    /* Another form of the tracer, with a row of its own: checked where forms may differ, that is in its answers.
     */
    bool is_form;
    /* A tracer that samples, and how far from brute force its answers may be. 0: it is exact. */
    struct {
        uint32_t resolution; /* cells along the longest side, as its options say */
        double cells;        /* distances agree to so many cells ... */
        double wrong_max;    /* ... but for this share of the rays that pass no edge within BLUR_CELLS */
        const char *reason;
        /* Reason why a tracer that stores depths as surfaces is not asked for rays that begin on a surface or
         * come from afar, and for light that passes. */
        const char *coarse;
        /* Why it may meet nothing within two cells of a ray's origin. */
        const char *own_way;
    } sampled;
    /* A tracer that knows what a view sees, and marks what it guesses (HIT_UNKNOWN). 0 layers: it knows
     * everything. Its answers are judged where it is to know them (seen.h), and it must say that it does. */
    struct {
        uint32_t layers, resolution; /* values of its options; of a face */
        bool is_one_face;            /* surfaces beside it, and behind the eye, are not known */
        double margin;               /* extra view of a face on each side, in halves of the view */
        double blind; /* texels from a ray's origin within which it may take a hit for the origin's own surface */
        double off;   /* error of 1 / depth where planes are hit, 1 / metres */
        double wrong_max;    /* but for this share of the rays judged, which pass no outline within a texel */
        uint32_t judged_min; /* minimum of RAY_COUNT rays through a scene; brute force says which are known */
        const char *reason;
    } seen;
    /* Reasons for which it refuses a request with an error; NULL: it does not. */
    const char *refuses_motion; /* while the shutter is open */
    const char *refuses_sizes;  /* scenes of extreme ones */
};

/* A sampled tracer is not asked for more than this of what a ray passes. */
#define BLUR_CELLS 2.0

/* Rows of a file, by its constructor. */
void tracer_rows_add(const struct tracer_row *rows, size_t count);
#define TRACER_ROWS(rows)                                                                                         \
    __attribute__((constructor)) static void add_##rows(void)                                                     \
    {                                                                                                             \
        tracer_rows_add(rows, sizeof(rows) / sizeof((rows)[0]));                                                  \
    }

struct scene_row {
    const char *name;
    struct scene *(*create)(void);
    /* Where things are while the shutter is open, or in a pose; may be NULL. */
    void (*move)(struct scene_motion *motion, uint32_t pose_count);
    uint32_t pose_count;      /* poses of the open shutter; 0: it is closed, and the pose comes as a later edit */
    bool is_finer_than_cells; /* textures finer than cells: for exact tracers alone */
    bool is_tinted;           /* light passes: not for what takes depths for surfaces */
    /* Phases of edits (conformance.c) after which answers are judged without FARLIGHT_TEST_LONG, a bit each. Each
     * set of features is another program of every tracer. */
    unsigned phases, phases_sampled; /* phases for exact tracers, and for sampled ones; 0: the scene is left out */
};
extern const struct scene_row scene_rows[];
extern const size_t scene_row_count;

/* ---- checks ---- */

struct contract_case {
    const struct tracer_row *tracer;
    const struct scene_row *scene; /* NULL: the check has its own */
};

enum check_scope {
    CHECK_EACH_SCENE = 1, /* run for each of scene_rows */
    CHECK_FORMS = 2,      /* run for forms, too */
    CHECK_SURFACES = 4,   /* not of what takes depths for surfaces */
    CHECK_BESIDE = 8,     /* not of what may meet nothing within two cells of a ray's origin */
};

struct check {
    const char *name;
    CMUnitTestFunction run; /* *state: struct contract_case */
    unsigned scope;
};
void check_add(const struct check *check);
/* A test that registers itself. */
#define CHECK(name, scope)                                                                                        \
    static void name(void **state);                                                                               \
    __attribute__((constructor)) static void add_##name(void)                                                     \
    {                                                                                                             \
        static const struct check check = {#name, name, scope};                                                   \
        check_add(&check);                                                                                        \
    }                                                                                                             \
    static void name(void **state)

/* ---- a scene with one tracer on it ---- */

#define RAY_COUNT 2000u

extern struct gpu_device *device; /* shared by all tests */

struct fixture {
    const struct tracer_row *row;
    struct scene *scene;
    struct test_edits edits;
    struct scene_motion motion;
    struct gpu_scene gpu;
    struct tracer *tracer;
    struct trace_view view; /* for tracers that depend on a view */
    bool is_eye_set;        /* the view stays; else it is renewed with each update, in front of all there is */
    struct twin twin;       /* visible surfaces, as of the last update; made on demand */
    struct seen_view seen_view;
    struct seen *seen;
    struct stage_times times; /* times of the last update */
    struct gpu_buffer rays, ray_times, answers;
    struct ray *host_rays;       /* RAY_COUNT */
    float host_times[RAY_COUNT]; /* 0 where nothing moves, and for tracers that refuse what moves */
    struct material *materials;  /* materials of the device, read back */
    uint64_t memory_before_bytes,
        others_bytes;          /* bytes on the device: before anything was there, and without the tracer */
    size_t objects_before[16]; /* live objects of the device, by kind */
};

void expect_ok(bool ok, const struct error *error);

/* Owns the scene. Brings the tracer to it; makes RAY_COUNT rays. */
void fixture_init(struct fixture *fixture, const struct tracer_row *row, struct scene *scene);
/* Begins as fixture_init() with motion while the shutter is open. */
void fixture_init_moving(struct fixture *fixture, const struct tracer_row *row, const struct scene_row *scene);
/* Begins as fixture_init() with an eye of the test's own, for a tracer that depends on a view. */
void fixture_init_seen_from(struct fixture *fixture, const struct tracer_row *row, struct scene *scene, float x,
                            float y, float z);
/* Nothing of it is left on the device. */
void fixture_finish(struct fixture *fixture);

/* Commits the edits and brings the copy on the device to them, and to the motion if there is one. */
void fixture_commit(struct fixture *fixture, struct scene_changes *changes);
/* Updates the scene and the tracer. */
bool fixture_try_update(struct fixture *fixture, struct error *error);
void fixture_update(struct fixture *fixture);
/* Parameters of the tracer's update after an update of the scene, and of the view with it. */
struct tracer_update fixture_tracer_update(struct fixture *fixture, unsigned changed);
/* The tracer alone, from nothing, in steps as short as can be; stops after `steps_max`. `steps`: those made; may
 * be NULL. */
enum tracer_progress fixture_update_in_steps(struct fixture *fixture, uint32_t steps_max, uint32_t *steps,
                                             struct error *error);

/* Pattern unlike any result: shows that a result was written, and that none was where none is due. */
#define UNTOUCHED 0xdeadbeefu

/* Answers to the fixture's rays, of which the wave has `count`; the caller frees RAY_COUNT of them: struct hit, or
 * of WAVE_ANY uint32_t. */
void *fixture_trace(struct fixture *fixture, enum wave_kind kind, uint32_t count);
/* Traces in steps of so many rays if the tracer counts rays; 0: in the smallest steps. */
void *fixture_trace_in_steps(struct fixture *fixture, enum wave_kind kind, uint32_t count, uint32_t step_rays);
/* Answers to rays of a test's own, at most RAY_COUNT. */
void fixture_trace_rays(struct fixture *fixture, enum wave_kind kind, const struct ray *rays, uint32_t count,
                        void *answers);

/* Cell of a tracer that samples; 0: an exact one. */
double fixture_cell_metres(const struct fixture *fixture);
/* Texel of a view at the farthest corner of the scene; 0: a tracer that knows everything. */
double fixture_texel_metres(const struct fixture *fixture);

/* Knowledge about a ray that is required, as of the last update. */
struct seen_answer fixture_seen(struct fixture *fixture, const struct ray *ray);
void what_a_view_sees_is_what_brute_force_counts(void **state); /* a test of its own */
/* Judgement of the closest hit of a ray that truly ends at this distance: at a surface, or at its own end. */
enum knowledge { IS_JUDGED, IS_NOT_JUDGED, CLAIMS_TO_KNOW, KNOWS_TOO_LITTLE };
enum knowledge seen_judges(const struct seen_answer *seen, const struct hit *hit, double until);
/* Whether all that it passes until then is to be known, and no outline is within a texel. */
bool seen_knows(const struct seen_answer *seen, double until);

static inline struct ray ray_from(const float origin[3], const float direction[3], float t_min, float t_max)
{
    return (struct ray){.origin_t_min = {origin[0], origin[1], origin[2], t_min},
                        .direction_t_max = {direction[0], direction[1], direction[2], t_max}};
}

/* Down from a point at a height of 10, a little askew so that no ray lies on an edge between cells. */
static inline struct ray ray_down(float x, float y)
{
    return (struct ray){{x + 0.013f, y + 0.017f, 10, 0}, {0, 0, -1, 1e9f}};
}

/* A box of one unit round the origin; boxes of it, shown by node i + 1 at x = 2 i. */
void add_box_mesh(struct test_edits *edits, uint32_t id);
struct scene *scene_of_boxes(uint32_t count);
void add_box(struct test_edits *edits, uint32_t node, float x, float y, float z);

/* The next update takes everything as changed. */
static inline void tracer_outdate(struct tracer *tracer)
{
    tracer_update_abandon(tracer);
    tracer->updated = false;
}

#endif
