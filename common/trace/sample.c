#include "trace/sample.h"

/* The first dimension is the index itself; the second has direction numbers v1 = 1/2, v(k+1) = vk xor vk/2. */
struct sample_digits sample_digits(uint32_t index)
{
    uint32_t second = 0, left = index;
    for (uint32_t v = 1u << 31; left; left >>= 1, v ^= v >> 1)
        if (left & 1)
            second ^= v;
    return (struct sample_digits){index, sample_reversed(second)};
}

struct sample_position sample_position(uint32_t x, uint32_t y, uint32_t index, uint32_t count,
                                       enum pixel_filter filter)
{
    if (count == 1)
        return (struct sample_position){0.5, 0.5};
    return sample_around_pixel(x, y, sample_digits(index), filter);
}
