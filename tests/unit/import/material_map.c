/* SPDX-License-Identifier: MIT */
/* Importers and the protocol mean the same by the positions of a material's textures. */
#include "import/material_map.h"
#include "protocol/describe.h"
#include "protocol/messages.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <string.h>

TEST(the_maps_of_a_material_are_those_of_the_message)
{
    static const char *const words[] = {
#define MAP_WORDS(NAME, words) words,
        MATERIAL_MAPS(MAP_WORDS)
#undef MAP_WORDS
    };
    const struct message_desc *message = message_describe(MESSAGE_SET_MATERIAL);
    const struct field_desc *textures = struct_field(message->body(), "textures");
    char listed[1024] = "by position:";
    size_t used = strlen(listed);

    for (int i = 0; i < MAP_COUNT; i++)
        used += (size_t)snprintf(listed + used, sizeof(listed) - used, "%s %d %s", i == 0 ? "" : ",", i, words[i]);
    assert_true(used < sizeof(listed));
    assert_string_equal(listed, textures->doc);
    assert_true(textures->max >= MAP_COUNT);
}
