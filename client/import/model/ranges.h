/* SPDX-License-Identifier: MIT */
/* Ranges of primitives that share a material, and the material of all others. */
#ifndef FARLIGHT_IMPORT_MODEL_RANGES_H
#define FARLIGHT_IMPORT_MODEL_RANGES_H

#include "scene.h"

/* True if ranges ascend without overlap, end within the primitives, and are few enough. */
bool import_ranges_valid(const struct record_material_range *ranges, uint32_t count, uint32_t primitives);
/* Merges neighbouring ranges of one material and removes empty ones; returns the remaining number. */
uint32_t import_ranges_merge(struct record_material_range *ranges, uint32_t count);
/* Gives primitives without a material the scene's `default`, a light grey, which is added with the first of
 * them. `*ranges` is valid and malloc'd, and may be replaced. False: the scene has failed. */
bool import_ranges_fill(struct import_scene *scene, struct record_material_range **ranges, uint32_t *count,
                        uint32_t primitives);

#endif
