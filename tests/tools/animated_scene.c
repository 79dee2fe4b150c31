/* SPDX-License-Identifier: MIT */
#include "animated_scene.h"

#include "animated_parts.h"
#include "glb.h"
#include "gltf_writer.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265f
#define CLIP_S 3.0f /* period: turning parts have turned fully, swinging ones are back */
#define KEYS_MAX 33

enum { JOINTS = PARTS_JOINTS, RIDERS = 4, BULB_PLACES = 6 };

/* Numbers of the nodes in the file; the arms and what is on them follow one another. */
enum node {
    FLOOR,
    PLATFORM,
    COLUMN,
    STUDS,
    BULB,
    BULB_LIGHT,
    SOCKETS,
    STAND,
    WHEEL,
    WHEEL_BALL,
    POST,
    JOINT,
    PLINTH = JOINT + JOINTS,
    BLOB,
    KEY_LIGHT,
    FILL_LIGHT,
    CAMERA,
    ARM, /* then its pole and its rider */
    NODES = ARM + 3 * RIDERS
};

struct carousel {
    struct gltf_writer writer;
    char nodes[NODES][320]; /* an object each */
};

/* ---- what hangs where ---- */

/* `format` is of the members beside the name. */
__attribute__((format(printf, 4, 5))) static void set_node(struct carousel *carousel, unsigned node,
                                                           const char *name, const char *format, ...)
{
    char *text = carousel->nodes[node];
    const size_t room = sizeof(carousel->nodes[node]);
    size_t length = (size_t)snprintf(text, room, "{\"name\":\"%s\",", name);
    va_list arguments;
    va_start(arguments, format);
    length += (size_t)vsnprintf(text + length, room - length, format, arguments);
    va_end(arguments);
    if (length + 2 > room)
        carousel->writer.failed = true;
    else
        strcpy(text + length, "}");
}

static void add_riders(struct carousel *carousel)
{
    static const float pole[][2] = {{0.03f, 0.27f}, {0.03f, 1.58f}, {0.03f, 1.6f}, {0.075f, 1.65f},
                                    {0.09f, 1.7f},  {0.06f, 1.77f}, {0, 1.79f}};
    static const struct {
        const char *arm, *name;
        enum parts_material material;
        bool mirrored;
    } riders[RIDERS] = {{"arm 1", "blue pot", BLUE, false},
                        {"arm 2", "mirrored red pot", RED, true},
                        {"arm 3", "copper pot", COPPER, false},
                        {"arm 4", "mirrored jade pot", JADE, true}};
    const unsigned pole_mesh = parts_lathe(&carousel->writer, "pole", pole, sizeof(pole) / sizeof(*pole), GOLD);
    struct shape shape = {0};
    shape_teapot(&shape, 48);
    const struct gltf_geometry pot = gltf_geometry(&carousel->writer, &shape);
    shape_finish(&shape);
    const float half = sqrtf(0.5f);
    for (unsigned i = 0; i < RIDERS; i++) {
        const unsigned arm = ARM + 3 * i;
        const float angle = 2 * PI * (float)i / RIDERS;
        set_node(carousel, arm, riders[i].arm, "\"rotation\":[0,%.9g,0,%.9g],\"children\":[%u,%u]",
                 (double)sinf(angle / 2), (double)cosf(angle / 2), arm + 1, arm + 2);
        set_node(carousel, arm + 1, "pole", "\"mesh\":%u,\"translation\":[1.4,0,0]", pole_mesh);
        const unsigned mesh = gltf_mesh(&carousel->writer, riders[i].name, &pot, riders[i].material);
        /* Spouts point the way that they go; a mirrored one would point back, so it is turned as well. */
        set_node(carousel, arm + 2, riders[i].name,
                 "\"mesh\":%u,\"translation\":[1.4,0.6,0],\"rotation\":[0,%.9g,0,%.9g],\"scale\":[%g,0.46,0.46]",
                 mesh, riders[i].mirrored ? (double)-half : (double)half, (double)half,
                 riders[i].mirrored ? -0.46 : 0.46);
    }
}

static void add_roundabout(struct carousel *carousel)
{
    static const float all_round[2] = {0, 2 * PI};
    set_node(carousel, PLATFORM, "platform", "\"mesh\":%u,\"children\":[%d,%d,%d,%d,%d,%d]",
             parts_platform(&carousel->writer), COLUMN, STUDS, ARM, ARM + 3, ARM + 6, ARM + 9);
    set_node(carousel, COLUMN, "column", "\"mesh\":%u", parts_column(&carousel->writer));
    set_node(carousel, STUDS, "studs", "\"mesh\":%u",
             parts_balls(&carousel->writer, "studs", (const float[2]){2.18f, 0.12f}, all_round, 24, 0.055f, GOLD));
    add_riders(carousel);
}

static void bulb_place(float place[3], unsigned which)
{
    const float angle = PI * (0.16f + 0.68f * (float)which / (BULB_PLACES - 1));
    place[0] = -2.7f * cosf(angle);
    place[1] = 0.2f;
    place[2] = 2.7f * sinf(angle);
}

static void add_bulb(struct carousel *carousel)
{
    struct shape sockets = {0}, bulb = {0};
    for (unsigned i = 0; i < BULB_PLACES; i++) {
        float place[3];
        bulb_place(place, i);
        place[1] = 0.05f;
        shape_box(&sockets, place, (const float[3]){0.1f, 0.05f, 0.1f}, 0);
    }
    shape_sphere(&bulb, (const float[3]){0, 0, 0}, 0.11f, 32);
    set_node(carousel, SOCKETS, "sockets", "\"mesh\":%u",
             parts_mesh(&carousel->writer, "sockets", &sockets, DARK));
    set_node(carousel, BULB, "bulb", "\"mesh\":%u,\"children\":[%d]",
             parts_mesh(&carousel->writer, "bulb", &bulb, GLOW), BULB_LIGHT);
    set_node(carousel, BULB_LIGHT, "bulb light",
             "\"translation\":[0,0.3,0],\"extensions\":{\"KHR_lights_punctual\":{\"light\":2}}");
}

static void add_neighbours(struct carousel *carousel)
{
    static const float plinth[][2] = {{0.55f, 0},     {0.55f, 0.08f}, {0.55f, 0.08f}, {0.42f, 0.1f},
                                      {0.36f, 0.16f}, {0.36f, 0.3f},  {0.42f, 0.36f}, {0.48f, 0.38f},
                                      {0.48f, 0.38f}, {0.48f, 0.44f}, {0.48f, 0.44f}, {0, 0.44f}};
    struct shape stand = {0}, ball = {0};
    shape_box(&stand, (const float[3]){0, 0.62f, -0.2f}, (const float[3]){0.07f, 0.62f, 0.05f}, 0);
    shape_box(&stand, (const float[3]){0, 0.04f, -0.1f}, (const float[3]){0.45f, 0.04f, 0.3f}, 0);
    shape_box(&stand, (const float[3]){0, 1.2f, -0.1f}, (const float[3]){0.05f, 0.05f, 0.1f}, 0);
    set_node(carousel, STAND, "stand", "\"mesh\":%u,\"translation\":[3.15,0,-0.6],\"children\":[%d]",
             parts_mesh(&carousel->writer, "stand", &stand, DARK), WHEEL);
    set_node(carousel, WHEEL, "wheel", "\"mesh\":%u,\"translation\":[0,1.2,0],\"children\":[%d]",
             parts_wheel(&carousel->writer), WHEEL_BALL);
    shape_sphere(&ball, (const float[3]){0, 0, 0}, 0.13f, 32);
    set_node(carousel, WHEEL_BALL, "ball on the wheel", "\"mesh\":%u,\"translation\":[0.85,0,0.05]",
             parts_mesh(&carousel->writer, "ball", &ball, GOLD));
    set_node(carousel, PLINTH, "plinth", "\"mesh\":%u,\"translation\":[-2.95,0,0.9],\"children\":[%d]",
             parts_lathe(&carousel->writer, "plinth", plinth, sizeof(plinth) / sizeof(*plinth), CREAM), BLOB);
    set_node(carousel, BLOB, "blob", "\"mesh\":%u,\"translation\":[0,1.1,0]", parts_blob(&carousel->writer));
    set_node(carousel, POST, "reed", "\"mesh\":%u,\"skin\":0", parts_reed(&carousel->writer));
    for (unsigned i = 0; i < JOINTS; i++) {
        char children[40] = "";
        if (i + 1 < JOINTS)
            snprintf(children, sizeof(children), ",\"children\":[%u]", JOINT + i + 1);
        set_node(carousel, JOINT + i, "joint", "\"translation\":[%g,%g,%g]%s", i == 0 ? -2.6 : 0,
                 i == 0 ? 0 : (double)(PARTS_REED_HEIGHT / JOINTS), i == 0 ? -1.7 : 0, children);
    }
}

static void add_floor_and_camera(struct carousel *carousel)
{
    const struct glb_camera camera = {{0.5f, 3.0f, 8.8f}, {0.05f, 0.86f, 0}, 0};
    struct shape floor = {0};
    float q[4];
    shape_quad(&floor, (const float[3]){-40, 0, 40}, (const float[3]){40, 0, 40}, (const float[3]){40, 0, -40},
               (const float[3]){-40, 0, -40});
    set_node(carousel, FLOOR, "floor", "\"mesh\":%u", parts_mesh(&carousel->writer, "floor", &floor, SLATE));
    glb_look_rotation(q, &camera);
    set_node(carousel, CAMERA, "camera",
             "\"camera\":0,\"translation\":[%g,%g,%g],\"rotation\":[%.9g,%.9g,%.9g,%.9g]", (double)camera.eye[0],
             (double)camera.eye[1], (double)camera.eye[2], (double)q[0], (double)q[1], (double)q[2], (double)q[3]);
    set_node(carousel, KEY_LIGHT, "key light",
             "\"translation\":[3.5,5.5,4.5],\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}");
    set_node(carousel, FILL_LIGHT, "fill light",
             "\"translation\":[-5,3.5,2.5],\"extensions\":{\"KHR_lights_punctual\":{\"light\":1}}");
}

/* ---- how it moves ---- */

static void set_turn(float q[4], int axis, float angle)
{
    memset(q, 0, 4 * sizeof(*q));
    q[axis] = sinf(angle / 2);
    q[3] = cosf(angle / 2);
}

static void even_times(float *times_s, unsigned key_count)
{
    for (unsigned i = 0; i < key_count; i++)
        times_s[i] = CLIP_S * (float)i / (float)(key_count - 1);
}

/* Evenly about an axis, so many turns in all. */
static void spin(struct carousel *carousel, unsigned node, int axis, float turns, unsigned key_count)
{
    float times_s[KEYS_MAX], values[KEYS_MAX][4];
    even_times(times_s, key_count);
    for (unsigned i = 0; i < key_count; i++)
        set_turn(values[i], axis, 2 * PI * turns * (float)i / (float)(key_count - 1));
    gltf_animate(&carousel->writer, node,
                 &(struct gltf_curve){"rotation", "LINEAR", times_s, &values[0][0], key_count, 4});
}

static void bob(struct carousel *carousel, unsigned node, float phase)
{
    enum { KEYS = 5 };
    float times_s[KEYS], values[KEYS][3][3] = {0}; /* tangent in, place, tangent out */
    const float turn_s = 2 * PI / CLIP_S, height = 0.16f;
    even_times(times_s, KEYS);
    for (unsigned i = 0; i < KEYS; i++) {
        const float angle = turn_s * times_s[i] + phase;
        values[i][0][1] = values[i][2][1] = height * turn_s * cosf(angle);
        values[i][1][0] = 1.4f;
        values[i][1][1] = 0.62f + height * sinf(angle);
    }
    gltf_animate(&carousel->writer, node,
                 &(struct gltf_curve){"translation", "CUBICSPLINE", times_s, &values[0][0][0], KEYS, 3});
}

static void bend(struct carousel *carousel, unsigned joint)
{
    enum { KEYS = 13 };
    float times_s[KEYS], values[KEYS][4];
    even_times(times_s, KEYS);
    for (unsigned i = 0; i < KEYS; i++)
        set_turn(values[i], 2,
                 (joint ? 0.36f : 0.12f) *
                     sinf(2 * PI * (float)(i % (KEYS - 1)) / (KEYS - 1) - 0.6f * (float)joint));
    gltf_animate(&carousel->writer, JOINT + joint,
                 &(struct gltf_curve){"rotation", "LINEAR", times_s, &values[0][0], KEYS, 4});
}

static void jump(struct carousel *carousel)
{
    float times_s[BULB_PLACES + 1], values[BULB_PLACES + 1][3];
    even_times(times_s, BULB_PLACES + 1);
    for (unsigned i = 0; i <= BULB_PLACES; i++)
        bulb_place(values[i], i % BULB_PLACES);
    gltf_animate(&carousel->writer, BULB,
                 &(struct gltf_curve){"translation", "STEP", times_s, &values[0][0], BULB_PLACES + 1, 3});
}

static float smooth(float t)
{
    const float inside = fminf(fmaxf(t, 0), 1);
    return inside * inside * (3 - 2 * inside);
}

static void morph(struct carousel *carousel)
{
    enum { KEYS = 13 };
    float times_s[KEYS], values[KEYS][2];
    even_times(times_s, KEYS);
    for (unsigned i = 0; i < KEYS; i++) { /* up, then into lobes, with nothing of either at first and last */
        const float t = (float)i / (KEYS - 1);
        values[i][0] = smooth(1 - fabsf(t - 1.0f / 3) * 3);
        values[i][1] = smooth(1 - fabsf(t - 2.0f / 3) * 3);
    }
    gltf_animate(&carousel->writer, BLOB,
                 &(struct gltf_curve){"weights", "LINEAR", times_s, &values[0][0], KEYS, 2});
}

static void add_clip(struct carousel *carousel)
{
    spin(carousel, PLATFORM, 1, 1, 9);
    spin(carousel, WHEEL, 2, -4, 25);
    for (unsigned i = 0; i < RIDERS; i++)
        bob(carousel, ARM + 3 * i + 2, PI / 2 * (float)i);
    for (unsigned i = 0; i < JOINTS; i++)
        bend(carousel, i);
    jump(carousel);
    morph(carousel);
}

/* ---- the file ---- */

/* The joints' places before anything bends; what is below a joint is moved by it. */
static unsigned add_bind_matrices(struct carousel *carousel)
{
    float columns[JOINTS][16] = {0};
    for (int i = 0; i < JOINTS; i++) {
        columns[i][0] = columns[i][5] = columns[i][10] = columns[i][15] = 1;
        columns[i][13] = i ? -PARTS_REED_HEIGHT * (float)i / JOINTS : 0;
    }
    return gltf_floats(&carousel->writer, &columns[0][0], JOINTS, 16, GLTF_NUMBERS);
}

static void print_rest(FILE *json, const struct carousel *carousel, unsigned bind_matrices)
{
    fprintf(json, "\"extensionsUsed\":[\"KHR_lights_punctual\",\"KHR_materials_emissive_strength\"],\"scene\":0,"
                  "\"scenes\":[{\"nodes\":[");
    static const int roots[] = {FLOOR, PLATFORM, BULB,      SOCKETS,    STAND, POST,
                                JOINT, PLINTH,   KEY_LIGHT, FILL_LIGHT, CAMERA};
    for (size_t i = 0; i < sizeof(roots) / sizeof(*roots); i++)
        fprintf(json, "%s%d", i ? "," : "", roots[i]);
    fprintf(json, "]}],\"nodes\":[");
    for (size_t i = 0; i < NODES; i++)
        fprintf(json, "%s%s", i ? "," : "", carousel->nodes[i]);
    fprintf(json, "],\"skins\":[{\"inverseBindMatrices\":%u,\"skeleton\":%d,\"joints\":[", bind_matrices, JOINT);
    for (int i = 0; i < JOINTS; i++)
        fprintf(json, "%s%d", i ? "," : "", JOINT + i);
    fprintf(json, "]}],\"materials\":[");
    for (size_t i = 0; i < PARTS_MATERIALS; i++) {
        fprintf(json, "%s", i ? "," : "");
        glb_print_material(json, &parts_materials[i]);
    }
    /* A light's radius is no part of the extension; importers that know none see points. */
    fprintf(json, "],\"extensions\":{\"KHR_lights_punctual\":{\"lights\":["
                  "{\"type\":\"point\",\"color\":[1,0.93,0.82],\"intensity\":190,\"extras\":{\"radius\":0.45}},"
                  "{\"type\":\"point\",\"color\":[0.6,0.75,1],\"intensity\":30,\"extras\":{\"radius\":0.8}},"
                  "{\"type\":\"point\",\"color\":[1,0.6,0.25],\"intensity\":3,\"extras\":{\"radius\":0.1}}]}},"
                  "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.55,\"znear\":0.01}}]");
}

bool animated_scene_write(const char *path)
{
    struct carousel *carousel = calloc(1, sizeof(*carousel));
    char *rest = NULL;
    size_t rest_bytes = 0;
    FILE *json = open_memstream(&rest, &rest_bytes);
    bool written = false;
    if (carousel && json) {
        gltf_begin(&carousel->writer);
        add_floor_and_camera(carousel);
        add_roundabout(carousel);
        add_bulb(carousel);
        add_neighbours(carousel);
        add_clip(carousel);
        print_rest(json, carousel, add_bind_matrices(carousel));
        carousel->writer.failed |= fflush(json) != 0;
        written = gltf_finish(&carousel->writer, path, rest);
    } else {
        fprintf(stderr, "make_scenes: %s: out of memory\n", path);
    }
    if (json)
        fclose(json);
    free(rest);
    free(carousel);
    return written;
}
