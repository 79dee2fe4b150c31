/* SPDX-License-Identifier: MIT */
/* Changes of the picture's settings by keys. */
#include "settings.h"

#include <stdlib.h>

const char *const local_views_names[LOCAL_VIEWS_COUNT + 1] = {"off", "auto", "on", NULL};

#define EXPOSURE_THIRDS_MAX 36 /* twelve stops */

static int around(int value, int step, int count)
{
    return (value + step + count) % count;
}

/* Numbers may have gaps. */
static bool is_for_everybody(enum protocol_tracer tracer)
{
    const struct tracer_desc *desc = tracer_describe((uint32_t)tracer);
    return desc && !desc->is_for_tests;
}

/* Applies actions that only an open panel handles. */
static enum settings_change act_on_panel(struct settings *settings, enum action action)
{
    const size_t count = panel_setting_count(settings->tracer);
    if (count == 0)
        return SETTINGS_SAME;
    switch (action) {
    case ACTION_UP:
    case ACTION_DOWN:
        settings->setting = (settings->setting + (action == ACTION_DOWN ? 1 : count - 1)) % count;
        return SETTINGS_DRAWN;
    case ACTION_STEP_BACK:
    case ACTION_STEP_ON:
        return panel_change(panel_setting(settings->tracer, settings->setting), &settings->tracers,
                            action == ACTION_STEP_ON ? 1 : -1)
                   ? SETTINGS_VIEW
                   : SETTINGS_SAME;
    default:
        return SETTINGS_SAME;
    }
}

/* Applies actions that change the daemon's picture. */
static bool change_view(struct settings *settings, enum action action)
{
    const struct settings before = *settings;
    switch (action) {
    case ACTION_NEXT_TRACER:
    case ACTION_PREVIOUS_TRACER:
        do /* tracers for tests are skipped */
            settings->tracer = (enum protocol_tracer)around(
                (int)settings->tracer, action == ACTION_NEXT_TRACER ? 1 : -1, PROTOCOL_TRACER_COUNT);
        while (!is_for_everybody(settings->tracer));
        settings->setting = 0;
        return true;
    case ACTION_NEXT_INTEGRATOR:
    case ACTION_PREVIOUS_INTEGRATOR:
        settings->integrator = (enum protocol_integrator)around(
            (int)settings->integrator, action == ACTION_NEXT_INTEGRATOR ? 1 : -1, PROTOCOL_INTEGRATOR_COUNT);
        return true;
    case ACTION_NEXT_TONE_MAP:
        settings->tone_map = (enum protocol_tone_map)around((int)settings->tone_map, 1, PROTOCOL_TONE_COUNT);
        return true;
    case ACTION_DARKER:
    case ACTION_BRIGHTER:
        settings->exposure_thirds += action == ACTION_DARKER ? -1 : 1;
        if (abs(settings->exposure_thirds) > EXPOSURE_THIRDS_MAX)
            settings->exposure_thirds = before.exposure_thirds;
        return settings->exposure_thirds != before.exposure_thirds;
    case ACTION_COARSER:
        settings->coarser += settings->coarser < SETTINGS_COARSEST;
        return settings->coarser != before.coarser;
    case ACTION_FINER:
        settings->coarser -= settings->coarser > 0;
        return settings->coarser != before.coarser;
    case ACTION_STEREO:
        settings->stereo = !settings->stereo;
        return true;
    case ACTION_VIEW_SOURCE:
        settings->views =
            settings->views == PROTOCOL_VIEW_SOURCE_RAYS ? PROTOCOL_VIEW_SOURCE_LAYERS : PROTOCOL_VIEW_SOURCE_RAYS;
        return settings->stereo;
    default:
        return false;
    }
}

bool settings_is_of_panel(enum action action)
{
    return action == ACTION_UP || action == ACTION_DOWN || action == ACTION_STEP_BACK || action == ACTION_STEP_ON;
}

enum settings_change settings_act(struct settings *settings, enum action action)
{
    if (settings->panel && settings_is_of_panel(action))
        return act_on_panel(settings, action);
    switch (action) {
    case ACTION_PANEL:
        settings->panel = !settings->panel;
        return SETTINGS_DRAWN;
    /* The daemon gets the change with the next motion; a picture at rest continues to be refined */
    case ACTION_LOCAL:
        settings->local = (enum local_views)around((int)settings->local, 1, LOCAL_VIEWS_COUNT);
        return SETTINGS_DRAWN;
    case ACTION_HOLES:
        settings->holes = settings->holes == FL_WARP_FILL ? FL_WARP_PATTERN : FL_WARP_FILL;
        return SETTINGS_DRAWN;
    case ACTION_ERROR_MAP:
        settings->error_map = !settings->error_map;
        return SETTINGS_DRAWN;
    case ACTION_HELP:
        settings->help = !settings->help;
        return SETTINGS_DRAWN;
    case ACTION_OVERLAY:
    case ACTION_OVERLAY_BACK:
        settings->overlay = (enum overlay_mode)around((int)settings->overlay, action == ACTION_OVERLAY ? 1 : -1,
                                                      OVERLAY_MODE_COUNT);
        return SETTINGS_DRAWN;
    default:
        return change_view(settings, action) ? SETTINGS_VIEW : SETTINGS_SAME;
    }
}
