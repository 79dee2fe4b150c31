/* SPDX-License-Identifier: MIT */
/* Nodes in one format, built and traversed twice: by the daemon's shaders and by client/warp, from the same
 * layers. */
#include "tests/accuracy/client_quadtree.h"

#include "shared/eye_hit.h"
#include "trace/quadtree/eyes.h"

ALL_TESTS(open_device, close_device)

/* ---- nodes ---- */

static const uint32_t (*client_nodes(const struct sides *sides, uint32_t layer))[2]
{
    uint32_t count;
    const uint32_t *nodes = fl_warp_nodes(sides->client, layer, &count);
    assert_int_equal(count, sides->daemon.store.uniforms.slice_nodes);
    return (const void *)nodes;
}

/* Both sum up in the same order. A GPU that rounds a product and a sum at once may find otherwise where a plane is
 * off by just what it may. */
static void expect_same_nodes(struct sides *sides)
{
    build_by_daemon(sides, true);
    const uint32_t slice_nodes = sides->daemon.store.uniforms.slice_nodes;
    uint32_t other = 0;
    for (uint32_t l = 0; l < LAYERS; l++)
        for (uint32_t i = 0; i < slice_nodes; i++)
            other += memcmp(client_nodes(sides, l)[i], sides->daemon.nodes[l * slice_nodes + i], 8) != 0;
    print_message("%u of %u nodes differ\n", other, LAYERS * slice_nodes);
    assert_true(other <= (device->facts.software ? 0 : LAYERS * slice_nodes / 1000));
}

TEST(nodes_over_the_same_leaves_are_the_same_bits)
{
    struct sides *sides = made_up();
    expect_same_nodes(sides);
    sides_destroy(sides);
    struct loaded_model model;
    load_bundled(&model, "carousel.glb");
    sides = rendered(model.scene);
    expect_same_nodes(sides);
    sides_destroy(sides);
    load_model_finish(&model);
}

/* ---- eyes ---- */

/* From the key view's eye to the right, up and back, in radii; and turned to the left, radians. */
struct eye {
    float aside[3], turn;
};

static const struct eye eyes[] = {
    {{0.1f, 0.05f, -0.9f}, 0},    /* ahead: its rays begin in what the key view sees */
    {{0.5f, 0.2f, -0.3f}, 0},     /* beside that */
    {{-0.3f, 0.1f, 0.7f}, 0.15f}, /* back, and turned */
    {{0, -0.9f, 0}, -0.1f},       /* down, near the bound's limit */
};

static struct fl_warp_camera camera_of(const struct sides *sides, const struct eye *eye)
{
    const float *m = sides->key.camera.world_from_view, c = cosf(eye->turn), s = sinf(eye->turn);
    struct fl_warp_camera camera = {.fov_y = FOV};
    for (int i = 0; i < 3; i++) {
        float *row = &camera.world_from_view[4 * i];
        row[0] = c * m[4 * i] - s * m[4 * i + 2];
        row[1] = m[4 * i + 1];
        row[2] = s * m[4 * i] + c * m[4 * i + 2];
        row[3] = m[4 * i + 3];
        for (int k = 0; k < 3; k++)
            row[3] += m[4 * i + k] * sides->radius * eye->aside[k];
    }
    return camera;
}

static void look_by_client(struct sides *sides, const struct fl_warp_camera *camera)
{
    const struct fl_warp_view view = {.width = WIDTH, .height = HEIGHT, .camera = *camera};
    struct fl_warp_picture picture = {.colours = sides->seen, .mask = sides->mask};
    struct fl_warp_error error = {0};
    if (!fl_warp_make(sides->client, &view, &picture, &error))
        fail_msg("%s: %s", error.field, error.text);
}

/* Pixels are numbered as in shaders/common/slots.glsl. */
static void sort_into_rows(struct sides *sides, const vec4 *slots)
{
    for (uint32_t slot = 0; slot < COUNT; slot++) {
        const uint32_t tile = slot / 64, m = slot % 64;
        const uint32_t x = tile % (WIDTH / 8) * 8 + ((m & 1) | (m >> 1 & 2) | (m >> 2 & 4));
        const uint32_t y = tile / (WIDTH / 8) * 8 + ((m >> 1 & 1) | (m >> 2 & 2) | (m >> 3 & 4));
        memcpy(sides->found[y * WIDTH + x], slots[slot], sizeof(*slots));
    }
}

static void look_by_daemon(struct sides *sides, const struct fl_warp_camera *camera)
{
    static vec4 slots[COUNT];
    const float extent = tanf(0.5f * FOV);
    struct raster_camera raster = {
        .extent = {extent * (float)WIDTH / (float)HEIGHT, extent}, .width = WIDTH, .height = HEIGHT};
    struct frame_uniforms frame = {0};
    struct gpu_buffer uniforms = {0}, hits = {0};
    struct error error = {0};
    const struct tracer_options options = {.quadtree.hits = QUADTREE_HITS_PLANE,
                                           .quadtree.faces = QUADTREE_FACES_VIEW};
    memcpy(raster.world_from_view, camera->world_from_view, sizeof(raster.world_from_view));
    raster_camera_fill(&frame, &raster);
    frame.tiles_across = WIDTH / 8;
    struct trace_state *state =
        trace_state_create(tracer_impl_by_number(TRACER_QUADTREE), device, &options, &error);
    expect_ok(state && gpu_buffer_upload(device, &uniforms, &frame, sizeof(frame), &error) &&
                  gpu_buffer_reserve(device, &hits, sizeof(slots), &error),
              &error);
    gpu_buffer_bind_uniform(&uniforms, UNIFORM_FRAME);
    const struct eye_rays rays = {.frame = &frame, .slot_count = COUNT, .hits = &hits};
    assert_true(quadtree_finds_eyes(&sides->daemon.store, &sides->daemon.gpu, &frame, &options));
    expect_ok(quadtree_eye_hits(&sides->daemon.store, (struct quadtree_state *)state, &rays, &error), &error);
    gpu_buffer_read(device, &hits, 0, slots, sizeof(slots));
    expect_ok(gpu_check(device, "eyes", &error), &error);
    sort_into_rows(sides, (const vec4 *)slots);
    trace_state_destroy(state);
    gpu_buffer_finish(device, &uniforms);
    gpu_buffer_finish(device, &hits);
}

/* The daemon calls unknown what an eye looks past beside the key view for too long (QUADTREE_FREE_RADII); the
 * client does not. Where that is so, what the ray meets behind is compared nevertheless. */
static bool comes_in_late(const struct sides *sides, const struct fl_warp_camera *camera, uint32_t i)
{
    const double extent = tan(0.5 * (double)FOV), unit = (double)sides->key.unit;
    const double towards[3] = {extent * ((i % WIDTH + 0.5) * 2 - WIDTH) / HEIGHT,
                               -extent * ((i / WIDTH + 0.5) * 2 / HEIGHT - 1), -1};
    const float *m = camera->world_from_view, *key = sides->key.camera.world_from_view;
    double eye[3] = {0}, way[3] = {0}; /* right, down, ahead of the key view */
    for (int axis = 0; axis < 3; axis++)
        for (int k = 0; k < 3; k++) {
            const double along = axis == 0 ? (double)key[4 * k] : -(double)key[4 * k + axis];
            eye[axis] += along * ((double)m[4 * k + 3] - (double)key[4 * k + 3]);
            for (int j = 0; j < 3; j++)
                way[axis] += along * (double)m[4 * k + j] * towards[j];
        }
    double enters = INFINITY, place[2], shift[2];
    for (int axis = 0; axis < 2; axis++) {
        const double middle = axis == 0 ? WIDTH / 2.0 : HEIGHT / 2.0;
        place[axis] = focal() * way[axis] / way[2];
        shift[axis] = (focal() * eye[axis] - eye[2] * place[axis]) / unit;
        enters = fmin(enters, fmax((-middle - place[axis]) / shift[axis], (middle - place[axis]) / shift[axis]));
    }
    const double x = (place[0] + enters * shift[0]) / focal(), y = (place[1] + enters * shift[1]) / focal();
    return enters * eye[2] < unit &&
           sqrt(1 + x * x + y * y) * unit > 0.999 * (double)QUADTREE_FREE_RADII * (double)sides->radius * enters;
}

/* Counts of pixels. */
struct tally {
    uint32_t same, beside, nothing, unknown, other;
};

/* A colour is that of the texel that a place lies in: between four texels they are mixed to the nearest. */
static void count_place(const struct sides *sides, uint32_t i, struct tally *tally)
{
    const double x = fabs(floor((double)sides->found[i][0]) - (sides->seen[i] & 255));
    const double y = fabs(floor((double)sides->found[i][1]) - (sides->seen[i] >> 8 & 255));
    *(x == 0 && y == 0 ? &tally->same : fmax(x, y) <= 1 ? &tally->beside : &tally->other) += 1;
}

static void count_pixel(const struct sides *sides, const struct fl_warp_camera *camera, uint32_t i,
                        struct tally *tally)
{
    const uint32_t bits = (uint32_t)sides->found[i][3], layer = bits & EYE_LAYER_MASK;
    const uint32_t blue = sides->seen[i] >> 16 & 255;
    const uint32_t client_layer = blue == SKY_COLOUR ? 0 : blue / LAYER_COLOUR + 1;
    const bool is_known = sides->mask[i] == FL_WARP_KNOWN;
    const bool by_daemon = !(bits & EYE_UNKNOWN) || (is_known && comes_in_late(sides, camera, i));
    if (is_known != by_daemon || (is_known && layer != client_layer))
        tally->other++;
    else if (!is_known)
        tally->unknown++;
    else if (layer == 0)
        tally->nothing++;
    else
        count_place(sides, i, tally);
}

/* Texels beside them are flagged, on both sides. */
static double length_of_outlines(const struct sides *sides)
{
    uint32_t flagged = 0;
    for (uint32_t i = 0; i < COUNT; i++)
        flagged += tree_plane_of(node_at(&sides->daemon, 0, 0, i % WIDTH, i / WIDTH)).at_edge;
    return flagged / 2.0;
}

/* Pixels differ only along outlines, which both see within the bound, and so within twice that of one another. A
 * ray that is behind a surface for less than QUADTREE_OWN_WAY texels may come out again for the daemon, and not
 * for the client: that matters most where there are nothing but outlines, as in leaves of a tree. */
static void expect_same_rays(struct sides *sides)
{
    const double most = length_of_outlines(sides) * (2 * (double)PIXELS + (double)QUADTREE_OWN_WAY);
    for (size_t e = 0; e < sizeof(eyes) / sizeof(eyes[0]); e++) {
        const struct fl_warp_camera camera = camera_of(sides, &eyes[e]);
        struct tally tally = {0};
        look_by_client(sides, &camera);
        look_by_daemon(sides, &camera);
        for (uint32_t i = 0; i < COUNT; i++)
            count_pixel(sides, &camera, i, &tally);
        print_message(
            "eye %zu: %u pixels in the same texel, %u beside it, %u nothing, %u unknown, %u differ, of at "
            "most %.0f\n",
            e, tally.same, tally.beside, tally.nothing, tally.unknown, tally.other, most);
        assert_true(tally.other <= most);
        assert_true(tally.same >= COUNT / 4 && tally.beside <= tally.same / 50);
    }
}

TEST(rays_of_eyes_meet_the_same_texel_or_one_beside_it)
{
    struct sides *sides = made_up();
    build_by_daemon(sides, true);
    expect_same_rays(sides);
    sides_destroy(sides);
    struct loaded_model model;
    load_bundled(&model, "carousel.glb");
    sides = rendered(model.scene);
    expect_same_rays(sides);
    sides_destroy(sides);
    load_model_finish(&model);
}
