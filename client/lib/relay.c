/* SPDX-License-Identifier: MIT */
/* The relay's decisions: which messages an importer may send. */
#include "lib/relay.h"

#define IMPORTER_SCENE 1u
/* Requests may begin out of order within the maximum number in flight of any daemon. */
#define REQUEST_AHEAD_MAX 1024u

static enum fl_relay_verdict kind_of(enum message_type type)
{
    switch (type) {
    case MESSAGE_BLOB_OFFER:
    case MESSAGE_BLOB_DATA:
    case MESSAGE_EDIT_BEGIN:
    case MESSAGE_EDIT_COMMIT:
    case MESSAGE_SET_NODE:
    case MESSAGE_SET_MESH:
    case MESSAGE_SET_SPHERES:
    case MESSAGE_SET_DISC:
    case MESSAGE_SET_MATERIAL:
    case MESSAGE_SET_TEXTURE:
    case MESSAGE_SET_LIGHT:
    case MESSAGE_SET_CAMERA:
    case MESSAGE_SET_ENVIRONMENT:
    case MESSAGE_SET_SKIN:
    case MESSAGE_SET_CLIP:
    case MESSAGE_SET_CHANNEL:
    case MESSAGE_REMOVE:
        return FL_RELAY_FORWARD;
    case MESSAGE_IMPORT_NOTE:
    case MESSAGE_IMPORT_BOUNDS:
    case MESSAGE_IMPORT_CLIP:
    case MESSAGE_IMPORT_VARIANT:
    case MESSAGE_IMPORT_FILE:
    case MESSAGE_IMPORT_PROGRESS:
    case MESSAGE_IMPORT_DONE:
        return FL_RELAY_LOCAL;
    default:
        return FL_RELAY_REFUSE;
    }
}

static enum fl_relay_verdict refuse(struct fl_error *error, const char *what, const struct message *message)
{
    fl_error_set(error, FL_ERROR_PROTOCOL, "farlight-import", "%s (%s)", what, message_type_text(message->type));
    return FL_RELAY_REFUSE;
}

enum fl_relay_verdict fl_relay_from_importer(struct fl_relay *relay, const struct framing_header *header,
                                             struct message *message, uint32_t *request, struct fl_error *error)
{
    const enum fl_relay_verdict kind = kind_of(message->type);
    if (kind == FL_RELAY_REFUSE)
        return refuse(error, "the importer sent a message that is not allowed", message);
    if (kind == FL_RELAY_LOCAL)
        return kind;
    const bool in_range = header->request > 0 && (header->request <= relay->max_request ||
                                                  header->request - relay->max_request <= REQUEST_AHEAD_MAX);
    if (!in_range || header->request > UINT32_MAX - relay->request_base)
        return refuse(error, "the importer's request numbers are not consecutive", message);
    if (header->channel > (message->type == MESSAGE_BLOB_DATA ? 1u : 0u))
        return refuse(error, "the importer used a channel that is not its own", message);
    if (message->type == MESSAGE_EDIT_BEGIN) {
        if (message->edit_begin.scene != IMPORTER_SCENE)
            return refuse(error, "the importer tried to edit another scene", message);
        message->edit_begin.scene = relay->scene;
    }
    if (header->request > relay->max_request)
        relay->max_request = header->request;
    *request = relay->request_base + header->request;
    return FL_RELAY_FORWARD;
}

bool fl_relay_from_daemon(const struct fl_relay *relay, const struct framing_header *header, uint32_t *request)
{
    if (header->type != MESSAGE_OK && header->type != MESSAGE_ERROR && header->type != MESSAGE_BLOB_NEED)
        return false;
    if (header->request <= relay->request_base || header->request - relay->request_base > relay->max_request)
        return false;
    *request = header->request - relay->request_base;
    return true;
}

uint64_t fl_relay_credit(const struct fl_relay *relay, uint64_t daemon_total)
{
    return daemon_total > relay->upload_base ? daemon_total - relay->upload_base : 0;
}
