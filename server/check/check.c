/* SPDX-License-Identifier: MIT */
/* The device check: all checks in order; those that need no frame are here. */
#include "check/check.h"

#include "base/host.h"
#include "check/tracers.h"
#include "gpu/buffer.h"
#include "gpu/program.h"

#include <math.h>
#include <stdlib.h>

#define WRITTEN_BYTES ((size_t)64 << 20)

static void add_line(struct check_report *report, const char *check, const char *name, const char *text)
{
    check_report_row(report, &(struct check_row){.verdict = CHECK_NOTE, .check = check, .name = name}, "%s", text);
}

static void report_facts(struct check_report *report, const struct gpu_device *device)
{
    const struct gpu_facts *facts = &device->facts;
    check_report_row(report, &(struct check_row){.verdict = CHECK_OK, .check = "device", .name = "is opened"},
                     "number %d, OpenGL 4.5 core over EGL without a window system", device->info.index);
    add_line(report, "device", "renderer", device->info.name);
    add_line(report, "device", "vendor", device->info.vendor);
    add_line(report, "device", "version", device->info.version);
    add_line(report, "device", "kind",
             device->info.software ? "software: measures say nothing of a GPU" : "hardware");
    add_line(report, "extension", "loss of the context",
             facts->robust ? "is told" : "is not told: a reset ends the daemon or hangs it");
    add_line(report, "extension", "binaries of programs",
             facts->has_program_binary ? "are kept between starts" : "there are none: each start compiles");
    add_line(report, "extension", "time stamps",
             facts->time_stamp_bits ? "are there" : "there are none: steps on the device have no measured length");
}

static void report_limits(struct check_report *report, const struct gpu_device *device)
{
    for (int i = 0; i < GPU_LIMIT_COUNT; i++) {
        const struct gpu_limit_row *row = &gpu_limit_rows[i];
        const uint64_t value = device->facts.limits[i];
        check_report_row(report,
                         &(struct check_row){.verdict = value >= row->needed ? CHECK_OK : CHECK_FAILED,
                                             .check = "limit",
                                             .name = row->noun,
                                             .unit = "",
                                             .value = (double)value,
                                             .bound = (double)row->needed},
                         "%llu, %llu needed", (unsigned long long)value, (unsigned long long)row->needed);
    }
}

/* ---- memory ---- */

static double mebibytes(uint64_t bytes)
{
    return (double)bytes / (1 << 20);
}

static void report_memory(struct check_report *report, const struct gpu_device *device, bool is_configured)
{
    const struct gpu_memory *memory = &device->facts.memory;
    check_report_row(report,
                     &(struct check_row){.verdict = CHECK_NOTE,
                                         .check = "memory",
                                         .name = "of the device",
                                         .unit = "MiB",
                                         .value = memory->bytes ? mebibytes(memory->bytes) : NAN,
                                         .bound = NAN},
                     "%.0f MiB, %s", mebibytes(memory->bytes), gpu_memory_source_text(memory->source));
    const bool fits = !memory->bytes || device->memory_limit_bytes <= memory->bytes;
    check_report_row(report,
                     &(struct check_row){.verdict = fits ? CHECK_OK : CHECK_FAILED,
                                         .check = "memory",
                                         .name = "limit",
                                         .unit = "MiB",
                                         .value = mebibytes(device->memory_limit_bytes),
                                         .bound = memory->bytes ? mebibytes(memory->bytes) : NAN,
                                         .remedy = "set memory.device of the configuration to less"},
                     "%.0f MiB, %s", mebibytes(device->memory_limit_bytes),
                     is_configured ? "from memory.device" : "by default; memory.device changes it");
}

static void check_refusal(struct check_report *report, struct gpu_device *device)
{
    struct gpu_buffer buffer = {0};
    struct error error = {0};
    const uint64_t beyond = device->memory_limit_bytes - device->memory_used_bytes + 1;
    const bool refused = !gpu_buffer_reserve(device, &buffer, beyond, &error) && error.kind == ERROR_OUT_OF_MEMORY;
    gpu_buffer_finish(device, &buffer);
    check_report_row(report,
                     &(struct check_row){.verdict = refused ? CHECK_OK : CHECK_FAILED,
                                         .check = "memory",
                                         .name = "a byte beyond the limit"},
                     "%s", refused ? "is refused" : "was not refused");
}

static void check_writing(struct check_report *report, struct gpu_device *device)
{
    static const uint32_t written = 0x5eed1234;
    struct gpu_buffer buffer = {0};
    struct error error = {0};
    uint32_t back = 0;
    if (gpu_buffer_reserve(device, &buffer, WRITTEN_BYTES, &error)) {
        gpu_buffer_clear(device, &buffer, written);
        gpu_buffer_read(device, &buffer, WRITTEN_BYTES - sizeof(back), &back, sizeof(back));
        gpu_check(device, "writing to a buffer", &error);
    }
    gpu_buffer_finish(device, &buffer);
    if (error.kind != ERROR_NONE)
        check_report_error(report, "memory", "64 MiB are written and read", &error);
    else
        check_report_row(report,
                         &(struct check_row){.verdict = back == written ? CHECK_OK : CHECK_FAILED,
                                             .check = "memory",
                                             .name = "64 MiB are written and read"},
                         "%s", back == written ? "as they were written" : "not as they were written");
}

/* ---- programs ---- */

static int slowest_first(const void *a, const void *b)
{
    const struct gpu_program_stat *one = a, *other = b;
    return (one->build_ns < other->build_ns) - (one->build_ns > other->build_ns);
}

/* A failure to compile a program is reported by the check that needed it. */
static void report_programs(struct check_report *report, const struct gpu_device *device)
{
    static struct gpu_program_stat stats[512];
    size_t count = 0;
    uint64_t sum_ns = 0;
    while (count < sizeof(stats) / sizeof(stats[0]) && gpu_program_stat(device, count, &stats[count]))
        sum_ns += stats[count++].build_ns;
    qsort(stats, count, sizeof(stats[0]), slowest_first);
    for (size_t i = 0; i < count; i++)
        check_report_row(report,
                         &(struct check_row){.verdict = CHECK_OK,
                                             .check = "program",
                                             .name = stats[i].key,
                                             .unit = "ms",
                                             .value = (double)stats[i].build_ns * 1e-6,
                                             .bound = NAN},
                         "compiled in %.1f ms", (double)stats[i].build_ns * 1e-6);
    check_report_row(report,
                     &(struct check_row){.verdict = count > 0 ? CHECK_OK : CHECK_FAILED,
                                         .check = "program",
                                         .name = "all of them",
                                         .unit = "ms",
                                         .value = (double)sum_ns * 1e-6,
                                         .bound = NAN},
                     "%zu compiled in %.1f s", count, (double)sum_ns * 1e-9);
}

/* ---- order ---- */

static void check_all(struct check_report *report, struct gpu_device *device, bool limit_is_configured)
{
    report_facts(report, device);
    report_limits(report, device);
    report_memory(report, device, limit_is_configured);
    check_refusal(report, device);
    check_writing(report, device);
    check_tracers(report, device);
    report_programs(report, device);
}

enum check_outcome check_device(const struct check_options *options)
{
    struct check_report report = {.stream = options->stream, .json = options->json};
    struct gpu_options gpu = options->gpu;
    struct error error = {0};
    gpu.compiles = true;
    struct gpu_device *device = gpu_device_create(&gpu, &error);
    if (!device) {
        check_report_error(&report, "device", "is opened", &error);
    } else {
        device->memory_limit_bytes = options->device_bytes_limit
                                         ? options->device_bytes_limit
                                         : gpu_memory_default_limit(&device->facts.memory, host_memory_bytes());
        check_all(&report, device, options->device_bytes_limit > 0);
    }
    const bool lost = device && device->lost;
    gpu_device_destroy(device);
    const bool told = check_report_end(&report);
    return lost ? CHECK_DEVICE_LOST : report.failed > 0 || !told ? CHECK_SOME_FAIL : CHECK_ALL_HOLDS;
}
