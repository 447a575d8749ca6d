/*
 * The folder in which a file is to be written: that it is there is told in words, before anything is done for the file.
 */
#ifndef WEFT_BASE_FOLDER_H
#define WEFT_BASE_FOLDER_H

#include "base/error.h"

/* STATUS_OUTPUT, with a sentence that begins with `path`, unless the folder of the file at `path` is there. */
enum status folder_is_there(const char *path, struct error *error);

/* The same, and that this process may make files in it. */
enum status folder_takes_files(const char *path, struct error *error);

#endif
