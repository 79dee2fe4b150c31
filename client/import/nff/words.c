/* SPDX-License-Identifier: MIT */
/* Words and numbers of an NFF file. */
#include "words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *word_reader_where(struct word_reader *reader)
{
    snprintf(reader->where, sizeof(reader->where), "line %u", reader->line);
    return reader->where;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\f';
}

bool word_reader_skip(struct word_reader *reader, bool same_line)
{
    while (reader->at < reader->end) {
        char c = *reader->at;

        if (c == '#')
            while (reader->at < reader->end && *reader->at != '\n')
                reader->at++;
        else if (c == '\n') {
            if (same_line)
                return false;
            reader->line++;
            reader->at++;
        } else if (is_blank(c))
            reader->at++;
        else
            return true;
    }
    return false;
}

static bool ends_word(char c)
{
    return c == '\0' || c == '\n' || c == '#' || is_blank(c);
}

struct word word_reader_next(struct word_reader *reader)
{
    struct word word = {reader->at, 0};

    while (reader->at < reader->end && !ends_word(*reader->at))
        reader->at++;
    if (reader->at == word.text && reader->at < reader->end) /* a NUL byte in the file */
        reader->at++;
    word.length = (size_t)(reader->at - word.text);
    return word;
}

bool word_is(struct word word, const char *text)
{
    return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

int word_shown(struct word word)
{
    return word.length < 24 ? (int)word.length : 24;
}

static bool to_number(struct word word, float *out)
{
    char text[64], *end;
    double value;

    if (word.length == 0 || word.length >= sizeof(text))
        return false;
    memcpy(text, word.text, word.length);
    text[word.length] = '\0';
    value = strtod(text, &end);
    if (*end != '\0' || end == text || !(fabs(value) <= 1e12))
        return false;
    *out = (float)value;
    return true;
}

bool word_reader_numbers(struct word_reader *reader, float *out, uint32_t count, const char *of)
{
    for (uint32_t i = 0; i < count; i++) {
        struct word word;

        if (!word_reader_skip(reader, false))
            return import_fail(reader->scene, word_reader_where(reader),
                               "the file ends where number %u of %u of '%s' should be", i + 1, count, of);
        word = word_reader_next(reader);
        if (!to_number(word, &out[i]))
            return import_fail(reader->scene, word_reader_where(reader),
                               "'%.*s' is not an allowed number of '%s' (%u of %u)", word_shown(word), word.text,
                               of, i + 1, count);
    }
    return true;
}

uint32_t word_reader_some(struct word_reader *reader, float *out, uint32_t maximum)
{
    uint32_t count = 0;
    bool more = false;

    while (word_reader_skip(reader, true)) {
        struct word word = word_reader_next(reader);

        if (!more && count < maximum && to_number(word, &out[count])) {
            count++;
        } else {
            more = true;
        }
    }
    if (more)
        import_note(reader->scene, PROTOCOL_SEVERITY_INFO, word_reader_where(reader),
                    "unknown words at the end of a line");
    return count;
}

/* Every number takes at least two bytes, except the last one. */
bool word_reader_can_hold(struct word_reader *reader, uint64_t numbers, const char *of)
{
    uint64_t left = (uint64_t)(reader->end - reader->at);

    return numbers <= (left + 1) / 2 ||
           import_fail(reader->scene, word_reader_where(reader), "%s needs %llu numbers, but the file ends before",
                       of, (unsigned long long)numbers);
}
