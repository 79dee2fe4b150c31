/* SPDX-License-Identifier: MIT */
/* Camera, lights and background of NFF. */
#include "reader.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI 3.14159265358979323846

static bool show(struct nff *nff, enum protocol_node_kind kind, uint32_t object, const float matrix[12],
                 const char *name)
{
    struct message_set_node node = {.value.kind = kind, .value.object = object, .name = name};

    memcpy(node.value.parent_from_node, matrix, sizeof(node.value.parent_from_node));
    return object != 0 && import_add_node(nff->scene, &node) != 0;
}

bool nff_add_camera(struct nff *nff)
{
    struct message_set_camera camera = {.name = "view"};
    double back[3], right[3], up[3], length = 0;
    float matrix[12];

    for (int c = 0; c < 3; c++)
        back[c] = (double)nff->from[c] - (double)nff->look_at[c];
    for (int c = 0; c < 3; c++)
        right[c] =
            (double)nff->up[(c + 1) % 3] * back[(c + 2) % 3] - (double)nff->up[(c + 2) % 3] * back[(c + 1) % 3];
    for (int c = 0; c < 3; c++)
        up[c] = back[(c + 1) % 3] * right[(c + 2) % 3] - back[(c + 2) % 3] * right[(c + 1) % 3];
    for (int axis = 0; axis < 3; axis++) {
        const double *v = axis == 0 ? right : axis == 1 ? up : back;

        length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int row = 0; row < 3; row++)
            matrix[row * 4 + axis] = (float)(v[row] / length);
    }
    for (int row = 0; row < 3; row++)
        matrix[row * 4 + 3] = nff->from[row];
    camera.value.fov_y = (float)((double)nff->angle_degrees * PI / 180);
    camera.value.near = fmaxf(nff->hither, 0);
    return show(nff, PROTOCOL_NODE_CAMERA, import_add_camera(nff->scene, &camera), matrix, "view");
}

/* Adds the lights. A surface that scatters all light has the radiance of NFF's formula, Kd times N.L times the
 * light; hence the factor pi. */
bool nff_add_lights(struct nff *nff)
{
    /* NFF: each of n lights without colour has the intensity 1 / sqrt(n). */
    float share = (float)(sqrt((double)nff->light_count) / (double)nff->light_count);

    for (size_t i = 0; i < nff->light_count; i++) {
        const struct nff_light *light = &nff->lights[i];
        struct message_set_light set = {.value.kind = PROTOCOL_LIGHT_STEADY};
        float matrix[12];
        char name[32];

        import_identity(matrix);
        for (int c = 0; c < 3; c++) {
            matrix[c * 4 + 3] = light->position[c];
            set.value.colour[c] = (float)fmin((double)(light->coloured ? light->colour[c] : share) * PI, 1e12);
        }
        snprintf(name, sizeof(name), "light %zu", i + 1);
        set.name = name;
        if (!show(nff, PROTOCOL_NODE_LIGHT, import_add_light(nff->scene, &set), matrix, name))
            return false;
    }
    return true;
}

void nff_add_background(struct nff *nff)
{
    struct message_set_environment environment = {0};

    if (!nff->has_background && !nff_keeps_values(nff))
        return;
    /* The backdrop for rays that hit nothing; without lights it is also the only light. */
    environment.value.backdrop = nff->light_count > 0;
    environment.value.display_values = nff_keeps_values(nff);
    for (int c = 0; c < 3; c++)
        environment.value.colour[c] = nff_colour(nff, nff->background[c]);
    import_set_environment(nff->scene, &environment, 0);
}
