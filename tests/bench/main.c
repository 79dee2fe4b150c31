/* SPDX-License-Identifier: MIT */
/* Runs one measurement: bench NAME [ARGUMENT ..]; its file says which arguments. bench --list names them all. */
#include "tests/bench/bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROWS_MAX 32

static struct {
    const char *name;
    bench_function *run;
} rows[ROWS_MAX];
static size_t row_count;

void bench_register(const char *name, bench_function *run)
{
    if (row_count == ROWS_MAX)
        abort();
    rows[row_count].name = name;
    rows[row_count++].run = run;
}

static void list(FILE *out)
{
    for (size_t i = 0; i < row_count; i++)
        fprintf(out, "%s\n", rows[i].name);
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--list") == 0) {
        list(stdout);
        return 0;
    }
    for (size_t i = 0; argc > 1 && i < row_count; i++)
        if (strcmp(rows[i].name, argv[1]) == 0)
            return rows[i].run(argc - 1, argv + 1);
    fputs("usage: bench NAME [ARGUMENT ..], where NAME is one of\n", stderr);
    list(stderr);
    return 2;
}
