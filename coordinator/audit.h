/*
 * Audits: bands chosen in secret are rendered by a second worker too, and the bytes compared. Where they differ, what a
 * worker of the coordinator's own machine returns is taken for right. Beside the secret that it draws at first, pure;
 * the dispatcher asks.
 */
#ifndef WEFT_COORDINATOR_AUDIT_H
#define WEFT_COORDINATOR_AUDIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/bytes.h"
#include "wire/message.h"

/* Bands of which two workers have returned different bytes, neither of them trusted: what the second one returned. */
struct doubt {
    uint32_t job;
    enum render_pass pass;
    uint32_t first_row;
    uint32_t second; /* worker */
    struct bytes result;
};

struct audit {
    double share;       /* of the bands that are audited, 0..1 */
    uint8_t secret[16]; /* so that nobody knows which */
    struct doubt *doubts;
    size_t doubt_count, doubt_capacity;
};

/* `percent`: 0..100. */
void audit_init(struct audit *audit, double percent);
void audit_finish(struct audit *audit);

/* Whether this band is to be audited; for scheduler_policy, with a struct audit as context. */
bool audit_chooses(const void *audit, uint32_t job, enum render_pass pass, uint32_t first_row);

/* The doubt about that band; NULL: there is none. Borrowed until the next change. */
const struct doubt *audit_find(const struct audit *audit, uint32_t job, enum render_pass pass, uint32_t first_row);

/* Keeps what the second worker returned: result[size], copied. */
void audit_keep(struct audit *audit, const struct doubt *doubt, const uint8_t *result, size_t size);

/* Forgets that doubt; and all doubts of a job. */
void audit_drop(struct audit *audit, uint32_t job, enum render_pass pass, uint32_t first_row);
void audit_drop_job(struct audit *audit, uint32_t job);

#endif
