/* SPDX-License-Identifier: MIT */
/* The outline of what the panel changes: asked for once the picture is at rest, and drawn over that picture alone.
 */
#include "viewer/overlay/outline.h"
#include "viewer/viewer_state.h"

#include <math.h>
#include <stdlib.h>

#define THICKNESS 2.0 /* pixels of the desktop */

/* ---- what it is of ---- */

/* Lights and the environment are seen nowhere, and an error map shows no objects. */
static bool is_wanted(const struct viewer *viewer)
{
    const struct viewer_edit *edit = &viewer->edit;
    return edit->shown && edit->tab < EDIT_LIGHT && edit->ids[edit->tab] != 0 && !viewer->settings.error_map;
}

/* The picture that is shown is the daemon's, of the camera that it was told last. */
static bool is_still(const struct viewer *viewer)
{
    return viewer->is_live && !viewer->shows_made && viewer->has_looked && !viewer->must_look &&
           !viewer->must_show && !viewer->told_moving && viewer->frame.command == viewer->command &&
           viewer->frame.change == viewer->change && !viewer->frame.moving;
}

static bool is_of_picture(const struct viewer *viewer)
{
    const struct viewer_outline *outline = &viewer->outline;
    return outline->command == viewer->command && outline->change == viewer->change &&
           outline->tab == viewer->edit.tab && outline->id == viewer->edit.ids[outline->tab];
}

bool viewer_outline_is_asked(const struct viewer *viewer)
{
    return is_wanted(viewer) && is_of_picture(viewer) && viewer->outline.revision == viewer->frame.revision;
}

bool viewer_outline_is_due(const struct viewer *viewer)
{
    const struct viewer_edit *edit = &viewer->edit;
    /* While a slider is dragged every picture is of another revision. */
    return is_wanted(viewer) && !edit->dragging && !edit->has_pending && is_still(viewer) &&
           viewer_is_at_rest(viewer, 1) && !(viewer->outline.is_answered && viewer_outline_is_asked(viewer));
}

/* ---- asking ---- */

void viewer_outline_ask(struct viewer *viewer, struct message_render *job)
{
    struct viewer_outline *outline = &viewer->outline;
    const struct viewer_edit *edit = &viewer->edit;
    viewer_outline_forget(viewer);
    outline->command = viewer->command;
    outline->change = viewer->change;
    outline->revision = viewer->frame.revision;
    outline->tab = edit->tab;
    outline->id = edit->ids[edit->tab];
    job->width = (uint32_t)viewer->live.width;
    job->height = (uint32_t)viewer->live.height;
    job->primary = viewer_primary(viewer);
    job->encoding = session_is_local(viewer->session) ? PROTOCOL_ENCODING_RAW : PROTOCOL_ENCODING_ZSTD;
    viewer_use_eyes(viewer, job);
    job->view_source = PROTOCOL_VIEW_SOURCE_RAYS;
}

/* A material alone, or a node with all that is below it. */
static uint32_t *ids_of(struct viewer *viewer, size_t *count)
{
    struct viewer_outline *outline = &viewer->outline;
    struct fl_object *nodes = NULL;
    struct fl_error refusal = {0};
    size_t node_count = 0;
    /* Without the list it is the node alone. */
    if (outline->tab == EDIT_NODE)
        session_objects(viewer->session, PROTOCOL_OBJECT_NODE, &nodes, &node_count, &refusal);
    const struct fl_object alone = {.id = outline->id};
    uint32_t *ids = nodes ? outline_family(nodes, node_count, outline->id, count)
                          : outline_family(&alone, 1, outline->id, count);
    free(nodes);
    return ids;
}

static unsigned reach_of(const struct viewer *viewer)
{
    const double pixels = THICKNESS * viewer->scale / (1 << viewer->settings.coarser);
    return pixels > 1 ? (unsigned)lround(pixels) : 1;
}

void viewer_outline_take(struct viewer *viewer, const struct fl_frame *frame)
{
    struct viewer_outline *outline = &viewer->outline;
    const size_t pixels = (size_t)frame->width * frame->height;
    const bool is_stereo = viewer->settings.stereo, over = viewer->options->stereo_over;
    const struct outline_size size = {.width = frame->width,
                                      .height = frame->height,
                                      .views_across = is_stereo && !over ? 2 : 1,
                                      .views_down = is_stereo && over ? 2 : 1};
    size_t count = 0;
    outline->is_answered = true;
    uint32_t *ids = ids_of(viewer, &count);
    uint8_t *marks = malloc(pixels);
    if (ids && marks) {
        outline_mark(frame->pixels, pixels, outline->tab == EDIT_NODE ? OUTLINE_BY_NODE : OUTLINE_BY_MATERIAL, ids,
                     count, marks);
        if (outline_trace(marks, &size, reach_of(viewer))) {
            outline->marks = marks;
            outline->width = (int)frame->width;
            outline->height = (int)frame->height;
            marks = NULL;
        }
    }
    free(marks);
    free(ids);
}

void viewer_outline_refuse(struct viewer *viewer)
{
    viewer->outline.is_answered = true;
}

/* ---- showing ---- */

/* One of an older revision stays while a material is changed, until the new one is there: surfaces stay where they
 * are. */
static bool fits(const struct viewer *viewer)
{
    const struct viewer_outline *outline = &viewer->outline;
    return outline->marks && is_wanted(viewer) && is_of_picture(viewer) && is_still(viewer) &&
           (outline->revision == viewer->frame.revision || outline->tab == EDIT_MATERIAL) &&
           outline->width == viewer->live.width && outline->height == viewer->live.height;
}

bool viewer_outline_is_shown(const struct viewer *viewer)
{
    return fits(viewer) && viewer->outline.is_drawn && viewer->outline.of_version == viewer->live.version;
}

void viewer_step_outline(struct viewer *viewer)
{
    struct viewer_outline *outline = &viewer->outline;
    struct fl_error ignored;
    if (!viewer->edit.shown && outline->marks)
        viewer_outline_forget(viewer);
    if (!fits(viewer) || viewer_outline_is_shown(viewer) ||
        !pixmap_copy(&outline->picture, &viewer->live, &ignored))
        return;
    outline_draw(outline->marks, (size_t)outline->width * (size_t)outline->height, outline->picture.pixels);
    outline->of_version = viewer->live.version;
    outline->is_drawn = viewer->must_draw = true;
}

void viewer_outline_forget(struct viewer *viewer)
{
    free(viewer->outline.marks);
    pixmap_finish(&viewer->outline.picture);
    viewer->outline = (struct viewer_outline){0};
}
