/* SPDX-License-Identifier: MIT */
/* farlight-import: turns a model file into the protocol's messages and speaks them over a socket that the program
 * that started it has connected already. A program of its own so that nothing else links the libraries that read
 * hostile files, and so that it can give up its rights before it does. */
#include "files.h"
#include "formats.h"
#include "import.h"
#include "helper/sandbox.h"
#include "send.h"
#include "texture.h"
#include "texture_plain.h"
#include "protocol/common/clock.h"
#include "protocol/version.h"

#include <argp.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define EXIT_USAGE 2
#define CPU_SECONDS_MAX 300

/* The C library looks for it by name, past our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-import " FARLIGHT_VERSION;

struct options {
    int socket;
    uint32_t scene;
    const char *environment;
    double environment_degrees;
    const char *variant;
    double point_size; /* 0: chosen by the points */
    bool no_model;
    const char *model;
};

#define RADIANS_PER_DEGREE 0.017453292519943295

enum {
    OPTION_FD = 256,
    OPTION_SCENE,
    OPTION_ENVIRONMENT,
    OPTION_ROTATION,
    OPTION_VARIANT,
    OPTION_POINT_SIZE,
    OPTION_NO_MODEL
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
     "show points without faces as spheres of this diameter (default: by their distances)", 0},
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
    case ARGP_KEY_ARG:
        if (options->model)
            argp_error(state, "only one MODEL can be given; '%s' is a second one", argument);
        options->model = argument;
        return 0;
    case ARGP_KEY_END:
        if (options->socket < 0)
            argp_error(state, "--fd is missing: this program is started by the client");
        if (options->no_model)
            options->model = NULL;
        else if (!options->model)
            argp_error(state, "MODEL is missing");
        if (!options->model && !options->environment)
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

/* The libraries talk to standard error on their own; what is worth knowing goes over the socket as a note. The
 * sanitizers' reports must stay to be seen. */
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

static bool has_ending(const char *path, const char *ending)
{
    size_t path_length = strlen(path), length = strlen(ending);

    return path_length > length && strcasecmp(path + path_length - length, ending) == 0;
}

static bool is_aff(const char *path)
{
    return has_ending(path, ".aff");
}

static bool enter_sandbox(struct import_scene *scene, const struct options *options)
{
    char *folder = options->model ? files_folder_of(options->model) : NULL, *images = NULL;
    const char *folders[] = {folder, NULL};
    struct sandbox_options sandbox = {
        .read_folders = folders, .read_folder_count = 2, .cpu_seconds = CPU_SECONDS_MAX};
    char reason[256];
    bool entered;

    if (folder && is_aff(options->model) && asprintf(&images, "%s/" FILES_IMAGES_BESIDE, folder) < 0)
        images = NULL;
    folders[1] = images;
    entered = sandbox_enter(&sandbox, reason, sizeof(reason));
    free(images);
    free(folder);
    if (!entered)
        return import_fail(scene, NULL, "the sandbox cannot be entered: %s", reason);
    if (reason[0])
        import_note(scene, PROTOCOL_SEVERITY_WARNING, NULL, "%s", reason);
    return true;
}

static bool is_gltf(const char *name, const unsigned char *bytes, size_t size_bytes)
{
    return has_ending(name, ".gltf") || has_ending(name, ".glb") ||
           (size_bytes >= 4 && memcmp(bytes, "glTF", 4) == 0);
}

static bool contains(const unsigned char *bytes, size_t size_bytes, const char *text)
{
    return memmem(bytes, size_bytes, text, strlen(text)) != NULL;
}

/* Of a binary one the first chunk, after two headers. */
static size_t gltf_text_bytes(const unsigned char *bytes, size_t size_bytes)
{
    uint32_t chunk_bytes;
    if (size_bytes < 20 || memcmp(bytes, "glTF", 4) != 0)
        return size_bytes;
    memcpy(&chunk_bytes, bytes + 12, sizeof(chunk_bytes)); /* little-endian, as this host is */
    return chunk_bytes < size_bytes - 20 ? 20 + (size_t)chunk_bytes : size_bytes;
}

/* Whether there may be some that need OpenImageIO: of glTF others than PNG and JPEG. By the bytes alone, for
 * nothing may be parsed yet. */
static bool may_name_images(const char *name, const unsigned char *bytes, size_t size_bytes)
{
    if (is_gltf(name, bytes, size_bytes))
        return texture_gltf_names_others(bytes, gltf_text_bytes(bytes, size_bytes));
    if (is_aff(name)) /* what it includes may name some, too */
        return contains(bytes, size_bytes, "texturecoords") || contains(bytes, size_bytes, "tt") ||
               contains(bytes, size_bytes, ".aff") || contains(bytes, size_bytes, ".nff");
    if (assimp_format_of(name))
        return assimp_may_name_images(assimp_format_of(name), bytes, size_bytes);
    return has_ending(name, ".obj") && contains(bytes, size_bytes, "mtllib");
}

/* The endings of all formats, for people. */
static const char *known_endings(char out[256])
{
    size_t used = (size_t)snprintf(out, 256, ".gltf, .glb, .obj, .nff, .aff");

    for (size_t i = 0; assimp_format_at(i) && used < 240; i++)
        used += (size_t)snprintf(out + used, 256 - used, "%s%s", assimp_format_at(i + 1) ? ", " : " and ",
                                 assimp_format_at(i)->ending);
    return out;
}

static bool parse_model(struct import_scene *scene, struct files *files, const struct options *options,
                        const unsigned char *bytes, size_t size_bytes)
{
    const char *name = file_part(options->model);
    const char *dot = strrchr(name, '.');
    char endings[256];

    if (size_bytes == 0)
        return import_fail(scene, NULL, "the file is empty");
    if (is_gltf(name, bytes, size_bytes))
        return gltf_import(scene, files, bytes, size_bytes);
    if (scene->variant)
        return import_fail(scene, NULL, "only glTF has variants, so none can be called '%.100s'", scene->variant);
    if (has_ending(name, ".obj"))
        return obj_import(scene, files, bytes, size_bytes);
    if (has_ending(name, ".nff"))
        return nff_import(scene, bytes, size_bytes);
    if (is_aff(name))
        return aff_import(scene, files, bytes, size_bytes);
    if (assimp_format_of(name))
        return assimp_import(scene, files, assimp_format_of(name), options->point_size, bytes, size_bytes);
    return import_fail(scene, NULL, "unknown format %.40s; known are %s", dot ? dot : "(no ending)",
                       known_endings(endings));
}

/* The protocol's middle column is -z. */
static float turn_of(double degrees)
{
    return (float)((degrees - 90) * RADIANS_PER_DEGREE);
}

static bool import_environment(struct import_scene *scene, struct files *files, const char *file, double degrees)
{
    struct message_set_environment environment = {.colour = {1, 1, 1}, .rotation = turn_of(degrees)};
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
    if (job.width != 2 * job.height)
        import_note(scene, PROTOCOL_SEVERITY_INFO, file,
                    "is %u x %u; an equirectangular image is twice as wide as high", job.width, job.height);
    environment.width = job.width;
    environment.height = job.height;
    import_set_environment(scene, &environment,
                           import_add_blob(scene, job.texels, (uint64_t)job.width * job.height * 8));
    return !scene->failed;
}

static bool import_all(struct import_scene *scene, struct files *files, struct sender *sender,
                       const struct options *options, const unsigned char *bytes, size_t size_bytes)
{
    bool imported = true;

    if (options->model) {
        imported = sender_progress(sender, size_bytes, 0, "parsing") &&
                   parse_model(scene, files, options, bytes, size_bytes);
        if (imported && scene->edit_count == 0)
            import_note(scene, PROTOCOL_SEVERITY_WARNING, NULL, "it contains nothing that can be shown");
    }
    if (imported && options->environment)
        imported = import_environment(scene, files, file_part(options->environment), options->environment_degrees);
    return imported && !scene->failed;
}

/* The model is read before the sandbox is entered and parsed within it: whether the module of images is needed
 * shows in the bytes, and loading it opens more files than the sandbox allows. */
static bool read_and_import(struct import_scene *scene, struct files *files, struct sender *sender,
                            const struct options *options)
{
    char reason[FILES_REASON_BYTES] = "";
    unsigned char *bytes = NULL;
    size_t size_bytes = 0;
    bool imported;

    if (options->model) {
        bytes = files_read_descriptor(files, files->model, &size_bytes, reason);
        if (!bytes)
            return import_fail(scene, NULL, "%s", reason);
    }
    if (options->environment || (bytes && may_name_images(file_part(options->model), bytes, size_bytes)))
        texture_load();
    if (bytes && !is_gltf(file_part(options->model), bytes, size_bytes) &&
        assimp_format_of(file_part(options->model)))
        assimp_load();
    imported = enter_sandbox(scene, options) && import_all(scene, files, sender, options, bytes, size_bytes);
    free(bytes);
    return imported;
}

static bool run(struct import_scene *scene, struct sender *sender, const struct options *options,
                uint64_t start_ns)
{
    struct message_import_done done = {0};
    struct files files;
    char reason[FILES_REASON_BYTES];
    uint64_t parsed_ns, begin_ns;
    bool imported;

    if (!files_open(&files, options->model, options->environment, reason)) {
        const char *at_fault = options->model && files.folder < 0 ? options->model : options->environment;

        files_finish(&files);
        return import_fail(scene, file_part(at_fault), "cannot be opened: %s", reason);
    }
    if (options->model && is_aff(options->model))
        files_open_images(&files);
    begin_ns = monotonic_now_ns();
    silence_libraries();
    imported = read_and_import(scene, &files, sender, options);
    parsed_ns = monotonic_now_ns();
    files_finish(&files);
    if (!imported || !sender_notes(sender) || !sender_progress(sender, 0, scene->blob_bytes, "hashing"))
        return false;
    begin_ns += files.read_ns;
    done.read_bytes = files.read_bytes;
    done.read_ns = files.read_ns;
    done.parse_ns = parsed_ns > begin_ns ? parsed_ns - begin_ns : 0;
    if (!import_hash(scene))
        return false;
    done.hash_ns = monotonic_now_ns() - parsed_ns;
    if (!sender_blobs(sender) || !sender_edits(sender, options->scene))
        return false;
    done.total_ns = monotonic_now_ns() - start_ns;
    return sender_done(sender, &done);
}

int main(int argc, char **argv)
{
    static const struct argp argp = {option_rows,
                                     parse_option,
                                     "MODEL",
                                     "Turn MODEL (glTF 2.0, GLB, OBJ, NFF, AFF, PLY, STL, FBX, COLLADA, 3MF and "
                                     "more) into messages of farlight's protocol.",
                                     NULL,
                                     NULL,
                                     NULL};
    static struct import_scene scene; /* the table of notes is too large for the stack of a careful program */
    uint64_t start_ns = monotonic_now_ns();
    struct options options = {.socket = -1, .scene = 1};
    struct sender sender;
    bool done;

    argp_err_exit_status = EXIT_USAGE;
    argp_parse(&argp, argc, argv, 0, NULL, &options);
    import_scene_init(&scene, file_part(options.model ? options.model : options.environment));
    scene.variant = options.variant;
    done = sender_init(&sender, options.socket, &scene) && run(&scene, &sender, &options, start_ns);
    if (!done)
        sender_failure(&sender);
    leave_at_once(done ? EXIT_SUCCESS : EXIT_FAILURE);
    sender_finish(&sender);
    import_scene_finish(&scene);
    return done ? EXIT_SUCCESS : EXIT_FAILURE;
}
