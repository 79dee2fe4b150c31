/* SPDX-License-Identifier: MIT */
/* Compares tracers with the reference, and measures dispatches. */
#include "check/tracers.h"

#include "check/first_hits.h"
#include "check/frames.h"
#include "check/scene.h"
#include "gpu/program.h"
#include "gpu/watch.h"
#include "protocol/tracers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Sizes of pictures whose rays are compared, and of those whose dispatches are measured: more work at once on a
 * GPU. */
#define COMPARED_WIDTH 160u
#define COMPARED_HEIGHT 120u
#define TIMED_WIDTH_HARDWARE 1920u
#define TIMED_HEIGHT_HARDWARE 1080u
#define TIMED_WIDTH_SOFTWARE 128u
#define TIMED_HEIGHT_SOFTWARE 96u
/* Minimum number of hits in a wave for its median to be meaningful. */
#define HITS_MIN 200u
/* Maximum of a dispatch: a cancel must be answered within this time, and a driver ends the process of a
 * dispatch of some seconds. */
#define DISPATCH_NS_MAX UINT64_C(50000000)

/* Requirements for a tracer. Exact ones: shares of the rays that are on no edge, and distances within some
 * roundings of a float's 24 bits. Sampled ones: shares of all rays for which both hit or both miss, and
 * distances in cells. The figures are those of the accuracy tests. */
struct promise {
    bool samples;
    double agree_min, median_max;
};

static const struct promise *promise_of(unsigned tracer)
{
    static const struct promise exact = {false, 0.9999, 1e-6}, ldc = {true, 0.99, 0.25},
                                abuffer = {true, 0.995, 0.1};
    /* Distances are exact, but texels decide which surface is met, and some rays reach unknown space. */
    static const struct promise quadtree = {false, 0.99, 1e-6};
    return tracer == TRACER_LDC        ? &ldc
           : tracer == TRACER_ABUFFER  ? &abuffer
           : tracer == TRACER_QUADTREE ? &quadtree
                                       : &exact;
}

static const unsigned tracers[] = {
#define TRACER(NAME, name, number, use, needs, doc) number,
#include "protocol/tracers.def"
};

static const char *tracer_name(unsigned tracer)
{
    switch (tracer) {
#define TRACER(NAME, name, number, use, needs, doc)                                                               \
    case number:                                                                                                  \
        return #name;
#include "protocol/tracers.def"
    }
    return "";
}

struct checking {
    struct check_report *report;
    struct check_frames frames;
    struct longest {
        uint64_t ns;
        unsigned program; /* its GL name */
    } longest[2];         /* dispatch of all tracers but brute force; of brute force */
};

/* ---- rays ---- */

struct agreement {
    uint64_t rays, agreed, edges;
    double median; /* median of the worst wave, in the units of the requirement */
};

static struct agreement agreement_of(const struct frame_result *result, bool samples, double cells_a_diagonal)
{
    struct agreement sum = {0};
    for (uint32_t i = 0; i < result->comparison_count; i++) {
        const struct record_wave_comparison *wave = &result->comparisons[i];
        const uint64_t differ = wave->only_tracer + wave->only_reference + (samples ? 0 : wave->far);
        const double median =
            samples ? (double)wave->distance_median * cells_a_diagonal : (double)wave->relative_median;
        sum.rays += wave->rays;
        sum.agreed += wave->rays - differ + (samples ? 0 : wave->edges);
        sum.edges += wave->edges;
        if (wave->kind != RAY_SHADOW && wave->both_hit >= HITS_MIN && median > sum.median)
            sum.median = median;
    }
    return sum;
}

static void report_agreement(struct check_report *report, const char *tracer, const struct agreement *found,
                             const struct promise *asked)
{
    const double agree = found->rays ? (double)found->agreed / (double)found->rays : 0;
    const bool good = agree >= asked->agree_min && found->median <= asked->median_max;
    check_report_row(report,
                     &(struct check_row){.verdict = good ? CHECK_OK : CHECK_FAILED,
                                         .check = "rays",
                                         .name = tracer,
                                         .unit = "%",
                                         .value = 100 * agree,
                                         .bound = 100 * asked->agree_min,
                                         .remedy = "do not trust pictures of this tracer on this device; "
                                                   "report the driver's version"},
                     "%.3f %% of %llu agree, %.2f %% needed; distances differ by %.2g %s, at most %.2g",
                     100 * agree, (unsigned long long)found->rays, 100 * asked->agree_min, found->median,
                     asked->samples ? "cells" : "of their length", asked->median_max);
}

static double cells_a_diagonal(const struct scene *scene)
{
    float lower[3], upper[3];
    double longest = 0, squares = 0;
    if (!scene_bounds(scene, NULL, lower, upper))
        return 0;
    for (int k = 0; k < 3; k++) {
        const double side = (double)upper[k] - (double)lower[k];
        longest = side > longest ? side : longest;
        squares += side * side;
    }
    return sqrt(squares) / longest * CHECK_CELLS;
}

static unsigned reference_tracer(void)
{
    return tracer_impl_by_number(TRACER_REFERENCE) ? TRACER_REFERENCE : TRACER_NAIVE;
}

/* Request whose rays begin at exact hits: a ray from one that lies a part of a cell off a surface may meet that
 * again. */
static struct frame_request compared_request(unsigned tracer, bool samples)
{
    struct frame_request request =
        check_request(samples ? reference_tracer() : tracer, COMPARED_WIDTH, COMPARED_HEIGHT);
    request.comparison.compare = true;
    request.comparison.compare_with = samples ? tracer : reference_tracer();
    return request;
}

bool check_rays(struct check_report *report, struct check_frames *frames, unsigned tracer)
{
    const char *name = tracer_name(tracer);
    const struct promise *asked = promise_of(tracer);
    const struct frame_request request = compared_request(tracer, asked->samples);
    struct frame_result result;
    struct error error = {0};
    bool rendered = check_frame(frames, &request, &result, &error);
    if (rendered) {
        const struct agreement found = agreement_of(&result, asked->samples, cells_a_diagonal(frames->scene));
        report_agreement(report, name, &found, asked);
    } else {
        check_report_error(report, "rays", name, &error);
    }
    frame_result_finish(&result);
    return rendered;
}

/* ---- pictures ---- */

/* Renders a frame whose dispatches are measured. */
static bool watched_frame(struct checking *checking, const struct frame_request *request,
                          struct frame_result *result, struct error *error)
{
    struct gpu_watch watch;
    gpu_watch_begin(checking->frames.device, &watch);
    bool rendered = check_frame(&checking->frames, request, result, error);
    gpu_watch_end(checking->frames.device);
    struct longest *longest = &checking->longest[request->tracing.tracer == TRACER_NAIVE];
    if (watch.longest_ns > longest->ns)
        *longest = (struct longest){watch.longest_ns, watch.longest_program};
    return rendered;
}

static struct frame_request timed_request(const struct checking *checking, unsigned tracer)
{
    const bool software = checking->frames.device->info.software;
    return check_request(tracer, software ? TIMED_WIDTH_SOFTWARE : TIMED_WIDTH_HARDWARE,
                         software ? TIMED_HEIGHT_SOFTWARE : TIMED_HEIGHT_HARDWARE);
}

/* Renders the same request twice: the first time compiles, and the second measures the dispatches. */
static void render_twice(struct checking *checking, const struct frame_request *request, const char *name)
{
    struct frame_result first, second = {0};
    struct error error = {0};
    bool rendered = check_frame(&checking->frames, request, &first, &error) &&
                    watched_frame(checking, request, &second, &error);
    const uint64_t trace_ns = stage_times_sum_ns(&second.times, STAGE_TRACE, CLOCK_GPU);
    if (!rendered) {
        check_report_error(checking->report, "picture", name, &error);
    } else {
        const bool same =
            first.size_bytes == second.size_bytes && memcmp(first.pixels, second.pixels, first.size_bytes) == 0;
        check_report_row(checking->report,
                         &(struct check_row){.verdict = same ? CHECK_OK : CHECK_FAILED,
                                             .check = "picture",
                                             .name = name,
                                             .unit = "ms",
                                             .value = (double)trace_ns * 1e-6,
                                             .bound = NAN,
                                             .remedy = "report the driver's version: the same request must give "
                                                       "the same bytes"},
                         "%s; %.1f ms of tracing", same ? "twice the same bytes" : "differs from frame to frame",
                         (double)trace_ns * 1e-6);
    }
    frame_result_finish(&first);
    frame_result_finish(&second);
}

static void check_tracer(struct checking *checking, unsigned tracer)
{
    const struct check_row noted = {.verdict = CHECK_NOTE, .check = "rays", .name = tracer_name(tracer)};
    if (!tracer_impl_by_number(tracer)) {
        check_report_row(checking->report, &noted, "not in this build");
        return;
    }
    if (tracer == reference_tracer())
        check_report_row(checking->report, &noted, "the others are compared with it");
    else if (!check_rays(checking->report, &checking->frames, tracer))
        return;
    const struct frame_request request = timed_request(checking, tracer);
    render_twice(checking, &request, tracer_name(tracer));
}

static void check_integrators(struct checking *checking)
{
    static const struct {
        const char *name;
        enum integrator_kind number;
    } rows[] = {{"distributed", INTEGRATOR_DISTRIBUTED},
                {"path", INTEGRATOR_PATH},
                {"raycast", INTEGRATOR_RAYCAST},
                {"ao", INTEGRATOR_AO}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct frame_request request = timed_request(checking, TRACER_BVH);
        request.light.integrator = rows[i].number;
        request.sampling.samples = 2;
        request.aperture = rows[i].number == INTEGRATOR_DISTRIBUTED ? 0.05f : 0.0f;
        render_twice(checking, &request, rows[i].name);
    }
    struct frame_request layers = timed_request(checking, TRACER_BVH);
    layers.picture.layers = (1u << (LAYER_CRYPTO_MATERIAL2 + 1)) - 1;
    render_twice(checking, &layers, "all layers");
}

/* ---- results over all tracers ---- */

static void report_ways(struct check_report *report, struct gpu_device *device, const struct first_hits *measured)
{
    static const char *const sample_texts[] = {"of one sample a pixel", "of several samples a pixel, each"};
    const struct gpu_measured limits = first_hits_limits(measured);
    (void)first_hits_keep(device, measured); /* spares the next start the measurement */
    for (int several = 0; several < 2; several++) {
        char choice[96] = "rasterised";
        if (device->measured.known)
            snprintf(choice, sizeof(choice), "traced from %.3g primitives a pixel on",
                     (double)device->measured.traced_from[several]);
        check_report_row(report,
                         &(struct check_row){.verdict = CHECK_NOTE,
                                             .check = "first hits",
                                             .name = sample_texts[several],
                                             .unit = "primitives a pixel",
                                             .value = limits.known ? (double)limits.traced_from[several] : NAN,
                                             .bound = NAN},
                         "rasterised in %.2f ms, traced in %.2f ms; %s",
                         (double)measured->ns[several][FIRST_HITS_RASTERISED] * 1e-6,
                         (double)measured->ns[several][FIRST_HITS_TRACED] * 1e-6, choice);
    }
}

static void check_first_hits(struct checking *checking)
{
    struct gpu_device *device = checking->frames.device;
    struct first_hits measured;
    struct error error = {0};
    if (!first_hits_measure(device, &measured, &error)) {
        check_report_error(checking->report, "first hits", "rasterised and traced", &error);
        return;
    }
    /* Along edges, rounding may decide for another surface. */
    const double agree_min = 0.998;
    check_report_row(checking->report,
                     &(struct check_row){.verdict = measured.agree >= agree_min ? CHECK_OK : CHECK_FAILED,
                                         .check = "first hits",
                                         .name = "rasterised and traced",
                                         .unit = "%",
                                         .value = 100 * measured.agree,
                                         .bound = 100 * agree_min},
                     "%.3f %% of the pixels agree, %.1f %% needed", 100 * measured.agree, 100 * agree_min);
    report_ways(checking->report, device, &measured);
    check_report_row(checking->report,
                     &(struct check_row){.verdict = CHECK_NOTE,
                                         .check = "nodes",
                                         .name = "of bvh",
                                         .unit = "of the time of links",
                                         .value = measured.links_ns > 0
                                                      ? (double)measured.eight_ns / (double)measured.links_ns
                                                      : NAN,
                                         .bound = NAN},
                     "bounces and occlusion by links in %.2f ms, by nodes of eight in %.2f ms; %s",
                     (double)measured.links_ns * 1e-6, (double)measured.eight_ns * 1e-6,
                     device->measured.nodes_of_eight ? "nodes of eight" : "links");
}

static const char *program_key(const struct gpu_device *device, unsigned name)
{
    struct gpu_program_stat stat;
    for (size_t i = 0; gpu_program_stat(device, i, &stat); i++)
        if (stat.name == name)
            return stat.key;
    return "none";
}

/* Reports dispatches. Those of software GL share the processor with everything else that runs: no requirement
 * applies. */
static void report_dispatch(const struct checking *checking, const char *name, const struct longest *longest)
{
    const struct gpu_device *device = checking->frames.device;
    const bool asked = !device->info.software && device->facts.time_stamp_bits > 0;
    const bool good = longest->ns <= DISPATCH_NS_MAX;
    check_report_row(checking->report,
                     &(struct check_row){.verdict = !asked ? CHECK_NOTE
                                                    : good ? CHECK_OK
                                                           : CHECK_FAILED,
                                         .check = "dispatch",
                                         .name = name,
                                         .unit = "ms",
                                         .value = (double)longest->ns * 1e-6,
                                         .bound = asked ? (double)DISPATCH_NS_MAX * 1e-6 : NAN,
                                         .remedy = "expect slow answers to cancels on this device"},
                     "%.2f ms%s, in %s", (double)longest->ns * 1e-6, asked ? ", at most 50 ms" : "",
                     program_key(device, longest->program));
}

void check_tracers(struct check_report *report, struct gpu_device *device)
{
    struct checking checking = {.report = report};
    struct error error = {0};
    if (!check_frames_init(&checking.frames, device, check_scene_small(&error), &error)) {
        check_report_error(report, "rays", "the scene", &error);
        return;
    }
    for (size_t i = 0; i < sizeof(tracers) / sizeof(tracers[0]) && !device->lost; i++)
        check_tracer(&checking, tracers[i]);
    if (!device->lost)
        check_integrators(&checking);
    if (!device->lost)
        check_first_hits(&checking);
    report_dispatch(&checking, "the longest", &checking.longest[0]);
    report_dispatch(&checking, "the longest of brute force (naive)", &checking.longest[1]);
    check_frames_finish(&checking.frames);
}
