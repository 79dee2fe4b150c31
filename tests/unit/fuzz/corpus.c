/* SPDX-License-Identifier: MIT */
/* Inputs that fuzzers found worth keeping, once through each of them: tests/fuzz/corpus/NAME/ through
 * fuzz_NAME.c, which is built for this with another name for its one function. */
#include "tests/harness/test.h"

#include <dirent.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef int fuzz_one_fn(const uint8_t *data, size_t size);
fuzz_one_fn fuzz_one_assimp, fuzz_one_environment, fuzz_one_gltf, fuzz_one_nff, fuzz_one_obj, fuzz_one_threemf,
    fuzz_one_coarse_depth, fuzz_one_codec, fuzz_one_frame, fuzz_one_framing, fuzz_one_handshake, fuzz_one_request,
    fuzz_one_scene, fuzz_one_sealed, fuzz_one_session, fuzz_one_transaction, fuzz_one_warp;

/* In a block of its own size, so that a sanitizer sees a read beyond it. */
static uint8_t *read_file(const char *path, size_t *size_bytes)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    *size_bytes = (size_t)ftell(file);
    rewind(file);
    uint8_t *data = malloc(*size_bytes ? *size_bytes : 1);
    assert_non_null(data);
    assert_int_equal(fread(data, 1, *size_bytes, file), *size_bytes);
    fclose(file);
    return data;
}

static void run(const char *name, fuzz_one_fn *one)
{
    char path[512];
    snprintf(path, sizeof(path), "tests/fuzz/corpus/%s", name);
    DIR *folder = opendir(path);
    if (!folder)
        fail_msg("%s is not there: the working folder is to be that of the sources", path);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(folder));) {
        if (entry->d_name[0] == '.')
            continue;
        snprintf(path, sizeof(path), "tests/fuzz/corpus/%s/%s", name, entry->d_name);
        size_t size_bytes;
        uint8_t *data = read_file(path, &size_bytes);
        one(data, size_bytes); /* which stops the program where a rule is broken */
        free(data);
        count++;
    }
    closedir(folder);
    assert_true(count > 0);
}

TEST(coarse_depth)
{
    run("coarse_depth", fuzz_one_coarse_depth);
}

TEST(codec)
{
    run("codec", fuzz_one_codec);
}

TEST(frame)
{
    run("frame", fuzz_one_frame);
}

TEST(framing)
{
    run("framing", fuzz_one_framing);
}

TEST(obj)
{
    run("obj", fuzz_one_obj);
}

TEST(assimp)
{
    run("assimp", fuzz_one_assimp);
}

TEST(environment)
{
    run("environment", fuzz_one_environment);
}

TEST(threemf)
{
    run("threemf", fuzz_one_threemf);
}

TEST(nff)
{
    run("nff", fuzz_one_nff);
}

TEST(gltf)
{
    run("gltf", fuzz_one_gltf);
}

TEST(handshake)
{
    run("handshake", fuzz_one_handshake);
}

TEST(request)
{
    run("request", fuzz_one_request);
}

TEST(scene)
{
    run("scene", fuzz_one_scene);
}

TEST(sealed)
{
    run("sealed", fuzz_one_sealed);
}

TEST(session)
{
    run("session", fuzz_one_session);
}

TEST(transaction)
{
    run("transaction", fuzz_one_transaction);
}

TEST(warp)
{
    run("warp", fuzz_one_warp);
}
