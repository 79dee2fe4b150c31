/* SPDX-License-Identifier: MIT */
/* Words and numbers of an NFF file. Blanks separate words, '#' begins a comment; a failure names the line. Not
 * thread-safe. */
#ifndef FARLIGHT_IMPORT_NFF_WORDS_H
#define FARLIGHT_IMPORT_NFF_WORDS_H

#include "import/model/scene.h"

struct word_reader {
    struct import_scene *scene;
    const char *at, *end;
    uint32_t line; /* of `at`, from 1 on */
    char where[24];
};

struct word {
    const char *text;
    size_t length;
};

/* The place for a message; it holds until the next call. */
const char *word_reader_where(struct word_reader *reader);

/* To the next word; with `same_line` not beyond the end of the line. False: there is none. */
bool word_reader_skip(struct word_reader *reader, bool same_line);
/* The word that `word_reader_skip` has found. */
struct word word_reader_next(struct word_reader *reader);

bool word_is(struct word word, const char *text);
/* For "%.*s" of a message: as much of the word as is shown. */
int word_shown(struct word word);

/* Exactly `count` numbers, over several lines if need be; false: the scene has failed. `of` is the statement, as
 * people know it. */
bool word_reader_numbers(struct word_reader *reader, float *out, uint32_t count, const char *of);
/* Up to `maximum` numbers of this line; stops at the first word that is none. The rest of the line is skipped. */
uint32_t word_reader_some(struct word_reader *reader, float *out, uint32_t maximum);
/* Whether the rest of the text can hold so many numbers: an array is not worth its memory if it cannot. False: the
 * scene has failed. */
bool word_reader_can_hold(struct word_reader *reader, uint64_t numbers, const char *of);

#endif
