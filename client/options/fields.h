/* SPDX-License-Identifier: MIT */
/* Options that are fields of the message `render`: range, names, unit and default come from its description, so
 * that command line, environment, shot files, completion and manual agree. */
#ifndef FARLIGHT_OPTIONS_FIELDS_H
#define FARLIGHT_OPTIONS_FIELDS_H

#include "job.h"
#include "protocol/describe.h"

enum cli_group {
    CLI_GROUP_OUTPUT,
    CLI_GROUP_PICTURE,
    CLI_GROUP_CAMERA,
    CLI_GROUP_VIEWS,
    CLI_GROUP_CLIPS,
    CLI_GROUP_METHOD,
    CLI_GROUP_LIGHT,
    CLI_GROUP_TRACERS, /* first of one group for each tracer */
    CLI_GROUP_TALK = 100
};

struct cli_field {
    char option[48]; /* "ldc-resolution" */
    char member[48]; /* name in a shot file: "ldc_resolution" */
    char help[480];  /* "Cells along the longest side of the sampled box, 16 to 4096 (default 1024)" */
    const char *argument;
    const struct field_desc *field;
    int group;
    size_t given_offset; /* offset of a bool in struct cli_job that is set with the option; 0: none */
    bool is_of_shot;     /* a member of shot files */
};

size_t cli_field_count(void);
const struct cli_field *cli_field_at(size_t index);
const struct cli_field *cli_field_find(const char *option); /* NULL: there is none */
/* Sets the field from text; `name` is the option's, for messages. Returns 0, or EINVAL with the job's error
 * set. */
error_t cli_field_set(struct cli_job *job, const struct cli_field *option, const char *name, const char *value);
/* Reports a value that is not in an enumeration: "unknown tone map 'x'", with the known ones. Returns EINVAL. */
error_t cli_unknown_value(struct cli_job *job, const char *name, const char *enum_name, const char *value);

#endif
