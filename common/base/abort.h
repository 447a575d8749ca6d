#ifndef WEFT_BASE_ABORT_H
#define WEFT_BASE_ABORT_H

/* From here on abort(), by which libraries end the process when memory or threads run out, and assertions when they
 * fail, is exit status STATUS_INTERNAL after a last line that says so; before it stands what they have said
 * themselves. To be called once, as the program starts. `program` is borrowed for ever. */
void abort_becomes_status(const char *program);

#endif
