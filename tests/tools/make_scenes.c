/* SPDX-License-Identifier: MIT */
/* Writes the bundled scenes into a folder, so that a fresh machine has something to render:
 *   cornell.glb      a box with coloured walls, a mirror block and a glass sphere
 *   teapot.glb       a teapot on a mirror, with metal and glass beside it
 *   fine-teapot.glb  the same of fifteen times as many triangles, so that its reflections show no facets
 *   carousel.glb     a roundabout of teapots with a clip, "ride": everything that moves
 *   sky.hdr          an evening sky with two soft lights, to be used as environment
 *   dusk.hdr         the same, a sixth as bright: what the lights reach has shadows under it
 *   sphereflake-N.nff  Eric Haines' 'balls' of the Standard Procedural Databases, N levels: 2 to 4, others
 *                    where asked for
 *   bumpy-N.glb      a bumpy sphere of about N thousand triangles above a floor, the family of the benchmark */
#include "animated_scene.h"
#include "glb.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const struct glb_material white = {"white", {0.73f, 0.73f, 0.73f, 1}, 0, 0.9f, 0, 0, {0, 0, 0}};
static const struct glb_material red = {"red", {0.65f, 0.05f, 0.05f, 1}, 0, 0.9f, 0, 0, {0, 0, 0}};
static const struct glb_material green = {"green", {0.12f, 0.45f, 0.15f, 1}, 0, 0.9f, 0, 0, {0, 0, 0}};
static const struct glb_material mirror = {"mirror", {0.92f, 0.92f, 0.92f, 1}, 1, 0, 0, 0, {0, 0, 0}};
static const struct glb_material gold = {"gold", {1.0f, 0.77f, 0.34f, 1}, 1, 0.05f, 0, 0, {0, 0, 0}};
static const struct glb_material glass = {"glass", {1, 1, 1, 1}, 0, 0, 1, 1.5f, {0, 0, 0}};
static const struct glb_material glaze = {"glaze", {0.08f, 0.22f, 0.55f, 1}, 0, 0.08f, 0, 0, {0, 0, 0}};
static const struct glb_material glow = {"glow", {0, 0, 0, 1}, 0, 1, 0, 0, {12, 11, 9}};

static bool finish_parts(bool written, struct glb_part *parts, size_t count)
{
    for (size_t i = 0; i < count; i++)
        shape_finish(&parts[i].shape);
    return written;
}

static bool write_cornell(const char *path)
{
    struct glb_part parts[] = {{"room", {0}, white}, {"left wall", {0}, red},       {"right wall", {0}, green},
                               {"light", {0}, glow}, {"mirror block", {0}, mirror}, {"glass sphere", {0}, glass},
                               {"block", {0}, white}};
    /* The room goes on behind the camera, so that mirror and glass have something to show. */
    const float corner[8][3] = {{-1, 0, -1}, {1, 0, -1}, {-1, 2, -1}, {1, 2, -1},
                                {-1, 0, 4},  {1, 0, 4},  {-1, 2, 4},  {1, 2, 4}};
    shape_quad(&parts[0].shape, corner[0], corner[4], corner[5], corner[1]); /* floor */
    shape_quad(&parts[0].shape, corner[2], corner[3], corner[7], corner[6]); /* ceiling */
    shape_quad(&parts[0].shape, corner[0], corner[1], corner[3], corner[2]); /* back */
    shape_quad(&parts[0].shape, corner[4], corner[6], corner[7], corner[5]); /* front */
    shape_quad(&parts[1].shape, corner[0], corner[2], corner[6], corner[4]);
    shape_quad(&parts[2].shape, corner[1], corner[5], corner[7], corner[3]);
    const float light_corner[4][3] = {
        {-0.3f, 1.995f, -0.3f}, {0.3f, 1.995f, -0.3f}, {0.3f, 1.995f, 0.3f}, {-0.3f, 1.995f, 0.3f}};
    shape_quad(&parts[3].shape, light_corner[0], light_corner[1], light_corner[2], light_corner[3]);
    shape_box(&parts[4].shape, (const float[3]){-0.38f, 0.6f, -0.35f}, (const float[3]){0.28f, 0.6f, 0.28f},
              0.35f);
    shape_sphere(&parts[5].shape, (const float[3]){0.42f, 0.33f, 0.32f}, 0.33f, 96);
    shape_box(&parts[6].shape, (const float[3]){0.48f, 0.15f, -0.45f}, (const float[3]){0.22f, 0.15f, 0.22f},
              -0.4f);
    const struct glb_light lights[] = {{"point", {1, 0.93f, 0.8f}, 2.6f, {0, 1.85f, 0}},
                                       {"point", {0.8f, 0.9f, 1}, 1.6f, {0.4f, 1.3f, 3.5f}}};
    const struct glb_camera camera = {{0, 1, 3.6f}, {0, 0.97f, 0}, 0.66f};
    const size_t count = sizeof(parts) / sizeof(*parts);
    return finish_parts(glb_write(path, parts, count, lights, 2, &camera), parts, count);
}

static bool write_teapot(const char *path, uint32_t segments)
{
    struct glb_part parts[] = {{"table", {0}, mirror},     {"teapot", {0}, glaze}, {"gold ball", {0}, gold},
                               {"glass ball", {0}, glass}, {"red ball", {0}, red}, {"wall", {0}, white}};
    shape_quad(&parts[0].shape, (const float[3]){-14, 0, 4}, (const float[3]){14, 0, 4},
               (const float[3]){14, 0, -4}, (const float[3]){-14, 0, -4});
    shape_teapot(&parts[1].shape, segments);
    shape_sphere(&parts[2].shape, (const float[3]){1.5f, 0.35f, 1.1f}, 0.35f, 96);
    shape_sphere(&parts[3].shape, (const float[3]){-0.5f, 0.3f, 1.5f}, 0.3f, 96);
    shape_sphere(&parts[4].shape, (const float[3]){-1.9f, 0.45f, 0.3f}, 0.45f, 96);
    shape_quad(&parts[5].shape, (const float[3]){-14, 0, -4}, (const float[3]){14, 0, -4},
               (const float[3]){14, 3.2f, -4}, (const float[3]){-14, 3.2f, -4});
    const struct glb_light lights[] = {{"point", {1, 0.95f, 0.85f}, 42, {3, 5, 4}},
                                       {"point", {0.6f, 0.75f, 1}, 14, {-4, 3.5f, 2}}};
    const struct glb_camera camera = {{0.9f, 1.7f, 5.0f}, {0, 0.5f, 0}, 0.68f};
    const size_t count = sizeof(parts) / sizeof(*parts);
    return finish_parts(glb_write(path, parts, count, lights, 2, &camera), parts, count);
}

/* z-up frame of a sphere of the flake: its children sit on the side that `axis` points to. */
static void write_flake(FILE *file, const float centre[3], const float axis[3], float radius, int levels)
{
    fprintf(file, "s %.7g %.7g %.7g %.7g\n", centre[0], centre[1], centre[2], radius);
    if (levels == 0)
        return;
    const bool steep = fabsf(axis[2]) > 0.9f;
    float side[3] = {steep ? 0 : -axis[1], steep ? -axis[2] : axis[0], steep ? axis[1] : 0};
    const float length = sqrtf(side[0] * side[0] + side[1] * side[1] + side[2] * side[2]);
    for (int i = 0; i < 3; i++)
        side[i] /= length;
    const float up[3] = {axis[1] * side[2] - axis[2] * side[1], axis[2] * side[0] - axis[0] * side[2],
                         axis[0] * side[1] - axis[1] * side[0]};
    for (int child = 0; child < 9; child++) { /* six around, three above */
        const float angle = child < 6 ? 1.04719755f * (float)child : 2.0943951f * (float)(child - 6) + 0.52f;
        const float polar = child < 6 ? 1.5707963f : 0.6154797f;
        float direction[3], at[3];
        for (int i = 0; i < 3; i++) {
            direction[i] = sinf(polar) * (cosf(angle) * side[i] + sinf(angle) * up[i]) + cosf(polar) * axis[i];
            at[i] = centre[i] + direction[i] * radius * (4.0f / 3.0f);
        }
        write_flake(file, at, direction, radius / 3, levels - 1);
    }
}

static bool write_sphereflake(const char *path, int levels)
{
    FILE *file = fopen(path, "w");
    if (!file) {
        fprintf(stderr, "make_scenes: %s: %s\n", path, strerror(errno));
        return false;
    }
    fprintf(file, "v\nfrom 2.1 1.3 1.7\nat 0 0 0\nup 0 0 1\nangle 45\nhither 0.01\nresolution 512 512\n"
                  "b 0.078 0.361 0.753\nl 4 3 2\nl 1 -4 4\nl -3 1 5\n"
                  "f 1 0.75 0.33 0.8 0 0 0 0\np 4\n12 12 -0.5\n-12 12 -0.5\n-12 -12 -0.5\n12 -12 -0.5\n"
                  "f 1 0.9 0.7 0.5 0.5 80 0 0\n");
    write_flake(file, (const float[3]){0, 0, 0}, (const float[3]){0, 0, 1}, 0.5f, levels);
    const bool written = !ferror(file);
    if (fclose(file) != 0 || !written) {
        fprintf(stderr, "make_scenes: %s: %s\n", path, strerror(errno));
        return false;
    }
    return true;
}

/* Radiance of the sky in a direction given by its height (sine of the elevation) and azimuth from -z to the right.
 */
static void sky_radiance(float rgb[3], float height, float azimuth)
{
    const float up = fmaxf(height, 0), warm = expf(-6 * up);
    const float ground = height < 0 ? 0.35f : 1;
    rgb[0] = ground * (0.16f + 0.75f * warm);
    rgb[1] = ground * (0.26f + 0.42f * warm);
    rgb[2] = ground * (0.48f + 0.22f * warm);
    /* Two soft boxes: a large warm one to the right, a slender cool one to the left. */
    if (fabsf(azimuth - 0.9f) < 0.45f && fabsf(height - 0.55f) < 0.22f)
        for (int i = 0; i < 3; i++)
            rgb[i] += (const float[3]){6, 5, 4}[i];
    if (fabsf(azimuth + 1.3f) < 0.18f && fabsf(height - 0.4f) < 0.35f)
        for (int i = 0; i < 3; i++)
            rgb[i] += (const float[3]){2.2f, 2.8f, 3.6f}[i];
}

/* The middle one is +x. */
static float azimuth_of_column(float x, float width)
{
    return 6.2831853f * ((x + 0.5f) / width - 0.25f);
}

/* Radiance's own format, without run lengths: https://radsite.lbl.gov/radiance/refer/filefmts.pdf */
static bool write_sky(const char *path, float strength)
{
    enum { WIDTH = 512, HEIGHT = 256 };
    FILE *file = fopen(path, "wb");
    if (!file) {
        fprintf(stderr, "make_scenes: %s: %s\n", path, strerror(errno));
        return false;
    }
    fprintf(file, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n", HEIGHT, WIDTH);
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            float rgb[3];
            sky_radiance(rgb, cosf(3.14159265f * ((float)y + 0.5f) / HEIGHT),
                         remainderf(azimuth_of_column((float)x, WIDTH), 6.2831853f));
            for (int i = 0; i < 3; i++)
                rgb[i] *= strength;
            int exponent;
            const float mantissa = frexpf(fmaxf(rgb[0], fmaxf(rgb[1], rgb[2])), &exponent);
            const float scale = mantissa * 256 / fmaxf(rgb[0], fmaxf(rgb[1], rgb[2]));
            const unsigned char rgbe[4] = {(unsigned char)(rgb[0] * scale), (unsigned char)(rgb[1] * scale),
                                           (unsigned char)(rgb[2] * scale), (unsigned char)(exponent + 128)};
            fwrite(rgbe, 1, 4, file);
        }
    }
    const bool written = !ferror(file);
    if (fclose(file) != 0 || !written) {
        fprintf(stderr, "make_scenes: %s: %s\n", path, strerror(errno));
        return false;
    }
    return true;
}

static bool write_bumpy(const char *path, uint32_t thousand_triangles)
{
    struct glb_part parts[] = {{"ball", {0}, white}, {"floor", {0}, gold}};
    const uint32_t segments = (uint32_t)sqrtf((float)thousand_triangles * 1000);
    struct shape *ball = &parts[0].shape;
    shape_sphere(ball, (const float[3]){0, 1, 0}, 1, segments);
    for (uint32_t i = 0; i < ball->vertex_count && !ball->out_of_memory; i++) {
        float *p = ball->positions + 3 * (size_t)i;
        const float *n = ball->normals + 3 * (size_t)i;
        const float bump = 0.06f * sinf(14 * n[0]) * sinf(14 * n[1]) * sinf(14 * n[2]);
        for (int axis = 0; axis < 3; axis++)
            p[axis] += bump * n[axis];
    }
    shape_quad(&parts[1].shape, (const float[3]){-4, -0.1f, 4}, (const float[3]){4, -0.1f, 4},
               (const float[3]){4, -0.1f, -4}, (const float[3]){-4, -0.1f, -4});
    const struct glb_light light = {"point", {1, 1, 1}, 40, {3, 5, 4}};
    const struct glb_camera camera = {{1.5f, 2.2f, 4}, {0, 0.9f, 0}, 0.7f};
    return finish_parts(glb_write(path, parts, 2, &light, 1, &camera), parts, 2);
}

int main(int argc, char **argv)
{
    if (argc < 2 || argv[1][0] == '-') {
        fprintf(stderr, "usage: make_scenes FOLDER [BUMPY_KILOTRIANGLES | flake-LEVELS ..]\n");
        return 2;
    }
    if (mkdir(argv[1], 0777) != 0 && errno != EEXIST) {
        fprintf(stderr, "make_scenes: %s: %s\n", argv[1], strerror(errno));
        return 1;
    }
    char path[4096];
    snprintf(path, sizeof(path), "%s/cornell.glb", argv[1]);
    bool ok = write_cornell(path);
    snprintf(path, sizeof(path), "%s/teapot.glb", argv[1]);
    ok &= write_teapot(path, 96);
    snprintf(path, sizeof(path), "%s/fine-teapot.glb", argv[1]);
    ok &= write_teapot(path, 288);
    snprintf(path, sizeof(path), "%s/carousel.glb", argv[1]);
    ok &= animated_scene_write(path);
    snprintf(path, sizeof(path), "%s/sky.hdr", argv[1]);
    ok &= write_sky(path, 1);
    snprintf(path, sizeof(path), "%s/dusk.hdr", argv[1]);
    ok &= write_sky(path, 0.16f);
    for (int levels = 2; levels <= 4; levels++) {
        snprintf(path, sizeof(path), "%s/sphereflake-%d.nff", argv[1], levels);
        ok &= write_sphereflake(path, levels);
    }
    for (int i = 2; i < argc; i++) {
        if (strncmp(argv[i], "flake-", 6) == 0) {
            const long levels = strtol(argv[i] + 6, NULL, 10);
            if (levels < 1 || levels > 6) {
                fprintf(stderr, "make_scenes: %s: 1 to 6 levels are expected\n", argv[i]);
                return 2;
            }
            snprintf(path, sizeof(path), "%s/sphereflake-%ld.nff", argv[1], levels);
            ok &= write_sphereflake(path, (int)levels);
            continue;
        }
        const long thousands = strtol(argv[i], NULL, 10);
        if (thousands < 1 || thousands > 8000) {
            fprintf(stderr, "make_scenes: %s: a number of thousands from 1 to 8000 is expected\n", argv[i]);
            return 2;
        }
        snprintf(path, sizeof(path), "%s/bumpy-%ld.glb", argv[1], thousands);
        ok &= write_bumpy(path, (uint32_t)thousands);
    }
    return ok ? 0 : 1;
}
