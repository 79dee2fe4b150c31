/* SPDX-License-Identifier: MIT */
/* Positions and scales are sent as they are: cubic polynomials between keys. Rotations are no polynomials, so they
 * are sampled. */
#include "aff_channel.h"

#include "model.h"

#include <math.h>
#include <string.h>

/* Radians between a rotation and its samples, about: far less than a pixel. */
#define ROTATION_ERROR 1e-4
#define ROTATION_HALVINGS 12 /* of the time between two keys */
#define CHANNEL_KEYS_MAX (1u << 24)

static bool push(struct aff_clip *clip, float **array, size_t *count, size_t *capacity, double value)
{
    float *grown = import_grow(clip->aff->nff.scene, *array, *count, capacity, sizeof(*grown));

    if (!grown)
        return false;
    *array = grown;
    grown[(*count)++] = (float)fmin(fmax(value, -1e12), 1e12);
    return true;
}

/* Keys at one time are moved apart by as little as possible, so that a jump stays one. */
static bool push_key(struct aff_clip *clip, double time, const double *values, size_t width)
{
    double at = time - (double)clip->aff->start_s;
    bool pushed;

    if (clip->time_count == CHANNEL_KEYS_MAX)
        return import_fail(clip->aff->nff.scene, NULL, "a property of 'k' needs more than %u keys",
                           CHANNEL_KEYS_MAX);
    if (clip->time_count > 0 && (float)at <= clip->times[clip->time_count - 1])
        at = (double)nextafterf(clip->times[clip->time_count - 1], INFINITY);
    pushed = push(clip, &clip->times, &clip->time_count, &clip->time_capacity, at);
    for (size_t i = 0; i < width && pushed; i++)
        pushed = push(clip, &clip->values, &clip->value_count, &clip->value_capacity, values[i]);
    return pushed;
}

static bool append(struct aff_clip *clip, const float *from, size_t count, uint32_t *first)
{
    if (count > UINT32_MAX - clip->float_count)
        return import_fail(clip->aff->nff.scene, NULL, "the animation has too many keys");
    *first = (uint32_t)clip->float_count;
    for (size_t i = 0; i < count; i++)
        if (!push(clip, &clip->floats, &clip->float_count, &clip->float_capacity, (double)from[i]))
            return false;
    return true;
}

/* Adds the channel of the keys that were pushed. */
static bool add_channel(struct aff_clip *clip, enum protocol_channel_path path, uint32_t node,
                        enum protocol_interpolation interpolation, uint32_t width)
{
    struct import_scene *scene = clip->aff->nff.scene;
    struct message_set_channel channel = {
        .path = path, .object = node, .interpolation = interpolation, .width = width};

    if (clip->id == 0)
        clip->id = import_reserve_id(scene, PROTOCOL_OBJECT_CLIP);
    channel.clip = clip->id;
    channel.key_count = (uint32_t)clip->time_count;
    if (!append(clip, clip->times, clip->time_count, &channel.first_time) ||
        !append(clip, clip->values, clip->value_count, &channel.first_value))
        return false;
    clip->end_s = fmax(clip->end_s, (double)clip->times[clip->time_count - 1]);
    clip->time_count = clip->value_count = 0;
    clip->channel_count++;
    return import_add_channel(scene, &channel) != 0;
}

/* Every channel ends with the animation, so that a clip that repeats does so when it should. Without `a` all keys
 * play. */
static double end_of(const struct aff_clip *clip)
{
    return clip->aff->has_animation ? (double)clip->aff->end_s : HUGE_VAL;
}

/* Holds what came last, `width` numbers, until the animation's end. */
static bool hold_until_end(struct aff_clip *clip, size_t width)
{
    double last[IMPORT_TARGETS_MAX];

    if (!clip->aff->has_animation || clip->aff->end_s - clip->aff->start_s <= clip->times[clip->time_count - 1])
        return true;
    for (size_t i = 0; i < width; i++)
        last[i] = (double)clip->values[clip->value_count - width + i];
    return push_key(clip, end_of(clip), last, width);
}

/* ---- properties ---- */

/* In-tangent, value and out-tangent at a time that is no key's, or beyond all of them. */
static bool push_position_at(struct aff_clip *clip, const struct aff_curve *curve, double time)
{
    double key[9];

    spline_position(curve->keys, curve->count, time, key + 3, key);
    if (time >= curve->keys[curve->count - 2].time)
        memset(key, 0, 3 * sizeof(*key));
    memset(key + 6, 0, 3 * sizeof(*key));
    return push_key(clip, time, key, 9);
}

static bool add_position(struct aff_clip *clip, const struct aff_curve *curve, enum protocol_channel_path path,
                         uint32_t node)
{
    bool pushed = true;
    size_t i = 1;

    for (; pushed && i + 1 < curve->count && curve->keys[i].time <= end_of(clip); i++) {
        double key[9]; /* in-tangent, value, out-tangent */

        spline_tangents(curve->keys, i, key, key + 6);
        memcpy(key + 3, curve->keys[i].value, 3 * sizeof(*key));
        if (i + 2 == curve->count) /* what follows is held */
            memset(key + 6, 0, 3 * sizeof(*key));
        pushed = push_key(clip, curve->keys[i].time, key, 9);
    }
    /* The same polynomial, cut short; or the last value, held. */
    if (pushed && clip->aff->has_animation && (i == 1 || curve->keys[i - 1].time < end_of(clip)))
        pushed = push_position_at(clip, curve, end_of(clip));
    return pushed && add_channel(clip, path, node, PROTOCOL_INTERPOLATION_CUBIC_SPLINE, 3);
}

/* Half of the angle of the turn between them. */
static double distance(const double a[4], const double b[4])
{
    return acos(fmin(fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]), 1));
}

struct sampled {
    double time, rotation[4];
};

static struct sampled sample(const struct aff_curve *curve, double time)
{
    struct sampled sampled = {.time = time};

    spline_rotation(curve->keys, curve->count, time, sampled.rotation);
    return sampled;
}

/* Whether the arc from a to b stands for the curve between them; three places, as an S may touch it in the middle.
 */
static bool close_enough(const struct aff_curve *curve, const struct sampled *a, const struct sampled *b)
{
    for (int i = 1; i < 4; i++) {
        struct sampled middle = sample(curve, a->time + (b->time - a->time) * i / 4);
        double arc[4];

        spline_slerp(a->rotation, b->rotation, i / 4.0, arc);
        if (!(2 * distance(middle.rotation, arc) <= ROTATION_ERROR))
            return false;
    }
    return true;
}

/* Samples after a up to b. */
static bool sample_between(struct aff_clip *clip, const struct aff_curve *curve, const struct sampled *a,
                           const struct sampled *b)
{
    struct sampled at = *a, ends[ROTATION_HALVINGS + 1];
    size_t depth = 0;

    ends[0] = *b;
    for (;;) {
        if (depth < ROTATION_HALVINGS && !close_enough(curve, &at, &ends[depth])) {
            ends[depth + 1] = sample(curve, (at.time + ends[depth].time) / 2);
            depth++;
            continue;
        }
        at = ends[depth];
        if (!push_key(clip, at.time, at.rotation, 4))
            return false;
        if (depth-- == 0)
            return true;
    }
}

static bool add_rotation(struct aff_clip *clip, const struct aff_curve *curve, uint32_t node)
{
    struct sampled before = {.time = fmin(curve->keys[1].time, end_of(clip))};
    bool pushed;

    memcpy(before.rotation, curve->keys[1].value, sizeof(before.rotation));
    pushed = push_key(clip, before.time, before.rotation, 4);
    for (size_t i = 2; pushed && i + 1 < curve->count && before.time < end_of(clip); i++) {
        struct sampled key = {.time = curve->keys[i].time};

        memcpy(key.rotation, curve->keys[i].value, sizeof(key.rotation));
        if (key.time > end_of(clip))
            key = sample(curve, end_of(clip));
        pushed = key.time > before.time ? sample_between(clip, curve, &before, &key)
                                        : push_key(clip, key.time, key.rotation, 4);
        before = key;
    }
    return pushed && hold_until_end(clip, 4) &&
           add_channel(clip, PROTOCOL_CHANNEL_NODE_ROTATION, node, PROTOCOL_INTERPOLATION_LINEAR, 4);
}

/* Before its first key everything is visible. */
static bool add_visibility(struct aff_clip *clip, const struct aff_curve *curve, uint32_t node)
{
    const double shown = 0;

    if (curve->keys[0].time > (double)clip->aff->start_s && !push_key(clip, (double)clip->aff->start_s, &shown, 1))
        return false;
    for (size_t i = 0; i < curve->count && (i == 0 || curve->keys[i].time <= end_of(clip)); i++) {
        double hidden = 1 - curve->keys[i].value[0];

        if (!push_key(clip, curve->keys[i].time, &hidden, 1))
            return false;
    }
    return hold_until_end(clip, 1) &&
           add_channel(clip, PROTOCOL_CHANNEL_NODE_HIDDEN, node, PROTOCOL_INTERPOLATION_STEP, 1);
}

bool aff_add_morph_channel(struct aff_clip *clip, const struct aff_morph *morph)
{
    uint32_t width = morph->time_count - 1;

    if (width == 0)
        return true;
    for (uint32_t i = 0; i < morph->time_count; i++) {
        float weights[IMPORT_TARGETS_MAX];
        double values[IMPORT_TARGETS_MAX], time = fmin((double)morph->times[i], end_of(clip));

        aff_morph_weights(morph, time, weights);
        for (uint32_t k = 0; k < width; k++)
            values[k] = (double)weights[k];
        if (!push_key(clip, time, values, width))
            return false;
        if (time >= end_of(clip))
            break;
    }
    return hold_until_end(clip, width) &&
           add_channel(clip, PROTOCOL_CHANNEL_NODE_WEIGHTS, morph->node, PROTOCOL_INTERPOLATION_LINEAR, width);
}

/* ---- of an object ---- */

bool aff_add_constant_channels(struct aff_clip *clip, const struct aff_curve *curves, uint32_t node)
{
    static const struct {
        enum protocol_channel_path path;
        uint32_t width;
        double value[4];
    } constants[] = {
        [AFF_TRANSL] = {PROTOCOL_CHANNEL_NODE_TRANSLATION, 3, {0}},
        [AFF_ROT] = {PROTOCOL_CHANNEL_NODE_ROTATION, 4, {0, 0, 0, 1}},
        [AFF_SCALE] = {PROTOCOL_CHANNEL_NODE_SCALE, 3, {1, 1, 1}},
    };

    for (unsigned i = AFF_TRANSL; i <= AFF_SCALE; i++)
        if (curves[i].count == 0 &&
            (!push_key(clip, (double)clip->aff->start_s, constants[i].value, constants[i].width) ||
             !add_channel(clip, constants[i].path, node, PROTOCOL_INTERPOLATION_STEP, constants[i].width)))
            return false;
    return true;
}

bool aff_add_channels(struct aff_clip *clip, struct aff_keys *keys, uint32_t node, unsigned wanted)
{
    if (!keys)
        return true;
    keys->used = true;
    for (unsigned i = 0; i < AFF_PROPERTY_COUNT; i++) {
        const struct aff_curve *curve = &keys->curves[i];
        bool added;

        if (curve->count == 0 || !(wanted & 1u << i))
            continue;
        if (i == AFF_ROT)
            added = add_rotation(clip, curve, node);
        else if (i == AFF_VISIBILITY)
            added = add_visibility(clip, curve, node);
        else
            added = add_position(clip, curve,
                                 i == AFF_TRANSL ? PROTOCOL_CHANNEL_NODE_TRANSLATION : PROTOCOL_CHANNEL_NODE_SCALE,
                                 node);
        if (!added)
            return false;
    }
    return true;
}
