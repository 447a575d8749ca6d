#include "trace/plan_facts.h"

#include "trace/instance.h"

static void count_primitives(struct plan_facts *facts, const struct plan *plan)
{
    facts->objects = plan->object_count;
    facts->primitives = plan->id_count;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++)
        facts->primitives_of[kind] = plan->count[kind];
    facts->tree_nodes = plan->bvh.node_count;
    facts->tree_bytes = plan->bvh.node_count * sizeof *plan->bvh.nodes;
    facts->loose = plan->bvh.loose_count;
}

static void count_shared_meshes(struct plan_facts *facts, const struct plan *plan)
{
    facts->shared_meshes = plan->shared_mesh_count;
    for (size_t i = 0; i < plan->shared_mesh_count; i++) {
        facts->shared_triangles += plan->shared_meshes[i].mesh->triangle_count;
        facts->shared_bytes += shared_mesh_bytes(&plan->shared_meshes[i]);
    }
}

static void count_object(struct plan_facts *facts, const struct plan *plan, const struct scene *scene, size_t index)
{
    const struct plan_object *object = &plan->objects[index];
    const struct plan_material *material = &plan->materials[object->material];
    uint8_t texture = plan->textures[object->texture].kind;
    facts->textured[texture]++;
    facts->folded += texture != scene->materials[object->material].color.kind;
    facts->highlights += (material->traits & TRAIT_HIGHLIGHTS) != 0;
    facts->mirrors += (material->traits & TRAIT_MIRRORS) != 0;
    facts->dielectric += material->dielectric;
    facts->transparent += (material->traits & TRAIT_TRANSMITS) && !material->dielectric;
    facts->absorbing += material->absorbs;
    facts->smooth += object->mesh != UINT32_MAX && plan->meshes[object->mesh].smooth;
}

static void count_images(struct plan_facts *facts, const struct plan *plan)
{
    for (size_t i = 0; i < plan->image_count; i++) {
        const struct plan_image *image = &plan->images[i];
        facts->images += image->levels > 0;
        facts->images_unworn += image->levels == 0;
        for (uint32_t k = 0; k < image->levels; k++)
            facts->image_bytes += (size_t)image->level[k].width * image->level[k].height * 3 * sizeof(float);
    }
}

static void count_lights(struct plan_facts *facts, const struct plan *plan, const struct scene *scene)
{
    facts->lights = plan->light_count;
    for (size_t i = 0; i < plan->light_count; i++)
        facts->lights_of[plan->lights[i].kind]++;
    for (size_t i = 0; i < scene->light_count; i++)
        facts->black_lights += vec3_is_zero(scene->lights[i].color);
    facts->idle_lights = scene->light_count - plan->light_count - facts->black_lights;
}

struct plan_facts plan_facts_of(const struct plan *plan, const struct scene *scene)
{
    struct plan_facts facts = {
        .around_camera = plan->camera_media_count,
        .footprints = plan->needs_footprints,
        .touching = plan->contact_count > 0,
    };
    count_primitives(&facts, plan);
    count_shared_meshes(&facts, plan);
    for (size_t i = 0; i < plan->object_count; i++)
        count_object(&facts, plan, scene, i);
    count_images(&facts, plan);
    count_lights(&facts, plan, scene);
    return facts;
}
