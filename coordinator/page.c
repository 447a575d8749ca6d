#include "coordinator/page.h"

#include <string.h>

#include "page_data.h"

#define PAGE_FILE(path, type, name) {path, type, page_##name, sizeof page_##name}

static const struct page_file files[] = {
    PAGE_FILE("/", "text/html; charset=utf-8", index_html),
    PAGE_FILE("/style.css", "text/css; charset=utf-8", style_css),
    PAGE_FILE("/icon.svg", "image/svg+xml", icon_svg),
    PAGE_FILE("/main.js", "text/javascript; charset=utf-8", main_js),
    PAGE_FILE("/server.js", "text/javascript; charset=utf-8", server_js),
    PAGE_FILE("/picture.js", "text/javascript; charset=utf-8", picture_js),
    PAGE_FILE("/plots.js", "text/javascript; charset=utf-8", plots_js),
    PAGE_FILE("/workers.js", "text/javascript; charset=utf-8", workers_js),
    PAGE_FILE("/text.js", "text/javascript; charset=utf-8", text_js),
};

const struct page_file *page_find(const char *path)
{
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        if (strcmp(files[i].path, path) == 0)
            return &files[i];
    return NULL;
}
