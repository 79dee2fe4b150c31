/* SPDX-License-Identifier: MIT */
/* Reading of numbers, sizes, ranges and patterns that people type. */
#include "lib/text.h"

#include <errno.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/common/srgb.h"
#include "protocol/plain_text.h"

#define EDGE_MAX 8192  /* the protocol's maximum of a picture */
#define NEAREST_MAX 2u /* a larger distance means another word */
#define NEAREST_BYTES_MAX 32u
#define FRAME_MAX 10000000 /* the protocol's maximum of a frame number */

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* Digits at *cursor, at most `maximum`; moves the cursor behind them. */
static bool read_digits(const char **cursor, uint64_t maximum, uint64_t *value)
{
    const char *at = *cursor;
    if (!is_digit(*at))
        return false;
    uint64_t sum = 0;
    for (; is_digit(*at); at++) {
        const unsigned digit = (unsigned)(*at - '0');
        if (sum > (UINT64_MAX - digit) / 10)
            return false;
        sum = sum * 10 + digit;
    }
    if (sum > maximum)
        return false;
    *value = sum;
    *cursor = at;
    return true;
}

bool fl_text_integer(const char *text, uint64_t minimum, uint64_t maximum, uint64_t *value, struct fl_error *error)
{
    const char *at = text;
    uint64_t read = 0;
    if (!read_digits(&at, maximum, &read) || *at != '\0' || read < minimum)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a whole number from %llu to %llu", text,
                            (unsigned long long)minimum, (unsigned long long)maximum);
    *value = read;
    return true;
}

/* strtod with a decimal point in every locale. */
static double read_real(const char *text, char **end)
{
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0)
        return strtod(text, end);
    const double value = strtod_l(text, end, plain);
    freelocale(plain);
    return value;
}

/* No hexadecimal, no 'inf', no blanks: digits, sign, point and exponent. */
static bool looks_decimal(const char *text, size_t length)
{
    return length > 0 && strspn(text, "+-.0123456789eE") >= length;
}

bool fl_text_real(const char *text, double minimum, double maximum, double *value, struct fl_error *error)
{
    char *end = NULL;
    const size_t length = strlen(text);
    const double read = looks_decimal(text, length) ? read_real(text, &end) : NAN;
    if (end != text + length || !isfinite(read) || read < minimum || read > maximum)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a number from %g to %g", text, minimum,
                            maximum);
    *value = read;
    return true;
}

bool fl_text_write_error(struct fl_error *error, const char *field, const char *what, int number)
{
    fl_error_set(error, FL_ERROR_FILE, field, "%s: %s", what, strerror(number));
    error->retryable = number == ENOSPC || number == EDQUOT;
    return false;
}

bool fl_text_duration(const char *text, double max_s, double *seconds, struct fl_error *error)
{
    static const struct {
        char name;
        double seconds;
    } units[] = {{'s', 1}, {'m', 60}, {'h', 3600}, {'\0', 1}};
    char *end = NULL;
    const size_t length = strspn(text, ".0123456789");
    const double read = looks_decimal(text, length) ? read_real(text, &end) : NAN;
    for (size_t i = 0; i < sizeof(units) / sizeof(units[0]); i++) {
        if (end != text + length || text[length] != units[i].name || (text[length] && text[length + 1]) ||
            !(read * units[i].seconds <= max_s))
            continue;
        *seconds = read * units[i].seconds;
        return true;
    }
    return fl_error_set(error, FL_ERROR_ARGUMENT, "",
                        "'%s' is not a duration of at most %g seconds, such as 90, 5m or 2h", text, max_s);
}

bool fl_text_size(const char *text, uint32_t *width, uint32_t *height, struct fl_error *error)
{
    const char *at = text;
    uint64_t read[2] = {0, 0};
    const bool read_all = read_digits(&at, EDGE_MAX, &read[0]) && (*at == 'x' || *at == 'X') && *++at != '\0' &&
                          read_digits(&at, EDGE_MAX, &read[1]) && *at == '\0';
    if (!read_all || read[0] == 0 || read[1] == 0)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a size of 1x1 to %dx%d pixels", text,
                            EDGE_MAX, EDGE_MAX);
    *width = (uint32_t)read[0];
    *height = (uint32_t)read[1];
    return true;
}

bool fl_text_place(const char *text, double place[3], struct fl_error *error)
{
    double read[3] = {0, 0, 0};
    const char *at = text;
    for (unsigned i = 0; i < 3; i++) {
        const size_t length = strcspn(at, ",");
        char *end = NULL;
        const double value = looks_decimal(at, length) ? read_real(at, &end) : NAN;
        const bool separated = i < 2 ? at[length] == ',' : at[length] == '\0';
        if (end != at + length || !separated || !(fabs(value) <= 1e12))
            return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not three numbers X,Y,Z", text);
        read[i] = value;
        at += length + 1;
    }
    memcpy(place, read, sizeof(read));
    return true;
}

bool fl_text_vector(const char *text, float vector[3], struct fl_error *error)
{
    double read[3];
    if (!fl_text_place(text, read, error))
        return false;
    for (unsigned i = 0; i < 3; i++)
        vector[i] = (float)read[i];
    return true;
}

bool fl_text_colour(const char *text, float linear[3], struct fl_error *error)
{
    unsigned codes[3];
    if (strlen(text) != 7 || strspn(text + 1, "0123456789abcdefABCDEF") != 6 ||
        sscanf(text, "#%2x%2x%2x", &codes[0], &codes[1], &codes[2]) != 3)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a colour as #ffffff", text);
    for (int c = 0; c < 3; c++)
        linear[c] = linear_from_srgb_f((float)codes[c] / 255.0f);
    return true;
}

bool fl_text_range(const char *text, uint32_t *first, uint32_t *last, uint32_t *step, struct fl_error *error)
{
    const char *at = text;
    uint64_t from = 0, to = 0, by = 1;
    bool good = read_digits(&at, FRAME_MAX, &from);
    to = from;
    if (good && *at == '-') {
        at++;
        good = read_digits(&at, FRAME_MAX, &to);
        if (good && *at == ':') {
            at++;
            good = read_digits(&at, FRAME_MAX, &by) && by > 0;
        }
    }
    if (!good || *at != '\0')
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a range of frames A-B or A-B:STEP, 0 to %d",
                            text, FRAME_MAX);
    if (to < from)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s': the last frame is before the first", text);
    *first = (uint32_t)from;
    *last = (uint32_t)to;
    *step = (uint32_t)by;
    return true;
}

/* Number of letters to change, insert or delete (Levenshtein 1965). */
static unsigned distance(const char *a, const char *b)
{
    unsigned row[NEAREST_BYTES_MAX];
    const size_t columns = strlen(b);
    if (columns + 1 > NEAREST_BYTES_MAX)
        return UINT_MAX;
    for (unsigned i = 0; i <= columns; i++)
        row[i] = i;
    for (unsigned y = 1; a[y - 1] != '\0'; y++) {
        unsigned corner = row[0];
        row[0] = y;
        for (size_t x = 1; x <= columns; x++) {
            const unsigned change = corner + (a[y - 1] != b[x - 1] ? 1 : 0);
            const unsigned shorter = row[x] < row[x - 1] ? row[x] : row[x - 1];
            corner = row[x];
            row[x] = change < shorter + 1 ? change : shorter + 1;
        }
    }
    return row[columns];
}

void fl_nearest_try(struct fl_nearest *nearest, const char *typed, const char *known)
{
    const unsigned off = strlen(typed) < NEAREST_BYTES_MAX ? distance(typed, known) : UINT_MAX;
    if (off > NEAREST_MAX || off >= strlen(known) || (nearest->name && off >= nearest->distance))
        return;
    nearest->name = known;
    nearest->distance = off;
}

void fl_text_utf8(const char *text, char *out, size_t out_bytes)
{
    size_t used = 0;
    while (*text != '\0') {
        uint32_t code;
        const size_t length = utf8_read(text, UTF8_BYTES_MAX, &code);
        const size_t taken = length > 0 ? length : 1;
        if (used + taken >= out_bytes)
            break;
        memcpy(out + used, length > 0 ? text : "?", taken);
        used += taken;
        text += taken;
    }
    out[used] = '\0';
}

/* Length of the conversion at a '%': 0 if it is invalid, 1 for "%%", else the length of "%d" or "%0Nd", with
 * its *digits. */
static size_t read_conversion(const char *at, unsigned *digits)
{
    if (at[1] == '%')
        return 1;
    if (at[1] == 'd') {
        *digits = 1;
        return 2;
    }
    if (at[1] == '0' && at[2] >= '1' && at[2] <= '9' && at[3] == 'd') {
        *digits = (unsigned)(at[2] - '0');
        return 4;
    }
    return 0;
}

bool fl_pattern_parse(const char *text, struct fl_pattern *pattern, struct fl_error *error)
{
    struct fl_pattern made = {0};
    char *out = made.before;
    size_t room = sizeof(made.before);
    for (const char *at = text; *at != '\0';) {
        char c = *at;
        size_t length = 1;
        unsigned digits = 0;
        if (c == '%') {
            length = read_conversion(at, &digits);
            if (length == 0)
                return fl_error_set(error, FL_ERROR_ARGUMENT, "",
                                    "'%s': %% must be followed by 'd', '0Nd' (N digits) or another %%", text);
            at += length == 1 ? 2 : length;
            if (length > 1) {
                if (made.digits != 0)
                    return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s': the frame's number occurs twice",
                                        text);
                made.digits = digits;
                out = made.after;
                room = sizeof(made.after);
                continue;
            }
        } else {
            at++;
        }
        if (made.digits != 0 && c == '/')
            return fl_error_set(error, FL_ERROR_ARGUMENT, "",
                                "'%s': the frame's number may only be in the file's name, not in a folder's",
                                text);
        if (room <= 1)
            return fl_error_set(error, FL_ERROR_ARGUMENT, "", "the file's name is too long");
        *out++ = c;
        room--;
    }
    if (made.digits == 0) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' has no place for the frame's number", text);
        return fl_error_remedy(error, "write it like 'frames/%%04d.exr'");
    }
    *pattern = made;
    return true;
}

bool fl_pattern_path(const struct fl_pattern *pattern, uint32_t frame, char *path, size_t path_bytes)
{
    const int length =
        snprintf(path, path_bytes, "%s%0*u%s", pattern->before, (int)pattern->digits, frame, pattern->after);
    return length >= 0 && (size_t)length < path_bytes;
}
