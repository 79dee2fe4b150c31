/* SPDX-License-Identifier: MIT */
#include "aff.h"

#include "model.h"

#include <stdlib.h>
#include <string.h>

static const struct property {
    const char *word;
    uint32_t numbers; /* a key, with its time */
    uint32_t keys_min;
} properties[AFF_PROPERTY_COUNT] = {
    [AFF_TRANSL] = {"transl", 7, SPLINE_KEYS_MIN},
    [AFF_ROT] = {"rot", 8, SPLINE_KEYS_MIN},
    [AFF_SCALE] = {"scale", 7, SPLINE_KEYS_MIN},
    [AFF_VISIBILITY] = {"visibility", 2, 1},
};

void aff_keys_finish(struct aff_keys *keys)
{
    for (int i = 0; i < AFF_PROPERTY_COUNT; i++)
        free(keys->curves[i].keys);
}

static struct spline_key key_of(enum aff_property property, const float *n)
{
    struct spline_key key = {.time = (double)n[0]};
    const float *shape = n + properties[property].numbers - 3; /* tension, continuity, bias */

    for (int c = 0; c < 3 && property != AFF_VISIBILITY; c++)
        key.value[c] = (double)n[1 + c];
    if (property == AFF_ROT) {
        const double axis[3] = {key.value[0], key.value[1], key.value[2]};

        placement_turn(axis, (double)n[4], key.value);
    }
    if (property == AFF_VISIBILITY) {
        key.value[0] = n[1] != 0.0f;
        return key;
    }
    key.tension = (double)shape[0];
    key.continuity = (double)shape[1];
    key.bias = (double)shape[2];
    return key;
}

static bool read_curve(struct aff *aff, enum aff_property property, struct aff_curve *curve)
{
    const struct property *p = &properties[property];
    struct word_reader *reader = &aff->nff.reader;
    uint32_t count;

    if (curve->count > 0)
        return import_fail(aff->nff.scene, word_reader_where(reader), "a second '%s' in one 'k'", p->word);
    if (!word_reader_count(reader, &count, p->keys_min, UINT32_MAX / 8, p->word) ||
        !word_reader_can_hold(reader, (uint64_t)count * p->numbers, p->word))
        return false;
    curve->keys = malloc(count * sizeof(*curve->keys));
    if (!curve->keys)
        return import_fail(aff->nff.scene, NULL, "out of memory");
    for (uint32_t i = 0; i < count; i++) {
        struct spline_key key;
        float numbers[8];

        if (!word_reader_numbers(reader, numbers, p->numbers, p->word))
            return false;
        key = key_of(property, numbers);
        if (curve->count == 0 || key.time >= curve->keys[curve->count - 1].time)
            curve->keys[curve->count++] = key;
        else /* there is one in BART's robot; its reader does not get to it, either */
            import_note(aff->nff.scene, PROTOCOL_SEVERITY_WARNING, word_reader_where(reader),
                        "keys that go back in time are left out");
    }
    if (curve->count < p->keys_min)
        return import_fail(aff->nff.scene, word_reader_where(reader),
                           "%zu keys of '%s' are in the order of time; at least %u are needed", curve->count,
                           p->word, p->keys_min);
    if (property == AFF_ROT)
        spline_align(curve->keys, curve->count);
    return true;
}

static bool read_curves(struct aff *aff, struct aff_keys *keys)
{
    struct word_reader *reader = &aff->nff.reader;
    struct word word;

    for (;;) {
        int property = 0;

        if (!word_reader_get(reader, &word, "k"))
            return false;
        if (word_is(word, "}"))
            return true;
        while (property < AFF_PROPERTY_COUNT && !word_is(word, properties[property].word))
            property++;
        if (word_is(word, "visible"))
            property = AFF_VISIBILITY;
        if (property == AFF_PROPERTY_COUNT)
            return import_fail(aff->nff.scene, word_reader_where(reader),
                               "'%.*s' is not a property of 'k'; transl, rot, scale and visibility are",
                               word_shown(word), word.text);
        if (!read_curve(aff, (enum aff_property)property, &keys->curves[property]))
            return false;
    }
}

bool aff_read_keys(struct aff *aff)
{
    struct import_scene *scene = aff->nff.scene;
    struct word_reader *reader = &aff->nff.reader;
    struct aff_keys *grown;
    struct word word;

    if (aff->key_count == AFF_GROUPS_MAX)
        return import_fail(scene, word_reader_where(reader), "more than %u 'k'", AFF_GROUPS_MAX);
    grown = import_grow(scene, aff->keys, aff->key_count, &aff->key_capacity, sizeof(*grown));
    if (!grown)
        return false;
    aff->keys = grown;
    grown += aff->key_count++;
    *grown = (struct aff_keys){0};
    if (!aff_read_name(aff, grown->name, "k") || !word_reader_get(reader, &word, "k"))
        return false;
    if (!word_is(word, "{"))
        return import_fail(scene, word_reader_where(reader), "'{' should follow 'k %s', but there is '%.*s'",
                           grown->name, word_shown(word), word.text);
    return read_curves(aff, grown);
}

struct aff_keys *aff_find_keys(const struct aff *aff, const char *name)
{
    for (size_t i = aff->key_count; i-- > 0;)
        if (strcmp(aff->keys[i].name, name) == 0)
            return &aff->keys[i];
    return NULL;
}

struct placement aff_pose_at(const struct aff_keys *keys, double time_s)
{
    double translation[3] = {0}, rotation[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
    const struct aff_curve *curves;

    if (!keys)
        return placement_identity();
    curves = keys->curves;
    if (curves[AFF_TRANSL].count > 0)
        spline_position(curves[AFF_TRANSL].keys, curves[AFF_TRANSL].count, time_s, translation, NULL);
    if (curves[AFF_ROT].count > 0)
        spline_rotation(curves[AFF_ROT].keys, curves[AFF_ROT].count, time_s, rotation);
    if (curves[AFF_SCALE].count > 0)
        spline_position(curves[AFF_SCALE].keys, curves[AFF_SCALE].count, time_s, scale, NULL);
    return placement_from_parts(scale, rotation, translation);
}

bool aff_visible_at(const struct aff_keys *keys, double time_s)
{
    bool visible = true;

    if (!keys)
        return true;
    for (size_t i = 0; i < keys->curves[AFF_VISIBILITY].count; i++)
        if (keys->curves[AFF_VISIBILITY].keys[i].time <= time_s)
            visible = keys->curves[AFF_VISIBILITY].keys[i].value[0] > 0;
    return visible;
}
