/* SPDX-License-Identifier: MIT */
/* Threads that make views. */
#include "views.h"

#include "layer.h"
#include "warped_key.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#define THREADS 2u /* threads for a view: decoder, window and often the daemon need the other processors */
#define KEY_NICE 5 /* niceness of the thread that prepares keys, since views are more urgent */
#define SECOND_NS UINT64_C(1000000000)
#define STILL_NS UINT64_C(80000000) /* without another request for this time, a better view is made */

struct views {
    pthread_t thread, key_thread;
    pthread_mutex_t lock; /* guards the members below, up to the threads' own */
    pthread_cond_t changed;
    bool quit;
    struct views_key given;                                  /* newest key that was not taken; no depth: none */
    uint64_t keys;                                           /* number of given keys */
    struct views_layer given_layers[FL_WARP_LAYERS_MAX - 1]; /* layers of the last key that were not taken */
    uint32_t given_layer_count;
    bool is_adding;      /* a layer is being added to the key .. */
    uint32_t key_layers; /* .. whose number of layers in the thread this is */
    uint64_t first_key;  /* first key that is not dropped */
    bool is_prepared;    /* `next` shall become `current` */
    bool wants;
    struct views_request request;
    atomic_uint_fast64_t requests; /* number of `request`; also read without the lock */
    uint64_t requested_ns;
    uint64_t first_request; /* first request since which views have been wanted without a pause */
    struct pixmap made_picture;
    struct views_made made;
    bool has_made; /* a view is ready */
    struct fl_warp_error error;

    struct warped_key next;    /* owned by the key thread, unless it is prepared; its number is guarded */
    struct warped_key current; /* owned by the view thread; its number is guarded */

    /* The view thread's own members. */
    uint64_t making;       /* number of the request that is being made */
    struct pixmap picture; /* picture of the view */
    uint8_t *mask;
    size_t mask_bytes;
    struct views_made last;
    struct plan_rung rung;
    uint64_t begun_ns; /* beginning of the last view */
};

/* Drops the layers that were not taken; needs the lock. */
static void drop_layers(struct views *views)
{
    while (views->given_layer_count > 0)
        views_layer_finish(&views->given_layers[--views->given_layer_count]);
}

/* ---- in the view thread, without the lock ---- */

static bool reserve(struct views *views, const struct views_request *request, struct fl_warp_error *error)
{
    struct fl_error ignored;
    const size_t bytes = (size_t)request->width * request->height;
    bool good = pixmap_resize(&views->picture, (int)request->width, (int)request->height, &ignored);
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

static bool is_overtaken(const void *context)
{
    const struct views *views = context;
    return atomic_load(&views->requests) != views->making;
}

/* Adds an eye's counts, which cover `share` of all pixels. */
static void add_counts(struct fl_warp_counts *sum, const struct fl_warp_counts *of_eye, float share)
{
    sum->known += share * of_eye->known;
    sum->behind += share * of_eye->behind;
    sum->outside += share * of_eye->outside;
    sum->deeper += share * of_eye->deeper;
    sum->marched += share * of_eye->marched;
    sum->sticking += share * of_eye->sticking;
    sum->bound_pixels = of_eye->bound_pixels > sum->bound_pixels ? of_eye->bound_pixels : sum->bound_pixels;
    sum->processor_ns += of_eye->processor_ns;
}

/* Makes the view of one of `count` eyes in its part of the picture. */
static bool make_eye(struct views *views, const struct views_request *request, unsigned eye, unsigned count,
                     struct fl_warp_view view, struct fl_warp_error *error)
{
    const float right = count > 1 ? request->baseline * ((float)eye - 0.5f) : 0;
    const size_t first = (size_t)eye * (request->over ? (size_t)view.height * request->width : view.width);
    struct fl_warp_picture picture = {.stride = request->width,
                                      .colours = (uint32_t *)(void *)views->picture.pixels + first,
                                      .mask = views->mask + first};
    for (int row = 0; row < 3; row++)
        view.camera.world_from_view[4 * row + 3] += right * view.camera.world_from_view[4 * row];
    if (!fl_warp_make(views->current.warp, &view, &picture, error))
        return false;
    add_counts(&views->last.counts, &picture.counts, 1 / (float)count);
    return true;
}

/* Pixels of the made picture along a side for each requested one; more than the key's texels would show nothing
 * more. */
static double density_of(const struct views *views, const struct views_request *request, uint32_t eye_height)
{
    const double of_key = views->current.height / tan((double)views->current.key.camera.fov_y / 2);
    const double of_request = eye_height / tan((double)request->camera.fov_y / 2);
    return of_key < of_request ? of_key / of_request : 1;
}

static uint32_t fewer(uint32_t pixels, double density)
{
    const long made = lround(pixels * density);
    return made > 1 ? (uint32_t)made : 1;
}

/* The request with the size that is made. */
static struct views_request sized(const struct views *views, const struct views_request *request, unsigned eyes)
{
    const uint32_t across = request->over ? 1 : eyes, down = request->over ? eyes : 1;
    const double density = density_of(views, request, request->height / down);
    struct views_request made = *request;
    made.width = across * fewer(request->width / across, density);
    made.height = down * fewer(request->height / down, density);
    return made;
}

/* Makes a view in `picture` and `last`. `may_end`: it is cancelled for a newer request. */
static bool make(struct views *views, const struct views_request *wanted, enum fl_warp_quality quality,
                 bool may_end, struct fl_warp_error *error)
{
    const unsigned eyes = wanted->baseline > 0 ? 2 : 1;
    const struct views_request request = sized(views, wanted, eyes);
    if (!reserve(views, &request, error))
        return false;
    const struct fl_warp_view view = {.width = request.over ? request.width : request.width / eyes,
                                      .height = request.over ? request.height / eyes : request.height,
                                      .camera = request.camera,
                                      .quality = quality,
                                      .holes = request.holes,
                                      .is_given_up = may_end ? is_overtaken : NULL,
                                      .given_up_context = views};
    const uint64_t begin_ns = monotonic_now_ns();
    views->last.counts = (struct fl_warp_counts){0};
    for (unsigned eye = 0; eye < eyes; eye++)
        if (!make_eye(views, &request, eye, eyes, view, error))
            return false;
    views->begun_ns = begin_ns;
    views->last.moved_ns = request.moved_ns;
    views->last.key_came_ns = views->current.key.came_ns;
    views->last.quality = quality;
    views->last.took_ns = monotonic_now_ns() - begin_ns;
    views->last.build_ns = fl_warp_build_ns(views->current.warp);
    return true;
}

/* ---- in the threads, with the lock ---- */

static bool same_camera(const struct fl_warp_camera *a, const struct fl_warp_camera *b)
{
    return memcmp(a, b, sizeof(*a)) == 0;
}

static float distance(const struct fl_warp_camera *a, const struct fl_warp_camera *b)
{
    const float *from = a->world_from_view, *to = b->world_from_view;
    return hypotf(hypotf(to[3] - from[3], to[7] - from[7]), to[11] - from[11]);
}

/* True if a new picture of motion is no better than the source of the last view. */
static bool keeps_key(const struct views *views)
{
    const struct views_key *key = &views->current.key;
    return views->given.is_moving && key->is_final && views->current.number != 0 &&
           views->last.key == views->current.number &&
           distance(&views->request.camera, &key->camera) <= key->radius &&
           views_unseen(&views->last) <= (float)PLAN_UNSEEN_LITTLE;
}

/* At rest the first and the last picture of a camera are prepared, so that motion starts with a view. */
static bool wants_key(const struct views *views)
{
    if (!views->given.depth || (views->wants && keeps_key(views)))
        return false;
    return views->wants || views->given.is_final || views->current.number == 0 ||
           !same_camera(&views->given.camera, &views->current.key.camera);
}

static bool is_of_now(const struct views *views, const struct views_made *made)
{
    return made->request == views->requests && made->key == views->current.number &&
           made->layers == views->key_layers;
}

static bool wants_layer(const struct views *views)
{
    return views->given_layer_count > 0 && views->current.number == views->keys &&
           (views->current.key.is_moving || !views->wants);
}

static bool wants_view(const struct views *views)
{
    return views->wants && views->current.number != 0 &&
           (!is_of_now(views, &views->last) || views->last.quality != FL_WARP_TREE);
}

/* A view that was made in time is made again in the best quality, if no other is requested for a while. */
static uint64_t due_ns(const struct views *views)
{
    const uint64_t next_ns = views->begun_ns + views->request.frame_ns, still_ns = views->requested_ns + STILL_NS;
    return is_of_now(views, &views->last) && still_ns > next_ns ? still_ns : next_ns;
}

static void prepare_key(struct views *views)
{
    struct views_key came = views->given;
    struct fl_warp_error error = {0};
    const uint64_t number = views->keys;
    views->given = (struct views_key){0};
    pthread_mutex_unlock(&views->lock);
    const bool set = warped_key_set(&views->next, &came, &error);
    pthread_mutex_lock(&views->lock);
    views->next.number = set ? number : 0;
    views->is_prepared = true;
    if (!set)
        views->error = error;
    pthread_cond_broadcast(&views->changed);
}

static void take_key(struct views *views)
{
    const struct warped_key before = views->current;
    views->current = views->next;
    views->next = before;
    views->is_prepared = false;
    views->key_layers = 1;
    pthread_cond_broadcast(&views->changed);
}

static void take_layer(struct views *views)
{
    struct views_layer came = views->given_layers[0];
    struct fl_warp_error error = {0};
    bool added = false;
    views->is_adding = true;
    views->given_layers[0] = views->given_layers[--views->given_layer_count];
    pthread_mutex_unlock(&views->lock);
    const bool good = warped_key_add(&views->current, &came, &added, &error);
    pthread_mutex_lock(&views->lock);
    views->is_adding = false;
    views->key_layers += added;
    if (!good)
        views->error = error;
}

static void take_request(struct views *views)
{
    const struct views_request request = views->request;
    const uint64_t number = views->requests;
    struct fl_warp_error error = {0};
    const bool again = is_of_now(views, &views->last);
    const enum fl_warp_quality quality = again ? FL_WARP_TREE : views->rung.quality;
    pthread_mutex_unlock(&views->lock);
    views->making = number;
    const bool done = make(views, &request, quality, again, &error);
    if (done && !again)
        plan_rung(&views->rung, views->last.took_ns, request.frame_ns, monotonic_now_ns());
    pthread_mutex_lock(&views->lock);
    if (error.code == FL_WARP_ERROR_GIVEN_UP)
        return;
    /* After a failure nothing is made before there is another key. */
    views->current.number = done ? views->current.number : 0;
    if (!done) {
        views->error = error;
        return;
    }
    views->last.request = number;
    views->last.camera = request.camera;
    views->last.key = views->current.number;
    views->last.layers = views->key_layers;
    pthread_cond_broadcast(&views->changed); /* holes of the view may be the reason to take another key */
    if (number < views->first_request)       /* another motion's */
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

static void *prepare_keys(void *argument)
{
    struct views *views = argument;
    const id_t own = (id_t)gettid();
    setpriority(PRIO_PROCESS, own, getpriority(PRIO_PROCESS, own) + KEY_NICE);
    pthread_mutex_lock(&views->lock);
    while (!views->quit) {
        if (!views->is_prepared && wants_key(views))
            prepare_key(views);
        else
            pthread_cond_wait(&views->changed, &views->lock);
    }
    pthread_mutex_unlock(&views->lock);
    return NULL;
}

static void *make_views(void *argument)
{
    struct views *views = argument;
    pthread_mutex_lock(&views->lock);
    while (!views->quit) {
        if (views->current.number < views->first_key)
            views->current.number = 0;
        if (views->is_prepared)
            take_key(views);
        else if (wants_layer(views))
            take_layer(views);
        else if (!wants_view(views))
            pthread_cond_wait(&views->changed, &views->lock);
        else if (monotonic_now_ns() < due_ns(views))
            wait_until(views, due_ns(views));
        else
            take_request(views);
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
    pthread_cond_broadcast(&views->changed);
    pthread_mutex_unlock(&views->lock);
    views_key_finish(&outdated);
    *key = (struct views_key){0};
}

void views_give_layer(struct views *views, struct views_layer *layer)
{
    pthread_mutex_lock(&views->lock);
    if (views->given_layer_count < FL_WARP_LAYERS_MAX - 1)
        views->given_layers[views->given_layer_count++] = *layer;
    else
        views_layer_finish(layer);
    pthread_cond_broadcast(&views->changed);
    pthread_mutex_unlock(&views->lock);
    *layer = (struct views_layer){0};
}

void views_forget_keys(struct views *views)
{
    pthread_mutex_lock(&views->lock);
    struct views_key outdated = views->given;
    views->given = (struct views_key){0};
    drop_layers(views);
    views->first_key = views->keys + 1;
    views->wants = views->has_made = false;
    pthread_mutex_unlock(&views->lock);
    views_key_finish(&outdated);
}

uint64_t views_start(struct views *views, const struct views_request *request)
{
    pthread_mutex_lock(&views->lock);
    const uint64_t number = ++views->requests;
    if (!views->wants)
        views->first_request = number;
    views->request = *request;
    views->requested_ns = monotonic_now_ns();
    views->wants = true;
    pthread_cond_broadcast(&views->changed);
    pthread_mutex_unlock(&views->lock);
    return number;
}

void views_stop(struct views *views)
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

bool views_is_best(struct views *views, const struct views_made *made, uint64_t request)
{
    pthread_mutex_lock(&views->lock);
    const bool is_newest = made->key == views->keys || (views->given.depth && keeps_key(views));
    const bool is_best = made->request == request && is_newest && made->layers == views->key_layers &&
                         !wants_layer(views) && !views->is_adding && made->quality == FL_WARP_TREE;
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

static void end(struct views *views)
{
    pthread_mutex_lock(&views->lock);
    views->quit = true;
    pthread_cond_broadcast(&views->changed);
    pthread_mutex_unlock(&views->lock);
}

static bool start(struct views *views)
{
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&views->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    pthread_mutex_init(&views->lock, NULL);
    views->first_key = 1;
    if (pthread_create(&views->thread, NULL, make_views, views) == 0) {
        if (pthread_create(&views->key_thread, NULL, prepare_keys, views) == 0)
            return true;
        end(views);
        pthread_join(views->thread, NULL);
    }
    pthread_mutex_destroy(&views->lock);
    pthread_cond_destroy(&views->changed);
    return false;
}

struct views *views_create(struct fl_error *error)
{
    struct fl_warp_error why = {0};
    struct views *views = calloc(1, sizeof(*views));
    if (views) {
        views->current.warp = fl_warp_create(THREADS, &why);
        views->next.warp = fl_warp_create(THREADS, &why);
    }
    if (views && views->current.warp && views->next.warp && start(views))
        return views;
    fl_error_set(error, FL_ERROR_SYSTEM, "", "views cannot be made here: %s",
                 why.code != FL_WARP_ERROR_NONE ? why.text : "no memory, or no thread");
    if (views) {
        fl_warp_destroy(views->current.warp);
        fl_warp_destroy(views->next.warp);
    }
    free(views);
    return NULL;
}

void views_destroy(struct views *views)
{
    if (!views)
        return;
    end(views);
    pthread_join(views->thread, NULL);
    pthread_join(views->key_thread, NULL);
    pthread_mutex_destroy(&views->lock);
    pthread_cond_destroy(&views->changed);
    fl_warp_destroy(views->current.warp);
    fl_warp_destroy(views->next.warp);
    drop_layers(views);
    views_key_finish(&views->given);
    pixmap_finish(&views->made_picture);
    pixmap_finish(&views->picture);
    free(views->mask);
    free(views);
}
