/* SPDX-License-Identifier: MIT */
/* The tracer bvh against Embree, ray by ray, on waves such as a frame sends: what shading does with the hits
 * cannot hide a difference.
 *
 * Two answers agree if both are misses, or both are hits whose distances differ by no more than rounding. Where
 * they do not, the ray may lie on an edge: then the last bits of a product decide whether it passes, and each
 * tracer is right. It counts as one if the reference itself gives bvh's answer to the ray moved by a few rounding
 * steps. Both tracers take a ray to object space, by three products and three sums a coordinate, each of which
 * rounds by half a step, and by matrices that round by half a step; EDGE_STEPS is the sum of that. */
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/device.h"

#include "shared/hit.h"
#include "shared/ray.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"

#include <float.h>

#define SIDE 160u
#define RAY_COUNT (SIDE * SIDE)
#define EDGE_STEPS 6.0f
/* Number of ways in which a ray is moved: at the tip of a triangle of one degree, one in 360 falls on it.
 * Most rays need few. */
#define EDGE_TRIES_FEW 64u
#define EDGE_TRIES_MANY 8192u
#define SHOWN_MAX 10u
/* A distance is the quotient of two sums of three products of differences: some 16 steps of its coordinates in the
 * plane's space, which an instance stretches by up to 2 in these scenes; and it grows as the ray slants. */
#define DISTANCE_STEPS 32.0f
/* Required agreement: 99.99 %, edges aside, and a median relative error below 1e-6. */
#define DISAGREED_MAX (RAY_COUNT / 10000)
#define MEDIAN_MAX 1e-6
/* Edges are a few rounding steps wide, so few rays meet one; many would mean that something else is called one. */
#define EDGES_MAX (RAY_COUNT / 1000)

enum rays_tried { RAYS_PRIMARY, RAYS_BOUNCE, RAYS_SHADOW, RAYS_INSIDE, RAYS_AT_VERTICES };
static const char *const kind_names[] = {"primary rays", "bounced rays", "shadow rays", "rays from inside",
                                         "rays at vertices"};

struct arena {
    struct scene *scene;
    struct gpu_scene gpu;
    struct tracer *bvh, *reference;
    struct gpu_buffer ray_buffer, answer_buffer;
    struct ray *rays;
    struct hit *primary_hits; /* the reference's */
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

/* ---- rays ---- */

static void set_ray(struct ray *ray, const float origin[3], const float direction[3], float t_max)
{
    float squared = 0.0f;
    for (int k = 0; k < 3; k++)
        squared += direction[k] * direction[k];
    float length = sqrtf(squared);
    for (int k = 0; k < 3; k++) {
        ray->origin_t_min[k] = origin[k];
        ray->direction_t_max[k] = direction[k] / length;
    }
    ray->origin_t_min[3] = 0.0f;
    ray->direction_t_max[3] = t_max < 0.0f ? length : t_max;
}

/* A view of all of it, at a slant so that no ray runs along an axis. */
static void make_primary(struct arena *arena)
{
    const float *low = arena->gpu.lower_world, *high = arena->gpu.upper_world;
    float centre[3], eye[3], forward[3], size = arena->gpu.diagonal;
    static const float from[3] = {0.31f, 0.47f, 0.83f}, right[3] = {0.937f, 0, -0.35f},
                       up[3] = {-0.164f, 0.883f, -0.44f};
    for (int k = 0; k < 3; k++) {
        centre[k] = 0.5f * (low[k] + high[k]);
        eye[k] = centre[k] + size * from[k];
        forward[k] = centre[k] - eye[k];
    }
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float u = ((float)(i % SIDE) + 0.5f) / SIDE - 0.5f, v = 0.5f - ((float)(i / SIDE) + 0.5f) / SIDE;
        float direction[3];
        for (int k = 0; k < 3; k++)
            direction[k] = forward[k] + 0.6f * size * (u * right[k] + v * up[k]);
        set_ray(&arena->rays[i], eye, direction, FLT_MAX);
    }
}

static void unpack_unit(float out[3], uint32_t bits)
{
    float x = (float)(int16_t)(bits & 0xffff) / 32767, y = (float)(int16_t)(bits >> 16) / 32767;
    out[2] = 1 - fabsf(x) - fabsf(y);
    out[0] = out[2] < 0 ? (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f) : x;
    out[1] = out[2] < 0 ? (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f) : y;
}

/* On from where the primary rays hit: in a random direction on the same side, or to a light. Where they hit
 * nothing the ray is dead. */
static void make_secondary(struct arena *arena, bool shadow)
{
    uint64_t seed = 7;
    struct ray *from = malloc(RAY_COUNT * sizeof(*from));
    make_primary(arena);
    memcpy(from, arena->rays, RAY_COUNT * sizeof(*from));
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const struct hit *hit = &arena->primary_hits[i];
        float normal[3], origin[3], direction[3];
        unpack_unit(normal, hit->normal_geometric);
        float side = hit->material & HIT_BACK_FACE ? -1.0f : 1.0f;
        for (int k = 0; k < 3; k++) {
            float light = arena->gpu.upper_world[k] + 0.4f * arena->gpu.diagonal;
            origin[k] =
                from[i].origin_t_min[k] + hit->distance * from[i].direction_t_max[k] + 1e-3f * side * normal[k];
            direction[k] =
                shadow ? light - origin[k] : side * normal[k] * 1.001f + test_uniform(&seed, -0.57f, 0.57f);
        }
        set_ray(&arena->rays[i], origin, direction, shadow ? -1.0f : FLT_MAX);
        if (hit->distance < 0)
            arena->rays[i].direction_t_max[3] = 0.0f;
    }
    free(from);
}

static void make_inside(struct arena *arena)
{
    uint64_t seed = 11;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float origin[3], direction[3];
        for (int k = 0; k < 3; k++) {
            origin[k] = test_uniform(&seed, arena->gpu.lower_world[k], arena->gpu.upper_world[k]);
            direction[k] = test_uniform(&seed, -1, 1);
        }
        set_ray(&arena->rays[i], origin, direction, FLT_MAX);
    }
}

/* Where edges meet, from where the camera is: what may be missed between them, or by rounding, is missed here. */
static void make_at_vertices(struct arena *arena)
{
    uint64_t seed = 13;
    make_primary(arena);
    for (uint32_t i = 0; i < RAY_COUNT;) {
        const struct instance *instance = &arena->gpu.instances[test_random(&seed) % arena->gpu.instance_count];
        const struct scene_mesh *mesh = arena->gpu.geometries[instance->geometry].mesh;
        if (!mesh)
            continue;
        const float *vertex = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data +
                              3 * (size_t)(test_random(&seed) % mesh->value.vertex_count);
        float direction[3];
        for (int k = 0; k < 3; k++) {
            const float *m = instance->world_from_object[k];
            direction[k] =
                m[0] * vertex[0] + m[1] * vertex[1] + m[2] * vertex[2] + m[3] - arena->rays[i].origin_t_min[k];
        }
        const float origin[3] = {arena->rays[i].origin_t_min[0], arena->rays[i].origin_t_min[1],
                                 arena->rays[i].origin_t_min[2]};
        set_ray(&arena->rays[i++], origin, direction, FLT_MAX);
    }
}

/* ---- tracing ---- */

static void *trace(struct arena *arena, struct tracer *tracer, const struct ray *rays, uint32_t count,
                   enum rays_tried kind)
{
    struct error error = {0};
    bool any = kind == RAYS_SHADOW;
    size_t bytes = count * (any ? sizeof(uint32_t) : sizeof(struct hit));
    expect_ok(gpu_buffer_upload(device, &arena->ray_buffer, rays, count * sizeof(*rays), &error), &error);
    expect_ok(gpu_buffer_reserve(device, &arena->answer_buffer, bytes, &error), &error);
    const struct wave wave = {.kind = any ? WAVE_ANY : WAVE_CLOSEST,
                              .ray_count = count,
                              .rays = &arena->ray_buffer,
                              .hits = &arena->answer_buffer,
                              .visibility = &arena->answer_buffer,
                              .shared_origin = kind == RAYS_PRIMARY};
    gpu_scene_bind(&arena->gpu);
    expect_ok(tracer_trace(tracer, &arena->gpu, &wave, &error), &error);
    void *answers = malloc(bytes);
    gpu_buffer_read(device, &arena->answer_buffer, 0, answers, bytes);
    return answers;
}

static struct tracer *make_tracer(struct arena *arena, unsigned number)
{
    struct error error = {0};
    const struct tracer_update all = {.changed = CHANGED_SCENE};
    struct tracer *tracer = tracer_create(tracer_impl_by_number(number), device, NULL, &error);
    expect_ok(tracer && tracer_update(tracer, &arena->gpu, &all, &error), &error);
    return tracer;
}

static void arena_init(struct arena *arena, struct scene *scene)
{
    struct error error = {0};
    struct scene_changes changes;
    *arena = (struct arena){.scene = scene, .rays = malloc(RAY_COUNT * sizeof(struct ray))};
    gpu_scene_init(&arena->gpu, device);
    expect_ok(gpu_scene_update(&arena->gpu, scene, NULL, &changes, NULL, &error), &error);
    arena->bvh = make_tracer(arena, TRACER_BVH);
    arena->reference = make_tracer(arena, TRACER_REFERENCE);
    make_primary(arena);
    arena->primary_hits = trace(arena, arena->reference, arena->rays, RAY_COUNT, RAYS_PRIMARY);
}

static void arena_finish(struct arena *arena)
{
    tracer_destroy(arena->bvh);
    tracer_destroy(arena->reference);
    gpu_buffer_finish(device, &arena->ray_buffer);
    gpu_buffer_finish(device, &arena->answer_buffer);
    gpu_scene_finish(&arena->gpu);
    scene_destroy(arena->scene);
    free(arena->rays);
    free(arena->primary_hits);
}

/* ---- comparing ---- */

static bool hits_agree(const struct arena *arena, const struct ray *ray, const struct hit *a, const struct hit *b)
{
    if (a->distance < 0 || b->distance < 0)
        return (a->distance < 0) == (b->distance < 0);
    float normal[3], cosine = 0.0f, squared = 0.0f;
    unpack_unit(normal, a->normal_geometric);
    for (int k = 0; k < 3; k++) {
        cosine += normal[k] * ray->direction_t_max[k];
        squared += normal[k] * normal[k];
    }
    float slant = fmaxf(fabsf(cosine) / sqrtf(squared), 1e-3f), size = arena->gpu.diagonal + a->distance;
    return fabsf(a->distance - b->distance) <= DISTANCE_STEPS * 0.5f * FLT_EPSILON * size / slant;
}

/* Transmittances are products of up to some ten factors: the last step may round either way. */
static bool visibilities_agree(uint32_t a, uint32_t b)
{
    for (unsigned shift = 0; shift < 3 * VISIBILITY_BITS; shift += VISIBILITY_BITS)
        if (abs((int)(a >> shift & VISIBILITY_MAX) - (int)(b >> shift & VISIBILITY_MAX)) > 1)
            return false;
    return true;
}

static bool agree(const struct arena *arena, enum rays_tried kind, const struct ray *ray, const void *a,
                  uint32_t index_a, const void *b, uint32_t index_b)
{
    if (kind == RAYS_SHADOW)
        return visibilities_agree(((const uint32_t *)a)[index_a], ((const uint32_t *)b)[index_b]);
    return hits_agree(arena, ray, &((const struct hit *)a)[index_a], &((const struct hit *)b)[index_b]);
}

/* Does the reference give bvh's answer to the ray moved a little? */
static bool is_answered_nearby(struct arena *arena, enum rays_tried kind, uint32_t ray, const void *bvh_answers,
                               uint32_t tries)
{
    struct ray *moved = calloc(tries, sizeof(*moved));
    const float steps = EDGE_STEPS * 0.5f * FLT_EPSILON;
    uint64_t seed = ray;
    for (uint32_t i = 0; i < tries; i++) {
        moved[i] = arena->rays[ray];
        for (int k = 0; k < 3; k++) {
            moved[i].origin_t_min[k] += test_uniform(&seed, -steps, steps) * arena->gpu.diagonal;
            moved[i].direction_t_max[k] += test_uniform(&seed, -steps, steps);
        }
    }
    void *answers = trace(arena, arena->reference, moved, tries, kind);
    bool found = false;
    for (uint32_t i = 0; i < tries && !found; i++)
        found = agree(arena, kind, &moved[i], answers, i, bvh_answers, ray);
    free(answers);
    free(moved);
    return found;
}

static bool is_on_edge(struct arena *arena, enum rays_tried kind, uint32_t ray, const void *bvh_answers)
{
    return is_answered_nearby(arena, kind, ray, bvh_answers, EDGE_TRIES_FEW) ||
           is_answered_nearby(arena, kind, ray, bvh_answers, EDGE_TRIES_MANY);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median_error(const struct hit *reference, const struct hit *bvh, uint32_t *count)
{
    double *errors = malloc(RAY_COUNT * sizeof(*errors)), median = 0;
    *count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        if (reference[i].distance > 0 && bvh[i].primitive == reference[i].primitive &&
            bvh[i].instance == reference[i].instance)
            errors[(*count)++] = fabs((double)bvh[i].distance / (double)reference[i].distance - 1);
    qsort(errors, *count, sizeof(*errors), by_size);
    if (*count > 0)
        median = errors[*count / 2];
    free(errors);
    return median;
}

static void compare(struct arena *arena, enum rays_tried kind)
{
    void *reference = trace(arena, arena->reference, arena->rays, RAY_COUNT, kind);
    void *bvh = trace(arena, arena->bvh, arena->rays, RAY_COUNT, kind);
    uint32_t edges = 0, disagreed = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        if (agree(arena, kind, &arena->rays[i], reference, i, bvh, i))
            continue;
        if (is_on_edge(arena, kind, i, bvh)) {
            edges++;
            continue;
        }
        if (++disagreed > SHOWN_MAX)
            continue;
        const struct hit *r = &((struct hit *)reference)[i], *b = &((struct hit *)bvh)[i];
        if (kind == RAYS_SHADOW)
            printf("  ray %u: reference %08x, bvh %08x\n", i, ((uint32_t *)reference)[i], ((uint32_t *)bvh)[i]);
        else
            printf("  ray %u: reference %.9g (primitive %u), bvh %.9g (primitive %u)\n", i, (double)r->distance,
                   r->primitive, (double)b->distance, b->primitive);
    }
    printf("  %s: %u rays, %u differ of which %u lie on edges", kind_names[kind], RAY_COUNT, edges + disagreed,
           edges);
    if (kind != RAYS_SHADOW) {
        uint32_t hit_count = 0;
        double median = median_error(reference, bvh, &hit_count);
        printf("; %u hit the same, median relative error of the distance %.2g", hit_count, median);
        assert_in_range(hit_count, RAY_COUNT / 40, RAY_COUNT); /* else the rays test nothing */
        assert_true(median < MEDIAN_MAX);
    }
    printf("\n");
    free(reference);
    free(bvh);
    assert_in_range(disagreed, 0, DISAGREED_MAX);
    if (kind != RAYS_AT_VERTICES)
        assert_in_range(edges, 0, EDGES_MAX);
}

static int open_device_beside_embree(void **state)
{
    struct error error = {0};
    if (tracer_find(TRACER_REFERENCE, "tracer", &error))
        return open_device(state);
    test_skip_file("%s", error.text);
    return 0;
}
ALL_TESTS(open_device_beside_embree, close_device)

static void expect_agreement(struct scene *scene)
{
    struct arena arena;
    arena_init(&arena, scene);
    compare(&arena, RAYS_PRIMARY);
    make_secondary(&arena, false);
    compare(&arena, RAYS_BOUNCE);
    make_secondary(&arena, true);
    compare(&arena, RAYS_SHADOW);
    make_inside(&arena);
    compare(&arena, RAYS_INSIDE);
    make_at_vertices(&arena);
    compare(&arena, RAYS_AT_VERTICES);
    arena_finish(&arena);
}

TEST(bvh_agrees_with_the_reference_on_a_triangle_soup_in_mirrored_squeezed_and_nested_instances)
{
    expect_agreement(test_scene_soup());
}

TEST_LONG(bvh_agrees_with_the_reference_on_spheres_among_triangles)
{
    expect_agreement(test_scene_spheres());
}

TEST_LONG(bvh_agrees_with_the_reference_on_cutouts_glass_panes_and_a_disc)
{
    expect_agreement(test_scene_translucent());
}

/* Debian's Embree ends the process at a ray whose numbers it does not take, in the world or in an instance. */
TEST(rays_that_embree_would_end_the_process_at_hit_nothing)
{
    static const float odd[] = {NAN, INFINITY, -INFINITY, 1e19f, -3e38f, 4e17f};
    struct arena arena;
    arena_init(&arena, test_scene_soup());
    make_inside(&arena);
    for (uint32_t i = 0; i < 64; i++) {
        float *of = i % 2 ? arena.rays[i].origin_t_min : arena.rays[i].direction_t_max;
        of[i / 2 % 3] = odd[i % 6];
        if (i >= 48)
            memset(arena.rays[i].direction_t_max, 0, 3 * sizeof(float));
    }
    struct hit *hits = trace(&arena, arena.reference, arena.rays, RAY_COUNT, RAYS_INSIDE);
    uint32_t *visibilities = trace(&arena, arena.reference, arena.rays, RAY_COUNT, RAYS_SHADOW);
    for (uint32_t i = 0; i < 64; i++) {
        bool far_away = i < 48 && odd[i % 6] == 4e17f;
        if (far_away)
            continue;
        assert_float_equal(hits[i].distance, -1.0f, 0.0f);
        assert_int_equal(visibilities[i], 0xffffffff);
    }
    free(hits);
    free(visibilities);
    arena_finish(&arena);
}

TEST(a_transform_that_embree_cannot_invert_is_refused_by_name)
{
    const struct tracer_update all = {.changed = CHANGED_SCENE};
    struct arena arena;
    arena_init(&arena, test_scene_soup());
    for (int round = 0; round < 2; round++) {
        struct test_edits edits = {.scene = arena.scene};
        struct scene_changes changes;
        struct error error = {0};
        float m[12], scale = round == 0 ? 1e-12f : 1e-3f;
        test_transform(m, scale, scale, scale, 1, 0.3f, 0, 0, 0);
        test_node(&edits, 2, 0, NODE_MESH, 10, m);
        test_commit(&edits);
        expect_ok(gpu_scene_update(&arena.gpu, arena.scene, NULL, &changes, NULL, &error), &error);
        bool ok = tracer_update(arena.reference, &arena.gpu, &all, &error);
        assert_int_equal(ok, round == 1);
        assert_int_equal(error.kind, round == 0 ? ERROR_UNSUPPORTED : ERROR_NONE);
        if (round == 0)
            assert_string_equal(error.field, "node 2.parent_from_node");
    }
    arena_finish(&arena);
}

TEST(a_scene_beyond_what_embree_sees_is_refused)
{
    const struct tracer_update all = {.changed = CHANGED_SCENE};
    struct arena arena;
    struct test_edits edits = {.scene = test_scene_soup()};
    struct scene_changes changes;
    struct error error = {0};
    float m[12];
    arena_init(&arena, edits.scene);
    /* In the space of what is small, what is large lies beyond Embree's numbers. */
    test_transform(m, 1e-8f, 1e-8f, 1e-8f, 1, 0.3f, 0, 0, 0);
    test_node(&edits, 2, 0, NODE_MESH, 10, m);
    test_transform(m, 5e9f, 5e9f, 5e9f, 1, 0.3f, 0, 0, 0);
    test_node(&edits, 3, 0, NODE_MESH, 10, m);
    test_commit(&edits);
    expect_ok(gpu_scene_update(&arena.gpu, arena.scene, NULL, &changes, NULL, &error), &error);
    assert_false(tracer_update(arena.reference, &arena.gpu, &all, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(error.field, "tracer");
    arena_finish(&arena);
}

/* Whatever Embree had allocated by then: from nothing to almost all of it. */
TEST(embree_keeps_to_the_memory_limit_and_its_books_are_right_afterwards)
{
    const struct tracer_update all = {.changed = CHANGED_SCENE};
    const uint64_t limit = device->memory_limit_bytes;
    struct arena arena;
    struct error error = {0};
    arena_init(&arena, test_scene_soup());
    const uint64_t needed = arena.reference->stats.device_bytes, used = device->memory_used_bytes;
    assert_true(needed > 0);
    tracer_destroy(arena.reference);
    assert_true(device->memory_used_bytes == used - needed);
    arena.reference = tracer_create(tracer_impl_by_number(TRACER_REFERENCE), device, NULL, &error);
    for (uint64_t part = 0; part < 8; part++) {
        error = (struct error){0};
        device->memory_limit_bytes = used - needed + part * needed / 8;
        assert_false(tracer_update(arena.reference, &arena.gpu, &all, &error));
        assert_int_equal(error.kind, ERROR_OUT_OF_MEMORY);
        assert_int_equal(arena.reference->stats.device_bytes, 0);
        assert_true(device->memory_used_bytes == used - needed);
    }
    device->memory_limit_bytes = limit;
    expect_ok(tracer_update(arena.reference, &arena.gpu, &all, &error), &error);
    assert_true(device->memory_used_bytes == used - needed + arena.reference->stats.device_bytes);
    arena_finish(&arena);
}
