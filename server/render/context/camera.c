/* SPDX-License-Identifier: MIT */
/* Places cameras and fills a frame's camera uniforms. */
#include "render/context/camera.h"

#include "trace/raster/view.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
/* The eye's minimum distance before the bounds, as a share of their extents. */
#define NEAREST_SHARE 0.01

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(double out[3], const double a[3], const double b[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static bool normalise3(double v[3])
{
    double length = sqrt(dot3(v, v));
    if (!(length > 1e-30) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return true;
}

bool frame_camera_look_at(struct frame_camera *camera, const float eye[3], const float look_at[3],
                          const float up[3], float fov_y)
{
    double back[3], right[3], above[3], up_unit[3];
    for (int i = 0; i < 3; i++) {
        back[i] = (double)eye[i] - (double)look_at[i];
        up_unit[i] = (double)up[i];
    }
    if (!normalise3(back) || !normalise3(up_unit))
        return false;
    cross3(right, up_unit, back);
    if (dot3(right, right) < 1e-12 || !normalise3(right)) /* up points along the view */
        return false;
    cross3(above, back, right);
    *camera = (struct frame_camera){.fov_y = fov_y};
    for (int row = 0; row < 3; row++) {
        camera->world_from_view[row * 4 + 0] = (float)right[row];
        camera->world_from_view[row * 4 + 1] = (float)above[row];
        camera->world_from_view[row * 4 + 2] = (float)back[row];
        camera->world_from_view[row * 4 + 3] = eye[row];
    }
    return true;
}

/* The picture's axes, not by an upward direction: seen from above there is none. */
struct axes {
    double right[3], above[3], back[3];
    double slope_x, slope_y; /* slopes of the edges that the margin leaves */
};

static void axes_of(struct axes *axes, const struct frame_framing *framing, float aspect)
{
    const double azimuth = (double)framing->azimuth, elevation = (double)framing->elevation;
    *axes = (struct axes){
        .right = {cos(azimuth), 0.0, -sin(azimuth)},
        .back = {sin(azimuth) * cos(elevation), sin(elevation), cos(azimuth) * cos(elevation)},
        .slope_y = tan((double)framing->fov_y / 2.0) * (1.0 - 2.0 * (double)framing->margin),
    };
    cross3(axes->above, axes->back, axes->right);
    axes->slope_x = axes->slope_y * (double)aspect;
}

enum { TO_RIGHT, TO_LEFT, TO_TOP, TO_BOTTOM, TO_EYE };

/* Normals of the planes through the eye and each edge of the picture: the bounds lie on one side of each. */
void frame_camera_directions(double directions[FRAME_CAMERA_DIRECTIONS][3], const struct frame_framing *framing,
                             float aspect)
{
    struct axes axes;
    axes_of(&axes, framing, aspect);
    for (int i = 0; i < 3; i++) {
        directions[TO_RIGHT][i] = axes.slope_x * axes.back[i] + axes.right[i];
        directions[TO_LEFT][i] = axes.slope_x * axes.back[i] - axes.right[i];
        directions[TO_TOP][i] = axes.slope_y * axes.back[i] + axes.above[i];
        directions[TO_BOTTOM][i] = axes.slope_y * axes.back[i] - axes.above[i];
        directions[TO_EYE][i] = axes.back[i];
    }
}

void frame_camera_around(struct frame_camera *camera, const struct frame_framing *framing, float aspect,
                         const double supports[FRAME_CAMERA_DIRECTIONS], double size)
{
    struct axes axes;
    axes_of(&axes, framing, aspect);
    double eye[3] = {(supports[TO_RIGHT] - supports[TO_LEFT]) / 2.0,
                     (supports[TO_TOP] - supports[TO_BOTTOM]) / 2.0};
    eye[2] = fmax((supports[TO_RIGHT] + supports[TO_LEFT]) / (2.0 * axes.slope_x),
                  (supports[TO_TOP] + supports[TO_BOTTOM]) / (2.0 * axes.slope_y));
    /* A box without an extent across the view, or without any. */
    eye[2] = fmax(eye[2], supports[TO_EYE] + (size > 0.0 ? NEAREST_SHARE * size : 1.0));
    *camera = (struct frame_camera){
        .fov_y = (float)(2.0 * atan(tan((double)framing->fov_y / 2.0) / (double)framing->zoom))};
    float *m = camera->world_from_view;
    for (int row = 0; row < 3; row++) {
        m[4 * row] = (float)axes.right[row];
        m[4 * row + 1] = (float)axes.above[row];
        m[4 * row + 2] = (float)axes.back[row];
        m[4 * row + 3] = (float)(eye[0] * axes.right[row] + eye[1] * axes.above[row] + eye[2] * axes.back[row]);
        if (!isfinite(m[4 * row + 3])) /* bounds at the end of the floats */
            m[4 * row + 3] = 0.0f;
    }
}

void frame_camera_auto(struct frame_camera *camera, const struct frame_framing *framing, const float lower[3],
                       const float upper[3], float aspect)
{
    double directions[FRAME_CAMERA_DIRECTIONS][3], supports[FRAME_CAMERA_DIRECTIONS];
    double size = 0.0;
    frame_camera_directions(directions, framing, aspect);
    for (int i = 0; i < 3; i++)
        size += fabs((double)upper[i] - (double)lower[i]);
    for (unsigned k = 0; k < FRAME_CAMERA_DIRECTIONS; k++) {
        supports[k] = 0.0;
        for (int i = 0; i < 3; i++)
            supports[k] += directions[k][i] * (double)(directions[k][i] > 0.0 ? upper[i] : lower[i]);
    }
    frame_camera_around(camera, framing, aspect, supports, size);
}

static float distance_along_view(const struct frame_camera *camera, const float point[3])
{
    const float *m = camera->world_from_view;
    return -((point[0] - m[3]) * m[2] + (point[1] - m[7]) * m[6] + (point[2] - m[11]) * m[10]);
}

/* A distance along the view beyond the scene. */
static float far_distance(const struct frame_camera *camera, const struct gpu_scene *scene, float near)
{
    float far = near + 1.0f;
    for (int corner = 0; corner < 8 && scene->instance_count > 0; corner++) {
        float point[3];
        for (int i = 0; i < 3; i++)
            point[i] = (corner >> i & 1) ? scene->upper_world[i] : scene->lower_world[i];
        far = fmaxf(far, distance_along_view(camera, point));
    }
    for (uint32_t i = 0; i < scene->disc_count; i++) {
        const struct disc *disc = &scene->discs[i];
        far = fmaxf(far, distance_along_view(camera, disc->centre_radius) + disc->centre_radius[3]);
    }
    return far * 1.001f;
}

/* The distance of the scene's centre; if that is not in front of the camera, half the scene's size. */
static float focus_distance(const struct frame_camera *camera, const struct gpu_scene *scene)
{
    float middle[3];
    for (int i = 0; i < 3; i++)
        middle[i] = scene->lower_world[i] / 2.0f + scene->upper_world[i] / 2.0f;
    float distance = distance_along_view(camera, middle), minimum = scene->diagonal / 2.0f;
    if (!(distance > 0.0f) || !isfinite(distance))
        distance = minimum > 0.0f && isfinite(minimum) ? minimum : 1.0f;
    return distance;
}

void frame_view_size(const struct frame_request *request, uint32_t *width, uint32_t *height)
{
    *width = request->picture.width / (request->picture.views_across ? request->picture.views_across : 1);
    *height = request->picture.height / (request->picture.views_down ? request->picture.views_down : 1);
}

bool frame_has_views(const struct frame_request *request)
{
    return request->picture.views_across > 1 || request->picture.views_down > 1;
}

/* From the first eye to the camera, in views. */
static void eyes_middle(const struct frame_request *request, float middle[2])
{
    middle[0] = request->picture.views_across > 1 ? (float)(request->picture.views_across - 1) / 2.0f : 0.0f;
    middle[1] = request->picture.views_down > 1 ? (float)(request->picture.views_down - 1) / 2.0f : 0.0f;
}

/* From an eye to that of the next view to the right, and to that of the next one below. */
static void eye_steps(const struct frame_request *request, float steps[4])
{
    const float baseline = frame_has_views(request) ? request->picture.baseline : 0.0f;
    steps[0] = baseline;
    steps[1] = 0.0f;
    steps[2] = request->picture.eyes_over ? baseline : 0.0f;
    steps[3] = request->picture.eyes_over ? 0.0f : -baseline;
}

void frame_view_eye(const struct frame_request *request, uint32_t across, uint32_t down, float eye[2])
{
    float middle[2], steps[4];
    eyes_middle(request, middle);
    eye_steps(request, steps);
    for (int i = 0; i < 2; i++)
        eye[i] = ((float)across - middle[0]) * steps[i] + ((float)down - middle[1]) * steps[2 + i];
}

void camera_fill_uniforms(struct frame_uniforms *uniforms, const struct frame_request *request,
                          const struct gpu_scene *scene)
{
    const struct frame_camera *camera = &request->camera;
    bool orthographic = camera->fov_y == 0.0f;
    uint32_t width, height;
    frame_view_size(request, &width, &height);
    float aspect = (float)width / (float)height;
    float half_height = orthographic ? camera->ortho_height / 2.0f : tanf(camera->fov_y / 2.0f);
    const float near = raster_near(scene, camera->near, orthographic);
    struct raster_camera view = {
        .extent = {half_height * aspect, half_height},
        .near = near,
        .far = far_distance(camera, scene, near),
        .orthographic = orthographic,
        .width = width,
        .height = height,
    };
    memcpy(view.world_from_view, camera->world_from_view, sizeof(view.world_from_view));
    raster_camera_fill(uniforms, &view);
    uniforms->width = request->picture.width;
    uniforms->height = request->picture.height;
    uniforms->tiles_across = (request->picture.width + 7) / 8;
    eyes_middle(request, uniforms->eyes_middle);
    eye_steps(request, uniforms->eye_steps);
    uniforms->lens[0] = request->aperture / 2.0f;
    uniforms->lens[1] = request->focus > 0.0f ? request->focus : focus_distance(camera, scene);
}
