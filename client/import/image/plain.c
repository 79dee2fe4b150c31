/* SPDX-License-Identifier: MIT */
/* Decoding of PNG, JPEG and HDR images without OpenImageIO. */
#include "plain.h"

#include "half.h"

#include <png.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stb_image.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

/* The limits of module.cpp. */
#define ALL_TEXELS_MAX (UINT64_C(1) << 30)
#define TEXEL_BYTES 4

static atomic_uint_fast64_t all_texels;

static bool is_png(const struct texture_job *job)
{
    return job->size_bytes >= 8 && memcmp(job->bytes, "\x89PNG\r\n\x1a\n", 8) == 0;
}

static bool is_jpeg(const struct texture_job *job)
{
    return job->size_bytes >= 3 && memcmp(job->bytes, "\xff\xd8\xff", 3) == 0;
}

static bool is_plain(const struct texture_job *job)
{
    return job->bytes && (is_png(job) || is_jpeg(job));
}

/* Checks the header's claims and allocates the texels. */
static bool take_texels(struct texture_job *job, uint64_t width, uint64_t height)
{
    char *reason = job->reason;
    job->reduced = texture_reduction(job, width, height);
    if (job->reduced == 0)
        return false;
    width = (width + job->reduced - 1) / job->reduced;
    height = (height + job->reduced - 1) / job->reduced;
    const uint64_t texels = width * height;
    if (atomic_fetch_add(&all_texels, texels) > ALL_TEXELS_MAX - texels)
        return snprintf(reason, sizeof(job->reason), "would need, with the images before it, more than 4 GiB"),
               false;
    job->texels = calloc(texels, TEXEL_BYTES);
    if (!job->texels)
        return snprintf(reason, sizeof(job->reason), "out of memory"), false;
    job->width = (uint32_t)width;
    job->height = (uint32_t)height;
    return true;
}

/* ---- PNG ---- */

struct png_bytes {
    struct texture_job *job;
    size_t at;
    png_bytep *rows;
    unsigned char *row; /* row of an image that is reduced .. */
    uint32_t *sums;     /* .. and sums for a row of the result */
};

static void read_png(png_structp png, png_bytep to, size_t count)
{
    struct png_bytes *bytes = png_get_io_ptr(png);
    if (count > bytes->job->size_bytes - bytes->at)
        png_error(png, "the file ends too early");
    memcpy(to, bytes->job->bytes + bytes->at, count);
    bytes->at += count;
}

static void fail_png(png_structp png, png_const_charp text)
{
    struct png_bytes *bytes = png_get_error_ptr(png);
    snprintf(bytes->job->reason, sizeof(bytes->job->reason), "%s", text);
    png_longjmp(png, 1);
}

static void ignore_warning(png_structp png, png_const_charp text)
{
    (void)png, (void)text;
}

/* Converts any PNG to four bytes a texel. */
static void ask_for_bytes(png_structp png, png_infop info, struct texture_job *job)
{
    const png_byte type = png_get_color_type(png, info);
    const bool keyed = png_get_valid(png, info, PNG_INFO_tRNS);
    job->has_alpha = keyed || (type & PNG_COLOR_MASK_ALPHA);
    png_set_expand(png);
    png_set_scale_16(png);
    if (!(type & PNG_COLOR_MASK_COLOR))
        png_set_gray_to_rgb(png);
    if (!job->has_alpha)
        png_set_add_alpha(png, 255, PNG_FILLER_AFTER);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
}

/* Averages encoded bytes: in images of this size neighbours are similar. */
static void read_reduced(png_structp png, png_infop info, struct png_bytes *bytes)
{
    struct texture_job *job = bytes->job;
    const uint32_t width = png_get_image_width(png, info), height = png_get_image_height(png, info),
                   by = job->reduced;
    if (png_get_interlace_type(png, info) != PNG_INTERLACE_NONE)
        png_error(png, "is interlaced and too large: save it without interlacing, or smaller");
    bytes->row = malloc((size_t)width * TEXEL_BYTES);
    bytes->sums = malloc((size_t)job->width * TEXEL_BYTES * sizeof(*bytes->sums));
    if (!bytes->row || !bytes->sums)
        png_error(png, "out of memory");
    for (uint32_t y = 0; y < job->height; y++) {
        const uint32_t rows = height - y * by < by ? height - y * by : by;
        memset(bytes->sums, 0, (size_t)job->width * TEXEL_BYTES * sizeof(*bytes->sums));
        for (uint32_t k = 0; k < rows; k++) {
            png_read_row(png, bytes->row, NULL);
            for (uint32_t x = 0; x < width; x++)
                for (uint32_t c = 0; c < TEXEL_BYTES; c++)
                    bytes->sums[x / by * TEXEL_BYTES + c] += bytes->row[(size_t)x * TEXEL_BYTES + c];
        }
        for (uint32_t x = 0; x < job->width; x++) {
            const uint32_t columns = width - x * by < by ? width - x * by : by, count = rows * columns;
            for (uint32_t c = 0; c < TEXEL_BYTES; c++)
                job->texels[((size_t)y * job->width + x) * TEXEL_BYTES + c] =
                    (unsigned char)((bytes->sums[x * TEXEL_BYTES + c] + count / 2) / count);
        }
    }
}

/* An error of libpng ends this function by a jump, so it keeps nothing in variables that the caller must free. */
static bool read_png_texels(png_structp png, png_infop info, struct png_bytes *bytes)
{
    struct texture_job *job = bytes->job;
    if (setjmp(png_jmpbuf(png)))
        return false;
    png_set_read_fn(png, bytes, read_png);
    png_set_user_limits(png, 0x7fffffff, 0x7fffffff); /* our own limits have better messages */
    png_read_info(png, info);
    if (!take_texels(job, png_get_image_width(png, info), png_get_image_height(png, info)))
        return false;
    ask_for_bytes(png, info, job);
    if (job->reduced > 1) {
        read_reduced(png, info, bytes);
        return true;
    }
    bytes->rows = malloc(job->height * sizeof(*bytes->rows));
    if (!bytes->rows)
        png_error(png, "out of memory");
    for (uint32_t y = 0; y < job->height; y++)
        bytes->rows[y] = job->texels + (size_t)y * job->width * TEXEL_BYTES;
    png_read_image(png, bytes->rows);
    return true;
}

static bool decode_png(struct texture_job *job)
{
    struct png_bytes bytes = {.job = job};
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &bytes, fail_png, ignore_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    bool decoded = false;
    if (info)
        decoded = read_png_texels(png, info, &bytes);
    else
        snprintf(job->reason, sizeof(job->reason), "out of memory");
    png_destroy_read_struct(&png, &info, NULL);
    free(bytes.rows);
    free(bytes.row);
    free(bytes.sums);
    return decoded;
}

/* ---- JPEG ---- */

/* Converts in place: JPEGs hold 255 minus the ink of each colour. */
static void rgb_from_cmyk(unsigned char *texels, size_t count)
{
    for (unsigned char *at = texels; at < texels + count * TEXEL_BYTES; at += TEXEL_BYTES) {
        for (int i = 0; i < 3; i++)
            at[i] = (unsigned char)((at[i] * at[3] + 127) / 255);
        at[3] = 255;
    }
}

static bool decode_jpeg_with(tjhandle handle, struct texture_job *job)
{
    int width = 0, height = 0, chroma = 0, space = 0;
    const unsigned long size = (unsigned long)job->size_bytes;
    if (tjDecompressHeader3(handle, job->bytes, size, &width, &height, &chroma, &space) < 0 &&
        tjGetErrorCode(handle) != TJERR_WARNING)
        return false;
    if (!take_texels(job, (uint64_t)width, (uint64_t)height))
        return false;
    const bool inks = space == TJCS_CMYK || space == TJCS_YCCK;
    /* A truncated image stays grey at its end and causes a warning only. */
    if (job->reduced > 8)
        return snprintf(job->reason, sizeof(job->reason), "is too large"), false;
    if (tjDecompress2(handle, job->bytes, size, job->texels, (int)job->width, 0, (int)job->height,
                      inks ? TJPF_CMYK : TJPF_RGBA, TJFLAG_LIMITSCANS) < 0 &&
        tjGetErrorCode(handle) != TJERR_WARNING)
        return false;
    if (inks)
        rgb_from_cmyk(job->texels, (size_t)job->width * job->height);
    return true;
}

static bool decode_jpeg(struct texture_job *job)
{
    tjhandle handle = tjInitDecompress();
    const bool decoded = handle && decode_jpeg_with(handle, job);
    if (!decoded && job->reason[0] == '\0')
        snprintf(job->reason, sizeof(job->reason), "%s", tjGetErrorStr2(handle));
    if (handle)
        tjDestroy(handle);
    return decoded;
}

/* ---- HDR ---- */

struct hdr_bytes {
    const unsigned char *at;
    size_t left_bytes;
    bool exhausted; /* more was read than there is */
};

/* Reads bytes, and newlines after the end: stb 2.27 would take zeros there for runs of no texel, endlessly.
 * Newlines end its header, and are runs of ten. */
static int read_hdr(void *context, char *to, int count)
{
    struct hdr_bytes *bytes = context;
    const size_t wanted = (size_t)count, given = wanted < bytes->left_bytes ? wanted : bytes->left_bytes;
    if (given == 0) {
        bytes->exhausted = true;
        memset(to, '\n', wanted);
        return count;
    }
    memcpy(to, bytes->at, given);
    bytes->at += given;
    bytes->left_bytes -= given;
    return (int)given;
}

static void skip_hdr(void *context, int count)
{
    struct hdr_bytes *bytes = context;
    const size_t wanted = count > 0 ? (size_t)count : 0,
                 skipped = wanted < bytes->left_bytes ? wanted : bytes->left_bytes;
    bytes->at += skipped;
    bytes->left_bytes -= skipped;
}

static int is_at_end_of_hdr(void *context)
{
    const struct hdr_bytes *bytes = context;
    return bytes->left_bytes == 0;
}

/* Checks that the file can hold its rows: a row has four bytes a texel or, with eight texels or more, a header
 * of four bytes and then, for each of four channels, two bytes a run of at most 127. A header that claims more
 * is refused before memory is allocated. */
static bool holds_rows_of_hdr(const struct texture_job *job, int width, int height)
{
    const uint64_t texels = (uint64_t)width, rows = (uint64_t)height;
    const uint64_t row_bytes = texels < 8 ? 4 * texels : 4 + 4 * 2 * ((texels + 126) / 127);
    return job->size_bytes >= rows * row_bytes;
}

static float *decode_hdr(const struct texture_job *job, int *width, int *height)
{
    static const stbi_io_callbacks calls = {.read = read_hdr, .skip = skip_hdr, .eof = is_at_end_of_hdr};
    const struct hdr_bytes whole = {job->bytes, job->size_bytes, false};
    struct hdr_bytes bytes = whole;
    int channels = 0;
    if (!stbi_is_hdr_from_callbacks(&calls, &bytes)) /* other formats have better readers */
        return NULL;
    bytes = whole;
    if (!stbi_info_from_callbacks(&calls, &bytes, width, height, &channels) || *width < 1 || *height < 1 ||
        *width > (int)TEXTURE_EDGE_MAX || *height > (int)TEXTURE_EDGE_MAX ||
        (uint64_t)*width * (uint64_t)*height > TEXTURE_TEXELS_MAX || !holds_rows_of_hdr(job, *width, *height))
        return NULL;
    bytes = whole;
    float *pixels = stbi_loadf_from_callbacks(&calls, &bytes, width, height, &channels, 3);
    if (!bytes.exhausted)
        return pixels;
    stbi_image_free(pixels);
    return NULL;
}

bool texture_plain_decode_environment(struct texture_job *job)
{
    int width = 0, height = 0;
    float *pixels = decode_hdr(job, &width, &height);
    const size_t texels = (size_t)width * (size_t)height;
    uint16_t *halves = pixels ? calloc(texels, 4 * sizeof(*halves)) : NULL;
    for (size_t i = 0; halves && i < texels; i++)
        for (size_t c = 0; c < 3; c++)
            halves[i * 4 + c] = half_of_radiance(pixels[i * 3 + c]);
    stbi_image_free(pixels);
    if (!halves)
        return false;
    job->texels = (unsigned char *)halves;
    job->width = (uint32_t)width;
    job->height = (uint32_t)height;
    return true;
}

/* ---- all ---- */

struct work {
    struct texture_job **jobs;
    size_t count;
    atomic_size_t next;
};

static void *decode_next(void *context)
{
    struct work *work = context;
    for (size_t i; (i = atomic_fetch_add(&work->next, 1)) < work->count;) {
        struct texture_job *job = work->jobs[i];
        if (is_png(job) ? decode_png(job) : decode_jpeg(job))
            continue;
        free(job->texels);
        job->texels = NULL;
        job->width = job->height = 0;
    }
    return NULL;
}

/* Sorts larger images first; otherwise one thread may end up decoding the largest while the other is idle. */
static int compare_jobs(const void *a, const void *b)
{
    const size_t left = (*(struct texture_job *const *)a)->size_bytes;
    const size_t right = (*(struct texture_job *const *)b)->size_bytes;
    return (left < right) - (left > right);
}

void texture_plain_decode(struct texture_job *jobs, size_t count)
{
    struct work work = {.jobs = malloc((count + 1) * sizeof(struct texture_job *))};
    pthread_t helper;
    for (size_t i = 0; i < count; i++) {
        if (is_plain(&jobs[i]) && work.jobs)
            work.jobs[work.count++] = &jobs[i];
        else if (is_plain(&jobs[i]))
            snprintf(jobs[i].reason, sizeof(jobs[i].reason), "out of memory");
    }
    if (work.jobs)
        qsort(work.jobs, work.count, sizeof(struct texture_job *), compare_jobs);
    const bool helped = work.count > 1 && pthread_create(&helper, NULL, decode_next, &work) == 0;
    decode_next(&work);
    if (helped)
        pthread_join(helper, NULL);
    free(work.jobs);
}
