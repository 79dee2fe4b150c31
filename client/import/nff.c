/* SPDX-License-Identifier: MIT */
/* Neutral File Format: E. Haines. A Proposal for Standard Graphics Environments. IEEE CG&A 7(11), 1987, and the
 * text that comes with the databases. Beyond it: colours of lights (SPD 3), fewer numbers after `f`, and the
 * solids and the `tess` of a widespread dialect. */
#include "nff.h"

#include "formats.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define LIGHTS_MAX 4096

struct light {
    float position[3], colour[3];
    bool coloured;
};

struct fill {
    float numbers[8]; /* red green blue Kd Ks shine T ior */
    uint32_t material;
};

struct nff {
    struct import_scene *scene;
    const char *at, *end;
    uint32_t line;
    struct nff_shapes shapes;
    struct light *lights;
    size_t light_count;
    struct fill *fills; /* open addressing; material 0: free */
    size_t fill_count, fill_capacity;
    bool has_view, has_background;
    float from[3], look_at[3], up[3], angle_degrees, hither;
    float background[3];
    char where[32];
};

/* ---- words and numbers ---- */

static const char *where(struct nff *nff)
{
    snprintf(nff->where, sizeof(nff->where), "line %u", nff->line);
    return nff->where;
}

/* To the next word; with `same_line` not beyond the end of the line. False: there is none. */
static bool skip_blanks(struct nff *nff, bool same_line)
{
    while (nff->at < nff->end) {
        char c = *nff->at;

        if (c == '#')
            while (nff->at < nff->end && *nff->at != '\n')
                nff->at++;
        else if (c == '\n') {
            if (same_line)
                return false;
            nff->line++;
            nff->at++;
        } else if (c == ' ' || c == '\t' || c == '\r')
            nff->at++;
        else
            return true;
    }
    return false;
}

struct word {
    const char *text;
    size_t length;
};

static struct word next_word(struct nff *nff)
{
    struct word word = {nff->at, 0};

    while (nff->at < nff->end && !strchr(" \t\r\n#", *nff->at)) /* strchr finds the NUL, too */
        nff->at++;
    word.length = (size_t)(nff->at - word.text);
    if (word.length == 0 && nff->at < nff->end) /* a NUL byte in the file */
        nff->at++, word.length = 1;
    return word;
}

static bool word_is(struct word word, const char *text)
{
    return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

static int shown(struct word word)
{
    return word.length < 24 ? (int)word.length : 24;
}

static bool to_number(struct word word, float *out)
{
    char text[64], *end;
    double value;

    if (word.length == 0 || word.length >= sizeof(text))
        return false;
    memcpy(text, word.text, word.length);
    text[word.length] = '\0';
    value = strtod(text, &end);
    if (*end != '\0' || end == text || !(fabs(value) <= 1e12))
        return false;
    *out = (float)value;
    return true;
}

/* Exactly `count` numbers, over several lines if need be. */
static bool read_numbers(struct nff *nff, float *out, uint32_t count, const char *of)
{
    for (uint32_t i = 0; i < count; i++) {
        struct word word;

        if (!skip_blanks(nff, false))
            return import_fail(nff->scene, where(nff), "the file ends where number %u of %u of '%s' should be",
                               i + 1, count, of);
        word = next_word(nff);
        if (!to_number(word, &out[i]))
            return import_fail(nff->scene, where(nff), "'%.*s' is not an allowed number of '%s' (%u of %u)",
                               shown(word), word.text, of, i + 1, count);
    }
    return true;
}

/* Up to `maximum` numbers of this line; stops at the first word that is none. The rest of the line is skipped. */
static uint32_t read_some(struct nff *nff, float *out, uint32_t maximum)
{
    uint32_t count = 0;
    bool more = false;

    while (skip_blanks(nff, true)) {
        struct word word = next_word(nff);

        if (more || count == maximum || !to_number(word, &out[count]))
            more = true;
        else
            count++;
    }
    if (more)
        import_note(nff->scene, PROTOCOL_SEVERITY_INFO, where(nff), "unknown words at the end of a line");
    return count;
}

/* ---- what a statement means ---- */

static float unit(float value)
{
    return value < 0 ? 0 : value > 1 ? 1 : value;
}

/* Kd is what scatters, Ks what mirrors, T what passes: what mirrors does so like a metal's share of the surface.
 * The colour is that of all three, times their sum, so that each comes out as stated. */
static void fill_to_material(const float n[8], struct message_set_material *material)
{
    float diffuse = unit(n[3]), specular = unit(n[4]), through = unit(n[6]);
    float sum = diffuse + specular;

    import_material_default(material);
    material->double_sided = 1;
    material->metallic = sum > 0 ? specular / sum : 0;
    material->roughness =
        specular > 0 ? 0.0f : 1.0f; /* NFF's reflections are sharp; Shine only shapes highlights */
    for (int c = 0; c < 3; c++)
        material->base_colour[c] = unit(n[c] * unit(sum));
    if (through > 0) {
        material->transmission = through;
        material->metallic = 0; /* glass mirrors by its index of refraction */
        material->roughness = 0;
        material->ior = n[7] >= 1 && n[7] <= 10 ? n[7] : 1;
        for (int c = 0; c < 3; c++)
            material->base_colour[c] = unit(n[c]);
    }
}

static struct fill *find_fill(struct nff *nff, const float numbers[8])
{
    uint64_t hash = 14695981039346656037ull; /* FNV-1a */
    const unsigned char *bytes = (const unsigned char *)numbers;
    size_t at;

    for (size_t i = 0; i < 8 * sizeof(float); i++)
        hash = (hash ^ bytes[i]) * 1099511628211ull;
    for (at = (size_t)hash & (nff->fill_capacity - 1); nff->fills[at].material != 0;
         at = (at + 1) & (nff->fill_capacity - 1))
        if (memcmp(nff->fills[at].numbers, numbers, 8 * sizeof(float)) == 0)
            break;
    return &nff->fills[at];
}

static bool grow_fills(struct nff *nff)
{
    struct fill *old = nff->fills;
    size_t old_capacity = nff->fill_capacity;

    nff->fill_capacity = old_capacity ? old_capacity * 2 : 64;
    nff->fills = calloc(nff->fill_capacity, sizeof(*nff->fills));
    if (!nff->fills) {
        nff->fills = old;
        nff->fill_capacity = old_capacity;
        return import_fail(nff->scene, NULL, "out of memory");
    }
    for (size_t i = 0; i < old_capacity; i++)
        if (old[i].material != 0)
            *find_fill(nff, old[i].numbers) = old[i];
    free(old);
    return true;
}

static bool read_fill(struct nff *nff)
{
    struct fill wanted = {.numbers = {1, 1, 1, 1, 0, 0, 0, 1}};
    struct message_set_material material;
    struct fill *found;
    char name[32];
    uint32_t count = read_some(nff, wanted.numbers, 8);

    if (count < 3)
        return import_fail(nff->scene, where(nff), "'f' has %u numbers; it needs at least red, green and blue",
                           count);
    if (nff->fill_count * 2 >= nff->fill_capacity && !grow_fills(nff))
        return false;
    found = find_fill(nff, wanted.numbers);
    if (found->material == 0) {
        fill_to_material(wanted.numbers, &material);
        snprintf(name, sizeof(name), "fill of line %u", nff->line);
        material.name = name;
        wanted.material = import_add_material(nff->scene, &material);
        if (wanted.material == 0)
            return false;
        *found = wanted;
        nff->fill_count++;
    }
    nff->shapes.material = found->material;
    return true;
}

static bool read_light(struct nff *nff)
{
    float numbers[6] = {0};
    uint32_t count = read_some(nff, numbers, 6);
    struct light *grown;

    if (count != 3 && count != 6)
        return import_fail(nff->scene, where(nff), "'l' has %u numbers; it needs 3, or 6 with a colour", count);
    if (nff->light_count == LIGHTS_MAX)
        return import_fail(nff->scene, where(nff), "more than %d lights", LIGHTS_MAX);
    grown = realloc(nff->lights, (nff->light_count + 1) * sizeof(*grown));
    if (!grown)
        return import_fail(nff->scene, NULL, "out of memory");
    nff->lights = grown;
    grown[nff->light_count].coloured = count == 6;
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

    if (skip_blanks(nff, false))
        word = next_word(nff);
    if (word_is(word, text))
        return true;
    return import_fail(nff->scene, where(nff), "'%s' is missing in the viewpoint; there is '%.*s'", text,
                       shown(word), word.text);
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
        return import_fail(nff->scene, where(nff), "'from' and 'at' of the viewpoint are the same point");
    if (!(across > 1e-18 * length * up_length))
        return import_fail(nff->scene, where(nff), "'up' is zero or along the view");
    if (!(nff->angle_degrees > 0 && nff->angle_degrees < 177))
        return import_fail(nff->scene, where(nff), "an angle of %g degrees", (double)nff->angle_degrees);
    return true;
}

static bool read_view(struct nff *nff)
{
    float resolution[2];

    if (!expect(nff, "from") || !read_numbers(nff, nff->from, 3, "from") || !expect(nff, "at") ||
        !read_numbers(nff, nff->look_at, 3, "at") || !expect(nff, "up") || !read_numbers(nff, nff->up, 3, "up") ||
        !expect(nff, "angle") || !read_numbers(nff, &nff->angle_degrees, 1, "angle") || !expect(nff, "hither") ||
        !read_numbers(nff, &nff->hither, 1, "hither") || !expect(nff, "resolution") ||
        !read_numbers(nff, resolution, 2, "resolution"))
        return false;
    nff->has_view = true;
    return view_usable(nff);
}

static bool read_sphere(struct nff *nff)
{
    float n[4];

    if (!read_numbers(nff, n, 4, "s"))
        return false;
    read_some(nff, n, 0);
    if (n[3] < 0) { /* 'only the inside is visible'; ours show both sides */
        import_note(nff->scene, PROTOCOL_SEVERITY_WARNING, where(nff),
                    "a sphere to be seen from inside shows both sides");
        n[3] = -n[3];
    }
    if (!(n[3] > 0))
        return import_fail(nff->scene, where(nff), "a sphere of radius 0");
    return nff_add_sphere(&nff->shapes, n, n[3]);
}

static bool read_cone(struct nff *nff)
{
    float ends[8];

    if (!read_numbers(nff, ends, 8, "c"))
        return false;
    ends[3] = fabsf(ends[3]); /* negative: to be seen from inside; ours show both sides */
    ends[7] = fabsf(ends[7]);
    return nff_add_cone(&nff->shapes, ends, where(nff));
}

static bool read_polygon(struct nff *nff, bool patch)
{
    uint32_t floats = patch ? 6 : 3, count;
    float stated, *rows = NULL, *corners = NULL, *normals = NULL;
    bool read = true;

    if (!read_numbers(nff, &stated, 1, patch ? "pp" : "p"))
        return false;
    if (!(stated >= 3 && stated <= (float)POLYGON_CORNERS_MAX))
        return import_fail(nff->scene, where(nff), "a polygon of %g corners; 3 to %u are allowed", (double)stated,
                           POLYGON_CORNERS_MAX);
    count = (uint32_t)stated;
    /* Every number takes two bytes at least: more than the file could hold is not worth memory. */
    if ((uint64_t)count * floats * 2 > (uint64_t)(nff->end - nff->at) + 1)
        return import_fail(nff->scene, where(nff), "a polygon of %u corners in a file that ends before", count);
    rows = malloc((size_t)count * floats * sizeof(*rows));
    corners = malloc((size_t)count * 3 * sizeof(*corners));
    normals = patch ? malloc((size_t)count * 3 * sizeof(*normals)) : NULL;
    if (!rows || !corners || (patch && !normals))
        read = import_fail(nff->scene, NULL, "out of memory");
    read = read && read_numbers(nff, rows, count * floats, patch ? "pp" : "p");
    for (size_t i = 0; read && i < count; i++) {
        memcpy(corners + i * 3, rows + i * floats, 12);
        if (patch)
            memcpy(normals + i * 3, rows + i * floats + 3, 12);
    }
    read = read && nff_add_polygon(&nff->shapes, corners, normals, count, where(nff));
    free(rows);
    free(corners);
    free(normals);
    return read;
}

static bool read_solid(struct nff *nff, int faces)
{
    float n[4];

    if (!read_numbers(nff, n, 4, "a solid"))
        return false;
    read_some(nff, n, 0);
    if (!(n[3] > 0))
        return import_fail(nff->scene, where(nff), "a solid of radius %g", (double)n[3]);
    return nff_add_solid(&nff->shapes, faces, n, n[3], where(nff));
}

static bool read_background(struct nff *nff)
{
    nff->has_background = true;
    return read_numbers(nff, nff->background, 3, "b");
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
    if (word_is(word, "tess")) /* how finely round things are cut: spheres are exact here */
        return read_some(nff, nothing, 1) <= 1;
    return import_fail(nff->scene, where(nff), "'%.*s' is not a statement of NFF", shown(word), word.text);
}

/* ---- what is added at the end ---- */

static bool show(struct nff *nff, enum protocol_node_kind kind, uint32_t object, const float matrix[12],
                 const char *name)
{
    struct message_set_node node = {.kind = kind, .object = object, .name = name};

    memcpy(node.parent_from_node, matrix, sizeof(node.parent_from_node));
    return object != 0 && import_add_node(nff->scene, &node) != 0;
}

static bool add_camera(struct nff *nff)
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
    camera.fov_y = (float)((double)nff->angle_degrees * PI / 180);
    camera.near = fmaxf(nff->hither, 0);
    return show(nff, PROTOCOL_NODE_CAMERA, import_add_camera(nff->scene, &camera), matrix, "view");
}

/* NFF's lights do not weaken with distance, ours do: each is given the intensity that makes it as bright as NFF
 * wants it at the place that the view looks at (without a view: in the middle of the model). A surface there that
 * scatters all light then sends out what NFF's formula says, Kd times N.L times the light; hence the factor pi. */
static bool add_lights(struct nff *nff)
{
    const struct nff_shapes *shapes = &nff->shapes;
    /* NFF: lights without colour share what one would give, less steeply than evenly. */
    float share = (float)(sqrt((double)nff->light_count) / (double)nff->light_count);

    for (size_t i = 0; i < nff->light_count; i++) {
        const struct light *light = &nff->lights[i];
        struct message_set_light set = {.kind = PROTOCOL_LIGHT_POINT};
        float matrix[12];
        double distance2 = 0;
        char name[32];

        import_identity(matrix);
        for (int c = 0; c < 3; c++) {
            double middle = nff->has_view ? (double)nff->look_at[c]
                                          : ((double)shapes->lower[c] + (double)shapes->upper[c]) / 2;

            matrix[c * 4 + 3] = light->position[c];
            distance2 += ((double)light->position[c] - middle) * ((double)light->position[c] - middle);
        }
        if (!(distance2 > 1e-12))
            distance2 = 1;
        for (int c = 0; c < 3; c++)
            set.colour[c] =
                (float)fmin((double)(light->coloured ? light->colour[c] : share) * PI * distance2, 1e12);
        snprintf(name, sizeof(name), "light %zu", i + 1);
        set.name = name;
        if (!show(nff, PROTOCOL_NODE_LIGHT, import_add_light(nff->scene, &set), matrix, name))
            return false;
    }
    return true;
}

static bool finish(struct nff *nff)
{
    struct message_set_environment environment = {0};

    if (nff->shapes.sphere_count == 0 && nff->shapes.triangle_count == 0)
        return import_fail(nff->scene, NULL, "it contains nothing that can be shown");
    if (!add_lights(nff) || !nff_finish_shapes(&nff->shapes) || (nff->has_view && !add_camera(nff)))
        return false;
    if (nff->has_background) {
        for (int c = 0; c < 3; c++)
            environment.colour[c] = fminf(fmaxf(nff->background[c], 0), 1e9f);
        import_set_environment(nff->scene, &environment, 0);
    }
    return !nff->scene->failed;
}

bool nff_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes)
{
    struct nff nff = {
        .scene = scene, .line = 1, .at = (const char *)bytes, .end = (const char *)bytes + size_bytes};
    bool imported = true;

    nff.shapes.scene = scene;
    nff.shapes.polygon_budget = POLYGON_BUDGET;
    for (int c = 0; c < 3; c++) {
        nff.shapes.lower[c] = INFINITY;
        nff.shapes.upper[c] = -INFINITY;
    }
    while (imported && skip_blanks(&nff, false))
        imported = read_statement(&nff, next_word(&nff));
    imported = imported && finish(&nff);
    nff_free_shapes(&nff.shapes);
    free(nff.lights);
    free(nff.fills);
    return imported && !scene->failed;
}
