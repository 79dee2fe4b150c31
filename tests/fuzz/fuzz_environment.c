/* SPDX-License-Identifier: MIT */
/* Any bytes as an environment, of the formats that need no module. */
#include "import/image/plain.h"
#include "tests/fuzz/fuzz.h"

#include <stdlib.h>
#include <string.h>

/* The decoder is chosen by a file's first bytes, which would take long to find by chance. */
static const char head[] = "#?RADIANCE\n";

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const size_t head_bytes = sizeof(head) - 1;
    unsigned char *bytes = malloc(head_bytes + size);
    FUZZ_REQUIRE(bytes);
    memcpy(bytes, head, head_bytes);
    if (size > 0)
        memcpy(bytes + head_bytes, data, size);
    struct texture_job job = {.bytes = bytes, .size_bytes = head_bytes + size};
    const bool decoded = texture_plain_decode_environment(&job);
    FUZZ_REQUIRE(decoded ? job.texels && job.width > 0 && job.height > 0 : !job.texels);
    const uint16_t *halves = (const uint16_t *)(const void *)job.texels;
    for (size_t i = 0; decoded && i < (size_t)4 * job.width * job.height; i++)
        FUZZ_REQUIRE(halves[i] <= 0x7bff); /* finite and not negative */
    free(job.texels);
    free(bytes);
    return 0;
}
