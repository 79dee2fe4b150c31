/* SPDX-License-Identifier: MIT */
/* A contact sheet: pictures in rows, with a name below each. */
#ifndef FARLIGHT_CLI_JOBS_SHEET_H
#define FARLIGHT_CLI_JOBS_SHEET_H

#include "lib/farlight.h"

/* A sheet; initially zero. The caller sets nothing. */
struct sheet {
    uint32_t cell_width, cell_height, columns, count;
    struct fl_frame frame; /* rgba8; the sheet owns `pixels` */
    struct fl_export_text *texts;
    size_t text_count;
};

/* Begins a sheet. `columns` 0: enough for a width of about 1600 pixels. False: the sheet exceeds the limits of
 * a picture. */
bool sheet_begin(struct sheet *sheet, const uint32_t cell[2], uint32_t columns, uint32_t count,
                 struct fl_error *error);
/* Draws a picture, which has the cell's size. */
bool sheet_put(struct sheet *sheet, uint32_t index, const char *name, const struct fl_frame *picture,
               struct fl_error *error);
/* Draws the reason of a missing picture. */
bool sheet_put_failure(struct sheet *sheet, uint32_t index, const char *name, const char *why,
                       struct fl_error *error);
void sheet_end(struct sheet *sheet);

#endif
