/* SPDX-License-Identifier: MIT */
/* Boxes and texts of the overlay. */
#include "mark.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const struct hud_colour hud_panel = {14, 17, 22, 205}, hud_ink = {232, 236, 241, 255},
                        hud_faint = {148, 158, 170, 255}, hud_accent = {255, 190, 92, 255},
                        hud_alarm = {255, 110, 92, 255}, hud_calm = {120, 214, 140, 255},
                        hud_rule = {255, 255, 255, 26};

static struct hud_mark *add(struct hud_layout *layout)
{
    struct hud *hud = layout->hud;
    /* The last mark is overwritten if there are too many. */
    struct hud_mark *mark = &hud->marks[hud->count < HUD_MARKS_MAX ? hud->count++ : HUD_MARKS_MAX - 1];
    *mark = (struct hud_mark){0};
    return mark;
}

void hud_box(struct hud_layout *layout, double x, double y, double width, double height, struct hud_colour colour)
{
    struct hud_mark *mark = add(layout);
    mark->x = x;
    mark->y = y;
    mark->width = width;
    mark->height = height;
    mark->colour = colour;
}

double hud_text_width(const struct hud_layout *layout, enum hud_font font, const char *text)
{
    return layout->measure(layout->user, font, layout->line, text);
}

__attribute__((format(printf, 6, 0))) static struct hud_mark *add_text(struct hud_layout *layout, double x,
                                                                       double y, enum hud_font font,
                                                                       struct hud_colour colour,
                                                                       const char *format, va_list arguments)
{
    struct hud_mark *mark = add(layout);
    vsnprintf(mark->text, sizeof(mark->text), format, arguments);
    mark->x = x;
    mark->y = y;
    mark->height = layout->line;
    mark->font = font;
    mark->colour = colour;
    return mark;
}

void hud_fit(const struct hud_layout *layout, enum hud_font font, char *text, double width)
{
    for (size_t length = strlen(text); length > 4 && hud_text_width(layout, font, text) > width; length--)
        strcpy(text + length - 4, "..");
}

void hud_text(struct hud_layout *layout, double x, double y, enum hud_font font, struct hud_colour colour,
              const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_text(layout, x, y, font, colour, format, arguments);
    va_end(arguments);
}

void hud_text_to(struct hud_layout *layout, double x, double y, enum hud_font font, struct hud_colour colour,
                 const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_text(layout, x, y, font, colour, format, arguments)->is_right = true;
    va_end(arguments);
}
