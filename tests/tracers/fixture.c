/* SPDX-License-Identifier: MIT */
/* The fixture of the contract: a scene, a tracer, and brute force beside it. */
#include "tests/tracers/contract.h"

#include "gpu/registry.h"

struct gpu_device *device;

#define VIEW_PIXELS 256u
#define VIEW_FOV (float)(TWIN_PI / 2)

void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

/* ---- the view ---- */

static void look_along_z_from(struct fixture *fixture, const float eye[3])
{
    fixture->view = (struct trace_view){.world_from_view = {1, 0, 0, eye[0], 0, 1, 0, eye[1], 0, 0, 1, eye[2]},
                                        .fov_y = VIEW_FOV,
                                        .width = VIEW_PIXELS,
                                        .height = VIEW_PIXELS};
}

/* In front of all there is, a little askew, so that no edge of a face lies in a plane of the scene. */
static void place_view(struct fixture *fixture)
{
    const float *low = fixture->gpu.lower_world, *high = fixture->gpu.upper_world;
    static const float askew[3] = {0.031f, 0.043f, 1.3f};
    float size = 0, eye[3];
    if (fixture->is_eye_set)
        return;
    for (int k = 0; k < 3; k++)
        size = fmaxf(size, high[k] - low[k]);
    for (int k = 0; k < 3; k++)
        eye[k] = 0.5f * (low[k] + high[k]) + askew[k] * (size > 0 ? size : 4);
    look_along_z_from(fixture, eye);
}

/* The faces of a cube; or the first of them, which looks as the view does, with a margin on either side. */
static void tell_view(struct fixture *fixture)
{
    const struct tracer_row *row = fixture->row;
    double eye[3];
    for (int k = 0; k < 3; k++)
        eye[k] = (double)fixture->view.world_from_view[4 * k + 3];
    fixture->seen_view = (struct seen_view){.layers = row->seen.layers, .blind = row->seen.blind};
    seen_view_of_cube(&fixture->seen_view, eye, row->seen.resolution);
    fixture->seen_view.is_bounded = true;
    for (int k = 0; k < 3; k++) {
        fixture->seen_view.lower[k] = (double)fixture->gpu.lower_world[k];
        fixture->seen_view.upper[k] = (double)fixture->gpu.upper_world[k];
    }
    if (row->seen.is_one_face) {
        fixture->seen_view.faces = 1;
        fixture->seen_view.half += row->seen.margin; /* 1 is the view's own */
    }
}

static void forget_seen(struct fixture *fixture)
{
    if (!fixture->seen)
        return;
    seen_destroy(fixture->seen);
    twin_finish(&fixture->twin);
    fixture->seen = NULL;
}

struct seen_answer fixture_seen(struct fixture *fixture, const struct ray *ray)
{
    struct seen_answer answer = {INFINITY, INFINITY, INFINITY, (double)ray->direction_t_max[3]};
    if (fixture->row->seen.layers == 0)
        return answer;
    if (!fixture->seen) {
        tell_view(fixture);
        twin_init_moving(&fixture->twin, fixture->scene, fixture->motion.pose_count ? &fixture->motion : NULL);
        fixture->seen = seen_create(&fixture->twin, &fixture->seen_view);
    }
    seen_trace(&answer, fixture->seen, ray);
    return answer;
}

/* Allowed error of a hit's distance. */
static double slack_of(double distance)
{
    return 1e-4 * (1 + fabs(distance));
}

enum knowledge seen_judges(const struct seen_answer *seen, const struct hit *hit, double until)
{
    const bool claims = !(hit->material & HIT_UNKNOWN);
    /* Whatever it has met or missed before, it goes on where nothing is known. */
    const double claimed = hit->distance < 0 ? seen->end : (double)hit->distance;
    if (claims && seen->unknown < claimed - slack_of(claimed))
        return CLAIMS_TO_KNOW;
    if (!seen_knows(seen, until))
        return IS_NOT_JUDGED;
    return claims ? IS_JUDGED : KNOWS_TOO_LITTLE;
}

bool seen_knows(const struct seen_answer *seen, double until)
{
    /* The surface at the end of the way may be what hides all behind it, and that is in double where it is. */
    const double rounding = 1e-6 * (1 + fabs(until));
    return seen->maybe_unknown >= until - rounding && seen->edge > until + slack_of(until);
}

/* ---- the scene and its tracer ---- */

void fixture_commit(struct fixture *fixture, struct scene_changes *changes)
{
    struct error error = {0};
    forget_seen(fixture);
    if (fixture->edits.count > 0)
        test_commit(&fixture->edits);
    const struct scene_motion *motion = fixture->motion.pose_count ? &fixture->motion : NULL;
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, motion, changes, NULL, &error), &error);
    size_t bytes = fixture->gpu.material_count * sizeof(*fixture->materials);
    fixture->materials = realloc(fixture->materials, bytes);
    gpu_buffer_read(device, &fixture->gpu.tables, (size_t)fixture->gpu.table_starts.materials * 16,
                    fixture->materials, bytes);
}

struct tracer_update fixture_tracer_update(struct fixture *fixture, unsigned changed)
{
    const struct trace_view before = fixture->view;
    place_view(fixture);
    if (memcmp(&before, &fixture->view, sizeof(before)) != 0)
        changed |= CHANGED_VIEW;
    return (struct tracer_update){.changed = changed,
                                  .view = fixture->tracer->impl->depends_on & CHANGED_VIEW ? &fixture->view : NULL,
                                  .times = &fixture->times};
}

bool fixture_try_update(struct fixture *fixture, struct error *error)
{
    struct scene_changes changes;
    fixture_commit(fixture, &changes);
    const struct tracer_update update = fixture_tracer_update(fixture, changes.bits);
    stage_times_begin(&fixture->times);
    return tracer_update(fixture->tracer, &fixture->gpu, &update, error);
}

void fixture_update(struct fixture *fixture)
{
    struct error error = {0};
    expect_ok(fixture_try_update(fixture, &error), &error);
}

enum tracer_progress fixture_update_in_steps(struct fixture *fixture, uint32_t steps_max, uint32_t *steps,
                                             struct error *error)
{
    /* The tracer is outdated, and takes everything as changed. */
    const struct tracer_update update = fixture_tracer_update(fixture, 0);
    enum tracer_progress progress = TRACER_MORE;
    uint32_t made = 0;
    stage_times_begin(&fixture->times);
    for (; made < steps_max && progress == TRACER_MORE; made++) {
        progress = tracer_update_step(fixture->tracer, &fixture->gpu, &update, 0, error);
        /* Memory of the device that is not others' is the structure's, in the middle of an update too. */
        assert_int_equal(device->memory_used_bytes - fixture->others_bytes, tracer_device_bytes(fixture->tracer));
    }
    if (steps)
        *steps = made;
    return progress;
}

/* Mostly at the scene from around it and from within, of any length of direction; some dead, some short, some
 * along an axis or across one. */
static void make_rays(struct fixture *fixture)
{
    const float *low = fixture->gpu.lower_world, *high = fixture->gpu.upper_world;
    uint64_t seed = 42;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        struct ray *ray = &fixture->host_rays[i];
        float length = test_uniform(&seed, 0.2f, 3.0f), squared = 0.0f;
        for (int k = 0; k < 3; k++) {
            float margin = i % 3 ? 1.0f : 0.0f;
            ray->origin_t_min[k] = test_uniform(&seed, low[k] - margin, high[k] + margin);
            ray->direction_t_max[k] = test_uniform(&seed, low[k], high[k]) - ray->origin_t_min[k];
            squared += ray->direction_t_max[k] * ray->direction_t_max[k];
        }
        for (int k = 0; k < 3; k++)
            ray->direction_t_max[k] *= length / sqrtf(squared);
        for (uint32_t k = 0; k < 3; k++)
            if (i % 13 == 5 && (i / 13 % 3 == k) == (i % 2 == 0))
                ray->direction_t_max[k] = k == 1 ? -0.0f : 0.0f;
        ray->origin_t_min[3] = 1e-3f;
        ray->direction_t_max[3] = i % 5 ? 1e6f : test_uniform(&seed, 0.5f, 3.0f);
        if (i % 17 == 0)
            ray->direction_t_max[3] = i % 2 ? 0.0f : -1.0f;
    }
    for (uint32_t i = 0; fixture->motion.pose_count > 1 && !fixture->row->refuses_motion && i < RAY_COUNT; i++)
        fixture->host_times[i] = i % 11 == 0 ? (float)(i % 2) : test_uniform(&seed, 0, 1);
    struct error error = {0};
    expect_ok(
        gpu_buffer_upload(device, &fixture->ray_times, fixture->host_times, sizeof(fixture->host_times), &error) &&
            gpu_buffer_upload(device, &fixture->rays, fixture->host_rays, RAY_COUNT * sizeof(struct ray), &error),
        &error);
}

static void count_objects(size_t counts[16])
{
    for (int kind = 0; kind < GPU_OBJECT_KIND_COUNT; kind++)
        if (kind != GPU_PROGRAM && kind != GPU_TIMESTAMP_QUERY) /* the device keeps them for others */
            counts[kind] = gpu_registry_count(device->registry, (enum gpu_object_kind)kind);
}

static void init(struct fixture *fixture)
{
    struct error error = {0};
    const struct tracer_row *row = fixture->row;
    fixture->edits.scene = fixture->scene;
    fixture->host_rays = malloc(RAY_COUNT * sizeof(struct ray));
    fixture->memory_before_bytes = device->memory_used_bytes;
    count_objects(fixture->objects_before);
    gpu_scene_init(&fixture->gpu, device);
    fixture->tracer = tracer_create(tracer_impl_by_number(row->number), device, &row->options, &error);
    expect_ok(fixture->tracer != NULL, &error);
    fixture_update(fixture);
    make_rays(fixture);
    expect_ok(gpu_buffer_reserve(device, &fixture->answers, RAY_COUNT * sizeof(struct hit), &error), &error);
    fixture->others_bytes = device->memory_used_bytes - fixture->tracer->stats.device_bytes;
}

void fixture_init(struct fixture *fixture, const struct tracer_row *row, struct scene *scene)
{
    *fixture = (struct fixture){.row = row, .scene = scene};
    init(fixture);
}

void fixture_init_seen_from(struct fixture *fixture, const struct tracer_row *row, struct scene *scene, float x,
                            float y, float z)
{
    *fixture = (struct fixture){.row = row, .scene = scene, .is_eye_set = true};
    look_along_z_from(fixture, (const float[3]){x, y, z});
    init(fixture);
}

void fixture_init_moving(struct fixture *fixture, const struct tracer_row *row, const struct scene_row *scene)
{
    *fixture = (struct fixture){.row = row, .scene = scene->create()};
    if (scene->pose_count > 0)
        scene->move(&fixture->motion, scene->pose_count);
    init(fixture);
    fixture->is_eye_set = true; /* edits follow one another before the same eye */
}

void fixture_finish(struct fixture *fixture)
{
    size_t objects[16] = {0};
    forget_seen(fixture);
    gpu_buffer_finish(device, &fixture->rays);
    gpu_buffer_finish(device, &fixture->ray_times);
    gpu_buffer_finish(device, &fixture->answers);
    tracer_destroy(fixture->tracer);
    gpu_scene_finish(&fixture->gpu);
    scene_motion_finish(&fixture->motion);
    scene_destroy(fixture->scene);
    free(fixture->host_rays);
    free(fixture->materials);
    assert_int_equal(device->memory_used_bytes, fixture->memory_before_bytes);
    count_objects(objects);
    for (int kind = 0; kind < GPU_OBJECT_KIND_COUNT; kind++)
        if (objects[kind] != fixture->objects_before[kind])
            fail_msg("%zu objects of kind %d, %zu before", objects[kind], kind, fixture->objects_before[kind]);
}

double fixture_cell_metres(const struct fixture *fixture)
{
    double longest = 0;
    if (fixture->row->sampled.resolution == 0)
        return 0;
    for (int k = 0; k < 3; k++)
        longest = fmax(longest, (double)(fixture->gpu.upper_world[k] - fixture->gpu.lower_world[k]));
    return longest / (fixture->row->sampled.resolution - 2.0); /* a cell on either side is no part of the scene */
}

double fixture_texel_metres(const struct fixture *fixture)
{
    double squared = 0;
    if (fixture->row->seen.layers == 0)
        return 0;
    for (int k = 0; k < 3; k++) {
        const float eye = fixture->view.world_from_view[4 * k + 3];
        const double away = (double)fmaxf(eye - fixture->gpu.lower_world[k], fixture->gpu.upper_world[k] - eye);
        squared += away * away;
    }
    return sqrt(squared) * 2 / fixture->row->seen.resolution;
}

/* ---- waves ---- */

static size_t answer_bytes(enum wave_kind kind)
{
    return kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit);
}

/* Clears the answers; the caller says which rays of the wave are traced. */
static struct wave begin_wave(struct fixture *fixture, enum wave_kind kind, uint32_t count)
{
    gpu_buffer_clear(device, &fixture->answers, UNTOUCHED);
    bool timed = fixture->motion.pose_count > 1 && !fixture->row->refuses_motion;
    return (struct wave){.kind = kind,
                         .ray_count = count,
                         .rays = &fixture->rays,
                         .hits = &fixture->answers,
                         .visibility = &fixture->answers,
                         .times = timed ? &fixture->ray_times : NULL};
}

static void run_wave(struct fixture *fixture, const struct wave *wave)
{
    struct error error = {0};
    gpu_scene_bind(&fixture->gpu);
    expect_ok(tracer_trace(fixture->tracer, &fixture->gpu, wave, &error), &error);
}

static void *read_answers(struct fixture *fixture, enum wave_kind kind)
{
    void *answers = malloc(RAY_COUNT * answer_bytes(kind));
    gpu_buffer_read(device, &fixture->answers, 0, answers, RAY_COUNT * answer_bytes(kind));
    return answers;
}

void *fixture_trace(struct fixture *fixture, enum wave_kind kind, uint32_t count)
{
    struct wave wave = begin_wave(fixture, kind, count);
    run_wave(fixture, &wave);
    return read_answers(fixture, kind);
}

void *fixture_trace_in_steps(struct fixture *fixture, enum wave_kind kind, uint32_t count, uint32_t step_rays)
{
    struct tracer *tracer = fixture->tracer;
    struct error error = {0};
    const struct wave wave = begin_wave(fixture, kind, count);
    struct trace_state *state = trace_state_create(tracer->impl, device, &tracer->options, &error);
    expect_ok(state && tracer_trace_begin(tracer, &fixture->gpu, &wave, state, &error), &error);
    gpu_scene_bind(&fixture->gpu);
    enum tracer_progress progress = TRACER_MORE;
    while (progress == TRACER_MORE) {
        state->step_rays[wave.family] = step_rays;
        progress = tracer_trace_step(tracer, &fixture->gpu, state, step_rays > 0 ? STEP_NS : 0, &error);
    }
    expect_ok(progress == TRACER_DONE, &error);
    trace_state_destroy(state);
    return read_answers(fixture, kind);
}

void fixture_trace_rays(struct fixture *fixture, enum wave_kind kind, const struct ray *rays, uint32_t count,
                        void *answers)
{
    struct error error = {0};
    assert_in_range(count, 1, RAY_COUNT);
    expect_ok(gpu_buffer_upload(device, &fixture->rays, rays, count * sizeof(*rays), &error), &error);
    struct wave wave = begin_wave(fixture, kind, count);
    run_wave(fixture, &wave);
    gpu_buffer_read(device, &fixture->answers, 0, answers, count * answer_bytes(kind));
    expect_ok(gpu_buffer_upload(device, &fixture->rays, fixture->host_rays, RAY_COUNT * sizeof(*rays), &error),
              &error);
}

/* ---- boxes ---- */

void add_box_mesh(struct test_edits *edits, uint32_t id)
{
    float positions[24][3];
    uint32_t indices[36];
    for (uint32_t side = 0; side < 6; side++) {
        uint32_t axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3, first = 4 * side;
        for (uint32_t corner = 0; corner < 4; corner++) {
            float *p = positions[first + corner];
            p[axis] = side % 2 ? 0.5f : -0.5f;
            p[u] = (corner == 1 || corner == 2) == (side % 2 != 0) ? 0.5f : -0.5f;
            p[v] = corner >= 2 ? 0.5f : -0.5f;
        }
        memcpy(&indices[6 * side], (uint32_t[6]){first, first + 1, first + 2, first, first + 2, first + 3},
               6 * sizeof(*indices));
    }
    test_mesh(edits, id, (const float(*)[3])positions, 24, indices, 12);
}

void add_box(struct test_edits *edits, uint32_t node, float x, float y, float z)
{
    const float m[12] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z};
    test_node(edits, node, 0, NODE_MESH, 10, m);
}

struct scene *scene_of_boxes(uint32_t count)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_box_mesh(&edits, 10);
    for (uint32_t i = 0; i < count; i++)
        add_box(&edits, i + 1, 2 * (float)i, 0, 0);
    test_commit(&edits);
    return edits.scene;
}
