/* SPDX-License-Identifier: MIT */
/* The importer's side of the protocol. */
#include "send.h"

#include "import/model/edits.h"

#include "protocol/framing.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#define OUT_BYTES (4u * FRAMING_MESSAGE_MAX_BYTES)
#define IN_BYTES FRAMING_MESSAGE_MAX_BYTES
#define PIECE_BYTES 262144u
#define UPLOAD_CHANNEL 1u
#define UPLOADS_MAX 32u /* requests in flight; servers allow 64 */
#define OFFER_MAX 1024u

bool sender_init(struct sender *sender, int socket, struct import_scene *scene)
{
    *sender = (struct sender){.socket = socket, .scene = scene};
    sender->out = malloc(OUT_BYTES);
    sender->in = malloc(IN_BYTES);
    return (sender->out && sender->in) || import_fail(scene, NULL, "out of memory");
}

void sender_finish(struct sender *sender)
{
    free(sender->out);
    free(sender->in);
    sender->out = sender->in = NULL;
}

/* ---- received messages ---- */

static bool peer_gone(struct sender *sender)
{
    sender->gone = true;
    return false;
}

static bool handle_error(struct sender *sender, uint32_t request, const struct message_error *error)
{
    if (request != 0 && request < sender->first_upload && request != sender->awaited)
        return true; /* answers an old request */
    return import_fail(sender->scene, NULL, "the server refused it: %s%s%s%s%s", error->field,
                       error->field[0] ? ": " : "", error->text, error->remedy[0] ? "; " : "", error->remedy);
}

static void handle_ok(struct sender *sender, uint32_t request)
{
    if (request != 0 && request == sender->awaited)
        sender->answered = true;
    else if (sender->uploads_open > 0 && request >= sender->first_upload && request <= sender->last_request)
        sender->uploads_open--;
}

static bool handle_need(struct sender *sender, uint32_t request, const struct message_blob_need *need)
{
    if (request == 0 || request != sender->awaited || !sender->needed)
        return true;
    for (uint32_t i = 0; i < need->needed_count; i++) {
        if (need->needed[i].index >= sender->offered)
            return import_fail(sender->scene, NULL, "the server requested blob %u of %u", need->needed[i].index,
                               sender->offered);
        sender->needed[need->needed[i].index] = true;
    }
    sender->answered = true;
    return true;
}

static bool handle(struct sender *sender, const struct frame *frame)
{
    static uint8_t scratch_bytes[SCRATCH_BYTES];
    struct scratch scratch;
    struct decode_error error = {0};
    struct message message;
    uint32_t request = frame->header.request;

    if (!frame->info)
        return true;
    scratch_init(&scratch, scratch_bytes, sizeof(scratch_bytes));
    if (!message_decode(&message, frame->header.type, frame->payload, frame->header.payload_bytes, &scratch,
                        &error))
        return import_fail(sender->scene, NULL, "the server sent an invalid message: %s: %s", error.field,
                           error.text);
    switch (message.type) {
    case MESSAGE_OK:
        handle_ok(sender, request);
        return true;
    case MESSAGE_ERROR:
        return handle_error(sender, request, &message.error);
    case MESSAGE_BLOB_NEED:
        return handle_need(sender, request, &message.blob_need);
    case MESSAGE_CREDIT:
        if (message.credit.channel == UPLOAD_CHANNEL && message.credit.total > sender->credit_bytes)
            sender->credit_bytes = message.credit.total;
        return true;
    case MESSAGE_GOODBYE:
        return peer_gone(sender);
    default:
        return true; /* irrelevant to an import */
    }
}

static bool parse_input(struct sender *sender)
{
    size_t used = 0;

    for (;;) {
        struct frame frame;
        struct decode_error error = {0};

        switch (framing_parse(&frame, sender->in + used, sender->in_used - used, MESSAGE_FROM_BOTH, &error)) {
        case FRAMING_FATAL:
            return import_fail(sender->scene, NULL, "the server does not speak the protocol: %s", error.text);
        case FRAMING_NEED_MORE:
            sender->in_used -= used;
            memmove(sender->in, sender->in + used, sender->in_used);
            return true;
        case FRAMING_CONSUMED:
            if (!handle(sender, &frame))
                return false;
            used += frame.consumed_bytes;
        }
    }
}

static bool receive(struct sender *sender)
{
    ssize_t got = recv(sender->socket, sender->in + sender->in_used, IN_BYTES - sender->in_used, MSG_DONTWAIT);

    if (got == 0)
        return peer_gone(sender);
    if (got < 0)
        return errno == EAGAIN || errno == EINTR || peer_gone(sender);
    sender->in_used += (size_t)got;
    return parse_input(sender);
}

/* ---- sent messages ---- */

/* Waits until bytes could be sent (if there are some) or have been received. Reading while sending keeps two
 * full sockets from waiting for each other. */
static bool exchange(struct sender *sender)
{
    struct pollfd poller = {.fd = sender->socket, .events = POLLIN};

    if (sender->out_used > 0)
        poller.events |= POLLOUT;
    if (poll(&poller, 1, -1) < 0)
        return errno == EINTR || peer_gone(sender);
    if ((poller.revents & (POLLIN | POLLHUP | POLLERR | POLLNVAL)) && !receive(sender))
        return false;
    if (poller.revents & POLLOUT) {
        ssize_t sent = send(sender->socket, sender->out, sender->out_used, MSG_DONTWAIT | MSG_NOSIGNAL);

        if (sent < 0)
            return errno == EAGAIN || errno == EINTR || peer_gone(sender);
        sender->out_used -= (size_t)sent;
        memmove(sender->out, sender->out + sent, sender->out_used);
    }
    return true;
}

static bool flush(struct sender *sender)
{
    while (sender->out_used > 0)
        if (!exchange(sender))
            return false;
    return true;
}

static bool put(struct sender *sender, uint32_t request, uint32_t channel, const struct message *message)
{
    struct writer writer;

    if (sender->gone || sender->scene->failed)
        return false;
    if (OUT_BYTES - sender->out_used < FRAMING_MESSAGE_MAX_BYTES + 8 && !flush(sender))
        return false;
    writer_init(&writer, sender->out + sender->out_used, OUT_BYTES - sender->out_used);
    if (!message_write(&writer, request, channel, message))
        return import_fail(sender->scene, NULL, "cannot be sent: %s: %s", writer.error.field, writer.error.text);
    sender->out_used += writer.used_bytes;
    return true;
}

static bool await(struct sender *sender, uint32_t request)
{
    sender->awaited = request;
    sender->answered = false;
    while (!sender->answered)
        if (!exchange(sender))
            return false;
    sender->awaited = 0;
    return true;
}

/* ---- notes ---- */

bool sender_progress(struct sender *sender, uint64_t done_bytes, uint64_t total_bytes, const char *text)
{
    struct message message;

    message_init(&message, MESSAGE_IMPORT_PROGRESS);
    message.import_progress.done_bytes = done_bytes;
    message.import_progress.total_bytes = total_bytes;
    message.import_progress.text = text;
    return put(sender, 0, 0, &message) && flush(sender);
}

bool sender_file(struct sender *sender, uint32_t model, const char *name)
{
    struct message message;
    char text[1025];

    /* A file whose name the protocol cannot carry is left out. */
    import_copy_text(text, sizeof(text), name);
    if (strcmp(text, name) != 0)
        return true;
    message_init(&message, MESSAGE_IMPORT_FILE);
    message.import_file.model = model;
    message.import_file.name = text;
    return put(sender, 0, 0, &message);
}

static bool put_note(struct sender *sender, const struct import_notice *note)
{
    struct message message;
    const char *file = note->file[0] != '\0' ? note->file : sender->scene->file;
    char where[257], text[513];

    if (note->where[0] && strcmp(note->where, file) != 0)
        snprintf(where, sizeof(where), "%.120s: %.130s", file, note->where);
    else
        snprintf(where, sizeof(where), "%s", file);
    if (note->count > 1)
        snprintf(text, sizeof(text), "%s (%u times)", note->text, note->count);
    else
        snprintf(text, sizeof(text), "%s", note->text);
    message_init(&message, MESSAGE_IMPORT_NOTE);
    message.import_note.severity = note->severity;
    message.import_note.where = where;
    message.import_note.text = text;
    return put(sender, 0, 0, &message);
}

bool sender_notes(struct sender *sender)
{
    struct import_scene *scene = sender->scene;

    for (size_t i = 0; i < scene->note_count; i++)
        if (!put_note(sender, &scene->notes[i]))
            return false;
    if (scene->notes_lost > 0) {
        struct import_notice more = {.severity = PROTOCOL_SEVERITY_WARNING, .count = 1};

        snprintf(more.text, sizeof(more.text), "about %u further notes are left out", scene->notes_lost);
        if (!put_note(sender, &more))
            return false;
    }
    for (size_t i = 0; i < scene->clip_count; i++) {
        struct message message;

        message_init(&message, MESSAGE_IMPORT_CLIP);
        message.import_clip.clip = scene->clips[i].clip;
        message.import_clip.name = scene->clips[i].name;
        message.import_clip.channels = scene->clips[i].channels;
        message.import_clip.duration_s = scene->clips[i].duration_s;
        if (!put(sender, 0, 0, &message))
            return false;
    }
    for (size_t i = 0; i < scene->variant_count; i++) {
        struct message message;

        message_init(&message, MESSAGE_IMPORT_VARIANT);
        message.import_variant.name = scene->variants[i].name;
        if (!put(sender, 0, 0, &message))
            return false;
    }
    for (size_t i = 0; i < scene->bounds_count; i++) {
        struct message message;

        message_init(&message, MESSAGE_IMPORT_BOUNDS);
        message.import_bounds.kind = scene->bounds[i].kind;
        message.import_bounds.object = scene->bounds[i].object;
        memcpy(message.import_bounds.lower, scene->bounds[i].lower, sizeof(scene->bounds[i].lower));
        memcpy(message.import_bounds.upper, scene->bounds[i].upper, sizeof(scene->bounds[i].upper));
        if (!put(sender, 0, 0, &message))
            return false;
    }
    return flush(sender);
}

void sender_failure(struct sender *sender)
{
    struct import_scene *scene = sender->scene;

    if (!scene->failed || sender->gone)
        return;
    scene->failed = false; /* allows sending again */
    if (put_note(sender, &scene->failure))
        flush(sender);
    scene->failed = true;
}

/* ---- blobs ---- */

/* Sends from *offset as much as a message and the credit allow, and advances it. */
static bool put_piece(struct sender *sender, uint32_t request, const struct import_blob *blob, uint64_t *offset)
{
    uint64_t piece = blob->size_bytes - *offset;
    struct message message;

    while (sender->credit_bytes == sender->sent_bytes)
        if (!exchange(sender))
            return false;
    piece = piece < PIECE_BYTES ? piece : PIECE_BYTES;
    if (piece > sender->credit_bytes - sender->sent_bytes)
        piece = sender->credit_bytes - sender->sent_bytes;
    message_init(&message, MESSAGE_BLOB_DATA);
    message.blob_data.offset_bytes = *offset;
    memcpy(message.blob_data.hash, blob->hash, sizeof(blob->hash));
    message.blob_data.data = blob->bytes + *offset;
    message.blob_data.data_bytes = (uint32_t)piece;
    sender->sent_bytes += piece;
    *offset += piece;
    return put(sender, request, UPLOAD_CHANNEL, &message);
}

static bool put_blob(struct sender *sender, const struct import_blob *blob)
{
    uint32_t request = ++sender->last_request;

    while (sender->uploads_open >= UPLOADS_MAX)
        if (!exchange(sender))
            return false;
    sender->uploads_open++;
    for (uint64_t offset = 0; offset < blob->size_bytes;)
        if (!put_piece(sender, request, blob, &offset))
            return false;
    return true;
}

/* Offers the blobs at `positions` and sends the missing ones. */
static bool send_lot(struct sender *sender, const uint32_t *positions, uint32_t count, uint64_t *done_bytes)
{
    struct import_scene *scene = sender->scene;
    static struct record_blob_ref refs[OFFER_MAX];
    bool needed[OFFER_MAX] = {false};
    struct message message;
    uint32_t request = ++sender->last_request;

    for (uint32_t i = 0; i < count; i++) {
        refs[i].size_bytes = scene->blobs[positions[i]].size_bytes;
        memcpy(refs[i].hash, scene->blobs[positions[i]].hash, sizeof(refs[i].hash));
    }
    message_init(&message, MESSAGE_BLOB_OFFER);
    message.blob_offer.blobs = refs;
    message.blob_offer.blobs_count = count;
    sender->needed = needed;
    sender->offered = count;
    if (!put(sender, request, 0, &message) || !flush(sender) || !await(sender, request)) {
        sender->needed = NULL;
        return false;
    }
    sender->needed = NULL;
    sender->first_upload = sender->last_request + 1;
    for (uint32_t i = 0; i < count; i++) {
        if (needed[i] && !put_blob(sender, &scene->blobs[positions[i]]))
            return false;
        *done_bytes += scene->blobs[positions[i]].size_bytes;
        if ((i & 15u) == 15u && !sender_progress(sender, *done_bytes, scene->blob_bytes, "sending"))
            return false;
    }
    if (!flush(sender))
        return false;
    while (sender->uploads_open > 0)
        if (!exchange(sender))
            return false;
    return true;
}

bool sender_blobs(struct sender *sender)
{
    struct import_scene *scene = sender->scene;
    uint32_t lot[OFFER_MAX];
    uint32_t count = 0;
    uint64_t done_bytes = 0;

    for (size_t i = 0; i < scene->blob_count; i++) {
        if (scene->blobs[i].same_as != i)
            continue;
        lot[count++] = (uint32_t)i;
        if (count == OFFER_MAX) {
            if (!send_lot(sender, lot, count, &done_bytes))
                return false;
            count = 0;
        }
    }
    return count == 0 || send_lot(sender, lot, count, &done_bytes);
}

/* ---- the transaction ---- */

static bool put_edit(struct sender *sender, uint32_t request, const struct import_edit *edit)
{
    struct record_blob_ref refs[IMPORT_ARRAYS_MAX] = {0};
    struct message message = edit->message;

    for (size_t i = 0; i < IMPORT_ARRAYS_MAX; i++) {
        if (edit->blobs[i] != 0) {
            const struct import_blob *blob = &sender->scene->blobs[edit->blobs[i] - 1];

            refs[i].size_bytes = blob->size_bytes;
            memcpy(refs[i].hash, blob->hash, sizeof(refs[i].hash));
        }
    }
    switch (message.type) {
    case MESSAGE_SET_MESH:
        message.set_mesh.arrays = refs;
        break;
    case MESSAGE_SET_SPHERES:
        message.set_spheres.arrays = refs;
        break;
    case MESSAGE_SET_TEXTURE:
        message.set_texture.arrays = refs;
        break;
    case MESSAGE_SET_SKIN:
        message.set_skin.arrays = refs;
        break;
    case MESSAGE_SET_CLIP:
        message.set_clip.arrays = refs;
        break;
    case MESSAGE_SET_ENVIRONMENT:
        message.set_environment.arrays = refs;
        break;
    default:
        break; /* has no arrays */
    }
    return put(sender, request, 0, &message);
}

bool sender_edits(struct sender *sender, uint32_t scene_id)
{
    uint32_t request = ++sender->last_request;
    struct message message;

    sender->first_upload = request;
    message_init(&message, MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = scene_id;
    if (!put(sender, request, 0, &message))
        return false;
    for (size_t i = 0; i < sender->scene->edit_count; i++)
        if (!put_edit(sender, request, &sender->scene->edits[i]))
            return false;
    message_init(&message, MESSAGE_EDIT_COMMIT);
    return put(sender, request, 0, &message) && flush(sender) && await(sender, request);
}

bool sender_done(struct sender *sender, const struct message_import_done *done)
{
    struct message message;

    message_init(&message, MESSAGE_IMPORT_DONE);
    message.import_done = *done;
    return put(sender, 0, 0, &message) && flush(sender);
}
