/* SPDX-License-Identifier: MIT */
/* Files of camera keys. */
#include "lib/farlight.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct fl_error error;
static struct record_camera_key *keys;
static size_t key_count;

static bool load(const char *text)
{
    char path[] = P_tmpdir "/farlight-keys-XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, strlen(text)), (ssize_t)strlen(text));
    close(fd);
    error = (struct fl_error){0};
    keys = NULL;
    const bool loaded = fl_camera_keys_load(path, &keys, &key_count, &error);
    unlink(path);
    return loaded;
}

TEST(keys_are_read_with_defaults)
{
    assert_true(
        load("[{\"time\": 0, \"eye\": [0, 1, 5], \"look_at\": [0, 0, 0]},\n"
             " {\"time\": 2.5, \"eye\": [5, 1, 0], \"look_at\": [0, 0, 0], \"up\": [0, 0, 1], \"fov\": 90}]"));
    assert_int_equal(key_count, 2);
    assert_true(keys[0].eye_world[2] == 5 && keys[0].up_world[1] == 1);
    assert_true(fabsf(keys[0].fov_y - 0.785398f) < 1e-5f);
    assert_true(keys[1].time_s == 2.5f && keys[1].up_world[2] == 1);
    assert_true(fabsf(keys[1].fov_y - 1.570796f) < 1e-5f);
    free(keys);
}

TEST(a_wrong_file_is_reported_by_line_or_key_and_field)
{
    static const struct {
        const char *text, *told;
    } cases[] = {
        {"", "line"},
        {"[\n{\"time\": }]", "line 2"},
        {"[]", "array of 1 to"},
        {"{}", "array of 1 to"},
        {"[5]", "key 0 is not an object"},
        {"[{\"eye\": [0,0,1], \"look_at\": [0,0,0]}]", "key 0, \"time\": is missing"},
        {"[{\"time\": 0, \"look_at\": [0,0,0]}]", "\"eye\": is missing"},
        {"[{\"time\": 0, \"eye\": [0,0], \"look_at\": [0,0,0]}]", "\"eye\": must be"},
        {"[{\"time\": 0, \"eye\": [0,0,\"1\"], \"look_at\": [0,0,0]}]", "\"eye\": must be"},
        {"[{\"time\": 0, \"eye\": [0,0,1e300], \"look_at\": [0,0,0]}]", "\"eye\": must be"},
        {"[{\"time\": -1, \"eye\": [0,0,1], \"look_at\": [0,0,0]}]", "\"time\": must be"},
        {"[{\"time\": 0, \"eye\": [0,0,0], \"look_at\": [0,0,0]}]", "\"look_at\": is where the eye is"},
        {"[{\"time\": 0, \"eye\": [0,0,1], \"look_at\": [0,0,0], \"fov\": 180}]", "\"fov\": must be"},
        {"[{\"time\": 0, \"eye\": [0,0,1], \"look_at\": [0,0,0], \"roll\": 1}]", "\"roll\": is not known"},
        {"[{\"time\": 1, \"eye\": [0,0,1], \"look_at\": [0,0,0]}, {\"time\": 1, \"eye\": [0,0,1], \"look_at\": "
         "[0,0,0]}]",
         "key 1, \"time\": does not come after"},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        if (load(cases[i].text))
            fail_msg("'%s' was taken", cases[i].text);
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
        assert_true(strlen(error.field) > 0);
        if (!strstr(error.text, cases[i].told))
            fail_msg("'%s' was told as '%s', which lacks '%s'", cases[i].text, error.text, cases[i].told);
    }
}

TEST(a_missing_file_is_named)
{
    assert_false(fl_camera_keys_load("/nonexistent/keys.json", &keys, &key_count, &error));
    assert_string_equal(error.field, "/nonexistent/keys.json");
}
