/*
 * UTF-8 text that is built up in a growing buffer, and its width on a terminal.
 *
 * Text from outside (paths, host names of workers) may hold any bytes. Nothing here trusts it.
 */
#ifndef WEFT_BASE_TEXT_H
#define WEFT_BASE_TEXT_H

#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"

/* What stands for a byte that is not part of valid UTF-8. */
enum { TEXT_REPLACEMENT = 0xFFFD };

/* The code point at *at, a string that ends with NUL, and moves *at behind it; 0, without moving, at the end.
 * An invalid byte is one TEXT_REPLACEMENT. */
uint32_t text_next(const char **at);

/* Appends one code point as UTF-8. As with all text_put functions a NUL that `size` does not count follows. */
void text_put_code(struct bytes *to, uint32_t code);

/* Appends formatted text; arguments from outside go through text_put_cut or text_next instead. */
void text_put(struct bytes *to, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* How many columns a terminal needs for a code point: 0, 1 or 2. Rather too many than too few, so that a line
 * whose sum fits does fit. */
size_t text_code_columns(uint32_t code);

/* How many columns text_put_cut takes for all of the text. */
size_t text_columns(const char *text);

/* Appends the text; if it is wider than `columns`, its beginning and "…" in at most `columns`. Characters that
 * would move the cursor or reverse the writing direction become TEXT_REPLACEMENT. Returns the columns used. */
size_t text_put_cut(struct bytes *to, const char *text, size_t columns);

#endif
