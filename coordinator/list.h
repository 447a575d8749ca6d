/*
 * Doubly linked lists whose links are members of what is listed, so that something joins and leaves a list without a
 * search and without memory of its own. A list is a ring: its head is a link too, which nothing owns.
 */
#ifndef WEFT_COORDINATOR_LIST_H
#define WEFT_COORDINATOR_LIST_H

#include <stdbool.h>
#include <stddef.h>

/* A list's head, to be emptied before its use; or a link, all zero while it is in no list. */
struct list {
    struct list *previous, *next;
};

/* What has `link` as the member of that name. */
#define list_owner(link, type, member) ((type *)(void *)((char *)(link) - offsetof(type, member)))

/* Goes through a list that does not change meanwhile. */
#define list_each(link, head) for (struct list *link = (head)->next; link != (head); link = link->next)

static inline void list_empty(struct list *list)
{
    list->previous = list->next = list;
}

static inline bool list_is_empty(const struct list *list)
{
    return list->next == list;
}

static inline bool list_is_in(const struct list *link)
{
    return link->next != NULL;
}

/* Takes the link out of the list that it is in, if it is in one. */
static inline void list_leave(struct list *link)
{
    if (!list_is_in(link))
        return;
    link->previous->next = link->next;
    link->next->previous = link->previous;
    *link = (struct list){NULL, NULL};
}

/* Puts the link at the list's end, from wherever it was. */
static inline void list_append(struct list *list, struct list *link)
{
    list_leave(link);
    *link = (struct list){list->previous, list};
    list->previous->next = link;
    list->previous = link;
}

#endif
