/* SPDX-License-Identifier: MIT */
/* The tracer `ldc` against the reference, at the resolution that is its default: on the same waves of secondary
 * rays, and on whole pictures. It samples, so it is held to the size of a cell and to what can be seen, not to
 * rounding. What is primary is rasterised in both pictures, as in every frame without a lens.
 *
 * Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder keeps the pictures. */
#include "render_fixture.h"

#include "trace/tracer.h"

#define BVH 0
#define REFERENCE 2
#define LDC 3
#define RESOLUTION 1024u
#define SIDE 192u
/* What is asked of the tracer: share of rays that agree on hit or miss, distances in cells, and the pictures. */
#define AGREED_MIN 0.99
#define DISTANCE_CELLS_MAX 0.25
#define PSNR_MIN 38.0
#define PSNR_MIN_HOLES 34.0

static unsigned exact_tracer; /* the reference, or bvh where a build leaves it out: their hits are the same */

/* ---- shapes: closed, with smooth normals and texture coordinates ---- */

enum shape { SHAPE_SPHERE, SHAPE_TORUS, SHAPE_BUMPY };

static void place_on(enum shape shape, float u, float v, float p[3])
{
    float a = 6.28318531f * u, b = shape == SHAPE_TORUS ? 6.28318531f * v : 3.14159265f * v;
    if (shape == SHAPE_TORUS) {
        float across = 0.7f + 0.3f * cosf(b);
        p[0] = across * cosf(a);
        p[1] = 0.3f * sinf(b);
        p[2] = -across * sinf(a);
        return;
    }
    float radius = shape == SHAPE_BUMPY ? 0.9f + 0.06f * sinf(7 * b) * sinf(6 * a) * sinf(b) : 1.0f;
    p[0] = radius * sinf(b) * cosf(a);
    p[1] = radius * cosf(b);
    p[2] = -radius * sinf(b) * sinf(a);
}

static void normal_on(enum shape shape, float u, float v, float n[3])
{
    const float step = 1e-3f;
    float along_u[2][3], along_v[2][3], squared = 0;
    v = shape == SHAPE_TORUS ? v : fminf(fmaxf(v, 0.002f), 0.998f); /* at the poles, as beside them */
    for (int side = 0; side < 2; side++) {
        place_on(shape, u + (side ? step : -step), v, along_u[side]);
        place_on(shape, u, v + (side ? step : -step), along_v[side]);
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (along_v[1][j] - along_v[0][j]) * (along_u[1][k] - along_u[0][k]) -
               (along_v[1][k] - along_v[0][k]) * (along_u[1][j] - along_u[0][j]);
        n[i] *= shape == SHAPE_TORUS ? -1.0f : 1.0f;
        squared += n[i] * n[i];
    }
    for (int i = 0; i < 3; i++)
        n[i] /= sqrtf(squared);
}

/* Returns the mesh's number. */
static uint32_t add_shape_mesh(struct fixture *fixture, enum shape shape, uint32_t steps, uint32_t material)
{
    uint32_t each = steps + 1, vertices = each * each, triangles = 2 * steps * steps;
    float(*positions)[3] = malloc(vertices * sizeof(*positions)),
    (*normals)[3] = malloc(vertices * sizeof(*normals));
    float(*texcoords)[2] = malloc(vertices * sizeof(*texcoords));
    uint32_t *indices = malloc(3 * (size_t)triangles * sizeof(*indices)), *out = indices;
    for (uint32_t i = 0; i < vertices; i++) {
        float u = (float)(i % each) / (float)steps, v = (float)(i / each) / (float)steps;
        /* what meets itself does so to the bit */
        place_on(shape, i % each == steps ? 0 : u, shape == SHAPE_TORUS && i / each == steps ? 0 : v,
                 positions[i]);
        if (shape != SHAPE_TORUS && (i / each == 0 || i / each == steps))
            positions[i][0] = positions[i][2] = 0;
        normal_on(shape, u, v, normals[i]);
        texcoords[i][0] = 4 * u;
        texcoords[i][1] = 2 * v;
    }
    for (uint32_t i = 0; i < steps * steps; i++, out += 6) {
        uint32_t a = i / steps * each + i % steps, b = a + each;
        if (shape == SHAPE_TORUS)
            memcpy(out, (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, 6 * sizeof(*out));
        else
            memcpy(out, (uint32_t[6]){a, b, a + 1, a + 1, b, b + 1}, 6 * sizeof(*out));
    }
    struct scene_mesh *mesh = &fixture_edit(fixture, SCENE_MESH)->set.mesh;
    mesh->base.id = fixture->next_id++;
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, vertices * sizeof(*positions));
    mesh->arrays[MESH_NORMALS] = fixture_blob(normals, vertices * sizeof(*normals));
    mesh->arrays[MESH_TEXCOORDS_0] = fixture_blob(texcoords, vertices * sizeof(*texcoords));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, 3 * (size_t)triangles * sizeof(*indices));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    *mesh->ranges = (struct material_range){0, triangles, material};
    mesh->range_count = 1;
    free(positions);
    free(normals);
    free(texcoords);
    free(indices);
    return mesh->base.id;
}

static void set_node(struct fixture *fixture, uint32_t node, uint32_t mesh, const float parent_from_node[12])
{
    struct scene_node *edit = &fixture_edit(fixture, SCENE_NODE)->set.node;
    edit->base.id = node;
    edit->kind = NODE_MESH;
    edit->object = mesh;
    memcpy(edit->parent_from_node, parent_from_node, sizeof(edit->parent_from_node));
}

/* Turned about x, scaled and moved. */
static void turned(float m[12], float scale, float radians, float x, float y, float z)
{
    float c = scale * cosf(radians), s = scale * sinf(radians);
    memcpy(m, (float[12]){scale, 0, 0, x, 0, c, -s, y, 0, s, c, z}, 12 * sizeof(float));
}

static uint32_t add_shape(struct fixture *fixture, enum shape shape, uint32_t steps, uint32_t material,
                          float scale, float radians, float x, float y, float z)
{
    float m[12];
    uint32_t mesh = add_shape_mesh(fixture, shape, steps, material);
    turned(m, scale, radians, x, y, z);
    return fixture_node(fixture, NODE_MESH, mesh, m);
}

/* A floor of some size below it all, and two lamps. */
static void add_floor_and_lamps(struct fixture *fixture, uint32_t material)
{
    const float floor[12] = {1, 0, 0, 0, 0, 0, 1, -1.05f, 0, -1, 0, 0};
    fixture_square(fixture, 3.0f, material, floor);
    fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
    fixture_light(fixture, LIGHT_POINT, -3, 3, 2, 120);
    fixture_environment(fixture, 0.3f, 0.4f, 0.5f);
}

static uint32_t add_texture(struct fixture *fixture, bool holes)
{
    enum { TEXELS = 64 };
    static uint8_t texels[TEXELS][TEXELS][4];
    for (int y = 0; y < TEXELS; y++) {
        for (int x = 0; x < TEXELS; x++) {
            bool odd = ((x / 16) + (y / 16)) % 2 != 0;
            texels[y][x][0] = odd ? 220 : (uint8_t)(40 + 3 * x);
            texels[y][x][1] = odd ? (uint8_t)(60 + 2 * y) : 200;
            texels[y][x][2] = (uint8_t)(80 + x + y);
            texels[y][x][3] = holes && odd ? 0 : 255;
        }
    }
    struct scene_texture *texture = &fixture_edit(fixture, SCENE_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->width = texture->height = TEXELS;
    texture->format = TEXTURE_RGBA8_SRGB;
    texture->texels = fixture_blob(texels, sizeof(texels));
    return texture->base.id;
}

static void use_texture(struct scene_material *material, enum material_texture use, uint32_t texture)
{
    material->textures[use] = (struct texture_use){.texture = texture, .strength = 1.0f};
    material->textures[use].uv_transform[0] = material->textures[use].uv_transform[4] = 1.0f;
}

static uint32_t add_matte(struct fixture *fixture, float r, float g, float b)
{
    struct scene_material *material = fixture_material(fixture);
    memcpy(material->base_colour, (float[3]){r, g, b}, 3 * sizeof(float));
    material->ior = 1.5f;
    return material->base.id;
}

static uint32_t add_mirror(struct fixture *fixture, float r, float g, float b)
{
    struct scene_material *material = fixture_material(fixture);
    memcpy(material->base_colour, (float[3]){r, g, b}, 3 * sizeof(float));
    material->metallic = 1.0f;
    material->roughness = 0.05f;
    return material->base.id;
}

/* ---- scenes ---- */

static void add_mirrors(struct fixture *fixture)
{
    uint32_t gold = add_mirror(fixture, 1.0f, 0.8f, 0.4f), silver = add_mirror(fixture, 0.9f, 0.9f, 0.95f);
    add_floor_and_lamps(fixture, add_matte(fixture, 0.6f, 0.6f, 0.5f));
    add_shape(fixture, SHAPE_SPHERE, 96, silver, 0.8f, 0, -1.3f, -0.2f, 0);
    add_shape(fixture, SHAPE_TORUS, 96, gold, 0.9f, 0.9f, 1.2f, -0.1f, 0.2f);
    add_shape(fixture, SHAPE_BUMPY, 160, add_matte(fixture, 0.8f, 0.3f, 0.2f), 0.5f, 0.3f, 0, -0.5f, 1.2f);
}

static void add_textured(struct fixture *fixture)
{
    uint32_t texture = add_texture(fixture, false), mirror = add_mirror(fixture, 0.9f, 0.9f, 0.9f);
    struct scene_material *checked = fixture_material(fixture);
    use_texture(checked, MATERIAL_BASE_COLOUR, texture);
    use_texture(checked, MATERIAL_EMISSION, texture);
    checked->emission[0] = 0.2f;
    add_floor_and_lamps(fixture, mirror);
    add_shape(fixture, SHAPE_SPHERE, 96, checked->base.id, 0.9f, 0.5f, -1.1f, 0, 0);
    add_shape(fixture, SHAPE_TORUS, 96, checked->base.id, 0.9f, 1.2f, 1.2f, 0, 0);
}

static void add_glass(struct fixture *fixture)
{
    struct scene_material *glass = fixture_material(fixture);
    memcpy(glass->base_colour, (float[3]){0.8f, 0.95f, 0.9f}, 3 * sizeof(float));
    glass->transmission = 1.0f;
    glass->roughness = 0.0f;
    glass->ior = 1.5f;
    add_floor_and_lamps(fixture, add_matte(fixture, 0.7f, 0.6f, 0.5f));
    add_shape(fixture, SHAPE_SPHERE, 96, glass->base.id, 0.9f, 0, -1.1f, 0, 0.6f);
    add_shape(fixture, SHAPE_TORUS, 96, glass->base.id, 0.9f, 1.0f, 1.2f, 0, 0.4f);
    add_shape(fixture, SHAPE_BUMPY, 96, add_matte(fixture, 0.2f, 0.4f, 0.8f), 0.6f, 0, 0, -0.3f, -1.2f);
}

static void add_cutout(struct fixture *fixture)
{
    struct scene_material *fence = fixture_material(fixture);
    use_texture(fence, MATERIAL_BASE_COLOUR, add_texture(fixture, true));
    fence->alpha_mode = ALPHA_MASK;
    add_floor_and_lamps(fixture, add_mirror(fixture, 0.8f, 0.8f, 0.8f));
    add_shape(fixture, SHAPE_SPHERE, 64, fence->base.id, 0.9f, 0.4f, -0.9f, 0, 0);
    const float pane[12] = {0.8f, 0, 0.6f, 1.3f, 0, 1, 0, 0, -0.6f, 0, 0.8f, 0};
    fixture_square(fixture, 0.9f, fence->base.id, pane);
}

static void add_spheres(struct fixture *fixture)
{
    uint32_t silver = add_mirror(fixture, 0.9f, 0.9f, 0.95f), red = add_matte(fixture, 0.8f, 0.2f, 0.2f);
    add_floor_and_lamps(fixture, add_matte(fixture, 0.6f, 0.6f, 0.5f));
    for (int i = 0; i < 9; i++)
        fixture_sphere(fixture, -1.4f + 1.4f * (float)(i % 3), -0.6f + 0.1f * (float)i,
                       1.2f - 1.1f * (float)(i / 3), 0.45f, i % 2 ? red : silver);
}

/* ---- pictures ---- */

static double psnr(const struct frame_result *a, const struct frame_result *b)
{
    double sum = 0, count = 0;
    assert_int_equal(a->size_bytes, b->size_bytes);
    for (size_t i = 0; i < a->size_bytes; i++) {
        if (i % 4 == 3)
            continue;
        double difference = (double)a->pixels[i] - (double)b->pixels[i];
        sum += difference * difference;
        count++;
    }
    return sum > 0 ? 10 * log10(255.0 * 255.0 * count / sum) : INFINITY;
}

static void request_picture(struct fixture *fixture)
{
    struct frame_request *request = &fixture->request;
    request->width = request->height = SIDE;
    request->format = FRAME_RGBA8;
    request->depth = 5;
    request->tracer_options.ldc_resolution = RESOLUTION;
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, const char *name)
{
    char kept[128];
    fixture->request.tracer = tracer;
    struct frame_result result = fixture_render(fixture);
    snprintf(kept, sizeof(kept), "ldc_%s_%s", name, tracer == LDC ? "ldc" : "exact");
    fixture_keep(&result, kept);
    return result;
}

static void expect_like_the_reference(struct fixture *fixture, const char *name, double psnr_min)
{
    struct frame_result got = render(fixture, LDC, name), expected = render(fixture, exact_tracer, name);
    double reached = psnr(&got, &expected);
    printf("%s: PSNR %.1f dB\n", name, reached);
    for (int i = 0; i < TRACER_CUBES_MAX; i++)
        assert_int_equal(got.cubes[i].samples_lost, 0);
    frame_result_finish(&got);
    frame_result_finish(&expected);
    if (!(reached >= psnr_min))
        fail_msg("%s: PSNR %.2f dB, at least %.1f is asked for", name, reached, psnr_min);
}

static void expect_scene_like_the_reference(struct fixture *fixture, void (*add)(struct fixture *fixture),
                                            const char *name, double psnr_min)
{
    add(fixture);
    request_picture(fixture);
    expect_like_the_reference(fixture, name, psnr_min);
}

static void mirrors_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_mirrors, "mirrors", PSNR_MIN);
}

static void textures_in_a_mirror_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_textured, "textures in a mirror", PSNR_MIN);
}

static void glass_is_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_glass, "glass", PSNR_MIN);
}

/* Whether there is a hole is decided for a cell as a whole, so its rims are a cell's steps, and each of many rims
 * shows. */
static void cutouts_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_cutout, "cutouts over a mirror", PSNR_MIN_HOLES);
}

static void spheres_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_spheres, "spheres", PSNR_MIN);
}

static void distributed_rays_see_what_the_references_see(void **state)
{
    struct fixture *fixture = *state;
    fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
    fixture->request.samples = 4;
    expect_scene_like_the_reference(fixture, add_mirrors, "mirrors, distributed", PSNR_MIN);
}

/* What moved lies in a cube of its own: rays see both as one, and each other's reflections and shadows. */
static void what_moves_is_seen_with_what_stands_still(void **state)
{
    struct fixture *fixture = *state;
    float m[12];
    add_mirrors(fixture);
    uint32_t mesh = add_shape_mesh(fixture, SHAPE_BUMPY, 96, add_matte(fixture, 0.2f, 0.5f, 0.8f));
    turned(m, 0.4f, 0, 0, 0.6f, 0);
    uint32_t node = fixture_node(fixture, NODE_MESH, mesh, m);
    request_picture(fixture);
    struct frame_result before = render(fixture, LDC, "before it moves");
    assert_int_equal(before.cubes[TRACER_CUBE_DYNAMIC].resolution, 0);
    frame_result_finish(&before);
    for (int step = 0; step < 2; step++) {
        turned(m, 0.4f, 0.3f, 0.4f, 0.3f + 0.2f * (float)step, 0.5f);
        set_node(fixture, node, mesh, m);
        struct frame_result after = render(fixture, LDC, "after it moved");
        assert_int_equal(after.cubes[TRACER_CUBE_DYNAMIC].resolution, RESOLUTION);
        assert_int_equal(after.cubes[TRACER_CUBE_STATIC].rebuilt, step == 0);
        assert_true(after.cubes[TRACER_CUBE_DYNAMIC].rebuilt);
        frame_result_finish(&after);
    }
    expect_like_the_reference(fixture, "two cubes", PSNR_MIN);
}

/* ---- frames ---- */

static void switching_to_another_tracer_and_back_builds_nothing(void **state)
{
    struct fixture *fixture = *state;
    static const struct {
        unsigned tracer;
        bool builds;
    } frames[] = {{LDC, true}, {BVH, false}, {LDC, false}, {BVH, false}, {LDC, false}};
    add_mirrors(fixture);
    request_picture(fixture);
    fixture->request.tracer_options.ldc_resolution = 128;
    for (size_t i = 0; i < sizeof(frames) / sizeof(frames[0]); i++) {
        struct frame_result result = render(fixture, frames[i].tracer, "switched");
        assert_int_equal(result.cubes[TRACER_CUBE_STATIC].rebuilt, frames[i].builds);
        assert_int_equal(result.cubes[TRACER_CUBE_STATIC].resolution, frames[i].tracer == LDC ? 128 : 0);
        frame_result_finish(&result);
    }
}

/* A picture that goes on does so only with what it was begun with. */
static void a_picture_of_other_cubes_begins_anew(void **state)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture->request.tracer = LDC;
    fixture->request.accumulate = true;
    fixture->request.tracer_options.ldc_resolution = 64;
    for (uint32_t i = 1; i <= 2; i++) {
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.samples, i);
        frame_result_finish(&result);
    }
    fixture->request.tracer_options.ldc_resolution = 128;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.samples, 1);
    frame_result_finish(&result);
}

static void what_moves_while_the_shutter_is_open_is_refused_at_once(void **state)
{
    struct fixture *fixture = *state;
    float m[12];
    uint32_t mesh = add_shape_mesh(fixture, SHAPE_SPHERE, 16, add_matte(fixture, 0.5f, 0.5f, 0.5f));
    uint32_t node = fixture_node(fixture, NODE_MESH, mesh, NULL);
    fixture_commit(fixture);
    struct pose_node places[2] = {{.node = node}, {.node = node}};
    struct scene_pose poses[2] = {{.nodes = &places[0], .node_count = 1}, {.nodes = &places[1], .node_count = 1}};
    for (int i = 0; i < 2; i++) {
        turned(m, 1, 0, (float)i, 0, 0);
        memcpy(places[i].parent_from_node, m, sizeof(m));
    }
    const struct scene_motion open = {.poses = poses, .pose_count = 2}, closed = {.poses = poses, .pose_count = 1};
    fixture->request.tracer_options.ldc_resolution = 64;
    for (int compare = 0; compare < 2; compare++) {
        struct error error = {0};
        fixture->request.tracer = compare ? BVH : LDC;
        fixture->request.compare = compare;
        fixture->request.compare_with = LDC;
        assert_false(frame_begin(fixture->renderer, fixture->scene, &open, &fixture->request, &error));
        assert_int_equal(error.kind, ERROR_UNSUPPORTED);
        assert_string_equal(error.field, "shutter");
        struct frame_result result = fixture_render_motion(fixture, &closed);
        frame_result_finish(&result);
    }
}

/* ---- rays ---- */

/* The reference's own waves, its secondary rays answered by `ldc` too. */
static void expect_rays_agree(struct fixture *fixture, const char *name, float cell_metres, double diagonal)
{
    fixture->request.tracer = exact_tracer;
    fixture->request.compare = true;
    fixture->request.compare_with = LDC;
    struct frame_result result = fixture_render(fixture);
    uint64_t rays = 0, disagreed = 0, compared = 0;
    double worst_median = 0;
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct wave_comparison *wave = &result.comparisons[i];
        static const char *const kinds[] = {"primary", "secondary", "shadow"};
        double agreed = 1 - (double)(wave->only_first + wave->only_second) / (double)(wave->rays ? wave->rays : 1);
        double median_cells = (double)wave->distance_median * diagonal / (double)cell_metres;
        printf("%s, wave %u, %s: %llu rays, %.3f %% agree on hit or miss, median distance %.4f cells, 99 %% below "
               "%.3f\n",
               name, wave->wave, kinds[wave->kind], (unsigned long long)wave->rays, 100 * agreed, median_cells,
               (double)wave->distance_p99 * diagonal / (double)cell_metres);
        if (wave->kind != RAY_SECONDARY)
            continue;
        rays += wave->rays;
        disagreed += wave->only_first + wave->only_second;
        if (wave->both_hit > 100) {
            worst_median = fmax(worst_median, median_cells);
            compared++;
        }
    }
    frame_result_finish(&result);
    assert_in_range(rays, SIDE * SIDE / 20, UINT64_MAX); /* else nothing would have been shown */
    assert_true(compared > 0);
    double agreed = 1 - (double)disagreed / (double)rays;
    if (!(agreed >= AGREED_MIN))
        fail_msg("%s: %.3f %% of %llu rays agree on hit or miss", name, 100 * agreed, (unsigned long long)rays);
    if (!(worst_median <= DISTANCE_CELLS_MAX))
        fail_msg("%s: the median distance is %.3f cells off", name, worst_median);
}

static void secondary_rays_agree_with_the_reference(void **state)
{
    struct fixture *fixture = *state;
    static const struct {
        const char *name;
        enum shape shape;
        uint32_t steps;
    } rows[] = {
        {"a sphere", SHAPE_SPHERE, 128}, {"a torus", SHAPE_TORUS, 128}, {"a bumpy sphere", SHAPE_BUMPY, 224}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        for (int inside = 0; inside < 2; inside++) {
            char name[64];
            fixture_clear(state);
            struct scene_material *material = fixture_material(fixture);
            uint32_t id = material->base.id;
            material->roughness = 0.05f;
            material->metallic = inside ? 0.0f : 1.0f;
            material->transmission = inside ? 1.0f : 0.0f;
            material->ior = 1.5f;
            /* Two of them, so that there is something to be mirrored. */
            add_shape(fixture, rows[i].shape, rows[i].steps, id, 1, 0.4f, -0.9f, 0, 0);
            add_shape(fixture, rows[i].shape, rows[i].steps, id, 1, 1.1f, 0.95f, 0.2f, 0.4f);
            fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
            request_picture(fixture);
            fixture_look(fixture, 1.5f, 2.2f, 4.5f, 0.7f);
            snprintf(name, sizeof(name), "%s%s", rows[i].name, inside ? " of glass" : "");
            fixture->request.width = fixture->request.height = 16; /* for the size of a cell */
            struct frame_result result = render(fixture, LDC, name);
            fixture->request.width = fixture->request.height = SIDE;
            float cell_metres = result.cubes[TRACER_CUBE_STATIC].cell_metres;
            frame_result_finish(&result);
            /* Errors come in scene diagonals; the lamp belongs to the scene. */
            struct scene_gpu gpu;
            struct scene_changes changes;
            struct error error = {0};
            scene_gpu_init(&gpu, fixture->device);
            assert_true(scene_gpu_update(&gpu, fixture->scene, NULL, &changes, NULL, &error));
            double diagonal = (double)gpu.diagonal;
            scene_gpu_finish(&gpu);
            expect_rays_agree(fixture, name, cell_metres, diagonal);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(secondary_rays_agree_with_the_reference, fixture_clear),
        cmocka_unit_test_setup(mirrors_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(textures_in_a_mirror_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(glass_is_like_the_references, fixture_clear),
        cmocka_unit_test_setup(cutouts_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(spheres_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(distributed_rays_see_what_the_references_see, fixture_clear),
        cmocka_unit_test_setup(what_moves_is_seen_with_what_stands_still, fixture_clear),
        cmocka_unit_test_setup(switching_to_another_tracer_and_back_builds_nothing, fixture_clear),
        cmocka_unit_test_setup(a_picture_of_other_cubes_begins_anew, fixture_clear),
        cmocka_unit_test_setup(what_moves_while_the_shutter_is_open_is_refused_at_once, fixture_clear),
    };
    exact_tracer = tracer_impl_by_number(REFERENCE) ? REFERENCE : BVH;
    return cmocka_run_group_tests_name("ldc against the reference", tests, fixture_setup, fixture_teardown);
}
