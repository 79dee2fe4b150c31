/* SPDX-License-Identifier: MIT */
#include "aff.h"

#include "model.h"
#include "texture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool aff_read_texture(struct aff *aff, uint32_t *texture, const char *of)
{
    struct import_scene *scene = aff->nff.scene;
    struct word word;
    char **grown;

    if (!word_reader_get(&aff->nff.reader, &word, of))
        return false;
    for (size_t i = 0; i < aff->texture_count; i++) {
        if (word_is(word, aff->textures[i])) {
            *texture = (uint32_t)i + 1;
            return true;
        }
    }
    if (aff->texture_count == AFF_TEXTURES_MAX)
        return import_fail(scene, word_reader_where(&aff->nff.reader), "more than %u images", AFF_TEXTURES_MAX);
    grown = import_grow(scene, aff->textures, aff->texture_count, &aff->texture_capacity, sizeof(*grown));
    if (!grown)
        return false;
    aff->textures = grown;
    grown[aff->texture_count] = strndup(word.text, word.length);
    if (!grown[aff->texture_count])
        return import_fail(scene, NULL, "out of memory");
    *texture = (uint32_t)++aff->texture_count;
    return true;
}

/* Takes the texels. An image that cannot be used is shown in a conspicuous colour. */
static uint32_t add_texture(const struct nff *nff, const char *name, struct texture_job *job)
{
    struct import_scene *scene = nff->scene;
    struct message_set_texture set = {.format = nff_keeps_values(nff) ? PROTOCOL_TEXTURE_RGBA8_LINEAR
                                                                      : PROTOCOL_TEXTURE_RGBA8_SRGB,
                                      .wrap_u = PROTOCOL_WRAP_REPEAT,
                                      .wrap_v = PROTOCOL_WRAP_REPEAT,
                                      .name = name};

    if (!job->texels) {
        import_note(scene, PROTOCOL_SEVERITY_WARNING, name,
                    "the image '%.100s' cannot be used: %.150s; it is shown in magenta and black", name,
                    job->reason);
        job->texels = texture_marker();
        job->width = job->height = 2;
        set.nearest = 1;
    }
    set.width = job->width;
    set.height = job->height;
    return import_add_texture(scene, &set,
                              import_add_blob(scene, job->texels, (uint64_t)set.width * set.height * 4));
}

bool aff_add_textures(struct aff *aff, uint32_t *ids)
{
    size_t count = aff->texture_count;
    struct texture_job *jobs = calloc(count + 1, sizeof(*jobs));

    if (!jobs)
        return import_fail(aff->nff.scene, NULL, "out of memory");
    for (size_t i = 0; i < count; i++) {
        char reason[FILES_REASON_BYTES] = "";

        jobs[i].srgb = true;
        jobs[i].bytes = files_read_image(aff->files, aff->textures[i], &jobs[i].size_bytes, reason);
        if (!jobs[i].bytes)
            snprintf(jobs[i].reason, sizeof(jobs[i].reason), "%.199s", reason);
    }
    texture_decode(jobs, count);
    for (size_t i = 0; i < count; i++) {
        free((void *)(uintptr_t)jobs[i].bytes);
        ids[i + 1] = add_texture(&aff->nff, aff->textures[i], &jobs[i]);
    }
    free(jobs);
    return !aff->nff.scene->failed;
}
