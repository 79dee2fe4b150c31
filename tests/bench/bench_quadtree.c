/* SPDX-License-Identifier: MIT */
/* Rays through the tracer `quadtree`: building its structure for a view, and waves of rays, in its forms and
 * beside other tracers. Prints one JSON object: {"scene", "triangles", "device", "software", "wave", "width",
 * "height", "rays", "contenders": [{"name", "nodes", "bytes", "update_ns", "draw_ns", "nodes_ns", "trace_ns",
 * "traversal_ns", "eye_ns", "steps", "layers", "unknown", "known", "agree", "eye_unknown", "eye_agree"}]}.
 *
 *   update_ns  bringing the structure to the view, all of it; draw_ns and nodes_ns of another update, in steps:
 *              drawing the layers, and building the nodes of them. Of `bvh` and `reference`: []
 *   eye_ns     moved: from the camera to hits, without a picture; of bvh and reference, and forms that
 *              need them, rays are made as frames make them; eye_unknown and eye_agree as below, or null of these
 *   steps      nodes that a ray looks at, and layers: means; null of `bvh` and `reference`
 *   unknown    rays that ended where the view sees nothing; known: the others, or misses
 *   agree      of those, the ones with the distance of `bvh`
 *
 * Times are of the processor, all threads of the process, one a run; traversal_ns of `reference` is Embree's own,
 * by the clock. Exit status: 1 failed, 2 usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_eye_pass.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_waves.h"

#include "trace/tracer.h"

#include <epoxy/gl.h>
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: bench quadtree --model FILE | --family TRIANGLES [options]\n"
    "  --wave NAME     moved: the rays of an eye that has moved; reflection, bounce: as of bench tracers, of the "
    "eye;\n"
    "                  default moved\n"
    "  --move R,U,A    metres right, up and ahead; default 0.065,0,0\n"
    "  --after N       reflection, bounce: so many reflections are between the camera's rays and the wave; "
    "default "
    "0\n"
    "  --forms LIST    of one, two, three (layers), quadtree, dda, minmax, stack, adaptive, bvh, reference, and\n"
    "                  primitives, which moved eyes hit in place of planes; default quadtree,dda,minmax\n"
    "  --layers N, --resolution N, --faces cube|view, --pixels E, --radius R, --margin M   settings of quadtree;\n"
    "                  default: 2 layers, the view, the picture's resolution\n"
    "  --size WxH      multiples of 8; default 1280x720\n"
    "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]\n"
    "  --runs N        after one warm-up; default 3, at most 64\n";

#define DISTANCE_TOLERANCE 1e-3f /* of a distance: planes of the tree are not the surface itself */
#define AFTER_MAX 8u
enum { DRAW, NODES, PHASES }; /* of a build's spans */
enum wave_name { MOVED, REFLECTION, BOUNCE, WAVE_NAMES };
static const char *const wave_names[WAVE_NAMES] = {"moved", "reflection", "bounce"};

static const struct form {
    const char *name;
    unsigned tracer;
    uint32_t layers; /* 0: as --layers says */
    uint32_t nodes, walk, adaptive, hits, stack;
} forms[] = {
    {.name = "bvh", .tracer = TRACER_BVH}, /* tells where rays go on, and what is right */
    {.name = "reference", .tracer = TRACER_REFERENCE},
    {.name = "quadtree", .tracer = TRACER_QUADTREE},
    {.name = "one", .tracer = TRACER_QUADTREE, .layers = 1},
    {.name = "two", .tracer = TRACER_QUADTREE, .layers = 2},
    {.name = "three", .tracer = TRACER_QUADTREE, .layers = 3},
    {.name = "dda", .tracer = TRACER_QUADTREE, .walk = QUADTREE_WALK_DDA},
    {.name = "minmax", .tracer = TRACER_QUADTREE, .nodes = QUADTREE_NODES_MINMAX},
    {.name = "primitives", .tracer = TRACER_QUADTREE, .hits = QUADTREE_HITS_PRIMITIVE},
    {.name = "stack", .tracer = TRACER_QUADTREE, .stack = 1},
    {.name = "adaptive", .tracer = TRACER_QUADTREE, .adaptive = QUADTREE_ADAPTIVE_ON},
};
enum { FORMS = sizeof(forms) / sizeof(forms[0]) };

struct contender {
    const struct form *form;
    struct tracer *tracer;
    struct bench_runs update, phases[PHASES], trace, traversal, eye;
    double steps, layers;
    uint32_t unknown, agree, eye_unknown, eye_agree;
};

struct bench {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct quadtree_settings settings;
    const char *names;
    enum wave_name wave_name;
    float way[3];
    uint32_t width, height, runs, after;
    struct trace_view view;
    struct ray *rays;
    struct hit *truth, *answers;
    struct gpu_buffer ray_buffer, answer_buffer;
    struct wave wave;
    struct bench_eye_pass eye;
    struct contender contenders[FORMS];
    unsigned count;
};

static bool is_quadtree(const struct contender *contender)
{
    return contender->form->tracer == TRACER_QUADTREE;
}

/* ---- structures ---- */

static bool make(struct bench *bench, const struct form *form, struct error *error)
{
    struct tracer_options options = {.quadtree = bench->settings};
    struct contender *contender = &bench->contenders[bench->count];
    struct quadtree_settings *settings = &options.quadtree;
    settings->layers = form->layers ? form->layers : settings->layers;
    settings->nodes = form->nodes;
    settings->walk = form->walk;
    settings->adaptive = form->adaptive;
    settings->hits = form->hits ? form->hits : bench->wave_name == MOVED ? QUADTREE_HITS_PLANE : 0;
    options.bench.quadtree_stack = form->stack;
    const struct tracer_impl *impl = tracer_find(form->tracer, "--forms", error);
    contender->form = form;
    contender->tracer = impl ? tracer_create(impl, bench->device, &options, error) : NULL;
    bench->count += contender->tracer != NULL;
    return contender->tracer && tracer_update(contender->tracer, &bench->scene.gpu,
                                              &(struct tracer_update){.view = &bench->view}, error);
}

/* What the spans of a step say that it did: a phase, or PHASES. */
static unsigned phase_of(const struct stage_times *times)
{
    for (uint32_t i = 0; i < times->count; i++)
        if (times->spans[i].stage == STAGE_BUILD && times->spans[i].wave < PHASES)
            return times->spans[i].wave;
    return PHASES;
}

/* Once more from the beginning, in the smallest steps, which are of one phase each. */
static bool build_by_phases(struct bench *bench, struct contender *contender, bool is_counted, struct error *error)
{
    uint64_t sums[PHASES + 1] = {0};
    enum tracer_progress progress;
    tracer_outdate(contender->tracer);
    do {
        struct stage_times times;
        stage_times_begin(&times);
        const struct tracer_update update = {.view = &bench->view, .times = &times};
        const uint64_t start_ns = bench_processor_ns();
        progress = tracer_update_step(contender->tracer, &bench->scene.gpu, &update, 0, error);
        glFinish();
        sums[phase_of(&times)] += bench_processor_ns() - start_ns;
    } while (progress == TRACER_MORE);
    for (int i = 0; is_counted && i < PHASES; i++)
        bench_add(&contender->phases[i], sums[i]);
    return progress == TRACER_DONE;
}

static bool build(struct bench *bench, struct contender *contender, bool is_counted, struct error *error)
{
    tracer_outdate(contender->tracer);
    const uint64_t start_ns = bench_processor_ns();
    const bool done =
        tracer_update(contender->tracer, &bench->scene.gpu, &(struct tracer_update){.view = &bench->view}, error);
    glFinish();
    if (is_counted)
        bench_add(&contender->update, bench_processor_ns() - start_ns);
    return done && build_by_phases(bench, contender, is_counted, error);
}

/* ---- rays ---- */

static bool upload(struct bench *bench, uint32_t count, struct error *error)
{
    bench->wave = (struct wave){.kind = WAVE_CLOSEST,
                                .ray_count = count,
                                .rays = &bench->ray_buffer,
                                .hits = &bench->answer_buffer,
                                .shared_origin = bench->wave_name == MOVED};
    return gpu_buffer_upload(bench->device, &bench->ray_buffer, bench->rays, count * sizeof(*bench->rays),
                             error) &&
           gpu_buffer_reserve(bench->device, &bench->answer_buffer, count * sizeof(struct hit), error);
}

static void read_answers(struct bench *bench, struct hit *answers)
{
    gpu_buffer_read(bench->device, &bench->answer_buffer, 0, answers, bench->wave.ray_count * sizeof(*answers));
}

static bool trace(struct bench *bench, struct contender *contender, struct error *error)
{
    gpu_scene_bind(&bench->scene.gpu);
    const bool done = tracer_intersect(contender->tracer, &bench->scene.gpu, &bench->wave, error);
    glFinish();
    return done;
}

/* Where the wave in hand ends, by the first contender, and what it bounces to. */
static bool go_on(struct bench *bench, enum bench_wave_kind kind, uint32_t *count, struct error *error)
{
    struct ray *from = malloc(*count * sizeof(*from));
    gpu_scene_bind(&bench->scene.gpu);
    bool done = from && upload(bench, *count, error) &&
                tracer_trace(bench->contenders[0].tracer, &bench->scene.gpu, &bench->wave, error);
    if (done) {
        memcpy(from, bench->rays, *count * sizeof(*from));
        read_answers(bench, bench->answers);
        *count = bench_secondary_rays(bench->rays, kind, from, bench->answers, *count, 1, &bench->scene);
        done = *count > 0 || error_set(error, ERROR_INVALID, "--wave", "no ray hits anything");
    }
    free(from);
    return done;
}

static bool prepare_rays(struct bench *bench, struct error *error)
{
    uint32_t count = bench->width * bench->height;
    const struct frame_camera camera =
        bench->wave_name == MOVED ? bench_moved(&bench->scene.camera, bench->way) : bench->scene.camera;
    bench_camera_rays(bench->rays, &camera, bench->width, bench->height);
    bool done = bench_eye_pass_init(&bench->eye, bench->device, &bench->scene, &camera, &bench->view, error);
    for (uint32_t i = 0; done && bench->wave_name != MOVED && i <= bench->after; i++)
        done = go_on(bench, i < bench->after || bench->wave_name == REFLECTION ? BENCH_REFLECTION : BENCH_BOUNCE,
                     &count, error);
    if (!done || !upload(bench, count, error) || !trace(bench, &bench->contenders[0], error))
        return false;
    read_answers(bench, bench->truth);
    return true;
}

static bool prepare(struct bench *bench, struct error *error)
{
    const size_t count = (size_t)bench->width * bench->height;
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    if (!bench_scene_init(&bench->scene, bench->device, &bench->scene_options, error))
        return false;
    const struct frame_camera *camera = &bench->scene.camera;
    bench->view = (struct trace_view){.fov_y = camera->fov_y, .width = bench->width, .height = bench->height};
    memcpy(bench->view.world_from_view, camera->world_from_view, sizeof(bench->view.world_from_view));
    bench->rays = malloc(count * sizeof(*bench->rays));
    bench->truth = malloc(count * sizeof(*bench->truth));
    bench->answers = malloc(count * sizeof(*bench->answers));
    if (!bench->rays || !bench->truth || !bench->answers)
        return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the rays");
    for (unsigned i = 0; i < FORMS; i++)
        if ((i == 0 || bench_is_named(bench->names, forms[i].name)) && !make(bench, &forms[i], error))
            return false;
    return prepare_rays(bench, error);
}

/* ---- what comes of it ---- */

static void compare(const struct bench *bench, const struct contender *contender, uint32_t *unknown,
                    uint32_t *agree)
{
    for (uint32_t i = 0; i < bench->wave.ray_count; i++) {
        const struct hit *answer = &bench->answers[i];
        const float x = answer->distance, y = bench->truth[i].distance;
        if (is_quadtree(contender) && (answer->material & HIT_UNKNOWN))
            ++*unknown;
        else
            *agree += (x < 0) == (y < 0) && fabsf(x - y) <= DISTANCE_TOLERANCE * fabsf(y);
    }
}

static bool count_steps(struct bench *bench, struct contender *contender, struct error *error)
{
    contender->tracer->options.bench.quadtree_count_steps = 1;
    const bool done = trace(bench, contender, error);
    contender->tracer->options.bench.quadtree_count_steps = 0;
    read_answers(bench, bench->answers);
    for (uint32_t i = 0; done && i < bench->wave.ray_count; i++) {
        contender->steps += (double)bench->answers[i].distance / bench->wave.ray_count;
        contender->layers += (double)bench->answers[i].primitive / bench->wave.ray_count;
    }
    return done;
}

static bool run_eye(struct bench *bench, struct contender *contender, bool is_counted, struct error *error)
{
    if (bench->wave_name != MOVED)
        return true;
    const uint64_t start_ns = bench_processor_ns();
    if (!bench_eye_pass_run(&bench->eye, contender->tracer, error))
        return false;
    if (is_counted)
        bench_add(&contender->eye, bench_processor_ns() - start_ns);
    if (is_counted || !bench_eye_pass_is_short(&bench->eye, contender->tracer))
        return true;
    if (!bench_eye_pass_read(&bench->eye, bench->rays, bench->answers, error))
        return false;
    compare(bench, contender, &contender->eye_unknown, &contender->eye_agree);
    return true;
}

static bool run_once(struct bench *bench, struct contender *contender, bool is_counted, struct error *error)
{
    if (is_quadtree(contender) && !build(bench, contender, is_counted, error))
        return false;
    if (!run_eye(bench, contender, is_counted, error))
        return false;
    const uint64_t start_ns = bench_processor_ns();
    if (!trace(bench, contender, error))
        return false;
    const uint64_t time_ns = bench_processor_ns() - start_ns;
    if (is_counted) {
        bench_add(&contender->trace, time_ns);
        bench_add(&contender->traversal, contender->tracer->stats.traversal_ns);
        return true;
    }
    read_answers(bench, bench->answers);
    compare(bench, contender, &contender->unknown, &contender->agree);
    return !is_quadtree(contender) || count_steps(bench, contender, error);
}

static bool run(struct bench *bench, struct error *error)
{
    for (unsigned round = 0; round <= bench->runs; round++)
        for (unsigned turn = 0; turn < bench->count; turn++)
            if (!run_once(bench, &bench->contenders[(turn + round) % bench->count], round > 0, error))
                return false;
    return gpu_check(bench->device, "bench", error);
}

/* ---- in and out ---- */

static json_t *contender_json(const struct bench *bench, const struct contender *contender)
{
    const struct tracer_stats *stats = &contender->tracer->stats;
    const uint32_t known = bench->wave.ray_count - contender->unknown;
    json_t *object = json_pack(
        "{s:s, s:I, s:I, s:o, s:o, s:o, s:o, s:o, s:i, s:i, s:i}", "name", contender->form->name, "nodes",
        (json_int_t)stats->nodes, "bytes", (json_int_t)tracer_device_bytes(contender->tracer), "update_ns",
        bench_times_json(&contender->update), "draw_ns", bench_times_json(&contender->phases[DRAW]), "nodes_ns",
        bench_times_json(&contender->phases[NODES]), "trace_ns", bench_times_json(&contender->trace),
        "traversal_ns", bench_times_json(&contender->traversal), "unknown", (int)contender->unknown, "known",
        (int)known, "agree", (int)contender->agree);
    const bool has_steps = is_quadtree(contender),
               is_short = bench_eye_pass_is_short(&bench->eye, contender->tracer);
    json_object_set_new(object, "eye_ns", bench_times_json(&contender->eye));
    json_object_set_new(object, "eye_unknown", is_short ? json_integer(contender->eye_unknown) : json_null());
    json_object_set_new(object, "eye_agree", is_short ? json_integer(contender->eye_agree) : json_null());
    json_object_set_new(object, "steps", has_steps ? json_real(contender->steps) : json_null());
    json_object_set_new(object, "layers", has_steps ? json_real(contender->layers) : json_null());
    return object;
}

static bool print(const struct bench *bench)
{
    json_t *contenders = json_array();
    for (unsigned i = 0; i < bench->count; i++)
        json_array_append_new(contenders, contender_json(bench, &bench->contenders[i]));
    json_t *measured =
        json_pack("{s:s, s:i, s:i, s:i, s:o}", "wave", wave_names[bench->wave_name], "width", (int)bench->width,
                  "height", (int)bench->height, "rays", (int)bench->wave.ray_count, "contenders", contenders);
    return bench_scene_print(&bench->scene, &bench->scene_options, bench->device, measured);
}

static bool parse_setting(struct bench *bench, int option, const char *text)
{
    static const char *const faces[] = {"cube", "view"};
    struct quadtree_settings *settings = &bench->settings;
    switch (option) {
    case 'L':
        return bench_parse_number(text, 1, 3, &settings->layers);
    case 'R':
        return bench_parse_number(text, 16, 4096, &settings->resolution);
    case 'F':
        return bench_parse_word(text, faces, 2, &settings->faces);
    case 'P':
        return bench_parse_real(text, &settings->pixels);
    case 'D':
        return bench_parse_real(text, &settings->radius);
    case 'G':
        return bench_parse_real(text, &settings->margin);
    default:
        return bench_parse_scene(option, text, &bench->scene_options);
    }
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    uint32_t word;
    switch (option) {
    case 'w':
        if (!bench_parse_word(text, wave_names, WAVE_NAMES, &word))
            return false;
        bench->wave_name = word;
        return true;
    case 'M':
        return bench_parse_vector(text, bench->way);
    case 'A':
        return bench_parse_number(text, 0, AFTER_MAX, &bench->after);
    case 'n':
        bench->names = text;
        return true;
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
        {"model", 1, NULL, 'm'},      {"family", 1, NULL, 'f'}, {"wave", 1, NULL, 'w'},
        {"move", 1, NULL, 'M'},       {"after", 1, NULL, 'A'},  {"forms", 1, NULL, 'n'},
        {"layers", 1, NULL, 'L'},     {"faces", 1, NULL, 'F'},  {"pixels", 1, NULL, 'P'},
        {"resolution", 1, NULL, 'R'}, {"radius", 1, NULL, 'D'}, {"margin", 1, NULL, 'G'},
        {"size", 1, NULL, 's'},       {"eye", 1, NULL, 'e'},    {"look-at", 1, NULL, 'l'},
        {"up", 1, NULL, 'u'},         {"fov", 1, NULL, 'v'},    {"runs", 1, NULL, 'r'},
        {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.names = "quadtree,dda,minmax",
                            .settings = {.layers = 2, .faces = QUADTREE_FACES_VIEW},
                            .way = {0.065f, 0, 0},
                            .width = 1280,
                            .height = 720,
                            .runs = 3};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    return (bench->scene_options.model != NULL) != (bench->scene_options.family_triangles > 0) && optind == argc;
}

static void finish(struct bench *bench)
{
    for (unsigned i = 0; i < bench->count; i++)
        tracer_destroy(bench->contenders[i].tracer);
    gpu_buffer_finish(bench->device, &bench->ray_buffer);
    gpu_buffer_finish(bench->device, &bench->answer_buffer);
    bench_eye_pass_finish(&bench->eye);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
    free(bench->rays);
    free(bench->truth);
    free(bench->answers);
}

BENCH_ON_DEVICE(quadtree, prepare(&bench, &error) && run(&bench, &error))
