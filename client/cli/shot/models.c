/* SPDX-License-Identifier: MIT */
/* Several models of a shot file, and where they stand. */
#include "read.h"
#include "options/job.h"
#include "options/models.h"

#define PLACE_MAX 1e9 /* metres or degrees, as in the importer */
#define SCALE_MIN 1e-6
#define SCALE_MAX 1e6

static bool read_three(const struct shot_reader *reader, const struct shot_value *at, float numbers[3])
{
    if (!json_is_array(at->value) || json_array_size(at->value) != 3)
        return shot_wrong(reader, at, "write it like [1, 0, 2]", "must be an array of 3 numbers");
    for (size_t i = 0; i < 3; i++) {
        const struct shot_value element = shot_element(at, i);
        double number = 0;
        if (!shot_number(reader, &element, -PLACE_MAX, PLACE_MAX, &number))
            return false;
        numbers[i] = (float)number;
    }
    return true;
}

static bool read_place(const struct shot_reader *reader, const struct shot_value *at, struct fl_model *model)
{
    const struct shot_value position = shot_member(at, "at"), turn = shot_member(at, "rotation_degrees"),
                            scale = shot_member(at, "scale");
    double factor = 1;
    if ((position.value && !read_three(reader, &position, model->position)) ||
        (turn.value && !read_three(reader, &turn, model->degrees)) ||
        (scale.value && !shot_number(reader, &scale, SCALE_MIN, SCALE_MAX, &factor)))
        return false;
    model->scale = (float)factor;
    model->is_placed = position.value || turn.value || scale.value;
    return true;
}

static bool apply_model(const struct shot_reader *reader, const struct shot_value *at)
{
    static const char *const known[] = {"model", "at", "rotation_degrees", "scale", NULL};
    struct cli_job *job = reader->job;
    const bool is_object = json_is_object(at->value);
    const struct shot_value written = is_object ? shot_member(at, "model") : *at;
    const char *path = NULL;
    if (is_object && !shot_is_object(reader, at, known))
        return false;
    if (!written.value)
        return shot_wrong(reader, at, "\"model\": a path relative to this file's folder", "\"model\" is missing");
    if (!shot_path(reader, &written, &path))
        return false;
    if (cli_set_model(job, path) != 0)
        return shot_wrong(reader, &written, "leave it out", "%s", job->error.text);
    return !is_object || read_place(reader, at, &job->input.models[job->input.count - 1]);
}

bool shot_models(const struct shot_reader *reader, const struct shot_value *at)
{
    if (!shot_is_array(reader, at, FL_MODELS_MAX))
        return false;
    if (json_array_size(at->value) == 0)
        return shot_wrong(reader, at, "\"models\": [\"room.glb\"]", "contains no file");
    for (size_t i = 0; i < json_array_size(at->value); i++) {
        const struct shot_value model = shot_element(at, i);
        if (!apply_model(reader, &model))
            return false;
    }
    return true;
}
