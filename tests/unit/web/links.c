/* SPDX-License-Identifier: MIT */
/* Who may come to the page (client/web/links.h), and how often (client/web/callers.h). */
#include "tests/harness/test.h"
#include "web/callers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *find(const struct web_links *links, const char *token, const char *behind,
                        enum web_right *right)
{
    static char path[200];
    snprintf(path, sizeof(path), "/%s%s", token, behind);
    return web_links_find(links, path, right);
}

TEST(each_token_gives_its_right)
{
    struct web_links links;
    enum web_right right = WEB_RIGHT_COUNT;
    assert_true(web_links_make(&links, true));
    assert_int_equal(strlen(links.tokens[WEB_READS]), WEB_TOKEN_LENGTH);
    assert_string_not_equal(links.tokens[WEB_READS], links.tokens[WEB_EDITS]);
    assert_string_equal(find(&links, links.tokens[WEB_READS], "/page.js", &right), "page.js");
    assert_int_equal(right, WEB_READS);
    assert_string_equal(find(&links, links.tokens[WEB_EDITS], "/", &right), "");
    assert_int_equal(right, WEB_EDITS);
    assert_null(find(&links, links.tokens[WEB_READS], "", &right));
    assert_null(find(&links, links.tokens[WEB_READS], "x/", &right));
    assert_null(find(&links, links.tokens[WEB_READS] + 1, "/", &right));
    links.tokens[WEB_READS][0] ^= 1;
    char other[sizeof(links.tokens[0])];
    memcpy(other, links.tokens[WEB_READS], sizeof(other));
    links.tokens[WEB_READS][0] ^= 1;
    assert_null(find(&links, other, "/", &right));
    web_links_forget(&links);
}

TEST(no_token_edits_unless_that_is_allowed)
{
    struct web_links links;
    enum web_right right = WEB_RIGHT_COUNT;
    assert_true(web_links_make(&links, false));
    assert_null(find(&links, links.tokens[WEB_EDITS], "/", &right));
    assert_non_null(find(&links, links.tokens[WEB_READS], "/", &right));
    assert_int_equal(right, WEB_READS);
}

TEST(an_address_has_so_many_connections_and_others_have_theirs)
{
    struct web_callers *callers = calloc(1, sizeof(*callers));
    assert_non_null(callers);
    for (int i = 0; i < 3; i++) {
        assert_true(web_callers_has_room(callers, "10.0.0.1", 3));
        assert_non_null(web_callers_add(callers, "10.0.0.1"));
    }
    assert_false(web_callers_has_room(callers, "10.0.0.1", 3));
    assert_true(web_callers_has_room(callers, "10.0.0.2", 3));
    callers->all[1].is_there = false; /* the browser has gone */
    assert_true(web_callers_has_room(callers, "10.0.0.1", 3));
    for (unsigned i = 2; i < CALLERS_MAX; i++)
        assert_non_null(web_callers_add(callers, "10.0.0.3"));
    assert_null(web_callers_add(callers, "10.0.0.4"));
    assert_false(web_callers_has_room(callers, "10.0.0.4", 3));
    free(callers);
}
