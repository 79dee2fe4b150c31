/* SPDX-License-Identifier: MIT */
/* One frame, in order: update, primary, waves, resolve, readback. */
#ifndef FARLIGHT_RENDER_FRAME_H
#define FARLIGHT_RENDER_FRAME_H

#include "base/error.h"
#include "base/stage_times.h"
#include "base/ycbcr.h"
#include "gpu/device.h"
#include "scene/pose.h"
#include "scene/scene.h"
#include "trace/tracer.h"
#include "render/compare/rays.h"

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

/* Of a view, whose frames follow each other (render/passes/denoise/history.h). */
enum frame_history {
    HISTORY_NONE,  /* the frame stands alone, and so does the next one */
    HISTORY_KEPT,  /* it stands alone, and the next one may follow it */
    HISTORY_USED,  /* it follows the one before */
    HISTORY_MOVING /* and has other noise than that, whatever the seed; no samples are added to its own */
};

/* A part of a picture, pixels; width 0: all of it. */
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

struct frame_request {
    uint32_t width, height; /* of the whole picture */
    /* Only the tiles of 8 x 8 pixels that this part touches get samples, and the result is the part. Not with
     * `noise` and `denoise`, which look at pixels around, attachments and VIEW_SOURCE_LAYERS. */
    struct frame_crop crop;
    /* Views in it, of the same size, row by row; 0: 1. Each is that of an eye of its own, see frame_view_eye(). */
    uint32_t views_across, views_down;
    float baseline; /* metres between neighbouring eyes */
    bool eyes_over; /* views one below the other are those of eyes side by side */
    enum view_source view_source;
    /* What is rendered is seen by another camera than the picture's; only with VIEW_SOURCE_LAYERS. */
    bool has_key;
    struct frame_camera key_camera;
    /* 0: what is seen. 1, 2: of the surfaces that it hides, the first and the second at each pixel that an eye
     * within hidden_radius sees past what hides them; elsewhere there is nothing. */
    uint32_t hidden_layer;
    float hidden_radius; /* metres; of that */
    uint32_t samples, depth;
    /* Tiles stop one by one when their error is below that (picture/noise.h); `samples` is the most that one gets.
     * 0: each gets all. Not with `compare` and VIEW_SOURCE_LAYERS. */
    float noise;
    uint64_t seed;
    struct frame_camera camera;
    /* The camera a frame earlier and a frame later, for LAYER_MOTION; without them it stands still. */
    bool has_neighbours;
    struct frame_camera camera_earlier, camera_later;
    double clips_time_s; /* when that is; 0: nothing plays */
    unsigned tracer;     /* protocol's number */
    struct tracer_options tracer_options;
    enum integrator_kind integrator;
    enum primary_kind primary;
    enum tone_map tone_map;
    enum pixel_format format;
    float exposure_stops;
    enum background background;
    float background_colour[3]; /* linear, 0 .. 1; BACKGROUND_COLOUR */
    float aperture;             /* diameter of the lens, metres; 0: everything is sharp, or the camera has none */
    float focus; /* distance along the view of the plane that is sharp, metres; 0: middle of the scene */
    enum pixel_filter filter;
    enum brdf brdf;    /* of rough surfaces; integrator path */
    float clamp;       /* times 2^-exposure_stops: see shaders/render/fireflies.glsl; 0: nothing is limited */
    float ao_distance; /* metres; 0: a tenth of the scene's diagonal */
    float ao_falloff;  /* as a power of 1 - distance / ao_distance; 0: all counts the same */
    uint32_t ao_rays;  /* a sample; 0: 8 */
    float wireframe;   /* pixels: width of lines along the edges of triangles; 0: none */
    struct frame_ground ground;
    float layer_opacity;  /* of opaque surfaces, integrator raycast; 0: 0.5 */
    uint32_t layers;      /* bits; 0: the picture alone. More than it need PIXEL_FORMAT_RGBA32F */
    uint32_t attachments; /* bits; beside the picture alone, in any format of it */
    /* RGBA8 of the picture alone: it comes as these planes, which are less to read back, and which its encoder
     * need not make of it. */
    enum ycbcr ycbcr;
    /* The frame goes on where the one before it ended, if that showed the same and was to be gone on from: scene,
     * motion and request alike but for `samples` and what is done with the sum (format, tone map, exposure); it
     * adds its samples to those. n frames of k samples hold what one of n x k does, to the bit. */
    bool accumulate;
    bool starts_anew; /* with `accumulate`: this frame does not go on; those after it may go on from this one */
    /* With `accumulate`: the limit of accumulated samples; of `samples` only those up to it are added. 0: no
     * limit. */
    uint32_t samples_max;
    /* Random noise is filtered out of the picture that is handed out, not out of the sums
     * (render/passes/denoise/); what integrators without any show stays as it is, and so does a picture made from
     * layers. */
    enum denoise denoise;
    /* With that: whether the picture, but not its sums, has what those before it have of the same places. */
    enum frame_history history;
    /* Every wave is traced by a second tracer too, primary rays included (`primary` is taken to be PRIMARY_TRACE),
     * and the result has what came of it. The picture is that of `tracer`. */
    bool compare;
    unsigned compare_with;   /* protocol's number; with the same options */
    float compare_far_share; /* 0: WAVE_FAR_SHARE, see render/compare/rays.h */
};

/* Of one sample, that is not to be added to, the place is the pixel's middle; several are spread by the filter.
 * With a lens, several views, or where something moves, first hits are traced whatever `primary` says. What
 * PRIMARY_AUTO chooses follows from tracer, scene, size, whether there are several samples, and device: for a
 * device it is measured once. Where something moves, a tracer of stored samples is refused: ERROR_UNSUPPORTED,
 * "shutter".
 *
 * What a picture holds:
 *   linear formats  mean radiance of the samples times 2^exposure_stops, premultiplied by alpha
 *   RGBA8           the same divided by alpha, tone-mapped, sRGB
 *   planes          that, without alpha
 *                   If the scene's light is display values, RGBA8 is clamped and nothing else, and the linear
 *                   formats, the albedo too, have what a display emits for it
 *   layers          those beside the beauty are what protocol/words.def says of them (LAYER), and know of no
 *                   exposure
 *   attachments     those layers in 4 bytes a pixel, see frame_result_attachment()
 *   alpha           1 where there is a surface (what blended surfaces leave open goes on to what lies behind) and
 *                   where a background is seen; 0 where there is neither
 * What integrators do with `depth`: whitted, distributed and path bounce so often after the first hit (path: and
 * ask for light at the last hit too); raycast and ao do not bounce, and going straight on through layers is no
 * bounce. What `ao` shows is how open a first hit is, 1 where nothing is hit; all else show radiance. A scene with
 * no light and a black environment is lit by the default of shaders/shared/sky.h, unless it has emissive surfaces
 * that are brighter than 1 and the integrator (distributed, path) has them for lights. The same request on the
 * same revision and device gives the same bytes. Crops of one picture agree to the byte wherever they overlap.
 * With software GL and the tracer `bvh` they differ from the frame without a crop, and that cut into other slices,
 * by rounding: rays are traversed in packets there, whose size follows the coherence of the slice's wave. */
struct frame_result {
    /* Owned; free(). Layer after layer, each of width x height pixels, or planes; behind size_bytes lie the
     * attachments. */
    uint8_t *pixels;
    uint32_t layers; /* bits, at least one */
    uint32_t attachments;
    size_t size_bytes;
    uint32_t width, height;
    /* Held per pixel, with those of the frames before that it goes on from; with noise: at most. */
    uint32_t samples;
    float noise; /* with noise in the request: the largest error of a tile, as far as is known; else 0 */
    enum pixel_format format;
    enum ycbcr ycbcr; /* in place of the RGBA8; base/ycbcr.h says how the planes lie in size_bytes */
    uint64_t revision;
    uint64_t primary_rays, shadow_rays, secondary_rays, splits;
    uint32_t sorted_waves; /* whose rays were brought into the order of their directions */
    uint32_t device_waits; /* how often the host has waited for the device, bringing the scene there included */
    uint32_t dispatches, barriers; /* of compute passes; between passes of any kind */
    uint64_t uploaded_bytes, structure_bytes;
    struct structure_rows structure; /* what the tracer says of it, and of its waves */
    struct stage_times times;
    struct wave_comparison *comparisons; /* owned; ascending by wave and kind; NULL: nothing was compared */
    uint32_t comparison_count;
};
void frame_result_finish(struct frame_result *result);
/* Of width x height: DEPTH f32, metres along the view to the first surface that the pixel's first sample met, 0
 * where there is none; NORMALS 4 u8, (n / 2 + 1/2) * 255 of the mean of the samples in world space, then 255, all
 * 0 where there is none; STICKING 4 u8, the first: 255 times the mean of the samples' shares that mirrors, glass
 * and highlights have in them (shaders/common/sticking.glsl), of each 2 x 2 pixels the first one's, the others 0.
 * Valid as long as the pixels; `which` is one of the result's attachments. */
const uint8_t *frame_result_attachment(const struct frame_result *result, enum attachment which);

/* The device's resources of a scene that all its viewers share: its copy, its light, and the tracers in use. */
struct frame_scene;

struct frame_scene *frame_scene_create(struct gpu_device *device, struct error *error);
void frame_scene_destroy(struct frame_scene *shared); /* after its renderers; accepts NULL */
uint64_t frame_scene_device_bytes(const struct frame_scene *shared);

/* The resources of one viewer: the waves and the picture of one frame at a time, and the last one's samples. */
struct frame_renderer;

/* `shared` stays the caller's and outlives the renderer. */
struct frame_renderer *frame_renderer_create(struct frame_scene *shared, struct error *error);
void frame_renderer_destroy(struct frame_renderer *renderer); /* accepts NULL */

/* Renderers of one scene may have frames in progress at the same time, each stepped as one likes. A frame that
 * would change what they share (another revision, something that moves, a tracer in use that is not up to date)
 * may only begin while no other is in progress. False: it has to wait for that. A tracer that is being brought to
 * the scene for one frame is shared as well: the steps of each that waits for it bring it on. */
bool frame_may_begin(const struct frame_renderer *renderer, const struct scene *scene,
                     const struct scene_motion *motion, const struct frame_request *request);
/* A frame in slices, so that others get their turn and a cancel is served: begin, then step until it is done
 * (or abandon). What a tracer has to build for it is part of the steps; abandoned with all frames that wait for
 * it, it is forgotten. Between the two the scene must not be edited. A step takes a few milliseconds where the
 * device allows. `result` is filled by the last step. `motion`: where things are while the shutter is open; NULL:
 * as they were committed. Both must stay until the frame is done or abandoned. A frame that may not begin is
 * refused, ERROR_INTERNAL. */
bool frame_begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                 const struct frame_request *request, struct error *error);
enum frame_progress { FRAME_FAILED, FRAME_MORE, FRAME_DONE };
enum frame_progress frame_step(struct frame_renderer *renderer, struct frame_result *result, struct error *error);
void frame_abandon(struct frame_renderer *renderer);
/* Whether the next step would do nothing but wait for the device, or for other threads that build a tracer's
 * structure: others may have their turn first. */
bool frame_step_waits(const struct frame_renderer *renderer);

uint64_t frame_renderer_device_bytes(const struct frame_renderer *renderer); /* without what is shared */

/* How a camera that sees all of some bounds is placed. Angles in radians. */
struct frame_framing {
    float azimuth, elevation; /* of the eye: from +z about +y towards +x, and above the horizon */
    float fov_y;              /* before the zoom */
    float margin; /* share of the picture that stays free beside the bounds, at each edge, before the zoom */
    float zoom;   /* scales the picture about its middle */
};
/* A camera that sees all, as near as that allows: two opposite edges of the picture, or of the margin, are
 * touched. What it depends on is how far all reaches in these directions: the greatest dot product with a point
 * for each. `size`: of all, in metres; the eye is at least a part of that before it. */
#define FRAME_CAMERA_DIRECTIONS 5
void frame_camera_directions(double directions[FRAME_CAMERA_DIRECTIONS][3], const struct frame_framing *framing,
                             float aspect);
void frame_camera_around(struct frame_camera *camera, const struct frame_framing *framing, float aspect,
                         const double supports[FRAME_CAMERA_DIRECTIONS], double size);
/* Likewise, of all within bounds. */
void frame_camera_auto(struct frame_camera *camera, const struct frame_framing *framing, const float lower[3],
                       const float upper[3], float aspect);
/* Pixels of one view. */
void frame_view_size(const struct frame_request *request, uint32_t *width, uint32_t *height);
bool frame_has_views(const struct frame_request *request); /* more than one */
/* How far the eye of view (across, down) lies from the camera, along its right and up; metres. */
void frame_view_eye(const struct frame_request *request, uint32_t across, uint32_t down, float eye[2]);
/* From eye, target and up; false if they do not span a view. */
bool frame_camera_look_at(struct frame_camera *camera, const float eye[3], const float look_at[3],
                          const float up[3], float fov_y);

#endif
