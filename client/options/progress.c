/* SPDX-License-Identifier: MIT */
/* Progress bars and lines. */
#include "progress.h"
#include "talk.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#define BAR_EVERY_NS 100000000ull
#define LINE_EVERY_NS 1000000000ull

#define COLUMNS_UNKNOWN 80

static unsigned columns(void)
{
    struct winsize size = {0};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : COLUMNS_UNKNOWN;
}

void cli_progress_begin(struct cli_progress *progress, const struct cli_talk *talk)
{
    const enum cli_progress_form usual = cli_is_terminal(STDERR_FILENO) ? CLI_PROGRESS_BAR : CLI_PROGRESS_LINES;
    *progress = (struct cli_progress){.form = talk->has_progress ? talk->progress : usual,
                                      .silent = talk->quiet,
                                      .begin_ns = monotonic_now_ns(),
                                      .slope = 0.5};
}

void cli_progress_clear(struct cli_progress *progress)
{
    if (progress->drawn)
        fputs("\r\033[K", stderr);
    progress->drawn = false;
}

void cli_progress_end(struct cli_progress *progress, bool done)
{
    if (done && progress->drawn && progress->total > 0)
        fputc('\n', stderr);
    else
        cli_progress_clear(progress);
    progress->drawn = false;
}

/* True if enough time has passed since the last output. */
static bool is_due(struct cli_progress *progress, bool always)
{
    const uint64_t now = monotonic_now_ns();
    if (!always && now - progress->shown_ns < (progress->form == CLI_PROGRESS_BAR ? BAR_EVERY_NS : LINE_EVERY_NS))
        return false;
    progress->shown_ns = now;
    return true;
}

/* Draws a bar, if `total` is not 0 and there is space for it, and the text, on one line: a line longer than the
 * terminal could not be redrawn in place. */
static void draw(struct cli_progress *progress, uint32_t done, uint32_t total, const char *text)
{
    const unsigned wide = columns(), length = (unsigned)strlen(text);
    const unsigned width = total > 0 && wide > length + 6 ? wide - length - 4 : 0;
    const unsigned filled = total > 0 ? (unsigned)((uint64_t)width * done / total) : 0;
    cli_progress_clear(progress);
    if (width >= 8) {
        fputc('[', stderr);
        for (unsigned i = 0; i < width; i++)
            fputc(i < filled ? '#' : '.', stderr);
        fputs("] ", stderr);
    }
    fprintf(stderr, "%.*s", (int)wide - 1, text);
    progress->drawn = true;
}

/* Shows a text, or a line; `total` 0: the share of the work is unknown. */
static void show(struct cli_progress *progress, uint32_t done, uint32_t total, const char *text)
{
    switch (progress->form) {
    case CLI_PROGRESS_BAR:
        draw(progress, done, total, text);
        return;
    case CLI_PROGRESS_LINES:
        fprintf(stderr, "%s\n", text);
        return;
    case CLI_PROGRESS_OPENJD: /* printed at once, since another program reads it */
        if (total > 0)
            printf("openjd_progress: %.1f\n", 100.0 * done / total);
        printf("openjd_status: %s\n", text);
        fflush(stdout);
        return;
    }
}

/* Shows an import. `what` comes from the importer, which is not trusted: only plain characters are shown. */
void cli_progress_import(struct cli_progress *progress, uint64_t done_bytes, uint64_t total_bytes,
                         const char *what)
{
    if (progress->silent || progress->form != CLI_PROGRESS_BAR || !is_due(progress, false))
        return;
    char plain[41];
    size_t length = 0;
    for (; *what != '\0' && length + 1 < sizeof(plain); what++)
        if (*what >= 0x20 && *what < 0x7f)
            plain[length++] = *what;
    plain[length] = '\0';
    char text[80];
    if (total_bytes > 0)
        snprintf(text, sizeof(text), "%s: %.0f %%", plain, 100.0 * (double)done_bytes / (double)total_bytes);
    else
        snprintf(text, sizeof(text), "%s: %.1f MB", plain, (double)done_bytes * 1e-6);
    draw(progress, 0, 0, text);
}

/* "1:02:03" or "2:03" */
static void print_duration(char *text, size_t text_bytes, double seconds)
{
    const unsigned long whole = (unsigned long)(seconds < 359999999 ? seconds + 0.5 : 359999999);
    if (whole >= 3600)
        snprintf(text, text_bytes, "%lu:%02lu:%02lu", whole / 3600, whole / 60 % 60, whole % 60);
    else
        snprintf(text, text_bytes, "%lu:%02lu", whole / 60, whole % 60);
}

void cli_progress_step(struct cli_progress *progress, uint32_t done, uint32_t total, const char *what)
{
    const uint64_t now = monotonic_now_ns();
    if (progress->silent || (progress->form != CLI_PROGRESS_BAR && now - progress->begin_ns < LINE_EVERY_NS))
        return;
    char text[120];
    snprintf(text, sizeof(text), "%u of %u: %s", done, total, what);
    show(progress, done, total, text);
}

void cli_progress_samples(struct cli_progress *progress, uint32_t held, uint32_t total)
{
    char text[80];
    if (progress->silent || !is_due(progress, held == total))
        return;
    if (total > 0)
        snprintf(text, sizeof(text), "%u of %u samples a pixel", held, total);
    else
        snprintf(text, sizeof(text), "%u sample%s a pixel; Ctrl-C ends it", held, held == 1 ? "" : "s");
    show(progress, held, total, text);
}

/* Estimates the seconds until the error is small enough, or until there are no more samples: the error falls as
 * a power of the time, whose exponent is measured and is -1/2 at first. */
static double noise_left_s(struct cli_progress *progress, const struct cli_noise *noise, double seconds)
{
    const double ratio = (double)noise->error / (double)noise->wanted;
    const double by_samples = seconds * (noise->total - noise->held) / (noise->held > 0 ? noise->held : 1);
    if (progress->error > noise->error && seconds > progress->error_s && progress->error_s > 0)
        progress->slope = log((double)(progress->error / noise->error)) / log(seconds / progress->error_s);
    const double slope = fmin(fmax(progress->slope, 0.25), 2.0);
    if (progress->error != noise->error) {
        progress->error = noise->error;
        progress->error_s = seconds;
    }
    const double by_error = progress->error_s * pow(ratio, 1 / slope) - seconds;
    return fmin(fmax(by_error, 0), by_samples);
}

void cli_progress_noise(struct cli_progress *progress, const struct cli_noise *noise)
{
    const uint64_t now = monotonic_now_ns();
    const bool is_known = noise->error < 1e6f,
               is_last = noise->error <= noise->wanted || noise->held >= noise->total;
    const double seconds = (double)(now - progress->begin_ns) * 1e-9;
    const double left_s = is_known && !is_last ? noise_left_s(progress, noise, seconds) : 0;
    char text[120];
    if (progress->silent || !is_due(progress, is_last))
        return;
    const double percent = (double)noise->error * 100;
    int length = is_known ? snprintf(text, sizeof(text), "error %.*f %%, wanted %.2g %%", percent < 10 ? 1 : 0,
                                     percent, (double)noise->wanted * 100)
                          : snprintf(text, sizeof(text), "%u samples a pixel", noise->held);
    if (is_known && !is_last) {
        length += snprintf(text + length, sizeof(text) - (size_t)length, ", about ");
        print_duration(text + length, sizeof(text) - (size_t)length, left_s);
        strncat(text, " left", sizeof(text) - strlen(text) - 1);
    }
    show(progress, (uint32_t)(1000 * seconds / (seconds + left_s)), is_known ? 1000 : 0, text);
}

/* Resident bytes of a process; 0: it has ended. */
static uint64_t resident_of(const char *process)
{
    char path[64];
    unsigned long long pages = 0;
    snprintf(path, sizeof(path), "/proc/%s/statm", process);
    FILE *file = fopen(path, "re");
    if (file && fscanf(file, "%*u %llu", &pages) != 1)
        pages = 0;
    if (file)
        fclose(file);
    return (uint64_t)pages * (uint64_t)sysconf(_SC_PAGESIZE);
}

static uint64_t resident_bytes(void)
{
    char path[64], child[24];
    uint64_t bytes = resident_of("self");
    snprintf(path, sizeof(path), "/proc/self/task/%d/children", (int)getpid());
    FILE *file = fopen(path, "re");
    while (file && fscanf(file, "%23s", child) == 1)
        bytes += resident_of(child);
    if (file)
        fclose(file);
    return bytes;
}

void cli_progress_frame(struct cli_progress *progress, uint32_t frame, double seconds, const char *path)
{
    if (progress->silent || progress->form == CLI_PROGRESS_BAR)
        return;
    /* The daemon may have ended before the last pictures are written. */
    const uint64_t now_bytes = resident_bytes();
    progress->resident_bytes = now_bytes > progress->resident_bytes ? now_bytes : progress->resident_bytes;
    fprintf(stderr, "frame %u: %.2f s, %.0f MB, ", frame, seconds, (double)progress->resident_bytes * 1e-6);
    plain_text_print(stderr, path);
    fputc('\n', stderr);
}

void cli_progress_frames(struct cli_progress *progress, uint32_t done, uint32_t total)
{
    const uint64_t now = monotonic_now_ns();
    if (progress->total == 0)
        progress->first_ns = now;
    progress->total = total;
    if (progress->silent || !is_due(progress, done == total || done == 1))
        return;
    char numbers[120], left[32] = "";
    const double seconds = (double)(now - progress->first_ns) * 1e-9;
    const double rate = seconds > 0 ? done / seconds : 0;
    if (done > 0 && rate > 0)
        print_duration(left, sizeof(left), (total - done) / rate);
    int length = snprintf(numbers, sizeof(numbers), "%u of %u frames", done, total);
    if (left[0] != '\0')
        snprintf(numbers + length, sizeof(numbers) - (size_t)length, ", %.2f frames/s, %s left", rate, left);
    if (progress->form != CLI_PROGRESS_BAR) {
        show(progress, done, total, numbers);
        return;
    }
    /* The remaining time is more important than the rate. */
    if (left[0] != '\0' && strlen(numbers) >= columns())
        snprintf(numbers + length, sizeof(numbers) - (size_t)length, ", %s left", left);
    if (strlen(numbers) >= columns())
        snprintf(numbers, sizeof(numbers), "%u/%u", done, total);
    draw(progress, done, total, numbers);
}
