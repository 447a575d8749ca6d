#include "scene/json_tree.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/memory.h"

static void *allocate(size_t size)
{
    return memory_array(size, 1);
}

static void choose_allocation(void)
{
    cJSON_InitHooks(&(cJSON_Hooks){allocate, free});
}

enum status json_tree_build(const char *file, const char *text, size_t size, cJSON **tree, struct error *error)
{
    static pthread_once_t chosen = PTHREAD_ONCE_INIT;
    pthread_once(&chosen, choose_allocation);
    *tree = cJSON_ParseWithLength(text, size);
    if (!*tree)
        return error_set(error, STATUS_INTERNAL, "%s: cJSON cannot build its tree", file);
    return STATUS_OK;
}
