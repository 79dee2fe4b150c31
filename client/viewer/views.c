/* SPDX-License-Identifier: MIT */
#include "viewer/views.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define THREADS 2u      /* that make a view: the decoder, the window and often the daemon want the others */
#define KEY_PIXELS 0.5f /* that planes may be off beside the rounding of depths: it is not seen in motion */
#define SECOND_NS UINT64_C(1000000000)
#define STILL_NS UINT64_C(80000000) /* without another wish: then there is time for a better view */

struct views {
    pthread_t thread;
    pthread_mutex_t lock; /* guards what follows, up to the thread's own */
    pthread_cond_t changed;
    bool quit;
    struct views_key given; /* the newest that was not taken; no depth: there is none */
    uint64_t keys;          /* that were given */
    struct views_layer given_layers[FL_WARP_LAYERS_MAX - 1]; /* of the last one, that were not taken */
    uint32_t given_layer_count;
    bool is_adding;      /* one of them to the key .. */
    uint32_t key_layers; /* .. that the thread has */
    bool forgets, wants;
    struct views_wish wish;
    uint64_t wishes; /* number of `wish` */
    uint64_t wished_ns;
    uint64_t first_wish; /* since which some view was wanted all the time */
    struct pixmap made_picture;
    struct views_made made;
    bool has_made; /* that was not taken */
    struct fl_warp_error error;

    /* The thread's own. */
    struct fl_warp *warp;
    struct pixmap picture; /* that is made */
    uint8_t *mask;
    size_t mask_bytes;
    struct views_key key; /* that the warp has, without picture and depths */
    int key_width, key_height;
    uint64_t key_number; /* 0: it has none */
    struct views_made last;
    struct plan_rung rung;
    uint64_t begun_ns; /* the last view */
};

static void key_finish(struct views_key *key)
{
    pixmap_finish(&key->picture);
    free(key->depth);
    free(key->sticking);
    key->depth = NULL;
    key->sticking = NULL;
}

/* With the lock. */
static void drop_layers(struct views *views)
{
    while (views->given_layer_count > 0)
        views_layer_finish(&views->given_layers[--views->given_layer_count]);
}

/* ---- in the thread, without the lock ---- */

/* In place. */
static void invert(float *depths, size_t count, float unit)
{
    for (size_t i = 0; i < count; i++)
        depths[i] = depths[i] > 0 ? unit / depths[i] : 0;
}

/* Makes numbers of the order of one. */
static float unit_of(const struct views_key *key)
{
    return key->radius / (float)PLAN_RADIUS_SHARE;
}

/* From what has come to what views are made from. */
static bool set_key(struct views *views, struct views_key *came, struct fl_warp_error *error)
{
    const struct pixmap *picture = &came->picture;
    const float unit = unit_of(came);
    views->key_width = picture->width;
    views->key_height = picture->height;
    invert(came->depth, (size_t)picture->width * (size_t)picture->height, unit);
    const struct fl_warp_key key = {.width = (uint32_t)picture->width,
                                    .height = (uint32_t)picture->height,
                                    .camera = came->camera,
                                    .unit = unit,
                                    .w_error = unit * came->depth_step / 2,
                                    .radius = came->radius,
                                    .pixels = KEY_PIXELS,
                                    .layer_count = 1,
                                    .layers[0] = {.colours = (const uint32_t *)(const void *)picture->pixels,
                                                  .w = came->depth,
                                                  .sticking = came->sticking}};
    const bool set = fl_warp_set_key(views->warp, &key, error);
    key_finish(came);
    views->key = *came;
    return set;
}

/* *added: it is of the key. */
static bool add_layer(struct views *views, struct views_layer *came, bool *added, struct fl_warp_error *error)
{
    const struct pixmap *picture = &came->picture;
    const bool fits = views_layer_fit(came, views->key_width, views->key_height);
    const struct fl_warp_layer layer = {.colours = (const uint32_t *)(const void *)picture->pixels,
                                        .w = came->depth};
    if (fits)
        invert(came->depth, (size_t)picture->width * (size_t)picture->height, unit_of(&views->key));
    *added = fits && fl_warp_add_layer(views->warp, &layer, error);
    views_layer_finish(came);
    return *added || !fits;
}

static bool reserve(struct views *views, const struct views_wish *wish, struct fl_warp_error *error)
{
    struct fl_error ignored;
    const size_t bytes = (size_t)wish->width * wish->height;
    bool good = pixmap_resize(&views->picture, (int)wish->width, (int)wish->height, &ignored);
    if (bytes > views->mask_bytes) {
        uint8_t *mask = realloc(views->mask, bytes);
        views->mask = mask ? mask : views->mask;
        views->mask_bytes = mask ? bytes : views->mask_bytes;
        good = good && mask;
    }
    if (!good)
        *error = (struct fl_warp_error){.code = FL_WARP_ERROR_MEMORY, .text = "out of memory"};
    return good;
}

/* Into `picture` and `last`. */
static bool make(struct views *views, const struct views_wish *wish, enum fl_warp_quality quality,
                 struct fl_warp_error *error)
{
    if (!reserve(views, wish, error))
        return false;
    const struct fl_warp_view view = {.width = wish->width,
                                      .height = wish->height,
                                      .camera = wish->camera,
                                      .quality = quality,
                                      .holes = wish->holes};
    struct fl_warp_picture picture = {.colours = (uint32_t *)(void *)views->picture.pixels, .mask = views->mask};
    const uint64_t begin_ns = monotonic_now_ns();
    if (!fl_warp_make(views->warp, &view, &picture, error))
        return false;
    views->begun_ns = begin_ns;
    views->last.moved_ns = wish->moved_ns;
    views->last.key_came_ns = views->key.came_ns;
    views->last.quality = quality;
    views->last.counts = picture.counts;
    views->last.took_ns = monotonic_now_ns() - begin_ns;
    views->last.build_ns = fl_warp_build_ns(views->warp);
    return true;
}

/* ---- in the thread, with the lock ---- */

static bool same_camera(const struct fl_warp_camera *a, const struct fl_warp_camera *b)
{
    return memcmp(a, b, sizeof(*a)) == 0;
}

/* At rest the first picture of a camera and the last one are prepared, so that motion begins with a view. */
static bool wants_key(const struct views *views)
{
    return views->given.depth && (views->wants || views->given.is_final || views->key_number == 0 ||
                                  !same_camera(&views->given.camera, &views->key.camera));
}

static bool is_of_now(const struct views *views, const struct views_made *made)
{
    return made->wish == views->wishes && made->key == views->key_number && made->layers == views->key_layers;
}

static bool wants_layer(const struct views *views)
{
    return views->given_layer_count > 0 && views->key_number == views->keys;
}

static bool wants_view(const struct views *views)
{
    return views->wants && views->key_number != 0 &&
           (!is_of_now(views, &views->last) || views->last.quality != FL_WARP_TREE);
}

/* A view in time is made again as well as possible, if no other is wanted for a while. */
static uint64_t due_ns(const struct views *views)
{
    const uint64_t next_ns = views->begun_ns + views->wish.frame_ns, still_ns = views->wished_ns + STILL_NS;
    return is_of_now(views, &views->last) && still_ns > next_ns ? still_ns : next_ns;
}

static void take_key(struct views *views)
{
    struct views_key came = views->given;
    struct fl_warp_error error = {0};
    const uint64_t number = views->keys;
    views->given = (struct views_key){0};
    pthread_mutex_unlock(&views->lock);
    const bool set = set_key(views, &came, &error);
    pthread_mutex_lock(&views->lock);
    views->key_number = set ? number : 0;
    views->key_layers = 1;
    if (!set)
        views->error = error;
}

static void take_layer(struct views *views)
{
    struct views_layer came = views->given_layers[0];
    struct fl_warp_error error = {0};
    bool added = false;
    views->is_adding = true;
    views->given_layers[0] = views->given_layers[--views->given_layer_count];
    pthread_mutex_unlock(&views->lock);
    const bool good = add_layer(views, &came, &added, &error);
    pthread_mutex_lock(&views->lock);
    views->is_adding = false;
    views->key_layers += added;
    if (!good)
        views->error = error;
}

static void take_wish(struct views *views)
{
    const struct views_wish wish = views->wish;
    const uint64_t number = views->wishes;
    struct fl_warp_error error = {0};
    const bool again = is_of_now(views, &views->last);
    const enum fl_warp_quality quality = again ? FL_WARP_TREE : views->rung.quality;
    pthread_mutex_unlock(&views->lock);
    const bool done = make(views, &wish, quality, &error);
    if (done && !again)
        plan_rung(&views->rung, views->last.took_ns, wish.frame_ns, monotonic_now_ns());
    pthread_mutex_lock(&views->lock);
    /* What fails is not tried again before there is another key. */
    views->key_number = done ? views->key_number : 0;
    if (!done) {
        views->error = error;
        return;
    }
    views->last.wish = number;
    views->last.key = views->key_number;
    views->last.layers = views->key_layers;
    if (number < views->first_wish) /* another motion's */
        return;
    pixmap_exchange(&views->made_picture, &views->picture);
    views->made = views->last;
    views->has_made = true;
}

static void wait_until(struct views *views, uint64_t until_ns)
{
    const struct timespec until = {.tv_sec = (time_t)(until_ns / SECOND_NS),
                                   .tv_nsec = (long)(until_ns % SECOND_NS)};
    pthread_cond_timedwait(&views->changed, &views->lock, &until);
}

static void *work(void *argument)
{
    struct views *views = argument;
    pthread_mutex_lock(&views->lock);
    while (!views->quit) {
        if (views->forgets) {
            views->key_number = 0;
            views->forgets = false;
        }
        if (wants_key(views))
            take_key(views);
        else if (wants_layer(views))
            take_layer(views);
        else if (!wants_view(views))
            pthread_cond_wait(&views->changed, &views->lock);
        else if (monotonic_now_ns() < due_ns(views))
            wait_until(views, due_ns(views));
        else
            take_wish(views);
    }
    pthread_mutex_unlock(&views->lock);
    return NULL;
}

/* ---- for the other thread ---- */

void views_give_key(struct views *views, struct views_key *key)
{
    pthread_mutex_lock(&views->lock);
    struct views_key outdated = views->given;
    views->given = *key;
    views->keys++;
    drop_layers(views);
    pthread_cond_signal(&views->changed);
    pthread_mutex_unlock(&views->lock);
    key_finish(&outdated);
    *key = (struct views_key){0};
}

void views_give_layer(struct views *views, struct views_layer *layer)
{
    pthread_mutex_lock(&views->lock);
    if (views->given_layer_count < FL_WARP_LAYERS_MAX - 1)
        views->given_layers[views->given_layer_count++] = *layer;
    else
        views_layer_finish(layer);
    pthread_cond_signal(&views->changed);
    pthread_mutex_unlock(&views->lock);
    *layer = (struct views_layer){0};
}

void views_forget_keys(struct views *views)
{
    pthread_mutex_lock(&views->lock);
    struct views_key outdated = views->given;
    views->given = (struct views_key){0};
    drop_layers(views);
    views->forgets = true;
    views->wants = views->has_made = false;
    pthread_mutex_unlock(&views->lock);
    key_finish(&outdated);
}

uint64_t views_want(struct views *views, const struct views_wish *wish)
{
    pthread_mutex_lock(&views->lock);
    const uint64_t number = ++views->wishes;
    if (!views->wants)
        views->first_wish = number;
    views->wish = *wish;
    views->wished_ns = monotonic_now_ns();
    views->wants = true;
    pthread_cond_signal(&views->changed);
    pthread_mutex_unlock(&views->lock);
    return number;
}

void views_want_none(struct views *views)
{
    pthread_mutex_lock(&views->lock);
    views->wants = views->has_made = false;
    pthread_mutex_unlock(&views->lock);
}

bool views_take(struct views *views, struct pixmap *picture, struct views_made *made)
{
    pthread_mutex_lock(&views->lock);
    const bool has_made = views->has_made && views->wants;
    if (has_made) {
        pixmap_exchange(picture, &views->made_picture);
        *made = views->made;
    }
    views->has_made = false;
    pthread_mutex_unlock(&views->lock);
    return has_made;
}

bool views_is_best(struct views *views, const struct views_made *made, uint64_t wish)
{
    pthread_mutex_lock(&views->lock);
    const bool is_best = made->wish == wish && made->key == views->keys && made->layers == views->key_layers &&
                         views->given_layer_count == 0 && !views->is_adding && made->quality == FL_WARP_TREE;
    pthread_mutex_unlock(&views->lock);
    return is_best;
}

bool views_take_error(struct views *views, struct fl_warp_error *error)
{
    pthread_mutex_lock(&views->lock);
    *error = views->error;
    views->error = (struct fl_warp_error){0};
    pthread_mutex_unlock(&views->lock);
    return error->code != FL_WARP_ERROR_NONE;
}

/* ---- beginning and end ---- */

static bool start(struct views *views)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&views->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&views->lock, NULL);
    if (pthread_create(&views->thread, NULL, work, views) == 0)
        return true;
    pthread_mutex_destroy(&views->lock);
    pthread_cond_destroy(&views->changed);
    return false;
}

struct views *views_create(struct fl_error *error)
{
    struct fl_warp_error why = {0};
    struct views *views = calloc(1, sizeof(*views));
    if (views)
        views->warp = fl_warp_create(THREADS, &why);
    if (views && views->warp && start(views))
        return views;
    fl_error_set(error, FL_ERROR_SYSTEM, "", "views cannot be made here: %s",
                 why.code != FL_WARP_ERROR_NONE ? why.text : "no memory, or no thread");
    if (views)
        fl_warp_destroy(views->warp);
    free(views);
    return NULL;
}

void views_destroy(struct views *views)
{
    if (!views)
        return;
    pthread_mutex_lock(&views->lock);
    views->quit = true;
    pthread_cond_signal(&views->changed);
    pthread_mutex_unlock(&views->lock);
    pthread_join(views->thread, NULL);
    pthread_mutex_destroy(&views->lock);
    pthread_cond_destroy(&views->changed);
    fl_warp_destroy(views->warp);
    drop_layers(views);
    key_finish(&views->given);
    pixmap_finish(&views->made_picture);
    pixmap_finish(&views->picture);
    free(views->mask);
    free(views);
}
