/*
 * The figures that `weft check` prints, of scenes whose figures are known; and that nothing is kept for what a scene
 * does not wear.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/scene_builder.h"
#include "trace/plan_facts.h"

static struct plan_facts facts_of(const struct scene *scene)
{
    struct trace_settings settings = settings_of(scene);
    struct plan *plan = plan_create(scene, &settings, 1);
    struct plan_facts facts = plan_facts_of(plan, scene);
    plan_destroy(&plan);
    return facts;
}

static struct material checkered(struct vec3 even, struct vec3 odd)
{
    struct material material = material_matte(grey(1));
    material.color = (struct texture){.kind = TEXTURE_CHECKER, .color = {even, odd}, .size = 1};
    return material;
}

static struct material with_image(size_t image)
{
    struct material material = material_matte(grey(1));
    material.color = (struct texture){.kind = TEXTURE_IMAGE, .map = MAP_SPHERE, .repeat_u = 1, .repeat_v = 1};
    for (int i = 0; i < BOX_FACES; i++)
        material.color.image[i] = image;
    return material;
}

static struct shape ball(double x)
{
    return shape_sphere(vec3_make(x, 0, 0), 0.4);
}

static void a_plain_scene_needs_little(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 1, 9), 40);
    scene_add(&scene, ball(0), material_matte(grey(1)));
    scene_add(&scene, shape_plane(vec3_make(0, -1, 0), vec3_make(0, 1, 0)), material_matte(grey(0.5)));
    scene_add_light(&scene, light_point(vec3_make(3, 5, 2), grey(1)));
    struct plan_facts facts = facts_of(&scene);
    assert_int_equal(facts.objects, 2);
    assert_int_equal(facts.primitives, 2);
    assert_int_equal(facts.primitives_of[PRIMITIVE_SPHERE], 1);
    assert_int_equal(facts.primitives_of[PRIMITIVE_PLANE], 1);
    assert_int_equal(facts.primitives_of[PRIMITIVE_BOX], 0);
    assert_int_equal(facts.textured[TEXTURE_CONSTANT], 2);
    assert_int_equal(facts.lights, 1);
    assert_int_equal(facts.lights_of[LIGHT_POINT], 1);
    assert_int_equal(facts.tree_nodes + facts.tree_bytes + facts.loose, 0);
    assert_int_equal(facts.highlights + facts.mirrors + facts.transparent + facts.dielectric + facts.absorbing, 0);
    assert_false(facts.footprints || facts.touching);
    assert_int_equal(facts.folded + facts.smooth + facts.images + facts.black_lights + facts.idle_lights, 0);
    scene_finish(&scene);
}

static void every_feature_is_counted(void **state)
{
    (void)state;
    static const float texels[4 * 2 * 3] = {1, 0.5f};
    struct scene scene = scene_at(vec3_make(0, 1, 19), 40);
    struct material shiny = material_matte(grey(1)), amber = material_glass(1.5, vec3_make(0, 1, 2));
    shiny.specular = grey(0.3);
    scene_add(&scene, ball(0), checkered(grey(0), grey(1)));
    scene_add(&scene, ball(1), with_image(scene_add_image(&scene, 4, 2, texels)));
    scene_add(&scene, ball(2), shiny);
    scene_add(&scene, ball(3), material_mirror(grey(0.5)));
    scene_add(&scene, ball(4), material_filter(grey(0.5)));
    scene_add(&scene, ball(5), amber);
    scene_add(&scene, ball(5.5), material_glass(1.5, grey(0)));
    scene_add(&scene, shape_globe(vec3_make(-3, 0, 0), 1, 4, 5), material_matte(grey(1)));
    struct plan_facts facts = facts_of(&scene);
    assert_int_equal(facts.primitives, 7 + 40);
    assert_true(facts.tree_nodes > 0 && facts.loose == 0);
    assert_int_equal(facts.tree_bytes, facts.tree_nodes * sizeof(struct bvh_node));
    assert_int_equal(facts.textured[TEXTURE_CHECKER], 1);
    assert_int_equal(facts.textured[TEXTURE_IMAGE], 1);
    assert_int_equal(facts.textured[TEXTURE_CONSTANT], 6);
    assert_int_equal(facts.highlights, 1);
    assert_int_equal(facts.mirrors, 1);
    assert_int_equal(facts.transparent, 1);
    assert_int_equal(facts.dielectric, 2);
    assert_int_equal(facts.absorbing, 1);
    assert_int_equal(facts.smooth, 1);
    assert_true(facts.footprints && facts.touching);
    assert_int_equal(facts.images, 1);
    assert_int_equal(facts.image_bytes, (4 * 2 + 2 * 1 + 1 * 1) * 3 * sizeof(float));
    scene_finish(&scene);
}

static void what_nothing_wears_is_not_kept(void **state)
{
    (void)state;
    static const float texels[2 * 2 * 3] = {1, 0.5f};
    struct scene scene = scene_at(vec3_make(0, 1, 9), 40);
    scene_add(&scene, ball(0), with_image(scene_add_image(&scene, 2, 2, texels)));
    scene.objects[0].material = scene_add_material(&scene, &(struct material){.color = texture_plain(grey(1))});
    struct plan_facts facts = facts_of(&scene);
    assert_int_equal(facts.images_unworn, 1);
    assert_int_equal(facts.images, 0);
    assert_int_equal(facts.image_bytes, 0);
    assert_false(facts.footprints);
    scene.background.kind = BACKGROUND_IMAGE;
    facts = facts_of(&scene);
    assert_int_equal(facts.images, 1);
    assert_true(facts.footprints);
    scene_finish(&scene);
}

/* And the picture is that of the plain colour, to the last bit: of a sum of shares it would not be. */
static void a_pattern_of_equal_colours_is_folded(void **state)
{
    (void)state;
    struct vec3 colour = {0.1, 0.7, 0.3};
    struct scene patterned = scene_at(vec3_make(0, 1, 3), 40), plain = scene_at(vec3_make(0, 1, 3), 40);
    scene_add(&patterned, ball(0), checkered(colour, colour));
    scene_add(&plain, ball(0), material_matte(colour));
    struct light lamp = light_point(vec3_make(3, 5, 2), grey(1));
    scene_add_light(&patterned, lamp);
    scene_add_light(&plain, lamp);
    struct plan_facts facts = facts_of(&patterned);
    assert_int_equal(facts.folded, 1);
    assert_int_equal(facts.textured[TEXTURE_CONSTANT], 1);
    assert_false(facts.footprints);
    struct vec3 *a = scene_render(&patterned, kernel_default(), NULL), *b = scene_render(&plain, kernel_default(), NULL);
    assert_memory_equal(a, b, (size_t)plain.width * plain.height * sizeof *a);
    free(a);
    free(b);
    scene_finish(&patterned);
    scene_finish(&plain);
}

static void lights_are_told_apart_by_why_they_are_left_out(void **state)
{
    (void)state;
    struct scene scene = scene_at(vec3_make(0, 1, 9), 40);
    scene_add(&scene, ball(0), material_matte(grey(1)));
    scene_add_light(&scene, light_point(vec3_make(0, 5, 0), grey(0)));
    scene_add_light(&scene, light_spot(vec3_make(0, 5, 0), vec3_make(0, 1, 0), 30, 10));
    scene_add_light(&scene, light_spot(vec3_make(0, 6, 0), vec3_make(0, 1, 0), 30, 10));
    scene_add_light(&scene, light_directional(vec3_make(0, -1, 0), grey(1)));
    struct plan_facts facts = facts_of(&scene);
    assert_int_equal(facts.lights, 1);
    assert_int_equal(facts.lights_of[LIGHT_DIRECTIONAL], 1);
    assert_int_equal(facts.black_lights, 1);
    assert_int_equal(facts.idle_lights, 2);
    scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plain_scene_needs_little),
        cmocka_unit_test(every_feature_is_counted),
        cmocka_unit_test(what_nothing_wears_is_not_kept),
        cmocka_unit_test(a_pattern_of_equal_colours_is_folded),
        cmocka_unit_test(lights_are_told_apart_by_why_they_are_left_out),
    };
    return cmocka_run_group_tests_name("plan_facts", tests, NULL, NULL);
}
