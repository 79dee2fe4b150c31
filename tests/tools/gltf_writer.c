/* SPDX-License-Identifier: MIT */
#include "gltf_writer.h"

#include "glb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void text_begin(struct gltf_writer *writer, struct gltf_text *text)
{
    text->stream = open_memstream(&text->text, &text->bytes);
    writer->failed |= !text->stream;
}

static bool text_end(struct gltf_text *text)
{
    if (!text->stream)
        return false;
    const bool complete = !ferror(text->stream);
    const bool closed = fclose(text->stream) == 0;
    text->stream = NULL;
    return complete && closed;
}

void gltf_begin(struct gltf_writer *writer)
{
    memset(writer, 0, sizeof(*writer));
    struct gltf_text *const texts[] = {&writer->binary, &writer->views,    &writer->accessors,
                                       &writer->meshes, &writer->samplers, &writer->channels};
    for (size_t i = 0; i < sizeof(texts) / sizeof(*texts); i++)
        text_begin(writer, texts[i]);
}

/* Bytes of its own in the file; everything here is a multiple of four long, so all of it is aligned. */
static unsigned add_view(struct gltf_writer *writer, const void *bytes, size_t count, enum gltf_use use)
{
    struct gltf_text *views = &writer->views;
    fflush(writer->binary.stream);
    fprintf(views->stream, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu", views->count ? "," : "",
            writer->binary.bytes, count);
    if (use != GLTF_NUMBERS)
        fprintf(views->stream, ",\"target\":%d", (int)use);
    fprintf(views->stream, "}");
    fwrite(bytes, 1, count, writer->binary.stream);
    return views->count++;
}

static FILE *begin_accessor(struct gltf_writer *writer, unsigned view, int component, size_t count,
                            const char *type)
{
    FILE *stream = writer->accessors.stream;
    fprintf(stream, "%s{\"bufferView\":%u,\"componentType\":%d,\"count\":%zu,\"type\":\"%s\"",
            writer->accessors.count++ ? "," : "", view, component, count, type);
    return stream;
}

static void print_numbers(FILE *stream, const char *name, const float *numbers, unsigned count)
{
    fprintf(stream, ",\"%s\":[", name);
    for (unsigned i = 0; i < count; i++)
        fprintf(stream, "%s%.9g", i ? "," : "", (double)numbers[i]);
    fprintf(stream, "]");
}

unsigned gltf_floats(struct gltf_writer *writer, const float *numbers, size_t count, unsigned width,
                     enum gltf_use use)
{
    static const char *const types[17] = {[1] = "SCALAR", [3] = "VEC3", [4] = "VEC4", [16] = "MAT4"};
    if (writer->failed)
        return 0;
    float minimum[16], maximum[16];
    for (unsigned c = 0; c < width; c++) {
        minimum[c] = INFINITY;
        maximum[c] = -INFINITY;
    }
    for (size_t i = 0; i < count * width; i++) {
        minimum[i % width] = fminf(minimum[i % width], numbers[i]);
        maximum[i % width] = fmaxf(maximum[i % width], numbers[i]);
    }
    const unsigned view = add_view(writer, numbers, count * width * sizeof(*numbers), use);
    FILE *stream = begin_accessor(writer, view, 5126, count, types[width]);
    print_numbers(stream, "min", minimum, width);
    print_numbers(stream, "max", maximum, width);
    fprintf(stream, "}");
    return writer->accessors.count - 1;
}

unsigned gltf_joints(struct gltf_writer *writer, const uint8_t (*joints)[4], size_t count)
{
    if (writer->failed)
        return 0;
    const unsigned view = add_view(writer, joints, count * sizeof(*joints), GLTF_VERTICES);
    fprintf(begin_accessor(writer, view, 5121, count, "VEC4"), "}");
    return writer->accessors.count - 1;
}

struct gltf_geometry gltf_geometry(struct gltf_writer *writer, const struct shape *shape)
{
    struct gltf_geometry result = {.joints = -1, .weights = -1};
    writer->failed |= shape->out_of_memory;
    if (writer->failed)
        return result;
    result.positions = gltf_floats(writer, shape->positions, shape->vertex_count, 3, GLTF_VERTICES);
    result.normals = gltf_floats(writer, shape->normals, shape->vertex_count, 3, GLTF_VERTICES);
    const unsigned view =
        add_view(writer, shape->indices, shape->index_count * sizeof(*shape->indices), GLTF_INDICES);
    fprintf(begin_accessor(writer, view, 5125, shape->index_count, "SCALAR"), "}");
    result.indices = writer->accessors.count - 1;
    return result;
}

unsigned gltf_mesh(struct gltf_writer *writer, const char *name, const struct gltf_geometry *geometry,
                   unsigned material)
{
    FILE *stream = writer->meshes.stream;
    if (writer->failed)
        return 0;
    fprintf(stream, "%s{\"name\":\"%s\",\"primitives\":[{\"attributes\":{\"POSITION\":%u,\"NORMAL\":%u",
            writer->meshes.count ? "," : "", name, geometry->positions, geometry->normals);
    if (geometry->joints >= 0)
        fprintf(stream, ",\"JOINTS_0\":%d,\"WEIGHTS_0\":%d", geometry->joints, geometry->weights);
    fprintf(stream, "},\"indices\":%u,\"material\":%u", geometry->indices, material);
    for (unsigned i = 0; i < geometry->target_count; i++)
        fprintf(stream, "%s{\"POSITION\":%u,\"NORMAL\":%u}", i ? "," : ",\"targets\":[", geometry->targets[i][0],
                geometry->targets[i][1]);
    fprintf(stream, "%s}]", geometry->target_count ? "]" : "");
    for (unsigned i = 0; i < geometry->target_count; i++)
        fprintf(stream, "%s0", i ? "," : ",\"weights\":[");
    fprintf(stream, "%s}", geometry->target_count ? "]" : "");
    return writer->meshes.count++;
}

void gltf_animate(struct gltf_writer *writer, unsigned node, const struct gltf_curve *curve)
{
    if (writer->failed)
        return;
    const size_t values = curve->key_count * (strcmp(curve->interpolation, "CUBICSPLINE") == 0 ? 3 : 1);
    /* The weights of a key stand one after the other. */
    const bool weights = strcmp(curve->path, "weights") == 0;
    const unsigned input = gltf_floats(writer, curve->times_s, curve->key_count, 1, GLTF_NUMBERS);
    const unsigned output = gltf_floats(writer, curve->values, values * (weights ? curve->width : 1),
                                        weights ? 1 : curve->width, GLTF_NUMBERS);
    fprintf(writer->samplers.stream, "%s{\"input\":%u,\"output\":%u,\"interpolation\":\"%s\"}",
            writer->samplers.count ? "," : "", input, output, curve->interpolation);
    fprintf(writer->channels.stream, "%s{\"sampler\":%u,\"target\":{\"node\":%u,\"path\":\"%s\"}}",
            writer->channels.count++ ? "," : "", writer->samplers.count, node, curve->path);
    writer->samplers.count++;
}

bool gltf_finish(struct gltf_writer *writer, const char *path, const char *rest)
{
    struct gltf_text *const texts[] = {&writer->binary, &writer->views,    &writer->accessors,
                                       &writer->meshes, &writer->samplers, &writer->channels};
    for (size_t i = 0; i < sizeof(texts) / sizeof(*texts); i++)
        writer->failed |= !text_end(texts[i]);
    bool written = false;
    struct gltf_text json = {0};
    if (!writer->failed)
        text_begin(writer, &json);
    if (writer->failed) {
        fprintf(stderr, "make_scenes: %s: out of memory\n", path);
    } else {
        fprintf(json.stream,
                "{\"asset\":{\"version\":\"2.0\",\"generator\":\"farlight make_scenes\"},%s,"
                "\"animations\":[{\"name\":\"ride\",\"samplers\":[%s],\"channels\":[%s]}],\"meshes\":[%s],"
                "\"accessors\":[%s],\"bufferViews\":[%s],\"buffers\":[{\"byteLength\":%zu}]}",
                rest, writer->samplers.text, writer->channels.text, writer->meshes.text, writer->accessors.text,
                writer->views.text, writer->binary.bytes);
        if (text_end(&json))
            written = glb_write_chunks(path, json.text, json.bytes, writer->binary.text, writer->binary.bytes);
        else
            fprintf(stderr, "make_scenes: %s: out of memory\n", path);
    }
    free(json.text);
    for (size_t i = 0; i < sizeof(texts) / sizeof(*texts); i++)
        free(texts[i]->text);
    return written;
}
