/* SPDX-License-Identifier: MIT */
/* Layered depth cubes beside each other and beside other tracers, on one scene. Prints one JSON object: {"scene",
 * "triangles", "spheres", "diagonal", "width", "height", "device", "software", "forms": [..]}; what a form's
 * object has, the parts say. `bench_ldc --help` has the options. The forms take turns, run by run. Exit status: 1
 * failed, 2 usage.
 */
#include "tests/bench/bench_ldc.h"
#include "tests/bench/bench_options.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: bench_ldc builds|samples|waves|frames  --model FILE | --family TRIANGLES | --sheets N\n"
    "                 --form FORM .. [options]\n"
    "  builds: what making a structure takes; samples: making those of ldc, and not what leads over emptiness;\n"
    "  waves: rays of them, and how far answers are from the reference;\n"
    "  frames: whole pictures, and how far they are from the reference's\n"
    "  --form TRACER[:KEY=VALUE,..]   bvh, reference or ldc; of ldc: resolution, block, build (auto peel lists),\n"
    "                        levels (auto blocks pyramid cells), images (overlap one), tolerance (metres), rays,\n"
    "                        layers (together)\n"
    "  --size WxH            multiples of 8; default 512x512\n"
    "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]   else the model's first camera, or one that sees "
    "all\n"
    "  --waves LIST          of primary,reflection,shadow,occlusion,bounce,shuffled; default: reflection\n"
    "  --depth N             of frames: bounces, default 1\n"
    "  --mirrors             everything becomes a mirror\n"
    "  --play                of frames: the model's first clip, 0.1 s further each run\n"
    "  --runs N              after one warm-up; default 5, at most 64\n";

/* ---- forms ---- */

static bool is_word(const char *value, const char *const words[], unsigned count, unsigned *found)
{
    for (*found = 0; *found < count; ++*found)
        if (strcmp(value, words[*found]) == 0)
            return true;
    return false;
}

static bool set_key(struct tracer_options *options, const char *key, const char *value)
{
    static const char *const builds[] = {"auto", "peel", "lists"}, *const levels[] = {"auto", "blocks", "pyramid",
                                                                                      "cells"};
    static const char *const images[] = {"overlap", "one"};
    const struct {
        const char *key;
        uint32_t *number;
    } numbers[] = {{"resolution", &options->ldc_resolution},
                   {"block", &options->ldc_block},
                   {"rays", &options->ldc_rays_together},
                   {"layers", &options->ldc_layers_together}};
    unsigned word;
    char *end;
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        if (strcmp(key, numbers[i].key) != 0)
            continue;
        *numbers[i].number = (uint32_t)strtoul(value, &end, 10);
        return end != value && *end == '\0';
    }
    if (strcmp(key, "build") == 0 && is_word(value, builds, 3, &word)) {
        options->ldc_build = word;
        return true;
    }
    if (strcmp(key, "levels") == 0 && is_word(value, levels, 4, &word)) {
        options->ldc_levels = word;
        return true;
    }
    if (strcmp(key, "images") == 0 && is_word(value, images, 2, &word)) {
        options->ldc_images = word;
        return true;
    }
    if (strcmp(key, "tolerance") == 0) {
        options->ldc_tolerance = strtof(value, &end);
        return end != value && *end == '\0' && options->ldc_tolerance >= 0;
    }
    return false;
}

bool bench_form_parse(struct bench_form *form, char *text)
{
    static const char *const tracers[] = {"bvh", "naive", "reference", "ldc"};
    char *name = strdup(text);
    *form = (struct bench_form){.name = name};
    char *options = strchr(text, ':'), *rest = NULL;
    if (options)
        *options++ = '\0';
    bool good = name && is_word(text, tracers, 4, &form->tracer);
    for (char *pair = options ? strtok_r(options, ",", &rest) : NULL; good && pair;
         pair = strtok_r(NULL, ",", &rest)) {
        char *value = strchr(pair, '=');
        if (!value)
            return false;
        *value++ = '\0';
        good = set_key(&form->options, pair, value);
    }
    return good;
}

/* ---- JSON ---- */

json_t *bench_cubes_json(const struct tracer_cube cubes[TRACER_CUBES_MAX])
{
    static const char *const parts[] = {"static", "dynamic"};
    json_t *list = json_array();
    for (unsigned i = 0; i < TRACER_CUBES_MAX; i++) {
        const struct tracer_cube *cube = &cubes[i];
        if (cube->resolution == 0)
            continue;
        json_array_append_new(list, json_pack("{s:s, s:i, s:f, s:i, s:i, s:I, s:I, s:b}", "part", parts[i],
                                              "resolution", (int)cube->resolution, "cell_metres",
                                              (double)cube->cell_metres, "layers_needed", (int)cube->layers_needed,
                                              "layers_kept", (int)cube->layers_kept, "samples",
                                              (json_int_t)cube->samples, "samples_lost",
                                              (json_int_t)cube->samples_lost, "rebuilt", cube->rebuilt ? 1 : 0));
    }
    return list;
}

json_t *bench_times_json(const struct bench_runs *runs)
{
    json_t *list = json_array();
    for (unsigned i = 0; i < runs->count; i++)
        json_array_append_new(list, json_integer((json_int_t)runs->times_ns[i]));
    return list;
}

static bool print(const struct bench_ldc *bench, json_t *forms)
{
    const struct bench_scene *scene = &bench->scene;
    const struct gpu_device_info *info = &bench->device->info;
    json_t *all = json_pack("{s:s, s:I, s:I, s:f, s:i, s:i, s:s, s:b, s:o}", "scene",
                            bench->scene_options.model    ? bench->scene_options.model
                            : bench->scene_options.sheets ? "sheets"
                                                          : "family",
                            "triangles", (json_int_t)scene->triangle_count, "spheres",
                            (json_int_t)scene->sphere_count, "diagonal", (double)scene->gpu.diagonal, "width",
                            (int)bench->width, "height", (int)bench->height, "device", info->name, "software",
                            bench->device->facts.software, "forms", forms);
    const bool done = all && json_dumpf(all, stdout, JSON_REAL_PRECISION(9)) == 0 && putchar('\n') == '\n' &&
                      fflush(stdout) == 0;
    json_decref(all);
    return done;
}

/* ---- command line ---- */

static bool parse_vector(const char *text, float v[3])
{
    char rest;
    return sscanf(text, "%f,%f,%f%c", &v[0], &v[1], &v[2], &rest) == 3;
}

static bool parse_number(const char *text, unsigned least, unsigned most, unsigned *number)
{
    char rest;
    return sscanf(text, "%u%c", number, &rest) == 1 && *number >= least && *number <= most;
}

static bool parse_waves(struct bench_ldc *bench, const char *text)
{
    unsigned asked = 1, found = 0;
    for (const char *at = text; *at; at++)
        asked += *at == ',';
    for (enum bench_wave_kind kind = 0; kind < BENCH_WAVE_KINDS; kind++)
        found += bench->waves[kind] = bench_is_named(text, bench_wave_facts[kind].name);
    return found == asked;
}

static bool parse_size(struct bench_ldc *bench, const char *text)
{
    char rest;
    return sscanf(text, "%ux%u%c", &bench->width, &bench->height, &rest) == 2 && bench->width % 8 == 0 &&
           bench->height % 8 == 0 && bench->width - 8 < 4096 && bench->height - 8 < 4096;
}

static bool parse_option(struct bench_ldc *bench, int option, char *text)
{
    struct bench_scene_options *scene = &bench->scene_options;
    switch (option) {
    case 'm':
        scene->model = text;
        return true;
    case 'f':
        return parse_number(text, 1, 50000000, &scene->family_triangles);
    case 'n':
        return parse_number(text, 1, 200, &scene->sheets);
    case 'o':
        return bench->form_count < BENCH_FORMS_MAX && bench_form_parse(&bench->forms[bench->form_count++], text);
    case 's':
        return parse_size(bench, text);
    case 'e':
        return scene->has_eye = parse_vector(text, scene->eye);
    case 'l':
        return parse_vector(text, scene->look_at);
    case 'u':
        return parse_vector(text, scene->up);
    case 'v':
        scene->fov_y = strtof(text, NULL) * 0.0174532925f;
        return scene->fov_y > 0 && scene->fov_y < 3.1f;
    case 'w':
        return parse_waves(bench, text);
    case 'd':
        return parse_number(text, 0, 32, &bench->depth);
    case 'i':
        return scene->mirrors = true;
    case 'p':
        return bench->plays = true;
    case 'r':
        return parse_number(text, 1, BENCH_RUNS_MAX, &bench->runs);
    default:
        return false;
    }
}

static bool parse(struct bench_ldc *bench, int argc, char **argv)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'}, {"family", 1, NULL, 'f'}, {"sheets", 1, NULL, 'n'},  {"form", 1, NULL, 'o'},
        {"size", 1, NULL, 's'},  {"eye", 1, NULL, 'e'},    {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},   {"waves", 1, NULL, 'w'},  {"depth", 1, NULL, 'd'},   {"mirrors", 0, NULL, 'i'},
        {"play", 0, NULL, 'p'},  {"runs", 1, NULL, 'r'},   {NULL, 0, NULL, 0},
    };
    *bench = (struct bench_ldc){.width = 512, .height = 512, .depth = 1, .runs = 5};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    bench->waves[BENCH_REFLECTION] = true;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;) {
        if (option == '?')
            return false;
        if (!parse_option(bench, option, optarg)) {
            fprintf(stderr, "bench_ldc: no such value: %s\n", optarg ? optarg : "");
            return false;
        }
    }
    const struct bench_scene_options *scene = &bench->scene_options;
    return (scene->model != NULL) + (scene->family_triangles > 0) + (scene->sheets > 0) == 1 &&
           bench->form_count > 0 && optind == argc;
}

/* ---- all ---- */

static void finish(struct bench_ldc *bench)
{
    for (unsigned i = 0; i < bench->form_count; i++) {
        tracer_destroy(bench->forms[i].made);
        free((char *)(uintptr_t)bench->forms[i].name);
    }
    if (!bench->device)
        return;
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

int main(int argc, char **argv)
{
    static json_t *(*const parts[])(struct bench_ldc *, struct error *) = {bench_ldc_builds, bench_ldc_samples,
                                                                           bench_ldc_waves, bench_ldc_frames};
    static const char *const names[] = {"builds", "samples", "waves", "frames"};
    struct bench_ldc bench;
    struct error error = {0};
    unsigned part = 4;
    if (argc == 2 && strcmp(argv[1], "--help") == 0) {
        fputs(usage, stdout);
        return 0;
    }
    if (argc < 2 || !is_word(argv[1], names, 4, &part) || !parse(&bench, argc - 1, argv + 1)) {
        fputs(usage, stderr);
        return 2;
    }
    bench.scene_options.aspect = (float)bench.width / (float)bench.height;
    bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    json_t *forms = NULL;
    if (bench.device && bench_scene_init(&bench.scene, bench.device, &bench.scene_options, &error))
        forms = parts[part](&bench, &error);
    const bool done = forms && print(&bench, forms);
    if (!done)
        fprintf(stderr, "bench_ldc: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    finish(&bench);
    return done ? 0 : 1;
}
