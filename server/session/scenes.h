/* SPDX-License-Identifier: MIT */
/* Scenes of one session: opened, attached to, described, closed; and notices of their changes. */
#ifndef FARLIGHT_SESSION_SCENES_H
#define FARLIGHT_SESSION_SCENES_H

#include "engine/engine.h"
#include "protocol/framing.h"
#include "session/requests.h"

#define SCENES_LIST_MAX 256 /* maximum of entries in the message */

/* A SCENE_LIST_REPLY of this worker, which refers to `entries` and the list. */
void scenes_fill_list(struct message *message, struct record_scene_entry entries[SCENES_LIST_MAX],
                      const struct engine_scene_list *list);

enum session_scene_state { SCENE_OPENING = 1, SCENE_OPEN, SCENE_CLOSING };

void scenes_open(struct session *session, struct request *request, const struct message_scene_open *open);
void scenes_attach(struct session *session, struct request *request, const struct message_scene_attach *attach);
void scenes_close(struct session *session, struct request *request, const struct message_scene_close *close);
void scenes_list(struct session *session, struct request *request);
void scenes_describe(struct session *session, struct request *request,
                     const struct message_scene_describe *describe);

void scenes_list_objects(struct session *session, struct request *request,
                         const struct message_scene_objects *objects);
void scenes_get_object(struct session *session, struct request *request, const struct message_object_get *get);

/* State of a scene, 0: it does not exist. */
enum session_scene_state session_scene(const struct session *session, uint32_t scene);
/* Name by which the scene was opened or attached to; empty: none. */
const char *session_scene_name(const struct session *session, uint32_t scene);

/* The engine's answers. */
void scenes_opened(struct session *session, struct request *request, uint64_t revision);
void scenes_closed(struct session *session, struct request *request);
/* Answers with the list and the shared scenes of other workers; takes over the list. */
void scenes_listed(struct session *session, struct request *request, struct engine_scene_list *list);
/* Handles an attach that the engine refused with `error`: moves the client to the worker that has the scene, if
 * there is one. */
void scenes_find_elsewhere(struct session *session, struct request *request, const struct error *error);
void scenes_described(struct session *session, struct request *request,
                      const struct engine_scene_description *description);
void scenes_objects_listed(struct session *session, struct request *request,
                           const struct engine_object_list *list);
void scenes_object_is(struct session *session, struct request *request, const struct engine_event *event);
/* Removes the scene of a failed request. `submitted`: the engine refused the request; otherwise the engine was not
 * asked, and an open scene stays open. Sends no answer. */
void scenes_failed(struct session *session, const struct request *request, bool submitted);

/* Notes a change by another client. The notice is sent as soon as the queue has space, with the last revision
 * only. */
void scenes_changed(struct session *session, uint32_t scene, uint64_t revision);
void scenes_send_changes(struct session *session);
void scenes_finish(struct session *session);

#endif
