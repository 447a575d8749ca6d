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
    struct sample_position shares = sample_shares(x, y, sample_digits(index), 0);
    return (struct sample_position){sample_spread(shares.x, filter), sample_spread(shares.y, filter)};
}

struct sample_cells sample_cells(uint32_t first, uint32_t end, enum pixel_filter filter)
{
    uint32_t count = end - first;
    bool is_net = count > 1 && !(count & (count - 1)) && first % count == 0;
    struct sample_cells cells = {1, 1};
    if (end == 1 || (!is_net && filter == FILTER_BOX))
        return (struct sample_cells){0, 0};
    while (2 * (uint64_t)cells.across * cells.down <= (is_net ? count : end))
        *(cells.across > cells.down ? &cells.down : &cells.across) *= 2;
    return cells;
}
