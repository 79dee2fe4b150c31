/* SPDX-License-Identifier: MIT */
/* Bounds of the rays of a wave: what a ray hits in exact arithmetic is culled at no level, whether the wave is
 * taken as it comes or turned round and sorted. The device's own programs are run (rayspace/sort.comp, nodes.comp,
 * meet.glsl), on rays and triangles as hostile as can be. */
#include "tests/unit/trace/tracer_fixture.h"

#include "shared/bindings.h"
#include "tests/fixtures/shader_probe.h"
#include "trace/program.h"
#include "trace/rayspace/tracer.h"

#include <float.h>

#define RAYSPACE_NUMBER 5u
#define RAYS 256u /* a power of four */
#define ELEMENTS 256u
#define CASES 40u /* a multiple of FORMS and of 4 */

ALL_TESTS(open_device, close_device)

TEST(a_level_has_a_node_for_every_four_of_the_level_below)
{
    uint32_t counts[64], n = 0;
    for (uint32_t power = 1; power <= 1u << 24; power *= 4) {
        counts[n++] = power;
        counts[n++] = power + 1;
    }
    counts[n++] = 17;
    counts[n++] = RAYSPACE_INDEX_MASK;
    for (uint32_t i = 0; i < n; i++) {
        const struct rayspace_levels levels = rayspace_levels_over(counts[i]);
        uint32_t first = 0, top = 0;
        for (uint64_t reach = 1; reach < counts[i]; reach *= 4)
            top++;
        assert_int_equal(levels.top, top);
        assert_true(levels.top < RAYSPACE_LEVELS);
        assert_int_equal(levels.count[0], counts[i]);
        assert_int_equal(levels.count[top], 1);
        for (uint32_t level = 1; level <= top; level++) {
            assert_int_equal(levels.count[level], (levels.count[level - 1] + 3) / 4);
            assert_int_equal(levels.first[level], first);
            first += levels.count[level];
        }
    }
}

/* ---- rays and triangles ---- */

enum form {
    FROM_A_POINT,
    PARALLEL,
    MIRRORED, /* from the surface of a ball */
    WIDE,     /* within 80 to 100 degrees of an axis */
    INCOHERENT,
    OPPOSED, /* directions of neighbours sum to zero */
    ALONG_AXES,
    FROM_BEHIND, /* t_min is negative */
    TO_A_POINT,  /* shadow rays, which end at a light */
    TO_AN_AREA,
    FORMS
};

static const char *const form_names[FORMS] = {"from a point", "parallel",  "mirrored",   "wide",
                                              "incoherent",   "opposed",   "along axes", "from behind",
                                              "to a point",   "to an area"};

struct triangle {
    double v[3][3];
};

struct fuzz {
    enum form form;
    uint64_t seed;
    double scale, offset[3];
    struct triangle triangles[ELEMENTS];
    struct ray rays[RAYS];
};

static double uniform(struct fuzz *fuzz, double low, double high)
{
    return low + (high - low) * ((double)test_random(&fuzz->seed) / 4294967296.0);
}

static bool one_in(struct fuzz *fuzz, uint32_t n)
{
    return test_random(&fuzz->seed) % n == 0;
}

static void random_unit(struct fuzz *fuzz, double v[3])
{
    const double z = uniform(fuzz, -1, 1), phi = uniform(fuzz, 0, 6.283185307179586), r = sqrt(1 - z * z);
    v[0] = r * cos(phi);
    v[1] = r * sin(phi);
    v[2] = z;
}

/* Tiny, middling, needles, huge, flat in an axis, without an area, points. */
static void make_triangle(struct fuzz *fuzz, uint32_t number)
{
    double centre[3], corner[3][3];
    for (int k = 0; k < 3; k++)
        centre[k] = uniform(fuzz, -1, 1);
    const uint32_t kind = number % 8;
    const double size = kind == 3   ? pow(10, uniform(fuzz, 1, 7))
                        : kind == 0 ? pow(10, uniform(fuzz, -6, -1))
                                    : 0.3;
    for (int v = 0; v < 3; v++)
        for (int k = 0; k < 3; k++)
            corner[v][k] = centre[k] + uniform(fuzz, -size, size);
    const int axis = (int)(test_random(&fuzz->seed) % 3);
    const double along = uniform(fuzz, 0, 1), thin = pow(10, uniform(fuzz, -9, -3));
    for (int v = 0; v < 3; v++) {
        if (kind == 4)
            corner[v][axis] = centre[axis];
        if (kind == 7)
            corner[v][axis] = corner[v][(axis + 1) % 3] = centre[axis];
    }
    for (int k = 0; k < 3; k++) {
        if (kind == 2 || kind == 5) /* its third corner is on, or near, the opposite edge */
            corner[2][k] = corner[0][k] + along * (corner[1][k] - corner[0][k]) +
                           (kind == 2 ? thin * uniform(fuzz, -1, 1) : 0);
        if (kind == 6 && number % 16 == 6)
            corner[1][k] = corner[2][k] = corner[0][k];
    }
    for (int v = 0; v < 3; v++)
        for (int k = 0; k < 3; k++)
            fuzz->triangles[number].v[v][k] = (float)(corner[v][k] * fuzz->scale + fuzz->offset[k]);
}

/* A point of a triangle, often a corner or on an edge. */
static void target_on(struct fuzz *fuzz, const struct triangle *t, double out[3])
{
    double a = uniform(fuzz, 0, 1), b = uniform(fuzz, 0, 1);
    if (a + b > 1) {
        a = 1 - a;
        b = 1 - b;
    }
    if (one_in(fuzz, 4))
        a = 0;
    if (one_in(fuzz, 4))
        b = a == 0 && one_in(fuzz, 2) ? 1 : 0;
    for (int k = 0; k < 3; k++)
        out[k] = t->v[0][k] + a * (t->v[1][k] - t->v[0][k]) + b * (t->v[2][k] - t->v[0][k]);
}

static double length_of(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* An origin, and the way to the target or elsewhere; not unit. Of rays that end at a light: how many times as far
 * as the target that is, else 0. */
static double choose_way(struct fuzz *fuzz, const double shared[2][3], const double target[3], double origin[3],
                         double way[3])
{
    double unit[3];
    random_unit(fuzz, unit);
    const double reach = fuzz->scale * pow(10, uniform(fuzz, -2, 1)), beyond = pow(10, uniform(fuzz, -4, 1)),
                 extent = fuzz->form == TO_AN_AREA ? uniform(fuzz, -0.3, 0.3) : 0;
    const double far_behind = fuzz->form == FROM_BEHIND && one_in(fuzz, 2) ? 1e5 : 1;
    for (int k = 0; k < 3; k++) {
        const double far = fuzz->offset[k] + fuzz->scale * (3 * shared[0][k] + extent * shared[1][k]);
        switch (fuzz->form) {
        case TO_A_POINT:
        case TO_AN_AREA:
            origin[k] = target[k] + beyond * (target[k] - far);
            break;
        case FROM_A_POINT:
            origin[k] = far;
            break;
        case PARALLEL:
            origin[k] = target[k] - reach * (shared[0][k] + 1e-3 * unit[k]);
            break;
        case MIRRORED:
            origin[k] = fuzz->offset[k] + fuzz->scale * 0.3 * unit[k];
            break;
        case WIDE:
        case OPPOSED:
            origin[k] = fuzz->offset[k] + fuzz->scale * 0.1 * shared[0][k];
            break;
        default:
            origin[k] = target[k] - far_behind * reach * unit[k];
        }
        origin[k] = (float)origin[k];
        way[k] = target[k] - origin[k];
    }
    if (fuzz->form == WIDE && one_in(fuzz, 2)) { /* at a right angle to the axis, or so */
        const double tilt = uniform(fuzz, -0.17, 0.17);
        double along = 0;
        for (int k = 0; k < 3; k++)
            along += unit[k] * shared[1][k];
        for (int k = 0; k < 3; k++)
            way[k] = unit[k] + (tilt - along) * shared[1][k];
    }
    if (fuzz->form == ALONG_AXES) {
        const uint32_t axis = test_random(&fuzz->seed) % 3;
        for (uint32_t k = 0; k < 3; k++) {
            origin[k] = (float)(k == axis ? origin[k] : target[k]);
            way[k] = k == axis ? target[k] - origin[k] : one_in(fuzz, 2) ? 0.0 : -0.0;
        }
    }
    return fuzz->form == TO_A_POINT || fuzz->form == TO_AN_AREA ? (1 + beyond) / beyond : 0;
}

/* How far the ray goes: without end, just to its target and a little less or more, to a light or almost, nowhere.
 */
static void choose_ends(struct fuzz *fuzz, struct ray *ray, double target_t, double light_t)
{
    float *t_min = &ray->origin_t_min[3], *t_max = &ray->direction_t_max[3];
    *t_min = one_in(fuzz, 4) ? (float)(target_t * uniform(fuzz, 0, 1.01)) : 0.0f;
    switch (test_random(&fuzz->seed) % 4) {
    case 0:
        *t_max = INFINITY;
        break;
    case 1:
        *t_max = 1e30f;
        break;
    case 2:
        *t_max = (float)target_t * (one_in(fuzz, 2) ? 1.0f : 1.0f + FLT_EPSILON);
        break;
    default:
        *t_max = (float)(target_t * uniform(fuzz, 0.5, 3));
    }
    if (light_t > 0)
        *t_max = (float)(light_t * (one_in(fuzz, 2) ? 1 : uniform(fuzz, 0.999, 1)));
    if (fuzz->form == FROM_BEHIND) /* far before the target, or just before it */
        *t_min =
            (float)(-target_t * (one_in(fuzz, 2) ? pow(10, uniform(fuzz, -3, 3)) : 1 + uniform(fuzz, 0, 1e-4)));
    if (one_in(fuzz, 16))
        *t_max = one_in(fuzz, 2) ? *t_min : -1.0f;
}

/* Neighbours aim at one triangle, in groups of all sizes. */
static void make_rays(struct fuzz *fuzz)
{
    double shared[2][3];
    random_unit(fuzz, shared[0]);
    random_unit(fuzz, shared[1]);
    for (uint32_t i = 0; i < RAYS; i++) {
        const uint32_t group = 1u << 2 * (i / (RAYS / 4) + 1);
        const uint32_t aimed = (i / group * 2654435761u >> 8) % ELEMENTS;
        double target[3], origin[3], way[3];
        target_on(fuzz, &fuzz->triangles[aimed], target);
        const double to_light = choose_way(fuzz, (const double(*)[3])shared, target, origin, way);
        /* Not of unit length, and where it is of none the ray is dead. */
        const double length = length_of(way), of_unit = pow(10, uniform(fuzz, -3, 3));
        struct ray *ray = &fuzz->rays[i];
        *ray = (struct ray){0};
        for (int k = 0; k < 3; k++) {
            ray->origin_t_min[k] = (float)origin[k];
            ray->direction_t_max[k] = length > 0 ? (float)(way[k] / length * of_unit) : 0.0f;
        }
        const bool behind = fuzz->form == FROM_BEHIND && one_in(fuzz, 2); /* so lies the target */
        for (int k = 0; k < 3 && behind; k++)
            ray->direction_t_max[k] = -ray->direction_t_max[k];
        if (fuzz->form == OPPOSED && i % 2)
            for (int k = 0; k < 3; k++)
                ray->direction_t_max[k] = -fuzz->rays[i - 1].direction_t_max[k];
        choose_ends(fuzz, ray, length / of_unit, to_light * length / of_unit);
    }
}

static void fuzz_init(struct fuzz *fuzz, uint32_t number)
{
    *fuzz = (struct fuzz){.form = (enum form)(number % FORMS), .seed = 1000 + number};
    const uint32_t world = number / FORMS;
    fuzz->scale = world % 2 == 0 ? 1 : pow(10, uniform(fuzz, -6, 6));
    double away[3];
    random_unit(fuzz, away);
    for (int k = 0; k < 3 && world / 2 % 2 > 0; k++)
        fuzz->offset[k] = 1e4 * fuzz->scale * away[k];
    for (uint32_t i = 0; i < ELEMENTS; i++)
        make_triangle(fuzz, i);
    make_rays(fuzz);
}

/* ---- the truth ---- */

static bool is_dead(const struct ray *ray)
{
    const float *d = ray->direction_t_max;
    return !(d[3] > ray->origin_t_min[3]) || (d[0] == 0 && d[1] == 0 && d[2] == 0);
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Moeller and Trumbore, in double precision. */
static bool hits(const struct ray *ray, const struct triangle *t)
{
    double d[3], edges[2][3], from[3], p[3], q[3];
    for (int k = 0; k < 3; k++) {
        d[k] = ray->direction_t_max[k];
        edges[0][k] = t->v[1][k] - t->v[0][k];
        edges[1][k] = t->v[2][k] - t->v[0][k];
        from[k] = ray->origin_t_min[k] - t->v[0][k];
    }
    cross(d, edges[1], p);
    cross(from, edges[0], q);
    const double det = dot(edges[0], p), u = dot(from, p) / det, v = dot(d, q) / det,
                 distance = dot(edges[1], q) / det;
    return det != 0 && u >= 0 && v >= 0 && u + v <= 1 && distance >= ray->origin_t_min[3] &&
           distance <= ray->direction_t_max[3];
}

/* ---- the device ---- */

/* Layout of the shader's struct. */
struct element {
    float centre_radius[4], lower[4], upper[4];
};

static float round_down(double value)
{
    return (double)(float)value > value ? nextafterf((float)value, -INFINITY) : (float)value;
}

static void bound_by_box(const struct triangle *t, struct element *e)
{
    float squared = 0;
    for (int k = 0; k < 3; k++) {
        e->lower[k] = round_down(fmin(t->v[0][k], fmin(t->v[1][k], t->v[2][k])));
        e->upper[k] = -round_down(-fmax(t->v[0][k], fmax(t->v[1][k], t->v[2][k])));
        const float half = 0.5f * e->upper[k] - 0.5f * e->lower[k];
        e->centre_radius[k] = e->lower[k] + half;
        squared += half * half;
    }
    e->centre_radius[3] = sqrtf(squared) * 1.000004f;
}

/* Result for each pair: bit 0 the cone intersects the sphere, 1 the slabs the box, 2 it may intersect, 3 a
 * ray of it is alive. */
static const char probe_text[] =
    "#include \"common/dispatch.glsl\"\n"
    "#include \"rayspace/meet.glsl\"\n"
    "#include \"rayspace/node.glsl\"\n"
    "#include \"rayspace/place.glsl\"\n"
    "layout(std430, binding = BIND_RAYSPACE_PAIRS) readonly buffer element_block { vec4 elements[]; };\n"
    "layout(std430, binding = BIND_RAYSPACE_LEAVES) writeonly buffer met_block { uint met[]; };\n"
    "uniform uint node_count, element_count;\n"
    "bundle bundle_at(uint node)\n"
    "{\n"
    "    if (node < ray_count)\n"
    "        return bundle_of_ray(ray_at_place(node));\n"
    "    return bundle_of_node(node - ray_count);\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    uint i = item_index();\n"
    "    if (i >= node_count * element_count)\n"
    "        return;\n"
    "    bundle b = bundle_at(i / element_count);\n"
    "    int e = 3 * int(i % element_count);\n"
    "    bounds what = bounds(elements[e].xyz, elements[e].w, elements[e + 1].xyz, elements[e + 2].xyz);\n"
    "    met[i] = uint(cone_meets_sphere(b, what.centre, what.radius)) |\n"
    "             uint(slabs_meet_box(b, what.lower, what.upper)) << 1 | uint(may_meet(b, what)) << 2 |\n"
    "             uint(b.end >= 0.0) << 3;\n"
    "}\n";

/* How a wave is taken. */
enum way { AS_IT_COMES, TURNED_AND_SORTED, WAYS };

static const char *const way_names[WAYS] = {"as it comes", "turned and sorted"};

struct run {
    struct fixture fixture;
    struct gpu_program programs[2]; /* for closest hits, and for shadow rays, which alone are turned round */
    struct rayspace_state state;
    struct gpu_buffer rays, elements, met;
    uint32_t places[RAYS]; /* place of each ray, in level 0 */
    uint32_t node_count;   /* with the rays themselves */
    uint32_t *words;
};

static void run_init(struct run *run)
{
    struct error error = {0};
    static const struct gpu_define any_hit[] = {{"ANY_HIT", "1"}, {0}};
    *run = (struct run){.state.levels = rayspace_levels_over(RAYS)};
    fixture_init_by(&run->fixture, RAYSPACE_NUMBER, test_scene_create(), NULL);
    run->programs[0] = shader_probe_compile(probe_text, NULL);
    run->programs[1] = shader_probe_compile(probe_text, any_hit);
    run->state.base.wave = (struct wave){.ray_count = RAYS, .rays = &run->rays};
    run->state.base.device = device;
    run->node_count = RAYS + run->state.levels.first[run->state.levels.top] + 1;
    const size_t answer_bytes = RAYS * RAYSPACE_ANSWER_BYTES, pairs = (size_t)run->node_count * ELEMENTS;
    run->words = malloc(pairs * sizeof(*run->words));
    expect_ok(gpu_buffer_reserve(device, &run->state.answers, answer_bytes, &error) &&
                  gpu_buffer_reserve(device, &run->met, pairs * sizeof(*run->words), &error) &&
                  gpu_buffer_reserve(device, &run->elements, ELEMENTS * sizeof(struct element), &error),
              &error);
    const struct rayspace_control control = {0};
    expect_ok(gpu_buffer_upload(device, &run->state.control, &control, sizeof(control), &error), &error);
}

static void run_finish(struct run *run)
{
    gpu_buffer_finish(device, &run->state.answers);
    gpu_buffer_finish(device, &run->state.control);
    gpu_buffer_finish(device, &run->state.nodes);
    gpu_buffer_finish(device, &run->rays);
    gpu_buffer_finish(device, &run->state.order);
    gpu_buffer_finish(device, &run->state.bins);
    gpu_buffer_finish(device, &run->elements);
    gpu_buffer_finish(device, &run->met);
    shader_probe_finish(&run->programs[0]);
    shader_probe_finish(&run->programs[1]);
    fixture_finish(&run->fixture);
    free(run->words);
}

static void bound_elements(struct run *run, const struct fuzz *fuzz)
{
    struct error error = {0};
    struct element elements[ELEMENTS] = {0};
    for (uint32_t i = 0; i < ELEMENTS; i++)
        bound_by_box(&fuzz->triangles[i], &elements[i]);
    expect_ok(gpu_buffer_upload(device, &run->elements, elements, sizeof(elements), &error), &error);
}

/* The hierarchy over the rays as the tracer makes it. */
static void build_nodes(struct run *run, const struct fuzz *fuzz, enum way way)
{
    struct error error = {0};
    struct rayspace_state *state = &run->state;
    const uint32_t no_hit[4] = {UINT32_MAX, RAYSPACE_NO_RANK, UINT32_MAX, RAYSPACE_NO_RANK},
                   no_light_lost[4] = {0};
    state->base.wave.kind = way == TURNED_AND_SORTED ? WAVE_ANY : WAVE_CLOSEST;
    state->turns = way ? RAYSPACE_CHANCE_ON : RAYSPACE_CHANCE_OFF;
    state->sorts = way ? RAYSPACE_CHANCE_ON : RAYSPACE_CHANCE_OFF;
    gpu_buffer_fill(device, &state->answers, 0, RAYS * RAYSPACE_ANSWER_BYTES, way ? no_light_lost : no_hit);
    const struct rayspace_control control = {0};
    gpu_buffer_write(device, &state->control, 0, &control, sizeof(control));
    expect_ok(gpu_buffer_upload(device, &run->rays, fuzz->rays, sizeof(fuzz->rays), &error) &&
                  rayspace_order_reserve(state, device, &error) && rayspace_nodes_reserve(state, device, &error) &&
                  rayspace_order_rays(state, &run->fixture.gpu, &error) &&
                  rayspace_nodes_build(state, &run->fixture.gpu, &error),
              &error);
    uint32_t order[RAYS];
    gpu_buffer_read(device, &state->order, 0, order, sizeof(order));
    for (uint32_t place = 0; place < RAYS; place++)
        run->places[way ? order[place] : place] = place;
}

static void run_case(struct run *run, const struct fuzz *fuzz, enum way way)
{
    struct error error = {0};
    build_nodes(run, fuzz, way);
    const struct gpu_program *program = &run->programs[way];
    rayspace_bind_wave(&run->fixture.gpu, &run->state, program);
    gpu_buffer_bind_texels(device, &run->state.nodes, UNIT_RAYSPACE_NODES, GL_RGBA32F);
    gpu_buffer_bind_storage(&run->elements, BIND_RAYSPACE_PAIRS);
    gpu_buffer_bind_storage(&run->met, BIND_RAYSPACE_LEAVES);
    gpu_uniform_uint(program, "node_count", run->node_count);
    gpu_uniform_uint(program, "element_count", ELEMENTS);
    const size_t pairs = (size_t)run->node_count * ELEMENTS;
    gpu_dispatch(device, program, pairs);
    gpu_buffer_read(device, &run->met, 0, run->words, pairs * sizeof(*run->words));
    expect_ok(gpu_check(device, "nodes", &error), &error);
}

/* ---- no true hit is culled ---- */

struct tally {
    uint64_t pairs, hit, culled;
};

/* The node of a level that has the ray at a place, among all, the rays first. */
static uint32_t node_over(const struct rayspace_levels *levels, uint32_t level, uint32_t place)
{
    return level == 0 ? place : RAYS + levels->first[level] + (place >> 2 * level);
}

/* Finds the hits of each ray. */
static void find_hits(const struct fuzz *fuzz, bool *found)
{
    for (uint32_t ray = 0; ray < RAYS; ray++)
        for (uint32_t e = 0; e < ELEMENTS; e++)
            found[ray * ELEMENTS + e] = !is_dead(&fuzz->rays[ray]) && hits(&fuzz->rays[ray], &fuzz->triangles[e]);
}

/* `what`: the case, in words. */
static struct tally expect_no_hit_culled(struct run *run, const bool *found, const char *what)
{
    const struct rayspace_levels *levels = &run->state.levels;
    const size_t pairs = (size_t)run->node_count * ELEMENTS;
    struct tally tally = {.pairs = pairs};
    bool *hit = calloc(pairs, sizeof(*hit));
    for (uint32_t i = 0; i < RAYS * ELEMENTS; i++) {
        const uint32_t ray = i / ELEMENTS, e = i % ELEMENTS;
        for (uint32_t level = 0; found[i] && level <= levels->top; level++) {
            const size_t pair = (size_t)node_over(levels, level, run->places[ray]) * ELEMENTS + e;
            hit[pair] = true;
            if (run->words[pair] != 15)
                fail_msg("%s: ray %u hits triangle %u, and its node of level %u is culled: cone %u, slabs %u, "
                         "both %u, alive %u",
                         what, ray, e, level, run->words[pair] & 1, run->words[pair] >> 1 & 1,
                         run->words[pair] >> 2 & 1, run->words[pair] >> 3);
        }
    }
    for (size_t pair = 0; pair < pairs; pair++) {
        tally.hit += hit[pair];
        tally.culled += !(run->words[pair] >> 2 & 1);
    }
    free(hit);
    return tally;
}

TEST(no_triangle_that_a_ray_hits_is_culled_from_its_nodes)
{
    struct run run;
    struct fuzz *fuzz = malloc(sizeof(*fuzz));
    bool *found = malloc((size_t)RAYS * ELEMENTS * sizeof(*found));
    struct tally sum = {0};
    const uint32_t case_count = getenv("FARLIGHT_TEST_LONG") ? 16 * CASES : CASES;
    run_init(&run);
    for (uint32_t number = 0; number < case_count; number++) {
        fuzz_init(fuzz, number);
        find_hits(fuzz, found);
        bound_elements(&run, fuzz);
        for (enum way way = 0; way < WAYS; way++) {
            char what[128];
            snprintf(what, sizeof(what), "case %u, %s, %s, scale %g", number, form_names[fuzz->form],
                     way_names[way], fuzz->scale);
            run_case(&run, fuzz, way);
            const struct tally tally = expect_no_hit_culled(&run, found, what);
            sum.pairs += tally.pairs;
            sum.hit += tally.hit;
            sum.culled += tally.culled;
        }
    }
    print_message("%llu pairs, %.2f %% of them hits, %.1f %% culled\n", (unsigned long long)sum.pairs,
                  100.0 * (double)sum.hit / (double)sum.pairs, 100.0 * (double)sum.culled / (double)sum.pairs);
    /* The test has seen both. */
    assert_true(sum.hit > sum.pairs / 200);
    assert_true(sum.culled > sum.pairs / 4);
    run_finish(&run);
    free(found);
    free(fuzz);
}
