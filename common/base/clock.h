#ifndef WEFT_BASE_CLOCK_H
#define WEFT_BASE_CLOCK_H

#include <stdint.h>

/* Monotonic time since an arbitrary start; not wall-clock time. */
int64_t clock_now_ms(void);
int64_t clock_now_us(void);

#endif
