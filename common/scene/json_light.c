#include "scene/json_scene.h"

static void read_strength(const struct json_at *at, struct light *light)
{
    double intensity = 1;
    light->color = vec3_make(1, 1, 1);
    json_colour(json_get(at, "color"), &json_not_negative, &light->color);
    json_number(json_get(at, "intensity"), &json_not_negative, &intensity);
    light->color = vec3_scale(light->color, intensity);
}

static void read_falloff(struct json_at at, struct light *light)
{
    json_numbers(at, &json_not_negative, 3, light->falloff);
    if (fmax(light->falloff[0], fmax(light->falloff[1], light->falloff[2])) < SCENE_SMALLEST)
        json_refuse(&at, "expected at least one number above 0, found [0, 0, 0]");
}

static void read_directional(const struct json_at *at, struct light *light)
{
    static const char *const keys[] = {"type", "direction", "color", "intensity", NULL};
    light->kind = LIGHT_DIRECTIONAL;
    json_keys(*at, keys, NULL);
    json_direction(json_need(at, "direction"), &light->direction);
    read_strength(at, light);
}

static void read_point(const struct json_at *at, struct light *light)
{
    static const char *const keys[] = {"type", "position", "color", "intensity", "falloff", NULL};
    light->kind = LIGHT_POINT;
    json_keys(*at, keys, NULL);
    json_point(json_need(at, "position"), &light->position);
    read_strength(at, light);
    read_falloff(json_get(at, "falloff"), light);
}

/* Where a spot shines: "direction", or from its position to "at". */
static void read_aim(const struct json_at *at, struct light *light)
{
    struct json_at direction = json_get(at, "direction"), target_at = json_get(at, "at");
    if (!direction.value == !target_at.value)
        json_refuse(at, "expected either the key \"at\" or the key \"direction\", found %s",
                    direction.value ? "both" : "neither");
    json_direction(direction, &light->direction);
    struct vec3 target = {0};
    json_point(target_at, &target);
    if (!target_at.value || at->reader->status != STATUS_OK)
        return;
    struct vec3 way = vec3_sub(target, light->position);
    if (vec3_is_zero(way))
        json_refuse(&target_at, "expected a point other than the spot's position, found the same");
    else
        light->direction = vec3_normalize(way);
}

static void read_spot(const struct json_at *at, struct light *light)
{
    static const char *const keys[] = {"type",  "position", "at",    "direction", "color", "intensity",
                                       "falloff", "angle",    "inner", NULL};
    static const struct json_range half_angle = {0, 90, true, false, false};
    light->kind = LIGHT_SPOT;
    json_keys(*at, keys, NULL);
    json_point(json_need(at, "position"), &light->position);
    read_aim(at, light);
    read_strength(at, light);
    read_falloff(json_get(at, "falloff"), light);
    json_number(json_need(at, "angle"), &half_angle, &light->outer_degrees);
    light->inner_degrees = light->outer_degrees;
    const struct json_range inner = {.min = 0, .max = light->outer_degrees};
    json_number(json_get(at, "inner"), &inner, &light->inner_degrees);
}

void json_light(struct json_at at, struct light *light)
{
    static const char *const types[] = {"point", "directional", "spot"};
    static void (*const readers[])(const struct json_at *, struct light *) = {read_point, read_directional,
                                                                             read_spot};
    size_t type = 0;
    *light = (struct light){.falloff = {1, 0, 0}};
    if (!cJSON_IsObject(at.value))
        json_expected(&at, "an object");
    json_choice(json_need(&at, "type"), types, sizeof types / sizeof *types, &type);
    if (at.reader->status == STATUS_OK)
        readers[type](&at, light);
}
