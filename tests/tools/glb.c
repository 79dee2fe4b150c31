/* SPDX-License-Identifier: MIT */
#include "glb.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void glb_print_material(FILE *json, const struct glb_material *m)
{
    fprintf(json, "{\"name\":\"%s\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[%g,%g,%g,%g],", m->name,
            m->base_colour[0], m->base_colour[1], m->base_colour[2], m->base_colour[3]);
    fprintf(json, "\"metallicFactor\":%g,\"roughnessFactor\":%g}", m->metallic, m->roughness);
    const float strength = fmaxf(fmaxf(m->emission[0], m->emission[1]), fmaxf(m->emission[2], 1));
    fprintf(json, ",\"emissiveFactor\":[%g,%g,%g],\"extensions\":{", m->emission[0] / strength,
            m->emission[1] / strength, m->emission[2] / strength);
    fprintf(json, "\"KHR_materials_emissive_strength\":{\"emissiveStrength\":%g}", strength);
    if (m->transmission > 0) {
        fprintf(json, ",\"KHR_materials_transmission\":{\"transmissionFactor\":%g}", m->transmission);
        fprintf(json, ",\"KHR_materials_ior\":{\"ior\":%g}", m->ior);
        fprintf(json, ",\"KHR_materials_volume\":{\"thicknessFactor\":1}"); /* a body, no pane */
    }
    fprintf(json, "}}");
}

static void print_accessors(FILE *json, const struct shape *shape, size_t part, size_t *offset)
{
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < 3 * shape->vertex_count; i++) {
        lower[i % 3] = fminf(lower[i % 3], shape->positions[i]);
        upper[i % 3] = fmaxf(upper[i % 3], shape->positions[i]);
    }
    fprintf(json,
            "%s{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5126,\"count\":%u,\"type\":\"VEC3\","
            "\"min\":[%.9g,%.9g,%.9g],\"max\":[%.9g,%.9g,%.9g]},",
            part ? "," : "", *offset, shape->vertex_count, lower[0], lower[1], lower[2], upper[0], upper[1],
            upper[2]);
    const size_t vertex_bytes = (size_t)shape->vertex_count * 12;
    fprintf(json, "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5126,\"count\":%u,\"type\":\"VEC3\"},",
            *offset + vertex_bytes, shape->vertex_count);
    fprintf(json, "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5125,\"count\":%u,\"type\":\"SCALAR\"}",
            *offset + 2 * vertex_bytes, shape->index_count);
    *offset += 2 * vertex_bytes + (size_t)shape->index_count * 4;
}

void glb_look_rotation(float q[4], const struct glb_camera *camera)
{
    const float dx = camera->look_at[0] - camera->eye[0], dy = camera->look_at[1] - camera->eye[1];
    const float dz = camera->look_at[2] - camera->eye[2];
    const float yaw = atan2f(-dx, -dz), pitch = atan2f(dy, sqrtf(dx * dx + dz * dz));
    const float cy = cosf(yaw / 2), sy = sinf(yaw / 2), cp = cosf(pitch / 2), sp = sinf(pitch / 2);
    q[0] = cy * sp;
    q[1] = sy * cp;
    q[2] = -sy * sp;
    q[3] = cy * cp;
}

static void print_nodes(FILE *json, const struct glb_part *parts, size_t part_count,
                        const struct glb_light *lights, size_t light_count, const struct glb_camera *camera)
{
    fprintf(json, "\"scene\":0,\"scenes\":[{\"nodes\":[");
    for (size_t i = 0; i < part_count + light_count + 1; i++)
        fprintf(json, "%s%zu", i ? "," : "", i);
    fprintf(json, "]}],\"nodes\":[");
    for (size_t i = 0; i < part_count; i++)
        fprintf(json, "{\"name\":\"%s\",\"mesh\":%zu},", parts[i].name, i);
    for (size_t i = 0; i < light_count; i++)
        fprintf(json, "{\"translation\":[%g,%g,%g],\"extensions\":{\"KHR_lights_punctual\":{\"light\":%zu}}},",
                lights[i].position[0], lights[i].position[1], lights[i].position[2], i);
    float q[4];
    glb_look_rotation(q, camera);
    fprintf(json,
            "{\"name\":\"camera\",\"camera\":0,\"translation\":[%g,%g,%g],\"rotation\":[%.9g,%.9g,%.9g,%.9g]}],",
            camera->eye[0], camera->eye[1], camera->eye[2], q[0], q[1], q[2], q[3]);
    fprintf(json, "\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":%g,\"znear\":0.01}}],",
            camera->fov_y);
}

static void print_json(FILE *json, const struct glb_part *parts, size_t part_count, const struct glb_light *lights,
                       size_t light_count, const struct glb_camera *camera)
{
    fprintf(
        json,
        "{\"asset\":{\"version\":\"2.0\",\"generator\":\"farlight make_scenes\"},\"extensionsUsed\":["
        "\"KHR_lights_punctual\",\"KHR_materials_transmission\",\"KHR_materials_ior\",\"KHR_materials_volume\","
        "\"KHR_materials_emissive_strength\"],");
    print_nodes(json, parts, part_count, lights, light_count, camera);
    if (light_count) {
        fprintf(json, "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[");
        for (size_t i = 0; i < light_count; i++)
            fprintf(json, "%s{\"type\":\"%s\",\"color\":[%g,%g,%g],\"intensity\":%g}", i ? "," : "",
                    lights[i].kind, lights[i].colour[0], lights[i].colour[1], lights[i].colour[2],
                    lights[i].intensity);
        fprintf(json, "]}},");
    }
    fprintf(json, "\"materials\":[");
    for (size_t i = 0; i < part_count; i++) {
        fprintf(json, "%s", i ? "," : "");
        glb_print_material(json, &parts[i].material);
    }
    fprintf(json, "],\"meshes\":[");
    for (size_t i = 0; i < part_count; i++)
        fprintf(json,
                "%s{\"name\":\"%s\",\"primitives\":[{\"attributes\":{\"POSITION\":%zu,\"NORMAL\":%zu},"
                "\"indices\":%zu,\"material\":%zu}]}",
                i ? "," : "", parts[i].name, 3 * i, 3 * i + 1, 3 * i + 2, i);
    size_t offset = 0;
    fprintf(json, "],\"accessors\":[");
    for (size_t i = 0; i < part_count; i++)
        print_accessors(json, &parts[i].shape, i, &offset);
    fprintf(json, "],\"bufferViews\":[{\"buffer\":0,\"byteLength\":%zu}],\"buffers\":[{\"byteLength\":%zu}]}",
            offset, offset);
}

static void write_u32(FILE *file, size_t value)
{
    const uint8_t bytes[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16),
                              (uint8_t)(value >> 24)};
    fwrite(bytes, 1, 4, file);
}

bool glb_write_chunks(const char *path, const char *json, size_t json_bytes, const void *binary,
                      size_t binary_bytes)
{
    const size_t padding = (4 - json_bytes % 4) % 4;
    FILE *file = fopen(path, "wb");
    if (!file) {
        fprintf(stderr, "make_scenes: %s: %s\n", path, strerror(errno));
        return false;
    }
    fwrite("glTF", 1, 4, file);
    write_u32(file, 2);
    write_u32(file, 12 + 8 + json_bytes + padding + 8 + binary_bytes);
    write_u32(file, json_bytes + padding);
    fwrite("JSON", 1, 4, file);
    fwrite(json, 1, json_bytes, file);
    fwrite("   ", 1, padding, file);
    write_u32(file, binary_bytes);
    fwrite("BIN", 1, 4, file);
    fwrite(binary, 1, binary_bytes, file);
    const bool written = !ferror(file);
    if (fclose(file) != 0 || !written) {
        fprintf(stderr, "make_scenes: %s: %s\n", path, strerror(errno));
        return false;
    }
    return true;
}

bool glb_write(const char *path, const struct glb_part *parts, size_t part_count, const struct glb_light *lights,
               size_t light_count, const struct glb_camera *camera)
{
    char *text = NULL, *bytes = NULL;
    size_t text_bytes = 0, binary_bytes = 0;
    FILE *json = open_memstream(&text, &text_bytes), *binary = open_memstream(&bytes, &binary_bytes);
    bool written = json && binary;
    if (json)
        print_json(json, parts, part_count, lights, light_count, camera);
    for (size_t i = 0; i < part_count; i++) {
        const struct shape *shape = &parts[i].shape;
        written &= !shape->out_of_memory;
        if (!written)
            break;
        fwrite(shape->positions, 12, shape->vertex_count, binary);
        fwrite(shape->normals, 12, shape->vertex_count, binary);
        fwrite(shape->indices, 4, shape->index_count, binary);
    }
    if (json)
        written &= fclose(json) == 0;
    if (binary)
        written &= fclose(binary) == 0;
    if (written)
        written = glb_write_chunks(path, text, text_bytes, bytes, binary_bytes);
    else
        fprintf(stderr, "make_scenes: %s: out of memory\n", path);
    free(text);
    free(bytes);
    return written;
}
