/* SPDX-License-Identifier: MIT */
#include "tests/fuzz/recorded_session.h"

#include "base/blob.h"
#include "protocol/framing.h"

#include <string.h>

#define BATCH_CHANNEL 2
#define VIEW_CHANNEL 3
#define SCENE_NAME "everybody's"

static const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
static const uint32_t indices[3] = {0, 1, 2};

struct talk {
    recorded_say_fn *say;
    void *context;
    struct message message; /* the next one */
};

static struct message *begin(struct talk *talk, enum message_type type)
{
    message_init(&talk->message, type);
    return &talk->message;
}

static void end(const struct talk *talk, uint32_t request)
{
    talk->say(talk->context, request, 0, &talk->message);
}

/* ---- scenes ----------------------------------------------------------------------------------------- */

static void open_scene(struct talk *talk, uint32_t request, enum protocol_sharing sharing, const char *name)
{
    struct message *message = begin(talk, MESSAGE_SCENE_OPEN);
    message->scene_open.scene = 1;
    message->scene_open.sharing = sharing;
    message->scene_open.name = name;
    end(talk, request);
}

static struct record_blob_ref reference_to(const void *data, size_t bytes)
{
    struct record_blob_ref reference = {.size_bytes = bytes};
    blob_hash(reference.hash, data, bytes);
    return reference;
}

static void upload(struct talk *talk, uint32_t request, const struct record_blob_ref *reference, const void *data)
{
    struct message *message = begin(talk, MESSAGE_BLOB_DATA);
    memcpy(message->blob_data.hash, reference->hash, sizeof(reference->hash));
    message->blob_data.data = data;
    message->blob_data.data_bytes = (uint32_t)reference->size_bytes;
    talk->say(talk->context, request, 1, message);
}

static void begin_edit(struct talk *talk, uint32_t request, uint32_t scene)
{
    begin(talk, MESSAGE_EDIT_BEGIN)->edit_begin.scene = scene;
    end(talk, request);
}

static void commit(struct talk *talk, uint32_t request)
{
    begin(talk, MESSAGE_EDIT_COMMIT);
    end(talk, request);
}

static void set_node(struct talk *talk, uint32_t request, uint32_t node, enum protocol_node_kind kind)
{
    struct message_set_node *set = &begin(talk, MESSAGE_SET_NODE)->set_node;
    set->node = node;
    set->value.kind = kind;
    set->value.object = kind == PROTOCOL_NODE_GROUP ? 0 : 1;
    set->value.parent_from_node[0] = set->value.parent_from_node[5] = set->value.parent_from_node[10] = 1;
    set->name = "a node";
    end(talk, request);
}

static void set_mesh(struct talk *talk, uint32_t request, struct record_blob_ref references[2])
{
    static struct record_material_range range = {.count = 1, .material = 1};
    struct message_set_mesh *set = &begin(talk, MESSAGE_SET_MESH)->set_mesh;
    set->mesh = 1;
    set->value.vertex_count = 3;
    set->value.triangle_count = 1;
    set->arrays = references;
    set->arrays_count = 2;
    set->ranges = &range;
    set->ranges_count = 1;
    end(talk, request);
}

/* Requests from `request` on: 5 of them. */
static void put_up(struct talk *talk, uint32_t request)
{
    struct record_blob_ref references[] = {reference_to(positions, sizeof(positions)),
                                           reference_to(indices, sizeof(indices))};
    struct message *message = begin(talk, MESSAGE_BLOB_OFFER);
    message->blob_offer.blobs = references;
    message->blob_offer.blobs_count = 2;
    end(talk, request);
    upload(talk, request + 1, &references[0], positions);
    upload(talk, request + 2, &references[1], indices);
    begin_edit(talk, request + 3, 1);
    begin(talk, MESSAGE_SET_MATERIAL)->set_material.material = 1;
    end(talk, request + 3);
    set_mesh(talk, request + 3, references);
    set_node(talk, request + 3, 1, PROTOCOL_NODE_MESH);
    struct message_set_light *light = &begin(talk, MESSAGE_SET_LIGHT)->set_light;
    light->light = 1;
    light->value.kind = PROTOCOL_LIGHT_DIRECTIONAL;
    end(talk, request + 3);
    set_node(talk, request + 3, 2, PROTOCOL_NODE_LIGHT);
    commit(talk, request + 3);
}

/* ---- pictures --------------------------------------------------------------------------------------- */

static struct message_render *begin_render(struct talk *talk, enum protocol_job_kind kind)
{
    struct message_render *render = &begin(talk, MESSAGE_RENDER)->render;
    render->scene = 1;
    render->kind = kind;
    render->channel = kind == PROTOCOL_JOB_VIEW ? VIEW_CHANNEL : BATCH_CHANNEL;
    render->credit = 2;
    render->picture.width = render->picture.height = 2;
    render->sampling.samples = 4;
    render->last_frame = 2;
    return render;
}

static void give_credit(struct talk *talk, uint32_t channel, uint64_t total)
{
    struct message *message = begin(talk, MESSAGE_CREDIT);
    message->credit.channel = channel;
    message->credit.total = total;
    end(talk, 0);
}

static void look(struct talk *talk, uint64_t command, bool moving)
{
    struct message_view_camera *camera = &begin(talk, MESSAGE_VIEW_CAMERA)->view_camera;
    camera->channel = VIEW_CHANNEL;
    camera->command = command;
    camera->moving = moving;
    camera->eye_world[2] = (float)command;
    camera->up_world[1] = 1;
    camera->fov_y = 0.5f;
    end(talk, 0);
}

static void acknowledge(struct talk *talk, uint32_t frame)
{
    for (uint32_t whole = 0; whole <= 1; whole++) {
        struct message_frame_ack *ack = &begin(talk, MESSAGE_FRAME_ACK)->frame_ack;
        ack->channel = VIEW_CHANNEL;
        ack->frame = frame;
        ack->whole = whole;
        ack->want_key_frame = whole;
        end(talk, 0);
    }
}

static void cancel(struct talk *talk, uint32_t request, uint32_t target)
{
    begin(talk, MESSAGE_CANCEL)->cancel.target_request = target;
    end(talk, request);
}

static void ask(struct talk *talk, uint32_t request, enum message_type type)
{
    begin(talk, type);
    end(talk, request);
}

static void close_scene(struct talk *talk, uint32_t request)
{
    begin(talk, MESSAGE_SCENE_CLOSE)->scene_close.scene = 1;
    end(talk, request);
}

/* ---- sessions --------------------------------------------------------------------------------------- */

void recorded_session(recorded_say_fn *say, void *context)
{
    struct talk talk = {.say = say, .context = context};
    open_scene(&talk, 1, PROTOCOL_SHARING_SHARED, SCENE_NAME);
    put_up(&talk, 2);
    begin_render(&talk, PROTOCOL_JOB_BATCH);
    end(&talk, 10);
    give_credit(&talk, BATCH_CHANNEL, 3);
    begin_render(&talk, PROTOCOL_JOB_VIEW)->view.pass_samples = 2;
    end(&talk, 11);
    acknowledge(&talk, 0);
    look(&talk, 1, true);
    give_credit(&talk, VIEW_CHANNEL, 4);
    acknowledge(&talk, 1);
    look(&talk, 3, false);
    struct message_render *render = begin_render(&talk, PROTOCOL_JOB_VIEW);
    render->credit = 9;
    render->picture.width = 3;
    end(&talk, 12);
    acknowledge(&talk, 2);
    ask(&talk, 13, MESSAGE_STATS);
    cancel(&talk, 14, 12);
    begin_edit(&talk, 15, 1);
    commit(&talk, 15);
    ask(&talk, 16, MESSAGE_PING);
    close_scene(&talk, 17);
    ask(&talk, 0, MESSAGE_GOODBYE);
}

void recorded_onlooker(recorded_say_fn *say, void *context)
{
    struct talk talk = {.say = say, .context = context};
    ask(&talk, 1, MESSAGE_SCENE_LIST);
    struct message *message = begin(&talk, MESSAGE_SCENE_ATTACH);
    message->scene_attach.scene = 1;
    message->scene_attach.name = SCENE_NAME;
    end(&talk, 2);
    begin(&talk, MESSAGE_SCENE_DESCRIBE)->scene_describe.scene = 1;
    end(&talk, 3);
    begin(&talk, MESSAGE_SCENE_OBJECTS)->scene_objects.scene = 1;
    end(&talk, 8);
    message = begin(&talk, MESSAGE_OBJECT_GET);
    message->object_get.scene = 1;
    message->object_get.kind = PROTOCOL_OBJECT_MATERIAL;
    end(&talk, 9);
    begin_render(&talk, PROTOCOL_JOB_VIEW)->view.adapt = 1;
    end(&talk, 4);
    look(&talk, 7, true);
    acknowledge(&talk, 0);
    begin_edit(&talk, 5, 1);
    begin(&talk, MESSAGE_SET_MATERIAL)->set_material.material = 2;
    end(&talk, 5);
    commit(&talk, 5);
    close_scene(&talk, 6);
    ask(&talk, 0, MESSAGE_GOODBYE);
}

void recorded_blunders(recorded_say_fn *say, void *context)
{
    static const uint8_t noise[40];
    struct talk talk = {.say = say, .context = context};
    struct record_blob_ref reference = {.size_bytes = sizeof(noise), .hash = {1}};
    open_scene(&talk, 1, PROTOCOL_SHARING_PRIVATE, "");
    open_scene(&talk, 2, PROTOCOL_SHARING_KEPT, "again");
    struct message *message = begin(&talk, MESSAGE_BLOB_OFFER);
    message->blob_offer.blobs = &reference;
    message->blob_offer.blobs_count = 1;
    end(&talk, 3);
    upload(&talk, 4, &reference, noise); /* not that hash */
    begin_edit(&talk, 5, 1);
    set_mesh(&talk, 5, (struct record_blob_ref[]){reference, reference}); /* not held */
    set_node(&talk, 5, 1, PROTOCOL_NODE_GROUP);
    commit(&talk, 5);
    begin_edit(&talk, 6, 9); /* no such scene */
    commit(&talk, 6);
    begin_edit(&talk, 7, 1);
    set_node(&talk, 7, 1, PROTOCOL_NODE_MESH); /* no such mesh */
    cancel(&talk, 8, 7);
    set_node(&talk, 7, 2, PROTOCOL_NODE_GROUP);
    commit(&talk, 7);
    cancel(&talk, 9, 9);
    begin(&talk, MESSAGE_SCENE_ATTACH)->scene_attach.scene = 1;
    end(&talk, 10);
    begin_render(&talk, PROTOCOL_JOB_BATCH)->last_frame = 0;
    end(&talk, 11);
    begin_render(&talk, PROTOCOL_JOB_BATCH)->picture.width = 8192;
    end(&talk, 12);
    cancel(&talk, 13, 11);
    cancel(&talk, 14, 13);
    ask(&talk, 15, MESSAGE_STATS);
}
