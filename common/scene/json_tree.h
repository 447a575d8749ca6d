/*
 * The tree that cJSON builds of a text.
 */
#ifndef WEFT_SCENE_JSON_TREE_H
#define WEFT_SCENE_JSON_TREE_H

#include <stddef.h>

#include <cjson/cJSON.h>

#include "base/error.h"

/* Of text[size], which json_syntax_check has passed; `file` is its name. *tree is the caller's to delete. With
 * base/memory.h's allocation, so that running out of memory is never taken for a fault of the text. STATUS_INTERNAL if
 * cJSON has another reason. */
enum status json_tree_build(const char *file, const char *text, size_t size, cJSON **tree, struct error *error);

#endif
