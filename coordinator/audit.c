#include "coordinator/audit.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include <sodium.h>

#include "base/memory.h"

void audit_init(struct audit *audit, double percent)
{
    *audit = (struct audit){.share = percent / 100};
    static_assert(sizeof audit->secret == crypto_shorthash_KEYBYTES, "a key of SipHash");
    randombytes_buf(audit->secret, sizeof audit->secret);
}

void audit_finish(struct audit *audit)
{
    for (size_t i = 0; i < audit->doubt_count; i++)
        bytes_finish(&audit->doubts[i].result);
    free(audit->doubts);
    *audit = (struct audit){0};
}

bool audit_chooses(const void *context, uint32_t job, enum render_pass pass, uint32_t first_row)
{
    const struct audit *audit = context;
    const uint32_t band[] = {job, pass, first_row};
    uint64_t hash;
    crypto_shorthash((unsigned char *)&hash, (const unsigned char *)band, sizeof band, audit->secret);
    return ldexp((double)(hash >> 11), -53) < audit->share;
}

static size_t find(const struct audit *audit, uint32_t job, enum render_pass pass, uint32_t first_row)
{
    size_t i = 0;
    for (; i < audit->doubt_count; i++) {
        const struct doubt *doubt = &audit->doubts[i];
        if (doubt->job == job && doubt->pass == pass && doubt->first_row == first_row)
            break;
    }
    return i;
}

const struct doubt *audit_find(const struct audit *audit, uint32_t job, enum render_pass pass, uint32_t first_row)
{
    size_t i = find(audit, job, pass, first_row);
    return i < audit->doubt_count ? &audit->doubts[i] : NULL;
}

void audit_keep(struct audit *audit, const struct doubt *doubt, const uint8_t *result, size_t size)
{
    audit->doubts = memory_grow(audit->doubts, &audit->doubt_capacity, audit->doubt_count + 1, sizeof *audit->doubts);
    struct doubt *kept = &audit->doubts[audit->doubt_count++];
    *kept = *doubt;
    kept->result = (struct bytes){0};
    bytes_put(&kept->result, result, size);
}

static void drop(struct audit *audit, size_t i)
{
    bytes_finish(&audit->doubts[i].result);
    audit->doubts[i] = audit->doubts[--audit->doubt_count];
}

void audit_drop(struct audit *audit, uint32_t job, enum render_pass pass, uint32_t first_row)
{
    size_t i = find(audit, job, pass, first_row);
    if (i < audit->doubt_count)
        drop(audit, i);
}

void audit_drop_job(struct audit *audit, uint32_t job)
{
    for (size_t i = audit->doubt_count; i-- > 0;)
        if (audit->doubts[i].job == job)
            drop(audit, i);
}
