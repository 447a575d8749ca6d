/*
 * How two machines know that they would compute the same bytes.
 */
#ifndef WEFT_TRACE_PROOF_H
#define WEFT_TRACE_PROOF_H

#include "base/hash.h"
#include "trace/kernel.h"

/* A digest of the sources that decide a pixel: base, math, image, scene and trace. */
struct digest proof_revision(void);

/* Renders a small built-in scene that uses every kind of primitive, texture, light and material, and digests its
 * pixels' bits. Machines whose digests differ must not work on one picture. */
struct digest proof_render(const struct kernel *kernel);

#endif
