/* SPDX-License-Identifier: MIT */
/* Ray by ray, a tracer's answers are those of a plain C tracer in double precision: at first, and after every kind
 * of edit. */
#include "tests/tracers/contract.h"
#include "trace/visibility.h"

/* Rays whose answer hangs on a rounding are left out; more of them than this and the test would say nothing. Of a
 * soup of small triangles most rays pass some edge within a few cells. */
#define CLOSE_CALLS_MAX (RAY_COUNT / 10)
#define CLOSE_CALLS_MAX_SAMPLED (RAY_COUNT * 4 / 5)

/* ---- edits ---- */

static void moves_hides_and_changes_a_material(struct fixture *fixture)
{
    struct test_edits *edits = &fixture->edits;
    const struct scene_node *second = scene_node(fixture->scene, 2), *third = scene_node(fixture->scene, 3);
    float m[12];
    test_transform(m, 0.8f, -0.9f, 1.1f, 0, 0.3f, 0.4f, 0.1f, -0.7f);
    test_node(edits, 2, second->value.parent, second->value.kind, second->value.object, m);
    test_node(edits, 3, third->value.parent, third->value.kind, third->value.object, third->value.parent_from_node)
        ->value.hidden = true;
    struct scene_material *material = test_material(edits, 2, 0.35f, 0.45f, 0.55f);
    if (!fixture->gpu.has_translucent && !getenv("FARLIGHT_TEST_LONG"))
        return; /* a program more of every tracer */
    material->value.alpha_mode = ALPHA_BLEND;
    material->value.base_colour[3] = 0.5f;
}

static void replaces_a_mesh_and_adds_an_instance(struct fixture *fixture)
{
    test_soup_mesh(&fixture->edits, 10, 70, 0.4f, 99);
    test_soup_mesh(&fixture->edits, 5, 10, 0.5f, 98); /* sorts before, so that all primitives get other numbers */
    test_node(&fixture->edits, 100, 0, NODE_MESH, 5, NULL);
}

/* Makes holes of surfaces and surfaces of holes. */
static void invert_alpha(struct test_edits *edits, const struct scene_texture *texture)
{
    size_t bytes = (size_t)texture->value.width * texture->value.height * 4;
    uint8_t *texels = malloc(bytes);
    for (size_t i = 0; i < bytes; i++)
        texels[i] = i % 4 == 3 ? (uint8_t)(255 - texture->texels->data[i]) : texture->texels->data[i];
    struct scene_texture *inverted = &test_add(edits, OBJECT_TEXTURE)->set.texture;
    *inverted = *texture;
    inverted->texels = test_blob(texels, bytes);
    free(texels);
}

static void removes_an_instance_shows_another_and_adds_a_disc(struct fixture *fixture)
{
    struct test_edits *edits = &fixture->edits;
    const struct scene_node *third = scene_node(fixture->scene, 3);
    const struct scene_texture *texture = scene_texture(fixture->scene, 1);
    struct scene_edit *edit = test_add(edits, OBJECT_NODE);
    edit->kind = EDIT_REMOVE;
    edit->id = 100;
    test_node(edits, 3, third->value.parent, third->value.kind, third->value.object,
              third->value.parent_from_node);
    if (texture)
        invert_alpha(edits, texture);
    struct scene_material *cut_away = test_material(edits, 2, 0.35f, 0.45f, 0.55f);
    cut_away->value.alpha_mode = ALPHA_MASK;
    cut_away->value.base_colour[3] = 0.2f;
    struct scene_disc *disc = &test_add(edits, OBJECT_DISC)->set.disc;
    disc->base.id = 9;
    disc->value.centre_world[1] = -0.4f;
    disc->value.normal_world[1] = 1.0f;
    disc->value.radius = 1.0f;
}

static const struct phase {
    const char *name;
    void (*edit)(struct fixture *fixture); /* NULL: a pose, where there is one */
} phases[] = {
    {"as it was committed", NULL},
    {"posed", NULL},
    {"moved, hidden, of another material", moves_hides_and_changes_a_material},
    {"of another shape, with a new instance", replaces_a_mesh_and_adds_an_instance},
    {"without that instance, with other holes and a disc", removes_an_instance_shows_another_and_adds_a_disc},
};
#define PHASE_COUNT (sizeof(phases) / sizeof(phases[0]))
enum { PHASE_POSED = 1 };

/* Those whose answers are judged. */
static unsigned phases_of(const struct contract_case *of)
{
    if (getenv("FARLIGHT_TEST_LONG"))
        return (1u << PHASE_COUNT) - 1;
    if (of->tracer->seen.layers) /* brute force takes long for seen surfaces; the last phase has all edits in it */
        return of->scene->phases & (1u | 1u << PHASE_POSED | 1u << (PHASE_COUNT - 1));
    return of->tracer->sampled.resolution ? of->scene->phases_sampled : of->scene->phases;
}

/* ---- what is true ---- */

/* Brute force's answers to the rays of a scene in a phase; the same for all tracers that are as exact. */
struct truth {
    const struct scene_row *scene;
    size_t phase;
    struct twin_blur blur;
    bool still;
    struct twin_answer answers[RAY_COUNT];
    struct truth *next;
};

static struct truth *truths;

static const struct truth *truth_of(const struct fixture *fixture, const struct scene_row *scene, size_t phase)
{
    const double cell = fixture_cell_metres(fixture), alpha = cell > 0 || fixture->row->seen.layers ? 0.15 : 0;
    /* Holes that are finer than a texel may be anywhere. */
    const struct twin_blur blur = {.near_world = BLUR_CELLS * cell,
                                   .slope = cell > 0 ? 0.02 : 0,
                                   .alpha = alpha > 0 && scene->is_finer_than_cells ? 1 : alpha};
    const bool still = fixture->row->refuses_motion != NULL;
    for (struct truth *truth = truths; truth; truth = truth->next)
        if (truth->scene == scene && truth->phase == phase && truth->still == still &&
            truth->blur.near_world == blur.near_world && truth->blur.alpha == blur.alpha)
            return truth;
    struct truth *truth = malloc(sizeof(*truth));
    struct twin twin;
    assert_non_null(truth);
    truth->scene = scene;
    truth->phase = phase;
    truth->blur = blur;
    truth->still = still;
    twin_init_moving(&twin, fixture->scene, fixture->motion.pose_count ? &fixture->motion : NULL);
    twin.blur = blur;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        twin_trace_at(&truth->answers[i], &twin, &fixture->host_rays[i], (double)fixture->host_times[i]);
    twin_finish(&twin);
    truth->next = truths;
    truths = truth;
    return truth;
}

/* ---- comparing ---- */

/* Fault of a result; empty: none. */
struct fault {
    char text[200];
};

static void expect_near(struct fault *fault, const char *what, double got, double expected, double tolerance)
{
    if (fault->text[0] == 0 && !(fabs(got - expected) <= tolerance))
        snprintf(fault->text, sizeof(fault->text), "%s is %.9g, expected %.9g (tolerance %g)", what, got, expected,
                 tolerance);
}

static void unpack_unit(double out[3], uint32_t bits)
{
    double x = fmax((int16_t)(bits & 0xffff) / 32767.0, -1), y = fmax((int16_t)(bits >> 16) / 32767.0, -1);
    out[0] = x;
    out[1] = y;
    out[2] = 1 - fabs(x) - fabs(y);
    if (out[2] < 0) {
        out[0] = (1 - fabs(y)) * (x >= 0 ? 1 : -1);
        out[1] = (1 - fabs(x)) * (y >= 0 ? 1 : -1);
    }
    twin_normalize(out);
}

static void expect_unit(struct fault *fault, const char *what, uint32_t got, const double expected[3],
                        double cosine_min)
{
    double unit[3];
    unpack_unit(unit, got);
    if (fault->text[0] == 0 && !(twin_dot(unit, expected) > cosine_min))
        snprintf(fault->text, sizeof(fault->text), "%s is %.6f %.6f %.6f, expected %.6f %.6f %.6f", what, unit[0],
                 unit[1], unit[2], expected[0], expected[1], expected[2]);
}

/* A sphere's u jumps from 1 to 0. */
static double beside_seam(double u, double expected)
{
    return fabs(u - expected) > 0.5 ? u + (u < expected ? 1 : -1) : u;
}

static double linear(double srgb)
{
    return srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4);
}

/* The stored sample of a hit says what is there: vertex colour times texture. */
static void expect_sample(struct fault *fault, const struct fixture *fixture, const struct hit *got,
                          const struct twin_hit *expected)
{
    const struct scene_material *material = scene_material(fixture->scene, expected->material);
    double colour[4] = {expected->colour[0], expected->colour[1], expected->colour[2], expected->colour[3]},
           texel[4];
    if (material && twin_sample(fixture->scene, &material->textures[MATERIAL_BASE_COLOUR], expected->uv, texel))
        for (int k = 0; k < 4; k++)
            colour[k] *= texel[k];
    for (int k = 0; k < 4; k++) {
        double stored = (got->uv01_or_sample[0] >> (8 * k) & 255) / 255.0;
        expect_near(fault, "stored colour", k < 3 ? linear(stored) : stored, colour[k], 0.2);
    }
}

/* A plane that is off by so much of 1 / depth, and tangent to what bends at the middle of a texel: how far along
 * the ray that is. */
static double off_plane(const struct fixture *fixture, const struct ray *ray, const struct twin_hit *expected)
{
    double from_eye[3], direction[3];
    if (fixture->row->seen.off == 0)
        return 0;
    for (int k = 0; k < 3; k++) {
        direction[k] = (double)ray->direction_t_max[k];
        from_eye[k] = (double)ray->origin_t_min[k] + expected->distance * direction[k] -
                      (double)fixture->view.world_from_view[4 * k + 3];
    }
    const double away = sqrt(twin_dot(from_eye, from_eye)), length = sqrt(twin_dot(direction, direction)),
                 seen = fabs(twin_dot(from_eye, expected->normal_geometric)) / away,
                 met = fabs(twin_dot(direction, expected->normal_geometric)) / length;
    /* Half the diagonal of a texel on the surface, and its effect on the falloff there. */
    const double texel = SEEN_TEXELS * fixture->seen_view.texel * away / seen;
    const double below = texel * texel * expected->bend / 2, slope = met - texel * expected->bend;
    if (slope <= 0)
        return INFINITY; /* where the tangent plane may be met, the surface is not */
    /* 1 / depth off by `off` is depth^2 * off along the way from the eye, whose part along the normal the ray
     * makes up for along its own. */
    return (fixture->row->seen.off * away * away * seen / met + below / slope) / length;
}

static void judge_hit(struct fault *fault, const struct fixture *fixture, const struct ray *ray,
                      const struct hit *got, const struct twin_hit *expected)
{
    double length = sqrt((double)ray->direction_t_max[0] * (double)ray->direction_t_max[0] +
                         (double)ray->direction_t_max[1] * (double)ray->direction_t_max[1] +
                         (double)ray->direction_t_max[2] * (double)ray->direction_t_max[2]);
    const double cell = fixture_cell_metres(fixture) / length;
    const bool is_sampled = fixture->row->sampled.resolution > 0 || fixture->row->seen.off > 0;
    if (expected->distance < 0 || got->distance < 0) {
        expect_near(fault, "distance", (double)got->distance, expected->distance < 0 ? -1 : expected->distance, 0);
        return;
    }
    expect_near(fault, "distance", (double)got->distance, expected->distance,
                1e-4 * (1 + expected->distance) + fixture->row->sampled.cells * cell +
                    off_plane(fixture, ray, expected));
    /* 0.1 degrees; of samples of what is curved what it turns by within a cell, of interpolated ones much more. */
    expect_unit(fault, "geometric normal", got->normal_geometric, expected->normal_geometric,
                is_sampled ? 0.9 : 1 - 2e-6);
    expect_unit(fault, "shading normal", got->normal_shading, expected->normal_shading,
                is_sampled ? 0.5 : 1 - 2e-6);
    expect_near(fault, "back face", (got->material & HIT_BACK_FACE) != 0, expected->back_face, 0);
    if (got->material & HIT_SAMPLED) {
        expect_near(fault, "whether it may be a sample", is_sampled && expected->node, 1, 0);
        expect_near(fault, "primitive of a sample", got->primitive, HIT_NO_PRIMITIVE, 0);
        expect_sample(fault, fixture, got, expected);
    } else if (expected->node) { /* a disc's texture coordinates are its own affair */
        if (got->instance >= fixture->gpu.instance_count && fixture->row->seen.layers > 0) {
            expect_near(fault, "whether it is a disc", 1, 0, 0); /* seen through a gap between texels */
            return;
        }
        if (got->instance >= fixture->gpu.instance_count)
            fail_msg("instance %u of %u", got->instance, fixture->gpu.instance_count);
        expect_near(fault, "node", fixture->gpu.instances[got->instance].node, expected->node, 0);
        float got_uv[2];
        memcpy(got_uv, got->uv01_or_sample, sizeof(got_uv));
        const double uv = is_sampled ? 0.3 : 5e-3, colour = is_sampled ? 0.2 : 5e-3;
        expect_near(fault, "u", beside_seam((double)got_uv[0], expected->uv[0]), expected->uv[0], uv);
        expect_near(fault, "v", (double)got_uv[1], expected->uv[1], uv);
        for (int k = 0; k < 4; k++) {
            const double stored = (got->colour >> (8 * k) & 255) / 255.0;
            expect_near(fault, "colour", k < 3 ? stored * stored : stored, expected->colour[k], colour);
        }
    } else {
        expect_near(fault, "instance of a disc", got->instance, HIT_NO_PRIMITIVE, 0);
    }
    static const float white[4] = {1, 1, 1, 1};
    const struct scene_material *material = scene_material(fixture->scene, expected->material);
    const float *base_colour = material ? material->value.base_colour : white;
    uint32_t index = got->material & HIT_MATERIAL_MASK;
    assert_in_range(index, 0, fixture->gpu.material_count - 1);
    for (int k = 0; k < 4; k++)
        expect_near(fault, "base colour of the material", (double)fixture->materials[index].base_colour[k],
                    (double)base_colour[k], 0);
}

/* Counts rays and their faults, and fails at the first that is one too many. */
struct tally {
    const char *phase;
    uint32_t judged, wrong;
    double wrong_max; /* a share of so many */
    uint32_t of;
};

static void count_fault(struct tally *tally, uint32_t ray, const struct fault *fault)
{
    tally->judged++;
    if (fault->text[0] == 0)
        return;
    tally->wrong++;
    if (tally->wrong > tally->wrong_max * tally->of)
        fail_msg("%s: ray %u: %s; %u rays are wrong up to it", tally->phase, ray, fault->text, tally->wrong);
}

static void judge_closest(struct tally *tally, const struct fixture *fixture, uint32_t ray, const struct hit *got,
                          const struct twin_answer *answer, const struct seen_answer *seen)
{
    const double distance = answer->closest.distance, until = distance < 0 ? answer->t_max : distance;
    struct fault fault = {""};
    if (answer->close_call)
        return;
    if (fixture->row->seen.layers > 0) {
        const enum knowledge knowledge =
            answer->close_distance <= until ? IS_NOT_JUDGED : seen_judges(seen, got, until);
        if (knowledge == IS_NOT_JUDGED)
            return;
        if (knowledge != IS_JUDGED)
            snprintf(fault.text, sizeof(fault.text), "it %s: %.6g along, hidden from %.6g on, perhaps from %.6g",
                     knowledge == CLAIMS_TO_KNOW ? "claims to know what is hidden" : "does not know what it sees",
                     until, seen->unknown, seen->maybe_unknown);
    }
    if (fault.text[0] == 0)
        judge_hit(&fault, fixture, &fixture->host_rays[ray], got, &answer->closest);
    count_fault(tally, ray, &fault);
}

static void judge_any(struct tally *tally, const struct fixture *fixture, uint32_t ray, uint32_t visibility,
                      const struct twin_answer *answer, const struct seen_answer *seen)
{
    const double until = fmin(answer->opaque_distance, answer->t_max);
    struct fault fault = {""};
    if (answer->close_any ||
        (fixture->row->seen.layers > 0 && (answer->close_distance <= until || !seen_knows(seen, until))))
        return;
    for (int k = 0; k < 3; k++)
        expect_near(&fault, "transmittance", visibility_transmittance(visibility, (unsigned)k),
                    answer->transmittance[k], fixture->row->sampled.resolution ? 0.1 : 6e-3);
    count_fault(tally, ray, &fault);
}

/* Counts judged rays only; a single ray proves nothing. */
static void expect_few_wrong(const struct tally *tally)
{
    if (tally->wrong > fmax(1, tally->wrong_max * tally->judged))
        fail_msg("%s: %u of %u are wrong", tally->phase, tally->wrong, tally->judged);
}

static void expect_answers(struct fixture *fixture, const struct scene_row *scene, size_t phase)
{
    const struct truth *truth = truth_of(fixture, scene, phase);
    const struct tracer_row *row = fixture->row;
    struct hit *hits = fixture_trace(fixture, WAVE_CLOSEST, RAY_COUNT);
    uint32_t *visibilities = fixture_trace(fixture, WAVE_ANY, RAY_COUNT), hit_count = 0, unknown = 0;
    struct tally closest = {phases[phase].name, 0, 0,
                            row->seen.layers ? row->seen.wrong_max : row->sampled.wrong_max, RAY_COUNT},
                 any = closest;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const struct twin_answer *answer = &truth->answers[i];
        hit_count += answer->closest.distance >= 0;
        unknown += (hits[i].material & HIT_UNKNOWN) != 0;
        if (answer->close_call && answer->close_any)
            continue; /* neither is judged */
        const struct seen_answer seen = fixture_seen(fixture, &fixture->host_rays[i]);
        judge_closest(&closest, fixture, i, &hits[i], answer, &seen);
        judge_any(&any, fixture, i, visibilities[i], answer, &seen);
    }
    free(hits);
    free(visibilities);
    if (row->sampled.resolution || row->seen.layers)
        print_message("  %s: closest %u of %u wrong, any %u of %u; unknown %u of %u\n", phases[phase].name,
                      closest.wrong, closest.judged, any.wrong, any.judged, unknown, RAY_COUNT);
    assert_true(row->seen.layers > 0 || unknown == 0);
    if (row->seen.layers)
        expect_few_wrong(&closest), expect_few_wrong(&any);
    const uint32_t close_max = row->seen.layers          ? RAY_COUNT - row->seen.judged_min
                               : row->sampled.resolution ? CLOSE_CALLS_MAX_SAMPLED
                                                         : CLOSE_CALLS_MAX;
    assert_in_range(closest.judged, RAY_COUNT - close_max, RAY_COUNT);
    assert_in_range(any.judged, RAY_COUNT - close_max, RAY_COUNT);
    assert_in_range(hit_count, RAY_COUNT / 10, RAY_COUNT); /* else the rays test nothing */
}

CHECK(answers_are_those_of_brute_force_and_follow_every_edit, CHECK_EACH_SCENE | CHECK_FORMS)
{
    const struct contract_case *of = *state;
    const unsigned judged = phases_of(of);
    struct fixture fixture;
    fixture_init_moving(&fixture, of->tracer, of->scene);
    for (size_t phase = 0; judged >> phase > 0; phase++) {
        if (phase == PHASE_POSED) {
            if (of->scene->pose_count > 0)
                continue;
            of->scene->move(&fixture.motion, 1);
        }
        if (phases[phase].edit)
            phases[phase].edit(&fixture);
        if (phase > 0)
            fixture_update(&fixture);
        if (judged >> phase & 1)
            expect_answers(&fixture, of->scene, phase);
    }
    fixture_finish(&fixture);
}

/* ---- while the shutter is open ---- */

/* Rays without times are all at the first pose, also where things move while the shutter is open. */
CHECK(a_wave_without_times_sees_the_first_pose, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    struct tracer_row still = *of->tracer; /* its waves have no times */
    static const struct scene_row moving[] = {
        {.name = "soup", test_scene_soup, test_motion_of_soup, .pose_count = 4},
        {.name = "skins", test_scene_deformed, test_motion_of_deformed, .pose_count = 4}};
    still.refuses_motion = "this test asks for none";
    for (size_t i = 0; i < sizeof(moving) / sizeof(moving[0]); i++) {
        struct fixture fixture;
        fixture_init_moving(&fixture, &still, &moving[i]);
        assert_true(fixture.gpu.has_motion);
        expect_answers(&fixture, &moving[i], 0);
        fixture_finish(&fixture);
    }
}

CHECK(rays_at_times_are_refused_by_tracers_that_refuse_motion, 0)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, of->tracer, test_scene_soup());
    struct hit *hits = fixture_trace(&fixture, WAVE_CLOSEST, RAY_COUNT);
    free(hits);
    struct wave wave = {
        .ray_count = RAY_COUNT, .rays = &fixture.rays, .hits = &fixture.answers, .times = &fixture.ray_times};
    expect_ok(tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error), &error); /* nothing moves */
    test_motion_of_soup(&fixture.motion, 2);
    fixture_update(&fixture);
    gpu_scene_bind(&fixture.gpu);
    bool ok = tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error);
    assert_int_equal(ok, !of->tracer->refuses_motion);
    if (!ok) {
        assert_int_equal(error.kind, ERROR_UNSUPPORTED);
        assert_string_equal(error.field, "shutter");
    }
    fixture_finish(&fixture);
}
