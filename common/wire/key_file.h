/*
 * Files of CURVE keys: text, a key a line as 40 characters of ZeroMQ's Z85 (rfc.zeromq.org/spec/32). Empty lines count
 * for nothing, nor does a line that starts with '#' (no key does: 32 bits never come to that), nor what follows a key
 * after a blank and '#'. Every error names file, line, what was expected and what was found, but never a key.
 */
#ifndef WEFT_WIRE_KEY_FILE_H
#define WEFT_WIRE_KEY_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { KEY_BYTES = 32, KEY_TEXT_BYTES = 41 }; /* of the Z85 form, with the NUL */

/* Secret or public. */
struct key {
    uint8_t bytes[KEY_BYTES];
};

/* All zero is an empty one; key_list_finish frees what it holds. */
struct key_list {
    struct key *keys;
    size_t count, capacity;
};

/* Who may read the file: a secret one only its owner, and by an access control list this process's user; where the
 * owner is root and this process is not, the file's group too (anything else is an error); a public one everybody.
 * Nobody but the owner may write either. */
enum key_secrecy { KEY_PUBLIC, KEY_SECRET };

/* Reads the one key of a file. STATUS_INPUT otherwise, and *key is all zero. The caller wipes a secret. */
enum status key_file_read(struct key *key, const char *path, enum key_secrecy secrecy, struct error *error);

/* Writes text to a file that is not there yet, to be read as secrecy says. STATUS_OUTPUT otherwise; what was there is
 * untouched, and nothing is left of a file that could not be written whole. */
enum status key_file_create(const char *path, const char *text, enum key_secrecy secrecy, struct error *error);

/* Reads a file of any number of public keys into an empty list. STATUS_INPUT otherwise, and the list stays empty. */
enum status key_list_read(struct key_list *list, const char *path, struct error *error);

bool key_list_has(const struct key_list *list, const struct key *key);
void key_list_finish(struct key_list *list);

/* The Z85 form, for a person. */
void key_text(const struct key *key, char text[KEY_TEXT_BYTES]);

#endif
