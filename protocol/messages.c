/* SPDX-License-Identifier: MIT */
/* Words of enumerations as text, and defaults of messages. */
#include "protocol/messages.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "protocol/describe.h"

static const struct enum_desc *find_enum(const char *name)
{
    for (size_t i = 0; i < protocol_enum_count; i++) {
        if (strcmp(protocol_enums[i].name, name) == 0) {
            return &protocol_enums[i];
        }
    }
    return NULL;
}

static const char *value_text(const char *enum_name, uint32_t number)
{
    const struct enum_desc *desc = find_enum(enum_name);
    const char *text = desc ? enum_desc_text(desc, number) : NULL;
    return text ? text : "?";
}

static const struct value_desc *find_value(const char *enum_name, const char *text)
{
    const struct enum_desc *desc = find_enum(enum_name);
    for (size_t i = 0; desc && text && i < desc->value_count; i++) {
        if (strcmp(desc->values[i].text, text) == 0) {
            return &desc->values[i];
        }
    }
    return NULL;
}

#define ENUMERATION(NAME, name, doc)                                                                              \
    const char *protocol_##name##_text(enum protocol_##name value)                                                \
    {                                                                                                             \
        return value_text(#name, (uint32_t)value);                                                                \
    }                                                                                                             \
    bool protocol_##name##_parse(const char *text, enum protocol_##name *out)                                     \
    {                                                                                                             \
        const struct value_desc *value = find_value(#name, text);                                                 \
        if (value) {                                                                                              \
            *out = (enum protocol_##name)value->number;                                                           \
        }                                                                                                         \
        return value;                                                                                             \
    }
#include "protocol/words.def"

bool protocol_layers_parse(const char *text, unsigned *layers)
{
    const struct enum_desc *desc = find_enum("layer");
    const size_t length = strlen(text);
    bool found = false;
    for (size_t i = 0; i < desc->value_count; i++) {
        const char *known = desc->values[i].text;
        if (strncmp(known, text, length) != 0 || strspn(known + length, "0123456789") != strlen(known + length)) {
            continue;
        }
        *layers |= 1u << desc->values[i].number;
        found = true;
    }
    return found;
}

/* For a word of a series "x0", "x1", .. the index of its first word; else i. */
static size_t series_start(const struct enum_desc *desc, size_t i)
{
    const char *word = desc->values[i].text;
    const size_t length = strlen(word);
    const size_t number =
        length > 1 && isdigit((unsigned char)word[length - 1]) ? (size_t)(word[length - 1] - '0') : i + 1;
    const char *first = number <= i ? desc->values[i - number].text : "";
    const bool is_series =
        strlen(first) == length && memcmp(first, word, length - 1) == 0 && first[length - 1] == '0';
    return is_series ? i - number : i;
}

const char *protocol_enum_list(const char *enum_name, char *out, size_t out_bytes)
{
    const struct enum_desc *desc = find_enum(enum_name);
    size_t used = 0;
    if (out_bytes == 0) {
        return out;
    }
    out[0] = '\0';
    for (size_t i = 0; desc && i < desc->value_count; i++) {
        const bool begins = i + 1 < desc->value_count && series_start(desc, i + 1) == i;
        if (series_start(desc, i) < i) {
            continue;
        }
        int written = snprintf(out + used, out_bytes - used, "%s%.*s", i == 0 ? "" : ", ",
                               (int)(strlen(desc->values[i].text) - (begins ? 1 : 0)), desc->values[i].text);
        if (written < 0 || (size_t)written >= out_bytes - used) {
            break; /* cut off, but terminated */
        }
        used += (size_t)written;
    }
    return out;
}

void message_init(struct message *message, enum message_type type)
{
    const struct message_desc *desc = message_describe(type);
    memset(message, 0, sizeof(*message));
    message->type = type;
    if (desc) {
        struct_defaults(desc->body(), (char *)message + MESSAGE_BODY_OFFSET);
    }
}

const char *message_type_text(uint32_t type)
{
    const struct message_info *info = message_lookup(type);
    return info ? info->name : "unknown";
}
