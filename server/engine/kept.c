/* SPDX-License-Identifier: MIT */
/* Scenes that others than their client may attach to, on their way to the keeper. */
#include "engine/engine_private.h"

#include "base/clock.h"

/* Minimum time between two saves of a scene, and its multiple of the time for which changes waited during the last
 * one. */
#define PAUSE_NS UINT64_C(1000000000)
#define PAUSE_OF_READ 20
/* Time for saves at the end, as clients have got answers that their changes are made: a daemon that is asked
 * to stop ends within a second. */
#define STOP_NS UINT64_C(800000000)

static bool has_news(const struct engine_scene *scene)
{
    return scene->sharing != SHARING_PRIVATE && !scene->commit && scene->known.revision > scene->kept_revision;
}

static void keep_scene(struct engine *engine, struct engine_scene *scene, uint64_t now_ns)
{
    scene->keep_due_ns = now_ns + PAUSE_NS;
    if (!keep_save(engine->keep, scene->scene, scene->principal, scene->sharing))
        return; /* tried again later */
    scene->kept_revision = scene->known.revision;
    engine->read_scene = scene;
}

/* Lets the scene that was read change again, or end. */
static void finish_reading(struct engine *engine)
{
    uint64_t read_ns;
    if (!engine->read_scene || !keep_was_read(engine->keep, &read_ns))
        return;
    struct engine_scene *scene = engine->read_scene;
    uint64_t pause_ns = read_ns * PAUSE_OF_READ;
    engine->read_scene = NULL;
    if (engine->read_scene_ended) {
        engine->read_scene_ended = false;
        engine_scene_free(engine, scene);
        return;
    }
    scene->keep_due_ns = clock_now_ns() + (pause_ns > PAUSE_NS ? pause_ns : PAUSE_NS);
    engine_run_waiting(engine, scene);
}

uint64_t engine_keep_scenes(struct engine *engine)
{
    if (!engine->keep)
        return UINT64_MAX;
    finish_reading(engine);
    struct engine_scene *first = NULL;
    uint64_t now_ns = clock_now_ns();
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        if (!has_news(scene))
            continue;
        if (!scene->keep_due_ns)
            scene->keep_due_ns = now_ns + PAUSE_NS; /* a client that loads a scene probably continues */
        if (!first || scene->keep_due_ns < first->keep_due_ns)
            first = scene;
    }
    if (!first || engine->read_scene || !keep_is_idle(engine->keep))
        return UINT64_MAX; /* the keeper wakes this thread when it is done */
    if (first->keep_due_ns <= now_ns)
        keep_scene(engine, first, now_ns);
    return first->keep_due_ns - now_ns;
}

void engine_forget_kept(struct engine *engine, const struct engine_scene *scene)
{
    /* A scene that could not be restored stays with the keeper, which decides on it. */
    if (engine->keep && scene->kept_revision && scene->known.revision >= scene->kept_revision)
        keep_forget(engine->keep, scene->principal, scene->scene->name);
}

void engine_stop_keeping(struct engine *engine)
{
    for (struct engine_scene *scene = engine->scenes; scene && engine->keep; scene = scene->next) {
        if (has_news(scene) && engine->read_scene != scene)
            keep_save(engine->keep, scene->scene, scene->principal, scene->sharing);
    }
    keep_destroy(engine->keep, STOP_NS);
    engine->keep = NULL;
    if (engine->read_scene_ended)
        engine_scene_free(engine, engine->read_scene);
    engine->read_scene = NULL;
}
