/* SPDX-License-Identifier: MIT */
/* The results of comparing the waves of a frame, for people and as JSON. */
#include "wave_table.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* Never rounded up: 100 means all. */
static double percent(const struct record_wave_comparison *wave)
{
    return floor(fl_wave_agreement(wave) * 1e6) / 1e4;
}

static double mrays(uint64_t rays, uint64_t ns)
{
    return ns > 0 ? (double)rays * 1e3 / (double)ns : 0;
}

static struct record_wave_comparison sum_of(const struct fl_frame *frame)
{
    struct record_wave_comparison sum = {0};
    for (size_t i = 0; i < frame->wave_comparison_count; i++)
        fl_wave_add(&sum, &frame->wave_comparisons[i]);
    return sum;
}

double cli_wave_agreement(const struct fl_frame *frame)
{
    const struct record_wave_comparison sum = sum_of(frame);
    return fl_wave_agreement(&sum);
}

/* ---- table ---- */

static void print_name(const struct record_wave_comparison *wave)
{
    printf("  %2u %-10s", wave->wave, protocol_ray_kind_text(wave->kind));
}

static void print_counts(const struct record_wave_comparison *wave)
{
    printf("%11" PRIu64 "%10.4f%11" PRIu64 "%11" PRIu64 "%9" PRIu64 "%8" PRIu64 "%9" PRIu64 "%11.2f%11.2f\n",
           wave->rays, percent(wave), wave->only_tracer, wave->only_reference, wave->far, wave->edges,
           wave->other_surface, mrays(wave->rays, wave->tracer_ns), mrays(wave->rays, wave->reference_ns));
}

static void print_agreement(const struct fl_frame *frame, const char *tracer, const char *reference)
{
    const struct record_wave_comparison sum = sum_of(frame);
    printf("%15s%11s%10s%22s%17s%31s\n", "", "", "", "hit only with", "of these:", "Mray/s of");
    printf("  %-13s%11s%10s%11s%11s%9s%8s%9s%11s%11s\n", "wave of rays", "rays", "agree %", tracer, reference,
           "far", "edges", "surface", tracer, reference);
    for (size_t i = 0; i < frame->wave_comparison_count; i++) {
        print_name(&frame->wave_comparisons[i]);
        print_counts(&frame->wave_comparisons[i]);
    }
    if (frame->wave_comparison_count > 1) {
        printf("  %-13s", "all");
        print_counts(&sum);
    }
}

static void print_error(double error)
{
    if (error == 0)
        printf("%10s", "0");
    else
        printf("%10.1e", error);
}

static void print_errors(const struct fl_frame *frame)
{
    printf("\n%15s%30s%10s%30s\n", "", "distance error, diagonals", "relative", "normal error, degrees");
    printf("  %-13s%10s%10s%10s%10s%10s%10s%10s\n", "wave of rays", "median", "99 %", "max", "median", "median",
           "99 %", "max");
    for (size_t i = 0; i < frame->wave_comparison_count; i++) {
        const struct record_wave_comparison *wave = &frame->wave_comparisons[i];
        if (wave->kind == PROTOCOL_RAY_SHADOW)
            continue; /* has neither */
        print_name(wave);
        print_error((double)wave->distance_median);
        print_error((double)wave->distance_p99);
        print_error((double)wave->distance_max);
        print_error((double)wave->relative_median);
        printf("%10.3f%10.3f%10.3f\n", (double)wave->normal_median, (double)wave->normal_p99,
               (double)wave->normal_max);
    }
}

void cli_print_waves(const struct fl_frame *frame, enum protocol_tracer reference, double far_share)
{
    const char *name = protocol_tracer_text(frame->tracer), *reference_name = protocol_tracer_text(reference);
    print_agreement(frame, name, reference_name);
    print_errors(frame);
    printf(
        "\n"
        "  agree    the same answer: both hit the same surface, both miss, or equally dark shadows; edges aside\n"
        "  far      both hit, at distances that differ by more than %g of the scene's diagonal, or in shadow and\n"
        "           with transmittances that differ by more than 2/255\n"
        "  edges    rays of the three columns before within rounding of an edge: %s itself gives %s's answer\n"
        "           if the ray is moved by a few rounding steps\n"
        "  surface  the same distance, but another surface: normals over 5 degrees apart, or another material or "
        "side\n"
        "  errors are of rays that hit with both, without edges; Mray/s from the call to the complete answer\n",
        far_share, reference_name, name);
}

/* ---- JSON ---- */

static void set(json_t *object, const char *name, uint64_t value)
{
    json_object_set_new(object, name, json_integer((json_int_t)value));
}

static void set_real(json_t *object, const char *name, double value)
{
    json_object_set_new(object, name, json_real(value));
}

static void set_counts(json_t *object, const struct record_wave_comparison *wave)
{
    set(object, "rays", wave->rays);
    set_real(object, "agree", fl_wave_agreement(wave));
    set(object, "both_hit", wave->both_hit);
    set(object, "both_missed", wave->both_missed);
    set(object, "only_tracer", wave->only_tracer);
    set(object, "only_reference", wave->only_reference);
    set(object, "far", wave->far);
    set(object, "edges", wave->edges);
    set(object, "other_surface", wave->other_surface);
    set(object, "tracer_ns", wave->tracer_ns);
    set(object, "reference_ns", wave->reference_ns);
    set_real(object, "tracer_mrays", mrays(wave->rays, wave->tracer_ns));
    set_real(object, "reference_mrays", mrays(wave->rays, wave->reference_ns));
}

static json_t *wave_object(const struct record_wave_comparison *wave)
{
    json_t *object = json_pack("{s:i,s:s}", "wave", (int)wave->wave, "kind", protocol_ray_kind_text(wave->kind));
    set_counts(object, wave);
    if (wave->kind == PROTOCOL_RAY_SHADOW)
        return object;
    set_real(object, "distance_median", (double)wave->distance_median);
    set_real(object, "distance_p99", (double)wave->distance_p99);
    set_real(object, "distance_max", (double)wave->distance_max);
    set_real(object, "relative_median", (double)wave->relative_median);
    set_real(object, "normal_median", (double)wave->normal_median);
    set_real(object, "normal_p99", (double)wave->normal_p99);
    set_real(object, "normal_max", (double)wave->normal_max);
    return object;
}

json_t *cli_waves_json(const struct fl_frame *frame)
{
    json_t *array = json_array();
    for (size_t i = 0; i < frame->wave_comparison_count; i++)
        json_array_append_new(array, wave_object(&frame->wave_comparisons[i]));
    return array;
}

json_t *cli_wave_total_json(const struct fl_frame *frame)
{
    const struct record_wave_comparison sum = sum_of(frame);
    json_t *object = json_object();
    set_counts(object, &sum);
    return object;
}
