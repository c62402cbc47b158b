// SPDX-License-Identifier: GPL-3.0-or-later
// Sub-plans of shadow textures: a light's map with the tests of all that are held against it. A light has samples x groups of casters x
// faces of them, thousands in a picture: the plan holds their loops (steps.c), and each is made when its round comes, of the scene, the
// plan and the round's numbers alone.
#include "passes.h"
#include "shared/shadows.h"

#include <string.h>

// Texels between points, where the picture need not be exact: filling closes what they leave open, and where it could not light would
// come through.
#define MAP_DETAIL 1.0f

// Whether an instance, or PT_PIXELS, is tested against the group's maps.
static int receives(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                    uint32_t group, uint32_t instance)
{
    const struct pt_shadow_group *of = &picture->groups[group];
    if (instance == PT_PIXELS)
        return round->pixels && of->without == PT_NO_INSTANCE;
    return round->points && pt_group_receives(scene, of, instance);
}

int pt_plan_tested(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                   uint32_t group)
{
    int some = receives(scene, picture, round, group, PT_PIXELS);
    for (uint32_t i = 0; i < scene->cloud_count && !some; i++)
        some = receives(scene, picture, round, group, i);
    return some;
}

// How many maps of a sample the instance is tested against.
static uint32_t maps_of(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                        uint32_t instance)
{
    uint32_t count = 0;
    for (uint32_t g = 0; g < picture->group_count; g++)
        if (receives(scene, picture, round, g, instance))
            count += picture->groups[g].faint ? PT_FAINT_LAYERS : 1;
    return pt_light_faces(picture, round->light) * count;
}

// Of all chunks of instance i those that the picture drew, as points or as discs: points of the others have no mark. Returns
// how many.
static uint32_t keep_seen(const struct pt_plan *picture, uint32_t i, struct chunk_view *chunks, uint32_t count)
{
    const struct pt_plan_instance *seen[2] = {NULL, NULL};
    uint32_t ways = 0, kept = 0, next[2] = {0, 0};
    for (uint32_t k = 0; k < picture->instance_count && ways < 2; k++)
        if (picture->instances[k].of == i)
            seen[ways++] = &picture->instances[k];
    for (uint32_t c = 0; c < count; c++) // all in the cloud's order, and a chunk is drawn in one way
        for (uint32_t k = 0; k < ways; k++)
            if (next[k] < seen[k]->chunk_count && chunks[c].first == seen[k]->chunks[next[k]].first) {
                chunks[kept++] = chunks[c];
                next[k]++;
                break;
            }
    return kept;
}

// Pixels that show meshes, as a cloud in view space: a row of them for a chunk.
static int pixels_as_cloud(const struct patina_scene *scene, const struct pt_plan *picture, struct pt_plan *map,
                           struct patina_cloud *cloud, struct pt_instance *out)
{
    const uint32_t width = picture->view.width, first = picture->view.rect[1], rows = picture->view.rect[3] - first;
    double axes[9], position[3];
    cloud->chunks = pt_arena_take(&map->arena, (rows + 1) * sizeof *cloud->chunks);
    if (!cloud->chunks || pt_camera_axes(&scene->camera, axes, position))
        return PATINA_ERROR_MEMORY;
    for (uint32_t y = 0; y < rows; y++) {
        cloud->chunks[y].first = (first + y) * width;
        cloud->chunks[y].count = cloud->chunks[y].padded = width;
    }
    cloud->chunk_count = rows;
    cloud->slots = (uint64_t)width * picture->view.height;
    cloud->info = (patina_cloud_info){.count = cloud->slots, .drawn = cloud->slots, .has_normals = 1};
    *out = (struct pt_instance){.cloud = cloud, .style = {.lighting = PATINA_LIGHTING_LIT}};
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++)
            out->style.world_from_object[4 * r + c] = axes[3 * c + r];
        out->style.world_from_object[4 * r + 3] = position[r];
    }
    out->style.world_from_object[15] = 1.0;
    return PATINA_OK;
}

struct tests {
    struct pt_builder builder; // of the map
    const struct pt_shadow_group *group;
    const struct patina_scene *scene, *view; // the picture's, and as the light sees it
    const struct pt_plan *picture;
    const struct pt_round *round;
    struct pt_ref planes[3]; // keys, from, deff
    struct pt_ref opacities;
    struct shadow_test_args args;
};

static void say_who(struct pt_pass *pass, uint32_t instance)
{
    if (instance == PT_PIXELS)
        PT_REASON(pass, "pixels that show meshes are tested");
    else
        PT_REASON(pass, "points of instance %u are tested", instance);
}

// Behind soft points: with what the surfaces' tests are asked.
static void add_dim(struct tests *tests, uint32_t instance, const struct shadow_test_args *asked, struct pt_ref positions)
{
    struct pt_plan *map = tests->builder.plan;
    struct dim_args args = {.view = asked->view,
                            .base = asked->base,
                            .alone = asked->alone,
                            .close = asked->close,
                            .samples = asked->samples,
                            .step = asked->step,
                            .compare = asked->compare,
                            .marked = asked->marked,
                            .veils = map->soft.veils,
                            .veil_from = map->soft.depths[0],
                            .veil_scale = 1.0f / pt_veil_deep(map)};
    memcpy(args.window, asked->window, sizeof args.window);
    const struct pt_ref refs[] = {pt_plane_at(PT_PLANE_VEIL, 0),
                                  {PT_OF_RECEIVER, PT_CHUNKS, map->receiver_count},
                                  positions,
                                  pt_buffer_of(PT_MARKS, instance),
                                  pt_buffer_of(PT_SHADOWS, instance),
                                  {PT_OF_FLAG, PT_FLAG_DIFFERS, 0}};
    map->receiver_count++;
    struct pt_pass *pass = pt_add(&tests->builder, PT_KERNEL_dim, "shadows", &args, sizeof args, refs,
                                  sizeof refs / sizeof *refs);
    say_who(pass, instance);
}

static int add_test(struct tests *tests, uint32_t instance, const struct pt_instance *receiver, struct pt_ref positions,
                    struct pt_ref words)
{
    struct pt_plan *map = tests->builder.plan;
    struct pt_receiver *out = &map->receivers[map->receiver_count];
    struct shadow_test_args args = tests->args;
    int error = pt_plan_chunks(tests->view, map, receiver, &args.instance, &out->chunks, &out->chunk_count);
    if (error)
        return error;
    out->cloud = instance == PT_PIXELS ? NULL : receiver->cloud;
    if (instance == PT_PIXELS)
        args.marked = args.compare = 0;
    args.base = tests->round->light * (args.marked ? 1 : (uint32_t)receiver->cloud->slots);
    args.step = args.marked ? tests->picture->light_count : 1;
    if (args.marked)
        out->chunk_count = keep_seen(tests->picture, instance, out->chunks, out->chunk_count);
    if (!out->chunk_count)
        return PATINA_OK;
    if (tests->group && tests->group->soft) {
        add_dim(tests, instance, &args, positions);
        return PATINA_OK;
    }
    const struct pt_ref refs[] = {tests->planes[0],
                                  tests->planes[1],
                                  tests->planes[2],
                                  {PT_OF_RECEIVER, PT_CHUNKS, map->receiver_count},
                                  positions,
                                  words,
                                  pt_buffer_of(PT_MARKS, instance),
                                  pt_buffer_of(PT_SHADOWS, instance),
                                  {PT_OF_FLAG, PT_FLAG_DIFFERS, 0},
                                  tests->opacities};
    map->receiver_count++;
    struct pt_pass *pass = pt_add(&tests->builder, PT_KERNEL_shadow_test, "shadows", &args, sizeof args, refs,
                                  sizeof refs / sizeof *refs);
    say_who(pass, instance);
    return PATINA_OK;
}

// Of every receiver; close: of those alone that several maps are tested for.
static int add_tests(struct tests *tests, int close)
{
    const struct patina_scene *scene = tests->scene;
    struct pt_plan *map = tests->builder.plan;
    struct patina_cloud *pixels = pt_arena_take(&map->arena, sizeof *pixels);
    map->receivers = pt_arena_take(&map->arena, ((size_t)scene->cloud_count + 1) * sizeof *map->receivers);
    if (!pixels || !map->receivers)
        return PATINA_ERROR_MEMORY;
    int error = PATINA_OK;
    for (uint32_t i = 0; i <= scene->cloud_count && !error; i++) {
        const uint32_t which = i < scene->cloud_count ? i : PT_PIXELS;
        const uint32_t maps = maps_of(scene, tests->picture, tests->round, which);
        const struct pt_ref positions = {PT_OF_RECEIVER, PT_POSITIONS, map->receiver_count};
        const struct pt_ref words = {PT_OF_RECEIVER, PT_SURFELS, map->receiver_count};
        struct pt_instance instance;
        if (close ? maps < 2 : !receives(scene, tests->picture, tests->round, tests->round->group, which))
            continue;
        tests->args.alone = !close && maps == 1;
        if (which != PT_PIXELS)
            error = add_test(tests, i, &scene->instances[i], positions, words);
        else if (!(error = pixels_as_cloud(scene, tests->picture, map, pixels, &instance)))
            error = add_test(tests, PT_PIXELS, &instance, (struct pt_ref){PT_OF_PICTURE, PT_PLANE_MESH_PLACES, 0},
                             (struct pt_ref){PT_OF_PICTURE, PT_PLANE_MESH_WORDS, 0});
    }
    return error ? error : tests->builder.failed;
}

static struct tests begin_tests(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                                struct pt_plan *map)
{
    return (struct tests){.builder = {.scene = scene, .plan = map, .as = "shadows"},
                          .scene = scene,
                          .picture = picture,
                          .round = round,
                          .opacities = {PT_OF_NOTHING, 0, 0},
                          .args = {.samples = round->sample + 1,
                                   .compare = (uint32_t)round->compare,
                                   .marked = (uint32_t)pt_plan_lazy(scene, picture)}};
}

static void set_window(const struct pt_plan *map, const double window[4], float out[4])
{
    for (int k = 0; k < 4; k++) { // window units -> pixels of the padded picture
        double first = k & 1 ? (double)map->view.ray_y0 : (double)map->view.ray_x0;
        double step = k & 1 ? (double)map->view.ray_ys : (double)map->view.ray_xs;
        out[k] = (float)((window[k] - first) / step);
    }
}

// Behind which the next layer of a faint caster lies, where the light is not spent.
static void add_limit(struct tests *tests, const struct pt_shadow_group *group)
{
    struct pt_plan *map = tests->builder.plan;
    struct limit_args args = {.view = map->view, .caster = tests->args.caster, .loss = group->loss};
    const uint32_t whole[4] = {0, 0, map->view.width, map->view.height};
    memcpy(args.view.rect, whole, sizeof whole);
    PT_REASON(PT_ADD(&tests->builder, limit, args,
                     {tests->planes[0],
                      tests->planes[1],
                      tests->planes[2],
                      tests->opacities,
                      pt_plane_at(PT_PLANE_LIMIT, 0),
                      {PT_OF_FLAG, PT_FLAG_SOME, 0}}),
              "what lies behind layer %u of the caster", tests->round->layer + 1);
}

static int plan_tests(struct tests *tests, const struct pt_shadow_group *group, const double window[4])
{
    struct pt_plan *map = tests->builder.plan;
    tests->planes[0] = pt_plane_at(PT_PLANE_KEYS, 0);
    tests->planes[1] = pt_plane_at(PT_PLANE_FROM, 0);
    tests->planes[2] = pt_plane_at(PT_PLANE_DEFF, 0);
    tests->args.view = map->view;
    tests->args.loss = group->loss;
    tests->args.faint = (uint32_t)group->faint;
    if (group->faint) {
        tests->args.caster = map->instances[0].args.id_base; // the map's only instance
        tests->opacities = pt_buffer_of(PT_OPACITIES, 0);
    }
    set_window(map, window, tests->args.window);
    int error = add_tests(tests, 0);
    if (!error && group->faint)
        add_limit(tests, group);
    return error;
}

int pt_plan_map(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                struct pt_plan *map)
{
    const struct pt_shadow_group *group = &picture->groups[round->group];
    struct patina_scene view = {0};
    double window[4];
    *map = (struct pt_plan){.map = 1, .pool = picture->pool};
    struct tests tests = begin_tests(scene, picture, round, map);
    tests.view = &view;
    tests.group = group;
    struct pt_builder builder = {.scene = &view, .plan = map, .behind = round->layer > 0, .as = "light map"};
    struct pt_instance *instances = pt_arena_take(&map->arena,
                                                  ((size_t)scene->cloud_count + scene->mesh_count + 1) * sizeof *instances);
    int error = instances ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (error ||
        !pt_light_scene(scene, &picture->lights[round->light], group, round->sample, round->face, instances, &view, window))
        return error;
    if (scene->settings.detail > 0.0f && pt_plan_lazy(scene, picture)) // textures that are kept serve exact pictures too
        view.settings.detail = MAP_DETAIL;
    pt_handle_init(&view.handle);
    if (group->soft) {
        map->soft.veils = pt_veil_slabs(&view);
        error = pt_plan_view(&view, map);
    } else {
        error = pt_plan_depth(&builder);
    }
    if (!error && (group->soft ? map->soft.part_count > 0 : pt_plan_shows(map))) {
        if (group->soft) {
            pt_plan_no_veil(&builder);
            pt_plan_veil(&builder);
        } else {
            pt_plan_clears(&builder, 0);
        }
        tests.builder.room = builder.room; // goes on where that ended
        tests.builder.listed = builder.listed;
        tests.builder.step_room = builder.step_room;
        error = plan_tests(&tests, group, window);
        pt_add_passes_step(&tests.builder, PT_STEP_PASSES);
        error = error ? error : tests.builder.failed ? tests.builder.failed : builder.failed;
    }
    pt_handle_destroy(&view.handle);
    if (error)
        pt_plan_destroy(map);
    return error;
}

int pt_plan_close(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                  struct pt_plan *map)
{
    static const patina_camera anywhere = {.orthographic = 1,
                                           .world_from_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                           .left = -1,
                                           .right = 1,
                                           .bottom = -1,
                                           .top = 1,
                                           .far_clip = 1};
    const struct patina_scene nothing = {.camera = anywhere, .settings = {.width = 1, .height = 1}}; // lies in no window
    *map = (struct pt_plan){.map = 1, .pool = picture->pool};
    struct tests tests = begin_tests(scene, picture, round, map);
    tests.view = &nothing;
    tests.args.close = 1;
    tests.args.loss = 255;
    tests.planes[0] = (struct pt_ref){PT_OF_LEFT, PT_PLANE_KEYS, 0};
    tests.planes[1] = (struct pt_ref){PT_OF_LEFT, PT_PLANE_FROM, 0};
    tests.planes[2] = (struct pt_ref){PT_OF_LEFT, PT_PLANE_DEFF, 0};
    int error = add_tests(&tests, 1);
    pt_add_passes_step(&tests.builder, PT_STEP_PASSES);
    error = error ? error : tests.builder.failed;
    if (error)
        pt_plan_destroy(map);
    return error;
}
