/* SPDX-License-Identifier: MIT */
/* The answer to --list-devices. */
#include "devices.h"

#include "gpu/device.h"
#include "protocol/plain_text.h"

#include <glob.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BEFORE_DEVICE ", device "
#define CMDLINE_BYTES 512

void devices_set_title(char *title, uint32_t worker, const char *owner, int32_t device)
{
    char text[256];
    const size_t bytes = strlen(title);
    snprintf(text, sizeof(text), "%" PRIu32 ": %s" BEFORE_DEVICE "%" PRId32, worker, owner, device);
    memset(title, ' ', bytes);
    memcpy(title, text, strnlen(text, bytes));
}

bool devices_read_title(const char *title, uint32_t *worker, const char **owner, size_t *owner_bytes,
                        int32_t *device)
{
    char *colon;
    *worker = (uint32_t)strtoul(title, &colon, 10);
    const char *found = NULL; /* the last one: an owner may have any name */
    for (const char *at = title; (at = strstr(at, BEFORE_DEVICE)); at++)
        found = at;
    if (colon == title || strncmp(colon, ": ", 2) != 0 || !found)
        return false;
    *owner = colon + 2;
    *owner_bytes = (size_t)(found - *owner);
    *device = (int32_t)strtol(found + strlen(BEFORE_DEVICE), NULL, 10);
    return true;
}

/* A worker of any daemon: its command is "farlightd", "--worker" and the title. */
static void print_worker(const char *path, int device)
{
    static const char before[] = "farlightd\0--worker";
    char command[CMDLINE_BYTES + 1] = "", name[CMDLINE_BYTES];
    const char *owner;
    size_t owner_bytes;
    uint32_t worker;
    int32_t at;
    FILE *file = fopen(path, "re");
    if (!file)
        return;
    const size_t bytes = fread(command, 1, CMDLINE_BYTES, file);
    fclose(file);
    if (bytes <= sizeof(before) || memcmp(command, before, sizeof(before)) != 0 ||
        !devices_read_title(command + sizeof(before), &worker, &owner, &owner_bytes, &at) || at != device)
        return;
    plain_text_copy(name, owner_bytes + 1 < sizeof(name) ? owner_bytes + 1 : sizeof(name), owner);
    printf("   worker %" PRIu32 ": %s (process %d)\n", worker, name, atoi(path + strlen("/proc/")));
}

static void print_workers(const glob_t *processes, int device)
{
    for (size_t i = 0; i < processes->gl_pathc; i++)
        print_worker(processes->gl_pathv[i], device);
}

int devices_print(void)
{
    struct gpu_device_info list[GPU_DEVICES_MAX];
    size_t count = gpu_device_list(list, GPU_DEVICES_MAX);
    glob_t processes;
    const bool has_processes = glob("/proc/[0-9]*/cmdline", 0, NULL, &processes) == 0;
    for (size_t i = 0; i < count; i++) {
        struct gpu_measured measured;
        printf("%d  %s  (%s, OpenGL %s%s)\n", list[i].index, list[i].name, list[i].vendor, list[i].version,
               list[i].software ? ", software" : "");
        if (gpu_measured_load(&list[i], &measured))
            printf("   first hits are traced from %.3g primitives a pixel on, from %.3g with several samples\n",
                   (double)measured.traced_from[0], (double)measured.traced_from[1]);
        else
            printf("   first hits are rasterised, until the first start measures\n");
        if (has_processes)
            print_workers(&processes, list[i].index);
    }
    if (has_processes)
        globfree(&processes);
    return count ? EXIT_SUCCESS : (fprintf(stderr, "farlightd: no device gives OpenGL 4.5\n"), EXIT_FAILURE);
}
