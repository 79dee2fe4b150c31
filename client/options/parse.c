/* SPDX-License-Identifier: MIT */
/* Parsing of command lines with argp, and suggestions for misspelt options. */
#include "parse.h"
#include "talk.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NAME_BYTES 64

/* A search for an option in an argp and its children. */
struct search {
    const char *name; /* name of a long option, perhaps abbreviated; or .. */
    char letter;      /* .. the letter of a short one */
    const struct argp_option *found;
    bool is_exact;
    struct fl_nearest nearest;
};

static void search_options(struct search *search, const struct argp_option *options)
{
    const struct argp_option *option = options;
    for (; option && (option->name || option->key || option->doc || option->group); option++) {
        const bool is_letter = option->key > ' ' && option->key < 0x7f && !(option->flags & OPTION_DOC);
        if (search->letter != '\0' && is_letter && option->key == search->letter)
            search->found = option;
        if (search->letter != '\0' || !option->name)
            continue;
        const bool is_exact = strcmp(option->name, search->name) == 0;
        if (is_exact || (!search->is_exact && strncmp(option->name, search->name, strlen(search->name)) == 0))
            search->found = option;
        search->is_exact = search->is_exact || is_exact;
        fl_nearest_try(&search->nearest, search->name, option->name);
    }
}

static void search_argp(struct search *search, const struct argp *argp)
{
    static const struct argp_option always[] = {{.name = "help"}, {.name = "usage"}, {0}};
    search_options(search, argp->options);
    for (const struct argp_child *child = argp->children; child && child->argp; child++)
        search_argp(search, child->argp);
    search_options(search, always);
}

/* True if the option takes the next word. */
static bool wants_word(const struct argp_option *option)
{
    return option && option->arg && !(option->flags & OPTION_ARG_OPTIONAL);
}

/* True if the next word belongs to "-qo": the last letter's option may take it; an earlier one takes the rest
 * of this word. */
static bool letters_want_word(const struct argp *argp, const char *letters)
{
    for (; *letters != '\0'; letters++) {
        struct search search = {.letter = *letters};
        search_argp(&search, argp);
        if (search.found && search.found->arg)
            return wants_word(search.found) && letters[1] == '\0';
    }
    return false;
}

/* Finds an unknown option that resembles a known one; argp reports all others. */
static bool check_options(const struct argp *argp, int argc, char **argv, struct fl_error *error)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        char name[NAME_BYTES];
        const size_t length = strncmp(argv[i], "--", 2) == 0 ? strcspn(argv[i] + 2, "=") : 0;
        if (length == 0) {
            i += argv[i][0] == '-' && letters_want_word(argp, argv[i] + 1);
            continue;
        }
        snprintf(name, sizeof(name), "%.*s", (int)length, argv[i] + 2);
        struct search search = {.name = name};
        search_argp(&search, argp);
        if (!search.found && search.nearest.name) {
            fl_error_set(error, FL_ERROR_ARGUMENT, argv[i], "is not an option of '%s'", argv[0]);
            return fl_error_remedy(error, "did you mean '--%s'?", search.nearest.name);
        }
        i += wants_word(search.found) && argv[i][2 + length] == '\0';
    }
    return true;
}

error_t cli_parse(const struct argp *argp, int argc, char **argv, unsigned flags, void *input)
{
    struct fl_error error = {0};
    if (!check_options(argp, argc, argv, &error)) {
        cli_report(&error);
        exit(argp_err_exit_status); /* argp's status */
    }
    return argp_parse(argp, argc, argv, flags, NULL, input);
}
