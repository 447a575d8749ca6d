/* What a file's access control list (POSIX.1e, as Linux keeps it) says beyond its mode. */
#ifndef WEFT_WIRE_ACCESS_LIST_H
#define WEFT_WIRE_ACCESS_LIST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

/* Whether a list, as the bytes of the attribute system.posix_acl_access, lets nobody read or write the file but its
 * owner and the user. False for bytes that are no such list. */
bool access_list_is_private(const uint8_t *list, size_t size, uid_t user);

/* The same of an open file, for the user that this process is. False where it has no list. */
bool access_list_of_file_is_private(int file);

#endif
