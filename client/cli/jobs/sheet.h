/* SPDX-License-Identifier: MIT */
/* A contact sheet: pictures in rows, with a name under each. */
#ifndef FARLIGHT_CLI_JOBS_SHEET_H
#define FARLIGHT_CLI_JOBS_SHEET_H

#include "lib/farlight.h"

/* All zero at first; the caller sets nothing. */
struct sheet {
    uint32_t cell_width, cell_height, columns, count;
    struct fl_frame frame; /* rgba8; `pixels` are the sheet's */
    struct fl_export_text *texts;
    size_t text_count;
};

/* `columns` 0: as many as make a sheet of about 1600 pixels' width. False: it has more pixels than a picture can
 * have. */
bool sheet_begin(struct sheet *sheet, const uint32_t cell[2], uint32_t columns, uint32_t count,
                 struct fl_error *error);
/* The picture, of the cell's size. */
bool sheet_put(struct sheet *sheet, uint32_t index, const char *name, const struct fl_frame *picture,
               struct fl_error *error);
/* Why there is none. */
bool sheet_put_failure(struct sheet *sheet, uint32_t index, const char *name, const char *why,
                       struct fl_error *error);
void sheet_end(struct sheet *sheet);

#endif
