/* SPDX-License-Identifier: MIT */
/* Transactions of very many edits that share large arrays, of one object or of many, sound or not, in a scene with
 * limits: what counts is checked, once, within the limits; a refused or abandoned transaction changes nothing;
 * none takes longer than its size allows. Input: a byte of flags, then groups of four bytes: what is set or
 * removed, its first number, how often (a power of two), which arrays it has. Missing bytes are 0. */
#include "tests/fuzz/fuzz.h"

#include "scene/edit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define EDITS_MAX 16384u
#define ELEMENTS (1u << 16) /* elements of an array */
#define HOST_BYTES_MAX (UINT64_C(32) << 20)
/* Maximum time of an input. Without sanitizers the largest takes some 10 ms: a table of 16,384 edits, and 32
 * MiB that are read. Checking the arrays of every edit would take a minute. */
#define SECONDS_MAX 10.0

enum array { POSITIONS, POSITIONS_WITH_NAN, INDICES, INDICES_BEYOND, JOINTS, MATRICES, ARRAYS };
static struct blob *arrays[ARRAYS];

static void make_arrays(void)
{
    static const size_t element_bytes[ARRAYS] = {12, 12, 12, 12, 4, 48};
    for (int i = 0; i < ARRAYS; i++) {
        arrays[i] = blob_create(ELEMENTS * element_bytes[i]);
        FUZZ_REQUIRE(arrays[i]);
        memset(arrays[i]->data, 0, arrays[i]->size_bytes);
    }
    const float nan = NAN;
    const uint32_t beyond = ELEMENTS, node = 1;
    memcpy(arrays[POSITIONS_WITH_NAN]->data + arrays[POSITIONS_WITH_NAN]->size_bytes - 4, &nan, 4);
    memcpy(arrays[INDICES_BEYOND]->data + arrays[INDICES_BEYOND]->size_bytes - 4, &beyond, 4);
    for (size_t i = 0; i < ELEMENTS; i++)
        memcpy(arrays[JOINTS]->data + 4 * i, &node, 4);
}

static void make_edit(struct scene_edit *edit, unsigned what, uint32_t id, unsigned which)
{
    static const enum object_kind kinds[] = {OBJECT_MESH, OBJECT_SKIN, OBJECT_NODE, OBJECT_MATERIAL};
    *edit = (struct scene_edit){.kind = what & 4 ? EDIT_REMOVE : EDIT_SET, .object = kinds[what % 4], .id = id};
    if (edit->kind == EDIT_REMOVE)
        return;
    edit->set.node.base.id = id;
    if (edit->object == OBJECT_MESH) {
        struct scene_mesh *mesh = &edit->set.mesh;
        mesh->value.vertex_count = ELEMENTS - (which == 7); /* which does not fit the arrays */
        mesh->value.triangle_count = ELEMENTS;
        mesh->arrays[MESH_POSITIONS] = blob_ref(arrays[which & 1 ? POSITIONS_WITH_NAN : POSITIONS]);
        mesh->arrays[MESH_INDICES] = blob_ref(arrays[which & 2 ? INDICES_BEYOND : INDICES]);
    } else if (edit->object == OBJECT_SKIN) {
        edit->set.skin.value.joint_count = ELEMENTS;
        edit->set.skin.joints = blob_ref(arrays[JOINTS]);
        edit->set.skin.joint_from_mesh = which & 1 ? NULL : blob_ref(arrays[MATRICES]);
    } else if (edit->object == OBJECT_NODE) {
        edit->set.node.value.parent = which & 1 ? id - 1 : 0;
        edit->set.node.value.parent_from_node[0] = edit->set.node.value.parent_from_node[5] = 1;
        edit->set.node.value.parent_from_node[10] = 1;
    }
}

/* Returns how many. */
static size_t make_edits(struct scene_edit *edits, const uint8_t *data, size_t size)
{
    size_t count = 0;
    for (; size >= 4 && count < EDITS_MAX; data += 4, size -= 4) {
        size_t often = (size_t)1 << data[2] % 15;
        bool same = data[2] & 16;
        for (size_t i = 0; i < often && count < EDITS_MAX; i++)
            make_edit(&edits[count++], data[0], data[1] % 8 + (same ? 0 : (uint32_t)i), data[3] % 8);
    }
    return count;
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now); /* not the one that tests replace */
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!arrays[0])
        make_arrays();
    const unsigned flags = size ? data[0] : 0;
    const double start_s = now_s();
    const struct scene_limits limits = {.host_bytes = HOST_BYTES_MAX, .nodes = flags & 1 ? 100 : 0};
    struct scene *scene = scene_create("fuzz", &limits);
    struct scene_edit *edits = calloc(EDITS_MAX, sizeof(*edits));
    FUZZ_REQUIRE(scene && edits);
    for (int round = 0; round < 2; round++) {
        struct error error = {0};
        const struct scene before = *scene;
        const atomic_bool abandoned = round == 0 && flags & 2;
        size_t count = size ? make_edits(edits, data + 1, size - 1) : 0;
        bool applied = scene_commit_unless(scene, edits, count, &abandoned, &error);
        FUZZ_REQUIRE(applied ? scene->revision == before.revision + 1 : error.kind != ERROR_NONE);
        FUZZ_REQUIRE(!applied || !abandoned || !count);
        if (!applied) {
            FUZZ_REQUIRE(scene->revision == before.revision && scene->host_bytes == before.host_bytes);
            for (int kind = 0; kind < OBJECT_COUNT; kind++)
                FUZZ_REQUIRE(scene->objects[kind].count == before.objects[kind].count);
        }
        FUZZ_REQUIRE(scene->host_bytes <= HOST_BYTES_MAX);
        for (size_t i = 0; i < count; i++)
            scene_edit_finish(&edits[i]);
    }
    free(edits);
    scene_destroy(scene);
    for (int i = 0; i < ARRAYS; i++)
        FUZZ_REQUIRE(atomic_load(&arrays[i]->references) == 1);
    FUZZ_REQUIRE(now_s() - start_s < SECONDS_MAX);
    return 0;
}
