/* SPDX-License-Identifier: MIT */
/* Waves by `rayspace`: what it counts, and its time beside other tracers on the same rays. Prints one JSON object:
 * {"scene", "triangles", "device", "software", "wave", "width", "height", "rays", "cone_tests", "triangle_tests",
 * "pairs_max", "passes", "halvings", "nodes", "nodes_ns", "first_ns", "differing", "tracers": [{"name",
 * "cpu_ns"}]}. first_ns: with --frames, of the first frame of each run, while cpu_ns has the last one. Times are
 * of the processor, all threads of the process: the machine may do other work meanwhile. Exit status: 1 failed, or
 * more than 0.01 % of the rays have another distance than by the second tracer; 2 usage. */
#include "tests/accuracy/motion_scenes.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_cut.h"
#include "tests/bench/bench_forms.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_waves.h"

#include "trace/rayspace/tracer.h"

#include <epoxy/gl.h>
#include <getopt.h>
#include <jansson.h>

static const char usage[] =
    "usage: bench rayspace --model FILE | --family TRIANGLES [options]\n"
    "  --wave NAME     primary, reflection, bounce, shadow: as of bench forms, shadow rays to --light;\n"
    "                  turned: shadow rays that begin at the light;\n"
    "                  ball: mirrored by a ball that stands before the camera, and is not in the scene;\n"
    "                  mirror: mirrored by the model --mirror, which stands there\n"
    "  --mirror FILE   its first mesh, 2.4 wide\n"
    "  --after N       reflection, bounce, shadow, turned: so many reflections are between the camera's rays and "
    "the\n"
    "                  wave; default 0\n"
    "  --light X,Y,Z   else one is chosen\n"
    "  --cut EDGE      all triangles are cut until no edge is longer\n"
    "  --mode joint|flat, --bounds both|sphere, --rounds N, --turn auto|on|off   settings of rayspace\n"
    "  --beside LIST   of bvh, reference, and of rayspace with --mode flat or --turn off: flat, unturned; "
    "default: bvh\n"
    "  --frames N      each run has a tracer of its own, which traces the wave so many times; default: all runs "
    "share\n"
    "                  one\n"
    "  --moves         of --family: all vertices move before each run, which then has the update of the tracer in "
    "it\n"
    "  --anew          with --moves: the structures that rayspace is beside are built anew, not refitted\n"
    "  --size WxH      multiples of 8; default 256x256\n"
    "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]\n"
    "  --runs N        after one warm-up; default 3, at most 64\n";

/* Of the camera, and of the ball and the model's width there: as the counts were first taken. */
#define MIRROR_DISTANCE 2.2f
#define BALL_RADIUS 1.2f
#define MIRROR_WIDTH 2.4f
#define MIRROR_ID 0x40000000u
#define FAR 1e4f
#define SHADOW_OFFSET 1e-3f
#define MIRROR_OFFSET 1e-4f
#define DISTANCE_TOLERANCE 1e-4f /* of a distance: surfaces that lie in each other */
#define BUILDS_A_RUN 8u
#define TRACERS 5u
#define FRAMES_MAX 1000u
#define AFTER_MAX 8u

enum wave_name { PRIMARY, REFLECTION, BOUNCE, SHADOW, TURNED, BALL, MIRROR, WAVE_NAMES };
static const char *const wave_names[WAVE_NAMES] = {"primary", "reflection", "bounce", "shadow",
                                                   "turned",  "ball",       "mirror"};

/* What takes turns. The first is what is measured, the second tells where rays go on, and what is right. */
static const struct {
    const char *name;
    unsigned number;
    bool is_flat, is_unturned;
} contenders[TRACERS] = {
    {.name = "rayspace", .number = TRACER_RAYSPACE},
    {.name = "bvh", .number = TRACER_BVH},
    {.name = "reference", .number = TRACER_REFERENCE},
    {.name = "flat", .number = TRACER_RAYSPACE, .is_flat = true},
    {.name = "unturned", .number = TRACER_RAYSPACE, .is_unturned = true},
};

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct scene_motion motion; /* of the last pose */
    unsigned changed;           /* by it */
    const char *mirror, *beside;
    float light[3];
    bool has_light, moves, anew;
    float cut; /* the longest edge; 0: as the model has them */
    struct tracer_options options;
    uint32_t width, height, runs, frames, after;
    enum wave_name name;
    struct ray *rays;
    struct gpu_buffer ray_buffer, answers;
    struct wave wave;
    struct tracer *tracers[TRACERS]; /* of the contenders that are asked for, in their order */
    unsigned which[TRACERS];         /* of the contenders */
    struct bench_runs times[TRACERS], nodes, first;
    unsigned tracer_count;
    struct rayspace_control control;
    uint32_t differing;
};

/* ---- the mirror ---- */

static void before_camera(const struct bench *bench, float centre[3])
{
    const float *m = bench->scene.camera.world_from_view;
    for (int k = 0; k < 3; k++)
        centre[k] = m[4 * k + 3] - MIRROR_DISTANCE * m[4 * k + 2];
}

static const float (*positions_of(const struct scene_mesh *mesh))[3]
{
    return (const float(*)[3])(const void *)mesh->arrays[MESH_POSITIONS]->data;
}

static const uint32_t *indices_of(const struct scene_mesh *mesh)
{
    return (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
}

/* Of all vertices, weighted by area. */
static struct blob *smooth_normals(const struct scene_mesh *mesh)
{
    const float(*p)[3] = positions_of(mesh);
    const uint32_t *indices = indices_of(mesh);
    float(*normals)[3] = calloc(mesh->vertex_count, sizeof(*normals));
    for (uint32_t i = 0; i < 3 * mesh->triangle_count; i++) {
        const uint32_t *t = indices + i - i % 3;
        for (int k = 0; k < 3; k++) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            normals[indices[i]][k] += (p[t[1]][u] - p[t[0]][u]) * (p[t[2]][v] - p[t[0]][v]) -
                                      (p[t[1]][v] - p[t[0]][v]) * (p[t[2]][u] - p[t[0]][u]);
        }
    }
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        const float *n = normals[i], length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++)
            normals[i][k] = length > 0 ? n[k] / length : k == 2;
    }
    struct blob *blob = test_blob(normals, mesh->vertex_count * sizeof(*normals));
    free(normals);
    return blob;
}

/* Scaled to its width, in the middle of the view. */
static void mirror_transform(const struct bench *bench, const struct scene_mesh *mesh, float m[12])
{
    const float(*p)[3] = positions_of(mesh);
    float lower[3], upper[3], centre[3], widest = 0;
    before_camera(bench, centre);
    for (int k = 0; k < 3; k++) {
        lower[k] = upper[k] = p[0][k];
        for (uint32_t i = 1; i < mesh->vertex_count; i++) {
            lower[k] = fminf(lower[k], p[i][k]);
            upper[k] = fmaxf(upper[k], p[i][k]);
        }
        widest = fmaxf(widest, upper[k] - lower[k]);
    }
    const float scale = MIRROR_WIDTH / widest;
    test_transform(m, scale, scale, scale, 0, 0, centre[0] - scale * (lower[0] + upper[0]) / 2,
                   centre[1] - scale * (lower[1] + upper[1]) / 2, centre[2] - scale * (lower[2] + upper[2]) / 2);
}

static bool add_mirror(struct bench *bench, struct error *error)
{
    struct loaded_model model;
    struct scene_changes changes;
    const struct scene_mesh *mesh = NULL;
    if (!load_model(&model, bench->mirror, error))
        return false;
    for (uint32_t id = 1; !mesh && id < 100000; id++)
        mesh = scene_mesh(model.scene, id);
    if (mesh) {
        struct test_edits edits = {.scene = bench->scene.loaded.scene};
        float m[12];
        mirror_transform(bench, mesh, m);
        test_mesh(&edits, MIRROR_ID, positions_of(mesh), mesh->vertex_count, indices_of(mesh),
                  mesh->triangle_count)
            ->arrays[MESH_NORMALS] = smooth_normals(mesh);
        test_node(&edits, MIRROR_ID, 0, NODE_MESH, MIRROR_ID, m);
        test_commit(&edits);
        bench->scene.triangle_count += mesh->triangle_count;
    } else {
        error_set(error, ERROR_INVALID, "--mirror", "the model has no mesh");
    }
    load_model_finish(&model);
    return mesh && gpu_scene_update(&bench->scene.gpu, bench->scene.loaded.scene, NULL, &changes, NULL, error);
}

/* ---- what is cut ---- */

static bool cut(struct bench *bench, struct error *error)
{
    struct bench_scene *scene = &bench->scene;
    struct scene_changes changes;
    struct scene *small = bench_cut_scene(&scene->gpu, bench->cut, &scene->triangle_count, error);
    if (!small)
        return false;
    gpu_scene_finish(&scene->gpu);
    load_model_finish(&scene->loaded);
    gpu_scene_init(&scene->gpu, bench->device);
    scene->loaded = (struct loaded_model){.scene = small};
    return gpu_scene_update(&scene->gpu, small, NULL, &changes, NULL, error);
}

/* ---- what moves ---- */

#define FAMILY_ID 1u /* of the mesh and of its node */

/* A target to the family's mesh, to which every vertex goes its own way. */
static void add_target(struct bench *bench)
{
    struct test_edits edits = {.scene = bench->scene.loaded.scene};
    const struct scene_mesh *still = scene_mesh(edits.scene, FAMILY_ID);
    const float(*p)[3] = positions_of(still);
    float(*ways)[3] = malloc(still->vertex_count * sizeof(*ways));
    for (uint32_t i = 0; i < still->vertex_count; i++)
        for (int k = 0; k < 3; k++)
            ways[i][k] = 0.1f * sinf(5 * p[i][(k + 1) % 3]) * cosf(3 * p[i][(k + 2) % 3]);
    struct scene_mesh *mesh =
        test_mesh(&edits, FAMILY_ID, p, still->vertex_count, indices_of(still), still->triangle_count);
    mesh->target_count = mesh->weight_count = 1;
    mesh->weights = calloc(1, sizeof(*mesh->weights));
    mesh->arrays[MESH_TARGET_POSITIONS] = test_blob(ways, still->vertex_count * sizeof(*ways));
    free(ways);
    test_commit(&edits);
}

static bool move(struct bench *bench, unsigned round, struct error *error)
{
    struct scene_changes changes;
    struct scene_motion motion;
    const float weight = 0.5f + 0.5f * sinf(0.7f * (float)round);
    test_motion_init(&motion, 1);
    test_pose_weights(&motion.poses[0], FAMILY_ID, &weight, 1);
    const bool ok = gpu_scene_update(&bench->scene.gpu, bench->scene.loaded.scene, &motion, &changes, NULL, error);
    scene_motion_finish(&bench->motion);
    bench->motion = motion;
    bench->scene.gpu.motion = &bench->motion;
    bench->changed = changes.bits;
    return ok;
}

/* ---- rays ---- */

static struct ray ray_of(const float origin[3], const float direction[3], float t_min, float t_max)
{
    return (struct ray){{origin[0], origin[1], origin[2], t_min},
                        {direction[0], direction[1], direction[2], t_max}};
}

static struct ray mirrored(const float point[3], const float d[3], const float n[3])
{
    const float along = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
    const float way[3] = {d[0] - 2 * along * n[0], d[1] - 2 * along * n[1], d[2] - 2 * along * n[2]};
    return ray_of(point, way, MIRROR_OFFSET, FAR);
}

static bool meet_ball(const struct bench *bench, const struct ray *from, struct ray *ray)
{
    const float *o = from->origin_t_min, *d = from->direction_t_max;
    float centre[3], away[3], along = 0, outside = -BALL_RADIUS * BALL_RADIUS, point[3], n[3];
    before_camera(bench, centre);
    for (int k = 0; k < 3; k++) {
        away[k] = o[k] - centre[k];
        along += away[k] * d[k];
        outside += away[k] * away[k];
    }
    const float squared = along * along - outside;
    if (squared < 0)
        return false;
    for (int k = 0; k < 3; k++) {
        point[k] = o[k] - (along + sqrtf(squared)) * d[k];
        n[k] = (point[k] - centre[k]) / BALL_RADIUS;
    }
    *ray = mirrored(point, d, n);
    return true;
}

static bool meet_mirror(const struct bench *bench, const struct ray *from, const struct hit *hit, struct ray *ray)
{
    const struct gpu_scene *scene = &bench->scene.gpu;
    const struct scene_mesh *mesh =
        hit->distance < 0 ? NULL : scene->geometries[scene->instances[hit->instance].geometry].mesh;
    if (!mesh || mesh->base.id != MIRROR_ID)
        return false;
    float point[3], n[3];
    bench_unpack_unit(n, hit->normal_shading);
    for (int k = 0; k < 3; k++)
        point[k] = from->origin_t_min[k] + hit->distance * from->direction_t_max[k];
    *ray = mirrored(point, from->direction_t_max, n);
    return true;
}

static bool shadow_of(const struct bench *bench, const struct ray *from, const struct hit *hit, struct ray *ray)
{
    const float *light = bench->scene.light_world;
    float point[3], way[3], squared = 0;
    if (hit->distance < 0)
        return false;
    for (int k = 0; k < 3; k++) {
        point[k] = from->origin_t_min[k] + hit->distance * from->direction_t_max[k];
        way[k] = bench->name == TURNED ? point[k] - light[k] : light[k] - point[k];
        squared += way[k] * way[k];
    }
    const float length = sqrtf(squared);
    for (int k = 0; k < 3; k++)
        way[k] /= length;
    *ray = bench->name == TURNED ? ray_of(light, way, 0, length - SHADOW_OFFSET)
                                 : ray_of(point, way, SHADOW_OFFSET, length);
    return true;
}

/* Those of the wave into bench->rays, from what other rays hit. */
static uint32_t make_rays(struct bench *bench, enum wave_name name, const struct ray *from, const struct hit *hits,
                          uint32_t from_count)
{
    uint32_t count = 0;
    if (name == REFLECTION || name == BOUNCE)
        return bench_secondary_rays(bench->rays, name == BOUNCE ? BENCH_BOUNCE : BENCH_REFLECTION, from, hits,
                                    from_count, 1, &bench->scene);
    for (uint32_t i = 0; i < from_count; i++) {
        struct ray *ray = &bench->rays[count];
        if (name == PRIMARY)
            *ray = from[i];
        count += name == PRIMARY  ? true
                 : name == BALL   ? meet_ball(bench, &from[i], ray)
                 : name == MIRROR ? meet_mirror(bench, &from[i], &hits[i], ray)
                                  : shadow_of(bench, &from[i], &hits[i], ray);
    }
    return count;
}

/* ---- tracing ---- */

static struct tracer *make_tracer(struct bench *bench, unsigned contender, struct error *error)
{
    struct tracer_options options = bench->options;
    if (contenders[contender].is_flat)
        options.rayspace.mode = RAYSPACE_MODE_FLAT;
    if (contenders[contender].is_unturned)
        options.rayspace.turn = RAYSPACE_CHANCE_OFF;
    const struct tracer_impl *impl = tracer_find(contenders[contender].number, "--beside", error);
    struct tracer *tracer = impl ? tracer_create(impl, bench->device, &options, error) : NULL;
    if (tracer && !tracer_update(tracer, &bench->scene.gpu, &(struct tracer_update){0}, error)) {
        tracer_destroy(tracer);
        return NULL;
    }
    return tracer;
}

/* After all vertices have moved. */
static bool update(struct bench *bench, unsigned tracer, struct error *error)
{
    struct tracer **tracers = bench->tracers;
    if (!bench->anew || tracer == 0)
        return tracer_update(tracers[tracer], &bench->scene.gpu,
                             &(struct tracer_update){.changed = bench->changed}, error);
    tracer_destroy(tracers[tracer]);
    tracers[tracer] = make_tracer(bench, bench->which[tracer], error);
    return tracers[tracer] != NULL;
}

static bool trace(struct bench *bench, unsigned tracer, struct error *error)
{
    if (bench->moves && !update(bench, tracer, error))
        return false;
    gpu_scene_bind(&bench->scene.gpu);
    const bool ok = bench->wave.kind == WAVE_ANY
                        ? tracer_trace(bench->tracers[tracer], &bench->scene.gpu, &bench->wave, error)
                        : tracer_intersect(bench->tracers[tracer], &bench->scene.gpu, &bench->wave, error);
    glFinish();
    return ok;
}

static bool upload_wave(struct bench *bench, uint32_t count, bool is_any, struct error *error)
{
    bench->wave = (struct wave){.kind = is_any ? WAVE_ANY : WAVE_CLOSEST,
                                .ray_count = count,
                                .rays = &bench->ray_buffer,
                                .hits = &bench->answers,
                                .visibility = &bench->answers};
    return gpu_buffer_upload(bench->device, &bench->ray_buffer, bench->rays, count * sizeof(*bench->rays),
                             error) &&
           gpu_buffer_reserve(bench->device, &bench->answers, count * sizeof(struct hit), error);
}

/* Of the wave in hand, by the second tracer: its rays and where they end. */
static bool trace_on(struct bench *bench, uint32_t count, struct ray *from, struct hit *hits, struct error *error)
{
    gpu_scene_bind(&bench->scene.gpu);
    if (!upload_wave(bench, count, false, error) ||
        !tracer_trace(bench->tracers[1], &bench->scene.gpu, &bench->wave, error))
        return false;
    memcpy(from, bench->rays, count * sizeof(*from));
    gpu_buffer_read(bench->device, &bench->answers, 0, hits, count * sizeof(*hits));
    return true;
}

static bool prepare_rays(struct bench *bench, struct error *error)
{
    uint32_t count = bench->width * bench->height;
    struct ray *from = malloc(count * sizeof(*from));
    struct hit *hits = malloc(count * sizeof(*hits));
    bench->rays = malloc(count * sizeof(*bench->rays));
    bench_camera_rays(bench->rays, &bench->scene.camera, bench->width, bench->height);
    bool ok = true;
    for (uint32_t i = 0; ok && i <= bench->after; i++) {
        ok = trace_on(bench, count, from, hits, error);
        if (ok)
            count = make_rays(bench, i < bench->after ? REFLECTION : bench->name, from, hits, count);
        ok = ok && (count > 0 || error_set(error, ERROR_INVALID, "--wave", "no ray hits what the wave begins at"));
    }
    free(from);
    free(hits);
    return ok && upload_wave(bench, count, bench->name == SHADOW || bench->name == TURNED, error);
}

/* The first tracer from nothing to its last frame but one, whose time is that of the run. */
static bool trace_first_frames(struct bench *bench, bool is_counted, struct error *error)
{
    tracer_destroy(bench->tracers[0]);
    const uint64_t start_ns = bench_processor_ns();
    bench->tracers[0] = make_tracer(bench, 0, error);
    bool ok = bench->tracers[0] && trace(bench, 0, error);
    if (is_counted)
        bench_add(&bench->first, bench_processor_ns() - start_ns);
    for (uint32_t i = 2; ok && i < bench->frames; i++)
        ok = trace(bench, 0, error);
    return ok;
}

/* Of the wave that has been traced, some times over; and counts of that. */
static bool build_nodes(struct bench *bench, struct error *error)
{
    struct rayspace_state *state = (struct rayspace_state *)bench->tracers[0]->state;
    gpu_buffer_read(bench->device, &state->control, 0, &bench->control, sizeof(bench->control));
    const uint64_t start_ns = bench_processor_ns();
    for (unsigned i = 0; i < BUILDS_A_RUN; i++)
        if (!rayspace_nodes_build(state, &bench->scene.gpu, false, error))
            return false;
    glFinish();
    bench_add(&bench->nodes, (bench_processor_ns() - start_ns) / BUILDS_A_RUN);
    return true;
}

static bool is_alike(const struct bench *bench, const void *a, const void *b, uint32_t i)
{
    if (bench->wave.kind == WAVE_ANY)
        return ((const uint32_t *)a)[i] == ((const uint32_t *)b)[i];
    const float x = ((const struct hit *)a)[i].distance, y = ((const struct hit *)b)[i].distance;
    return (x < 0) == (y < 0) && fabsf(x - y) <= DISTANCE_TOLERANCE * fabsf(y);
}

static bool run(struct bench *bench, struct error *error)
{
    const uint32_t rays = bench->wave.ray_count;
    void *answers[2] = {malloc(rays * sizeof(struct hit)), malloc(rays * sizeof(struct hit))};
    bool ok = true;
    for (unsigned round = 0; ok && round <= bench->runs; round++) {
        ok = !bench->moves || move(bench, round, error);
        glFinish();
        for (unsigned turn = 0; ok && turn < bench->tracer_count; turn++) {
            const unsigned i = (turn + round) % bench->tracer_count;
            if (i == 0 && bench->frames > 1 && !trace_first_frames(bench, round > 0, error))
                return false;
            const uint64_t start_ns = bench_processor_ns();
            ok = trace(bench, i, error);
            if (round > 0)
                bench_add(&bench->times[i], bench_processor_ns() - start_ns);
            else if (i < 2)
                gpu_buffer_read(bench->device, &bench->answers, 0, answers[i], rays * sizeof(struct hit));
            if (ok && i == 0 && round > 0)
                ok = build_nodes(bench, error);
        }
    }
    for (uint32_t i = 0; ok && i < rays; i++)
        bench->differing += !is_alike(bench, answers[0], answers[1], i);
    free(answers[0]);
    free(answers[1]);
    return ok && gpu_check(bench->device, "bench", error);
}

static bool prepare(struct bench *bench, struct error *error)
{
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    if (!bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error) ||
        (bench->cut > 0 && !cut(bench, error)) || (bench->mirror && !add_mirror(bench, error)))
        return false;
    if (bench->moves) {
        add_target(bench);
        if (!move(bench, 0, error))
            return false;
    }
    if (bench->has_light)
        memcpy(bench->scene.light_world, bench->light, sizeof(bench->light));
    for (unsigned i = 0; i < TRACERS; i++) {
        if (i > 0 && !bench_is_named(bench->beside, contenders[i].name))
            continue;
        const unsigned made = bench->tracer_count++;
        bench->which[made] = i;
        bench->tracers[made] = make_tracer(bench, i, error);
        if (!bench->tracers[made])
            return false;
    }
    return (bench->tracer_count > 1 || error_set(error, ERROR_INVALID, "--beside", "names no tracer")) &&
           prepare_rays(bench, error);
}

/* ---- in and out ---- */

static bool print(const struct bench *bench)
{
    const struct rayspace_control *control = &bench->control;
    const struct rayspace_levels levels = rayspace_levels_over(bench->wave.ray_count);
    json_t *tracers = json_array();
    for (unsigned i = 0; i < bench->tracer_count; i++)
        json_array_append_new(tracers, json_pack("{s:s, s:o}", "name", contenders[bench->which[i]].name, "cpu_ns",
                                                 bench_times_json(&bench->times[i])));
    json_t *measured = json_pack(
        "{s:s, s:i, s:i, s:i, s:I, s:I, s:I, s:i, s:i, s:i, s:o, s:o, s:i, s:o}", "wave", wave_names[bench->name],
        "width", (int)bench->width, "height", (int)bench->height, "rays", (int)bench->wave.ray_count, "cone_tests",
        (json_int_t)control->cone_tests, "triangle_tests", (json_int_t)control->triangle_tests, "pairs_max",
        (json_int_t)control->pairs_max, "passes", (int)control->passes, "halvings", (int)control->halvings,
        "nodes", (int)(levels.first[levels.top] + 1), "nodes_ns", bench_times_json(&bench->nodes), "first_ns",
        bench_times_json(&bench->first), "differing", (int)bench->differing, "tracers", tracers);
    return bench_scene_print(&bench->scene, &bench->scene_options, bench->device, measured);
}

static bool parse_setting(struct bench *bench, int option, const char *text)
{
    static const char *const modes[] = {"joint", "flat"}, *const bounds[] = {"both", "sphere"},
                             *const chances[] = {"auto", "on", "off"};
    struct rayspace_settings *settings = &bench->options.rayspace;
    switch (option) {
    case 'M':
        return bench_parse_word(text, modes, 2, &settings->mode);
    case 'B':
        return bench_parse_word(text, bounds, 2, &settings->bounds);
    case 'R':
        return bench_parse_number(text, 1, 16, &settings->rounds);
    case 'T':
        return bench_parse_word(text, chances, 3, &settings->turn);
    default:
        return bench_parse_scene(option, text, &bench->scene_options);
    }
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    uint32_t word;
    char *end;
    switch (option) {
    case 'w':
        if (!bench_parse_word(text, wave_names, WAVE_NAMES, &word))
            return false;
        bench->name = word;
        return true;
    case 'i':
        bench->mirror = text;
        return true;
    case 'g':
        return bench->has_light = bench_parse_vector(text, bench->light);
    case 'd':
        bench->beside = text;
        return true;
    case 'o':
        return bench->moves = true;
    case 'a':
        return bench->anew = true;
    case 'c':
        bench->cut = strtof(text, &end);
        return *end == '\0' && bench->cut > 0;
    case 'F':
        return bench_parse_number(text, 2, FRAMES_MAX, &bench->frames);
    case 'A':
        return bench_parse_number(text, 0, AFTER_MAX, &bench->after);
    case 's':
        return bench_parse_size(text, &bench->width, &bench->height);
    case 'r':
        return bench_parse_number(text, 1, BENCH_RUNS_MAX, &bench->runs);
    default:
        return parse_setting(bench, option, text);
    }
}

static bool parse(struct bench *bench, int argc, char **argv)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'},   {"family", 1, NULL, 'f'}, {"wave", 1, NULL, 'w'},  {"mirror", 1, NULL, 'i'},
        {"light", 1, NULL, 'g'},   {"beside", 1, NULL, 'd'}, {"size", 1, NULL, 's'},  {"eye", 1, NULL, 'e'},
        {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},     {"fov", 1, NULL, 'v'},   {"runs", 1, NULL, 'r'},
        {"moves", 0, NULL, 'o'},   {"anew", 0, NULL, 'a'},   {"cut", 1, NULL, 'c'},   {"mode", 1, NULL, 'M'},
        {"bounds", 1, NULL, 'B'},  {"rounds", 1, NULL, 'R'}, {"after", 1, NULL, 'A'}, {"frames", 1, NULL, 'F'},
        {"turn", 1, NULL, 'T'},    {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.beside = "bvh", .width = 256, .height = 256, .runs = 3};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    return (bench->scene_options.model != NULL) != (bench->scene_options.family_triangles > 0) &&
           (bench->name == MIRROR) == (bench->mirror != NULL) &&
           !(bench->moves && (bench->scene_options.model || bench->cut > 0)) && !(bench->anew && !bench->moves) &&
           !(bench->after > 0 && (bench->name == PRIMARY || bench->name == BALL || bench->name == MIRROR)) &&
           optind == argc;
}

static void finish(struct bench *bench)
{
    for (unsigned i = 0; i < TRACERS; i++)
        tracer_destroy(bench->tracers[i]);
    gpu_buffer_finish(bench->device, &bench->ray_buffer);
    gpu_buffer_finish(bench->device, &bench->answers);
    scene_motion_finish(&bench->motion);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
    free(bench->rays);
}

BENCH(rayspace)
{
    struct bench bench;
    struct error error = {0};
    if (!parse(&bench, argc, argv)) {
        fputs(usage, stderr);
        return 2;
    }
    bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    bool ok = bench.device && prepare(&bench, &error) && run(&bench, &error);
    if (!ok)
        fprintf(stderr, "bench rayspace: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    ok = ok && print(&bench);
    const bool agree = bench.differing <= bench.wave.ray_count / 10000;
    if (!agree)
        fprintf(stderr, "bench rayspace: %u of %u answers differ\n", bench.differing, bench.wave.ray_count);
    if (bench.device)
        finish(&bench);
    return ok && agree ? 0 : 1;
}
