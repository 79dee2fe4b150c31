/* SPDX-License-Identifier: MIT */
/* Helper programs that fail, hang, lie, or do their work. Scripts stand in for the importer; the image writer is
 * the real one where it is built. */
#include "lib/farlight.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static struct fl_error error;
static char folder[64], script[96], model[96];

static void write_file(const char *path, const char *text, mode_t mode)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    assert_int_equal(chmod(path, mode), 0);
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof(folder), "%s/farlight-client-XXXXXX", P_tmpdir);
    if (!mkdtemp(folder))
        return -1;
    snprintf(script, sizeof(script), "%s/farlight-import", folder);
    snprintf(model, sizeof(model), "%s/-model.obj", folder);
    write_file(model, "v 0 0 0\n", 0600);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(script);
    unlink(model);
    return rmdir(folder);
}

/* Runs the text as the importer. */
static struct fl_model_info *import_with(const char *text, unsigned timeout_ms)
{
    write_file(script, text, 0700);
    setenv("FARLIGHT_LIBEXEC", folder, 1);
    error = (struct fl_error){0};
    return fl_model_info(&(struct fl_load_options){.model = model, .timeout_ms = timeout_ms}, 0, &error);
}

static void check_error(enum fl_error_code code, const char *part)
{
    if (error.code != code || !strstr(error.text, part))
        fail_msg("error %d '%s' in place of %d '%s'", (int)error.code, error.text, (int)code, part);
}

ALL_TESTS(make_folder, remove_folder)

TEST(an_importer_that_gives_up_is_reported_with_its_last_words)
{
    assert_null(import_with("#!/bin/sh\necho first >&2\necho 'no more memory' >&2\nexit 3\n", 60000));
    check_error(FL_ERROR_MODEL, "farlight-import ended with status 3: no more memory");
    assert_string_equal(error.field, model);
}

TEST(an_importer_that_crashes_is_reported_with_its_signal)
{
    assert_null(import_with("#!/bin/sh\nkill -SEGV $$\n", 60000));
    check_error(FL_ERROR_MODEL, "farlight-import was ended by signal 11");
    assert_non_null(strstr(error.remedy, "the file may be broken"));
}

TEST(an_importer_that_hangs_is_killed_at_its_deadline)
{
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    assert_null(import_with("#!/bin/sh\ntrap '' TERM\nexec sleep 60\n", 200));
    clock_gettime(CLOCK_MONOTONIC, &end);
    check_error(FL_ERROR_TIMEOUT, "timed out");
    assert_in_range(end.tv_sec - begin.tv_sec, 0, 50);
}

TEST(an_importer_that_sends_garbage_is_reported)
{
    assert_null(import_with("#!/bin/sh\necho 'this is no message at all' >&3\nsleep 5\n", 60000));
    check_error(FL_ERROR_PROTOCOL, "the importer sent a message that the protocol does not allow");
}

TEST(an_importer_may_not_speak_for_the_client)
{
    /* The header of a `stats` request: 8 bytes of payload size and type, flags, request 1, channel 0; no fields.
     */
    assert_null(import_with("#!/bin/sh\nprintf '\\002\\000\\000\\000\\011\\000\\000\\000\\001\\000\\000\\000\\000"
                            "\\000\\000\\000\\000\\000\\000\\000\\000\\000\\000\\000' >&3\nsleep 5\n",
                            60000));
    check_error(FL_ERROR_PROTOCOL, "not allowed (stats)");
}

TEST(a_model_that_is_missing_or_no_file_starts_nothing)
{
    setenv("FARLIGHT_LIBEXEC", folder, 1);
    write_file(script, "#!/bin/sh\necho started >&2\nexit 9\n", 0700);
    assert_null(fl_model_info(&(struct fl_load_options){.model = "/nonexistent/a.glb"}, 0, &error));
    check_error(FL_ERROR_FILE, "No such file");
    assert_null(fl_model_info(&(struct fl_load_options){.model = folder}, 0, &error));
    check_error(FL_ERROR_FILE, "is not a file");
    assert_null(fl_model_info(&(struct fl_load_options){0}, 0, &error));
    check_error(FL_ERROR_ARGUMENT, "a file name is needed");
}

TEST(a_helper_that_is_not_installed_is_named)
{
    char *path = strdup(getenv("PATH"));
    unlink(script);
    setenv("PATH", folder, 1);
    assert_null(fl_model_info(&(struct fl_load_options){.model = model}, 0, &error));
    setenv("PATH", path, 1);
    free(path);
    check_error(FL_ERROR_FILE, "is not installed");
    assert_string_equal(error.field, "farlight-import");
}

/* ---- the real image writer ---- */

#define EDGE 64u

static size_t count_files(const char *where)
{
    size_t count = 0;
    DIR *listing = opendir(where);
    assert_non_null(listing);
    for (const struct dirent *entry = readdir(listing); entry; entry = readdir(listing))
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(listing);
    return count;
}

static uint8_t *pixels; /* pixels of all layers */
static struct fl_exporter *exporter;
static size_t files_before;
static bool has_exporter;

static void start_exporter(const char *format)
{
    if (!has_exporter) {
        print_message("skipped: farlight-export is not built\n");
        skip();
    }
    exporter = fl_exporter_start(&(struct fl_exporter_options){.folder = folder, .format = format}, &error);
    assert_non_null(exporter);
}

static int begin_export(void **state)
{
    (void)state;
    char self[4096], program[4200];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);
    assert_true(length > 0);
    self[length] = '\0';
    for (int i = 0; i < 3; i++) /* build/CONFIG/tests/unit/test: the programs are in build/CONFIG */
        *strrchr(self, '/') = '\0';
    snprintf(program, sizeof(program), "%s/farlight-export", self);
    setenv("FARLIGHT_LIBEXEC", self, 1);
    has_exporter = access(program, X_OK) == 0;
    files_before = count_files(folder);
    pixels = calloc(PROTOCOL_LAYER_COUNT, EDGE * EDGE * 16);
    assert_non_null(pixels);
    return 0;
}

/* Nothing is left in the folder. */
static int end_export(void **state)
{
    (void)state;
    fl_exporter_destroy(exporter);
    exporter = NULL;
    free(pixels);
    assert_int_equal(count_files(folder), files_before);
    return 0;
}

static const char *path_of(const char *name)
{
    static char path[128];
    snprintf(path, sizeof(path), "%s/%s", folder, name);
    return path;
}

/* Whether the file is there then. */
static bool export_as(const struct fl_frame *frame, const struct fl_export_options *options)
{
    error = (struct fl_error){0};
    assert_true(fl_exporter_write(exporter, frame, options, &error));
    return fl_exporter_wait(exporter, &error);
}

static struct fl_frame some_frame(enum protocol_pixel_format format)
{
    struct fl_frame frame = {
        .width = EDGE, .height = EDGE, .samples = 1, .layers = 1, .format = format, .fov_y = 1};
    frame.world_from_view[0] = frame.world_from_view[5] = frame.world_from_view[10] = 1;
    frame.pixels = pixels;
    frame.pixels_bytes = (size_t)EDGE * EDGE * fl_bytes_per_pixel(format);
    return frame;
}

static void check_magic(const char *path, const char *magic, size_t count)
{
    char found[16] = "";
    FILE *file = fopen(path, "rb");
    if (!file)
        fail_msg("%s is missing", path);
    assert_int_equal(fread(found, 1, count, file), count);
    fclose(file);
    assert_memory_equal(found, magic, count);
}

TEST_WITH(one_exporter_writes_every_format, begin_export, end_export)
{
    static const struct {
        const char *name, *magic;
        size_t magic_bytes;
        enum protocol_pixel_format format;
    } files[] = {{"a.png", "\x89PNG", 4, PROTOCOL_PIXEL_FORMAT_RGBA8},
                 {"b.JPG", "\xff\xd8\xff", 3, PROTOCOL_PIXEL_FORMAT_RGBA8},
                 {"c.exr", "\x76\x2f\x31\x01", 4, PROTOCOL_PIXEL_FORMAT_RGBA16F},
                 {"d.exr", "\x76\x2f\x31\x01", 4, PROTOCOL_PIXEL_FORMAT_RGBA32F},
                 {"e.hdr", "#?RADIANCE", 10, PROTOCOL_PIXEL_FORMAT_RGBA32F}};
    start_exporter(NULL);
    for (size_t i = 0; i < sizeof(files) / sizeof(files[0]); i++) {
        const char *path = path_of(files[i].name);
        const struct fl_frame frame = some_frame(files[i].format);
        if (!export_as(&frame, &(struct fl_export_options){.path = path}))
            fail_msg("%s: %s", path, error.text);
        check_magic(path, files[i].magic, files[i].magic_bytes);
        unlink(path);
    }
}

TEST_WITH(an_exporter_for_one_format_refuses_those_that_it_did_not_load, begin_export, end_export)
{
    const struct fl_frame frame = some_frame(PROTOCOL_PIXEL_FORMAT_RGBA8);
    start_exporter("png");
    assert_false(export_as(&frame, &(struct fl_export_options){.path = path_of("a.webp")}));
    check_error(FL_ERROR_FILE, "started for other formats");
    assert_true(export_as(&frame, &(struct fl_export_options){.path = path_of("a.png")}));
    unlink(path_of("a.png"));
}

/* ---- layers ---- */

#define LAYER_SET(name) (1u << PROTOCOL_LAYER_##name)

/* "A:1 B:1 .." as the header of an EXR file lists channels: by name; 0 whole numbers, 1 half floats, 2 floats. */
static void read_channels(const char *path, char *text, size_t text_bytes)
{
    static const char attribute[] = "channels\0chlist";
    static char head[8192];
    size_t used = 0;
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    const size_t count = fread(head, 1, sizeof(head), file);
    fclose(file);
    const char *at = memmem(head, count, attribute, sizeof(attribute));
    assert_non_null(at);
    for (at += sizeof(attribute) + 4; at[0] != '\0'; at += strlen(at) + 17) /* type, linear, sampling */
        used += (size_t)snprintf(text + used, text_bytes - used, "%s%s:%d", used > 0 ? " " : "", at,
                                 at[strlen(at) + 1]);
}

TEST_WITH(layers_become_channels_by_name, begin_export, end_export)
{
    static const struct {
        unsigned layers;
        bool half;
        const char *channels;
    } cases[] = {
        {LAYER_SET(BEAUTY) | LAYER_SET(DEPTH), true, "A:1 B:1 G:1 R:1 Z:2"},
        {LAYER_SET(NORMAL) | LAYER_SET(AO), false, "ao.Y:2 normal.X:2 normal.Y:2 normal.Z:2"},
        {LAYER_SET(ID), true, "id.material:0 id.node:0"},
        {LAYER_SET(CRYPTO_OBJECT1), true,
         "CryptoObject01.alpha:2 CryptoObject01.blue:2 CryptoObject01.green:2 CryptoObject01.red:2"},
        {LAYER_SET(DIFFUSE_DIRECT) | LAYER_SET(BACKGROUND), false,
         "background.B:2 background.G:2 background.R:2 diffuse_direct.B:2 diffuse_direct.G:2 diffuse_direct.R:2"},
        {LAYER_SET(CRYPTO_OBJECT0) - 1, true,
         "A:1 B:1 G:1 R:1 Z:2 albedo.B:1 albedo.G:1 albedo.R:1 ao.Y:1 id.material:0 id.node:0 normal.X:1 "
         "normal.Y:1 "
         "normal.Z:1 position.X:2 position.Y:2 position.Z:2 unknown.Y:1"},
    };
    char found[512];
    const char *path = path_of("layers.exr");
    start_exporter(NULL);
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct fl_frame frame = some_frame(PROTOCOL_PIXEL_FORMAT_RGBA32F);
        frame.layers = cases[i].layers;
        frame.pixels_bytes *= (size_t)__builtin_popcount(frame.layers);
        if (!export_as(&frame, &(struct fl_export_options){.path = path, .half = cases[i].half}))
            fail_msg("%#x: %s", frame.layers, error.text);
        read_channels(path, found, sizeof(found));
        assert_string_equal(found, cases[i].channels);
        unlink(path);
    }
}

TEST_WITH(layers_that_a_file_cannot_have_are_refused_and_the_next_picture_is_written, begin_export, end_export)
{
    static const struct {
        const char *name;
        enum protocol_pixel_format format;
    } wrong[] = {{"a.png", PROTOCOL_PIXEL_FORMAT_RGBA8},
                 {"a.hdr", PROTOCOL_PIXEL_FORMAT_RGBA32F},
                 {"a.exr", PROTOCOL_PIXEL_FORMAT_RGBA16F}};
    start_exporter(NULL);
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        const struct fl_export_options options = {.path = path_of(wrong[i].name)};
        struct fl_frame frame = some_frame(wrong[i].format);
        frame.layers = LAYER_SET(BEAUTY) | LAYER_SET(ALBEDO);
        frame.pixels_bytes *= 2;
        assert_false(export_as(&frame, &options));
        check_error(FL_ERROR_FILE, "layers");
        assert_int_equal(count_files(folder), files_before);
        frame = some_frame(wrong[i].format);
        assert_true(export_as(&frame, &options));
        unlink(options.path);
    }
}

TEST_WITH(a_file_that_cannot_be_written_is_named_and_nothing_is_left, begin_export, end_export)
{
    static const char *const wrong[] = {"missing/a.png", "a.bmp", "no-ending", "../a.png"};
    start_exporter(NULL);
    const struct fl_frame frame = some_frame(PROTOCOL_PIXEL_FORMAT_RGBA8);
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        const char *path = path_of(wrong[i]);
        if (export_as(&frame, &(struct fl_export_options){.path = path}))
            fail_msg("%s was written", path);
        assert_int_equal(error.code, FL_ERROR_FILE);
        assert_string_equal(error.field, path);
    }
}

TEST_WITH(a_full_disk_is_reported_and_no_file_is_left, begin_export, end_export)
{
    struct rlimit saved, small;
    const char *path = path_of("large.exr");
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &saved), 0);
    small = (struct rlimit){.rlim_cur = 4096, .rlim_max = saved.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small); /* inherited by the exporter */
    start_exporter(NULL);
    setrlimit(RLIMIT_FSIZE, &saved);
    uint32_t noise = 1;
    for (size_t i = 0; i < EDGE * EDGE * 16; i++) { /* finite floats that do not compress */
        noise = noise * 1664525u + 1013904223u;
        pixels[i] = i % 4 == 3 ? 0x3f : (uint8_t)(noise >> 24);
    }
    const struct fl_frame frame = some_frame(PROTOCOL_PIXEL_FORMAT_RGBA32F);
    assert_false(export_as(&frame, &(struct fl_export_options){.path = path}));
    check_error(FL_ERROR_FILE, "File too large");
    assert_string_equal(error.field, path);
}
