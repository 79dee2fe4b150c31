/* SPDX-License-Identifier: MIT */
/* Neutral File Format (E. Haines. A Proposal for Standard Graphics Environments. IEEE CG&A 7(11), 1987, and the
 * text that comes with the databases), and beyond it: colours of lights (SPD 3), fewer numbers after `f`, and
 * the solids and the `tess` of a widespread dialect. */
#include "import.h"

#include "import/model/edits.h"
#include "reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LIGHTS_MAX 4096

/* The fill before any `f`, and for numbers that an `f` omits. */
static const struct nff_fill default_fill = {.numbers = {1, 1, 1, 1, 0, 0, 0, 1}};

static bool read_fill(struct nff *nff)
{
    struct nff_fill fill = default_fill;
    uint32_t count = word_reader_some(&nff->reader, fill.numbers, 8);

    if (count < 3)
        return import_fail(nff->scene, word_reader_where(&nff->reader),
                           "'f' has %u numbers; it needs at least red, green and blue", count);
    nff->fill = fill;
    return nff_use_fill(nff);
}

static bool read_light(struct nff *nff)
{
    float numbers[6] = {0};
    uint32_t count = word_reader_some(&nff->reader, numbers, 6);
    struct nff_light *grown;

    if (count != 3 && count != 6)
        return import_fail(nff->scene, word_reader_where(&nff->reader),
                           "'l' has %u numbers; it needs 3, or 6 with a colour", count);
    if (nff->light_count == LIGHTS_MAX)
        return import_fail(nff->scene, word_reader_where(&nff->reader), "more than %d lights", LIGHTS_MAX);
    grown = import_grow(nff->scene, nff->lights, nff->light_count, &nff->light_capacity, sizeof(*grown));
    if (!grown)
        return false;
    nff->lights = grown;
    grown[nff->light_count] = (struct nff_light){.coloured = count == 6};
    for (int c = 0; c < 3; c++) {
        grown[nff->light_count].position[c] = numbers[c];
        grown[nff->light_count].colour[c] = fmaxf(numbers[3 + c], 0);
    }
    nff->light_count++;
    return true;
}

static bool expect(struct nff *nff, const char *text)
{
    struct word word = {"", 0};

    if (word_reader_skip(&nff->reader, false))
        word = word_reader_next(&nff->reader);
    if (word_is(word, text))
        return true;
    return import_fail(nff->scene, word_reader_where(&nff->reader),
                       "'%s' is missing in the viewpoint; there is '%.*s'", text, word_shown(word), word.text);
}

static bool view_usable(struct nff *nff)
{
    double along[3], across = 0, length = 0, up_length = 0;

    for (int c = 0; c < 3; c++) {
        along[c] = (double)nff->look_at[c] - (double)nff->from[c];
        length += along[c] * along[c];
        up_length += (double)nff->up[c] * (double)nff->up[c];
    }
    for (int c = 0; c < 3; c++) {
        int u = (c + 1) % 3, v = (c + 2) % 3;
        double product = along[u] * (double)nff->up[v] - along[v] * (double)nff->up[u];

        across += product * product;
    }
    if (!(length > 0))
        return import_fail(nff->scene, word_reader_where(&nff->reader),
                           "'from' and 'at' of the viewpoint are the same point");
    if (!(across > 1e-18 * length * up_length))
        return import_fail(nff->scene, word_reader_where(&nff->reader), "'up' is zero or along the view");
    if (!(nff->angle_degrees > 0 && nff->angle_degrees < 177))
        return import_fail(nff->scene, word_reader_where(&nff->reader), "an angle of %g degrees",
                           (double)nff->angle_degrees);
    return true;
}

static bool read_view(struct nff *nff)
{
    float resolution[2];

    if (!expect(nff, "from") || !word_reader_numbers(&nff->reader, nff->from, 3, "from") || !expect(nff, "at") ||
        !word_reader_numbers(&nff->reader, nff->look_at, 3, "at") || !expect(nff, "up") ||
        !word_reader_numbers(&nff->reader, nff->up, 3, "up") || !expect(nff, "angle") ||
        !word_reader_numbers(&nff->reader, &nff->angle_degrees, 1, "angle") || !expect(nff, "hither") ||
        !word_reader_numbers(&nff->reader, &nff->hither, 1, "hither") || !expect(nff, "resolution") ||
        !word_reader_numbers(&nff->reader, resolution, 2, "resolution"))
        return false;
    nff->has_view = true;
    return view_usable(nff);
}

static bool read_sphere(struct nff *nff)
{
    float n[4];

    if (!word_reader_numbers(&nff->reader, n, 4, "s"))
        return false;
    word_reader_some(&nff->reader, n, 0);
    if (n[3] < 0) { /* 'only the inside is visible'; ours show both sides */
        import_note(nff->scene, PROTOCOL_SEVERITY_WARNING, word_reader_where(&nff->reader),
                    "a sphere to be seen from inside shows both sides");
        n[3] = -n[3];
    }
    if (!(n[3] > 0))
        return import_fail(nff->scene, word_reader_where(&nff->reader), "a sphere of radius 0");
    return shapes_add_sphere(nff->shapes, n, n[3]);
}

static bool read_cone(struct nff *nff)
{
    float ends[8];

    if (!word_reader_numbers(&nff->reader, ends, 8, "c"))
        return false;
    ends[3] = fabsf(ends[3]); /* negative: visible from inside; ours show both sides */
    ends[7] = fabsf(ends[7]);
    return shapes_add_cone(nff->shapes, ends, word_reader_where(&nff->reader));
}

static bool read_polygon(struct nff *nff, bool patch)
{
    uint32_t floats = patch ? 6 : 3, count;
    struct shape_vertex *corners;
    float stated;
    bool read = true;

    if (!word_reader_numbers(&nff->reader, &stated, 1, patch ? "pp" : "p"))
        return false;
    if (!(stated >= 3 && stated <= (float)POLYGON_CORNERS_MAX))
        return import_fail(nff->scene, word_reader_where(&nff->reader),
                           "a polygon of %g corners; 3 to %u are allowed", (double)stated, POLYGON_CORNERS_MAX);
    count = (uint32_t)stated;
    if (!word_reader_can_hold(&nff->reader, (uint64_t)count * floats, "a polygon"))
        return false;
    corners = calloc(count, sizeof(*corners));
    if (!corners)
        return import_fail(nff->scene, NULL, "out of memory");
    for (uint32_t i = 0; read && i < count; i++) {
        float row[6] = {0};

        read = word_reader_numbers(&nff->reader, row, floats, patch ? "pp" : "p");
        memcpy(corners[i].position, row, 12);
        memcpy(corners[i].normal, row + 3, 12);
    }
    read = read && shapes_add_polygon(nff->shapes, corners, count, !patch, word_reader_where(&nff->reader));
    free(corners);
    return read;
}

static bool read_solid(struct nff *nff, int faces)
{
    float n[4];

    if (!word_reader_numbers(&nff->reader, n, 4, "a solid"))
        return false;
    word_reader_some(&nff->reader, n, 0);
    if (!(n[3] > 0))
        return import_fail(nff->scene, word_reader_where(&nff->reader), "a solid of radius %g", (double)n[3]);
    return shapes_add_solid(nff->shapes, faces, n, n[3], word_reader_where(&nff->reader));
}

static bool read_background(struct nff *nff)
{
    nff->has_background = true;
    return word_reader_numbers(&nff->reader, nff->background, 3, "b");
}

static bool read_statement(struct nff *nff, struct word word)
{
    float nothing[1];

    if (word_is(word, "v"))
        return read_view(nff);
    if (word_is(word, "b"))
        return read_background(nff);
    if (word_is(word, "l"))
        return read_light(nff);
    if (word_is(word, "f"))
        return read_fill(nff);
    if (word_is(word, "s"))
        return read_sphere(nff);
    if (word_is(word, "c"))
        return read_cone(nff);
    if (word_is(word, "p") || word_is(word, "pp"))
        return read_polygon(nff, word.length == 2);
    if (word_is(word, "tet"))
        return read_solid(nff, 4);
    if (word_is(word, "hex"))
        return read_solid(nff, 6);
    if (word_is(word, "oct"))
        return read_solid(nff, 8);
    if (word_is(word, "dod"))
        return read_solid(nff, 12);
    if (word_is(word, "tess")) /* subdivision of round shapes; spheres are exact here */
        return word_reader_some(&nff->reader, nothing, 1) <= 1;
    return import_fail(nff->scene, word_reader_where(&nff->reader), "'%.*s' is not a statement of NFF",
                       word_shown(word), word.text);
}

static void nff_init(struct nff *nff, struct import_scene *scene, const unsigned char *bytes, size_t size_bytes)
{
    *nff = (struct nff){.scene = scene, .fill = default_fill, .polygon_budget = POLYGON_BUDGET};
    nff->reader = (struct word_reader){
        .scene = scene, .at = (const char *)bytes, .end = (const char *)bytes + size_bytes, .line = 1};
}

static void nff_free(struct nff *nff)
{
    free(nff->lights);
    free(nff->materials);
    free(nff->slots);
    free(nff->material_ids);
}

static bool finish(struct nff *nff)
{
    const struct shapes *shapes = nff->shapes;

    if (shapes->sphere_count == 0 && shapes->triangle_count == 0)
        return import_fail(nff->scene, NULL, "it contains nothing that can be shown");
    if (!nff_add_materials(nff) || !nff_add_lights(nff) || !shapes_finish(nff->shapes, nff->material_ids) ||
        (nff->has_view && !nff_add_camera(nff)))
        return false;
    nff_add_background(nff);
    return !nff->scene->failed;
}

bool nff_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes)
{
    struct shapes shapes;
    struct nff nff;
    bool imported = true;

    nff_init(&nff, scene, bytes, size_bytes);
    shapes_init(&shapes, scene, &nff.polygon_budget);
    nff.shapes = &shapes;
    while (imported && word_reader_skip(&nff.reader, false))
        imported = read_statement(&nff, word_reader_next(&nff.reader));
    imported = imported && finish(&nff);
    shapes_free(&shapes);
    nff_free(&nff);
    return imported && !scene->failed;
}
