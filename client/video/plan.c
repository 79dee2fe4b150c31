/* SPDX-License-Identifier: MIT */
/* Choice of container and encoder. */
#include "encode.h"
#include "lib/rate.h"
#include "palette.h"

#include <libavcodec/avcodec.h>
#include <string.h>
#include <strings.h>

#define DEFAULT_FACTOR 18 /* x264's constant rate factor: hardly distinguishable from the original */
#define FACTOR_MAX 51
/* Hardly distinguishable, too; 95, as for pictures, makes files half as large again. */
#define DEFAULT_WEBP_QUALITY 90

/* H.264 (ITU-T H.264, table A-1): level 6.2 allows 139,264 macroblocks of 16x16. */
#define H264_MACROBLOCKS_MAX 139264u

/* Encoders in order of preference. Others of the library are never used, because some open devices. */
static const struct choice {
    const char *codec;   /* name in options */
    const char *encoder; /* the library's name */
    bool lossless;
} choices[] = {{"h264", "libx264", false}, {"mpeg4", "mpeg4", false}, {"ffv1", "ffv1", true}};

static const struct container {
    const char *ending, *name;
    const char *encoder;      /* the only encoder of an animated picture; NULL: one of the choices */
    enum video_pixels pixels; /* pixels of that encoder */
} containers[] = {{"mp4", "mp4", NULL, VIDEO_YCBCR},
                  {"mkv", "matroska", NULL, VIDEO_YCBCR},
                  {"webp", "webp", "libwebp_anim", VIDEO_RGBA},
                  {"gif", "gif", "gif", VIDEO_PALETTE}};

static const struct container *container_by_ending(const char *ending)
{
    for (size_t i = 0; i < sizeof(containers) / sizeof(containers[0]); i++)
        if (strcasecmp(containers[i].ending, ending) == 0)
            return &containers[i];
    return NULL;
}

static const struct container *container_of(const char *path, const char *fallback)
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
    const bool has_ending = dot && (!slash || dot > slash);
    const struct container *container = has_ending ? container_by_ending(dot + 1) : NULL;
    return container ? container : container_by_ending(fallback);
}

static const struct choice *choose(const struct message_video_begin *wanted, struct video_failure *failure)
{
    bool known = wanted->codec[0] == '\0';
    for (size_t i = 0; i < sizeof(choices) / sizeof(choices[0]); i++) {
        const struct choice *each = &choices[i];
        const bool named = strcmp(each->codec, wanted->codec) == 0;
        known = known || named;
        if ((wanted->codec[0] == '\0' || named) && each->lossless == (wanted->lossless != 0) &&
            avcodec_find_encoder_by_name(each->encoder))
            return each;
        if (named && each->lossless != (wanted->lossless != 0)) {
            video_fail(failure, "codec", NULL, "%s is %slossless, which is %s", each->codec,
                       each->lossless ? "" : "not ", each->lossless ? "not asked for" : "asked for");
            failure->remedy = each->lossless ? "ask for lossless, too" : "for lossless leave the codec out";
            return NULL;
        }
    }
    if (!known)
        video_fail(failure, "codec", "use h264, mpeg4 or ffv1", "'%s' is not a codec that can be written",
                   wanted->codec);
    else
        video_fail(failure, "codec", "install a libavcodec with libx264", "this libavcodec has no encoder for %s",
                   wanted->codec[0] != '\0' ? wanted->codec : "such a video");
    return NULL;
}

static bool plan_film(struct video_plan *plan, const struct message_video_begin *wanted,
                      struct video_failure *failure)
{
    const struct choice *chosen = choose(wanted, failure);
    if (!chosen)
        return false;
    if (chosen->lossless && strcmp(plan->container, "mp4") == 0)
        return video_fail(failure, "lossless", "use the ending .mkv", "an MP4 file cannot contain FFV1");
    if (wanted->quality > FACTOR_MAX)
        return video_fail(failure, "quality", NULL, "a video has 1 (best) to %d", FACTOR_MAX);
    plan->encoder = chosen->encoder;
    plan->pixels = chosen->lossless ? VIDEO_RGB : VIDEO_YCBCR;
    plan->quality = wanted->quality > 0 ? wanted->quality : DEFAULT_FACTOR;
    fl_rate_exact(wanted->frames_per_second, &plan->rate_numerator, &plan->rate_denominator);
    return true;
}

static bool plan_moving_picture(struct video_plan *plan, const struct container *container,
                                const struct message_video_begin *wanted, struct video_failure *failure)
{
    const bool is_gif = container->pixels == VIDEO_PALETTE;
    char reason[256];
    if (wanted->codec[0] != '\0')
        return video_fail(failure, "codec", "leave the codec out", "a .%s file is written in one way only",
                          container->ending);
    if (is_gif && wanted->lossless)
        return video_fail(failure, "lossless", "use the ending .webp or .mkv", "a GIF file has 256 colours");
    if (!avcodec_find_encoder_by_name(container->encoder))
        return video_fail(failure, "codec", "install a libavcodec with it", "this libavcodec has no encoder %s",
                          container->encoder);
    plan->palette = is_gif ? palette_loaded(reason, sizeof(reason)) : NULL;
    if (is_gif && !plan->palette)
        return video_fail(failure, "path", NULL, "%s", reason);
    plan->encoder = container->encoder;
    plan->pixels = container->pixels;
    plan->quality = wanted->quality > 0 ? wanted->quality : DEFAULT_WEBP_QUALITY;
    fl_rate_exact(wanted->frames_per_second, &plan->rate_numerator, &plan->rate_denominator);
    if (is_gif) {
        plan->rate_numerator = 100;
        plan->rate_denominator = fl_rate_gif_delay(wanted->frames_per_second);
    }
    return true;
}

bool video_plan(struct video_plan *plan, const struct message_video_begin *wanted, struct video_failure *failure)
{
    const struct container *container = container_of(wanted->path, wanted->format);
    if (!container)
        return video_fail(failure, "path", "use the ending .mp4, .mkv, .webp or .gif",
                          "the ending belongs to no supported video format");
    *plan = (struct video_plan){.container = container->name, .lossless = wanted->lossless != 0};
    return container->encoder ? plan_moving_picture(plan, container, wanted, failure)
                              : plan_film(plan, wanted, failure);
}

bool video_plan_allows(const struct video_plan *plan, uint32_t width, uint32_t height,
                       struct video_failure *failure)
{
    const uint32_t macroblocks = ((width + 15) / 16) * ((height + 15) / 16);
    return strcmp(plan->encoder, "libx264") != 0 || macroblocks <= H264_MACROBLOCKS_MAX ||
           video_fail(failure, "size", "render smaller frames, or a lossless .mkv",
                      "H.264 cannot encode pictures of %ux%u: the maximum is 35,651,584 pixels", width, height);
}
