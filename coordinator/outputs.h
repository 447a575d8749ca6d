/*
 * Where a render's files go, and that no two of them go to one place, nor one to a file that is read.
 */
#ifndef WEFT_COORDINATOR_OUTPUTS_H
#define WEFT_COORDINATOR_OUTPUTS_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

/* Where the picture of a scene goes: where -o says (`asked`; NULL: nothing was said), which of several scenes is a
 * folder. The caller frees. */
char *outputs_path(const char *asked, const char *scene, bool several);

/* Makes the folder for the pictures of several scenes, if it is not there. */
enum status outputs_make_folder(const char *folder, struct error *error);

/* A file to be written, and what for: a scene or an option. Borrowed. */
struct output {
    const char *what, *path;
};

/* STATUS_USAGE if two of them are the same file. */
enum status outputs_check_distinct(const struct output *outputs, size_t count, struct error *error);

/* STATUS_OUTPUT if the folder of one of them is not there or takes no files. */
enum status outputs_check_folders(const struct output *outputs, size_t count, struct error *error);

/* STATUS_USAGE if one of them is the file `input`, which is read (NULL: none is). */
enum status outputs_check_spare(const struct output *outputs, size_t count, const char *input, struct error *error);

#endif
