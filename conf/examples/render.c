/* SPDX-License-Identifier: MIT */
/* Renders a model into a PNG file with libfarlight.
 *
 *   cc render.c $(pkg-config --cflags --libs farlight) -o render
 *   ./render model.glb picture.png [unix:/run/farlight/farlight.sock]
 *
 * Without an address the library starts a daemon for itself. */
#include <farlight/client.h>

#include <stdio.h>

static int failed(const struct fl_error *error)
{
    char line[1200];
    fl_error_print(error, line, sizeof(line));
    fprintf(stderr, "render: %s\n", line);
    return 1;
}

/* The exporter may write into this folder only. Writes nothing where there is no frame. */
static bool write_picture(const struct fl_frame *frame, const char *path, struct fl_error *error)
{
    const struct fl_exporter_options options = {.folder = "."};
    const struct fl_export_options picture = {.path = path};
    struct fl_exporter *exporter = fl_exporter_start(&options, error);
    const bool good =
        exporter && fl_exporter_write(exporter, frame, &picture, error) && fl_exporter_wait(exporter, error);
    fl_exporter_destroy(exporter);
    return good;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: render MODEL PICTURE.png [ADDRESS]\n");
        return 2;
    }
    const struct fl_connect_options connect = {.server = argc > 3 ? argv[3] : NULL, .name = "example"};
    const struct fl_load_options load = {.model = argv[1]};
    struct message_render options = fl_render_defaults(); /* every field: farlight/protocol/messages.def */
    struct fl_error error = {0};
    options.picture.width = 160;
    options.picture.height = 120;
    options.sampling.samples = 4;

    struct fl_connection *connection = fl_connect(&connect, &error);
    struct fl_scene *scene = connection ? fl_scene_load(connection, &load, &error) : NULL;
    const struct fl_camera_info *camera = scene ? fl_scene_camera(scene, 0) : NULL;
    if (camera) { /* without one the scene is seen from its front */
        options.camera.camera_path = PROTOCOL_CAMERA_NODE;
        options.camera.camera_node = camera->node;
    }
    struct fl_job *job = scene ? fl_render_start(scene, &options, &error) : NULL;
    struct fl_frame *frame = job ? fl_render_next(job, &error) : NULL;
    const bool good = frame && write_picture(frame, argv[2], &error);
    if (good)
        printf("%ux%u, %u samples\n", frame->width, frame->height, frame->samples);

    fl_frame_destroy(frame);
    fl_render_destroy(job);
    fl_scene_destroy(scene);
    fl_connection_destroy(connection);
    return good ? 0 : failed(&error);
}
