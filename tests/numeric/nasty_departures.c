/*
 * Rays that leave surfaces, made as shading makes them at the hits of nasty rays: mirrored and shadow rays on
 * the outside must not meet the primitive that they leave, and rays that go in, or on inside, must come out of
 * it, once and where the oracle says. Closed convex meshes must behave as solids do, also at their edges and
 * vertices.
 *
 * FULL=1 in the environment shoots a million rays at each primitive, otherwise a 125th of that.
 */
#include <stdlib.h>

#include "tests/numeric/bounce.h"
#include "tests/numeric/nasty.h"

static const double distances[] = {0.7, 4, 1e3, 1e6};

enum { BATCH = 500, INNER_BOUNCES = 4, DISTANCES = sizeof distances / sizeof *distances };

struct tally {
    unsigned outward, inward, shadows;
    unsigned false_hits, leaks, misplaced, false_shadows;
};

/* The nearest hit, without the care that shoot_ray takes. */
static struct hit hit_by(const struct world *world, const struct ray *ray)
{
    struct ray_batch rays = {0};
    struct hit_batch hits = {0};
    ray_batch_push(&rays, ray);
    shoot_batch(world->plan, &rays, &hits);
    struct hit hit = hit_at(world->plan, &rays, &hits, 0);
    ray_batch_finish(&rays);
    hit_batch_finish(&hits);
    return hit;
}

/* --- outward ---------------------------------------------------------------------------------------------- */

static void count_shadows(struct tally *tally, const struct world *world, const struct path *path,
                          const struct hit *hit)
{
    const struct generation *g = generation_at(world, &(struct medium_pool){0}, path, hit);
    struct surfaces surfaces = g->surfaces;
    struct lighting lighting = {0};
    struct shadow_batch shadows = {0};
    struct crossing_list crossings = {0};
    g->kernel->ambient(world->plan, &surfaces);
    for (size_t light = 0; light < world->plan->light_count; light++) {
        g->kernel->light(world->plan, light, &surfaces, &lighting);
        shadow_batch_collect(&shadows, &lighting, surfaces.count);
        g->kernel->shadow_rays(&surfaces, &lighting, &shadows);
        for (size_t k = 0; kernel_at(k) && shadows.rays.count > 0; k++) {
            kernel_at(k)->shadow(world->plan, &shadows.rays, shadows.blocked, &crossings);
            tally->false_shadows += shadows.blocked[0];
        }
        tally->shadows += (unsigned)shadows.rays.count;
    }
    crossing_list_finish(&crossings);
    shadow_batch_finish(&shadows);
    lighting_finish(&lighting);
}

/* An opaque mirror, lit from all around and from nearby. */
static struct stage mirror_stage(int kind, double distance, uint32_t i)
{
    struct material material = material_matte(grey(1));
    material.reflection = grey(0.5);
    struct stage stage = stage_of(kind, distance, material, i);
    plan_destroy(&stage.world.plan);
    for (uint32_t k = 0; k < 6; k++) {
        struct vec3 d = random_unit(i, 70 + 3 * k);
        struct vec3 place = vec3_add_scaled(stage.middle, d, stage.size * (k < 3 ? 2 : 1000));
        scene_add_light(&stage.world.scene,
                        k % 3 == 0 ? light_directional(d, grey(1)) : light_point(place, grey(1)));
    }
    world_compile(&stage.world);
    return stage;
}

/* From the outside of a convex thing, nothing of it is ahead. A tube is seen from inside, too: not there. */
static void outward(struct tally *tally, int kind, double distance, uint32_t batch)
{
    struct stage stage = mirror_stage(kind, distance, 97 * batch + (uint32_t)kind);
    bool tube = kind >= CYLINDER_OPEN && kind <= FRUSTUM_OPEN;
    for (uint32_t k = 0; k < BATCH; k++) {
        struct medium_pool media = {0};
        struct ray ray =
            nasty_ray(&stage, kind, (enum aim)(k % AIMS), hash_u32(batch * BATCH + k) ^ (uint32_t)kind);
        struct path path = path_along(ray);
        struct hit hit = hit_by(&stage.world, &ray);
        bool solid = shape_is_closed(&stage.world.scene.objects[0].shape);
        if (hit.id == PRIMITIVE_NONE || ((tube || solid) && hit.side == SIDE_LEAVE))
            continue;
        struct bounce bounce = bounce_at(&stage.world, &media, &path, &hit);
        if (bounce.is_mirrored) {
            tally->outward++;
            tally->false_hits += hit_by(&stage.world, &bounce.mirrored.ray).id != PRIMITIVE_NONE;
        }
        count_shadows(tally, &stage.world, &path, &hit);
        medium_pool_finish(&media);
    }
    world_end(&stage.world);
}

/* --- inward ----------------------------------------------------------------------------------------------- */

/* One step of a path within glass: counts what leaves and must meet nothing, and takes *path and *hit to where the
 * light that stays inside goes. False if none does. */
static bool step_inside(struct tally *tally, const struct world *world, struct medium_pool *media,
                        struct path *path, struct hit *hit)
{
    bool leaves = hit->side == SIDE_LEAVE;
    if (leaves && path->medium == MEDIUM_SPACE)
        path->medium = medium_push(media, MEDIUM_SPACE, 0); /* the camera is inside */
    struct bounce bounce = bounce_at(world, media, path, hit);
    if (leaves ? bounce.is_transmitted : bounce.is_mirrored) {
        struct ray out = leaves ? bounce.transmitted.ray : bounce.mirrored.ray;
        tally->outward++;
        tally->false_hits += hit_by(world, &out).id != PRIMITIVE_NONE;
    }
    if (!(leaves ? bounce.is_mirrored : bounce.is_transmitted))
        return false;
    *path = leaves ? bounce.mirrored : bounce.transmitted;
    path->throughput = grey(1);
    *hit = hit_by(world, &path->ray);
    tally->inward++;
    return true;
}

/* A ray inside a solid leaves it within the oracle's limits, or at once where those lie behind its start. Its start
 * has, along the surface, the error of the ray that came there, whose `unit` was larger if it came from afar. What
 * leaves glass is taken to be farther by COINCIDENCE, so a ray along a face steps over its edge by as much at each
 * bounce. */
static bool comes_out(const struct stage *stage, int kind, double unit, const struct ray *ray,
                      const struct hit *hit)
{
    struct limits_ray exact = limits_ray_in(&stage->frame, ray->origin, ray->direction);
    double slack = kinds[kind].slack * fmax(unit, unit_of(stage, kind, ray, hit->t));
    double delay = COINCIDENCE * (fabs(hit->t) + vec3_max_abs(ray->origin));
    const struct shape *shape = &stage->world.scene.objects[0].shape;
    struct limits_root root = limits_roots(shape, &exact, slack).side[SIDE_LEAVE];
    bool early = hit->t < root.low - 1.5 * INNER_BOUNCES * delay;
    bool late = hit->t > delay && hit->t > root.high + delay;
    return !root.may || !(early || late);
}

/* Into glass, and on inside for a few bounces. */
static void inward(struct tally *tally, int kind, double distance, uint32_t batch)
{
    struct material glass = material_glass(random_between(batch, 80, 0.6, 2.5), grey(0));
    struct stage stage = stage_of(kind, distance, glass, 97 * batch + (uint32_t)kind);
    for (uint32_t k = 0; k < BATCH; k++) {
        struct medium_pool media = {0};
        struct ray ray =
            nasty_ray(&stage, kind, (enum aim)(k % AIMS), hash_u32(batch * BATCH + k) ^ (uint32_t)kind);
        struct path path = path_along(ray);
        struct hit hit = hit_by(&stage.world, &ray);
        double unit = unit_of(&stage, kind, &ray, hit.t);
        for (int bounces = 0; hit.id != PRIMITIVE_NONE && bounces < INNER_BOUNCES; bounces++) {
            if (!step_inside(tally, &stage.world, &media, &path, &hit))
                break;
            bool out = hit.id != PRIMITIVE_NONE && hit.side == SIDE_LEAVE;
            tally->leaks += !out;
            tally->misplaced += out && !comes_out(&stage, kind, unit, &path.ray, &hit);
        }
        medium_pool_finish(&media);
    }
    world_end(&stage.world);
}

/* --- meshes ----------------------------------------------------------------------------------------------- */

/* A ray within glass meets a wall from inside; or, where it has just crossed the wall at an edge, the wall's
 * neighbour from outside, within the error of its start, which shading passes over. */
static bool is_leak(const struct ray *ray, const struct hit *hit)
{
    return hit->id == PRIMITIVE_NONE || (hit->side == SIDE_ENTER && !(hit->t <= -ray->t_min));
}

/* Follows a ray into a mesh of glass and on inside for a few bounces. */
static void follow_in_mesh(struct tally *tally, const struct world *world, struct path path)
{
    struct medium_pool media = {0};
    struct hit hit = hit_by(world, &path.ray);
    for (int bounces = 0; hit.id != PRIMITIVE_NONE && bounces < INNER_BOUNCES; bounces++) {
        if (!step_inside(tally, world, &media, &path, &hit))
            break;
        tally->leaks += is_leak(&path.ray, &hit);
    }
    medium_pool_finish(&media);
}

/* A convex globe of glass, met at vertices, edges and anywhere, 1e-9 beside them. */
static void mesh_of_glass(struct tally *tally, double distance, uint32_t batch)
{
    struct vec3 center = vec3_scale(random_vector(batch, 20), 10);
    struct shape globe = shape_globe(center, 1, 5, 7);
    free(globe.mesh.normals);
    globe.mesh.normals = NULL;
    struct world world = world_begin(vec3_add_scaled(center, random_unit(batch, 23), distance));
    scene_add(&world.scene, globe, material_glass(1.5, grey(0)));
    world_compile(&world);
    for (uint32_t k = 0; k < BATCH; k++) {
        uint32_t i = hash_u32(batch * BATCH + k);
        const uint32_t *corners = &globe.mesh.index[3 * (i % globe.mesh.triangle_count)];
        double v = k % 3 == 0 ? 0 : random_between(i, 3, 0, 1);
        double w = k % 3 == 2 ? (1 - v) * random_between(i, 4, 0, 1) : 0;
        struct vec3 a = globe.mesh.points[corners[0]], b = globe.mesh.points[corners[1]];
        struct vec3 target = vec3_add_scaled(vec3_mix(a, b, v), vec3_sub(globe.mesh.points[corners[2]], a), w);
        struct vec3 o = vec3_add_scaled(target, random_unit(i, 5), fmax(distance, 3));
        follow_in_mesh(tally, &world,
                       path_along(ray_from(&world, o, vec3_sub(vec3_mix(target, center, 1e-9), o))));
    }
    world_end(&world);
}

/* --- the table -------------------------------------------------------------------------------------------- */

static void print_head(const char *name)
{
    printf("# %-15s %8s %8s %10s %8s %6s %9s %8s %14s\n", name, "distance", "outward", "self-hits", "inward",
           "leaks", "misplaced", "shadows", "self-shadows");
}

static unsigned print_row(double distance, const struct tally *tally)
{
    printf("# %-15s %8g %8u %10u %8u %6u %9u %8u %14u\n", "", distance, tally->outward, tally->false_hits,
           tally->inward, tally->leaks, tally->misplaced, tally->shadows, tally->false_shadows);
    return tally->false_hits + tally->leaks + tally->misplaced + tally->false_shadows;
}

static uint32_t batches(void)
{
    return getenv("FULL") ? 500 : 4;
}

static void every_primitive(void **state)
{
    (void)state;
    unsigned wrong = 0;
    for (int kind = 0; kind < KINDS; kind++) {
        struct shape shape = shape_of(kind);
        bool solid = shape_is_closed(&shape);
        print_head(kinds[kind].name);
        for (size_t i = 0; i < DISTANCES; i++) {
            struct tally tally = {0};
            for (uint32_t batch = 0; batch < batches(); batch++) {
                outward(&tally, kind, distances[i], batch);
                if (solid)
                    inward(&tally, kind, distances[i], batch);
            }
            wrong += print_row(distances[i], &tally);
        }
        if (shape.kind == SHAPE_MESH)
            mesh_finish(&shape.mesh);
    }
    assert_int_equal(wrong, 0);
}

static void closed_meshes(void **state)
{
    (void)state;
    unsigned wrong = 0;
    print_head("glass globe");
    for (size_t i = 0; i < DISTANCES; i++) {
        struct tally tally = {0};
        for (uint32_t batch = 0; batch < batches(); batch++)
            mesh_of_glass(&tally, distances[i], batch);
        wrong += print_row(distances[i], &tally);
    }
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_primitive),
        cmocka_unit_test(closed_meshes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
