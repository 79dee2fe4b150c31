/* SPDX-License-Identifier: MIT */
/* Words and numbers of an NFF file. Blanks separate words, '#' begins a comment; errors name the line. Not
 * thread-safe. */
#ifndef FARLIGHT_IMPORT_NFF_WORDS_H
#define FARLIGHT_IMPORT_NFF_WORDS_H

#include "import/model/scene.h"

struct word_reader {
    struct import_scene *scene;
    const char *at, *end;
    uint32_t line; /* line of `at`, from 1 on */
    char where[24];
};

struct word {
    const char *text;
    size_t length;
};

/* The place for an error; valid until the next call. */
const char *word_reader_where(struct word_reader *reader);

/* Skips to the next word; with `same_line` not beyond the end of the line. False: there is none. */
bool word_reader_skip(struct word_reader *reader, bool same_line);
/* Reads the word that `word_reader_skip` has found. */
struct word word_reader_next(struct word_reader *reader);

bool word_is(struct word word, const char *text);
/* Length for "%.*s" in a message that shows the word. */
int word_shown(struct word word);

/* Reads exactly `count` numbers, over several lines if need be; false: the scene has failed. `of` is the
 * statement's name for people. */
bool word_reader_numbers(struct word_reader *reader, float *out, uint32_t count, const char *of);
/* Reads up to `maximum` numbers of this line, up to the first other word. The rest of the line is skipped. */
uint32_t word_reader_some(struct word_reader *reader, float *out, uint32_t maximum);
/* Checks that the rest of the text can hold this many numbers, before an array is allocated. False: the scene
 * has failed. */
bool word_reader_can_hold(struct word_reader *reader, uint64_t numbers, const char *of);

#endif
