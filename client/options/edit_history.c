/* SPDX-License-Identifier: MIT */
/* Stacks for undo and redo. */
#include "edit_history.h"

#include <stdlib.h>
#include <string.h>

static void push(struct edit_change *stack, size_t *stack_count, struct fl_assignment *list, size_t count)
{
    if (count == 0) {
        free(list);
        return;
    }
    if (*stack_count == EDIT_HISTORY_MAX) {
        free(stack[0].list);
        memmove(stack, stack + 1, --*stack_count * sizeof(*stack));
    }
    stack[(*stack_count)++] = (struct edit_change){.list = list, .count = count};
}

static void clear(struct edit_change *stack, size_t *stack_count)
{
    while (*stack_count > 0)
        free(stack[--*stack_count].list);
}

void edit_history_add(struct edit_history *history, struct fl_assignment *list, size_t count)
{
    if (count > 0)
        clear(history->redo, &history->redo_count);
    push(history->undo, &history->undo_count, list, count);
}

bool edit_history_take(struct edit_history *history, bool redo, struct edit_change *change)
{
    struct edit_change *stack = redo ? history->redo : history->undo;
    size_t *count = redo ? &history->redo_count : &history->undo_count;
    if (*count == 0)
        return false;
    *change = stack[--*count];
    return true;
}

void edit_history_took(struct edit_history *history, bool redo, struct fl_assignment *list, size_t count)
{
    if (redo)
        push(history->undo, &history->undo_count, list, count);
    else
        push(history->redo, &history->redo_count, list, count);
}

void edit_history_clear(struct edit_history *history)
{
    clear(history->undo, &history->undo_count);
    clear(history->redo, &history->redo_count);
}
