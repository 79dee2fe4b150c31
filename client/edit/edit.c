/* SPDX-License-Identifier: MIT */
/* Edits of a scene: assignments become a transaction. The objects are read, changed here and sent back. The
 * daemon refuses the transaction if another client has changed an object meanwhile; then everything is
 * repeated. */
#include "edit/field.h"
#include "edit/objects.h"
#include "lib/scene.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ANSWER_NS 600000000000ull /* the daemon first finishes a slice of a frame, and may build structures */
#define ATTEMPTS 32               /* exceeded only if other clients interfere every time */

/* An object of the transaction. */
struct target {
    struct edit_object object;
    bool changed;
    size_t assignment; /* the last assignment to it, which a daemon's error names */
};

struct edit {
    struct fl_scene *scene;
    const struct fl_assignment *assignments;
    size_t assignment_count;
    struct {
        uint32_t *ids; /* owned */
        size_t count;
    } * meant;              /* owned: one for each assignment */
    struct target *targets; /* owned, as everything below */
    size_t target_count, target_capacity;
    struct fl_assignment *undo;
    size_t undo_count, undo_capacity;
};

static void forget_objects(struct edit *edit)
{
    for (size_t i = 0; i < edit->target_count; i++)
        edit_object_finish(&edit->targets[i].object);
    edit->target_count = edit->undo_count = 0;
}

static void finish(struct edit *edit)
{
    forget_objects(edit);
    for (size_t i = 0; edit->meant && i < edit->assignment_count; i++)
        free(edit->meant[i].ids);
    free(edit->meant);
    free(edit->targets);
    free(edit->undo);
}

/* Adds the assignment's name to an error, unless the connection itself is at fault. */
static bool blame(const struct edit *edit, size_t assignment, struct fl_error *error)
{
    char text[sizeof(error->field)];
    if (error && (error->code == FL_ERROR_ARGUMENT || error->code == FL_ERROR_REFUSED))
        snprintf(error->field, sizeof(error->field), "%s",
                 fl_assignment_print(&edit->assignments[assignment], text, sizeof(text)));
    return false;
}

/* ---- changing ---- */

static struct target *find_target(const struct edit *edit, enum protocol_object_kind kind, uint32_t id)
{
    for (size_t i = edit->target_count; i-- > 0;)
        if (edit->targets[i].object.kind == kind && edit->targets[i].object.id == id)
            return &edit->targets[i];
    return NULL;
}

static struct target *need_target(struct edit *edit, enum protocol_object_kind kind, uint32_t id,
                                  struct fl_error *error)
{
    struct target *target = find_target(edit, kind, id);
    if (target)
        return target;
    if (!fl_grow((void **)&edit->targets, &edit->target_capacity, edit->target_count, sizeof(*target), error))
        return NULL;
    target = &edit->targets[edit->target_count++];
    *target = (struct target){0};
    return edit_object_read(edit->scene, kind, id, &target->object, error) ? target : NULL;
}

/* Records the value of the field before its first change. */
static bool note_undo(struct edit *edit, const struct edit_object *object, const struct fl_field *field,
                      struct fl_error *error)
{
    struct fl_field restored;
    if (!edit_field_find(object->kind, edit_field_to_restore(field), &restored, error))
        return false;
    for (size_t i = 0; i < edit->undo_count; i++)
        if (edit->undo[i].kind == object->kind && edit->undo[i].id == object->id &&
            strcmp(edit->undo[i].field, restored.name) == 0)
            return true;
    if (!fl_grow((void **)&edit->undo, &edit->undo_capacity, edit->undo_count, sizeof(*edit->undo), error))
        return false;
    struct fl_assignment *undo = &edit->undo[edit->undo_count++];
    *undo = (struct fl_assignment){.kind = object->kind, .id = object->id, .count = restored.count};
    snprintf(undo->field, sizeof(undo->field), "%s", restored.name);
    edit_field_load(&restored, &object->message, undo->values);
    return true;
}

static void combine(const struct fl_assignment *assignment, const struct fl_field *field,
                    double values[FL_FIELD_VALUES_MAX])
{
    const unsigned all = field->form == FL_FIELD_COLOUR && assignment->count < 4 ? 3 : field->count;
    for (unsigned i = 0; i < all; i++) {
        const double given = assignment->values[assignment->count == 1 ? 0 : i];
        values[i] = assignment->way == FL_ASSIGN_SUM       ? values[i] + given
                    : assignment->way == FL_ASSIGN_PRODUCT ? values[i] * given
                                                           : given;
    }
}

static bool change(struct edit *edit, size_t index, const struct fl_field *field, struct target *target,
                   struct fl_error *error)
{
    const struct fl_assignment *assignment = &edit->assignments[index];
    struct message *message = &target->object.message;
    double before[FL_FIELD_VALUES_MAX] = {0}, values[FL_FIELD_VALUES_MAX] = {0};
    if (!edit_field_applies(field, message))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "a %s light has no %s",
                            protocol_light_kind_text(message->set_light.value.kind), field->name);
    edit_field_load(field, message, before);
    memcpy(values, before, sizeof(values));
    combine(assignment, field, values);
    if (!edit_field_check(field, values, field->count, error))
        return false;
    if (memcmp(values, before, sizeof(values)) == 0)
        return true;
    if (!note_undo(edit, &target->object, field, error))
        return false;
    edit_field_store(field, message, values);
    target->changed = true;
    target->assignment = index;
    return true;
}

static bool change_all(struct edit *edit, struct fl_error *error)
{
    for (size_t i = 0; i < edit->assignment_count; i++) {
        const struct fl_assignment *assignment = &edit->assignments[i];
        struct fl_field field;
        if (!edit_field_find(assignment->kind, assignment->field, &field, error))
            return blame(edit, i, error);
        if (!edit_field_takes(&field, assignment->count)) {
            fl_error_set(error, FL_ERROR_ARGUMENT, "", "%s does not take %u values", field.name,
                         assignment->count);
            return blame(edit, i, error);
        }
        for (size_t k = 0; k < edit->meant[i].count; k++) {
            struct target *target = need_target(edit, assignment->kind, edit->meant[i].ids[k], error);
            if (!target || !change(edit, i, &field, target, error))
                return blame(edit, i, error);
        }
    }
    return true;
}

/* ---- sending ---- */

/* Finds the assignment for the daemon's "edits[3] (light 2).."; false: the error concerns none. */
static bool find_blamed(const struct edit *edit, const char *field, size_t *assignment)
{
    size_t place = 0, seen = 0;
    if (sscanf(field, "edits[%zu]", &place) != 1)
        return false;
    for (size_t i = 0; i < edit->target_count; i++) {
        if (!edit->targets[i].changed || seen++ != place)
            continue;
        *assignment = edit->targets[i].assignment;
        return true;
    }
    return false;
}

/* Sends a message of a transaction, which may be larger than the buffers. */
static bool send_part(struct fl_connection *connection, uint32_t request, const struct message *message,
                      struct fl_error *error)
{
    return fl_connection_wait_upload(connection, request, 0, monotonic_now_ns() + ANSWER_NS, error) &&
           fl_connection_send(connection, request, 0, message, error);
}

/* `base_revision` is the revision of the earliest reading, as later changes may be missing in it. */
static bool send_all(const struct edit *edit, uint64_t base_revision, uint64_t *revision, struct fl_error *error)
{
    struct fl_connection *connection = edit->scene->connection;
    const uint32_t request = fl_connection_next_request(connection);
    const struct message commit = {.type = MESSAGE_EDIT_COMMIT};
    struct message begin;
    struct fl_received received;
    message_init(&begin, MESSAGE_EDIT_BEGIN);
    begin.edit_begin.scene = edit->scene->scene;
    begin.edit_begin.base_revision = base_revision;
    if (!send_part(connection, request, &begin, error))
        return false;
    for (size_t i = 0; i < edit->target_count; i++)
        if (edit->targets[i].changed && !send_part(connection, request, &edit->targets[i].object.message, error))
            return false;
    if (!send_part(connection, request, &commit, error) ||
        !fl_connection_answer(connection, request, MESSAGE_OK, &received, monotonic_now_ns() + ANSWER_NS, error))
        return false;
    *revision = received.message.ok.revision;
    return true;
}

/* Reads, changes and sends once. */
static bool attempt(struct edit *edit, struct fl_edited *edited, struct fl_error *error)
{
    uint64_t base_revision = UINT64_MAX;
    size_t assignment;
    forget_objects(edit);
    if (!change_all(edit, error))
        return false;
    edited->objects = 0;
    for (size_t i = 0; i < edit->target_count; i++) {
        const uint64_t read_revision = edit->targets[i].object.revision;
        base_revision = read_revision < base_revision ? read_revision : base_revision;
        edited->objects += edit->targets[i].changed;
    }
    edited->revision = edit->target_count > 0 ? base_revision : edit->scene->revision;
    if (edited->objects == 0 || send_all(edit, base_revision, &edited->revision, error))
        return true;
    if (error->code == FL_ERROR_REFUSED && find_blamed(edit, error->field, &assignment))
        blame(edit, assignment, error);
    return false;
}

static bool find_all(struct edit *edit, struct fl_error *error)
{
    edit->meant = calloc(edit->assignment_count + 1, sizeof(*edit->meant));
    if (!edit->meant)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < edit->assignment_count; i++) {
        const struct fl_assignment *assignment = &edit->assignments[i];
        char id[16];
        snprintf(id, sizeof(id), "#%u", assignment->id);
        if (!fl_scene_find_objects(edit->scene, assignment->kind, assignment->id > 0 ? id : assignment->which,
                                   &edit->meant[i].ids, &edit->meant[i].count, error))
            return blame(edit, i, error);
    }
    return true;
}

bool fl_scene_edit(struct fl_scene *scene, const struct fl_assignment *assignments, size_t count,
                   struct fl_edited *edited, struct fl_error *error)
{
    struct edit edit = {.scene = scene, .assignments = assignments, .assignment_count = count};
    struct fl_edited result = {0};
    struct fl_error why = {0};
    bool done = false;
    if (find_all(&edit, &why)) {
        for (int i = 0; i < ATTEMPTS && !done; i++) {
            why = (struct fl_error){0};
            done = attempt(&edit, &result, &why);
            if (why.code != FL_ERROR_REFUSED || why.server_code != PROTOCOL_ERROR_CONFLICT)
                break;
        }
    }
    if (done && result.revision > scene->revision)
        scene->revision = result.revision;
    if (done && edited) {
        result.undo = edit.undo;
        result.undo_count = edit.undo_count;
        edit.undo = NULL;
        *edited = result;
    }
    if (!done && error)
        *error = why;
    finish(&edit);
    return done;
}

/* ---- reading ---- */

bool fl_scene_read(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                   struct fl_object_state *state, struct fl_error *error)
{
    struct edit_object object;
    struct fl_field fields[FL_FIELDS_MAX];
    const size_t count = fl_fields(kind, fields);
    *state = (struct fl_object_state){.kind = kind, .id = id};
    if (!edit_object_read(scene, kind, id, &object, error)) {
        edit_object_finish(&object);
        return false;
    }
    const struct message *message = &object.message;
    state->revision = object.revision;
    snprintf(state->name, sizeof(state->name), "%s",
             kind == PROTOCOL_OBJECT_NODE       ? message->set_node.name
             : kind == PROTOCOL_OBJECT_MATERIAL ? message->set_material.name
             : kind == PROTOCOL_OBJECT_LIGHT    ? message->set_light.name
             : kind == PROTOCOL_OBJECT_CAMERA   ? message->set_camera.name
                                                : "");
    for (size_t i = 0; i < count; i++) {
        if (!edit_field_applies(&fields[i], message))
            continue;
        struct fl_field_value *value = &state->fields[state->count++];
        value->field = fields[i];
        edit_field_load(&fields[i], message, value->values);
    }
    edit_object_finish(&object);
    return true;
}
