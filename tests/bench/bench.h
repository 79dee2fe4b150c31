/* SPDX-License-Identifier: MIT */
/* Measurements register themselves; main.c runs the one that is asked for.
 *
 *     BENCH(link)
 *     {
 *         ...                  with argc and argv, argv[0] its name; returns the exit status
 *     }
 */
#ifndef FARLIGHT_TESTS_BENCH_H
#define FARLIGHT_TESTS_BENCH_H

typedef int bench_function(int argc, char **argv);

/* `name` lasts until the process ends. */
void bench_register(const char *name, bench_function *run);

#define BENCH(name)                                                                                               \
    static int name##_main(int argc, char **argv);                                                                \
    __attribute__((constructor)) static void register_##name(void)                                                \
    {                                                                                                             \
        bench_register(#name, name##_main);                                                                       \
    }                                                                                                             \
    static int name##_main(int argc, char **argv)

/* The usual one: `usage`, parse(), `work` on bench.device with an `error`, print() and finish() of its struct
 * bench. */
#define BENCH_ON_DEVICE(name, work)                                                                               \
    BENCH(name)                                                                                                   \
    {                                                                                                             \
        struct bench bench;                                                                                       \
        struct error error = {0};                                                                                 \
        if (!parse(&bench, argc, argv)) {                                                                         \
            fputs(usage, stderr);                                                                                 \
            return 2;                                                                                             \
        }                                                                                                         \
        bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);                             \
        bool ok = bench.device && (work);                                                                         \
        if (!ok)                                                                                                  \
            fprintf(stderr, "bench " #name ": %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);    \
        ok = ok && print(&bench);                                                                                 \
        if (bench.device)                                                                                         \
            finish(&bench);                                                                                       \
        return ok ? 0 : 1;                                                                                        \
    }

#endif
