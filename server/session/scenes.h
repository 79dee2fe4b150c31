/* SPDX-License-Identifier: MIT */
/* Scenes of one session: opened, attached to, described, closed; and what is heard of them. */
#ifndef FARLIGHT_SESSION_SCENES_H
#define FARLIGHT_SESSION_SCENES_H

#include "engine/engine.h"
#include "protocol/framing.h"
#include "session/requests.h"

enum session_scene_state { SCENE_OPENING = 1, SCENE_OPEN, SCENE_CLOSING };

void scenes_open(struct session *session, struct request *request, const struct message_scene_open *open);
void scenes_attach(struct session *session, struct request *request, const struct message_scene_attach *attach);
void scenes_close(struct session *session, struct request *request, const struct message_scene_close *close);
void scenes_list(struct session *session, struct request *request);
void scenes_describe(struct session *session, struct request *request,
                     const struct message_scene_describe *describe);

/* State of a scene, 0 if there is none. */
enum session_scene_state session_scene(const struct session *session, uint32_t scene);

/* The engine's answers: to an open or an attach, to a close, to the others. */
void scenes_opened(struct session *session, struct request *request, uint64_t revision);
void scenes_closed(struct session *session, struct request *request);
void scenes_listed(struct session *session, struct request *request, const struct engine_scene_list *list);
void scenes_described(struct session *session, struct request *request,
                      const struct engine_scene_description *description);
/* A request of this kind that failed: its scene is forgotten. `submitted`: by the engine; else it was never asked,
 * and what was open stays so. Does not answer. */
void scenes_failed(struct session *session, const struct request *request, bool submitted);

/* Another client has changed a scene. It is told as soon as there is room, the last revision alone. */
void scenes_changed(struct session *session, uint32_t scene, uint64_t revision);
void scenes_tell_changes(struct session *session);
void scenes_finish(struct session *session);

#endif
