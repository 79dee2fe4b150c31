/* SPDX-License-Identifier: MIT */
/* The panel of a tracer's settings. */
#include "panel.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REAL_SMALLEST 1e-3f /* first value after 0, since a range of lengths has no natural unit */

const struct field_desc *panel_setting(enum protocol_tracer tracer, size_t index)
{
    const struct struct_desc *render = message_describe(MESSAGE_RENDER)->body();
    const struct field_desc *field = struct_field(render, "tracing")->record()->fields;
    for (; field->name; field++)
        if (field->tracer && strcmp(field->tracer, protocol_tracer_text(tracer)) == 0 && index-- == 0)
            return field;
    return NULL;
}

size_t panel_setting_count(enum protocol_tracer tracer)
{
    size_t count = 0;
    while (panel_setting(tracer, count))
        count++;
    return count;
}

/* Address of a setting, whose offset is as in the message. */
static void *place_of(const struct field_desc *setting, struct tracer_settings *settings)
{
    return (char *)settings + setting->offset - offsetof(struct record_tracing, settings);
}

void panel_value(const struct field_desc *setting, const struct tracer_settings *settings, char *text,
                 size_t text_bytes)
{
    struct tracer_settings copy = *settings;
    const void *place = place_of(setting, &copy);
    float real;
    if (setting->kind == FIELD_REAL) {
        memcpy(&real, place, sizeof(real));
        if (real == 0 && setting->zero_is_default)
            field_default_text(setting, text, text_bytes);
        else
            snprintf(text, text_bytes, "%g", (double)real);
        return;
    }
    const uint64_t number = field_load_int(setting, place);
    if (setting->kind == FIELD_ENUM)
        snprintf(text, text_bytes, "%s", enum_desc_text(setting->enumeration, (uint32_t)number));
    else if (number == 0 && setting->zero_is_default)
        field_default_text(setting, text, text_bytes);
    else
        snprintf(text, text_bytes, "%llu", (unsigned long long)number);
}

static uint64_t next_choice(const struct enum_desc *choices, uint64_t number, int step)
{
    const size_t count = choices->value_count;
    for (size_t i = 0; i < count; i++)
        if (choices->values[i].number == number)
            return choices->values[(i + count + (size_t)step) % count].number;
    return choices->values[0].number;
}

/* The next number of "2, 4, 8"; also 0 if that stands for a default outside of the list: auto. */
static uint64_t next_of_set(const struct field_desc *setting, uint64_t number, int step)
{
    uint64_t numbers[32];
    size_t count = 0, at = 0;
    if (setting->zero_is_default && setting->default_int == 0)
        numbers[count++] = 0;
    for (const char *text = setting->numbers; *text != '\0' && count < 32; text += strspn(text, ", ")) {
        char *end;
        numbers[count++] = strtoull(text, &end, 10);
        text = end;
    }
    for (size_t i = 0; i < count; i++)
        if (numbers[i] == number)
            at = i;
    return count > 0 ? numbers[(at + count + (size_t)step) % count] : number;
}

static uint64_t next_in_range(const struct field_desc *setting, uint64_t number, int step)
{
    const uint64_t next = step > 0 ? number * 2 : number / 2;
    return next < setting->min ? setting->min : next > setting->max ? setting->max : next;
}

static bool change_real(const struct field_desc *setting, void *place, int step)
{
    float before, value;
    memcpy(&before, place, sizeof(before));
    if (before == 0 && setting->zero_is_default)
        before = setting->default_real;
    value = before < REAL_SMALLEST ? (step > 0 ? REAL_SMALLEST : setting->real_min)
                                   : before * (step > 0 ? 2.0f : 0.5f);
    value = value < REAL_SMALLEST ? setting->real_min : value;
    value = value < setting->real_max ? value : setting->real_max;
    memcpy(place, &value, sizeof(value));
    return value < before || value > before;
}

bool panel_change(const struct field_desc *setting, struct tracer_settings *settings, int step)
{
    void *place = place_of(setting, settings);
    if (setting->kind == FIELD_REAL)
        return change_real(setting, place, step);
    uint64_t number = field_load_int(setting, place);
    if (number == 0 && setting->zero_is_default)
        number = setting->default_int;
    const uint64_t next = setting->kind == FIELD_ENUM ? next_choice(setting->enumeration, number, step)
                          : setting->numbers          ? next_of_set(setting, number, step)
                                                      : next_in_range(setting, number, step);
    field_store_int(setting, place, next);
    return next != number;
}
