/* SPDX-License-Identifier: MIT */
#include "protocol/codec.h"

#include <inttypes.h>
#include <string.h>

#include "protocol/describe.h"
#include "protocol/plain_text.h"

#define ELEMENTS_SHOWN 4u /* of an array */
#define BYTES_SHOWN 8u    /* of bulk data and long byte arrays */
#define TEXT_SHOWN 200u

static void print_struct(FILE *stream, const struct struct_desc *desc, const char *body);

/* Characters that are not plain are written as their bytes. */
static void print_text(FILE *stream, const char *text)
{
    size_t shown = 0;
    fputc('"', stream);
    while (*text != '\0' && shown < TEXT_SHOWN) {
        uint32_t code = 0;
        size_t length = utf8_read(text, UTF8_BYTES_MAX, &code);
        bool plain = length > 0 && plain_text_allows(code);
        if (code == '"' || code == '\\') {
            fputc('\\', stream);
        }
        for (size_t end = shown + (length > 0 ? length : 1); shown < end; text++, shown++) {
            fprintf(stream, plain ? "%c" : "\\x%02x", (unsigned char)*text);
        }
    }
    fputs(*text != '\0' ? "\".." : "\"", stream);
}

static void print_hex(FILE *stream, const uint8_t *bytes, uint32_t count)
{
    for (uint32_t i = 0; i < count && i < BYTES_SHOWN; i++) {
        fprintf(stream, "%02x", bytes[i]);
    }
    if (count > BYTES_SHOWN) {
        fputs("..", stream);
    }
}

static void print_fixed(FILE *stream, const struct field_desc *field, const char *place)
{
    const char *text = NULL;
    switch (field->kind) {
    case FIELD_INT:
        fprintf(stream, "%" PRIu64, field_load_int(field, place));
        break;
    case FIELD_ENUM:
        text = enum_desc_text(field->enumeration, (uint32_t)field_load_int(field, place));
        if (text) {
            fputs(text, stream);
        } else {
            fprintf(stream, "?%" PRIu64, field_load_int(field, place));
        }
        break;
    case FIELD_REAL:
        for (uint32_t i = 0; i < field->count; i++) {
            float value;
            memcpy(&value, place + 4 * i, 4);
            fprintf(stream, "%s%.9g", i == 0 ? "" : ",", (double)value);
        }
        break;
    default:
        print_hex(stream, (const uint8_t *)place, field->count);
        break;
    }
}

static void print_array(FILE *stream, const struct field_desc *field, const char *elements, uint32_t count)
{
    const struct struct_desc *record = field->record();
    fprintf(stream, "[%" PRIu32, count);
    for (uint32_t i = 0; elements && i < count && i < ELEMENTS_SHOWN; i++) {
        fputs(i == 0 ? ": {" : ", {", stream);
        print_struct(stream, record, elements + i * record->size_bytes);
        fputc('}', stream);
    }
    fputs(count > ELEMENTS_SHOWN ? ", ..]" : "]", stream);
}

static void print_struct(FILE *stream, const struct struct_desc *desc, const char *body)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        const char *pointer = NULL;
        uint32_t count = 0;
        fprintf(stream, "%s%s=", field == desc->fields ? "" : " ", field->name);
        if (!field_is_counted(field)) {
            print_fixed(stream, field, body + field->offset);
            continue;
        }
        memcpy(&pointer, body + field->offset, sizeof(pointer));
        if (field->kind == FIELD_STRING) {
            print_text(stream, pointer ? pointer : "");
            continue;
        }
        memcpy(&count, body + field->count_offset, sizeof(count));
        if (field->kind == FIELD_ARRAY) {
            print_array(stream, field, pointer, count);
        } else {
            fprintf(stream, "<%" PRIu32 " bytes%s", count, count > 0 ? ": " : "");
            print_hex(stream, (const uint8_t *)pointer, pointer ? count : 0);
            fputc('>', stream);
        }
    }
}

void message_print(FILE *stream, const struct message *message)
{
    const struct message_desc *desc = message_describe(message->type);
    if (!desc) {
        fprintf(stream, "unknown type=0x%04x", (unsigned)message->type);
        return;
    }
    const struct struct_desc *body = desc->body();
    fprintf(stream, "%s%s", desc->info.name, body->fields->name ? " " : "");
    print_struct(stream, body, (const char *)message + MESSAGE_BODY_OFFSET);
}
