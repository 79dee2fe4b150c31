/* SPDX-License-Identifier: MIT */
/* Alpha, tint and transmission of a point on the host, as shaders/common/alpha.glsl computes them. */
#include "trace/reference/opacity.h"

#include "trace/reference/texture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- materials ---- */

static void take_texture(struct opacity_texture *out, const struct scene *scene,
                         const struct record_texture_use *use)
{
    const struct scene_texture *texture = use->texture ? scene_texture(scene, use->texture) : NULL;
    if (!texture)
        return;
    *out = (struct opacity_texture){
        .texels = blob_ref(texture->texels),
        .width = texture->value.width,
        .height = texture->value.height,
        .is_srgb = texture->value.format == TEXTURE_RGBA8_SRGB,
        .nearest = texture->value.nearest,
        .second_set = use->texcoord_set == 1,
        .wrap_u = texture->value.wrap_u,
        .wrap_v = texture->value.wrap_v,
    };
    memcpy(out->uv_transform, use->uv_transform, sizeof(out->uv_transform));
}

static void take_material(struct opacity_material *out, const struct scene *scene, const struct scene_material *in)
{
    *out = (struct opacity_material){
        .alpha_mode = in->value.alpha_mode,
        .alpha_cutoff = in->value.alpha_cutoff,
        .transmission = in->value.transmission,
        .metallic = in->value.metallic,
    };
    memcpy(out->base_colour, in->value.base_colour, sizeof(out->base_colour));
    for (int i = 0; i < 3; i++)
        out->body_tint[i] = scene_material_body_tint(in, i);
    take_texture(&out->base_colour_texture, scene, &in->textures[MATERIAL_BASE_COLOUR]);
    take_texture(&out->transmission_texture, scene, &in->textures[MATERIAL_TRANSMISSION]);
    take_texture(&out->metallic_texture, scene, &in->textures[MATERIAL_METALLIC_ROUGHNESS]);
}

bool opacity_materials_init(struct opacity_materials *materials, const struct scene *scene,
                            const struct scene_pose *pose)
{
    size_t count = scene->objects[OBJECT_MATERIAL].count + 1, cursor = 0;
    uint64_t id;
    void *value;
    *materials = (struct opacity_materials){.list = calloc(count, sizeof(*materials->list)), .count = 1};
    bool ok = materials->list != NULL;
    while (ok && hashmap_next(&scene->objects[OBJECT_MATERIAL], &cursor, &id, &value)) {
        take_material(&materials->list[materials->count++], scene, scene_pose_material(pose, value));
        ok = hashmap_put(&materials->index_by_id, id, (void *)(uintptr_t)materials->count);
    }
    if (!ok)
        opacity_materials_finish(materials);
    return ok;
}

void opacity_materials_finish(struct opacity_materials *materials)
{
    for (uint32_t i = 0; i < materials->count && materials->list; i++) {
        blob_unref(materials->list[i].base_colour_texture.texels);
        blob_unref(materials->list[i].transmission_texture.texels);
        blob_unref(materials->list[i].metallic_texture.texels);
    }
    free(materials->list);
    hashmap_finish(&materials->index_by_id);
    *materials = (struct opacity_materials){0};
}

static bool is_cutout(const struct opacity_material *material)
{
    return material->alpha_mode == ALPHA_MASK;
}

static bool lets_light_pass(const struct opacity_material *material)
{
    return material->alpha_mode != ALPHA_OPAQUE || material->transmission > 0.0f;
}

/* ---- surfaces ---- */

/* Copies the ranges, with the default material in the gaps between them. */
static bool take_ranges(struct opacity_surface *surface, const struct record_material_range *ranges,
                        uint32_t range_count, uint32_t primitive_count)
{
    uint32_t end = 0;
    surface->runs = calloc(2 * (size_t)range_count + 1, sizeof(*surface->runs));
    if (!surface->runs)
        return false;
    for (uint32_t i = 0; i < range_count; i++) {
        if (ranges[i].count == 0)
            continue;
        if (ranges[i].first > end)
            surface->runs[surface->run_count++] = (struct opacity_run){.end = ranges[i].first};
        end = ranges[i].first + ranges[i].count;
        surface->runs[surface->run_count++] = (struct opacity_run){.end = end, .material_id = ranges[i].material};
    }
    if (end < primitive_count)
        surface->runs[surface->run_count++] = (struct opacity_run){.end = primitive_count};
    return true;
}

bool opacity_surface_init_mesh(struct opacity_surface *surface, const struct scene_mesh *mesh)
{
    *surface = (struct opacity_surface){
        .kind = OPACITY_MESH,
        .indices = blob_ref(mesh->arrays[MESH_INDICES]),
        .texcoords = {blob_ref(mesh->arrays[MESH_TEXCOORDS_0]), blob_ref(mesh->arrays[MESH_TEXCOORDS_1])},
        .colours = blob_ref(mesh->arrays[MESH_COLOURS]),
        .has_wide_colours = mesh_has_wide_colours(mesh),
    };
    return take_ranges(surface, mesh->ranges, mesh->range_count, mesh->value.triangle_count);
}

bool opacity_surface_init_spheres(struct opacity_surface *surface, const struct scene_spheres *spheres)
{
    *surface =
        (struct opacity_surface){.kind = OPACITY_SPHERES, .centres_radii = blob_ref(spheres->centres_radii)};
    return take_ranges(surface, spheres->ranges, spheres->range_count, spheres->value.sphere_count);
}

bool opacity_surface_init_discs(struct opacity_surface *surface, const struct disc *discs,
                                const uint32_t *material_ids, uint32_t count)
{
    *surface = (struct opacity_surface){
        .kind = OPACITY_DISCS,
        .runs = calloc((size_t)count + 1, sizeof(*surface->runs)),
        .run_count = count,
        .discs = malloc((size_t)count * sizeof(*discs) + 1),
    };
    if (!surface->runs || !surface->discs)
        return false;
    memcpy(surface->discs, discs, (size_t)count * sizeof(*discs));
    for (uint32_t i = 0; i < count; i++)
        surface->runs[i] = (struct opacity_run){.end = i + 1, .material_id = material_ids[i]};
    return true;
}

void opacity_surface_finish(struct opacity_surface *surface)
{
    blob_unref(surface->indices);
    blob_unref(surface->texcoords[0]);
    blob_unref(surface->texcoords[1]);
    blob_unref(surface->colours);
    blob_unref(surface->centres_radii);
    free(surface->discs);
    free(surface->runs);
    *surface = (struct opacity_surface){0};
}

void opacity_surface_bind(struct opacity_surface *surface, const struct opacity_materials *materials)
{
    surface->materials = materials;
    for (uint32_t i = 0; i < surface->run_count; i++) {
        const void *found = hashmap_get(&materials->index_by_id, surface->runs[i].material_id);
        surface->runs[i].material = found ? (uint32_t)(uintptr_t)found - 1 : 0;
    }
}

static bool some_material(const struct opacity_surface *surface, bool (*is)(const struct opacity_material *))
{
    for (uint32_t i = 0; i < surface->run_count; i++)
        if (is(&surface->materials->list[surface->runs[i].material]))
            return true;
    return false;
}

bool opacity_surface_has_cutout(const struct opacity_surface *surface)
{
    return some_material(surface, is_cutout);
}

bool opacity_surface_lets_light_pass(const struct opacity_surface *surface)
{
    return some_material(surface, lets_light_pass);
}

/* ---- points ---- */

/* The inputs of alpha and tint: texture coordinates of both sets, and the vertices' colour. */
struct attributes {
    float uv[2][2];
    float colour[4];
};

static const struct opacity_material *material_of(const struct opacity_surface *surface, uint32_t primitive)
{
    uint32_t low = 0, high = surface->run_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (surface->runs[middle - 1].end <= primitive)
            low = middle;
        else
            high = middle;
    }
    return &surface->materials->list[surface->runs[low].material];
}

/* Zero for values that are not finite, which is how gpu_scene/geometry.c uploads them. */
static float finite_or_zero(float x)
{
    return isfinite(x) ? x : 0.0f;
}

static float colour_at(const struct opacity_surface *surface, size_t place)
{
    const uint8_t *data = surface->colours->data;
    return surface->has_wide_colours ? (float)((const uint16_t *)(const void *)data)[place] / 65535.0f
                                     : (float)data[place] / 255.0f;
}

static void triangle_attributes(const struct opacity_surface *surface, const struct opacity_point *point,
                                struct attributes *out)
{
    const uint32_t *triangle =
        (const uint32_t *)(const void *)surface->indices->data + 3 * (size_t)point->primitive;
    const float weights[3] = {1.0f - point->u - point->v, point->u, point->v};
    for (int set = 0; set < 2; set++) {
        const struct blob *blob = surface->texcoords[set];
        const float *uv = blob ? (const float *)(const void *)blob->data : NULL;
        for (int i = 0; uv && i < 3; i++)
            for (size_t k = 0; k < 2; k++)
                out->uv[set][k] += weights[i] * finite_or_zero(uv[2 * (size_t)triangle[i] + k]);
    }
    if (!surface->colours)
        return;
    memset(out->colour, 0, sizeof(out->colour));
    for (int i = 0; i < 3; i++)
        for (size_t k = 0; k < 4; k++)
            out->colour[k] += weights[i] * colour_at(surface, 4 * (size_t)triangle[i] + k);
}

static void sphere_attributes(const struct opacity_surface *surface, const struct opacity_point *point,
                              struct attributes *out)
{
    const float *sphere = (const float *)(const void *)surface->centres_radii->data + 4 * (size_t)point->primitive;
    float normal[3], squared = 0.0f;
    for (int k = 0; k < 3; k++) {
        normal[k] = point->origin[k] + point->distance * point->direction[k] - sphere[k];
        squared += normal[k] * normal[k];
    }
    float y = squared > 0.0f ? normal[1] / sqrtf(squared) : 0.0f;
    out->uv[0][0] = 0.5f + atan2f(normal[0], normal[2]) * (float)(0.5 / M_PI);
    out->uv[0][1] = acosf(fminf(fmaxf(y, -1.0f), 1.0f)) * (float)(1.0 / M_PI);
    memcpy(out->uv[1], out->uv[0], sizeof(out->uv[1]));
}

/* Attributes of a disc's point, by tangent_frame() of common/math.glsl. */
static void disc_attributes(const struct opacity_surface *surface, const struct opacity_point *point,
                            struct attributes *out)
{
    const struct disc *disc = &surface->discs[point->primitive];
    const float *n = disc->normal;
    float s = n[2] >= 0.0f ? 1.0f : -1.0f, a = -1.0f / (s + n[2]), b = n[0] * n[1] * a;
    const float tangent[3] = {1.0f + s * n[0] * n[0] * a, s * b, -s * n[0]};
    const float bitangent[3] = {b, s + n[1] * n[1] * a, -n[1]};
    float along_tangent = 0.0f, along_bitangent = 0.0f;
    for (int k = 0; k < 3; k++) {
        float from_centre = point->origin[k] + point->distance * point->direction[k] - disc->centre_radius[k];
        along_tangent += from_centre * tangent[k];
        along_bitangent += from_centre * bitangent[k];
    }
    out->uv[0][0] = 0.5f + 0.5f * along_tangent / disc->centre_radius[3];
    out->uv[0][1] = 0.5f - 0.5f * along_bitangent / disc->centre_radius[3];
    memcpy(out->uv[1], out->uv[0], sizeof(out->uv[1]));
}

static struct attributes attributes_at(const struct opacity_surface *surface, const struct opacity_point *point)
{
    struct attributes out = {.colour = {1.0f, 1.0f, 1.0f, 1.0f}};
    if (surface->kind == OPACITY_MESH)
        triangle_attributes(surface, point, &out);
    else if (surface->kind == OPACITY_SPHERES)
        sphere_attributes(surface, point, &out);
    else
        disc_attributes(surface, point, &out);
    return out;
}

static void base_colour_at(const struct opacity_material *material, const struct attributes *at, float colour[4])
{
    float texel[4] = {1.0f, 1.0f, 1.0f, 1.0f};
    reference_texture_sample(&material->base_colour_texture, at->uv, texel);
    for (int k = 0; k < 4; k++)
        colour[k] = material->base_colour[k] * at->colour[k] * texel[k];
}

bool opacity_is_cut_out(const struct opacity_surface *surface, const struct opacity_point *point)
{
    const struct opacity_material *material = material_of(surface, point->primitive);
    if (!is_cutout(material))
        return false;
    const struct attributes at = attributes_at(surface, point);
    float colour[4];
    base_colour_at(material, &at, colour);
    return colour[3] < material->alpha_cutoff;
}

void opacity_transmittance(const struct opacity_surface *surface, const struct opacity_point *point, bool stops,
                           float transmittance[3])
{
    const struct opacity_material *material = material_of(surface, point->primitive);
    memset(transmittance, 0, 3 * sizeof(*transmittance));
    if (!lets_light_pass(material))
        return;
    const struct attributes at = attributes_at(surface, point);
    float colour[4], texel[4] = {1.0f, 1.0f, 1.0f, 1.0f}, metal[4] = {1.0f, 1.0f, 1.0f, 1.0f};
    base_colour_at(material, &at, colour);
    bool is_open = is_cutout(material) && colour[3] < material->alpha_cutoff;
    if (material->transmission > 0.0f)
        reference_texture_sample(&material->transmission_texture, at.uv, texel);
    if (material->transmission > 0.0f)
        reference_texture_sample(&material->metallic_texture, at.uv, metal);
    float alpha = material->alpha_mode == ALPHA_BLEND ? fminf(fmaxf(colour[3], 0.0f), 1.0f) : 1.0f;
    for (int k = 0; k < 3; k++) {
        float through = material->transmission * (1.0f - material->metallic * metal[2]) * texel[0] *
                        fminf(fmaxf(colour[k], 0.0f), 1.0f) * material->body_tint[k];
        transmittance[k] = is_open ? 1.0f : stops ? 0.0f : (1.0f - alpha) + alpha * through;
    }
}
