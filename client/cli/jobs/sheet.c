/* SPDX-License-Identifier: MIT */
/* Layout and drawing of contact sheets. */
#include "sheet.h"

#include <stdlib.h>
#include <string.h>

#define GAP 8u /* pixels between cells, and around them */
#define NAME_PIXELS 22u
#define LINE_PIXELS 18u
#define LETTER_PIXELS 9u /* mean width of a letter of the exporter's font, and a little more */
#define USUAL_WIDTH 1600u
#define EDGE_MAX 8192u
#define PAPER 0x22u
#define EMPTY 0x30u
#define INK 0xe8e8e8u
#define FAULT_INK 0xff9a8au
#define LINES_MAX 16u

static uint8_t *pixel_at(const struct sheet *sheet, uint32_t x, uint32_t y)
{
    return sheet->frame.pixels + ((size_t)y * sheet->frame.width + x) * 4;
}

static void fill(const struct sheet *sheet, uint32_t x, uint32_t y, const uint32_t size[2], uint8_t grey)
{
    for (uint32_t row = 0; row < size[1]; row++) {
        memset(pixel_at(sheet, x, y + row), grey, (size_t)size[0] * 4);
        for (uint32_t column = 0; column < size[0]; column++)
            pixel_at(sheet, x + column, y + row)[3] = 255;
    }
}

static void place(const struct sheet *sheet, uint32_t index, uint32_t *x, uint32_t *y)
{
    *x = GAP + index % sheet->columns * (sheet->cell_width + GAP);
    *y = GAP + index / sheet->columns * (sheet->cell_height + NAME_PIXELS + GAP);
}

bool sheet_begin(struct sheet *sheet, const uint32_t cell[2], uint32_t columns, uint32_t count,
                 struct fl_error *error)
{
    const uint32_t usual = USUAL_WIDTH / (cell[0] + GAP) > 0 ? USUAL_WIDTH / (cell[0] + GAP) : 1;
    const uint32_t across = columns > 0 ? columns : usual < count ? usual : count;
    const uint32_t rows = (count + across - 1) / across;
    const uint64_t width = GAP + (uint64_t)across * (cell[0] + GAP),
                   height = GAP + (uint64_t)rows * (cell[1] + NAME_PIXELS + GAP);
    if (width > EDGE_MAX || height > EDGE_MAX) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--output",
                     "a sheet of %u pictures would have %llux%llu pixels, and %ux%u are the most", count,
                     (unsigned long long)width, (unsigned long long)height, EDGE_MAX, EDGE_MAX);
        return fl_error_remedy(error, "make them smaller with --size, or write one file for each: -o FOLDER/");
    }
    *sheet = (struct sheet){.cell_width = cell[0], .cell_height = cell[1], .columns = across, .count = count};
    sheet->frame = (struct fl_frame){.width = (uint32_t)width,
                                     .height = (uint32_t)height,
                                     .samples = 1,
                                     .layers = 1,
                                     .fov_y = 1,
                                     .format = PROTOCOL_PIXEL_FORMAT_RGBA8,
                                     .pixels_bytes = (size_t)width * height * 4};
    sheet->frame.pixels = malloc(sheet->frame.pixels_bytes);
    sheet->texts = calloc((size_t)count * (1 + LINES_MAX), sizeof(*sheet->texts));
    if (!sheet->frame.pixels || !sheet->texts)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    fill(sheet, 0, 0, (const uint32_t[2]){(uint32_t)width, (uint32_t)height}, PAPER);
    return true;
}

static bool add_text(struct sheet *sheet, uint32_t x, uint32_t baseline, uint32_t colour, char *text,
                     struct fl_error *error)
{
    if (!text)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    sheet->texts[sheet->text_count++] = (struct fl_export_text){
        .x = x, .baseline = baseline, .width = sheet->cell_width, .colour = colour, .text = text};
    return true;
}

static bool put_name(struct sheet *sheet, uint32_t index, const char *name, struct fl_error *error)
{
    uint32_t x, y;
    place(sheet, index, &x, &y);
    return add_text(sheet, x, y + sheet->cell_height + NAME_PIXELS - 6, INK, strdup(name), error);
}

/* Draws the picture over the paper, which a transparent background shows. */
bool sheet_put(struct sheet *sheet, uint32_t index, const char *name, const struct fl_frame *picture,
               struct fl_error *error)
{
    uint32_t x, y;
    place(sheet, index, &x, &y);
    fill(sheet, x, y, (const uint32_t[2]){sheet->cell_width, sheet->cell_height}, EMPTY);
    for (uint32_t row = 0; row < sheet->cell_height; row++)
        for (uint32_t column = 0; column < sheet->cell_width; column++) {
            const uint8_t *from = picture->pixels + ((size_t)row * picture->width + column) * 4;
            uint8_t *to = pixel_at(sheet, x + column, y + row);
            for (int c = 0; c < 3; c++)
                to[c] = (uint8_t)((from[c] * from[3] + to[c] * (255 - from[3]) + 127) / 255);
        }
    return put_name(sheet, index, name, error);
}

/* The length of the text's first line of at most `width` bytes: whole words, unless one is too long. */
static size_t line_length(const char *text, size_t width)
{
    const size_t length = strlen(text);
    if (length <= width)
        return length;
    for (size_t i = width; i > width / 4; i--)
        if (text[i] == ' ')
            return i;
    while (width > 1 && ((unsigned char)text[width] & 0xc0) == 0x80) /* a continuation byte */
        width--;
    return width;
}

bool sheet_put_failure(struct sheet *sheet, uint32_t index, const char *name, const char *why,
                       struct fl_error *error)
{
    const uint32_t room = sheet->cell_height / LINE_PIXELS;
    const size_t lines_max = room < LINES_MAX ? room : LINES_MAX, width = sheet->cell_width / LETTER_PIXELS;
    uint32_t x, y;
    place(sheet, index, &x, &y);
    fill(sheet, x, y, (const uint32_t[2]){sheet->cell_width, sheet->cell_height}, EMPTY);
    for (size_t i = 0; i < lines_max && *why != '\0'; i++) {
        const size_t length = line_length(why, width > 0 ? width : 1);
        if (!add_text(sheet, x, y + (uint32_t)(i + 1) * LINE_PIXELS, FAULT_INK, strndup(why, length), error))
            return false;
        why += length;
        why += strspn(why, " ");
    }
    return put_name(sheet, index, name, error);
}

void sheet_end(struct sheet *sheet)
{
    for (size_t i = 0; i < sheet->text_count; i++)
        free((char *)(uintptr_t)sheet->texts[i].text); /* the sheet's own copies */
    free(sheet->texts);
    free(sheet->frame.pixels);
    *sheet = (struct sheet){0};
}
