/*
 * A file that appears under its name when it is complete, or not at all. Until then its bytes are in a file in the same
 * folder that has no name, and is gone if its process is killed; where the file system knows no such files, in a
 * temporary one, `.NAME.PID.part`.
 */
#ifndef WEFT_IMAGE_PART_FILE_H
#define WEFT_IMAGE_PART_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* Open from part_file_open to part_file_publish or part_file_discard. */
struct part_file {
    char *path;       /* of the output, as the user named it */
    const char *name; /* the part of path after the last slash */
    char *temporary;  /* the temporary file's name in the folder, */
    bool named;       /* and whether it has it */
    int folder_fd;
    int fd;           /* of the temporary file; -1 when closed */
};

/* Creates the temporary file, replacing what a killed process with our id may have left: whoever calls
 * this keeps other writers off `path`. `path` must be new or a regular file (a symbolic link to one is
 * replaced, not followed). STATUS_OUTPUT with a sentence otherwise; *file is then closed. */
enum status part_file_open(struct part_file *file, const char *path, struct error *error);

/* Writes all of data[size] at `offset`. On failure (STATUS_OUTPUT) the file is discarded. */
enum status part_file_write(struct part_file *file, const void *data, size_t size, uint64_t offset,
                            struct error *error);

/* fsyncs, closes and renames the file to its path, and fsyncs the folder. Closes *file whether it succeeds
 * or not; on failure (STATUS_OUTPUT) the temporary file is gone. */
enum status part_file_publish(struct part_file *file, struct error *error);

/* Removes the temporary file and closes *file. Does nothing if it is closed. */
void part_file_discard(struct part_file *file);

#endif
