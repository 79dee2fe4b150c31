/* SPDX-License-Identifier: MIT */
/* Models loaded into this process: held against what the importer says is in them. */
#include "tests/bench/load_model.h"

#include "lib/farlight.h"
#include "tests/harness/test.h"

#include <stddef.h>
#include <stdint.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Two triangles with texture coordinates and a material, in two objects. */
static const char small_obj[] = "mtllib small.mtl\n"
                                "o first\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
                                "usemtl red\nf 1/1 2/2 3/3\no second\nf 1/1 3/3 4/2\n";
static const char small_mtl[] = "newmtl red\nKd 0.8 0.1 0.1\n";
static const char small_nff[] = "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 64 64\n"
                                "f 1 0.5 0.2 1 0 0 0 1\ns 0 0 0 1\ns 1 2 3 0.5\n";

static void write_file(const char *folder, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof(path), "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_int_equal(fputs(text, file) >= 0, 1);
    fclose(file);
}

static void remove_file(const char *folder, const char *name)
{
    char path[256];
    snprintf(path, sizeof(path), "%s/%s", folder, name);
    unlink(path);
}

static uint64_t triangles_of(const struct scene *scene)
{
    uint64_t triangles = 0;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_MESH], &cursor, NULL, &value))
        triangles += ((const struct scene_mesh *)value)->triangle_count;
    return triangles;
}

static uint64_t spheres_of(const struct scene *scene)
{
    uint64_t spheres = 0;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_SPHERES], &cursor, NULL, &value))
        spheres += ((const struct scene_spheres *)value)->sphere_count;
    return spheres;
}

/* Loads it both ways; the importer's own counts are those of `farlight info`. */
static void expect_what_the_importer_counts(const char *path)
{
    struct loaded_model model;
    struct error error = {0};
    struct fl_error failed = {0};
    if (!load_model(&model, path, &error))
        fail_msg("%s: %s: %s", path, error.field, error.text);
    struct fl_model_info *info = fl_model_info(&(struct fl_load_options){.model = path}, 0, &failed);
    if (!info)
        fail_msg("%s: %s", path, failed.text);
    assert_int_equal(triangles_of(model.scene), info->triangles);
    assert_int_equal(spheres_of(model.scene), info->spheres);
    assert_int_equal(model.scene->objects[OBJECT_NODE].count, info->nodes);
    assert_int_equal(model.scene->objects[OBJECT_MESH].count, info->meshes);
    assert_int_equal(model.scene->objects[OBJECT_MATERIAL].count, info->materials);
    assert_int_equal(model.scene->objects[OBJECT_TEXTURE].count, info->textures);
    assert_int_equal(model.scene->objects[OBJECT_LIGHT].count, info->lights);
    assert_int_equal(model.blob_bytes, info->import.offered_bytes);
    assert_int_equal(model.scene->revision, 1);
    fl_model_info_destroy(info);
    load_model_finish(&model);
    assert_null(model.scene);
}

static int make_folder(void **state)
{
    static char folder[64];
    snprintf(folder, sizeof(folder), "%s/farlight-load-XXXXXX", P_tmpdir);
    if (!mkdtemp(folder))
        return -1;
    write_file(folder, "small.obj", small_obj);
    write_file(folder, "small.mtl", small_mtl);
    write_file(folder, "small.nff", small_nff);
    write_file(folder, "broken.obj", "f 1 2 3\n");
    *state = folder;
    return 0;
}

static int remove_folder(void **state)
{
    static const char *const names[] = {"small.obj", "small.mtl", "small.nff", "broken.obj"};
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++)
        remove_file(*state, names[i]);
    return rmdir(*state);
}

ALL_TESTS(make_folder, remove_folder)

TEST(a_mesh_arrives_with_what_the_importer_counts)
{
    char path[256];
    snprintf(path, sizeof(path), "%s/small.obj", (const char *)*state);
    struct loaded_model model;
    struct error error = {0};
    assert_true(load_model(&model, path, &error));
    assert_int_equal(triangles_of(model.scene), 2);
    load_model_finish(&model);
    expect_what_the_importer_counts(path);
}

TEST(spheres_and_the_camera_arrive)
{
    char path[256];
    snprintf(path, sizeof(path), "%s/small.nff", (const char *)*state);
    struct loaded_model model;
    struct error error = {0};
    float m[12];
    assert_true(load_model(&model, path, &error));
    assert_int_equal(spheres_of(model.scene), 2);
    assert_int_not_equal(model.camera, 0);
    assert_true(scene_world_from_node(model.scene, NULL, model.camera, m));
    assert_float_equal(m[11], 5.0f, 1e-5f); /* `from` */
    load_model_finish(&model);
    expect_what_the_importer_counts(path);
}

TEST(what_cannot_be_loaded_is_an_error_that_says_why)
{
    char path[256];
    struct loaded_model model;
    struct error error = {0};
    snprintf(path, sizeof(path), "%s/absent.obj", (const char *)*state);
    assert_false(load_model(&model, path, &error));
    assert_non_null(strstr(error.text, "cannot be read"));
    assert_null(model.scene);
    error = (struct error){0};
    snprintf(path, sizeof(path), "%s/broken.obj", (const char *)*state);
    assert_false(load_model(&model, path, &error));
    assert_true(strlen(error.text) > 0);
    assert_null(model.scene);
}

TEST(real_models_arrive_with_what_the_importer_counts)
{
    static const char *const names[] = {"common/dragon-11k.glb", "gltf/DamagedHelmet.glb", "bvh/spd-tetra.nff",
                                        "gltf/samplebuilding.gltf"};
    const char *folder = getenv("FARLIGHT_SCENES");
    unsigned found = 0;
    (void)state;
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
        char path[512];
        snprintf(path, sizeof(path), "%s/%s", folder ? folder : "../shared/scenes", names[i]);
        if (access(path, R_OK) != 0)
            continue;
        expect_what_the_importer_counts(path);
        found++;
    }
    if (found == 0) {
        print_message("skipped: no models below FARLIGHT_SCENES\n");
        skip();
    }
}
