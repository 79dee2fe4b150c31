/* SPDX-License-Identifier: MIT */
/* Messages of the driver reach the log with the name of the pass, where the context is one for debugging. */
#include "base/error.h"
#include "gpu/device.h"
#include "tests/harness/test.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifdef FARLIGHT_DEBUG
#define DEBUG_BUILD true
#else
#define DEBUG_BUILD false
#endif

struct capture {
    int log; /* where standard error goes otherwise */
    FILE *file;
};

static void capture_begin(struct capture *capture)
{
    fflush(stderr);
    capture->log = dup(STDERR_FILENO);
    capture->file = tmpfile();
    assert_non_null(capture->file);
    assert_int_not_equal(dup2(fileno(capture->file), STDERR_FILENO), -1);
}

static void capture_end(struct capture *capture, char *text, size_t size)
{
    fflush(stderr);
    dup2(capture->log, STDERR_FILENO);
    close(capture->log);
    rewind(capture->file);
    text[fread(text, 1, size - 1, capture->file)] = '\0';
    fclose(capture->file);
    fputs(text, stderr);
}

/* Provokes a mistake and an inserted message in a pass on a device of its own, and returns the log's text. */
static bool provoke(bool debug, char *text, size_t size)
{
    struct error error = {0};
    struct capture capture;
    struct gpu_device *device = gpu_device_create(&(struct gpu_options){.index = -1, .debug = debug}, &error);
    if (!device)
        return false;
    capture_begin(&capture);
    gpu_push_group(device, "a provoked pass");
    glEnable(0xdead);
    glDebugMessageInsert(GL_DEBUG_SOURCE_APPLICATION, GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR, 1,
                         GL_DEBUG_SEVERITY_MEDIUM, -1, "a provoked message");
    gpu_pop_group(device);
    capture_end(&capture, text, size);
    assert_false(gpu_check(device, "the test", &error));
    gpu_device_destroy(device);
    return true;
}

TEST(a_provoked_message_of_the_driver_appears_in_the_log)
{
    char text[4096];
    if (!provoke(true, text, sizeof(text))) {
        printf("skipped: no OpenGL device\n");
        skip();
    }
    assert_non_null(strstr(text, "error gpu: a provoked pass: ")); /* in the driver's words */
    assert_non_null(strstr(text, "warning gpu: a provoked pass: a provoked message\n"));
}

TEST(a_debug_build_has_messages_unasked_and_a_release_build_has_none)
{
    char text[4096];
    if (!provoke(false, text, sizeof(text))) {
        printf("skipped: no OpenGL device\n");
        skip();
    }
    assert_int_equal(strstr(text, "error gpu: a provoked pass: ") != NULL, DEBUG_BUILD);
    assert_int_equal(strstr(text, "warning gpu: a provoked pass: a provoked message\n") != NULL, DEBUG_BUILD);
}
