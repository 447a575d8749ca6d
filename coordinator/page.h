/*
 * The files of the status page (coordinator/page), as they are in the program.
 */
#ifndef WEFT_COORDINATOR_PAGE_H
#define WEFT_COORDINATOR_PAGE_H

#include <stddef.h>

struct page_file {
    const char *path, *type; /* of the URL; of the content */
    const unsigned char *data;
    size_t size;
};

/* NULL: there is none of that path. */
const struct page_file *page_find(const char *path);

#endif
