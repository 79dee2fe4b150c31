/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_options.h"

#include "tests/bench/bench_stats.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RAYS_MAX ((uint64_t)1 << 24)

bool bench_is_named(const char *list, const char *name)
{
    const size_t length = strlen(name);
    for (const char *at = list; (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (at[length] == '\0' || at[length] == ','))
            return true;
    return false;
}

const char bench_usage[] =
    "usage: bench tracers --model FILE | --family TRIANGLES  [options]\n"
    "  --size WxH            multiples of 8; default 512x512\n"
    "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]   else the model's first camera, or one that sees "
    "all\n"
    "  --waves LIST          of primary,reflection,shadow,refraction,occlusion,bounce,shuffled; default: all but\n"
    "                        refraction\n"
    "  --rays-per-pixel N    of every wave but primary and shuffled; default 1\n"
    "  --tracers LIST        default: all but naive\n"
    "  --runs N              after one warm-up; default 5, at most 64\n"
    "  --quick               of bvh only its own choice, of Embree only 1 ray a call\n"
    "  --device N            which OpenGL device; default: the first hardware, else software\n";

bool bench_parse_vector(const char *text, float v[3])
{
    char rest;
    return sscanf(text, "%f,%f,%f%c", &v[0], &v[1], &v[2], &rest) == 3;
}

bool bench_parse_number(const char *text, uint32_t minimum, uint32_t maximum, uint32_t *value)
{
    char *end;
    unsigned long parsed = strtoul(text, &end, 10);
    *value = (uint32_t)parsed;
    return *text >= '0' && *text <= '9' && *end == '\0' && parsed >= minimum && parsed <= maximum;
}

bool bench_parse_real(const char *text, float *value)
{
    char *end;
    *value = strtof(text, &end);
    return end != text && *end == '\0' && *value > 0;
}

bool bench_parse_word(const char *text, const char *const words[], uint32_t count, uint32_t *found)
{
    for (*found = 0; *found < count; ++*found)
        if (strcmp(text, words[*found]) == 0)
            return true;
    return false;
}

bool bench_parse_size(const char *text, uint32_t *width, uint32_t *height)
{
    char rest;
    return sscanf(text, "%ux%u%c", width, height, &rest) == 2 && *width % 8 == 0 && *height % 8 == 0 &&
           *width >= 8 && *height >= 8 && *width <= 4096 && *height <= 4096;
}

bool bench_parse_waves(const char *text, bool waves[BENCH_WAVE_KINDS])
{
    unsigned found = 0, asked = 1;
    for (const char *at = text; *at; at++)
        asked += *at == ',';
    for (enum bench_wave_kind kind = 0; kind < BENCH_WAVE_KINDS; kind++)
        found += waves[kind] = bench_is_named(text, bench_wave_facts[kind].name);
    return found == asked;
}

bool bench_parse_scene(int option, const char *text, struct bench_scene_options *scene)
{
    char *end;
    switch (option) {
    case 'm':
        scene->model = text;
        return true;
    case 'f':
        return bench_parse_number(text, 1, 50000000, &scene->family_triangles);
    case 'e':
        return scene->has_eye = bench_parse_vector(text, scene->eye);
    case 'l':
        return bench_parse_vector(text, scene->look_at);
    case 'u':
        return bench_parse_vector(text, scene->up);
    case 'v':
        scene->fov_y = strtof(text, &end) * 0.0174532925f;
        return *end == '\0' && scene->fov_y > 0 && scene->fov_y < 3.1f;
    default:
        return false;
    }
}

static bool parse_option(int option, const char *text, struct bench_options *options, struct gpu_options *gpu)
{
    uint32_t number;
    switch (option) {
    case 's':
        return bench_parse_size(text, &options->width, &options->height);
    case 'w':
        return bench_parse_waves(text, options->waves);
    case 'p':
        return bench_parse_number(text, 1, 256, &options->rays_each);
    case 't':
        options->tracers = text;
        return true;
    case 'r':
        return bench_parse_number(text, 1, BENCH_RUNS_MAX, &options->runs);
    case 'q':
        return options->quick = true;
    case 'd':
        gpu->index = bench_parse_number(text, 0, 63, &number) ? (int)number : -1;
        return gpu->index >= 0;
    default:
        return bench_parse_scene(option, text, &options->scene);
    }
}

bool bench_parse(int argc, char **argv, struct bench_options *options, struct gpu_options *gpu)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'},   {"family", 1, NULL, 'f'},  {"size", 1, NULL, 's'},
        {"eye", 1, NULL, 'e'},     {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},     {"waves", 1, NULL, 'w'},   {"rays-per-pixel", 1, NULL, 'p'},
        {"tracers", 1, NULL, 't'}, {"runs", 1, NULL, 'r'},    {"quick", 0, NULL, 'q'},
        {"device", 1, NULL, 'd'},  {NULL, 0, NULL, 0},
    };
    *options = (struct bench_options){.width = 512, .height = 512, .rays_each = 1, .runs = 5};
    options->scene.up[1] = 1;
    options->scene.fov_y = 0.7f;
    memset(options->waves, true, sizeof(options->waves));
    options->waves[BENCH_REFRACTION] = false; /* rays into what is no glass */
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;) {
        if (option == '?')
            return false;
        if (!parse_option(option, optarg, options, gpu)) {
            fprintf(stderr, "bench tracers: no such value: %s\n", optarg ? optarg : "");
            return false;
        }
    }
    if ((options->scene.model != NULL) == (options->scene.family_triangles != 0)) {
        fprintf(stderr, "bench tracers: one of --model and --family is needed\n");
        return false;
    }
    if ((uint64_t)options->width * options->height * options->rays_each > RAYS_MAX) {
        fprintf(stderr, "bench tracers: more than 16 Mi rays a wave\n");
        return false;
    }
    return optind == argc;
}
