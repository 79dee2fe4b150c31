/* SPDX-License-Identifier: MIT */
/* Materials of NFF. */
#include "reader.h"

#include "import/model/edits.h"
#include "protocol/common/srgb.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static float unit(float value)
{
    return value < 0 ? 0 : value > 1 ? 1 : value;
}

bool nff_keeps_values(const struct nff *nff)
{
    return nff->scene->display_values && nff->light_count > 0;
}

float nff_colour(const struct nff *nff, float shown)
{
    return nff_keeps_values(nff) ? unit(shown) : linear_from_srgb_f(unit(shown));
}

/* The protocol's limit of a mirror's colour. */
#define SPECULAR_MAX 1000.0f

/* A mirror of NFF reflects the same share at every angle, and the surface below it scatters the rest. Fresnel's
 * curve starts at `share` for perpendicular light and would rise to 1: scaled to start at 1, it stays there,
 * and is attenuated by `share`. Reflections are sharp, as Shine only shapes highlights. */
static void mirror(struct message_set_material *material, float share)
{
    const float root = (material->value.ior - 1) / (material->value.ior + 1);

    if (share == 0 && material->value.transmission == 0) {
        material->value.ior = 1; /* reflects nothing */
        return;
    }
    material->value.roughness = 0;
    material->value.specular = share;
    for (int c = 0; c < 3; c++)
        material->value.specular_colour[c] = share > 0 ? fminf(1 / (root * root), SPECULAR_MAX) : 1;
}

/* Sets transmission. Without an index of refraction above 1, light passes straight through a thin pane. */
static void transmit(struct message_set_material *material, float through, float ior)
{
    material->value.transmission = through;
    material->value.roughness = 0;
    material->value.thin_walled = ior > 1 ? 0u : 1u;
    if (ior > 1)
        material->value.ior = fminf(ior, 10);
}

/* The colour below a mirror of this share that reflects as much in total as without it. */
static float below(float sent, float share)
{
    return share < 1 ? unit(sent / (1 - share)) : 0;
}

/* NFF's numbers are display values: a single visible component is displayed times the colour, and the mirror
 * times its reflection, which has a hue of its own. Transmitted light is not scattered, as in pictures of the
 * Standard Procedural Databases that POV-Ray makes from their author's output. */
static void from_fill(const struct nff *nff, const float n[8], struct message_set_material *material)
{
    const float share = nff_colour(nff, n[4]);
    const float through = nff_colour(nff, n[6]), sent = through + nff_colour(nff, n[3]) * (1 - through);

    if (through > 0)
        transmit(material, through / sent, n[7]);
    mirror(material, share);
    for (int c = 0; c < 3; c++)
        material->value.base_colour[c] =
            below(through > 0 ? nff_colour(nff, n[c]) * sent : nff_colour(nff, unit(n[c]) * unit(n[3])), share);
}

static size_t find_slot(const struct nff *nff, const struct nff_fill *fill)
{
    uint64_t hash = 14695981039346656037ull; /* FNV-1a */
    const unsigned char *bytes = (const unsigned char *)fill;
    size_t at;

    for (size_t i = 0; i < sizeof(*fill); i++)
        hash = (hash ^ bytes[i]) * 1099511628211ull;
    for (at = (size_t)hash & (nff->slot_count - 1); nff->slots[at] != 0; at = (at + 1) & (nff->slot_count - 1))
        if (memcmp(&nff->materials[nff->slots[at] - 1].fill, fill, sizeof(*fill)) == 0)
            break;
    return at;
}

static bool grow_slots(struct nff *nff)
{
    size_t count = nff->slot_count ? nff->slot_count * 2 : 64;
    uint32_t *slots = calloc(count, sizeof(*slots));

    if (!slots)
        return import_fail(nff->scene, NULL, "out of memory");
    free(nff->slots);
    nff->slots = slots;
    nff->slot_count = count;
    for (size_t i = 0; i < nff->material_count; i++)
        nff->slots[find_slot(nff, &nff->materials[i].fill)] = (uint32_t)i + 1;
    return true;
}

bool nff_use_fill(struct nff *nff)
{
    struct nff_material *grown;
    size_t at;

    if (nff->material_count * 2 >= nff->slot_count && !grow_slots(nff))
        return false;
    at = find_slot(nff, &nff->fill);
    if (nff->slots[at] == 0) {
        grown =
            import_grow(nff->scene, nff->materials, nff->material_count, &nff->material_capacity, sizeof(*grown));
        if (!grown)
            return false;
        nff->materials = grown;
        grown[nff->material_count].fill = nff->fill;
        snprintf(grown[nff->material_count].name, sizeof(grown->name), "fill of %.50s",
                 word_reader_where(&nff->reader));
        nff->slots[at] = (uint32_t)++nff->material_count;
    }
    nff->shapes->material = nff->slots[at];
    return true;
}

static uint32_t add_material(struct nff *nff, const struct nff_material *from)
{
    struct message_set_material material;

    import_material_default(&material);
    material.value.double_sided = 1;
    material.name = from->name;
    from_fill(nff, from->fill.numbers, &material);
    return import_add_material(nff->scene, &material);
}

bool nff_add_materials(struct nff *nff)
{
    nff->material_ids = calloc(nff->material_count + 1, sizeof(*nff->material_ids));
    if (!nff->material_ids)
        return import_fail(nff->scene, NULL, "out of memory");
    for (size_t i = 0; i < nff->material_count && !nff->scene->failed; i++)
        nff->material_ids[i + 1] = add_material(nff, &nff->materials[i]);
    return !nff->scene->failed;
}
