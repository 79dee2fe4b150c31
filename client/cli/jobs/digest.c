/* SPDX-License-Identifier: MIT */
/* Files with digests of pictures. */
#include "digest.h"
#include "options/image_path.h"

#include <errno.h>
#include <sodium.h>
#include <stdio.h>
#include <string.h>

#define HEX_BYTES (2 * crypto_hash_sha256_BYTES + 1)
#define PATH_BYTES (4352 + sizeof(DIGEST_ENDING))

const char *digest_state_text(enum digest_state state)
{
    static const char *const texts[DIGEST_STATE_COUNT] = {
        [DIGEST_AGREES] = "good",
        [DIGEST_NO_PICTURE] = "missing",
        [DIGEST_MISSING] = "has no digest",
        [DIGEST_DIFFERS] = "differs from its digest",
        [DIGEST_UNREADABLE] = "cannot be read",
    };
    return texts[state];
}

static bool name_digest(const char *path, char out[PATH_BYTES])
{
    const int length = snprintf(out, PATH_BYTES, "%s" DIGEST_ENDING, path);
    return length > 0 && (size_t)length < PATH_BYTES;
}

/* Computes the digest of a file. False: errno has the reason. */
static bool digest_of(const char *path, char hex[HEX_BYTES])
{
    FILE *file = fopen(path, "rbe");
    if (!file)
        return false;
    crypto_hash_sha256_state state;
    crypto_hash_sha256_init(&state);
    unsigned char bytes[65536], digest[crypto_hash_sha256_BYTES];
    for (size_t count; (count = fread(bytes, 1, sizeof(bytes), file)) > 0;)
        crypto_hash_sha256_update(&state, bytes, count);
    const int failure = ferror(file) ? errno : 0;
    fclose(file);
    crypto_hash_sha256_final(&state, digest);
    sodium_bin2hex(hex, HEX_BYTES, digest, sizeof(digest));
    errno = failure;
    return failure == 0;
}

bool digest_write(const char *path, struct fl_error *error)
{
    char beside[PATH_BYTES], hex[HEX_BYTES], line[PATH_BYTES + HEX_BYTES + 4];
    if (!name_digest(path, beside))
        return fl_error_set(error, FL_ERROR_FILE, path, "the path of its digest is too long");
    if (!digest_of(path, hex))
        return fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %s", strerror(errno));
    snprintf(line, sizeof(line), "%s  %s\n", hex, cli_base_name(path));
    return cli_write_text(beside, line, 0644, error);
}

enum digest_state digest_check(const char *path)
{
    char beside[PATH_BYTES], hex[HEX_BYTES], line[HEX_BYTES + 1];
    if (!name_digest(path, beside))
        return DIGEST_UNREADABLE;
    if (!digest_of(path, hex))
        return errno == ENOENT ? DIGEST_NO_PICTURE : DIGEST_UNREADABLE;
    FILE *file = fopen(beside, "re");
    if (!file)
        return errno == ENOENT ? DIGEST_MISSING : DIGEST_UNREADABLE;
    const size_t length = fread(line, 1, sizeof(line), file);
    fclose(file);
    return length == sizeof(line) && memcmp(line, hex, HEX_BYTES - 1) == 0 && line[HEX_BYTES - 1] == ' '
               ? DIGEST_AGREES
               : DIGEST_DIFFERS;
}
