/* SPDX-License-Identifier: MIT */
/* A session with one triangle, a light and a picture of 2 x 2 pixels. The daemon's bytes vary in a few places;
 * the integration tests send the client's bytes to a daemon and compare its answers with the others. */
#include "protocol/docs/example.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "protocol/common/blob_hash.h"
#include "protocol/framing.h"
#include "protocol/handshake.h"
#include "protocol/messages.h"

#define BYTES_A_LINE 16
#define ANSWER_TO(request) "Daemon, in answer to request " #request

/* A triangle that covers the camera's whole picture. */
static const float positions[] = {-1, -1, 0, 3, -1, 0, -1, 3, 0};
static const uint32_t indices[] = {0, 1, 2};
/* The base colour is 0.8, 0.4, 0.2, and a light that makes white 1 shines perpendicularly. The surface reflects
 * 4 %; the rest of the light gives these colours in sRGB. */
static const uint8_t pixels[] = {232, 171, 126, 255, 232, 171, 126, 255, 232, 171, 126, 255, 232, 171, 126, 255};

static void print_bytes(const char *what, const uint8_t *bytes, size_t count)
{
    printf("%s:\n\n```\n", what);
    for (size_t i = 0; i < count; i++) {
        printf("%02x%c", bytes[i], (i + 1) % BYTES_A_LINE == 0 || i + 1 == count ? '\n' : ' ');
    }
    printf("```\n\n");
}

static void show(const char *what, uint32_t request, uint32_t channel, const struct message *message)
{
    static uint8_t bytes[FRAMING_MESSAGE_MAX_BYTES];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    if (!message_write(&writer, request, channel, message)) {
        fprintf(stderr, "%s: %s: %s\n", what, writer.error.field, writer.error.text);
        exit(1);
    }
    char title[128];
    snprintf(title, sizeof(title), "%s, `%s`", what, message_type_text(message->type));
    print_bytes(title, bytes, writer.used_bytes);
}

static struct message made(enum message_type type)
{
    struct message message;
    message_init(&message, type);
    return message;
}

static struct record_blob_ref reference_to(const void *data, size_t bytes)
{
    struct record_blob_ref reference = {.size_bytes = bytes};
    blob_hash(reference.hash, data, bytes);
    return reference;
}

static void print_ok(const char *what, uint32_t request, uint64_t revision)
{
    struct message message = made(MESSAGE_OK);
    message.ok.revision = revision;
    show(what, request, 0, &message);
}

/* ---- the session ------------------------------------------------------------------------------------ */

static void print_hello(void)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    struct handshake_hello hello = {
        .version_min = HANDSHAKE_VERSION_MIN, .version_max = HANDSHAKE_VERSION_MAX, .name = "example"};
    for (size_t i = 0; i < sizeof(hello.nonce); i++) {
        hello.nonce[i] = (uint8_t)i;
    }
    print_bytes("Client, hello", bytes, handshake_hello_encode(bytes, &hello));
    printf("The daemon's reply contains random numbers, its limits and its name. It is followed by the first "
           "credit, whose\n"
           "total is the daemon's upload window:\n\n");
    struct message credit = made(MESSAGE_CREDIT);
    credit.credit.channel = 1;
    credit.credit.total = 4 << 20;
    show("Daemon, unasked", 0, 1, &credit);
}

static void print_blob(uint32_t request, const struct record_blob_ref *reference, const void *data)
{
    struct message message = made(MESSAGE_BLOB_DATA);
    memcpy(message.blob_data.hash, reference->hash, sizeof(reference->hash));
    message.blob_data.data = data;
    message.blob_data.data_bytes = (uint32_t)reference->size_bytes;
    show("Client", request, 1, &message);
}

static void print_upload(struct record_blob_ref references[2])
{
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = 1;
    message.scene_open.name = "a triangle";
    show("Client", 1, 0, &message);
    print_ok(ANSWER_TO(1), 1, 0);
    message = made(MESSAGE_BLOB_OFFER);
    message.blob_offer.blobs = references;
    message.blob_offer.blobs_count = 2;
    show("Client", 2, 0, &message);
    struct record_blob_index needed[] = {{.index = 0}, {.index = 1}};
    message = made(MESSAGE_BLOB_NEED);
    message.blob_need.needed = needed;
    message.blob_need.needed_count = 2;
    show(ANSWER_TO(2), 2, 0, &message);
    print_blob(3, &references[0], positions);
    print_blob(4, &references[1], indices);
    print_ok(ANSWER_TO(3), 3, 0);
    print_ok(ANSWER_TO(4), 4, 0);
}

static void print_node(uint32_t node, enum protocol_node_kind kind)
{
    struct message message = made(MESSAGE_SET_NODE);
    message.set_node.node = node;
    message.set_node.value.kind = kind;
    message.set_node.value.object = 1;
    message.set_node.value.parent_from_node[0] = message.set_node.value.parent_from_node[5] =
        message.set_node.value.parent_from_node[10] = 1;
    show("Client", 5, 0, &message);
}

static void print_transaction(struct record_blob_ref references[2])
{
    struct message message = made(MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = 1;
    show("Client", 5, 0, &message);
    message = made(MESSAGE_SET_MATERIAL);
    message.set_material.material = 1;
    static const float base_colour[] = {0.8f, 0.4f, 0.2f, 1};
    memcpy(message.set_material.value.base_colour, base_colour, sizeof(base_colour));
    message.set_material.value.roughness = 1;
    message.set_material.value.ior = 1.5f;
    show("Client", 5, 0, &message);
    struct record_material_range range = {.count = 1, .material = 1};
    message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 1;
    message.set_mesh.value.vertex_count = 3;
    message.set_mesh.value.triangle_count = 1;
    message.set_mesh.arrays = references;
    message.set_mesh.arrays_count = 2;
    message.set_mesh.ranges = &range;
    message.set_mesh.ranges_count = 1;
    show("Client", 5, 0, &message);
    print_node(1, PROTOCOL_NODE_MESH);
    message = made(MESSAGE_SET_LIGHT);
    message.set_light.light = 1;
    message.set_light.value.kind = PROTOCOL_LIGHT_DIRECTIONAL;
    for (int i = 0; i < 3; i++) {
        message.set_light.value.colour[i] = 3.1415927f;
    }
    show("Client", 5, 0, &message);
    print_node(2, PROTOCOL_NODE_LIGHT);
    message = made(MESSAGE_EDIT_COMMIT);
    show("Client", 5, 0, &message);
    print_ok(ANSWER_TO(5), 5, 1);
}

static void print_render(void)
{
    struct record_camera_key key = {.eye_world = {0, 0, 2}, .up_world = {0, 1, 0}, .fov_y = 0.5f};
    struct message message = made(MESSAGE_RENDER);
    message.render.scene = 1;
    message.render.channel = 2;
    message.render.credit = 1;
    message.render.picture.width = message.render.picture.height = 2;
    message.render.sampling.samples = 1;
    message.render.light.depth = 0;
    message.render.frame_step = 1;
    message.render.frames_per_second = 24;
    message.render.picture.tone_map = PROTOCOL_TONE_NONE;
    message.render.quality = 1;
    message.render.camera.camera_path = PROTOCOL_CAMERA_KEYS;
    message.render.keys = &key;
    message.render.keys_count = 1;
    show("Client", 6, 0, &message);
}

static void print_frame(void)
{
    struct message message = made(MESSAGE_FRAME_BEGIN);
    struct message_frame_begin *begin = &message.frame_begin;
    begin->width = begin->height = 2;
    begin->samples = 1;
    begin->revision = 1;
    begin->size_bytes = sizeof(pixels);
    begin->digest = XXH3_64bits(pixels, sizeof(pixels));
    begin->world_from_view[0] = begin->world_from_view[5] = begin->world_from_view[10] = 1;
    begin->world_from_view[11] = 2;
    begin->fov_y = 0.5f;
    begin->layers = 1;
    begin->key_frame = 1;
    show("Daemon, for request 6", 6, 2, &message);
    message = made(MESSAGE_FRAME_DATA);
    message.frame_data.data = pixels;
    message.frame_data.data_bytes = sizeof(pixels);
    show("Daemon, for request 6", 6, 2, &message);
    printf("It is followed by `frame_end`, which states the costs of the frame.\n\n");
    print_ok(ANSWER_TO(6), 6, 0);
}

void docgen_print_example(void)
{
    struct record_blob_ref references[] = {reference_to(positions, sizeof(positions)),
                                           reference_to(indices, sizeof(indices))};
    printf("## A session, byte by byte\n\n"
           "A triangle in front of the camera, a light at the camera, and a picture of 2 x 2 pixels.\n\n");
    print_hello();
    print_upload(references);
    print_transaction(references);
    print_render();
    printf("The frame. Its pixels may differ by one level between devices, its digest with them, and its times "
           "with the\n"
           "clock.\n\n");
    print_frame();
    struct message message = made(MESSAGE_GOODBYE);
    show("Client", 0, 0, &message);
}
