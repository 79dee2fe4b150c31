/* SPDX-License-Identifier: MIT */
/* Loader of libavcodec on first use: linked, it and its dependencies would cost every start of the daemon 20 to
 * 60 ms, though few ever encode video. */
#ifndef FARLIGHT_ENCODE_LIBAV_H
#define FARLIGHT_ENCODE_LIBAV_H

#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>

#define LIBAVUTIL_FUNCTIONS(FUNCTION)                                                                             \
    FUNCTION(av_dict_free)                                                                                        \
    FUNCTION(av_dict_set)                                                                                         \
    FUNCTION(av_frame_alloc)                                                                                      \
    FUNCTION(av_frame_free)                                                                                       \
    FUNCTION(av_frame_get_buffer)                                                                                 \
    FUNCTION(av_frame_make_writable)                                                                              \
    FUNCTION(av_log_set_level)                                                                                    \
    FUNCTION(av_opt_set_double)                                                                                   \
    FUNCTION(av_strerror)
#define LIBAVCODEC_FUNCTIONS(FUNCTION)                                                                            \
    FUNCTION(av_packet_alloc)                                                                                     \
    FUNCTION(av_packet_free)                                                                                      \
    FUNCTION(av_packet_unref)                                                                                     \
    FUNCTION(avcodec_alloc_context3)                                                                              \
    FUNCTION(avcodec_find_encoder_by_name)                                                                        \
    FUNCTION(avcodec_free_context)                                                                                \
    FUNCTION(avcodec_open2)                                                                                       \
    FUNCTION(avcodec_receive_packet)                                                                              \
    FUNCTION(avcodec_send_frame)

struct libav {
#define FUNCTION(name) __typeof__(&name) name;
    LIBAVUTIL_FUNCTIONS(FUNCTION)
    LIBAVCODEC_FUNCTIONS(FUNCTION)
#undef FUNCTION
};

/* Loads the library for good. NULL: the version that this was built for is missing. Any thread. */
const struct libav *libav_load(void);

#endif
