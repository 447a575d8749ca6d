#include "scene/images.h"
#include "scene/json_scene.h"

void json_image(struct scene_reader *reader, struct json_at at, size_t *image)
{
    const char *file = NULL;
    json_text(at, &file);
    if (!file)
        return;
    enum status status = scene_image_use(reader->scene, reader->assets, reader->name, file, image,
                                         reader->json.error);
    if (status != STATUS_OK)
        json_forward(&at, status);
}

/* --- patterns --------------------------------------------------------------------------------------------- */

static void read_two_colours(const struct json_at *at, struct texture *texture)
{
    struct json_at colors = json_need(at, "colors");
    json_array(colors, 2, 2, "colours");
    for (struct json_at item = json_first(&colors); item.value; json_next(&item))
        json_colour(item, &json_share, &texture->color[item.index]);
}

static void read_checker(struct scene_reader *reader, struct json_at at, struct read_texture *to)
{
    (void)reader;
    static const char *const keys[] = {"type", "colors", "size", "offset", NULL};
    to->texture.size = 1;
    json_keys(at, keys, NULL);
    read_two_colours(&at, &to->texture);
    json_number(json_get(&at, "size"), &json_positive, &to->texture.size);
    json_point(json_get(&at, "offset"), &to->texture.offset);
}

static void read_stripes(struct scene_reader *reader, struct json_at at, struct read_texture *to)
{
    (void)reader;
    static const char *const keys[] = {"type", "colors", "direction", "width", "offset", NULL};
    to->texture.size = 1;
    json_keys(at, keys, NULL);
    read_two_colours(&at, &to->texture);
    json_direction(json_need(&at, "direction"), &to->texture.direction);
    json_number(json_get(&at, "width"), &json_positive, &to->texture.size);
    json_point(json_get(&at, "offset"), &to->texture.offset);
}

static void read_gradient(struct scene_reader *reader, struct json_at at, struct read_texture *to)
{
    (void)reader;
    static const char *const keys[] = {"type", "colors", "direction", "start", "end", NULL};
    to->texture.end = 1;
    json_keys(at, keys, NULL);
    read_two_colours(&at, &to->texture);
    json_direction(json_need(&at, "direction"), &to->texture.direction);
    json_number(json_get(&at, "start"), &json_any, &to->texture.start);
    json_number(json_get(&at, "end"), &json_any, &to->texture.end);
    if (fabs(to->texture.end - to->texture.start) < SCENE_SMALLEST)
        json_refuse(&at, "expected start and end apart, found both at %g", to->texture.start);
}

/* --- images ----------------------------------------------------------------------------------------------- */

/* "file", or "files" for the six faces of a box. */
static void read_files(struct scene_reader *reader, const struct json_at *at, struct texture *texture)
{
    struct json_at file = json_get(at, "file"), files = json_get(at, "files");
    if (!file.value == !files.value)
        json_refuse(at, "expected either the key \"file\" or the key \"files\", found %s",
                    file.value ? "both" : "neither");
    json_image(reader, file, &texture->image[0]);
    for (int i = 1; i < BOX_FACES; i++)
        texture->image[i] = texture->image[0];
    json_array(files, BOX_FACES, BOX_FACES, "file names");
    for (struct json_at item = json_first(&files); item.value; json_next(&item))
        json_image(reader, item, &texture->image[item.index]);
}

static void read_planar_frame(const struct json_at *at, struct read_texture *to)
{
    struct texture *texture = &to->texture;
    struct json_at u = json_get(at, "u"), v = json_get(at, "v");
    to->has_origin = json_get(at, "origin").value != NULL;
    to->has_axes = u.value || v.value;
    json_point(json_get(at, "origin"), &texture->origin);
    if (!to->has_axes)
        return;
    json_point(json_need(at, "u"), &texture->axis_u);
    json_point(json_need(at, "v"), &texture->axis_v);
    if (at->reader->status != STATUS_OK)
        return;
    if (vec3_max_abs(texture->axis_u) < SCENE_SMALLEST || vec3_max_abs(texture->axis_v) < SCENE_SMALLEST) {
        json_refuse(at, "expected u and v other than zero, found one of them zero");
        return;
    }
    /* A sine below 1e-9 leaves fewer than half of a double's digits in the map. */
    struct vec3 sine = vec3_cross(vec3_normalize(texture->axis_u), vec3_normalize(texture->axis_v));
    if (vec3_length(sine) < 1e-9)
        json_refuse(at, "expected u and v in different directions, found them parallel");
}

static void read_map(const struct json_at *at, struct read_texture *to)
{
    static const char *const maps[] = {"sphere", "cylinder", "planar", "box", "mesh"}; /* enum texture_map */
    bool six = json_get(at, "files").value, framed = to->has_origin || to->has_axes;
    struct json_at map_at = json_get(at, "map");
    size_t map = six ? MAP_BOX : framed ? MAP_PLANAR : MAP_SPHERE;
    to->has_map = map_at.value || six || framed;
    json_choice(map_at, maps, sizeof maps / sizeof *maps, &map);
    to->texture.map = (enum texture_map)map;
    if (six && map != MAP_BOX)
        json_refuse(at, "expected the map \"box\" with six files, found \"%s\"", maps[map]);
    if (framed && map != MAP_PLANAR)
        json_refuse(at, "expected the map \"planar\" with origin, u and v, found \"%s\"", maps[map]);
}

static void read_image(struct scene_reader *reader, struct json_at at, struct read_texture *to)
{
    static const char *const keys[] = {"type", "file", "files", "map", "repeat", "origin", "u", "v", NULL};
    double repeat[2] = {1, 1};
    json_keys(at, keys, NULL);
    read_planar_frame(&at, to);
    read_map(&at, to);
    json_numbers(json_get(&at, "repeat"), &json_positive, 2, repeat);
    to->texture.repeat_u = repeat[0];
    to->texture.repeat_v = repeat[1];
    read_files(reader, &at, &to->texture);
}

void json_texture(struct scene_reader *reader, struct json_at at, struct read_texture *to)
{
    static const char *const types[] = {"checker", "stripes", "gradient", "image"};
    static const enum texture_kind kinds[] = {TEXTURE_CHECKER, TEXTURE_STRIPES, TEXTURE_GRADIENT,
                                              TEXTURE_IMAGE};
    static void (*const readers[])(struct scene_reader *, struct json_at, struct read_texture *) = {
        read_checker, read_stripes, read_gradient, read_image};
    if (!cJSON_IsObject(at.value)) {
        json_colour(at, &json_share, &to->texture.color[0]);
        return;
    }
    size_t type = 0;
    json_choice(json_need(&at, "type"), types, sizeof types / sizeof *types, &type);
    if (at.reader->status != STATUS_OK)
        return;
    to->texture.kind = kinds[type];
    readers[type](reader, at, to);
}
