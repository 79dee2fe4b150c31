/* SPDX-License-Identifier: MIT */
/* A clip that the client creates: one blob of times and values, and one transaction. */
#include "lib/scene.h"
#include "lib/text.h"
#include "protocol/common/blob_hash.h"
#include "protocol/common/clock.h"

#include <stdlib.h>
#include <string.h>

#define ANSWER_NS 60000000000ull
#define PIECE_BYTES 262144u
/* 256 MiB: far above any real clip, far below the range of sizes. */
#define NUMBERS_MAX (1u << 26)

struct clip {
    struct fl_scene *scene;
    float *numbers;
    size_t count;
    struct record_blob_ref blob;
};

static size_t numbers_per_key(const struct fl_channel *channel)
{
    const bool has_handles = channel->interpolation == PROTOCOL_INTERPOLATION_CUBIC_SPLINE ||
                             channel->interpolation == PROTOCOL_INTERPOLATION_BEZIER;
    return (size_t)channel->width * (has_handles ? 3 : 1);
}

/* Puts the numbers of all channels into one blob: the times of a channel, then its values. */
static bool gather(struct clip *clip, const struct fl_channel *channels, size_t channel_count,
                   struct fl_error *error)
{
    uint64_t total = 0;
    for (size_t i = 0; i < channel_count; i++) {
        const struct fl_channel *channel = &channels[i];
        if (channel->key_count == 0 || channel->key_count > NUMBERS_MAX || channel->width == 0 ||
            channel->width > 1024)
            return fl_error_set(error, FL_ERROR_ARGUMENT, "clip", "channel %zu has no keys or too many", i);
        total += (uint64_t)channel->key_count * (1 + numbers_per_key(channel));
        if (total > NUMBERS_MAX)
            return fl_error_set(error, FL_ERROR_ARGUMENT, "clip", "it has more than %u numbers", NUMBERS_MAX);
    }
    clip->numbers = calloc((size_t)total + 1, sizeof(*clip->numbers));
    if (!clip->numbers)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < channel_count; i++) {
        const size_t values = channels[i].key_count * numbers_per_key(&channels[i]);
        memcpy(clip->numbers + clip->count, channels[i].times, channels[i].key_count * sizeof(float));
        memcpy(clip->numbers + clip->count + channels[i].key_count, channels[i].values, values * sizeof(float));
        clip->count += channels[i].key_count + values;
    }
    clip->blob.size_bytes = clip->count * sizeof(float);
    blob_hash(clip->blob.hash, (const uint8_t *)clip->numbers, clip->blob.size_bytes);
    return true;
}

/* Sends the blob in chunks under a single request, which gets a single answer. */
static bool send_blob(const struct clip *clip, uint64_t deadline_ns, struct fl_error *error)
{
    struct fl_connection *connection = clip->scene->connection;
    const uint32_t request = fl_connection_next_request(connection);
    struct message message = {.type = MESSAGE_BLOB_DATA};
    struct message_blob_data *data = &message.blob_data;
    memcpy(data->hash, clip->blob.hash, BLOB_HASH_BYTES);
    for (uint64_t at = 0; at < clip->blob.size_bytes; at += data->data_bytes) {
        const uint64_t left = clip->blob.size_bytes - at;
        data->offset_bytes = at;
        data->data = (const uint8_t *)clip->numbers + at;
        data->data_bytes = left < PIECE_BYTES ? (uint32_t)left : PIECE_BYTES;
        if (!fl_connection_wait_upload(connection, request, connection->upload_sent + data->data_bytes,
                                       deadline_ns, error) ||
            !fl_connection_send(connection, request, FL_UPLOAD_CHANNEL, &message, error))
            return false;
        connection->upload_sent += data->data_bytes;
    }
    struct fl_received received;
    return fl_connection_answer(connection, request, MESSAGE_OK, &received, deadline_ns, error);
}

static bool upload(const struct clip *clip, uint64_t deadline_ns, struct fl_error *error)
{
    struct fl_connection *connection = clip->scene->connection;
    const uint32_t request = fl_connection_next_request(connection);
    struct record_blob_ref offered = clip->blob;
    struct message offer = {.type = MESSAGE_BLOB_OFFER};
    struct fl_received received;
    offer.blob_offer.blobs = &offered;
    offer.blob_offer.blobs_count = 1;
    return fl_connection_send(connection, request, 0, &offer, error) &&
           fl_connection_answer(connection, request, MESSAGE_BLOB_NEED, &received, deadline_ns, error) &&
           (received.message.blob_need.needed_count == 0 || send_blob(clip, deadline_ns, error));
}

/* Sends one edit of the transaction. */
static bool edit(const struct clip *clip, uint32_t request, const struct message *message, uint64_t deadline_ns,
                 struct fl_error *error)
{
    struct fl_connection *connection = clip->scene->connection;
    return fl_connection_wait_upload(connection, request, 0, deadline_ns, error) &&
           fl_connection_send(connection, request, 0, message, error);
}

static bool send_channels(const struct clip *clip, uint32_t request, uint32_t id,
                          const struct fl_channel *channels, size_t channel_count, uint64_t deadline_ns,
                          struct fl_error *error)
{
    size_t at = 0;
    for (size_t i = 0; i < channel_count; i++) {
        struct message message = {.type = MESSAGE_SET_CHANNEL};
        struct message_set_channel *channel = &message.set_channel;
        channel->channel = fl_scene_new_id(clip->scene, PROTOCOL_OBJECT_CHANNEL);
        channel->value.clip = id;
        channel->value.path = channels[i].path;
        channel->value.object = channels[i].object;
        channel->value.interpolation = channels[i].interpolation;
        channel->value.width = channels[i].width;
        channel->value.key_count = channels[i].key_count;
        channel->value.first_time = (uint32_t)at;
        channel->value.first_value = (uint32_t)at + channels[i].key_count;
        at += channels[i].key_count * (1 + numbers_per_key(&channels[i]));
        if (!edit(clip, request, &message, deadline_ns, error))
            return false;
    }
    return true;
}

/* Records an added clip for removal. Without memory for it the clip stays, even in another client's scene. */
static bool take_note(struct fl_scene *scene, uint32_t id, uint64_t revision)
{
    if (revision > scene->revision)
        scene->revision = revision;
    if (scene->attached &&
        fl_grow((void **)&scene->clips, &scene->clip_capacity, scene->clip_count, sizeof(*scene->clips), NULL))
        scene->clips[scene->clip_count++] = id;
    return true;
}

static bool commit(const struct clip *clip, const char *name, uint32_t id, const struct fl_channel *channels,
                   size_t channel_count, uint64_t deadline_ns, struct fl_error *error)
{
    struct fl_connection *connection = clip->scene->connection;
    const uint32_t request = fl_connection_next_request(connection);
    struct record_blob_ref blob = clip->blob;
    struct message begin = {.type = MESSAGE_EDIT_BEGIN}, set = {.type = MESSAGE_SET_CLIP},
                   end = {.type = MESSAGE_EDIT_COMMIT};
    struct fl_received received;
    char short_name[129];
    fl_text_utf8(name, short_name, sizeof(short_name));
    begin.edit_begin.scene = clip->scene->scene;
    set.set_clip.clip = id;
    set.set_clip.arrays = &blob;
    set.set_clip.arrays_count = 1;
    set.set_clip.name = short_name;
    return edit(clip, request, &begin, deadline_ns, error) && edit(clip, request, &set, deadline_ns, error) &&
           send_channels(clip, request, id, channels, channel_count, deadline_ns, error) &&
           edit(clip, request, &end, deadline_ns, error) &&
           fl_connection_answer(connection, request, MESSAGE_OK, &received, deadline_ns, error) &&
           take_note(clip->scene, id, received.message.ok.revision);
}

bool fl_scene_add_clip(struct fl_scene *scene, const char *name, const struct fl_channel *channels,
                       size_t channel_count, uint32_t *clip, struct fl_error *error)
{
    struct clip made = {.scene = scene};
    const uint64_t deadline_ns = monotonic_now_ns() + ANSWER_NS;
    const uint32_t id = fl_scene_new_id(scene, PROTOCOL_OBJECT_CLIP);
    const bool added = gather(&made, channels, channel_count, error) && upload(&made, deadline_ns, error) &&
                       commit(&made, name, id, channels, channel_count, deadline_ns, error);
    free(made.numbers);
    *clip = added ? id : 0;
    return added;
}
