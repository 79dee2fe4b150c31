/* SPDX-License-Identifier: MIT */
/* The request of a frame, and what follows from it alone. */
#ifndef FARLIGHT_RENDER_CONTEXT_REQUEST_H
#define FARLIGHT_RENDER_CONTEXT_REQUEST_H

#include "base/error.h"
#include "base/words.h"
#include "base/ycbcr.h"
#include "protocol/values.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stdint.h>

/* Formats of attachments alone, which follow those of the wire. */
enum { PIXEL_FORMAT_DEPTH32F = PIXEL_FORMAT_COUNT, PIXEL_FORMAT_NORMAL8, PIXEL_FORMAT_SHARE8 };

struct frame_camera {
    float world_from_view[12]; /* rigid; looks along -z, y up */
    float fov_y;               /* radians, of the whole picture's height; 0: orthographic */
    float ortho_height;
    float near; /* metres; 0: chosen from the scene */
};

/* How the frames of a view follow each other (render/passes/denoise/history.h). */
enum frame_history {
    HISTORY_NONE,  /* the frame stands alone, and so does the next one */
    HISTORY_KEPT,  /* the frame stands alone, and the next one may follow it */
    HISTORY_USED,  /* the frame follows the one before */
    HISTORY_MOVING /* HISTORY_USED with other noise, whatever the seed; no samples are added to it */
};

/* A part of a picture, pixels. */
struct frame_crop {
    uint32_t x, y, width, height;
};

/* A shadow catcher: a disc that shows what lies behind it, times the share of light that reaches it, where a ray
 * of the eye from above it meets nothing else. Nothing else sees it, and it throws no shadow;
 * shaders/render/ground.comp has the share. Not with VIEW_SOURCE_LAYERS; the integrator raycast, which has no
 * shadows, shows none, and neither does a hidden_layer. */
struct frame_ground {
    float centre_world[3], normal_world[3]; /* unit */
    float radius;                           /* 0: there is none */
};

/* The records are those of `render`, which protocol/values.def explains; zeros stand for defaults. The session
 * passes them whole, and the engine adds what a frame has of its own. */
struct frame_request {
    /* width and height are those of all views together, row by row; each view has an eye of its own, see
     * frame_view_eye(). With a crop, only the tiles of 8 x 8 pixels that it touches get samples. */
    struct record_picture picture;
    struct record_sampling sampling;
    struct record_lighting light;
    struct record_comparison comparison; /* the second tracer has the same options */
    struct record_tracing tracing;
    struct tracer_options tracer_options; /* tracing.settings within the daemon's limits */
    /* Another camera than the picture's sees what is rendered; only with VIEW_SOURCE_LAYERS. */
    bool has_key;
    struct frame_camera key_camera;
    /* 0: what is seen. 1, 2: of the surfaces that it hides, the first and the second at each pixel that an eye
     * within hidden_radius sees past what hides them; elsewhere there is nothing. */
    uint32_t hidden_layer;
    float hidden_radius; /* metres; of that */
    struct frame_camera camera;
    /* The camera a frame earlier and a frame later, for LAYER_MOTION; without them it stands still. */
    bool has_neighbours;
    struct frame_camera camera_earlier, camera_later;
    double clips_time_s; /* when that is; 0: nothing plays */
    float aperture;      /* diameter of the lens, metres; 0: everything is sharp, or the camera has none */
    float focus;         /* distance along the view of the plane that is sharp, metres; 0: middle of the scene */
    struct frame_ground ground;
    uint32_t attachments; /* bits; beside the picture alone, in any format of it */
    /* RGBA8 of the picture alone: it comes as these planes, which are less to read back, and which its encoder
     * need not make of it. */
    enum ycbcr ycbcr;
    /* With sampling.accumulate the frame goes on where the one before it ended, if that showed the same and was to
     * be gone on from: scene, motion and request alike but for the number of samples and what is done with the sum
     * (format, tone map, exposure); it adds its samples to those. n frames of k samples hold what one of n x k
     * does, to the bit. */
    bool starts_anew; /* with that: this frame does not go on; those after it may go on from this one */
    /* With that: the limit of accumulated samples; of `samples` only those up to it are added. 0: no limit. */
    uint32_t samples_max;
    /* With picture.denoise: whether the picture, but not its sums, has what those before it have of the same
     * places. */
    enum frame_history history;
};

/* The part of the picture that the frame shows: its crop, or the whole picture. */
struct frame_crop frame_request_crop(const struct frame_request *request);
bool frame_request_is_cropped(const struct frame_request *request);
/* The layers as bits, with the beauty where the request names none. */
uint32_t frame_request_layers(const struct frame_request *request);
/* The plane that an attachment alone is made of: a layer after all others. */
#define LAYER_STICKING ((enum layer)31)
/* Whether a layer holds the first sample of each pixel, in place of the mean of all; whether it is a part of the
 * light. */
bool frame_request_is_first_sample(enum layer layer);
bool frame_request_is_light(enum layer layer);
/* Bits of the picture's planes: layers, and those that attachments are made of. */
uint32_t frame_request_planes(const struct frame_request *request);
/* The format of a plane's pixels on the host; where the request attaches the plane, that of the attachment. */
unsigned frame_request_plane_format(const struct frame_request *request, enum layer layer);
uint32_t frame_format_bytes(unsigned format); /* bytes of a pixel */
/* Bytes of a plane's rows on the host; a multiple of 8 rows, or all that there are. In Y'CbCr an odd last row has
 * two. */
uint64_t frame_request_plane_bytes(const struct frame_request *request, enum layer layer, uint32_t rows);
/* Bytes of the frame's pixels, all planes. */
uint64_t frame_request_bytes(const struct frame_request *request);
/* Whether another background than the environment is seen behind the picture's surfaces. */
bool frame_request_hides_environment(const struct frame_request *request);
/* The limit of radiance by the request's clamp, before exposure; 0: there is none. */
float frame_request_radiance_limit(const struct frame_request *request);
/* Whether the same ray brings the same radiance. */
bool frame_request_same_radiance(const struct frame_request *a, const struct frame_request *b);
/* Whether it is not known beforehand how many samples a pixel will have. */
bool frame_request_is_open_ended(const struct frame_request *request);
/* Whether the samples of `b` may be added to those of `a`: they are equal but for their number and the use of the
 * sum, and `b` does not start anew. */
bool frame_request_adds_to(const struct frame_request *a, const struct frame_request *b);

#endif
