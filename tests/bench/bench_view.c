/* SPDX-License-Identifier: MIT */
/* Views of a daemon while their cameras move, frame by frame. Usage: see `usage` below.
 *
 * Each viewer has a connection of its own; the first one loads the model, the others come to that scene. After a
 * second of motion it is measured. Prints JSON: "threads_ns", what each thread of the process --pid took of a
 * processor meanwhile, by its name; "batch_frames", of the job beside; "late_ns", by how much each sleep of this
 * process ended late, which is what the machine does to whoever waits; and "frames", an array for each of
 * "columns". Times are nanoseconds of the host's monotonic clock, which the daemon must share where they are its
 * own: received, applied, rendered; encode_begin is since applied. */
#include "tests/bench/bench.h"

#include "lib/farlight.h"
#include "viewer/input/camera.h"
#include "viewer/view/decode.h"
#include "protocol/common/clock.h"

#include <dirent.h>
#include <getopt.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define VIEWERS_MAX 256u
#define LOOKS_REMEMBERED 32768u
#define SECOND_NS UINT64_C(1000000000)
#define WARM_UP_NS SECOND_NS
#define FIRST_MS 300000u /* the first picture builds and compiles */
#define SWAY_RADIANS 0.5
#define DEPTH 4u /* bounces */
#define SWAY_SECONDS 4.0
#define SCENE_NAME "bench"
#define TAU 6.283185307179586

static const char usage[] =
    "usage: bench view ADDRESS MODEL [options]\n"
    "  --size WxH        default 1280x720\n"
    "  --encoding E      raw, zstd, jpeg, h264 or predicted; default jpeg\n"
    "  --seconds S       default 5\n"
    "  --rate FPS        what is asked for; default 1000\n"
    "  --looks N         cameras a second; 0: one once the last one is shown; default 1000\n"
    "  --viewers N       default 1\n"
    "  --weight N        of each viewer; default: the daemon's\n"
    "  --adapt           quality and size follow the link\n"
    "  --batch           another client has a batch job rendered meanwhile\n"
    "  --environment F   of the model\n"
    "  --key FILE        the daemon's key\n"
    "  --pid N           the daemon's process\n";

struct options {
    const char *address, *model, *environment, *key;
    uint32_t width, height, encoding, looks, viewers, weight, pid;
    double seconds, rate;
    bool adapt, batch;
};

struct viewer {
    struct fl_connection *connection;
    struct fl_scene *scene;
    struct fl_view *view;
    struct viewer_camera camera; /* where it rests */
    uint64_t next_look_ns, last_command, shown_command;
    uint64_t sent_ns[LOOKS_REMEMBERED]; /* send times of commands, modulo: more than the library remembers */
    struct decoder *decoder;
    struct pixmap picture;
};

static struct viewer viewers[VIEWERS_MAX];
static struct options options = {.width = 1280,
                                 .height = 720,
                                 .encoding = PROTOCOL_ENCODING_JPEG,
                                 .looks = 1000,
                                 .viewers = 1,
                                 .seconds = 5,
                                 .rate = 1000};

/* ---- what the daemon's threads take ------------------------------------------------------------------ */

static bool read_line(const char *task, const char *file, char *line, int line_bytes)
{
    char path[300];
    snprintf(path, sizeof(path), "/proc/%" PRIu32 "/task/%.32s/%s", options.pid, task, file);
    FILE *from = fopen(path, "r");
    bool read = from && fgets(line, line_bytes, from);
    if (from)
        fclose(from);
    return read;
}

/* Adds `sign` times what each took so far. */
static void add_threads(json_t *threads, int sign)
{
    char folder[64], name[64], times[128];
    snprintf(folder, sizeof(folder), "/proc/%" PRIu32 "/task", options.pid);
    DIR *tasks = options.pid ? opendir(folder) : NULL;
    for (struct dirent *task; tasks && (task = readdir(tasks));) {
        if (task->d_name[0] == '.' || !read_line(task->d_name, "comm", name, sizeof(name)) ||
            !read_line(task->d_name, "schedstat", times, sizeof(times)))
            continue;
        name[strcspn(name, "\n")] = '\0';
        json_int_t taken_ns = sign * (json_int_t)strtoull(times, NULL, 10);
        json_object_set_new(threads, name,
                            json_integer(json_integer_value(json_object_get(threads, name)) + taken_ns));
    }
    if (tasks)
        closedir(tasks);
}

/* ---- frames ------------------------------------------------------------------------------------------ */

static const char *const columns[] = {"viewer",   "command", "width",    "height", "bytes",        "sent",
                                      "received", "applied", "rendered", "stages", "encode_begin", "encode",
                                      "queue",    "send",    "begun",    "whole",  "decode"};

static bool is_of_renderer(enum protocol_stage stage)
{
    return stage <= PROTOCOL_STAGE_READBACK;
}

static json_t *row_of(const struct fl_frame *frame, const struct viewer *viewer, uint64_t whole_ns,
                      uint64_t decode_ns)
{
    uint64_t rendering_ns = 0, encode_begin_ns = 0, taken_ns[PROTOCOL_STAGE_COUNT] = {0};
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *stage = &frame->stages[i];
        if (stage->clock != PROTOCOL_CLOCK_CPU)
            continue;
        taken_ns[stage->stage] += stage->duration_ns;
        rendering_ns += is_of_renderer(stage->stage) ? stage->duration_ns : 0;
        encode_begin_ns = stage->stage == PROTOCOL_STAGE_ENCODE ? stage->start_ns : encode_begin_ns;
    }
    const uint64_t values[] = {(uint64_t)(viewer - viewers),
                               frame->command,
                               frame->width,
                               frame->height,
                               frame->wire_bytes,
                               viewer->sent_ns[frame->command % LOOKS_REMEMBERED],
                               frame->command_received_ns,
                               frame->command_applied_ns,
                               frame->rendered_ns,
                               rendering_ns,
                               encode_begin_ns,
                               taken_ns[PROTOCOL_STAGE_ENCODE],
                               taken_ns[PROTOCOL_STAGE_QUEUE],
                               taken_ns[PROTOCOL_STAGE_SEND],
                               frame->begun_ns,
                               whole_ns,
                               decode_ns};
    _Static_assert(sizeof(values) / sizeof(values[0]) == sizeof(columns) / sizeof(columns[0]), "a value for each");
    json_t *row = json_array();
    for (size_t i = 0; i < sizeof(values) / sizeof(values[0]); i++)
        json_array_append_new(row, json_integer((json_int_t)values[i]));
    return row;
}

static bool take_frame(struct viewer *viewer, struct fl_frame *frame, json_t *rows, struct fl_error *error)
{
    uint64_t whole_ns = frame->whole_ns, decode_ns = frame->decode_ns;
    viewer->shown_command = frame->command;
    if (frame->encoded) {
        const uint64_t begin_ns = monotonic_now_ns();
        if (!decoder_decode(viewer->decoder, frame, &viewer->picture, error))
            return false;
        whole_ns = monotonic_now_ns();
        decode_ns += whole_ns - begin_ns;
    }
    if (rows && frame->command)
        json_array_append_new(rows, row_of(frame, viewer, whole_ns, decode_ns));
    fl_frame_destroy(frame);
    return true;
}

/* ---- motion ------------------------------------------------------------------------------------------ */

static bool look(struct viewer *viewer, uint64_t now, struct fl_error *error)
{
    const double phase = TAU * (double)now / (double)SECOND_NS / SWAY_SECONDS;
    struct viewer_camera camera = viewer->camera;
    struct fl_view_camera seen = {.moving = true};
    camera_orbit(&camera, SWAY_RADIANS * sin(phase), SWAY_RADIANS / 4 * cos(phase));
    camera_export(&camera, &seen);
    viewer->sent_ns[(viewer->last_command + 1) % LOOKS_REMEMBERED] = monotonic_now_ns();
    return fl_view_set_camera(viewer->view, &seen, &viewer->last_command, error);
}

/* Sends the camera if it is time for one, and takes what has come. */
static bool serve(struct viewer *viewer, json_t *rows, struct fl_error *error)
{
    struct fl_frame *frame;
    while ((frame = fl_view_next(viewer->view, 0, error)))
        if (!take_frame(viewer, frame, rows, error))
            return false;
    if (error->code != FL_ERROR_NONE)
        return false;
    const uint64_t now = monotonic_now_ns();
    if (options.looks ? now < viewer->next_look_ns : viewer->shown_command < viewer->last_command)
        return true;
    const uint64_t interval_ns = options.looks ? SECOND_NS / options.looks : 0;
    viewer->next_look_ns += interval_ns;
    if (viewer->next_look_ns < now)
        viewer->next_look_ns = now + interval_ns;
    return look(viewer, now, error);
}

/* *batch_frames (may be NULL) counts. */
static bool serve_batch(struct fl_job *batch, json_int_t *frames, struct fl_error *error)
{
    struct fl_frame *frame;
    bool done = false;
    while (batch && (frame = fl_render_poll(batch, 0, &done, error))) {
        fl_frame_destroy(frame);
        ++*frames;
    }
    return error->code == FL_ERROR_NONE;
}

/* Adds to `late` if nothing came. */
static void wait_for_more(int batch_fd, json_t *late)
{
    struct pollfd watched[VIEWERS_MAX + 1];
    uint64_t due_ns = UINT64_MAX;
    for (uint32_t i = 0; i < options.viewers; i++) {
        watched[i] = (struct pollfd){.fd = fl_connection_fd(viewers[i].connection), .events = POLLIN};
        if (options.looks && viewers[i].next_look_ns < due_ns)
            due_ns = viewers[i].next_look_ns;
    }
    watched[options.viewers] = (struct pollfd){.fd = batch_fd, .events = POLLIN};
    const uint64_t now = monotonic_now_ns(), wait_ns = due_ns > now ? due_ns - now : 0;
    const struct timespec wait = {.tv_sec = wait_ns < SECOND_NS ? 0 : 1,
                                  .tv_nsec = wait_ns < SECOND_NS ? (long)wait_ns : 0};
    if (ppoll(watched, options.viewers + 1, &wait, NULL) == 0 && wait_ns > 0)
        json_array_append_new(late, json_integer((json_int_t)(monotonic_now_ns() - due_ns)));
}

static bool move_for(uint64_t duration_ns, struct fl_connection *beside, struct fl_job *batch, json_t *rows,
                     json_t *late, json_int_t *batch_frames, struct fl_error *error)
{
    const uint64_t end_ns = monotonic_now_ns() + duration_ns;
    *batch_frames = 0;
    while (monotonic_now_ns() < end_ns) {
        for (uint32_t i = 0; i < options.viewers; i++)
            if (!serve(&viewers[i], rows, error))
                return false;
        if (!serve_batch(batch, batch_frames, error))
            return false;
        wait_for_more(beside ? fl_connection_fd(beside) : -1, late);
    }
    return true;
}

/* ---- coming and going -------------------------------------------------------------------------------- */

static bool come(struct viewer *viewer, struct fl_error *error)
{
    const bool is_first = viewer == viewers, is_alone = options.viewers == 1;
    viewer->connection =
        fl_connect(&(struct fl_connect_options){.server = options.address,
                                                .name = "bench_view",
                                                .key_file = options.key,
                                                .can_h264 = options.encoding == PROTOCOL_ENCODING_H264},
                   error);
    if (!viewer->connection)
        return false;
    if (options.encoding == PROTOCOL_ENCODING_H264) {
        if (!fl_connection_can_h264(viewer->connection))
            return fl_error_set(error, FL_ERROR_ARGUMENT, "--encoding", "the daemon has no encoder for H.264");
        if (!(viewer->decoder = decoder_create(error)))
            return false;
    }
    const struct fl_load_options load = {.model = options.model,
                                         .environment = options.environment,
                                         .sharing = is_alone ? PROTOCOL_SHARING_PRIVATE : PROTOCOL_SHARING_SHARED,
                                         .scene_name = SCENE_NAME};
    viewer->scene = is_first ? fl_scene_load(viewer->connection, &load, error)
                             : fl_scene_attach(viewer->connection, SCENE_NAME, error);
    return viewer->scene != NULL;
}

/* Until its first picture, from which it takes where it stands. */
static bool begin_view(struct viewer *viewer, struct fl_error *error)
{
    struct message_render terms = fl_view_defaults();
    terms.picture.width = options.width;
    terms.picture.height = options.height;
    terms.sampling.samples = 1;
    terms.light.depth = DEPTH;
    terms.encoding = (enum protocol_encoding)options.encoding;
    terms.frames_per_second = (float)options.rate;
    terms.view.still_encoding = terms.encoding;
    terms.weight = options.weight;
    terms.view.adapt = options.adapt;
    struct fl_scene_bounds bounds;
    viewer->view = fl_view_start(viewer->scene, &terms, error);
    struct fl_frame *frame = viewer->view ? fl_view_next(viewer->view, FIRST_MS, error) : NULL;
    if (!frame && error->code == FL_ERROR_NONE)
        return fl_error_set(error, FL_ERROR_TIMEOUT, "", "there was no first picture");
    if (!frame || !fl_scene_get_bounds(viewer->scene, &bounds, error)) {
        fl_frame_destroy(frame);
        return false;
    }
    double square = 0;
    for (int i = 0; i < 3; i++)
        square += pow((double)bounds.upper_world[i] - (double)bounds.lower_world[i], 2);
    camera_from_frame(&viewer->camera, frame, fmax(sqrt(square), 1e-3));
    return take_frame(viewer, frame, NULL, error);
}

/* Frame after frame, for as long as anybody measures. */
static struct fl_job *begin_batch(struct viewer *beside, struct fl_error *error)
{
    struct message_render job = fl_render_defaults();
    job.picture.width = 640;
    job.picture.height = 480;
    job.sampling.samples = job.light.depth = 4;
    job.last_frame = 1000000;
    job.encoding = PROTOCOL_ENCODING_JPEG;
    beside->connection =
        fl_connect(&(struct fl_connect_options){.server = options.address, .key_file = options.key}, error);
    if (beside->connection)
        beside->scene = fl_scene_load(
            beside->connection,
            &(struct fl_load_options){.model = options.model, .environment = options.environment}, error);
    return beside->scene ? fl_render_start(beside->scene, &job, error) : NULL;
}

static void go(struct viewer *viewer)
{
    fl_view_destroy(viewer->view);
    fl_scene_destroy(viewer->scene);
    fl_connection_destroy(viewer->connection);
    decoder_destroy(viewer->decoder);
    pixmap_finish(&viewer->picture);
}

static bool measure(json_t *result, struct fl_error *error)
{
    struct viewer beside = {0};
    struct fl_job *batch = NULL;
    json_t *threads = json_object(), *rows = json_array(), *late = json_array();
    json_int_t batch_frames = 0;
    bool ok = true;
    for (uint32_t i = 0; ok && i < options.viewers; i++)
        ok = come(&viewers[i], error);
    for (uint32_t i = 0; ok && i < options.viewers; i++)
        ok = begin_view(&viewers[i], error);
    ok = ok && (!options.batch || (batch = begin_batch(&beside, error))) &&
         move_for(WARM_UP_NS, beside.connection, batch, NULL, late, &batch_frames, error);
    json_array_clear(late);
    add_threads(threads, -1);
    ok = ok && move_for((uint64_t)(options.seconds * (double)SECOND_NS), beside.connection, batch, rows, late,
                        &batch_frames, error);
    add_threads(threads, 1);
    fl_render_destroy(batch);
    go(&beside);
    for (uint32_t i = options.viewers; i-- > 0;)
        go(&viewers[i]);
    json_object_set_new(result, "threads_ns", threads);
    json_object_set_new(result, "batch_frames", json_integer(batch_frames));
    json_object_set_new(result, "late_ns", late);
    json_object_set_new(result, "frames", rows);
    return ok;
}

/* ---- command line ------------------------------------------------------------------------------------ */

static bool parse_number(const char *text, uint32_t minimum, uint32_t maximum, uint32_t *value)
{
    char *end;
    const unsigned long parsed = strtoul(text, &end, 10);
    *value = (uint32_t)parsed;
    return *text >= '0' && *text <= '9' && *end == '\0' && parsed >= minimum && parsed <= maximum;
}

static bool parse_real(const char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && *end == '\0' && *value > 0 && *value < 1e5;
}

static bool parse_encoding(const char *text)
{
    for (options.encoding = 0; options.encoding < PROTOCOL_ENCODING_COUNT; options.encoding++)
        if (strcmp(text, protocol_encoding_text((enum protocol_encoding)options.encoding)) == 0)
            return true;
    return false;
}

static bool parse_option(int option, const char *text)
{
    char rest;
    switch (option) {
    case 's':
        return sscanf(text, "%" SCNu32 "x%" SCNu32 "%c", &options.width, &options.height, &rest) == 2;
    case 'e':
        return parse_encoding(text);
    case 't':
        return parse_real(text, &options.seconds);
    case 'r':
        return parse_real(text, &options.rate);
    case 'l':
        return parse_number(text, 0, 10000, &options.looks);
    case 'n':
        return parse_number(text, 1, VIEWERS_MAX, &options.viewers);
    case 'w':
        return parse_number(text, 1, 16, &options.weight);
    case 'p':
        return parse_number(text, 1, INT32_MAX, &options.pid);
    case 'a':
        return options.adapt = true;
    case 'b':
        return options.batch = true;
    case 'v':
        options.environment = text;
        return true;
    case 'k':
        options.key = text;
        return true;
    default:
        return false;
    }
}

static bool parse(int argc, char **argv)
{
    static const struct option known[] = {
        {"size", 1, NULL, 's'},   {"encoding", 1, NULL, 'e'}, {"seconds", 1, NULL, 't'},
        {"rate", 1, NULL, 'r'},   {"looks", 1, NULL, 'l'},    {"viewers", 1, NULL, 'n'},
        {"weight", 1, NULL, 'w'}, {"adapt", 0, NULL, 'a'},    {"batch", 0, NULL, 'b'},
        {"key", 1, NULL, 'k'},    {"pid", 1, NULL, 'p'},      {"environment", 1, NULL, 'v'},
        {NULL, 0, NULL, 0},
    };
    int option;
    while ((option = getopt_long(argc, argv, "", known, NULL)) != -1)
        if (!parse_option(option, optarg))
            return false;
    if (argc - optind != 2)
        return false;
    options.address = argv[optind];
    options.model = argv[optind + 1];
    return true;
}

BENCH(view)
{
    if (!parse(argc, argv)) {
        fputs(usage, stderr);
        return 2;
    }
    struct fl_error error = {0};
    json_t *result = json_object(), *names = json_array();
    for (size_t i = 0; i < sizeof(columns) / sizeof(columns[0]); i++)
        json_array_append_new(names, json_string(columns[i]));
    json_object_set_new(result, "columns", names);
    bool ok = measure(result, &error);
    if (ok) {
        ok = json_dumpf(result, stdout, 0) == 0 && putchar('\n') == '\n' && fflush(stdout) == 0;
    } else {
        char line[1200];
        fl_error_print(&error, line, sizeof(line));
        fprintf(stderr, "bench view: %s\n", line);
    }
    json_decref(result);
    return ok ? 0 : 1;
}
