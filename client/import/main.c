/* SPDX-License-Identifier: MIT */
/* farlight-import: turns a model file into the protocol's messages and sends them over a socket that its parent
 * has connected. It is a program of its own so that nothing else links the libraries that read hostile files,
 * and so that it can give up its rights beforehand. */
#include "import/assimp/import.h"
#include "import/gltf/import.h"
#include "import/nff/import.h"
#include "import/obj/import.h"
#include "import/model/scene.h"
#include "helper/module.h"
#include "helper/sandbox.h"
#include "import/model/edits.h"
#include "import/model/origin.h"
#include "send.h"
#include "sky.h"
#include "source.h"
#include "import/image/texture.h"
#include "import/threemf/import.h"
#include "protocol/common/clock.h"
#include "protocol/version.h"

#include <argp.h>
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define EXIT_USAGE 2
#define CPU_SECONDS_MAX 300

/* argp finds this variable by name, despite our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-import " FARLIGHT_VERSION;

struct options {
    int socket;
    uint32_t scene;
    const char *environment;
    double environment_degrees;
    const char *variant;
    double point_size; /* 0: chosen by the points */
    bool no_model, no_sky;
    struct source *sources;
    size_t source_count;
};

#define RADIANS_PER_DEGREE 0.017453292519943295

enum {
    OPTION_FD = 256,
    OPTION_SCENE,
    OPTION_ENVIRONMENT,
    OPTION_ROTATION,
    OPTION_VARIANT,
    OPTION_POINT_SIZE,
    OPTION_NO_MODEL,
    OPTION_AT,
    OPTION_FORMAT,
    OPTION_NO_SKY
};

static const struct argp_option option_rows[] = {
    {"fd", OPTION_FD, "N", 0, "use this connected stream socket (required)", 0},
    {"scene", OPTION_SCENE, "ID", 0, "edit this scene (default 1)", 0},
    {"environment", OPTION_ENVIRONMENT, "FILE", 0, "light the scene with this equirectangular image, HDR or EXR",
     0},
    {"environment-rotation", OPTION_ROTATION, "DEGREES", 0,
     "turn it about +y by -360 to 360 (default 0: its middle column is +x)", 0},
    {"variant", OPTION_VARIANT, "NAME", 0, "show the materials of this variant of a glTF model", 0},
    {"point-size", OPTION_POINT_SIZE, "METRES", 0,
     "show points as spheres, and lines as tubes, of this diameter (default: by their distances)", 0},
    {"at", OPTION_AT, "X,Y,Z[:RX,RY,RZ[:SCALE]]", 0,
     "place the MODEL named before: metres, degrees about x, then y, then z, and a factor", 0},
    {"format", OPTION_FORMAT, "NAME", 0,
     "read the MODEL named before as such a file, for example glb (default: by its name, else its first bytes)",
     0},
    {"no-sky", OPTION_NO_SKY, NULL, 0, "add no sky to models with lights (default: a sky, but not in rooms)", 0},
    {"no-model", OPTION_NO_MODEL, NULL, 0, "send the environment only; MODEL is not needed", 0},
    {0}};

static uint32_t parse_number(struct argp_state *state, const char *name, const char *text, uint32_t minimum)
{
    char *end;
    unsigned long value;

    errno = 0;
    value = strtoul(text, &end, 10);
    if (errno != 0 || end == text || *end != '\0' || text[0] == '-' || value < minimum || value > INT32_MAX)
        argp_error(state, "--%s: '%s' is not a whole number from %u", name, text, minimum);
    return (uint32_t)value;
}

static double parse_degrees(struct argp_state *state, const char *text)
{
    char *end;
    const double degrees = strtod(text, &end);

    if (end == text || *end != '\0' || !(fabs(degrees) <= 360))
        argp_error(state, "--environment-rotation: '%s' is not a number from -360 to 360", text);
    return degrees;
}

static double parse_point_size(struct argp_state *state, const char *text)
{
    char *end;
    const double size = strtod(text, &end);

    if (end == text || *end != '\0' || !(size > 0 && size <= 1e6))
        argp_error(state, "--point-size: '%s' is not a number above 0, up to 1e6", text);
    return size;
}

static void add_source(struct argp_state *state, struct options *options, const char *path)
{
    if (options->source_count == SOURCES_MAX)
        argp_error(state, "more than %d models", SOURCES_MAX);
    options->sources[options->source_count++] =
        (struct source){.path = path, .scale = 1, .files = {.folder = -1, .model = -1, .environment = -1}};
}

static struct source *last_source(struct argp_state *state, struct options *options, const char *option)
{
    if (options->source_count == 0)
        argp_error(state, "--%s: no MODEL is named before it", option);
    return &options->sources[options->source_count - 1];
}

static error_t parse_option(int key, char *argument, struct argp_state *state)
{
    struct options *options = state->input;

    switch (key) {
    case OPTION_FD:
        options->socket = (int)parse_number(state, "fd", argument, 0);
        return 0;
    case OPTION_SCENE:
        options->scene = parse_number(state, "scene", argument, 1);
        return 0;
    case OPTION_ENVIRONMENT:
        options->environment = argument;
        return 0;
    case OPTION_ROTATION:
        options->environment_degrees = parse_degrees(state, argument);
        return 0;
    case OPTION_VARIANT:
        options->variant = argument;
        return 0;
    case OPTION_POINT_SIZE:
        options->point_size = parse_point_size(state, argument);
        return 0;
    case OPTION_NO_MODEL:
        options->no_model = true;
        return 0;
    case OPTION_AT:
        if (!source_place(last_source(state, options, "at"), argument))
            argp_error(state, "--at: '%s' is not X,Y,Z, X,Y,Z:RX,RY,RZ or X,Y,Z:RX,RY,RZ:SCALE", argument);
        return 0;
    case OPTION_FORMAT:
        last_source(state, options, "format")->format = argument;
        return 0;
    case OPTION_NO_SKY:
        options->no_sky = true;
        return 0;
    case ARGP_KEY_ARG:
        add_source(state, options, argument);
        return 0;
    case ARGP_KEY_END:
        if (options->socket < 0)
            argp_error(state, "--fd is missing: this program is started by the client");
        if (options->no_model)
            options->source_count = 0;
        else if (options->source_count == 0)
            argp_error(state, "MODEL is missing");
        if (options->source_count == 0 && !options->environment)
            argp_error(state, "give MODEL or --environment");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static const char *file_part(const char *path)
{
    const char *slash = strrchr(path, '/');

    return slash && slash[1] ? slash + 1 : path;
}

/* Silences the libraries, which write to standard error on their own; anything important is sent as a note.
 * Reports of sanitizers must stay visible. */
static void silence_libraries(void)
{
#if !defined(__SANITIZE_ADDRESS__)
    if (!freopen("/dev/null", "w", stderr))
        fclose(stderr);
#endif
}

/* The parent waits for the end of this process, so memory is not freed and the destructors of some hundred
 * libraries do not run. The leak checker needs both. */
static void leave_at_once(int status)
{
#if !defined(__SANITIZE_ADDRESS__)
    _exit(status);
#else
    (void)status;
#endif
}

/* Enters the sandbox, which allows the folders of all models and of the modules, which are loaded when needed. */
static bool enter_sandbox(struct import_scene *scene, const struct options *options)
{
    char *folders[SOURCES_MAX + 1] = {NULL};
    const size_t folder_count = options->source_count + 1;
    struct sandbox_options sandbox = {.read_folders = (const char *const *)folders,
                                      .read_folder_count = folder_count,
                                      .cpu_seconds = CPU_SECONDS_MAX};
    char reason[256];
    bool entered;

    for (size_t i = 0; i < options->source_count; i++) {
        const struct source *source = &options->sources[i];

        if (source->files.folder >= 0)
            folders[i] = files_folder_of(source->path);
    }
    folders[folder_count - 1] = module_folder(TEXTURE_MODULE);
    entered = sandbox_enter(&sandbox, reason, sizeof(reason));
    for (size_t i = 0; i < folder_count; i++)
        free(folders[i]);
    if (!entered)
        return import_fail(scene, NULL, "the sandbox cannot be entered: %s", reason);
    if (reason[0])
        import_note(scene, PROTOCOL_SEVERITY_WARNING, NULL, "%s", reason);
    return true;
}

static bool parse_model(struct import_scene *scene, struct source *source)
{
    const unsigned char *bytes = source->bytes;
    const size_t size_bytes = source->size_bytes;
    char reason[FORMAT_REASON_BYTES];

    if (size_bytes == 0)
        return import_fail(scene, NULL, "the file is empty");
    if (source->of.reader == FORMAT_GLTF)
        return gltf_import(scene, &source->files, bytes, size_bytes);
    if (scene->variant)
        return import_fail(scene, NULL, "only glTF has variants, so none can be called '%.100s'", scene->variant);
    switch (source->of.reader) {
    case FORMAT_OBJ:
        return obj_import(scene, &source->files, bytes, size_bytes);
    case FORMAT_NFF:
        return nff_import(scene, bytes, size_bytes);
    case FORMAT_3MF:
        return threemf_import(scene, bytes, size_bytes);
    case FORMAT_ASSIMP:
        return assimp_import(scene, &source->files, source->of.assimp, bytes, size_bytes);
    default:
        format_explain_unknown(source_name(source), source->format, bytes, size_bytes, reason);
        return import_fail(scene, NULL, "%s", reason);
    }
}

/* The protocol's middle column is -z. */
static float turn_of(double degrees)
{
    return (float)((degrees - 90) * RADIANS_PER_DEGREE);
}

static bool import_environment(struct import_scene *scene, struct files *files, const char *file, double degrees)
{
    struct message_set_environment environment = {.value.colour = {1, 1, 1}, .value.rotation = turn_of(degrees)};
    struct texture_job job = {0};
    char reason[FILES_REASON_BYTES] = "";
    unsigned char *bytes = files_read_descriptor(files, files->environment, &job.size_bytes, reason);

    if (!bytes)
        return import_fail(scene, file, "%s", reason);
    job.bytes = bytes;
    texture_decode_environment(&job);
    free(bytes);
    if (!job.texels)
        return import_fail(scene, file, "the environment cannot be read: %s", job.reason);
    if (job.reduced > 1) {
        char text[200];

        texture_explain_reduction(&job, text);
        import_note(scene, PROTOCOL_SEVERITY_WARNING, file, "%s", text);
    }
    if (job.width != 2 * job.height)
        import_note(scene, PROTOCOL_SEVERITY_INFO, file,
                    "is %u x %u; an equirectangular image is twice as wide as high", job.width, job.height);
    environment.value.width = job.width;
    environment.value.height = job.height;
    import_set_environment(scene, &environment,
                           import_add_blob(scene, job.texels, (uint64_t)job.width * job.height * 8));
    return !scene->failed;
}

/* Counts surfaces and lights; cameras and nodes alone show nothing. */
static uint32_t count_shown(const struct import_scene *scene)
{
    return scene->last_id[PROTOCOL_OBJECT_MESH] + scene->last_id[PROTOCOL_OBJECT_SPHERES] +
           scene->last_id[PROTOCOL_OBJECT_LIGHT];
}

static const char *first_warning(const struct import_scene *scene)
{
    for (size_t i = 0; i < scene->note_count; i++)
        if (scene->notes[i].severity == PROTOCOL_SEVERITY_WARNING)
            return scene->notes[i].text;
    return "";
}

static bool import_model(struct import_scene *scene, struct sender *sender, const struct options *options,
                         size_t index)
{
    struct source *source = &options->sources[index];
    const uint32_t shown = count_shown(scene);
    bool imported;

    if (!sender_progress(sender, source->size_bytes, 0, "parsing"))
        return false;
    scene->variant = index == 0 ? options->variant : NULL;
    scene->point_size = options->point_size;
    if (source_repeat(scene, options->sources, index, options->source_count))
        return !scene->failed;
    imported = source_begin(scene, options->sources, index, options->source_count) && parse_model(scene, source);
    if (imported && count_shown(scene) == shown) {
        static const char nothing[] = "it contains nothing that can be shown";
        const char *why = first_warning(scene);

        if (options->source_count == 1)
            imported = import_fail(scene, NULL, "%s%s%s", nothing, why[0] != '\0' ? ": " : "", why);
        else
            import_note(scene, PROTOCOL_SEVERITY_WARNING, NULL, "%s", nothing);
    }
    source_end(scene, source);
    return imported;
}

static bool import_all(struct import_scene *scene, struct files *surroundings, struct sender *sender,
                       const struct options *options)
{
    for (size_t i = 0; i < options->source_count; i++)
        if (!import_model(scene, sender, options, i))
            return false;
    if (options->environment &&
        !import_environment(scene, surroundings, file_part(options->environment), options->environment_degrees))
        return false;
    if (!import_settle_origin(scene))
        return false;
    if (!options->no_sky)
        import_add_sky(scene);
    return !scene->failed;
}

static bool read_files(struct import_scene *scene, struct files *surroundings, const struct options *options)
{
    char reason[FILES_REASON_BYTES];

    if (options->environment && !files_open(surroundings, NULL, options->environment, reason))
        return import_fail(scene, file_part(options->environment), "cannot be opened: %s", reason);
    for (size_t i = 0; i < options->source_count; i++) {
        import_copy_text(scene->file, sizeof(scene->file), source_name(&options->sources[i]));
        if (!source_read(&options->sources[i], reason))
            return import_fail(scene, NULL, "%s%s",
                               options->sources[i].files.model < 0 ? "cannot be opened: " : "", reason);
    }
    return true;
}

static bool send_names(struct sender *sender, const struct options *options)
{
    for (size_t i = 0; i < options->source_count; i++)
        for (size_t k = 0; k < options->sources[i].files.named_count; k++)
            if (!sender_file(sender, (uint32_t)i, options->sources[i].files.named[k]))
                return false;
    return true;
}

static void *mark_closed(void *scene)
{
    import_mark_closed(scene);
    import_measure_bodies(scene);
    return NULL;
}

static bool run(struct import_scene *scene, struct sender *sender, const struct options *options,
                uint64_t start_ns)
{
    struct message_import_done done = {0};
    struct files surroundings = {.folder = -1, .model = -1, .environment = -1};
    uint64_t parsed_ns, begin_ns = monotonic_now_ns();
    bool imported, marks, sent;
    pthread_t marker;

    silence_libraries();
    imported = read_files(scene, &surroundings, options) && enter_sandbox(scene, options) &&
               import_all(scene, &surroundings, sender, options);
    parsed_ns = monotonic_now_ns();
    done.read_bytes = surroundings.read_bytes;
    done.read_ns = surroundings.read_ns;
    files_finish(&surroundings);
    imported = imported && send_names(sender, options);
    for (size_t i = 0; i < options->source_count; i++) {
        done.read_bytes += options->sources[i].files.read_bytes;
        done.read_ns += options->sources[i].files.read_ns;
        source_finish(&options->sources[i]);
    }
    if (!imported)
        return false;
    begin_ns += done.read_ns;
    done.parse_ns = parsed_ns > begin_ns ? parsed_ns - begin_ns : 0;
    /* The edits are sent after the blobs, and only they contain which meshes are closed. */
    marks = pthread_create(&marker, NULL, mark_closed, scene) == 0;
    sent = sender_notes(sender) && sender_progress(sender, 0, scene->blob_bytes, "hashing") && import_hash(scene);
    done.hash_ns = monotonic_now_ns() - parsed_ns;
    sent = sent && sender_blobs(sender);
    if (marks)
        pthread_join(marker, NULL);
    else
        mark_closed(scene);
    if (!sent || !sender_edits(sender, options->scene))
        return false;
    done.total_ns = monotonic_now_ns() - start_ns;
    memcpy(done.origin, scene->origin, sizeof(done.origin));
    return sender_done(sender, &done);
}

int main(int argc, char **argv)
{
    static const struct argp argp = {option_rows,
                                     parse_option,
                                     "MODEL...",
                                     "Turn each MODEL (glTF 2.0, GLB, OBJ, NFF, PLY, STL, FBX, COLLADA, 3MF and "
                                     "more) into messages of farlight's protocol.",
                                     NULL,
                                     NULL,
                                     NULL};
    static struct import_scene scene; /* static, since the table of notes is too large for the stack */
    uint64_t start_ns = monotonic_now_ns();
    static struct source sources[SOURCES_MAX];
    struct options options = {.socket = -1, .scene = 1, .sources = sources};
    struct sender sender;
    bool done;

    argp_err_exit_status = EXIT_USAGE;
    argp_parse(&argp, argc, argv, ARGP_IN_ORDER, NULL, &options);
    import_scene_init(&scene,
                      options.source_count > 0 ? source_name(&sources[0]) : file_part(options.environment));
    /* Light of images and of other formats is linear. */
    scene.display_values = options.source_count == 1 && !options.environment;
    done = sender_init(&sender, options.socket, &scene) && run(&scene, &sender, &options, start_ns);
    if (!done)
        sender_failure(&sender);
    leave_at_once(done ? EXIT_SUCCESS : EXIT_FAILURE);
    sender_finish(&sender);
    import_scene_finish(&scene);
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
