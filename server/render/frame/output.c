/* SPDX-License-Identifier: MIT */
/* Hands a picture's bands to the host: one is fetched while the next one is copied. */
#include "render/frame/output.h"

#include "render/frame/ready.h"
#include "render/picture/readback.h"
#include "render/picture/resolve.h"

static bool reserve_pixels(struct frame_renderer *renderer, struct error *error)
{
    struct error failed = {0};
    reserve_begin(renderer);
    bool reserved = picture_reserve_pixels(&renderer->picture, &renderer->work->frame, &failed);
    return reserve_end(renderer, reserved, &failed, error);
}

static bool all_resolved(const struct frame_renderer *renderer)
{
    return renderer->plane == renderer->picture.plane_count;
}

/* The previous band is fetched while this one is copied. */
static bool pass_on(struct frame_renderer *renderer, bool has_band, uint32_t plane, uint32_t band,
                    struct error *error)
{
    struct picture *picture = &renderer->picture;
    struct frame_work *work = renderer->work;
    struct gpu_readback *before = &work->copies[renderer->copied % 2];
    struct gpu_readback *next = &work->copies[(renderer->copied + 1) % 2];
    if (has_band && !picture_copy_band(picture, &work->frame, next, plane, band, error))
        return false;
    if (renderer->copying &&
        !picture_take_band(picture, &work->frame, before, renderer->copied_plane, renderer->copied_band, error))
        return false;
    renderer->copying = has_band;
    renderer->copied++;
    renderer->copied_plane = plane;
    renderer->copied_band = band;
    return true;
}

/* Resolves a band of a plane and passes the band before it on; the last one is followed by none. */
static bool read_band(struct frame_renderer *renderer, struct error *error)
{
    struct picture *picture = &renderer->picture;
    struct frame_work *work = renderer->work;
    const uint32_t plane = renderer->plane, band = renderer->band;
    if (!picture->pixels)
        return reserve_pixels(renderer, error);
    context_set_number(&work->wave, 0);
    if (all_resolved(renderer))
        return pass_on(renderer, false, 0, 0, error);
    if (++renderer->band == picture->band_count) {
        renderer->band = 0;
        renderer->plane++;
    }
    return picture_resolve_band(picture, &work->frame, plane, band, error) &&
           pass_on(renderer, true, plane, band, error);
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    struct frame_renderer *renderer = self;
    (void)wave;
    if (!read_band(renderer, error))
        return PASS_FAILED;
    return all_resolved(renderer) && !renderer->copying ? PASS_DONE : PASS_MORE;
}

const struct pass output_pass = {.name = "output", .run = run};

bool output_waits(const struct frame_renderer *renderer)
{
    return renderer->picture.pixels && renderer->copying && all_resolved(renderer) &&
           !gpu_readback_is_done(&renderer->work->copies[renderer->copied % 2]);
}
