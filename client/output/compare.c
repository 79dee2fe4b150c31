/* SPDX-License-Identifier: MIT */
/* Comparison of two image files, by the module of library.h. */
#include "compare.h"
#include "helper/file.h"
#include "image.h"
#include "library.h"

#include <stdlib.h>

static bool write_errors(const struct message_compare_images *wanted, const struct raster *picture,
                         const char *description, char *reason, size_t reason_bytes)
{
    uint8_t *file = NULL;
    size_t file_bytes = 0;
    const bool written = image_encode_plain(image_format_of(wanted->picture, wanted->format), picture, description,
                                            &file, &file_bytes, reason, reason_bytes) &&
                         file_write(wanted->picture, file, file_bytes, reason, reason_bytes);
    free(file);
    return written;
}

bool compare_images(const struct message_compare_images *wanted, const struct compare_file *a,
                    const struct compare_file *b, struct compare_result *result)
{
    static const struct library_host host = {.read = file_read, .write = write_errors};
    const struct image_library *library = library_loaded(result->reason, sizeof(result->reason));
    return library && library->compare(&host, wanted, a, b, result);
}
