/* SPDX-License-Identifier: MIT */
/* Motion of the user's camera. */
#include "camera.h"

#include <math.h>
#include <string.h>

#define POLE_MARGIN 0.02 /* minimum angle in radians between the view and the orbit's axis */
#define ORTHOGRAPHIC_FOV 0.35

/* ---- vectors ---- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    const double made[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, made, sizeof(made));
}

static double unit(double vector[3])
{
    const double length = sqrt(dot(vector, vector));
    for (int i = 0; i < 3 && length > 0; i++)
        vector[i] /= length;
    return length;
}

/* Rotates about a unit axis, counter-clockwise (Rodrigues). */
static void rotate(double vector[3], const double axis[3], double angle)
{
    double side[3];
    const double along = dot(vector, axis) * (1 - cos(angle));
    cross(axis, vector, side);
    for (int i = 0; i < 3; i++)
        vector[i] = vector[i] * cos(angle) + side[i] * sin(angle) + axis[i] * along;
}

/* Unit vectors of the picture: to the right, upwards, into it. */
static void axes(const struct viewer_camera *camera, double right[3], double above[3], double into[3])
{
    for (int i = 0; i < 3; i++)
        into[i] = camera->look_at[i] - camera->eye[i];
    unit(into);
    cross(into, camera->up, right);
    unit(right);
    cross(right, into, above);
}

/* ---- moving ---- */

double camera_distance(const struct viewer_camera *camera)
{
    double way[3];
    for (int i = 0; i < 3; i++)
        way[i] = camera->look_at[i] - camera->eye[i];
    return sqrt(dot(way, way));
}

/* Turns `arm`, which points along the view or against it, so that the view turns by the angles. */
static void swing(const struct viewer_camera *camera, double arm[3], double right_angle, double up_angle)
{
    double right[3], above[3], into[3];
    axes(camera, right, above, into);
    const double slope = acos(fmax(-1, fmin(1, dot(into, camera->up)))); /* 0: straight along the axis */
    const double maximum = slope - POLE_MARGIN, minimum = slope - (M_PI - POLE_MARGIN);
    rotate(arm, right, fmax(fmin(minimum, 0), fmin(fmax(maximum, 0), up_angle)));
    rotate(arm, camera->up, -right_angle);
}

void camera_orbit(struct viewer_camera *camera, double right, double up)
{
    double arm[3];
    for (int i = 0; i < 3; i++)
        arm[i] = camera->eye[i] - camera->look_at[i];
    swing(camera, arm, right, up);
    for (int i = 0; i < 3; i++)
        camera->eye[i] = camera->look_at[i] + arm[i];
}

void camera_turn(struct viewer_camera *camera, double right, double up)
{
    double arm[3];
    for (int i = 0; i < 3; i++)
        arm[i] = camera->look_at[i] - camera->eye[i];
    swing(camera, arm, right, up);
    for (int i = 0; i < 3; i++)
        camera->look_at[i] = camera->eye[i] + arm[i];
}

void camera_swing(const struct viewer_camera *from, const struct viewer_camera *to, double *right, double *up)
{
    double before[3], after[3], side[3];
    for (int i = 0; i < 3; i++) {
        before[i] = from->look_at[i] - from->eye[i];
        after[i] = to->look_at[i] - to->eye[i];
    }
    unit(before);
    unit(after);
    const double rise_before = dot(before, to->up), rise_after = dot(after, to->up);
    cross(after, before, side);
    *right = atan2(dot(side, to->up), dot(before, after) - rise_before * rise_after);
    *up = asin(fmax(-1, fmin(1, rise_after))) - asin(fmax(-1, fmin(1, rise_before)));
}

void camera_fly(struct viewer_camera *camera, const double metres[3])
{
    double right[3], above[3], into[3];
    axes(camera, right, above, into);
    for (int i = 0; i < 3; i++) {
        const double step = right[i] * metres[0] + above[i] * metres[1] + into[i] * metres[2];
        camera->eye[i] += step;
        camera->look_at[i] += step;
    }
}

void camera_pan(struct viewer_camera *camera, double right, double up)
{
    const double height = 2 * tan(camera->fov_y / 2) * camera_distance(camera);
    camera_fly(camera, (const double[3]){right * height, up * height, 0});
}

void camera_dolly(struct viewer_camera *camera, double factor, double minimum)
{
    const double distance = camera_distance(camera), wanted = distance * factor;
    const double share = (wanted > minimum ? wanted : fmin(minimum, distance)) / distance;
    for (int i = 0; i < 3; i++)
        camera->eye[i] = camera->look_at[i] + (camera->eye[i] - camera->look_at[i]) * share;
}

void camera_focus(struct viewer_camera *camera, const double place[3])
{
    double way[3], side[3];
    for (int i = 0; i < 3; i++)
        way[i] = place[i] - camera->eye[i];
    const double distance = unit(way);
    cross(way, camera->up, side);
    if (!(distance > 0) || dot(side, side) < POLE_MARGIN * POLE_MARGIN / 4)
        return;
    memcpy(camera->look_at, place, sizeof(camera->look_at));
}

void camera_ray(const struct viewer_camera *camera, double aspect, double x, double y, double direction[3])
{
    double right[3], above[3], into[3];
    const double half = tan(camera->fov_y / 2);
    axes(camera, right, above, into);
    for (int i = 0; i < 3; i++)
        direction[i] = into[i] + right[i] * (2 * x - 1) * half * aspect + above[i] * (1 - 2 * y) * half;
    unit(direction);
}

/* ---- from frame to frame ---- */

void camera_from_frame(struct viewer_camera *camera, const struct fl_frame *frame, double distance)
{
    const float *m = frame->world_from_view;
    const double vertical[3] = {0, 1, 0};
    double right[3], above[3], into[3];
    for (int i = 0; i < 3; i++) {
        right[i] = (double)m[i * 4];
        above[i] = (double)m[i * 4 + 1];
        into[i] = -(double)m[i * 4 + 2];
        camera->eye[i] = (double)m[i * 4 + 3];
    }
    unit(right);
    unit(above);
    unit(into);
    /* A camera without tilt turns about the vertical; a tilted one keeps its horizon. */
    const bool is_upright =
        fabs(dot(right, vertical)) < 1e-3 && above[1] > 0 && fabs(dot(into, vertical)) < cos(POLE_MARGIN);
    memcpy(camera->up, is_upright ? vertical : above, sizeof(camera->up));
    camera->fov_y = (double)frame->fov_y;
    if (!(camera->fov_y > 0)) {
        const double away = (double)frame->ortho_height / (2 * tan(ORTHOGRAPHIC_FOV / 2));
        camera->fov_y = ORTHOGRAPHIC_FOV;
        for (int i = 0; i < 3; i++)
            camera->eye[i] += into[i] * (distance - away);
        distance = away;
    }
    for (int i = 0; i < 3; i++)
        camera->look_at[i] = camera->eye[i] + into[i] * distance;
}

static double mix(double from, double to, double share)
{
    return from + (to - from) * share;
}

void camera_between(const struct viewer_camera *from, const struct viewer_camera *to, double share,
                    struct viewer_camera *camera)
{
    struct viewer_camera made = *to;
    const double eased = share * share * (3 - 2 * share);
    if (share < 1) {
        for (int i = 0; i < 3; i++) {
            made.look_at[i] = mix(from->look_at[i], to->look_at[i], eased);
            made.eye[i] = mix(from->eye[i], to->eye[i], eased);
            made.up[i] = mix(from->up[i], to->up[i], eased);
        }
        made.fov_y = mix(from->fov_y, to->fov_y, eased);
        /* Half way between opposite views the direction is undefined: the end is shown. */
        if (unit(made.up) < 1e-3 || camera_distance(&made) < 1e-3 * camera_distance(to))
            made = *to;
    }
    *camera = made;
}

void camera_export(const struct viewer_camera *camera, struct fl_view_camera *out)
{
    for (int i = 0; i < 3; i++) {
        out->eye_world[i] = (float)camera->eye[i];
        out->look_at_world[i] = (float)camera->look_at[i];
        out->up_world[i] = (float)camera->up[i];
    }
    out->fov_y = (float)camera->fov_y;
}

void camera_pose(const struct viewer_camera *camera, float world_from_view[12])
{
    double right[3], above[3], into[3];
    axes(camera, right, above, into);
    for (int i = 0; i < 3; i++) {
        world_from_view[i * 4] = (float)right[i];
        world_from_view[i * 4 + 1] = (float)above[i];
        world_from_view[i * 4 + 2] = (float)-into[i];
        world_from_view[i * 4 + 3] = (float)camera->eye[i];
    }
}
