/* SPDX-License-Identifier: MIT */
/* Remembered settings of the viewer: they come back unchanged, and a file that holds anything else does no
 * harm. */
#include "viewer/input/recall.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/farlight-recall-XXXXXX";
static char path[64];
static struct fl_error error;

static int begin(void **state)
{
    (void)state;
    strcpy(folder + strlen(folder) - 6, "XXXXXX");
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof(path), "%s/viewer.json", folder);
    error = (struct fl_error){0};
    return 0;
}

static int end(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder); /* nothing else is left in it */
}

static void load(struct recall *recall, const char *text, size_t bytes)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, bytes, file), bytes);
    fclose(file);
    recall_load(recall, path);
}

EACH_TEST(begin, end)

TEST(what_keys_have_chosen_comes_back_and_nothing_else)
{
    const struct settings first = {.tone_map = PROTOCOL_TONE_ACES, .local = LOCAL_AUTO};
    struct settings now = first, later = {.tone_map = PROTOCOL_TONE_NEUTRAL, .coarser = 2, .local = LOCAL_AUTO};
    struct recall saved = {.width = 800, .height = 600, .has_place = true, .x = -20, .y = 30}, loaded;
    now.tracer = PROTOCOL_TRACER_LDC;
    now.overlay = OVERLAY_FIGURES;
    now.local = LOCAL_ON;
    recall_note(&saved, &first, &now);
    if (!recall_save(&saved, path, &error))
        fail_msg("%s", error.text);
    recall_load(&loaded, path);
    assert_true(loaded.width == 800 && loaded.height == 600 && loaded.has_place && loaded.x == -20 &&
                loaded.y == 30);
    assert_false(loaded.full_screen);
    recall_apply(&loaded, &later);
    assert_int_equal(later.tracer, PROTOCOL_TRACER_LDC);
    assert_int_equal(later.overlay, OVERLAY_FIGURES);
    assert_int_equal(later.local, LOCAL_ON);
    assert_true(later.tone_map == PROTOCOL_TONE_NEUTRAL &&
                later.coarser == 2); /* the command line has precedence */
}

TEST(a_file_that_holds_something_else_is_as_none)
{
    static const char *const wrong[] = {
        "",
        "[]",
        "null",
        "{",
        "{\"width\": 800}",
        "{\"width\": 1e9, \"height\": 600}",
        "{\"width\": 0, \"height\": -1}",
        "{\"width\": \"800\", \"height\": [600]}",
        "{\"x\": 99999999999999999999, \"y\": 0}",
        "{\"x\": 5, \"y\": 100000}",
        "{\"tracer\": 1, \"tone_map\": \"none such\", \"overlay\": null, \"scale\": \"3\"}",
        "{\"tracer\": \"naive\", \"full_screen\": 1}", /* this tracer is for tests */
    };
    const struct recall none = {0};
    struct recall loaded;
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        load(&loaded, wrong[i], strlen(wrong[i]));
        if (loaded.width != 0 || loaded.has_place || loaded.full_screen ||
            memcmp(loaded.has, none.has, sizeof(none.has)) != 0)
            fail_msg("taken: %s", wrong[i]);
    }
    char *deep = malloc(200000); /* more than such a file may have, and deeper */
    assert_non_null(deep);
    memset(deep, '[', 200000);
    load(&loaded, deep, 200000);
    load(&loaded, deep, 60000);
    free(deep);
    assert_int_equal(loaded.width, 0);
    unlink(path);
    assert_int_equal(mkfifo(path, 0600), 0); /* is not waited for */
    recall_load(&loaded, path);
    recall_load(&loaded, folder);
    recall_load(&loaded, "/nonexistent/viewer.json");
    assert_int_equal(loaded.width, 0);
}

TEST(the_file_is_where_the_desktop_keeps_such)
{
    char found[64];
    setenv("XDG_STATE_HOME", "/a/state", 1);
    setenv("HOME", "/home/me", 1);
    assert_true(recall_default_path(found, sizeof(found)));
    assert_string_equal(found, "/a/state/farlight/viewer.json");
    setenv("XDG_STATE_HOME", "relative", 1); /* is to be ignored */
    assert_true(recall_default_path(found, sizeof(found)));
    assert_string_equal(found, "/home/me/.local/state/farlight/viewer.json");
    unsetenv("HOME");
    assert_false(recall_default_path(found, sizeof(found)));
}
