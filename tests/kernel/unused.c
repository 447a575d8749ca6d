/*
 * What a scene does not use costs nothing. callgrind counts the instructions that a render takes, which unlike seconds
 * come out the same again; adding something that no ray reaches must leave their number as it is, to within 0.5 %.
 *
 * The scene is a dozen balls on a thirteenth, and something far behind the camera: a ball that differs in nothing from
 * the others. Each case puts another thing in that ball's place, or dresses it in another material, or adds a light
 * that reaches nothing. How many things there are, and where, does cost something: the tree depends on it. A plane is
 * not among them: it has no end, so every ray has to try it.
 *
 * The program runs itself under callgrind, with a case and a kernel as arguments. Only tracer_area is counted, so
 * neither reading the scene nor compiling it into a plan is.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/cpu.h"
#include "base/parallel.h"
#include "tests/sanitized.h"
#include "tests/scene_builder.h"
#include "trace/plan_parts.h"

static const double share_allowed = 0.005; /* of the instructions */

/* --- scenes ----------------------------------------------------------------------------------------------- */

static const struct vec3 behind = {0, 3, 200};

static struct vec3 near_it(double x, double y, double z)
{
    return vec3_add(behind, vec3_make(x, y, z));
}

static struct material grey_matter(void)
{
    struct material material = material_matte(vec3_make(0.5, 0.6, 0.7));
    material.diffuse = 0.8;
    material.ambient = 0.2;
    return material;
}

/* Every fourth ball mirrors if `mirrors`, so that there are rays in all directions. */
static struct scene base_scene(bool mirrors)
{
    struct scene scene = scene_at(vec3_make(0, 2, 9), 40);
    scene.width = 64;
    scene.height = 48;
    scene.samples = 4;
    scene.background.color[0] = vec3_make(0.1, 0.2, 0.3);
    scene_add_light(&scene, light_directional(vec3_make(-1, -3, -2), grey(0.6)));
    scene_add(&scene, shape_sphere(vec3_make(0, -1000, 0), 1000), grey_matter());
    for (int i = 0; i < 12; i++) {
        struct material material = grey_matter();
        if (mirrors && i % 4 == 0)
            material.reflection = grey(0.5);
        scene_add(&scene, shape_sphere(vec3_make(1.5 * (i % 6) - 3.75, 0.6 + 1.5 * (i / 6), -(i % 3)), 0.6), material);
    }
    return scene;
}

static struct shape hidden_ball(void)
{
    return shape_sphere(behind, 1);
}

static void add_nothing(struct scene *scene)
{
    scene_add(scene, hidden_ball(), grey_matter());
}

/* --- what is never reached: primitives -------------------------------------------------------------------- */

static void add_ellipsoid(struct scene *scene)
{
    struct object *object = scene_add(scene, shape_sphere(grey(0), 1), grey_matter());
    object->transform.linear.z.z = 0.5;
    object->transform.offset = behind;
}

static void add_disc(struct scene *scene)
{
    scene_add(scene, shape_disc(behind, vec3_make(0, 0, 1), 1), grey_matter());
}

static void add_cylinder(struct scene *scene)
{
    scene_add(scene, shape_frustum(near_it(0, -1, 0), near_it(0, 1, 0), 1, 1), grey_matter());
}

static void add_cone(struct scene *scene)
{
    scene_add(scene, shape_frustum(near_it(0, -1, 0), near_it(0, 1, 0), 1, 0), grey_matter());
}

static void add_tube(struct scene *scene)
{
    scene_add(scene, shape_tube(near_it(0, -1, 0), near_it(0, 1, 0), 1, 0.5), grey_matter());
}

static void add_box(struct scene *scene)
{
    scene_add(scene, shape_box(near_it(-1, -1, -1), near_it(1, 1, 1)), grey_matter());
}

static void add_triangle(struct scene *scene)
{
    static const uint32_t corners[3] = {0, 1, 2};
    const struct vec3 points[3] = {near_it(-1, -1, 0), near_it(1, -1, 0), near_it(0, 1, 0)};
    scene_add(scene, shape_mesh(points, 3, corners, 1, false), grey_matter());
}

static void add_smooth_mesh(struct scene *scene)
{
    scene_add(scene, shape_globe(behind, 1, 4, 5), grey_matter());
}

static void add_mesh(struct scene *scene)
{
    struct shape globe = shape_globe(behind, 1, 4, 5);
    free(globe.mesh.normals);
    globe.mesh.normals = NULL;
    scene_add(scene, globe, grey_matter());
}

static void add_pair(struct scene *scene)
{
    scene_add(scene, hidden_ball(), grey_matter());
    scene_add(scene, shape_sphere(near_it(0, 3, 0), 1), grey_matter());
}

static void add_instances(struct scene *scene)
{
    scene_add(scene, shape_globe(behind, 1, 4, 5), grey_matter());
    scene_share(scene, scene->object_count - 1, grey_matter())->transform = affine_translation(vec3_make(0, 3, 0));
}

/* --- what is never reached: materials and textures -------------------------------------------------------- */

static void add_mirror(struct scene *scene)
{
    scene_add(scene, hidden_ball(), material_mirror(grey(0.5)));
}

static void add_highlight(struct scene *scene)
{
    struct material material = grey_matter();
    material.specular = grey(0.5);
    material.shininess = 50;
    scene_add(scene, hidden_ball(), material);
}

static void add_transparent(struct scene *scene)
{
    scene_add(scene, hidden_ball(), material_filter(grey(0.5)));
}

static void add_glass(struct scene *scene)
{
    scene_add(scene, hidden_ball(), material_glass(1.5, grey(0)));
}

static void add_amber(struct scene *scene)
{
    scene_add(scene, hidden_ball(), material_glass(1.5, vec3_make(0, 1, 2)));
}

static void add_ball_in_ball(struct scene *scene)
{
    scene_add(scene, hidden_ball(), grey_matter());
    scene_add(scene, shape_sphere(behind, 0.5), grey_matter());
}

static void add_glass_in_glass(struct scene *scene)
{
    scene_add(scene, hidden_ball(), material_glass(1.5, grey(0)));
    scene_add(scene, shape_sphere(behind, 0.5), material_glass(1.3, grey(0)));
}

static void add_pattern(struct scene *scene, enum texture_kind kind)
{
    struct material material = grey_matter();
    material.color = (struct texture){.kind = kind, .color = {{1, 1, 1}, {0, 0, 0}}, .direction = {1, 0, 0}, .size = 1,
                                      .end = 1};
    scene_add(scene, hidden_ball(), material);
}

static void add_checker(struct scene *scene)
{
    add_pattern(scene, TEXTURE_CHECKER);
}

static void add_stripes(struct scene *scene)
{
    add_pattern(scene, TEXTURE_STRIPES);
}

static void add_gradient(struct scene *scene)
{
    add_pattern(scene, TEXTURE_GRADIENT);
}

static void add_image(struct scene *scene)
{
    static const float texels[4 * 2 * 3] = {1, 0.5f, 0.25f};
    struct material material = grey_matter();
    material.color = (struct texture){.kind = TEXTURE_IMAGE, .map = MAP_SPHERE, .repeat_u = 1, .repeat_v = 1};
    for (int i = 0; i < BOX_FACES; i++)
        material.color.image[i] = scene_add_image(scene, 4, 2, texels);
    scene_add(scene, hidden_ball(), material);
}

/* --- what reaches nothing: lights ------------------------------------------------------------------------- */

static void add_black_light(struct scene *scene)
{
    add_nothing(scene);
    scene_add_light(scene, light_point(vec3_make(3, 3, 3), grey(0)));
}

static void add_spot_that_looks_away(struct scene *scene)
{
    add_nothing(scene);
    scene_add_light(scene, light_spot(vec3_make(0, 9, 3), vec3_make(0, 1, 0), 30, 20));
}

/* --- counting --------------------------------------------------------------------------------------------- */

/* The first ones are what others are compared with: as many primitives in the same places, and so the same tree. */
enum { BASE, BASE_MIRRORS, BASE_MESH, BASE_TWO, BASE_TWO_MIRRORS, BASE_PAIR };

static const struct {
    const char *name;
    void (*add)(struct scene *scene);
    bool mirrors;
    uint8_t like;
} cases[] = {
    [BASE] = {"the scene", add_nothing, false, BASE},
    [BASE_MIRRORS] = {"the scene with mirrors", add_nothing, true, BASE_MIRRORS},
    [BASE_MESH] = {"the scene and a mesh", add_mesh, false, BASE_MESH},
    [BASE_TWO] = {"the scene and a ball in a ball", add_ball_in_ball, false, BASE_TWO},
    [BASE_TWO_MIRRORS] = {"that with mirrors", add_ball_in_ball, true, BASE_TWO_MIRRORS},
    [BASE_PAIR] = {"the scene and two balls", add_pair, false, BASE_PAIR},
    {"an ellipsoid", add_ellipsoid, false, BASE},
    {"a disc", add_disc, false, BASE},
    {"a cylinder", add_cylinder, false, BASE},
    {"a cone", add_cone, false, BASE},
    {"a tube", add_tube, false, BASE},
    {"a box", add_box, false, BASE},
    {"a triangle", add_triangle, false, BASE},
    {"a triangle, beside mirrors", add_triangle, true, BASE_MIRRORS},
    {"a smooth mesh", add_smooth_mesh, false, BASE_MESH},
    {"instances", add_instances, false, BASE_PAIR},
    {"a mirror", add_mirror, false, BASE},
    {"a highlight", add_highlight, false, BASE},
    {"something transparent", add_transparent, false, BASE},
    {"glass", add_glass, false, BASE},
    {"glass that absorbs", add_amber, false, BASE},
    {"glass in glass", add_glass_in_glass, false, BASE_TWO},
    {"glass in glass, beside mirrors", add_glass_in_glass, true, BASE_TWO_MIRRORS},
    {"a checker", add_checker, false, BASE},
    {"a checker, beside mirrors", add_checker, true, BASE_MIRRORS},
    {"stripes", add_stripes, false, BASE},
    {"a gradient", add_gradient, false, BASE},
    {"an image", add_image, false, BASE},
    {"a black light", add_black_light, false, BASE},
    {"a spot that looks away", add_spot_that_looks_away, false, BASE},
};

enum { CASES = sizeof cases / sizeof *cases };

/* What is counted. */
static int render_case(size_t number, const char *kernel)
{
    struct scene scene = base_scene(cases[number].mirrors);
    cases[number].add(&scene);
    struct trace_settings settings = settings_of(&scene);
    struct plan *plan = plan_create_sharing(&scene, &settings, 1, 0);
    free(plan_render(plan, kernel_find(kernel), scene.samples, NULL));
    plan_destroy(&plan);
    scene_finish(&scene);
    return 0;
}

/* Runs cases in this program's own children. */
struct counting {
    const char *program, *kernel;
    uint64_t instructions[CASES]; /* 0: could not be counted */
};

static void count_case(void *context, size_t number)
{
    struct counting *counting = context;
    char *command = memory_format("exec valgrind --tool=callgrind --callgrind-out-file=/dev/null "
                                  "--toggle-collect=tracer_area '%s' %zu %s 2>&1",
                                  counting->program, number, counting->kernel);
    FILE *output = popen(command, "r");
    char line[256];
    unsigned long long found;
    while (output && fgets(line, sizeof line, output))
        if (sscanf(line, "==%*d== Collected : %llu", &found) == 1)
            counting->instructions[number] = found;
    if (output)
        pclose(output);
    free(command);
}

static const char *program;

static void assert_nothing_is_paid(const char *kernel)
{
    struct counting counting = {.program = program, .kernel = kernel};
    int dear = 0;
    parallel_for(cpu_available(), CASES, count_case, &counting);
    for (size_t i = 0; i < CASES; i++) {
        double base = (double)counting.instructions[cases[i].like], share = (double)counting.instructions[i] / base - 1;
        bool good = fabs(share) <= share_allowed;
        print_message("# %s %-32s %9llu instructions %+.3f %%%s\n", kernel, cases[i].name,
                      (unsigned long long)counting.instructions[i], 100 * share, good ? "" : ": too many");
        dear += !good; /* nor is what could not be counted */
    }
    assert_int_equal(dear, 0);
}

static bool can_count(void)
{
#ifdef SANITIZED
    return false;
#else
    return system("valgrind --version >/dev/null 2>&1") == 0;
#endif
}

static void the_scalar_kernel_pays_nothing_for_what_is_not_used(void **state)
{
    (void)state;
    assert_nothing_is_paid("ref");
}

/* Of the lanes, valgrind knows neither AVX-512 nor every AVX2; the source is the same. */
static void lanes_pay_nothing_for_what_is_not_used(void **state)
{
    (void)state;
    assert_nothing_is_paid(kernel_find("sse2") ? "sse2" : "neon");
}

int main(int argc, char **argv)
{
    if (argc == 3)
        return render_case((size_t)atoi(argv[1]), argv[2]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_scalar_kernel_pays_nothing_for_what_is_not_used),
        cmocka_unit_test(lanes_pay_nothing_for_what_is_not_used),
    };
    program = argv[0];
    if (!can_count()) { /* cmocka's own word for it is no TAP that prove takes for a skip */
        puts("1..0 # SKIP counting needs valgrind, and a build without sanitizers");
        return 0;
    }
    return cmocka_run_group_tests_name("unused", tests, NULL, NULL);
}
