/* Makes nodes of ranges of items: opens the child with the largest surface until a node has eight. The nodes near the
 * root are made first; the ranges below them are tasks for threads, each with a list of nodes of its own. The lists
 * are joined in the order of the tasks, so that the layout does not depend on who did what. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "trace/bvh_parts.h"

enum {
    TASK_MAX = 1 << 14,  /* items; a task is not worth a thread's while below some thousands */
    EVEN_DEPTH = 20,     /* from here on ranges are halved: 2^32 items take at most 11 more levels */
    BLOCK_NODES = 63,
};

struct node_block {
    struct bvh_node nodes[BLOCK_NODES];
    struct node_block *next;
};

/* A growing list of nodes that stay where they are. */
struct node_list {
    struct node_block *first, *last;
    size_t count;
};

struct task {
    struct bvh_range range;
    int depth;
    uint32_t *link; /* the parent's child[] */
    struct node_list nodes;
};

struct task_list {
    struct task *tasks;
    size_t count, capacity;
};

/* --- lists ------------------------------------------------------------------------------------------------ */

static struct bvh_node *push_node(struct node_list *list)
{
    size_t at = list->count++ % BLOCK_NODES;
    if (at == 0) {
        struct node_block *block = memory_aligned(1, sizeof *block, _Alignof(struct node_block));
        block->next = NULL;
        if (list->last)
            list->last->next = block;
        else
            list->first = block;
        list->last = block;
    }
    struct bvh_node *node = &list->last->nodes[at];
    memset(node, 0, sizeof *node);
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < BVH_WIDTH; i++) {
            node->low[axis][i] = INFINITY;
            node->high[axis][i] = -INFINITY;
        }
    return node;
}

/* Copies the list to `to` and frees it. Children that are nodes are numbered from `base` on. */
static void empty_list(struct node_list *list, struct bvh_node *to, uint32_t base)
{
    for (size_t left = list->count; left > 0;) {
        struct node_block *block = list->first;
        size_t count = left < BLOCK_NODES ? left : BLOCK_NODES;
        memcpy(to, block->nodes, count * sizeof *to);
        for (size_t i = 0; i < count; i++)
            for (int slot = 0; slot < BVH_WIDTH; slot++)
                to[i].child[slot] += to[i].count[slot] == 0 ? base : 0;
        to += count;
        left -= count;
        list->first = block->next;
        free(block);
    }
}

static void push_task(struct task_list *list, const struct bvh_range *range, int depth, uint32_t *link)
{
    list->tasks = memory_grow(list->tasks, &list->capacity, list->count + 1, sizeof *list->tasks);
    list->tasks[list->count++] = (struct task){.range = *range, .depth = depth, .link = link};
}

/* --- nodes ------------------------------------------------------------------------------------------------ */

/* What is to be opened first: no leaf before others, then the largest; −1 if there is nothing left to open. Leaves are
 * cut where a node has room for more children: their boxes are tested eight at a time anyway. */
static int find_widest(const struct bvh_range *ranges, int count, bool even)
{
    int widest = -1;
    bool is_leaf = true;
    double most = -1;
    for (int i = 0; i < count; i++) {
        const struct bvh_range *range = &ranges[i];
        if (range->count == 1 || (range->is_leaf && !is_leaf))
            continue;
        double size = even ? (double)range->count : range->area;
        if (size > most || (is_leaf && !range->is_leaf)) {
            widest = i;
            is_leaf = range->is_leaf;
            most = size;
        }
    }
    return widest;
}

static int open_range(const struct bvh_builder *builder, const struct bvh_range *range, int depth,
                      struct bvh_range children[BVH_WIDTH])
{
    bool even = depth >= EVEN_DEPTH;
    int count = 1, widest = 0;
    children[0] = *range;
    while (count < BVH_WIDTH && (widest = find_widest(children, count, even)) >= 0) {
        bvh_split(builder, &children[widest], &children[count], even);
        count++;
    }
    return count;
}

static void set_leaf(struct bvh_node *node, int slot, const struct bvh_builder *builder, const struct bvh_range *range)
{
    const struct bvh_item *items = builder->items[range->side] + range->first;
    node->child[slot] = (uint32_t)range->first;
    node->count[slot] = (uint8_t)range->count;
    node->kind[slot] = (uint8_t)items[0].kind;
    for (size_t i = 0; i < range->count; i++)
        builder->leaf_items[range->first + i] = (struct bvh_leaf_item){.id = items[i].id, .kind = items[i].kind};
}

static void set_box(struct bvh_node *node, int slot, const struct bvh_range *range, double unit)
{
    for (int axis = 0; axis < 3; axis++) {
        node->low[axis][slot] = (float)(unit * range->box.low[axis]);
        node->high[axis][slot] = (float)(unit * range->box.high[axis]);
    }
}

/* Returns the node's number in its list. Small enough children become tasks if there is a list for those. */
static uint32_t make_node(const struct bvh_builder *builder, struct node_list *nodes, struct task_list *tasks,
                          const struct bvh_range *range, int depth)
{
    struct bvh_range children[BVH_WIDTH];
    uint32_t number = (uint32_t)nodes->count;
    struct bvh_node *node = push_node(nodes);
    int count = open_range(builder, range, depth, children);
    for (int i = 0; i < count; i++) {
        set_box(node, i, &children[i], builder->unit);
        if (children[i].is_leaf)
            set_leaf(node, i, builder, &children[i]);
        else if (tasks && children[i].count <= TASK_MAX)
            push_task(tasks, &children[i], depth + 1, &node->child[i]);
        else
            node->child[i] = make_node(builder, nodes, tasks, &children[i], depth + 1);
    }
    return number;
}

/* --- tasks ------------------------------------------------------------------------------------------------ */

struct crew {
    struct bvh_builder builder; /* for one thread */
    struct task_list tasks;
};

static void run_task(void *context, size_t index)
{
    struct crew *crew = context;
    struct task *task = &crew->tasks.tasks[index];
    make_node(&crew->builder, &task->nodes, NULL, &task->range, task->depth);
}

/* Joins the tree's top and what the tasks made. */
static void join(struct bvh *bvh, struct node_list *top, struct task_list *tasks)
{
    bvh->node_count = top->count;
    for (size_t i = 0; i < tasks->count; i++) {
        *tasks->tasks[i].link = (uint32_t)bvh->node_count;
        bvh->node_count += tasks->tasks[i].nodes.count;
    }
    bvh->nodes = memory_aligned(bvh->node_count, sizeof *bvh->nodes, _Alignof(struct bvh_node));
    size_t at = top->count;
    empty_list(top, bvh->nodes, 0);
    for (size_t i = 0; i < tasks->count; i++) {
        struct node_list *nodes = &tasks->tasks[i].nodes;
        empty_list(nodes, bvh->nodes + at, (uint32_t)at);
        at += nodes->count;
    }
}

void bvh_make_nodes(struct bvh *bvh, const struct bvh_builder *builder, size_t item_count)
{
    struct node_list top = {0};
    struct crew crew = {.builder = *builder};
    crew.builder.threads = 1;
    struct bvh_range all = bvh_range_make(builder, 0, 0, item_count);
    make_node(builder, &top, &crew.tasks, &all, 0);
    int threads = item_count > TASK_MAX ? builder->threads : 1;
    parallel_for(threads, crew.tasks.count, run_task, &crew);
    join(bvh, &top, &crew.tasks);
    free(crew.tasks.tasks);
}
