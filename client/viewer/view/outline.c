/* SPDX-License-Identifier: MIT */
/* Outline of the edited object over the resting picture. */
#include "outline.h"
#include "view.h"
#include "viewer/overlay/outline.h"

#include <math.h>
#include <stdlib.h>

#define THICKNESS 2.0 /* pixels of the desktop */

/* ---- the outlined object ---- */

/* Lights and the environment have no surface, and an error map shows no objects. */
static bool is_wanted(const struct view *view)
{
    const struct edit_choice *edit = view->choice;
    return edit->shown && edit->tab < EDIT_LIGHT && edit->ids[edit->tab] != 0 && !view->settings.error_map;
}

/* Returns whether the daemon's own picture is shown, with the camera last sent. */
static bool is_still(const struct view *view)
{
    return view->frames.is_live && !view->local.shows_made && view->sent.has_sent_camera &&
           !view->sent.must_send_camera && !view->sent.must_send_view && !view->sent.moving &&
           view->frames.last.command == view->sent.command && view->frames.last.change == view->sent.change &&
           !view->frames.last.moving;
}

static bool is_of_picture(const struct view *view)
{
    const struct view_outline *outline = &view->outline;
    return outline->command == view->sent.command && outline->change == view->sent.change &&
           outline->tab == view->choice->tab && outline->id == view->choice->ids[outline->tab];
}

bool view_outline_is_asked(const struct view *view)
{
    return is_wanted(view) && is_of_picture(view) && view->outline.revision == view->frames.last.revision;
}

bool view_outline_is_due(const struct view *view)
{
    const struct edit_choice *edit = view->choice;
    /* Each picture has another revision while a slider is dragged. */
    return is_wanted(view) && !edit->dragging && !edit->has_pending && is_still(view) &&
           view_is_at_rest(view, 1) && !(view->outline.is_answered && view_outline_is_asked(view));
}

/* ---- requests ---- */

void view_outline_ask(struct view *view, struct message_render *job)
{
    struct view_outline *outline = &view->outline;
    const struct edit_choice *edit = view->choice;
    view_outline_forget(view);
    outline->command = view->sent.command;
    outline->change = view->sent.change;
    outline->revision = view->frames.last.revision;
    outline->tab = edit->tab;
    outline->id = edit->ids[edit->tab];
    job->picture.width = (uint32_t)view->frames.live.width;
    job->picture.height = (uint32_t)view->frames.live.height;
    job->tracing.primary = view_primary(view);
    job->encoding = session_is_local(view->session) ? PROTOCOL_ENCODING_RAW : PROTOCOL_ENCODING_ZSTD;
    view_use_eyes(view, job);
    job->picture.view_source = PROTOCOL_VIEW_SOURCE_RAYS;
}

/* Lists one material, or one node with its descendants. */
static uint32_t *ids_of(struct view *view, size_t *count)
{
    struct view_outline *outline = &view->outline;
    struct fl_object *nodes = NULL;
    struct fl_error refusal = {0};
    size_t node_count = 0;
    /* Without the list of nodes, the node alone is outlined. */
    if (outline->tab == EDIT_NODE)
        session_objects(view->session, PROTOCOL_OBJECT_NODE, &nodes, &node_count, &refusal);
    const struct fl_object alone = {.id = outline->id};
    uint32_t *ids = nodes ? outline_family(nodes, node_count, outline->id, count)
                          : outline_family(&alone, 1, outline->id, count);
    free(nodes);
    return ids;
}

static unsigned reach_of(const struct view *view)
{
    const double pixels = THICKNESS * view->screen->scale / (1 << view->settings.coarser);
    return pixels > 1 ? (unsigned)lround(pixels) : 1;
}

void view_outline_take(struct view *view, const struct fl_frame *frame)
{
    struct view_outline *outline = &view->outline;
    const size_t pixels = (size_t)frame->width * frame->height;
    const bool is_stereo = view->settings.stereo, over = view->options->stereo_over;
    const struct outline_size size = {.width = frame->width,
                                      .height = frame->height,
                                      .views_across = is_stereo && !over ? 2 : 1,
                                      .views_down = is_stereo && over ? 2 : 1};
    size_t count = 0;
    outline->is_answered = true;
    uint32_t *ids = ids_of(view, &count);
    uint8_t *marks = malloc(pixels);
    if (ids && marks) {
        outline_mark(frame->pixels, pixels, outline->tab == EDIT_NODE ? OUTLINE_BY_NODE : OUTLINE_BY_MATERIAL, ids,
                     count, marks);
        if (outline_trace(marks, &size, reach_of(view))) {
            outline->marks = marks;
            outline->width = (int)frame->width;
            outline->height = (int)frame->height;
            marks = NULL;
        }
    }
    free(marks);
    free(ids);
}

void view_outline_refuse(struct view *view)
{
    view->outline.is_answered = true;
}

/* ---- drawing ---- */

/* Returns whether the outline fits the picture. An outline of an older revision remains while a material
 * changes, since surfaces do not move. */
static bool fits(const struct view *view)
{
    const struct view_outline *outline = &view->outline;
    return outline->marks && is_wanted(view) && is_of_picture(view) && is_still(view) &&
           (outline->revision == view->frames.last.revision || outline->tab == EDIT_MATERIAL) &&
           outline->width == view->frames.live.width && outline->height == view->frames.live.height;
}

bool view_outline_is_shown(const struct view *view)
{
    return fits(view) && view->outline.is_drawn && view->outline.of_version == view->frames.live.version;
}

void view_step_outline(struct view *view)
{
    struct view_outline *outline = &view->outline;
    struct fl_error ignored;
    if (!view->choice->shown && outline->marks)
        view_outline_forget(view);
    if (!fits(view) || view_outline_is_shown(view) ||
        !pixmap_copy(&outline->picture, &view->frames.live, &ignored))
        return;
    outline_draw(outline->marks, (size_t)outline->width * (size_t)outline->height, outline->picture.pixels);
    outline->of_version = view->frames.live.version;
    outline->is_drawn = view->screen->must_draw = true;
}

void view_outline_forget(struct view *view)
{
    free(view->outline.marks);
    pixmap_finish(&view->outline.picture);
    view->outline = (struct view_outline){0};
}
