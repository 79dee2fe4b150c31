/* SPDX-License-Identifier: MIT */
#include "session/upload.h"

#include "session/session.h"

#include <inttypes.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- offers ------------------------------------------------------------------------------------------ */

_Static_assert(SESSION_OFFERS_KEY_BYTES == crypto_shorthash_KEYBYTES, "the key is libsodium's");
_Static_assert(crypto_shorthash_BYTES == sizeof(uint64_t), "a hash of a hash is a key of the map");

/* Key of an offered hash in the map. Hashes are only claims: a client may invent many whose fixed part is equal,
 * so a secret key hashes them again. */
static uint64_t key_of(const struct session *session, const uint8_t hash[BLOB_HASH_BYTES])
{
    uint8_t bytes[crypto_shorthash_BYTES];
    crypto_shorthash(bytes, hash, BLOB_HASH_BYTES, session->blobs.offers_key);
    uint64_t key;
    memcpy(&key, bytes, sizeof(key));
    return key;
}

struct offer *upload_find(const struct session *session, const uint8_t hash[BLOB_HASH_BYTES])
{
    struct offer *offer = hashmap_get(&session->blobs.offers, key_of(session, hash));
    while (offer && memcmp(offer->hash, hash, BLOB_HASH_BYTES) != 0)
        offer = (struct offer *)offer->same_key.next;
    return offer;
}

struct offer *upload_add(struct session *session, const struct record_blob_ref *reference, struct error *error)
{
    if (session->blobs.offer_count >= session->hub->options.limits.blobs_per_client) {
        error_set(error, ERROR_LIMIT, "blob_offer.blobs", "a client may name %u blobs",
                  session->hub->options.limits.blobs_per_client);
        error_remedy(error, "connect again, or raise limits.blobs in the daemon's configuration");
        return NULL;
    }
    struct offer *offer = calloc(1, sizeof(*offer));
    if (offer) {
        memcpy(offer->hash, reference->hash, BLOB_HASH_BYTES);
        offer->size_bytes = reference->size_bytes;
    }
    if (!offer || !hashmap_chain(&session->blobs.offers, key_of(session, reference->hash), &offer->same_key)) {
        free(offer);
        error_set(error, ERROR_OUT_OF_MEMORY, "blob_offer.blobs", "no memory");
        return NULL;
    }
    session->blobs.offer_count++;
    return offer;
}

/* Adds an offered blob; *needed: whether the client must send it. */
static bool add_offer(struct session *session, const struct record_blob_ref *reference, bool *needed,
                      struct error *error)
{
    *needed = false;
    if (!reference->size_bytes)
        return true; /* an empty reference */
    struct offer *offer = upload_find(session, reference->hash);
    if (!offer && !(offer = upload_add(session, reference, error)))
        return false;
    if (offer->size_bytes != reference->size_bytes)
        return error_set(error, ERROR_INVALID, "blob_offer.blobs",
                         "the same hash was offered with %" PRIu64 " and with %" PRIu64 " bytes",
                         offer->size_bytes, reference->size_bytes);
    if (!offer->held)
        offer->held = blob_store_find(session->hub->blobs, session->principal, offer->hash, offer->size_bytes);
    *needed = !offer->held;
    return true;
}

void upload_offer(struct session *session, struct request *request, const struct message_blob_offer *message)
{
    struct error error = {0};
    struct record_blob_index *needed = calloc(message->blobs_count + 1u, sizeof(*needed));
    if (!needed)
        error_set(&error, ERROR_OUT_OF_MEMORY, "blob_offer", "no memory");
    struct message answer;
    message_init(&answer, MESSAGE_BLOB_NEED);
    answer.blob_need.needed = needed;
    for (uint32_t i = 0; needed && i < message->blobs_count; i++) {
        bool is_needed;
        if (!add_offer(session, &message->blobs[i], &is_needed, &error))
            break;
        if (is_needed)
            needed[answer.blob_need.needed_count++].index = i;
    }
    if (error.kind) {
        request_answer_error(session, request, &error);
    } else {
        session_send(session, request->id, 0, &answer);
        request_answered(session, request);
    }
    free(needed);
}

static bool resolve(void *context, const struct record_blob_ref *reference, const char *field, struct blob **blob,
                    struct error *error)
{
    const struct session *session = context;
    *blob = NULL;
    if (!reference->size_bytes)
        return true;
    const struct offer *offer = upload_find(session, reference->hash);
    if (offer && offer->held && offer->size_bytes == reference->size_bytes) {
        *blob = blob_ref(offer->held);
        return true;
    }
    char text[2 * BLOB_HASH_BYTES + 1];
    sodium_bin2hex(text, sizeof(text), reference->hash, BLOB_HASH_BYTES);
    error_set(error, ERROR_UNKNOWN_ID, field, "blob %s of %" PRIu64 " bytes is not held", text,
              reference->size_bytes);
    return error_remedy(error, "offer it on this connection, and send it if it is needed, before the edit");
}

struct edit_source upload_source(struct session *session)
{
    return (struct edit_source){resolve, session, session->hub->options.limits.texture_edge_texels};
}

/* ---- pieces ------------------------------------------------------------------------------------------ */

void upload_abandon(struct session *session, struct offer *offer)
{
    if (!offer->arriving)
        return;
    hasher_await(session->hub->hasher, &offer->hashes_left);
    blob_store_release(session->hub->blobs, offer->arrived_bytes);
    blob_unref(offer->arriving);
    free(offer->chunk_hashes);
    offer->arriving = NULL;
    offer->chunk_hashes = NULL;
    offer->chunk_hashes_max = 0;
    offer->arrived_bytes = 0;
}

/* Sends new credit when half the window is used up, so that it costs few messages; absolute, so that it cannot
 * drift. */
static void send_credit(struct session *session)
{
    struct session_blobs *blobs = &session->blobs;
    uint64_t window_bytes = session->hub->options.limits.upload_window_bytes;
    if (blobs->credit_bytes - blobs->received_bytes > window_bytes / 2)
        return;
    blobs->credit_bytes = blobs->received_bytes + window_bytes;
    struct message message;
    message_init(&message, MESSAGE_CREDIT);
    message.credit.channel = UPLOAD_CHANNEL;
    message.credit.total = blobs->credit_bytes;
    session_send(session, 0, UPLOAD_CHANNEL, &message);
}

void upload_begin(struct session *session)
{
    randombytes_buf(session->blobs.offers_key, sizeof(session->blobs.offers_key));
    send_credit(session);
}

/* A blob that cannot fit is refused before it arrives; memory is reserved chunk by chunk, so that a declared size
 * alone keeps no other client's blobs out. */
static bool begin_blob(struct session *session, struct offer *offer, struct error *error)
{
    if (!blob_store_reserve(session->hub->blobs, offer->size_bytes, error))
        return false;
    blob_store_release(session->hub->blobs, offer->size_bytes);
    offer->arriving = blob_create_empty(offer->size_bytes);
    return offer->arriving || error_set(error, ERROR_OUT_OF_MEMORY, "blob_data", "no memory for %" PRIu64 " bytes",
                                        offer->size_bytes);
}

static bool reserve_hashes(const struct session *session, struct offer *offer, uint64_t count)
{
    if (count <= offer->chunk_hashes_max)
        return true;
    const uint64_t max = count > 2 * offer->chunk_hashes_max ? count : 2 * offer->chunk_hashes_max;
    hasher_await(session->hub->hasher, &offer->hashes_left);
    uint8_t *hashes = realloc(offer->chunk_hashes, (size_t)max * BLOB_HASH_BYTES);
    if (!hashes)
        return false;
    offer->chunk_hashes = hashes;
    offer->chunk_hashes_max = (size_t)max;
    return true;
}

static bool hash_arrived(const struct session *session, struct offer *offer, uint64_t before_bytes,
                         struct error *error)
{
    struct hasher *hasher = session->hub->hasher;
    uint64_t first = before_bytes / BLOB_CHUNK_BYTES, end = offer->arrived_bytes / BLOB_CHUNK_BYTES;
    bool complete = offer->arrived_bytes == offer->size_bytes;
    if (complete && offer->arrived_bytes % BLOB_CHUNK_BYTES)
        end++;
    if (first == end)
        return true;
    if (!reserve_hashes(session, offer, end))
        return error_set(error, ERROR_OUT_OF_MEMORY, "blob_data", "no memory");
    for (uint64_t chunk = first; chunk < end; chunk++) {
        uint64_t start_bytes = chunk * BLOB_CHUNK_BYTES;
        hasher_add(hasher, offer->chunk_hashes + chunk * BLOB_HASH_BYTES, offer->arriving->data + start_bytes,
                   blob_chunk_bytes(offer->arrived_bytes, start_bytes), &offer->hashes_left);
    }
    if (!complete)
        return true;
    hasher_await(hasher, &offer->hashes_left);
    blob_hash_chunks(offer->arriving->hash, offer->chunk_hashes, (size_t)end);
    return true;
}

/* Reserves memory for that many bytes. If arrived bytes must move, waits for their hashes. */
static bool reserve_bytes(const struct session *session, struct offer *offer, size_t needed_bytes)
{
    if (needed_bytes > offer->arriving->capacity_bytes)
        hasher_await(session->hub->hasher, &offer->hashes_left);
    return blob_reserve(offer->arriving, needed_bytes);
}

static bool add_piece(struct session *session, struct offer *offer, const struct message_blob_data *data,
                      struct error *error)
{
    if (data->offset_bytes != offer->arrived_bytes)
        return error_set(error, ERROR_INVALID, "blob_data.offset_bytes",
                         "%" PRIu64 " came where %" PRIu64 " was due", data->offset_bytes, offer->arrived_bytes);
    if (!data->data_bytes || data->data_bytes > offer->size_bytes - offer->arrived_bytes)
        return error_set(error, ERROR_INVALID, "blob_data.data", "%u bytes came where 1 to %" PRIu64 " were left",
                         data->data_bytes, offer->size_bytes - offer->arrived_bytes);
    if (!offer->arriving && !begin_blob(session, offer, error))
        return false;
    if (!blob_store_reserve(session->hub->blobs, data->data_bytes, error))
        return false;
    uint64_t before_bytes = offer->arrived_bytes;
    if (!reserve_bytes(session, offer, (size_t)(before_bytes + data->data_bytes))) {
        blob_store_release(session->hub->blobs, data->data_bytes);
        return error_set(error, ERROR_OUT_OF_MEMORY, "blob_data", "no memory for %" PRIu64 " bytes",
                         before_bytes + data->data_bytes);
    }
    memcpy(offer->arriving->data + before_bytes, data->data, data->data_bytes);
    offer->arrived_bytes += data->data_bytes;
    return hash_arrived(session, offer, before_bytes, error);
}

/* Verifies the hash after the last chunk has arrived, and adds the blob to the store. */
static bool complete(struct session *session, struct offer *offer, struct error *error)
{
    if (memcmp(offer->arriving->hash, offer->hash, BLOB_HASH_BYTES) != 0) {
        char named[2 * BLOB_HASH_BYTES + 1], found[2 * BLOB_HASH_BYTES + 1];
        sodium_bin2hex(named, sizeof(named), offer->hash, BLOB_HASH_BYTES);
        sodium_bin2hex(found, sizeof(found), offer->arriving->hash, BLOB_HASH_BYTES);
        return error_set(error, ERROR_HASH_MISMATCH, "blob_data", "the bytes of blob %s have the hash %s", named,
                         found);
    }
    offer->held = blob_store_add(session->hub->blobs, session->principal, offer->arriving);
    return offer->held || error_set(error, ERROR_OUT_OF_MEMORY, "blob_data", "no memory");
}

/* The request of the chunk; NULL: it was already answered or refused. */
static struct request *request_of(struct session *session, const struct framing_header *header,
                                  const struct message_blob_data *data)
{
    struct request *request = request_find(session, header->request);
    if (request && request->kind == REQUEST_UPLOAD)
        return request;
    if (requests_is_dead(session, header->request)) {
        if (data->offset_bytes)
            return NULL;
        requests_forget_dead(session, header->request); /* the number is used anew */
    }
    request = request_begin(session, header->request, REQUEST_UPLOAD);
    if (!request)
        requests_bury(session, header->request);
    return request;
}

static bool take_piece(struct session *session, struct request *request, const struct message_blob_data *data,
                       struct error *error)
{
    struct offer *offer = upload_find(session, data->hash);
    if (!offer || offer->held)
        return error_set(error, ERROR_INVALID, "blob_data.hash", "a blob that %s",
                         offer ? "is held already" : "was not offered");
    if (!request->object && offer->arriving)
        return error_set(error, ERROR_INVALID, "blob_data.hash", "a blob that another request is sending");
    if (request->object && request->object != offer)
        return error_set(error, ERROR_INVALID, "blob_data.hash", "another blob than the request began with");
    request->object = offer;
    if (!add_piece(session, offer, data, error))
        return false;
    return offer->arrived_bytes < offer->size_bytes || complete(session, offer, error);
}

void upload_data(struct session *session, const struct framing_header *header,
                 const struct message_blob_data *data)
{
    struct error error = {0};
    struct session_blobs *blobs = &session->blobs;
    if (header->channel != UPLOAD_CHANNEL || data->data_bytes > blobs->credit_bytes - blobs->received_bytes) {
        error_set(&error, ERROR_PROTOCOL, "blob_data",
                  header->channel != UPLOAD_CHANNEL ? "blob data belongs on channel 1"
                                                    : "more came on channel 1 than credit was given for");
        session_fail(session, &error);
        return;
    }
    blobs->received_bytes += data->data_bytes;
    send_credit(session);
    struct request *request = request_of(session, header, data);
    if (!request)
        return;
    bool taken = take_piece(session, request, data, &error);
    struct offer *offer = request->object;
    if (taken && !offer->held)
        return;
    if (offer)
        upload_abandon(session, offer);
    if (taken) {
        request_answer_ok(session, request, 0);
        return;
    }
    if (offer && error.kind == ERROR_LIMIT)
        hub_trim(session->hub, blob_store_lacking(session->hub->blobs, offer->size_bytes));
    requests_bury(session, request->id);
    request_answer_error(session, request, &error);
}

void upload_invalid(struct session *session, uint32_t request_id, const struct error *error)
{
    struct request *request = request_find(session, request_id);
    if (!request && requests_is_dead(session, request_id))
        return;
    if (!request)
        request = request_begin(session, request_id, REQUEST_UPLOAD);
    if (!request)
        return;
    if (request->kind != REQUEST_UPLOAD) {
        session_fail(session, error);
        return;
    }
    if (request->object)
        upload_abandon(session, request->object);
    requests_bury(session, request_id);
    request_answer_error(session, request, error);
}

void upload_finish(struct session *session)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&session->blobs.offers, &cursor, NULL, &value)) {
        for (struct offer *offer = value, *next; offer; offer = next) {
            next = (struct offer *)offer->same_key.next;
            upload_abandon(session, offer);
            blob_unref(offer->held);
            free(offer);
        }
    }
    hashmap_finish(&session->blobs.offers);
    if (!session->identity.known)
        blob_store_forget(session->hub->blobs, session->principal);
    blob_store_trim(session->hub->blobs);
}
