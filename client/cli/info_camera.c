/* SPDX-License-Identifier: MIT */
/* farlight info --camera: the default camera of 'farlight render' for a model, in coordinates, from a tiny
 * picture of a daemon. */
#include "cli/info_camera.h"

#include "options/complete.h"
#include "options/interrupt.h"

#include <math.h>
#include <stdio.h>

#define DEGREES_PER_RADIAN 57.295779513082321

/* Reduces the picture to the fewest pixels of the same shape. */
static void shrink(struct message_render *wanted)
{
    uint32_t a = wanted->picture.width, b = wanted->picture.height;
    while (b != 0) {
        const uint32_t rest = a % b;
        a = b;
        b = rest;
    }
    wanted->picture.width /= a;
    wanted->picture.height /= a;
}

/* Distance of the target on the view's axis, equal to the distance of the scene's middle. */
static double target_distance(const float m[12], const struct fl_model_info *info)
{
    double distance = 0;
    for (int axis = 0; axis < 3 && info->has_bounds; axis++)
        distance -=
            (((double)info->lower_world[axis] + (double)info->upper_world[axis]) / 2 - (double)m[4 * axis + 3]) *
            (double)m[4 * axis + 2];
    return distance > 0 ? distance : 1;
}

static bool render(struct fl_scene *scene, const struct fl_model_info *info, struct cli_info_camera *camera,
                   struct fl_error *error)
{
    struct message_render wanted = fl_render_defaults();
    shrink(&wanted);
    wanted.sampling.samples = 1;
    wanted.light.depth = 0;
    if (!cli_find_camera(&wanted, NULL, NULL, false, scene, error))
        return false;
    struct fl_job *job = fl_render_start(scene, &wanted, error);
    struct fl_frame *frame = job ? fl_render_next(job, error) : NULL;
    if (frame) {
        const float *m = frame->world_from_view;
        const double distance = target_distance(m, info);
        for (int axis = 0; axis < 3; axis++) {
            camera->eye[axis] = (double)m[4 * axis + 3];
            camera->target[axis] = (double)m[4 * axis + 3] - distance * (double)m[4 * axis + 2];
            camera->up[axis] = (double)m[4 * axis + 1];
        }
        camera->fov_degrees = (double)frame->fov_y * DEGREES_PER_RADIAN;
        camera->ortho_height = (double)frame->ortho_height;
    }
    fl_frame_destroy(frame);
    fl_render_destroy(job);
    return frame != NULL;
}

bool cli_info_find_camera(const struct fl_load_options *load, const struct fl_model_info *info,
                          struct cli_info_camera *camera, struct fl_error *error)
{
    *camera = (struct cli_info_camera){0};
    struct fl_connection *connection =
        fl_connect(&(struct fl_connect_options){.name = "farlight", .interrupt_fd = cli_interrupt_fd()}, error);
    struct fl_scene *scene = connection ? fl_scene_load(connection, load, error) : NULL;
    const bool found = scene && render(scene, info, camera, error);
    fl_scene_destroy(scene);
    fl_connection_destroy(connection);
    return found;
}

static void print_place(const char *option, const double place[3])
{
    printf(" --%s=%.9g,%.9g,%.9g", option, place[0], place[1], place[2]);
}

void cli_info_print_camera(const struct cli_info_camera *camera)
{
    printf("  %-10s", "camera");
    print_place("eye", camera->eye);
    print_place("look-at", camera->target);
    print_place("up", camera->up);
    if (camera->ortho_height > 0)
        printf(", orthographic, %.9g metres high: --camera 0\n", camera->ortho_height);
    else
        printf(" --fov=%.7g\n", camera->fov_degrees);
}

static json_t *place_json(const double place[3])
{
    return json_pack("[f,f,f]", place[0], place[1], place[2]);
}

json_t *cli_info_camera_json(const struct cli_info_camera *camera)
{
    return json_pack("{s:o,s:o,s:o,s:f,s:f}", "eye", place_json(camera->eye), "target", place_json(camera->target),
                     "up", place_json(camera->up), "fov_degrees", camera->fov_degrees, "ortho_height",
                     camera->ortho_height);
}
