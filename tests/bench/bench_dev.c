/* scratch */
#include "tests/bench/bench.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_waves.h"
#include "trace/quadtree/store.h"
#include "trace/tracer.h"
#include "shared/hit.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
static double cpu(void) { struct timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return (double)t.tv_sec + (double)t.tv_nsec * 1e-9; }
static void die(struct error *e) { fprintf(stderr, "%s: %s\n", e->field, e->text); exit(1); }
static void oracle(struct gpu_device *device, struct gpu_scene *gpu, struct tracer *ref, const float eye[3], const struct ray *r, float t_end)
{
    struct ray q[24]; struct hit h[24]; struct error error = {0}; int count[24] = {0};
    struct gpu_buffer rb = {0}, hb = {0};
    float from[24] = {0};
    for (int pass = 0; pass < 6; pass++) {
        for (int i = 0; i < 24; i++) {
            float t = t_end * ((float)i + 0.5f) / 24;
            q[i].origin_t_min[3] = from[i]; q[i].direction_t_max[3] = 0.9999f;
            for (int k = 0; k < 3; k++) { q[i].origin_t_min[k] = eye[k]; q[i].direction_t_max[k] = r->origin_t_min[k] + t * r->direction_t_max[k] - eye[k]; }
        }
        gpu_buffer_upload(device, &rb, q, sizeof q, &error); gpu_buffer_reserve(device, &hb, sizeof h, &error);
        struct wave wave = {.kind = WAVE_CLOSEST, .ray_count = 24, .rays = &rb, .hits = &hb};
        gpu_scene_bind(gpu);
        tracer_trace(ref, gpu, &wave, &error);
        gpu_buffer_read(device, &hb, 0, h, sizeof h);
        for (int i = 0; i < 24; i++) if (h[i].distance >= 0 && from[i] < 1) { count[i]++; from[i] = h[i].distance * 1.000001f + 1e-6f; } else from[i] = 2;
    }
    printf("    hidden by:"); for (int i = 0; i < 24; i++) printf(" %d", count[i]); printf("\n");
    gpu_buffer_finish(device, &rb); gpu_buffer_finish(device, &hb);
}
BENCH(dev)
{
    struct error error = {0};
    struct gpu_options gpu = {0};
    (void)argc;
    struct gpu_device *device = gpu_device_create(&gpu, &error);
    if (!device) die(&error);
    struct bench_scene_options so = {.model = argv[1], .aspect = 16.f / 9, .fov_y = 0.8727f};
    if (getenv("EYE")) { so.has_eye = true; sscanf(getenv("EYE"), "%f,%f,%f", so.eye, so.eye + 1, so.eye + 2); sscanf(getenv("AT"), "%f,%f,%f", so.look_at, so.look_at + 1, so.look_at + 2); so.up[2] = getenv("ZUP") ? 1 : 0; so.up[1] = getenv("ZUP") ? 0 : 1; }
    struct bench_scene scene;
    if (!bench_scene_init(&scene, device, &so, &error)) die(&error);
    uint32_t w = 320, h = 176, n = w * h;
    struct tracer_options options = {0};
    options.quadtree.layers = getenv("LAYERS") ? (uint32_t)atoi(getenv("LAYERS")) : 3;
    options.quadtree.resolution = getenv("RES") ? (uint32_t)atoi(getenv("RES")) : 1024;
    options.quadtree.hits = getenv("PLANE") ? QUADTREE_HITS_PLANE : 0;
    options.quadtree.walk = getenv("DDA") ? QUADTREE_WALK_DDA : 0;
    options.quadtree.faces = getenv("VIEW") ? QUADTREE_FACES_VIEW : 0;
    options.quadtree.nodes = getenv("MINMAX") ? QUADTREE_NODES_MINMAX : 0;
    if (getenv("E")) options.quadtree.pixels = (float)atof(getenv("E"));
    struct tracer *ref = tracer_create(tracer_impl_by_number(2), device, &(struct tracer_options){0}, &error);
    struct tracer *qt = tracer_create(tracer_impl_by_number(6), device, &options, &error);
    if (!ref || !qt) die(&error);
    struct trace_view view = {.fov_y = scene.camera.fov_y, .width = w, .height = h};
    memcpy(view.world_from_view, scene.camera.world_from_view, sizeof(view.world_from_view));
    struct tracer_update u = {.view = &view};
    double t0 = cpu();
    if (!tracer_update(qt, &scene.gpu, &u, &error)) die(&error);
    double t1 = cpu();
    if (!tracer_update(qt, &scene.gpu, &u, &error)) die(&error);
    if (!tracer_update(ref, &scene.gpu, &u, &error)) die(&error);
    printf("build %.3f s\n", t1 - t0);
    struct ray *rays = calloc(n, sizeof *rays), *second = calloc(n, sizeof *second);
    struct hit *hits = calloc(n, sizeof *hits), *got = calloc(n, sizeof *got);
    bench_camera_rays(rays, &scene.camera, w, h);
    struct gpu_buffer rb = {0}, hb = {0};
    gpu_buffer_upload(device, &rb, rays, n * sizeof *rays, &error);
    gpu_buffer_reserve(device, &hb, n * sizeof *hits, &error);
    struct wave wave = {.kind = WAVE_CLOSEST, .ray_count = n, .rays = &rb, .hits = &hb};
    gpu_scene_bind(&scene.gpu);
    if (!tracer_trace(ref, &scene.gpu, &wave, &error)) die(&error);
    struct hit *primary = calloc(n, sizeof *primary);
    gpu_buffer_read(device, &hb, 0, primary, n * sizeof *hits);
    for (int k = 0; k < 3; k++) {
        static const char *names[] = {"primary", "reflection", "bounce"};
        uint32_t c = n;
        if (k) c = bench_secondary_rays(second, k == 1 ? BENCH_REFLECTION : BENCH_BOUNCE, rays, primary, n, 1, &scene);
        else memcpy(second, rays, n * sizeof *rays);
        gpu_buffer_upload(device, &rb, second, c * sizeof *rays, &error);
        wave.ray_count = c;
        gpu_scene_bind(&scene.gpu);
        if (!tracer_trace(ref, &scene.gpu, &wave, &error)) die(&error);
        gpu_buffer_read(device, &hb, 0, hits, c * sizeof *hits);
        if (!tracer_intersect(qt, &scene.gpu, &wave, &error)) die(&error);
        double a = cpu();
        if (!tracer_intersect(qt, &scene.gpu, &wave, &error)) die(&error);
        double b = cpu();
        gpu_buffer_read(device, &hb, 0, got, c * sizeof *hits);
        qt->options.bench.quadtree_count_steps = 1;
        if (!tracer_intersect(qt, &scene.gpu, &wave, &error)) die(&error);
        qt->options.bench.quadtree_count_steps = 0;
        struct hit *cnt = calloc(n, sizeof *cnt); double ss = 0, ll = 0, mm = 0; float mx = 0;
        gpu_buffer_read(device, &hb, 0, cnt, c * sizeof *cnt);
        for (uint32_t i = 0; i < c; i++) { ss += (double)cnt[i].distance; ll += cnt[i].primitive; mm += cnt[i].instance; if (cnt[i].distance > mx) mx = cnt[i].distance; }
        printf("steps %.1f (max %.0f), layers %.2f, meetings %.2f a ray\n", ss / c, (double)mx, ll / c, mm / c);
        uint32_t known = 0, right = 0, near = 0, far = 0, missed = 0, only = 0, guess = 0, guess_ok = 0, lucky = 0, same_prim = 0, layer[4] = {0}; int shown = 0;
        for (uint32_t i = 0; i < c; i++) {
            uint32_t flags = got[i].material;
            { float e_ = hits[i].distance, g_ = got[i].distance; if ((flags & HIT_UNKNOWN) && (flags & 0x30000000u || g_ < 0) && ((e_ < 0 && g_ < 0) || (e_ >= 0 && g_ >= 0 && fabsf(e_ - g_) <= 1e-4f * scene.gpu.diagonal + 1e-3f * e_))) lucky++; if (flags & HIT_UNKNOWN) { if (getenv("SHOWU") && shown < atoi(getenv("SHOWU"))) { shown++; printf("  unknown %u: o %g %g %g d %g %g %g: got %g (prim %u, layer %u) expected %g (prim %u); first prim %u\n", i, second[i].origin_t_min[0], second[i].origin_t_min[1], second[i].origin_t_min[2], second[i].direction_t_max[0], second[i].direction_t_max[1], second[i].direction_t_max[2], g_, got[i].primitive, flags >> 28 & 3, e_, hits[i].primitive, primary[i].primitive); float eye_[3] = {scene.camera.world_from_view[3], scene.camera.world_from_view[7], scene.camera.world_from_view[11]}; oracle(device, &scene.gpu, ref, eye_, &second[i], e_); } continue; } }
            known++;
            float e = hits[i].distance, g = got[i].distance;
            int ok = (e < 0 && g < 0) || (e >= 0 && g >= 0 && fabsf(e - g) <= 1e-4f * scene.gpu.diagonal + 1e-3f * e);
            right += (uint32_t)ok; if (flags & 0x40000000u) { guess++; guess_ok += (uint32_t)ok; }
            if (ok) { layer[flags >> 28 & 3]++; continue; }
            if (g < 0) missed++; else if (e < 0) only++; else if (g < e) near++; else far++;
            if (got[i].primitive == hits[i].primitive) same_prim++;
            if (getenv("SHOW") && shown < atoi(getenv("SHOW"))) { shown++; printf("  ray %u: o %g %g %g d %g %g %g: got %g (prim %u, layer %u%s) expected %g (prim %u); first prim %u\n", i, second[i].origin_t_min[0], second[i].origin_t_min[1], second[i].origin_t_min[2], second[i].direction_t_max[0], second[i].direction_t_max[1], second[i].direction_t_max[2], g, got[i].primitive, flags >> 28 & 3, flags & 0x40000000u ? " guess" : "", e, hits[i].primitive, primary[i].primitive); }
        }
        printf("%-10s rays %u known %.2f %%; of known: right %.2f %% (layers %u %u %u %u), near %.2f, far %.2f, missed %.2f, only %.2f, same primitive %.2f; guessed %.2f right %.2f; unknown but right %.2f; %.2f Mray/s (cpu)\n", names[k], c, 100. * known / c, 100. * right / known, layer[0], layer[1], layer[2], layer[3], 100. * near / known, 100. * far / known, 100. * missed / known, 100. * only / known, 100. * same_prim / known, 100. * guess / known, 100. * guess_ok / known, 100. * lucky / c, c / (b - a) * 1e-6);
    }
    return 0;
}
