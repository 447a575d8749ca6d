#ifndef WEFT_BASE_CLOCK_H
#define WEFT_BASE_CLOCK_H

#include <stdint.h>

/* Monotonic time since an arbitrary start; not wall-clock time. */
int64_t clock_now_ms(void);
int64_t clock_now_us(void);

/* The wall clock's time as ISO 8601 has it, in UTC: 2026-01-31T23:59:59.123Z. */
enum { CLOCK_TEXT_BYTES = 32 };
void clock_text(char text[CLOCK_TEXT_BYTES]);

#endif
