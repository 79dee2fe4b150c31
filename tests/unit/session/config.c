/* SPDX-License-Identifier: MIT */
/* config: rows, sources, errors that name the place. */
#include <stddef.h>
#include <stdint.h>

#include "config.h"

#include "base/host.h"
#include "base/log.h"
#include "gpu/memory.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static bool read_text(struct config *config, const char *text, struct error *error)
{
    char path[64];
    int fd = memfd_create("config", MFD_CLOEXEC);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, strlen(text)), strlen(text));
    snprintf(path, sizeof(path), "/proc/self/fd/%d", fd);
    config_defaults(config);
    bool ok = config_read_file(config, path, false, error);
    close(fd);
    return ok;
}

TEST(the_defaults_are_within_their_own_bounds)
{
    struct config config;
    config_defaults(&config);
    assert_int_equal(config.connection.handshake_ms, 5000);
    assert_int_equal(config.connection.idle_ms, 120000);
    assert_int_equal(config.connection.queued_hard_bytes, 64 << 20);
    assert_int_equal(config.limits.requests_in_flight, 64);
    assert_int_equal(config.limits.unauthenticated_per_address, 8);
    assert_int_equal(config.limits.samples, 65536);
    assert_int_equal(config.limits.depth, SCENE_DEPTH_MAX);
    assert_int_equal(config.limits.tracers.ldc_layers, 255);
    assert_int_equal(config.limits.tracers.ldc_mebibytes, 0);
    assert_int_equal(config.limits.tracers.abuffer_mebibytes, 0);
    assert_int_equal(config.limits.upload_window_bytes, 16 << 20);
    assert_int_not_equal(config.scene_bytes, 0);
    assert_string_equal(config.device, "auto");
    assert_false(config.insecure);
}

/* With software GL, whose device is the host's memory. */
TEST(the_default_limits_of_memory_are_three_quarters_of_what_there_is_at_most)
{
    struct config config;
    config_defaults(&config);
    const struct gpu_memory memory = {GPU_MEMORY_HOST, host_memory_bytes()};
    const uint64_t all_bytes = config.scene_bytes + config.limits.blob_bytes + config.limits.transaction_bytes +
                               config.limits.frame_bytes + gpu_memory_default_limit(&memory, memory.bytes);
    assert_in_range(all_bytes, memory.bytes / 100 * 70, memory.bytes / 100 * 75);
    assert_in_range(config.limits.blob_cache_bytes, 1, config.limits.blob_bytes);
}

TEST(a_file_sets_numbers_with_units_texts_and_switches)
{
    struct config config;
    struct error error = {0};
    assert_true(read_text(&config,
                          "[limits]\nclients = 3\nupload_window=2M\n; note\n[server]\ninsecure = yes\n"
                          "listen = unix:/a tcp:[::1]:0\nlog_level = debug\n[memory]\nblob_cache = 0%\nldc = 96M\n"
                          "abuffer = 1G\n"
                          "[limits]\nldc_layers = 12\n",
                          &error));
    assert_int_equal(config.limits.clients, 3);
    assert_int_equal(config.limits.upload_window_bytes, 2 << 20);
    assert_true(config.insecure);
    assert_string_equal(config.listen, "unix:/a tcp:[::1]:0");
    assert_int_equal(config.log_level, 3);
    assert_int_equal(config.limits.blob_cache_bytes, 0);
    assert_int_equal(config.limits.tracers.ldc_mebibytes, 96);
    assert_int_equal(config.limits.tracers.abuffer_mebibytes, 1024);
    assert_int_equal(config.limits.tracers.ldc_layers, 12);
    /* Whole MiB are told on; less than one is a limit still. */
    assert_true(read_text(&config, "[memory]\nldc = 3145729\nabuffer = 1000\n", &error));
    assert_int_equal(config.limits.tracers.ldc_mebibytes, 3);
    assert_int_equal(config.limits.tracers.abuffer_mebibytes, 1);
}

TEST(a_mistake_is_reported_with_its_file_line_and_key)
{
    static const struct {
        const char *text, *place, *what;
    } cases[] = {
        {"[limits]\n\nclientz = 3\n", ":3", "limits.clientz"},
        {"[limits]\nclients = 0\n", ":2", "1 .. 65536"},
        {"[limits]\nclients = 12x\n", ":2", "12x"},
        {"[limits]\nldc_layers = 256\n", ":2", "1 .. 255"},
        {"[limits]\nclients = -1\n", ":2", "-1"},
        {"[limits]\nclients = 99999999999999999999999\n", ":2", "no number"},
        {"[memory]\nscene = 101%\n", ":2", "101%"},
        {"[memory]\nscene = 18446744073709551615T\n", ":2", "no number"},
        {"[server]\ninsecure = perhaps\n", ":2", "perhaps"},
        {"[server]\nlog_level = loud\n", ":2", "loud"},
        {"clients = 3\n", ":1", "clients"},
        {"[limits\nclients = 3\n", ":1", "section"},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct config config;
        struct error error = {0};
        assert_false(read_text(&config, cases[i].text, &error));
        if (!strstr(error.field, cases[i].place) || !strstr(error.text, cases[i].what))
            fail_msg("%s: got \"%s: %s\"", cases[i].text, error.field, error.text);
    }
}

TEST(the_environment_goes_over_the_file_and_a_flag_over_both)
{
    struct config config;
    struct error error = {0};
    assert_true(read_text(&config, "[engine]\ndevice = 1\n", &error));
    setenv("FARLIGHT_ENGINE_DEVICE", "2", 1);
    assert_true(config_read_environment(&config, &error));
    assert_string_equal(config.device, "2");
    unsetenv("FARLIGHT_ENGINE_DEVICE");
    assert_true(config_flag(&config, "engine.device", NULL, "--device", &error));
    assert_string_equal(config.device, "2");
    assert_true(config_flag(&config, "engine.device", "software", "--device", &error));
    struct engine_options options;
    assert_true(config_engine(&config, &options, &error));
    assert_true(options.gpu.software);
    assert_true(config_flag(&config, "engine.device", "fast", "--device", &error));
    assert_false(config_engine(&config, &options, &error));
    setenv("FARLIGHT_LIMITS_CLIENTS", "none", 1);
    error = (struct error){0};
    assert_false(config_read_environment(&config, &error));
    assert_string_equal(error.field, "FARLIGHT_LIMITS_CLIENTS");
    unsetenv("FARLIGHT_LIMITS_CLIENTS");
}

TEST(a_missing_file_is_an_error_only_if_it_was_named)
{
    struct config config;
    struct error error = {0};
    config_defaults(&config);
    assert_true(config_read_file(&config, "/nowhere/farlightd.conf", true, &error));
    assert_false(config_read_file(&config, "/nowhere/farlightd.conf", false, &error));
    assert_string_equal(error.field, "/nowhere/farlightd.conf");
}

TEST(what_is_dumped_reads_back_the_same)
{
    struct config config, again;
    struct error error = {0};
    assert_true(
        read_text(&config, "[limits]\nclients = 77\n[memory]\nscene = 3G\n[server]\ninsecure = yes\n", &error));
    char *text = NULL;
    size_t bytes;
    FILE *stream = open_memstream(&text, &bytes);
    assert_true(config_dump(&config, stream));
    fclose(stream);
    assert_non_null(strstr(text, "\nclients = 77\n"));
    assert_non_null(strstr(text, "\n#requests = 64\n"));
    if (!read_text(&again, text, &error))
        fail_msg("%s: %s", error.field, error.text);
    assert_memory_equal(&again, &config, sizeof(config));
    free(text);
}

TEST(readers_are_names_and_numbers_of_users)
{
    struct config config;
    struct front_options options;
    struct error error = {0};
    assert_true(read_text(&config, "[server]\nreaders = root 4294967 0\n", &error));
    assert_true(config_front(&config, &options, &error));
    assert_int_equal(options.readers.count, 3);
    assert_true(readers_have(&options.readers, 0));
    assert_true(readers_have(&options.readers, 4294967));
    assert_false(readers_have(&options.readers, 1));
    static const char *const wrong[] = {"nobody-has-this-name", "-1", "4294967295", "1x"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        char text[64];
        snprintf(text, sizeof(text), "[server]\nreaders = 0 %s\n", wrong[i]);
        error = (struct error){0};
        assert_true(read_text(&config, text, &error));
        assert_false(config_front(&config, &options, &error));
        assert_string_equal(error.field, "server.readers");
        assert_non_null(strstr(error.text, wrong[i]));
    }
    config_defaults(&config);
    assert_true(config_front(&config, &options, &error));
    assert_int_equal(options.readers.count, 0);
}

TEST(scenes_linger_as_long_as_the_file_says)
{
    struct config config;
    struct engine_options options;
    struct error error = {0};
    config_defaults(&config);
    assert_true(config_engine(&config, &options, &error));
    assert_int_equal(options.limits.scene_linger_ms, 120000);
    assert_int_equal(options.limits.lingering_scenes, 16);
    assert_true(read_text(&config, "[limits]\nscene_linger = 0\nscenes_lingering = 3\n", &error));
    assert_true(config_engine(&config, &options, &error));
    assert_int_equal(options.limits.scene_linger_ms, 0);
    assert_int_equal(options.limits.lingering_scenes, 3);
}

TEST(what_is_taken_at_the_start_stays_and_the_rest_is_read_again)
{
    struct config config, next;
    struct error error = {0};
    config_defaults(&config);
    config_defaults(&next);
    assert_true(
        read_text(&next,
                  "[server]\nlisten = tcp:127.0.0.1:1\nlog_level = error\n[engine]\nencode_threads = 9\n[memory]\n"
                  "scene = 2M\ndevice = 3M\n[limits]\nrequests = 3\n[network]\nidle = 7\n",
                  &error));
    config_keep_start(&next, &config);
    assert_string_equal(next.listen, config.listen);
    assert_int_equal(next.encode_threads, config.encode_threads);
    assert_int_equal(next.device_bytes, config.device_bytes);
    assert_int_equal(next.log_level, LOG_ERROR);
    assert_int_equal(next.scene_bytes, 2 << 20);
    assert_int_equal(next.limits.requests_in_flight, 3);
    assert_int_equal(next.connection.idle_ms, 7);
}

TEST(the_file_in_conf_is_what_is_dumped)
{
    FILE *file = fopen("conf/farlightd.conf", "re");
    if (!file) {
        print_message("skipped: conf/farlightd.conf is not in the current folder\n");
        skip();
    }
    static char there[65536];
    size_t there_bytes = fread(there, 1, sizeof(there) - 1, file);
    fclose(file);
    there[there_bytes] = '\0';
    struct config config;
    config_defaults(&config);
    char *text = NULL;
    size_t bytes;
    FILE *stream = open_memstream(&text, &bytes);
    assert_true(config_dump(&config, stream));
    fclose(stream);
    assert_string_equal(there, text);
    free(text);
}
