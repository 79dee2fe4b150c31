/* SPDX-License-Identifier: MIT */
/* The module that makes palettes: one palette for all pictures by median cut (Heckbert 1982, in libavfilter),
 * and an ordered dither, which stays the same where the picture does. */
#include "palette.h"

#include <libavfilter/avfilter.h>
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <stdio.h>
#include <stdlib.h>

struct palette {
    AVFilterGraph *graph;
    AVFilterContext *source, *sink; /* nodes of the graph */
};

static void destroy(struct palette *palette)
{
    avfilter_graph_free(&palette->graph);
    free(palette);
}

static int build(struct palette *palette, int width, int height)
{
    char text[512];
    AVFilterInOut *inputs = NULL, *outputs = NULL;
    snprintf(text, sizeof(text),
             "buffer@source=video_size=%dx%d:pix_fmt=bgra:time_base=1/1,split[seen][shown];"
             "[seen]palettegen[palette];[shown][palette]paletteuse=dither=bayer:bayer_scale=4,buffersink@sink",
             width, height);
    int result = avfilter_graph_parse2(palette->graph, text, &inputs, &outputs);
    avfilter_inout_free(&inputs);
    avfilter_inout_free(&outputs);
    if (result < 0)
        return result;
    palette->source = avfilter_graph_get_filter(palette->graph, "buffer@source");
    palette->sink = avfilter_graph_get_filter(palette->graph, "buffersink@sink");
    return avfilter_graph_config(palette->graph, NULL);
}

static int create(struct palette **palette, int width, int height)
{
    struct palette *made = calloc(1, sizeof(*made));
    if (!made)
        return AVERROR(ENOMEM);
    made->graph = avfilter_graph_alloc();
    const int result = made->graph ? build(made, width, height) : AVERROR(ENOMEM);
    if (result < 0)
        destroy(made);
    else
        *palette = made;
    return result;
}

static int put(struct palette *palette, AVFrame *picture)
{
    return av_buffersrc_add_frame_flags(palette->source, picture,
                                        AV_BUFFERSRC_FLAG_KEEP_REF | AV_BUFFERSRC_FLAG_PUSH);
}

static int take(struct palette *palette, AVFrame *picture)
{
    return av_buffersink_get_frame(palette->sink, picture);
}

const struct palette_maker palette_maker = {.create = create, .put = put, .take = take, .destroy = destroy};
