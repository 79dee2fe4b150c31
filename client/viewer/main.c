/* SPDX-License-Identifier: MIT */
/* farlight-view: a window on a scene that a daemon renders. Started by `farlight view`; it is a program of its
 * own so that nothing else links SDL and libavcodec. */
#include "options/arguments.h"
#include "options/complete.h"
#include "options/daemon.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/talk.h"
#include "options/views.h"
#include "lib/text.h"
#include "viewer/input/controls.h"
#include "viewer/viewer.h"
#include "protocol/common/standard.h"
#include "protocol/version.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* argp finds this variable by name, despite our hidden visibility. */
__attribute__((visibility("default"))) const char *argp_program_version = "farlight-view " FARLIGHT_VERSION;

#define MOVING_RATE_DEFAULT 15.0f
#define STEREO_DEFAULT_M 0.065f /* mean distance of human eyes */

enum key {
    KEY_SCENE = 0x500,
    KEY_WATCH,
    KEY_HEADLESS,
    KEY_REPLAY,
    KEY_RATE,
    KEY_MOVING_RATE,
    KEY_SAMPLES,
    KEY_INTEGRATOR,
    KEY_PASS,
    KEY_ENCODING,
    KEY_STILL_ENCODING,
    KEY_SCALE,
    KEY_ADAPT,
    KEY_NO_ADAPT,
    KEY_WEIGHT,
    KEY_EYES,
    KEY_VIEWS,
    KEY_HOLES,
    KEY_STATE
};

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Window:", -2},
    {"scene", KEY_SCENE, "NAME", 0,
     "Use a shared scene at --server in place of MODEL ('farlight scenes' lists them)", -2},
    {"watch", KEY_WATCH, NULL, 0, "Load the model again when it, or a file that it names, has changed", -2},
    {"samples", KEY_SAMPLES, "N", 0, "Render N samples per pixel while nothing moves (default 64)", -2},
    {"pass-samples", KEY_PASS, "N", 0, "Add N of these samples with each frame (default 1)", -2},
    {"integrator", KEY_INTEGRATOR, "NAME", 0,
     "Use whitted (default), distributed (default with a lens or a shutter), raycast, ao or path", -2},
    {"fps", KEY_RATE, "N", 0, "Render at most N frames per second (default 60)", -2},
    {"moving-rate", KEY_MOVING_RATE, "N", 0,
     "Render at least N frames per second while something moves, with fewer samples, pixels and bounces; "
     "0: render all of them (default 15; with --no-adapt 0)",
     -2},
    {"scale", KEY_SCALE, "N", 0, "Show a rendered pixel as NxN pixels of the window: 1 (default), 2, 4, 8", -2},
    {"encoding", KEY_ENCODING, "NAME", 0,
     "Encoding of pixels while something moves: raw, h264, jpeg, predicted, zstd (default: raw on this machine, "
     "else h264)",
     -2},
    {"still-encoding", KEY_STILL_ENCODING, "NAME", 0,
     "Encode pixels like this while nothing moves: raw, predicted, zstd, jpeg (default: raw on this machine, else "
     "predicted)",
     -2},
    {"adapt", KEY_ADAPT, NULL, 0,
     "Adapt quality and size to the link while something moves (default over a network)", -2},
    {"no-adapt", KEY_NO_ADAPT, NULL, 0, "Keep quality and size; a slow link gets fewer frames", -2},
    {"weight", KEY_WEIGHT, "N", 0,
     "Set this client's share of the device relative to others, 1 to 16 (default: the daemon's)", -2},
    {"eyes", KEY_EYES, "rays|quadtree", 0,
     "Render both eyes of --stereo, or make them on the daemon from depth layers (default)", -2},
    {"views", KEY_VIEWS, "off|auto|on", 0,
     "Warp the last picture by its depths while the camera moves, at the display's rate (auto, the default: where "
     "the daemon and the link take longer than a frame of the display)",
     -2},
    {"holes", KEY_HOLES, "fill|pattern", 0,
     "Fill areas that no picture shows yet from their surroundings (default), or mark them", -2},
    {"state", KEY_STATE, "FILE|none", 0,
     "Save the window's place and the settings chosen by keys in this file (default: farlight/viewer.json in "
     "$XDG_STATE_HOME or ~/.local/state; with --replay none)",
     -2},
    {"replay", KEY_REPLAY, "INPUT.json", 0, "Read timed input events from this file; exit after the last", -2},
    {"headless", KEY_HEADLESS, NULL, 0, "Open no window; needs --replay", -2},
    {0}};

struct command_line {
    struct cli_job job;
    struct viewer_options viewer;
    bool has_moving_rate;
};

static error_t name_field(struct cli_job *job, const char *field, bool good)
{
    if (good)
        return 0;
    snprintf(job->error.field, sizeof(job->error.field), "%s", field);
    return EINVAL;
}

static error_t set_integer(struct cli_job *job, const char *field, const char *value, uint64_t minimum,
                           uint64_t maximum, uint32_t *out)
{
    uint64_t number = *out;
    const error_t status = name_field(job, field, fl_text_integer(value, minimum, maximum, &number, &job->error));
    *out = (uint32_t)number;
    return status;
}

static error_t set_scale(struct command_line *line, const char *value)
{
    static const char *const scales[] = {"1", "2", "4", "8"};
    for (unsigned i = 0; i < sizeof(scales) / sizeof(scales[0]); i++)
        if (strcmp(value, scales[i]) == 0) {
            line->viewer.coarser = i;
            return 0;
        }
    return cli_usage(&line->job, "--scale", "is 1, 2, 4 or 8");
}

static error_t set_encoding(struct command_line *line, const char *value)
{
    line->job.given.encoding = true;
    if (protocol_encoding_parse(value, &line->job.options.encoding))
        return 0;
    return cli_usage(&line->job, "--encoding", "'%s' is not raw, h264, jpeg, predicted or zstd", value);
}

static error_t set_still_encoding(struct command_line *line, const char *value)
{
    struct viewer_options *viewer = &line->viewer;
    viewer->view.has_still_encoding = true;
    if (protocol_encoding_parse(value, &line->job.options.view.still_encoding) &&
        line->job.options.view.still_encoding != PROTOCOL_ENCODING_H264)
        return 0;
    return cli_usage(&line->job, "--still-encoding", "'%s' is not raw, predicted, zstd or jpeg", value);
}

/* Sets *choice to the index of the name. */
static error_t set_choice(struct command_line *line, const char *option, const char *const names[],
                          const char *value, int *choice)
{
    for (int i = 0; names[i]; i++)
        if (strcmp(value, names[i]) == 0) {
            *choice = i;
            return 0;
        }
    return cli_usage(&line->job, option, "'%s' is not one of its values, see --help", value);
}

static error_t set_views(struct command_line *line, const char *value)
{
    int choice = LOCAL_AUTO;
    const error_t status = set_choice(line, "--views", local_views_names, value, &choice);
    line->viewer.local = (enum local_views)choice;
    return status;
}

static error_t set_holes(struct command_line *line, const char *value)
{
    static const char *const names[] = {"fill", "pattern", NULL}; /* the order of enum fl_warp_holes */
    int choice = FL_WARP_FILL;
    const error_t status = set_choice(line, "--holes", names, value, &choice);
    line->viewer.holes = (enum fl_warp_holes)choice;
    return status;
}

static error_t set_integrator(struct command_line *line, const char *value)
{
    line->job.given.integrator = true;
    if (protocol_integrator_parse(value, &line->job.options.light.integrator))
        return 0;
    return cli_usage(&line->job, "--integrator", "unknown integrator '%s'", value);
}

static error_t set_rate(struct command_line *line, const char *value)
{
    double real = 0;
    const error_t status =
        name_field(&line->job, "--fps", fl_text_real(value, 0.1, 1000, &real, &line->job.error));
    line->job.options.frames_per_second = (float)real;
    return status;
}

static error_t set_moving_rate(struct command_line *line, const char *value)
{
    double real = 0;
    const error_t status =
        name_field(&line->job, "--moving-rate", fl_text_real(value, 0, 1000, &real, &line->job.error));
    line->viewer.view.moving_rate = (float)real;
    line->has_moving_rate = true;
    return status;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct command_line *line = state->input;
    struct viewer_options *viewer = &line->viewer;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &line->job;
        return 0;
    case ARGP_KEY_ARG:
        return cli_set_model(&line->job, value);
    case KEY_SCENE:
        line->job.input.scene = value;
        return 0;
    case KEY_WATCH:
        line->job.input.watch = true;
        return 0;
    case KEY_HEADLESS:
        viewer->headless = true;
        return 0;
    case KEY_STATE:
        viewer->state = value;
        return 0;
    case KEY_REPLAY:
        viewer->replay = value;
        return 0;
    case KEY_ADAPT:
        viewer->view.always_adapt = true;
        return 0;
    case KEY_NO_ADAPT:
        viewer->view.never_adapt = true;
        return 0;
    case KEY_MOVING_RATE:
        return set_moving_rate(line, value);
    case KEY_RATE:
        return set_rate(line, value);
    case KEY_SAMPLES:
        line->job.sampling.has_samples = true;
        return set_integer(&line->job, "--samples", value, 1, 65536, &line->job.options.sampling.samples);
    case KEY_PASS:
        return set_integer(&line->job, "--pass-samples", value, 1, 256, &line->job.options.view.pass_samples);
    case KEY_WEIGHT:
        return set_integer(&line->job, "--weight", value, 1, 16, &line->job.options.weight);
    case KEY_INTEGRATOR:
        return set_integrator(line, value);
    case KEY_SCALE:
        return set_scale(line, value);
    case KEY_ENCODING:
        return set_encoding(line, value);
    case KEY_STILL_ENCODING:
        return set_still_encoding(line, value);
    case KEY_EYES:
        return cli_views_set(&line->job, "--eyes", value);
    case KEY_VIEWS:
        return set_views(line, value);
    case KEY_HOLES:
        return set_holes(line, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Appends the list of keys to the options. */
static char *help_filter(int key, const char *text, void *input)
{
    (void)input;
    char *list = NULL;
    size_t bytes = 0;
    FILE *out = key == ARGP_KEY_HELP_POST_DOC ? open_memstream(&list, &bytes) : NULL;
    if (!out)
        return (char *)(uintptr_t)text; /* argp returns it as const */
    fprintf(out, "%s\n\nKeys:\n", text);
    input_print_bindings(out);
    fclose(out);
    return list;
}

static bool complete(struct command_line *line)
{
    struct cli_job *job = &line->job;
    struct viewer_options *viewer = &line->viewer;
    if (viewer->headless && !viewer->replay)
        return cli_usage(job, "--headless", "without a window --replay is needed") == 0;
    if (cli_views_are_files(job)) {
        cli_usage(job, "--stereo-layout", "a window is no pair of files");
        return fl_error_remedy(&job->error, "use side or over");
    }
    if (!cli_check_watch(job))
        return false;
    if (job->clips.count > 1)
        return cli_usage(job, "--clip", "only one clip can be played") == 0;
    return cli_check_models(job, &job->error) && cli_job_complete_view(job);
}

static void on_note(void *user, const struct fl_note *note)
{
    (void)user;
    cli_note(note, false);
}

static void fill(struct command_line *line)
{
    const struct cli_job *job = &line->job;
    struct viewer_options *viewer = &line->viewer;
    viewer->server = job->daemon.server && job->daemon.server[0] != '\0' ? job->daemon.server : NULL;
    viewer->key_file = cli_key_file(viewer->server, job->daemon.key_file);
    viewer->model = job->input.model;
    viewer->watch = job->input.watch;
    viewer->models = job->input.models;
    viewer->model_count = job->input.count;
    viewer->input_fd = job->input.fd;
    viewer->environment = job->input.environment;
    viewer->environment_degrees = job->input.environment_degrees;
    viewer->without_studio = job->input.without_studio;
    viewer->variant = job->input.variant;
    viewer->edits = job->input.edits;
    viewer->edit_count = job->input.edit_count;
    viewer->point_size = job->input.point_size;
    viewer->scene_name = job->input.scene;
    viewer->view.render = job->options;
    viewer->view.render.picture.views_across = viewer->view.render.picture.views_down = 1;
    viewer->view.render.picture.eyes_over = 0;
    viewer->view.render.picture.baseline = 0;
    viewer->view.render.picture.view_source = job->views.has_lens ? job->views.lens : PROTOCOL_VIEW_SOURCE_RAYS;
    viewer->stereo = job->views.has_stereo;
    viewer->view.stereo_m = job->views.has_stereo ? job->views.stereo_m : STEREO_DEFAULT_M;
    viewer->view.stereo_over = job->views.layout == CLI_STEREO_OVER;
    viewer->views = job->views.has_stereo ? job->options.picture.view_source : PROTOCOL_VIEW_SOURCE_LAYERS;
    if (!line->has_moving_rate)
        viewer->view.moving_rate = viewer->view.never_adapt ? 0.0f : MOVING_RATE_DEFAULT;
    viewer->view.has_encoding = job->given.encoding;
    viewer->view.has_primary = job->given.primary;
    viewer->view.jumps = viewer->replay != NULL;
    viewer->camera = job->camera.name;
    viewer->framed = job->camera.framed;
    viewer->has_framing = job->camera.has_framing;
    viewer->clip = job->clips.count > 0 ? job->clips.list[0].which : NULL;
    viewer->speed = job->clips.count > 0 ? job->clips.list[0].speed : 1;
    viewer->has_retry_for = job->daemon.retries.has_duration;
    viewer->retry_for_s = job->daemon.retries.for_s;
    viewer->lost_after_ms = job->daemon.retries.lost_after_ms;
    viewer->interrupt_fd = cli_interrupt_fd();
    viewer->interrupt_signal = cli_interrupt_signal;
    viewer->note = job->talk.quiet ? NULL : on_note;
}

/* Reads variables and options over saved choices, which replace the defaults. */
static bool read_line(struct command_line *line, const struct argp *argp, int argc, char **argv,
                      const struct recall *recall)
{
    struct message_render defaults = fl_view_defaults();
    struct settings settings = {.tracer = defaults.tracing.tracer,
                                .integrator = defaults.light.integrator,
                                .tone_map = defaults.picture.tone_map,
                                .local = LOCAL_AUTO};
    recall_apply(recall, &settings);
    defaults.tracing.tracer = settings.tracer;
    defaults.light.integrator = settings.integrator;
    defaults.picture.tone_map = settings.tone_map;
    if (recall->width > 0) {
        defaults.picture.width = (uint32_t)recall->width;
        defaults.picture.height = (uint32_t)recall->height;
    }
    *line = (struct command_line){.viewer = {.local = settings.local,
                                             .holes = settings.holes,
                                             .coarser = (unsigned)settings.coarser,
                                             .overlay = settings.overlay,
                                             .recall = *recall}};
    return cli_job_begin(&line->job, defaults) && cli_parse(argp, argc, argv, ARGP_IN_ORDER, line) == 0 &&
           complete(line);
}

/* A file with the name "none" needs its folder: ./none. */
static const char *state_file(const struct viewer_options *viewer)
{
    static char path[4096];
    if (viewer->state)
        return strcmp(viewer->state, "none") == 0 ? NULL : viewer->state;
    return !viewer->replay && recall_default_path(path, sizeof(path)) ? path : NULL;
}

/* Reads the command line twice, since it names the file of saved choices. */
static bool read_all(struct command_line *line, const struct argp *argp, int argc, char **argv)
{
    struct recall recall = {0};
    if (!read_line(line, argp, argc, argv, &recall))
        return false;
    const char *state = state_file(&line->viewer);
    if (state)
        recall_load(&recall, state);
    /* Saved choices must not make a command line invalid. */
    if (state && !read_line(line, argp, argc, argv, &recall) &&
        !read_line(line, argp, argc, argv, &(struct recall){0}))
        return false;
    line->viewer.state = state;
    return true;
}

int main(int argc, char **argv)
{
    static struct argp_child children[2];
    children[0].argp = cli_options_argp(CLI_OPTIONS_WINDOW);
    static const struct argp argp = {.options = options,
                                     .parser = parse,
                                     .args_doc = "MODEL [--at PLACE] [MODEL [--at PLACE]]...",
                                     .doc = "Open a window on a model, or on a shared scene of a daemon.\v"
                                            "MODEL is glTF, GLB, OBJ, PLY, STL, FBX, COLLADA, 3MF or of another "
                                            "format of farlight-import; '-' is standard input. "
                                            "FARLIGHT_SERVER, FARLIGHT_SIZE and so on give defaults.",
                                     .children = children,
                                     .help_filter = help_filter};
    static struct command_line line;
    argp_err_exit_status = CLI_USAGE;
    open_standard_descriptors();
    if (!read_all(&line, &argp, argc, argv))
        return cli_report(&line.job.error);
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error) || !cli_read_input(&line.job, &error))
        return cli_report(&error);
    fill(&line);
    return viewer_run(&line.viewer, &error) ? CLI_DONE : cli_report(&error);
}
