/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#define BAR_EVERY_NS 100000000ull
#define LINE_EVERY_NS 1000000000ull

static unsigned columns(void)
{
    struct winsize size = {0};
    return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 80;
}

void cli_progress_begin(struct cli_progress *progress, bool silent)
{
    *progress = (struct cli_progress){
        .silent = silent, .bar = cli_is_terminal(STDERR_FILENO), .begin_ns = monotonic_now_ns()};
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

/* Whether enough time has passed since the last output. */
static bool is_due(struct cli_progress *progress, bool always)
{
    const uint64_t now = monotonic_now_ns();
    if (!always && now - progress->shown_ns < (progress->bar ? BAR_EVERY_NS : LINE_EVERY_NS))
        return false;
    progress->shown_ns = now;
    return true;
}

/* `what` comes from our importer, which is not trusted: only plain characters are shown. */
void cli_progress_import(struct cli_progress *progress, uint64_t done_bytes, uint64_t total_bytes,
                         const char *what)
{
    if (progress->silent || !progress->bar || !is_due(progress, false))
        return;
    char plain[41];
    size_t length = 0;
    for (; *what != '\0' && length + 1 < sizeof(plain); what++)
        if (*what >= 0x20 && *what < 0x7f)
            plain[length++] = *what;
    plain[length] = '\0';
    cli_progress_clear(progress);
    if (total_bytes > 0)
        fprintf(stderr, "%s: %.0f %%", plain, 100.0 * (double)done_bytes / (double)total_bytes);
    else
        fprintf(stderr, "%s: %.1f MB", plain, (double)done_bytes * 1e-6);
    progress->drawn = true;
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

static void draw_bar(uint32_t done, uint32_t total, const char *numbers, size_t numbers_length)
{
    const unsigned wide = columns();
    const unsigned width = wide > numbers_length + 6 ? wide - (unsigned)numbers_length - 4 : 0;
    const unsigned filled = total > 0 ? (unsigned)((uint64_t)width * done / total) : 0;
    if (width >= 8) {
        fputc('[', stderr);
        for (unsigned i = 0; i < width; i++)
            fputc(i < filled ? '#' : '.', stderr);
        fputs("] ", stderr);
    }
    fputs(numbers, stderr);
}

void cli_progress_step(struct cli_progress *progress, uint32_t done, uint32_t total, const char *what)
{
    const uint64_t now = monotonic_now_ns();
    if (progress->silent || (!progress->bar && now - progress->begin_ns < LINE_EVERY_NS))
        return;
    char text[120];
    int length = snprintf(text, sizeof(text), "%u of %u: %s", done, total, what);
    if (!progress->bar) {
        fprintf(stderr, "%s\n", text);
        return;
    }
    cli_progress_clear(progress);
    draw_bar(done, total, text, length > 0 && length < (int)sizeof(text) ? (size_t)length : sizeof(text) - 1);
    progress->drawn = true;
}

void cli_progress_samples(struct cli_progress *progress, uint32_t held, uint32_t total)
{
    char text[80];
    if (progress->silent || !is_due(progress, held == total))
        return;
    int length = 0;
    if (total > 0)
        length = snprintf(text, sizeof(text), "%u of %u samples a pixel", held, total);
    else
        length = snprintf(text, sizeof(text), "%u sample%s a pixel; Ctrl-C ends it", held, held == 1 ? "" : "s");
    if (!progress->bar) {
        fprintf(stderr, "%s\n", text);
        return;
    }
    cli_progress_clear(progress);
    if (total > 0)
        draw_bar(held, total, text, (size_t)length);
    else
        fputs(text, stderr);
    progress->drawn = true;
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
        length +=
            snprintf(numbers + length, sizeof(numbers) - (size_t)length, ", %.2f frames/s, %s left", rate, left);
    if (!progress->bar) {
        fprintf(stderr, "%s\n", numbers);
        return;
    }
    cli_progress_clear(progress);
    draw_bar(done, total, numbers, (size_t)length);
    progress->drawn = true;
}
