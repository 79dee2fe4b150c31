/* SPDX-License-Identifier: MIT */
/* The viewer's list of timed events: what it may hold, and what is told about what it may not. */
#include "viewer/input/replay.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct fl_error error;
static struct replay replay;

static bool load(const char *text)
{
    char path[] = "/tmp/farlight-replay-XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, strlen(text)), strlen(text));
    close(fd);
    error = (struct fl_error){0};
    const bool loaded = replay_load(&replay, path, &error);
    unlink(path);
    return loaded;
}

TEST(every_kind_of_event_is_read)
{
    if (!load("[{\"mouse\": \"down\", \"button\": \"right\", \"x\": 10, \"y\": 20.5, \"clicks\": 2, \"shift\": "
              "true},\n"
              " {\"mouse\": \"move\", \"x\": 11, \"y\": 21, \"after\": 0.25}, {\"mouse\": \"up\"},\n"
              " {\"wheel\": -2}, {\"key\": \"t\", \"shift\": true}, {\"key\": \"w\", \"hold\": 0.5},\n"
              " {\"resize\": [640, 360]}, {\"wait\": \"rest\", \"samples\": 8, \"timeout\": 3}, {\"wait\": "
              "\"lost\"}, {\"wait\": \"camera\"},\n"
              " {\"screenshot\": \"a/b.png\"}, {\"state\": \"here\"}, {\"after\": 2}, {\"drop\": \"a.glb\"}, "
              "{\"text\": \"0.5\", \"ctrl\": true}, {\"wait\": \"change\"}]"))
        fail_msg("%s", error.text);
    assert_int_equal(replay.count, 18); /* a key is two: down and up */
    const struct replay_event *event = replay.events;
    assert_int_equal(event[0].input.kind, INPUT_BUTTON_DOWN);
    assert_int_equal(event[0].input.button, INPUT_RIGHT);
    assert_int_equal(event[0].input.clicks, 2);
    assert_true(event[0].input.shift && event[0].input.x == 10 && event[0].input.y == 20.5);
    assert_int_equal(event[1].input.kind, INPUT_MOTION);
    assert_true(event[1].after_s == 0.25 && !event[1].input.shift);
    assert_int_equal(event[2].input.kind, INPUT_BUTTON_UP);
    assert_true(event[3].input.kind == INPUT_WHEEL && event[3].input.wheel == -2);
    assert_true(event[4].input.kind == INPUT_KEY_DOWN && event[4].input.shift);
    assert_string_equal(event[4].input.key, "t");
    assert_true(event[5].input.kind == INPUT_KEY_UP && event[5].after_s == 0);
    assert_true(event[7].input.kind == INPUT_KEY_UP && event[7].after_s == 0.5);
    assert_true(event[8].input.kind == INPUT_RESIZE && event[8].input.width == 640 &&
                event[8].input.height == 360);
    assert_true(event[9].kind == REPLAY_REST && event[9].samples == 8 && event[9].timeout_s == 3);
    assert_true(event[10].kind == REPLAY_LOST && event[10].samples == 0 && event[10].timeout_s == 120);
    assert_int_equal(event[10].number, 8); /* in the file */
    assert_true(event[11].kind == REPLAY_CAMERA);
    assert_true(event[12].kind == REPLAY_SCREENSHOT);
    assert_string_equal(event[12].path, "a/b.png");
    assert_true(event[13].kind == REPLAY_STATE);
    assert_true(event[14].kind == REPLAY_INPUT && event[14].after_s == 2);
    assert_int_equal(event[15].input.kind, INPUT_DROP);
    assert_string_equal(event[15].input.path, "a.glb");
    assert_true(event[16].input.kind == INPUT_TEXT && event[16].input.ctrl);
    assert_string_equal(event[16].input.text, "0.5");
    assert_true(event[17].kind == REPLAY_CHANGE);
    replay_finish(&replay);
}

TEST(mistakes_are_reported_with_line_and_event)
{
    static const struct {
        const char *text, *part;
    } wrong[] = {
        {"{}", "is not a list of events"},
        {"[{]", "line 1"},
        {"[{\"after\": 1},\n {\"nothing\": 1}]", "line 2: [1]: is not one of"},
        {"[{\"after\": -1}]", "after: is not a number"},
        {"[{\"after\": 1e9}]", "after: is not a number"},
        {"[{\"mouse\": \"jump\"}]", "mouse: is not one of"},
        {"[{\"mouse\": \"down\", \"x\": \"5\"}]", "x: is not a number"},
        {"[{\"key\": \"\"}]", "key: is not a text"},
        {"[{\"key\": 5}]", "key: is not a text"},
        {"[{\"key\": \"a name that is far too long for a key\"}]", "key: is not a text"},
        {"[{\"wait\": \"for me\"}]", "wait: is not one of"},
        {"[{\"wait\": \"rest\", \"samples\": 0}]", "samples: is not a number"},
        {"[{\"resize\": [640]}]", "resize: is not"},
        {"[{\"resize\": [640, 100000]}]", "resize: is not"},
        {"[{\"screenshot\": true}]", "screenshot: is not a text"},
        {"[{\"drop\": 1}]", "drop: is not a text"},
        {"[5]", "[0]: is not one of"},
    };
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        if (load(wrong[i].text))
            fail_msg("taken: %s", wrong[i].text);
        if (!strstr(error.text, wrong[i].part))
            fail_msg("%s: '%s'", wrong[i].text, error.text);
    }
    error = (struct fl_error){0};
    assert_false(replay_load(&replay, "/nonexistent.json", &error));
    assert_int_equal(error.code, FL_ERROR_FILE);
}
