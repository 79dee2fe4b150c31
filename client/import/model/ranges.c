/* SPDX-License-Identifier: MIT */
/* Ranges of materials. */
#include "ranges.h"

#include <stdlib.h>

/* Diffuse reflectance of surfaces without a material. Bodies that reflect all light are white wherever the sky
 * lights them, and show no shape; with this grey even sunlit surfaces stay below white at the default exposure. */
#define DEFAULT_ALBEDO 0.6f

bool import_ranges_valid(const struct record_material_range *ranges, uint32_t count, uint32_t primitives)
{
    uint64_t end = 0;

    for (uint32_t i = 0; i < count; i++) {
        if (ranges[i].first < end)
            return false;
        end = (uint64_t)ranges[i].first + ranges[i].count;
        if (end > primitives)
            return false;
    }
    return count <= IMPORT_RANGES_MAX;
}

uint32_t import_ranges_merge(struct record_material_range *ranges, uint32_t count)
{
    uint32_t kept = 0;

    for (uint32_t i = 0; i < count; i++) {
        struct record_material_range *last = kept > 0 ? &ranges[kept - 1] : NULL;

        if (ranges[i].count == 0)
            continue;
        if (last && last->material == ranges[i].material && last->first + last->count == ranges[i].first)
            last->count += ranges[i].count;
        else
            ranges[kept++] = ranges[i];
    }
    return kept;
}

static uint32_t default_material(struct import_scene *scene)
{
    struct message_set_material material;

    if (scene->default_material == 0) {
        import_material_default(&material);
        for (int c = 0; c < 3; c++)
            material.value.base_colour[c] = DEFAULT_ALBEDO;
        material.value.double_sided = 1;
        material.name = "default";
        scene->default_material = import_add_material(scene, &material);
    }
    return scene->default_material;
}

/* Fills gaps between the ranges, and the end, with ranges of material 0. */
static uint32_t with_gaps(struct record_material_range *out, const struct record_material_range *ranges,
                          uint32_t count, uint32_t primitives)
{
    uint32_t end = 0, made = 0;

    for (uint32_t i = 0; i < count; i++) {
        if (ranges[i].first > end)
            out[made++] = (struct record_material_range){end, ranges[i].first - end, 0};
        out[made++] = ranges[i];
        end = ranges[i].first + ranges[i].count;
    }
    if (primitives > end)
        out[made++] = (struct record_material_range){end, primitives - end, 0};
    return import_ranges_merge(out, made);
}

bool import_ranges_fill(struct import_scene *scene, struct record_material_range **ranges, uint32_t *count,
                        uint32_t primitives)
{
    struct record_material_range *all = malloc((2 * (size_t)*count + 1) * sizeof(*all));

    if (!all)
        return import_fail(scene, NULL, "out of memory");
    const uint32_t all_count = with_gaps(all, *ranges, *count, primitives);
    if (all_count > IMPORT_RANGES_MAX) { /* primitives without a material keep the protocol's default then */
        free(all);
        return true;
    }
    for (uint32_t i = 0; i < all_count; i++)
        if (all[i].material == 0)
            all[i].material = default_material(scene);
    free(*ranges);
    *ranges = all;
    *count = all_count;
    return !scene->failed;
}
