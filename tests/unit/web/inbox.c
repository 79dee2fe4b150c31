/* SPDX-License-Identifier: MIT */
/* Requests of a browser (client/web/inbox.h), and effects of an edit (client/web/editing.h). */
#include "tests/harness/test.h"
#include "web/editing.h"
#include "web/inbox.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const edits[] = {
    "{\"list\": {\"kind\": \"node\", \"match\": \"\"}}", "{\"read\": {\"kind\": \"node\", \"id\": 1}}",
    "{\"edit\": {\"kind\": \"material\", \"id\": 1, \"field\": \"roughness\", \"values\": [0.5]}}",
    "{\"undo\": true}", "{\"redo\": true}"};
#define EDIT_COUNT (sizeof(edits) / sizeof(edits[0]))

static struct web_request request_of(const char *text)
{
    struct web_request request;
    struct fl_error error = {0};
    assert_true(web_request_read(text, strlen(text), &request, &error));
    return request;
}

TEST(a_link_to_look_leaves_no_request_to_edit)
{
    for (size_t i = 0; i < EDIT_COUNT; i++) {
        struct web_inbox inbox = {0};
        const struct web_request request = request_of(edits[i]);
        assert_false(web_inbox_put(&inbox, &request, false));
        assert_int_equal(inbox.edit.kind, WEB_NONE);
        assert_int_equal(web_inbox_take(&inbox.edit, true).kind, WEB_NONE);
    }
}

TEST(an_edit_waits_until_it_is_taken_and_no_other_takes_its_place)
{
    struct web_inbox inbox = {0};
    const struct web_request first = request_of(edits[0]), second = request_of(edits[3]);
    assert_true(web_inbox_put(&inbox, &first, true));
    assert_false(web_inbox_put(&inbox, &second, true));
    assert_int_equal(web_inbox_take(&inbox.edit, false).kind, WEB_NONE);
    assert_int_equal(web_inbox_take(&inbox.edit, true).kind, WEB_LIST);
    assert_int_equal(web_inbox_take(&inbox.edit, true).kind, WEB_NONE);
    assert_true(web_inbox_put(&inbox, &second, true));
}

TEST(a_newer_camera_takes_the_place_of_one_that_waits)
{
    struct web_inbox inbox = {0};
    struct web_request camera = {.kind = WEB_CAMERA, .id = 1};
    assert_true(web_inbox_put(&inbox, &camera, false));
    camera.id = 2;
    assert_true(web_inbox_put(&inbox, &camera, false));
    assert_int_equal(web_inbox_take(&inbox.camera, true).id, 2);
}

TEST(a_request_without_a_kind_undoes_nothing)
{
    struct edit_history history = {0};
    struct fl_error error = {0};
    edit_history_add(&history, calloc(1, sizeof(struct fl_assignment)), 1);
    assert_null(web_editing_answer(&history, NULL, &(struct web_request){0}, &error));
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    assert_int_equal(history.undo_count, 1);
    edit_history_clear(&history);
}
