/* SPDX-License-Identifier: MIT */
/* A tracer's description of its structure, for people and for scripts. The words are the tracer's. */
#include "structure.h"
#include "options/talk.h"

#include <stdio.h>
#include <string.h>

void cli_structure_warn(const struct fl_frame *frame, struct cli_warned *warned, struct cli_progress *progress)
{
    for (size_t i = 0; i < frame->structure_count; i++) {
        const struct record_structure_row *row = &frame->structure[i];
        bool known = row->warning[0] == '\0' || warned->count == CLI_WARNED_MAX;
        for (size_t k = 0; k < warned->count && !known; k++)
            known = strcmp(warned->names[k], row->name) == 0;
        if (known)
            continue;
        snprintf(warned->names[warned->count++], sizeof(warned->names[0]), "%s", row->name);
        char where[24];
        snprintf(where, sizeof(where), "frame %u", frame->frame);
        cli_progress_clear(progress);
        cli_note(&(struct fl_note){.severity = PROTOCOL_SEVERITY_WARNING, .where = where, .text = row->warning},
                 true);
    }
}

void cli_structure_set_json(json_t *object, const struct fl_frame *frame)
{
    json_t *structure = json_object(), *warnings = json_array();
    for (size_t i = 0; i < frame->structure_count; i++) {
        const struct record_structure_row *row = &frame->structure[i];
        char name[FL_STRUCTURE_NAME_BYTES + 16];
        const bool is_counted = row->unit == PROTOCOL_UNIT_NUMBER || row->unit == PROTOCOL_UNIT_BUILT;
        snprintf(name, sizeof(name), "%s%s%s", row->name, is_counted ? "" : "_",
                 is_counted ? "" : protocol_unit_text(row->unit));
        json_object_set_new(structure, name,
                            !is_counted                        ? json_real((double)row->measure)
                            : row->unit == PROTOCOL_UNIT_BUILT ? json_boolean(row->number != 0)
                                                               : json_integer((json_int_t)row->number));
        if (row->warning[0] != '\0')
            json_array_append_new(warnings, json_string(row->warning));
    }
    json_object_set_new(object, "structure", structure);
    json_object_set_new(object, "warnings", warnings);
}
