/* SPDX-License-Identifier: MIT */
/* fl_compare against an image program that fails, hangs or lies; scripts stand in for it. What the real one finds
 * is tested by tests/integration/test_compare.py. */
#include <stddef.h>
#include <stdint.h>

#include "lib/farlight.h"
#include "protocol/framing.h"
#include "tests/harness/test.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static struct fl_error error;
static struct fl_comparison comparison;
static char folder[64], script[96], answer[96];

static void write_file(const char *path, const void *bytes, size_t count, mode_t mode)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, count, file), count);
    fclose(file);
    assert_int_equal(chmod(path, mode), 0);
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof(folder), "%s/farlight-compare-XXXXXX", P_tmpdir);
    if (!mkdtemp(folder))
        return -1;
    snprintf(script, sizeof(script), "%s/farlight-export", folder);
    snprintf(answer, sizeof(answer), "%s/answer", folder);
    return setenv("FARLIGHT_LIBEXEC", folder, 1);
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(script);
    unlink(answer);
    return rmdir(folder);
}

static bool compare_with(const char *text, unsigned timeout_ms)
{
    write_file(script, text, strlen(text), 0700);
    error = (struct fl_error){0};
    return fl_compare(&(struct fl_compare_options){.a = "a.png", .b = "b.png", .timeout_ms = timeout_ms},
                      &comparison, &error);
}

static void check_error(enum fl_error_code code, const char *part)
{
    if (error.code != code || !strstr(error.text, part))
        fail_msg("error %d '%s' in place of %d '%s'", (int)error.code, error.text, (int)code, part);
}

/* Runs a program that answers with these figures, whatever it is asked. */
static bool compare_answered(const struct message_images_compared *figures)
{
    static uint8_t bytes[4096];
    const struct message message = {.type = MESSAGE_IMAGES_COMPARED, .images_compared = *figures};
    struct writer writer;
    char text[256];
    writer_init(&writer, bytes, sizeof(bytes));
    assert_true(message_write(&writer, 1, 0, &message));
    write_file(answer, bytes, writer.used_bytes, 0600);
    snprintf(text, sizeof(text), "#!/bin/sh\ncat %s >&3\nsleep 0.2\n", answer);
    return compare_with(text, 60000);
}

static struct message_images_compared some_figures(void)
{
    return (struct message_images_compared){.width = 4, .height = 3, .channels = 3, .channel_names = "R,G,B"};
}

ALL_TESTS(make_folder, remove_folder)

TEST(a_program_that_ends_or_crashes_is_reported_with_its_last_words)
{
    assert_false(compare_with("#!/bin/sh\necho 'no more memory' >&2\nexit 3\n", 60000));
    check_error(FL_ERROR_SYSTEM, "farlight-export ended with status 3: no more memory");
    assert_false(compare_with("#!/bin/sh\nkill -SEGV $$\n", 60000));
    check_error(FL_ERROR_SYSTEM, "farlight-export was ended by signal 11");
}

TEST(a_program_that_reads_files_gets_no_secrets_and_no_descriptors)
{
    const int open_fd = fcntl(STDIN_FILENO, F_DUPFD, 17);
    char text[300];
    assert_true(open_fd >= 17);
    setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
    setenv("LC_TEST", "passed", 1);
    snprintf(text, sizeof(text),
             "#!/bin/sh\n[ -e /proc/$$/fd/%d ] && f=open\n"
             "echo \"secret ${AWS_SECRET_ACCESS_KEY-unset}, LC $LC_TEST, fd ${f-closed}\" >&2\nexit 3\n",
             open_fd);
    assert_false(compare_with(text, 60000));
    check_error(FL_ERROR_SYSTEM, "secret unset, LC passed, fd closed");
    close(open_fd);
    unsetenv("AWS_SECRET_ACCESS_KEY");
    unsetenv("LC_TEST");
}

TEST(a_program_that_hangs_is_ended_at_its_deadline)
{
    assert_false(compare_with("#!/bin/sh\ntrap '' TERM\nexec sleep 60\n", 200));
    check_error(FL_ERROR_TIMEOUT, "timed out");
}

TEST(garbage_is_reported)
{
    assert_false(compare_with("#!/bin/sh\necho 'this is no message at all' >&3\nsleep 5\n", 60000));
    check_error(FL_ERROR_PROTOCOL, "the image program sent a message that the protocol does not allow");
}

TEST(figures_arrive_and_no_error_is_an_infinite_ratio)
{
    struct message_images_compared figures = some_figures();
    if (!compare_answered(&figures))
        fail_msg("%s", error.text);
    assert_true(comparison.identical && comparison.has_errors);
    assert_true(isinf(comparison.psnr_db) && comparison.psnr_db > 0);
    assert_int_equal(comparison.pixels, 12);
    assert_true(fabs(comparison.threshold - FL_THRESHOLD_DEFAULT) <= 0);
    figures.rms_error = 0.1f;
    figures.shown_rms_error = 0.01f;
    figures.max_error = 0.5f;
    assert_true(compare_answered(&figures));
    assert_false(comparison.identical);
    /* 0.1 is a 32-bit float on the way: 20 dB to 1 part in 1e7. */
    assert_true(fabs(comparison.psnr_db - 20) < 1e-5);
    assert_true(fabs(comparison.shown_psnr_db - 40) < 1e-5);
}

TEST(counts_that_no_picture_can_have_are_refused)
{
    struct message_images_compared wrong[4];
    for (size_t i = 0; i < 4; i++)
        wrong[i] = some_figures();
    wrong[0].beyond = 13;
    wrong[1].nonfinite = 13;
    wrong[2].nonfinite_a = 1;
    wrong[3].visible = 13;
    for (size_t i = 0; i < 4; i++) {
        assert_false(compare_answered(&wrong[i]));
        check_error(FL_ERROR_PROTOCOL, "images_compared");
    }
}

TEST(what_cannot_be_meant_starts_nothing)
{
    static const struct fl_compare_options wrong[] = {{.a = "a.png"},
                                                      {.a = "a.png", .b = "b.png", .threshold = NAN},
                                                      {.a = "a.png", .b = "b.png", .threshold = INFINITY},
                                                      {.a = "a.png", .b = "b.png", .heat_top = -1},
                                                      {.a = "a.png", .b = "b.png", .heat_top = NAN}};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        error = (struct fl_error){0};
        assert_false(fl_compare(&wrong[i], &comparison, &error));
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    }
    assert_false(fl_compare(&(struct fl_compare_options){.a = "\xff.png", .b = "b.png"}, &comparison, &error));
    check_error(FL_ERROR_FILE, "UTF-8");
}
