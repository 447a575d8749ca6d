/*
 * The tree: how fast it is built, what it takes in memory, and how fast it is searched.
 *
 * tree [LARGEST]: up to that many primitives (default 100000; `make bench` takes 1000000).
 */
#include <inttypes.h>
#include <malloc.h>
#include <stdio.h>

#include "tests/bench/bench.h"
#include "trace/plan_parts.h"

/* --- building: the only place here that knows the tree's insides -------------------------------------------- */

static void build_tree(void *context)
{
    const struct plan *plan = context;
    struct bvh bvh = {0};
    size_t count;
    uint32_t *order = bvh_build(&bvh, plan, 1, &count);
    bvh_finish(&bvh);
    free(order);
}

/* Brings the primitives from the tree's order back into the scene's, in which the builder finds them when it makes a
 * plan. The plan's tree does not hold after that. */
static void restore_order(struct plan *plan)
{
    uint32_t *ids = memory_array(plan->primitive_count, sizeof *ids);
    for (size_t i = 0; i < plan->primitive_count; i++)
        ids[i] = (uint32_t)i;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        free(plan->ids[kind]);
    plan_order(plan, ids, plan->primitive_count);
    free(ids);
}

static size_t tree_bytes(const struct bvh *bvh)
{
    return bvh->node_count * sizeof *bvh->nodes + bvh->loose_count * sizeof *bvh->loose;
}

static size_t heap_bytes(void)
{
    struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

static void print_build(enum bench_shape shape, struct plan *plan, size_t plan_bytes, double plan_seconds)
{
    restore_order(plan);
    double seconds = bench_least_seconds(build_tree, plan), count = (double)plan->primitive_count;
    printf("%-9s %9zu %9.2f %9.2f %9.1f %9.1f\n", bench_shape_names[shape], plan->primitive_count,
           1e-6 * count / seconds, 1e-6 * count / plan_seconds, (double)tree_bytes(&plan->bvh) / count,
           (double)plan_bytes / count);
}

static void print_search(enum bench_shape shape, const struct plan *plan)
{
    for (size_t k = 0; kernel_at(k); k++) {
        printf("%-9s %9zu %9s", bench_shape_names[shape], plan->primitive_count, kernel_at(k)->name);
        for (int sort = 0; sort < BENCH_RAY_SORTS; sort++)
            printf(" %9.1f", bench_ns_a_ray(kernel_at(k), plan, (enum bench_rays)sort));
        printf("\n");
    }
}

/* Compiles the scene into *bytes of heap and *seconds of CPU time. */
static struct plan *compile(const struct scene *scene, size_t *bytes, double *seconds)
{
    size_t before = heap_bytes();
    double start = bench_thread_seconds();
    struct plan *plan = bench_plan(scene);
    *seconds = bench_thread_seconds() - start;
    *bytes = heap_bytes() - before;
    return plan;
}

static void for_each_size(size_t largest, bool search)
{
    static const enum bench_shape shapes[] = {BENCH_TRIANGLE, BENCH_SPHERE};
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++)
        for (size_t count = 10000; count <= largest; count *= 10) {
            size_t bytes;
            double seconds;
            struct scene scene = bench_scene(shapes[s], count);
            struct plan *plan = compile(&scene, &bytes, &seconds);
            if (search)
                print_search(shapes[s], plan);
            else
                print_build(shapes[s], plan, bytes, seconds);
            fflush(stdout);
            plan_destroy(&plan);
            scene_finish(&scene);
        }
}

/* --- instances -------------------------------------------------------------------------------------------- */

enum { WEARERS = 100 };

/* Balls of `triangles` in the cube, all of one mesh. */
static struct scene balls_scene(uint32_t triangles)
{
    struct scene scene = scene_at(vec3_make(0, 0, 4), 30);
    uint32_t rings = (uint32_t)sqrt(triangles / 4.0);
    scene_add(&scene, shape_globe(vec3_make(0, 0, 0), 0.15, rings, 2 * rings), material_matte(grey(1)));
    for (uint32_t i = 1; i < WEARERS; i++) {
        struct object *object = scene_share(&scene, 0, material_matte(grey(1)));
        object->transform = affine_rotation(random_unit(i, 0), 180 * random_signed(i, 3));
        object->transform.offset = random_vector(i, 4);
    }
    return scene;
}

/* The balls as instances if `least` is 0, as copies if it is SIZE_MAX. */
static void print_balls(const struct scene *scene, const char *name, size_t least)
{
    struct trace_settings settings = settings_of(scene);
    size_t before = heap_bytes();
    double start = bench_thread_seconds();
    struct plan *plan = plan_create_sharing(scene, &settings, 1, least);
    double seconds = bench_thread_seconds() - start;
    printf("%-9s %9zu %9.2f %9.2f", name, plan->id_count, seconds, 1e-6 * (double)(heap_bytes() - before));
    for (int sort = 0; sort < BENCH_RAY_SORTS; sort++)
        printf(" %9.1f", bench_ns_a_ray(kernel_default(), plan, (enum bench_rays)sort));
    printf("\n");
    plan_destroy(&plan);
}

static void compare_instances(size_t largest)
{
    printf("\n%d balls of one mesh: seconds to compile, MB, ns a ray (%s)\n%-9s %9s %9s %9s", WEARERS,
           kernel_default()->name, "kept as", "triangles", "seconds", "MB");
    for (int sort = 0; sort < BENCH_RAY_SORTS; sort++)
        printf(" %9s", bench_ray_names[sort]);
    printf("\n");
    for (uint32_t triangles = 100; triangles <= largest / 10; triangles *= 10) {
        struct scene scene = balls_scene(triangles);
        print_balls(&scene, "copies", SIZE_MAX);
        print_balls(&scene, "instances", 0);
        scene_finish(&scene);
    }
}

int main(int argc, char **argv)
{
    size_t largest = argc > 1 ? strtoul(argv[1], NULL, 10) : 100000;
    printf("building, on one thread: millions of primitives a second for the tree alone and for the whole plan;\n"
           "bytes a primitive likewise\n");
    printf("%-9s %9s %9s %9s %9s %9s\n", "shape", "count", "tree M/s", "plan M/s", "tree B", "plan B");
    for_each_size(largest, false);
    printf("\nsearching: ns a ray\n%-9s %9s %9s", "shape", "count", "kernel");
    for (int sort = 0; sort < BENCH_RAY_SORTS; sort++)
        printf(" %9s", bench_ray_names[sort]);
    printf("\n");
    for_each_size(largest, true);
    compare_instances(largest);
    return 0;
}
