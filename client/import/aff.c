/* SPDX-License-Identifier: MIT */
/* Animated File Format: J. Lext, U. Assarsson, T. Möller. BART: A Benchmark for Animated Ray Tracing. Chalmers
 * University of Technology, Technical Report 00-14, 2000. It is NFF with materials of three colours, indexed
 * meshes, textures, transforms, keys and files that include others. */
#include "aff.h"

#include "formats.h"
#include "model.h"

#include <stdlib.h>
#include <string.h>

#define INCLUDE_DEPTH_MAX 32u
#define INCLUDES_MAX 65536u

bool aff_read_name(struct aff *aff, aff_name name, const char *of)
{
    struct word word;

    if (!word_reader_get(&aff->nff.reader, &word, of))
        return false;
    if (word.length > IMPORT_NAME_MAX || word_is(word, "{") || word_is(word, "}"))
        return import_fail(aff->nff.scene, word_reader_where(&aff->nff.reader),
                           "'%s' needs a name of at most %d characters, but there is '%.*s'", of, IMPORT_NAME_MAX,
                           word_shown(word), word.text);
    memcpy(name, word.text, word.length);
    name[word.length] = '\0';
    return true;
}

/* ---- other files ---- */

static bool read_text(struct aff *aff);

/* Its ending says that it is meant for this reader: messages quote the words of what it reads, and must quote no
 * other file. */
static bool may_be_included(const char *name)
{
    const char *dot = strrchr(name, '.');

    return dot && (strcmp(dot, ".aff") == 0 || strcmp(dot, ".nff") == 0);
}

/* UINT32_MAX: the scene has failed. */
static uint32_t find_text(struct aff *aff, const char *name)
{
    struct import_scene *scene = aff->nff.scene;
    char reason[FILES_REASON_BYTES] = "";
    struct aff_file *grown;

    for (size_t i = 0; i < aff->text_count; i++)
        if (strcmp(aff->texts[i].name, name) == 0)
            return (uint32_t)i;
    grown = import_grow(scene, aff->texts, aff->text_count, &aff->text_capacity, sizeof(*grown));
    if (!grown)
        return UINT32_MAX;
    aff->texts = grown;
    grown += aff->text_count;
    *grown = (struct aff_file){.name = strdup(name)};
    if (!grown->name) {
        import_fail(scene, NULL, "out of memory");
        return UINT32_MAX;
    }
    aff->text_count++;
    grown->bytes = files_read(aff->files, name, &grown->size_bytes, reason);
    if (!grown->bytes) {
        import_fail(scene, word_reader_where(&aff->nff.reader),
                    "the file '%.100s', which it includes, cannot be used: %s", name, reason);
        return UINT32_MAX;
    }
    return (uint32_t)aff->text_count - 1;
}

static bool read_include(struct aff *aff, const char *name)
{
    struct import_scene *scene = aff->nff.scene;
    const struct word_reader outside = aff->nff.reader;
    const char *where = word_reader_where(&aff->nff.reader);
    uint32_t text;
    bool read;

    if (!may_be_included(name))
        return import_fail(scene, where, "'%.100s' cannot be included: its name should end in .aff or .nff", name);
    if (aff->include_depth == INCLUDE_DEPTH_MAX || ++aff->include_count > INCLUDES_MAX)
        return import_fail(scene, where, "more than %u files include one another, or more than %u in all",
                           INCLUDE_DEPTH_MAX, INCLUDES_MAX);
    text = find_text(aff, name);
    if (text == UINT32_MAX)
        return false;
    if (aff->texts[text].open)
        return import_fail(scene, where, "'%.100s' includes itself", name);
    aff->included_bytes += aff->texts[text].size_bytes;
    if (aff->included_bytes > FILES_TOTAL_MAX)
        return import_fail(scene, where,
                           "the files that are included, some of them again and again, have more than "
                           "%llu GiB",
                           FILES_TOTAL_MAX >> 30);
    aff->texts[text].open = true;
    aff->include_depth++;
    aff->nff.reader.at = (const char *)aff->texts[text].bytes;
    aff->nff.reader.end = aff->nff.reader.at + aff->texts[text].size_bytes;
    aff->nff.reader.file = aff->texts[text].name;
    aff->nff.reader.line = 1;
    read = read_text(aff);
    aff->include_depth--;
    aff->texts[text].open = false;
    aff->nff.reader = outside;
    return read;
}

static bool read_include_statement(struct aff *aff)
{
    uint32_t detail;
    aff_name name;

    return word_reader_count(&aff->nff.reader, &detail, 0, UINT32_MAX, "i") && aff_read_name(aff, name, "i") &&
           (detail > aff->detail || read_include(aff, name));
}

/* ---- statements ---- */

static bool read_fill(struct aff *aff)
{
    aff->nff.fill = (struct nff_fill){.extended = 1};
    return word_reader_numbers(&aff->nff.reader, aff->nff.fill.numbers, 12, "fm") && nff_use_fill(&aff->nff);
}

static bool read_named_light(struct aff *aff)
{
    struct aff_named_light *grown = import_grow(aff->nff.scene, aff->named_lights, aff->named_light_count,
                                                &aff->named_light_capacity, sizeof(*grown));

    if (!grown)
        return false;
    aff->named_lights = grown;
    grown += aff->named_light_count;
    grown->light = aff->nff.light_count;
    if (!aff_read_name(aff, grown->name, "la") || !nff_read_light(&aff->nff))
        return false;
    aff->named_light_count++;
    return true;
}

static bool read_animation(struct aff *aff)
{
    struct word_reader *reader = &aff->nff.reader;
    float times[2];

    if (!word_reader_numbers(reader, times, 2, "a") ||
        !word_reader_count(reader, &aff->frames, 1, UINT32_MAX, "a"))
        return false;
    if (times[1] < times[0])
        return import_fail(aff->nff.scene, word_reader_where(reader),
                           "the animation ends at %g, before it begins "
                           "at %g",
                           (double)times[1], (double)times[0]);
    aff->has_animation = true;
    aff->start_s = times[0];
    aff->end_s = times[1];
    return true;
}

static bool read_statement(struct aff *aff, struct word word)
{
    bool read = true;

    if (word_is(word, "i"))
        return read_include_statement(aff);
    if (word_is(word, "d"))
        return word_reader_count(&aff->nff.reader, &aff->detail, 0, UINT32_MAX, "d");
    if (word_is(word, "am"))
        return word_reader_numbers(&aff->nff.reader, aff->nff.ambient, 3, "am");
    if (word_is(word, "fm"))
        return read_fill(aff);
    if (word_is(word, "la"))
        return read_named_light(aff);
    if (word_is(word, "a"))
        return read_animation(aff);
    if (word_is(word, "k"))
        return aff_read_keys(aff);
    if (word_is(word, "xs"))
        return aff_read_static_transform(aff);
    if (word_is(word, "x"))
        return aff_read_moving_transform(aff);
    if (word_is(word, "m"))
        return aff_read_mesh(aff);
    if (word_is(word, "tt") || word_is(word, "ttp"))
        return aff_read_textured_triangle(aff, word.length == 3);
    if (word_is(word, "tpa"))
        return aff_read_moving_triangle(aff);
    if (word_is(word, "s"))
        return aff_read_sphere(aff, word);
    if (nff_statement(&aff->nff, word, &read))
        return read;
    return import_fail(aff->nff.scene, word_reader_where(&aff->nff.reader), "'%.*s' is not a statement of AFF",
                       word_shown(word), word.text);
}

/* A file closes what it opens, and nothing else. */
static bool read_text(struct aff *aff)
{
    struct word_reader *reader = &aff->nff.reader;
    const size_t outermost = aff->block;

    while (word_reader_skip(reader, false)) {
        struct word word = word_reader_next(reader);

        if (!word_is(word, "}")) {
            if (!read_statement(aff, word))
                return false;
        } else if (aff->block > outermost) {
            aff_close_block(aff);
        } else {
            return import_fail(aff->nff.scene, word_reader_where(reader), "a '}' that closes no '{' of its file");
        }
    }
    return aff->block == outermost ||
           import_fail(aff->nff.scene, word_reader_where(reader), "the file ends, but %zu '{' lack their '}'",
                       aff->block - outermost);
}

static void aff_finish(struct aff *aff)
{
    for (size_t i = 0; i < aff->group_count; i++)
        aff_group_finish(aff->groups[i]);
    for (size_t i = 0; i < aff->text_count; i++) {
        free(aff->texts[i].name);
        free(aff->texts[i].bytes);
    }
    for (size_t i = 0; i < aff->texture_count; i++)
        free(aff->textures[i]);
    for (size_t i = 0; i < aff->key_count; i++)
        aff_keys_finish(&aff->keys[i]);
    free(aff->groups);
    free(aff->texts);
    free(aff->textures);
    free(aff->keys);
    free(aff->named_lights);
    nff_free(&aff->nff);
    free(aff);
}

bool aff_import(struct import_scene *scene, struct files *files, const unsigned char *bytes, size_t size_bytes)
{
    struct aff *aff = calloc(1, sizeof(*aff));
    struct aff_group *root;
    bool imported = false;

    if (!aff)
        return import_fail(scene, NULL, "out of memory");
    nff_init(&aff->nff, scene, bytes, size_bytes);
    aff->nff.reader.comment_marks = "#%";
    aff->nff.reader.word_marks = "{}";
    aff->nff.reader.free_form = true;
    aff->files = files;
    aff->blocks[0].group_from_block = placement_identity();
    for (int c = 0; c < 3; c++)
        aff->nff.ambient[c] = 1; /* without `am` */
    root = aff_add_group(aff);
    if (root) {
        aff->nff.shapes = &root->shapes;
        imported = read_text(aff) && aff_add_all(aff);
    }
    aff_finish(aff);
    return imported && !scene->failed;
}
