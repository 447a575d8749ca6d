#include "trace/proof.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "core_revision.h"
#include "scene/load.h"
#include "trace/tracer.h"

enum { PROOF_SIDE = 12 };

static const char proof_scene[] =
    "{\"camera\": {\"from\": [0.3, 1.7, 6.1], \"at\": [0, 0.9, 0], \"fov\": 47},"
    " \"background\": {\"type\": \"gradient\", \"bottom\": [0.2, 0.3, 0.4], \"top\": \"#8ac\"},"
    " \"depth\": 6,"
    " \"lights\": ["
    "  {\"type\": \"point\", \"position\": [3, 5, 4], \"color\": [0.9, 0.8, 0.7], \"falloff\": [0.5, 0.05, 0.01]},"
    "  {\"type\": \"directional\", \"direction\": [-0.4, -1, -0.7], \"intensity\": 0.4},"
    "  {\"type\": \"spot\", \"position\": [-3, 4, 3], \"at\": [0, 0, 0], \"angle\": 35, \"inner\": 20}],"
    " \"objects\": ["
    "  {\"type\": \"plane\", \"point\": [0, 0, 0], \"normal\": [0, 1, 0],"
    "   \"material\": {\"color\": {\"type\": \"checker\", \"colors\": [\"#eee\", \"#234\"], \"size\": 0.7}}},"
    "  {\"type\": \"sphere\", \"center\": [-1.6, 1, 0.4], \"radius\": 0.8, \"material\": {\"ior\": 1.5, \"specular\": 0.4,"
    "   \"shininess\": 77.7, \"absorption\": [0.1, 0.4, 0.2]}},"
    "  {\"type\": \"sphere\", \"radius\": 0.6, \"transform\": [{\"scale\": [1, 1.6, 0.7]}, {\"rotate\": [20, 33, 7]},"
    "   {\"translate\": [0.2, 1.1, 0]}], \"material\": {\"reflection\": [0.7, 0.6, 0.5]}},"
    "  {\"type\": \"sphere\", \"center\": [0.4, 0.6, 1.9], \"radius\": 0.4, \"material\": {\"transparency\": 0.6,"
    "   \"filter\": [0.9, 0.3, 0.2]}},"
    "  {\"type\": \"cylinder\", \"base\": [1.5, 0, 0.6], \"top\": [1.7, 1.3, 0.2], \"radius\": 0.35, \"material\":"
    "   {\"color\": {\"type\": \"stripes\", \"direction\": [1, 0, 1], \"width\": 0.15, \"colors\": [\"#c33\", \"#fed\"]}}},"
    "  {\"type\": \"cone\", \"base\": [2.4, 0, -1], \"apex\": [2.3, 1.9, -0.8], \"radius\": 0.6, \"material\":"
    "   {\"color\": {\"type\": \"gradient\", \"direction\": [0, 1, 0], \"colors\": [\"#283\", \"#ff8\"], \"end\": 2}}},"
    "  {\"type\": \"frustum\", \"base\": [-2.8, 0, -1], \"top\": [-2.6, 1.2, -1], \"base_radius\": 0.7, \"top_radius\": 0.3,"
    "   \"open\": true},"
    "  {\"type\": \"disc\", \"center\": [0, 2.6, -1.5], \"normal\": [0.1, -0.3, 1], \"radius\": 0.7},"
    "  {\"type\": \"tetrahedron\", \"points\": [[-0.9, 0, 2.2], [-0.3, 0, 2.6], [-0.4, 0, 1.8], [-0.6, 0.7, 2.2]],"
    "   \"material\": {\"ior\": 1.3}},"
    "  {\"type\": \"box\", \"min\": [-0.4, -0.4, -0.4], \"max\": [0.4, 0.4, 0.4], \"transform\": [{\"rotate\": {\"axis\":"
    "   [1, 2, 3], \"angle\": 41}}, {\"translate\": [-0.9, 0.7, -1.6]}], \"material\": {\"specular\": 0.5}}]}";

struct digest proof_revision(void)
{
    struct digest digest;
    static const char hex[] = CORE_REVISION;
    static_assert(sizeof hex == DIGEST_HEX_BYTES, "a digest in hexadecimal");
    for (size_t i = 0; i < DIGEST_BYTES; i++) {
        const char pair[3] = {hex[2 * i], hex[2 * i + 1], '\0'};
        digest.bytes[i] = (uint8_t)strtoul(pair, NULL, 16);
    }
    return digest;
}

static struct digest digest_picture(const struct plan *plan, const struct kernel *kernel)
{
    const struct sampling sampling = {.least = 1, .most = 16, .threshold = 70}; /* stops at each of its stages */
    struct bytes bits = {0};
    struct tracer *tracer = tracer_create(plan, kernel);
    for (uint32_t y = 0; y < PROOF_SIDE; y++) {
        struct pixel row[PROOF_SIDE];
        struct ray_counts counts = {0};
        tracer_area(tracer, &sampling, &(struct pixel_area){0, PROOF_SIDE, y, y + 1}, row, &counts);
        for (size_t x = 0; x < PROOF_SIDE; x++) {
            bytes_put_f64(&bits, row[x].light.x);
            bytes_put_f64(&bits, row[x].light.y);
            bytes_put_f64(&bits, row[x].light.z);
            bytes_put_f64(&bits, row[x].error);
            bytes_put_u32(&bits, row[x].samples);
        }
    }
    tracer_destroy(&tracer);
    struct digest digest = digest_of(bits.data, bits.size);
    bytes_finish(&bits);
    return digest;
}

struct digest proof_render(const struct kernel *kernel)
{
    struct asset_set assets = {0};
    struct bytes text = {0};
    bytes_put(&text, proof_scene, sizeof proof_scene); /* with its NUL, */
    text.size--;                                       /* which the size does not count */
    asset_set_add(&assets, "proof.json", &text);
    struct scene scene = {0};
    struct error error;
    enum status status = scene_load(&scene, "proof.json", &assets, &error);
    assert(status == STATUS_OK);
    (void)status;
    const struct trace_settings settings = {PROOF_SIDE, PROOF_SIDE, FILTER_BOX};
    struct plan *plan = plan_create(&scene, &settings, 1);
    struct digest digest = digest_picture(plan, kernel);
    plan_destroy(&plan);
    scene_finish(&scene);
    asset_set_finish(&assets);
    return digest;
}
