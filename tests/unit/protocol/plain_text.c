/* SPDX-License-Identifier: MIT */
/* Text from outside, made harmless for terminals and logs. */
#include "protocol/plain_text.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "protocol/common/trace_event.h"
#include "tests/harness/test.h"

static const struct {
    const char *text, *shown;
} cases[] = {
    {"", ""},
    {"plain", "plain"},
    {"\xc3\xa4\xe6\xbc\xa2\xf0\x9f\x8e\xa8", "\xc3\xa4\xe6\xbc\xa2\xf0\x9f\x8e\xa8"},
    {"\033[2J\n\x7f", "?[2J??"},                           /* C0, DEL */
    {"a\xc2\x80\xc2\x9b\xc2\x9f\xc2\xa0", "a???\xc2\xa0"}, /* C1, and the character behind it */
    {"a\x9b"
     "b",
     "a?b"},                                                    /* C1 as a single byte: no UTF-8 */
    {"\xe2\x80\xaa\xe2\x80\xae\xe2\x80\xaf", "??\xe2\x80\xaf"}, /* embedding and override; U+202F is a blank */
    {"\xe2\x81\xa6\xe2\x81\xa9", "??"},                         /* isolates */
    {"\xe2\x80\x8b\xe2\x80\x8e\xe2\x80\x8f\xd8\x9c", "????"},   /* without width, marks of direction */
    {"\xe2\x80\xa8\xe2\x80\xa9\xef\xbb\xbf", "???"},            /* separators, byte order mark */
    {"\xf3\xa0\x81\x81", "?"},                                  /* a tag */
    {"\xc0\xaf\xed\xa0\x80\xf4\x90\x80\x80\xe2\x82", "???????????"},
};

TEST(what_a_terminal_would_obey_becomes_a_question_mark)
{
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        char out[64];
        assert_int_equal(plain_text_copy(out, sizeof(out), cases[i].text), strlen(cases[i].shown));
        assert_string_equal(out, cases[i].shown);
        strcpy(out, cases[i].text);
        plain_text_copy(out, sizeof(out), out);
        assert_string_equal(out, cases[i].shown);
        char *printed = NULL;
        size_t bytes = 0;
        FILE *stream = open_memstream(&printed, &bytes);
        assert_non_null(stream);
        plain_text_print(stream, cases[i].text);
        assert_int_equal(fclose(stream), 0);
        assert_string_equal(printed, cases[i].shown);
        free(printed);
    }
}

TEST(a_copy_ends_at_a_whole_character)
{
    char out[4];
    assert_int_equal(plain_text_copy(out, sizeof(out), "ab\xc3\xa4"), 2);
    assert_string_equal(out, "ab");
    assert_int_equal(plain_text_copy(out, 1, "ab"), 0);
    assert_string_equal(out, "");
    assert_int_equal(plain_text_copy(out, 0, "ab"), 0);
}

TEST(names_in_a_trace_are_complete_and_valid_json)
{
    char *text = NULL;
    size_t bytes = 0;
    uint64_t threads = 0;
    FILE *stream = open_memstream(&text, &bytes);
    assert_non_null(stream);
    struct trace_writer writer = {.out = stream, .before = "", .threads = &threads};
    trace_write_process_name(&writer, 1, "a\xc2\x9b\"\xe2\x80\xae\xf3\xa0\x81\x81\xff\xc3\xa4");
    assert_int_equal(fclose(stream), 0);
    assert_non_null(strstr(text, "\"a\\u009b\\\"\\u202e\\udb40\\udc41\\ufffd\xc3\xa4\""));
    free(text);
}

TEST(a_log_line_holds_nothing_that_a_terminal_obeys)
{
    int ends[2];
    char line[256] = "";
    const int kept = dup(STDERR_FILENO);
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(dup2(ends[1], STDERR_FILENO), STDERR_FILENO);
    log_write(LOG_ERROR, "net", "scene \"%s\"",
              "a\xc2\x9b"
              "2J\xe2\x80\xae\n\xc3\xa4");
    assert_int_equal(dup2(kept, STDERR_FILENO), STDERR_FILENO);
    assert_true(read(ends[0], line, sizeof(line) - 1) > 0);
    assert_string_equal(line, "error net: scene \"a?2J??\xc3\xa4\"\n");
    close(kept);
    close(ends[0]);
    close(ends[1]);
}
