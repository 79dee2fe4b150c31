/* SPDX-License-Identifier: MIT */
/* The page's files, embedded in the program. */
#include "web/page.h"

#include <string.h>

/* The assembler includes the bytes unchanged. */
#define EMBED(name, file)                                                                                         \
    __asm__(".pushsection .rodata\n" #name ": .incbin \"client/web/page/" file "\"\n" #name                       \
            "_end: .byte 0\n.popsection\n");                                                                      \
    extern const unsigned char name[] __attribute__((visibility("hidden")));                                      \
    extern const unsigned char name##_end[] __attribute__((visibility("hidden")))

EMBED(page_index, "index.html");
EMBED(page_style, "page.css");
EMBED(page_main, "page.js");
EMBED(page_camera, "camera.js");
EMBED(page_picture, "picture.js");
EMBED(page_errors, "errors.js");
EMBED(page_edit, "edit.js");
EMBED(page_stages, "stages.js");
EMBED(page_refusal, "denied.html");
EMBED(page_elsewhere, "misdirected.html");

#define HTML "text/html; charset=utf-8"
#define SCRIPT "text/javascript; charset=utf-8"

static const struct page_file files[] = {
    {"", HTML, page_index, page_index_end},
    {"page.css", "text/css; charset=utf-8", page_style, page_style_end},
    {"page.js", SCRIPT, page_main, page_main_end},
    {"camera.js", SCRIPT, page_camera, page_camera_end},
    {"picture.js", SCRIPT, page_picture, page_picture_end},
    {"errors.js", SCRIPT, page_errors, page_errors_end},
    {"edit.js", SCRIPT, page_edit, page_edit_end},
    {"stages.js", SCRIPT, page_stages, page_stages_end},
};

const struct page_file page_denied = {"", HTML, page_refusal, page_refusal_end};
const struct page_file page_misdirected = {"", HTML, page_elsewhere, page_elsewhere_end};

const struct page_file *page_find(const char *name)
{
    for (size_t i = 0; i < sizeof(files) / sizeof(files[0]); i++)
        if (strcmp(files[i].name, name) == 0)
            return &files[i];
    return NULL;
}
