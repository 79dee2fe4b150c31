/* SPDX-License-Identifier: MIT */
/* Queue of messages for a browser (client/web/queue.h). */
#include "tests/harness/test.h"
#include "web/queue.h"

#include <stdlib.h>

static struct parcel *parcel(bool is_text)
{
    struct parcel *made = calloc(1, sizeof(*made));
    assert_non_null(made);
    made->is_text = is_text;
    return made;
}

/* Adds pictures while there is room; returns how many. */
static unsigned fill(struct web_queue *queue)
{
    unsigned count = 0;
    for (; count < 100 && web_queue_has_room(queue); count++)
        web_queue_add(queue, parcel(false));
    return count;
}

TEST(a_queue_has_room_again_once_a_picture_is_shown)
{
    struct web_queue queue = {0};
    assert_int_equal(fill(&queue), QUEUE_ROOM);
    free(web_queue_take(&queue));
    assert_false(web_queue_has_room(&queue)); /* a message is on its way */
    web_queue_shown(&queue, 1);
    assert_int_equal(fill(&queue), 1);
    web_queue_clear(&queue);
}

TEST(a_browser_that_reads_nothing_gets_no_room_by_its_words)
{
    struct web_queue queue = {0};
    fill(&queue);
    for (int i = 0; i < 1000; i++) {
        web_queue_shown(&queue, 64);
        assert_int_equal(fill(&queue), 0);
    }
    web_queue_clear(&queue);
}

TEST(a_text_needs_not_be_shown)
{
    struct web_queue queue = {0};
    web_queue_add(&queue, parcel(true));
    web_queue_add(&queue, parcel(true));
    assert_false(web_queue_has_room(&queue));
    free(web_queue_take(&queue));
    free(web_queue_take(&queue));
    assert_int_equal(fill(&queue), QUEUE_ROOM);
    web_queue_clear(&queue);
}

TEST(a_text_needs_not_wait_for_pictures_to_be_shown_but_to_be_taken)
{
    struct web_queue queue = {0};
    fill(&queue);
    assert_false(web_queue_has_room_for_text(&queue));
    free(web_queue_take(&queue));
    assert_false(web_queue_has_room(&queue));
    assert_true(web_queue_has_room_for_text(&queue));
    web_queue_clear(&queue);
}

TEST(parcels_come_in_their_order)
{
    struct web_queue queue = {0};
    struct parcel *made[] = {parcel(true), parcel(false), parcel(true)};
    for (int i = 0; i < 3; i++)
        web_queue_add(&queue, made[i]);
    for (int i = 0; i < 3; i++) {
        struct parcel *taken = web_queue_take(&queue);
        assert_ptr_equal(taken, made[i]);
        free(taken);
    }
    assert_null(web_queue_take(&queue));
    web_queue_add(&queue, parcel(true));
    web_queue_clear(&queue);
    assert_null(web_queue_take(&queue));
}
