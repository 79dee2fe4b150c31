/* SPDX-License-Identifier: MIT */
/* Tracers with options, their forms, beside each other on one scene. Prints one JSON object: {"scene",
 * "triangles", "spheres", "diagonal", "width", "height", "device", "software", "forms": [..]}; what a form's
 * object has, the parts say. `bench forms --help` has the options. The forms take turns, run by run. Exit status:
 * 1 failed, 2 usage.
 */
#include "tests/bench/bench.h"
#include "tests/bench/bench_forms.h"
#include "tests/bench/bench_options.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "usage: bench forms builds|samples|waves|frames  --model FILE | --family TRIANGLES | --sheets N\n"
    "                 --form FORM .. [options]\n"
    "  builds: what making a structure takes; samples: making those of ldc, and not what leads over emptiness;\n"
    "  waves: rays of them, and how far answers are from the reference;\n"
    "  frames: whole pictures, and how far they are from the reference's\n"
    "  --form TRACER[:KEY=VALUE,..]   bvh, reference, ldc, abuffer, and of the benchmark's own svo-cells, "
    "svo-planes\n"
    "                        of ldc: resolution, block, build (auto peel lists), levels (auto blocks pyramid "
    "cells),\n"
    "                        images (overlap one), tolerance (metres), rays, layers (together);\n"
    "                        of abuffer: resolution, voxels, search (auto dda linear3 linear1 voxels3 voxels1 "
    "parity3 parity1); of svo: "
    "resolution;\n"
    "                        of all: ao (rays a pixel, of frames)\n"
    "  --size WxH            multiples of 8; default 512x512\n"
    "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]   else the model's first camera, or one that sees "
    "all\n"
    "  --waves LIST          of primary,reflection,refraction,shadow,occlusion,bounce,shuffled; default: "
    "reflection\n"
    "  --rays-each N         of waves: for each camera ray that hits; default 1\n"
    "  --integrator NAME     of frames: whitted, ao; --ao-rays N a pixel, default 8\n"
    "  --depth N             of frames: bounces, default 1\n"
    "  --mirrors | --glass   everything becomes a mirror, or glass\n"
    "  --play                of frames: the model's first clip, 0.1 s further each run\n"
    "  --once                of frames: one run without a warm-up, for what it shows\n"
    "  --runs N              after one warm-up; default 5, at most 64\n";

/* ---- JSON ---- */

json_t *bench_structure_json(const struct structure_rows *rows)
{
    json_t *object = json_object();
    for (uint32_t i = 0; i < rows->count; i++) {
        const struct structure_row *row = &rows->rows[i];
        json_object_set_new(object, row->name,
                            row->unit == UNIT_METRES ? json_real((double)row->measure)
                                                     : json_integer((json_int_t)row->number));
    }
    return object;
}

static bool print(const struct bench_forms *bench, json_t *forms)
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

static bool parse_option(struct bench_forms *bench, int option, char *text)
{
    static const char *const integrators[] = {"whitted", "distributed", "raycast", "ao", "path"};
    struct bench_scene_options *scene = &bench->scene_options;
    unsigned word;
    switch (option) {
    case 'n':
        return bench_parse_number(text, 1, 200, &scene->sheets);
    case 'o':
        return bench->form_count < BENCH_FORMS_MAX && bench_form_parse(&bench->forms[bench->form_count++], text);
    case 's':
        return bench_parse_size(text, &bench->width, &bench->height);
    case 'w':
        return bench_parse_waves(text, bench->waves);
    case 'd':
        return bench_parse_number(text, 0, 32, &bench->depth);
    case 'k':
        return bench_parse_number(text, 1, 64, &bench->rays_each);
    case 't':
        if (!bench_parse_word(text, integrators, sizeof(integrators) / sizeof(*integrators), &word))
            return false;
        bench->integrator = word;
        return true;
    case 'a':
        return bench_parse_number(text, 1, 4096, &bench->ao_rays);
    case 'i':
        return scene->mirrors = true;
    case 'g':
        return scene->glass = true;
    case 'p':
        return bench->plays = true;
    case '1':
        bench->runs = 1;
        return bench->once = true;
    case 'r':
        return bench_parse_number(text, 1, BENCH_RUNS_MAX, &bench->runs);
    default:
        return bench_parse_scene(option, text, scene);
    }
}

static bool parse(struct bench_forms *bench, int argc, char **argv)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'},     {"family", 1, NULL, 'f'},     {"sheets", 1, NULL, 'n'},
        {"form", 1, NULL, 'o'},      {"size", 1, NULL, 's'},       {"eye", 1, NULL, 'e'},
        {"look-at", 1, NULL, 'l'},   {"up", 1, NULL, 'u'},         {"fov", 1, NULL, 'v'},
        {"waves", 1, NULL, 'w'},     {"depth", 1, NULL, 'd'},      {"mirrors", 0, NULL, 'i'},
        {"glass", 0, NULL, 'g'},     {"play", 0, NULL, 'p'},       {"runs", 1, NULL, 'r'},
        {"rays-each", 1, NULL, 'k'}, {"integrator", 1, NULL, 't'}, {"ao-rays", 1, NULL, 'a'},
        {"once", 0, NULL, '1'},      {NULL, 0, NULL, 0},
    };
    *bench =
        (struct bench_forms){.width = 512, .height = 512, .depth = 1, .rays_each = 1, .ao_rays = 8, .runs = 5};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    bench->waves[BENCH_REFLECTION] = true;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;) {
        if (option == '?')
            return false;
        if (!parse_option(bench, option, optarg)) {
            fprintf(stderr, "bench forms: no such value: %s\n", optarg ? optarg : "");
            return false;
        }
    }
    const struct bench_scene_options *scene = &bench->scene_options;
    return (scene->model != NULL) + (scene->family_triangles > 0) + (scene->sheets > 0) == 1 &&
           !(scene->mirrors && scene->glass) && bench->form_count > 0 && optind == argc;
}

/* ---- all ---- */

static void finish(struct bench_forms *bench)
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

BENCH(forms)
{
    static json_t *(*const parts[])(struct bench_forms *, struct error *) = {
        bench_forms_builds, bench_forms_samples, bench_forms_waves, bench_forms_frames};
    static const char *const names[] = {"builds", "samples", "waves", "frames"};
    struct bench_forms bench;
    struct error error = {0};
    unsigned part = 4;
    if (argc == 2 && strcmp(argv[1], "--help") == 0) {
        fputs(usage, stdout);
        return 0;
    }
    if (argc < 2 || !bench_parse_word(argv[1], names, 4, &part) || !parse(&bench, argc - 1, argv + 1)) {
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
        fprintf(stderr, "bench forms: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    finish(&bench);
    return done ? 0 : 1;
}
