/* SPDX-License-Identifier: MIT */
/* The scenes in which every tracer's answers are held against brute force. */
#include "tests/tracers/contract.h"

/* Two panes with holes over each other, one of glass and one that is blended, a ball of glass, and a disc below it
 * all: texels are so large that cells tell them apart. */
static struct scene *scene_of_panes(void)
{
    static const float corners[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    static const float uv[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    static const float ball[1][4] = {{0.2f, 0.1f, 0.2f, 0.4f}};
    struct test_edits edits = {.scene = test_scene_create()};
    uint32_t texels[4 * 4];
    float m[12];
    for (uint32_t i = 0; i < 16; i++)
        texels[i] = ((i + i / 4) % 2 ? 0xff000000u : 0u) | 0x00c0a080u;
    struct scene_texture *texture = &test_add(&edits, OBJECT_TEXTURE)->set.texture;
    texture->base.id = 1;
    texture->value.width = texture->value.height = 4;
    texture->value.format = TEXTURE_RGBA8_SRGB;
    texture->texels = test_blob(texels, sizeof(texels));
    struct scene_material *fence = test_material(&edits, 1, 0.9f, 0.8f, 0.7f);
    fence->value.alpha_mode = ALPHA_MASK;
    fence->textures[MATERIAL_BASE_COLOUR].texture = 1;
    struct scene_material *pane = test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.6f;
    test_material(&edits, 3, 0.9f, 0.8f, 0.7f)->value.transmission = 0.9f;
    test_material(&edits, 4, 0.95f, 0.75f, 0.85f)->value.transmission = 1.0f;
    test_material(&edits, 5, 0.05f, 0.15f, 0.25f);
    for (uint32_t i = 0; i < 3; i++) { /* meshes 10, 11, 12: a fence, a blended pane, one of glass */
        struct scene_mesh *mesh = test_mesh(&edits, 10 + i, corners, 4, indices, 2);
        mesh->arrays[MESH_TEXCOORDS_0] = test_blob(uv, sizeof(uv));
        mesh->ranges = test_ranges(&(struct record_material_range){0, 2, 1 + i}, 1);
        mesh->range_count = 1;
    }
    struct scene_spheres *set = test_spheres(&edits, 20, ball, 1);
    set->ranges = test_ranges(&(struct record_material_range){0, 1, 4}, 1);
    set->range_count = 1;
    test_transform(m, 1, 1, 1, 0, 0.4f, 0, 0, -0.8f);
    test_node(&edits, 1, 0, NODE_MESH, 10, m);
    test_transform(m, 0.8f, -0.9f, 1, 1, 0.3f, 0.3f, 0, 1);
    test_node(&edits, 2, 0, NODE_MESH, 10, m);
    test_transform(m, 1, 1, 1, 1, 1.2f, 0.9f, 0, 0);
    test_node(&edits, 3, 0, NODE_MESH, 11, m);
    test_transform(m, 1, 0.7f, 1, 1, -1.3f, -0.9f, 0, 0);
    test_node(&edits, 4, 0, NODE_MESH, 12, m);
    test_node(&edits, 5, 0, NODE_SPHERES, 20, NULL);
    struct scene_disc *disc = &test_add(&edits, OBJECT_DISC)->set.disc;
    disc->base.id = 1;
    disc->value.material = 5;
    disc->value.centre_world[1] = -1.2f;
    disc->value.normal_world[1] = 1.0f;
    disc->value.radius = 3.0f;
    test_commit(&edits);
    return edits.scene;
}

/* Bits of the phases of conformance.c. Discs and holes come with the last one, to a scene without any and to one
 * that has them. */
enum {
    ALL = 0x1f,
    BUT_THE_LAST = 0xf,
    AT_FIRST_AND_OF_ANOTHER_SHAPE = 0x9,
};

const struct scene_row scene_rows[] = {
    {"a triangle soup in mirrored, squeezed and nested instances", test_scene_soup, test_motion_of_soup, 0, false,
     false, ALL, BUT_THE_LAST},
    {"spheres among triangles", test_scene_spheres, test_motion_of_two, 0, false, false, BUT_THE_LAST,
     BUT_THE_LAST},
    {"panes with holes, panes of glass and a disc", scene_of_panes, test_motion_of_two, 0, false, true, 0, ALL},
    {"cutouts, glass, panes and a disc", test_scene_translucent, test_motion_of_two, 0, true, true, ALL, ALL},
    {"skins and morph targets", test_scene_deformed, test_motion_of_deformed, 0, false, false, BUT_THE_LAST,
     BUT_THE_LAST},
    {"a soup that moves from one pose to another", test_scene_soup, test_motion_of_soup, 2, false, false, 0, 0},
    {"a soup that moves through nine poses", test_scene_soup, test_motion_of_soup, 9, false, false, 0, 0},
    {"spheres of which some move through nine poses", test_scene_spheres, test_motion_of_two, 9, false, false,
     AT_FIRST_AND_OF_ANOTHER_SHAPE, 0},
    {"cutouts and glass that move", test_scene_translucent, test_motion_of_two, 4, true, true,
     AT_FIRST_AND_OF_ANOTHER_SHAPE, 0},
    {"skins and morph targets that move", test_scene_deformed, test_motion_of_deformed, 3, false, false,
     AT_FIRST_AND_OF_ANOTHER_SHAPE, 0},
};
const size_t scene_row_count = sizeof(scene_rows) / sizeof(scene_rows[0]);
