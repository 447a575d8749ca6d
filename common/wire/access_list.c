#include "wire/access_list.h"

#include <sys/xattr.h>
#include <unistd.h>

#include "base/bytes.h"

/* linux/posix_acl_xattr.h: a version of four bytes, then entries of eight: tag, permissions, id. */
enum { VERSION = 2, LIST_BYTES_MAX = 4 + 16 * 8 };

enum tag { TAG_OWNER = 0x01, TAG_USER = 0x02, TAG_MASK = 0x10 };

/* Groups, others and other users must get nothing. The mask is only a limit for what the rest gives. */
static bool next_entry_is_private(struct byte_reader *reader, uid_t user)
{
    uint16_t tag = byte_reader_u16(reader), permissions = byte_reader_u16(reader);
    uint32_t id = byte_reader_u32(reader);
    return permissions == 0 || tag == TAG_OWNER || tag == TAG_MASK || (tag == TAG_USER && id == user);
}

bool access_list_is_private(const uint8_t *list, size_t size, uid_t user)
{
    struct byte_reader reader = byte_reader_of(list, size);
    if (byte_reader_u32(&reader) != VERSION || byte_reader_done(&reader))
        return false;
    bool private = true;
    while (private && !reader.failed && reader.at < size)
        private = next_entry_is_private(&reader, user);
    return private && byte_reader_done(&reader);
}

bool access_list_of_file_is_private(int file)
{
    uint8_t list[LIST_BYTES_MAX];
    ssize_t size = fgetxattr(file, "system.posix_acl_access", list, sizeof list);
    return size > 0 && access_list_is_private(list, (size_t)size, geteuid());
}
