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

#endif
