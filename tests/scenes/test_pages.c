// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds whose points arrive page by page (SPEC 14): whatever the order, the same picture in the end, as of the saved file; before, what
// has arrived; lists of what is wanted; pages that are not what was promised.
#include "clouds.h"
#include "scene/clouds/cloud.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS = 120000, WIDTH = 220, HEIGHT = 160, LEVELS = 3, PAGES = 1 + 8 + 64 };

// An octree of a torus: a sixteenth of the points at its root, four sixteenths below, the others below that.
struct tree {
    struct points points; // page by page
    uint8_t classes[POINTS];
    float scalars[POINTS];
    patina_page pages[PAGES];
    uint32_t first[PAGES], count;
};

static const double half = 2.8;

static uint32_t cell_of(const float *p, uint32_t level)
{
    uint32_t cell = 0;
    for (int k = 0; k < 3; k++)
        cell = cell << level | (uint32_t)(((double)p[k] + half) / (2.0 * half) * (1u << level));
    return cell;
}

static uint32_t level_of(uint64_t i) { return i % 16 == 0 ? 0 : i % 4 == 1 ? 1 : 2; }

static struct tree *make_tree(void)
{
    struct tree *tree = calloc(1, sizeof *tree);
    struct points all = points_torus(POINTS, 2.0, 0.7, POINTS_ALL, 7);
    const double gap = sqrt(area_torus(2.0, 0.7) / (POINTS / 16.0));
    uint32_t at = 0, of[1 + 8 + 64];
    tree->points = points_create(POINTS, POINTS_ALL);
    for (uint32_t level = 0; level < LEVELS; level++)
        for (uint32_t cell = 0; cell < 1u << 3 * level; cell++) {
            patina_page *page = &tree->pages[tree->count];
            const uint32_t side = 1u << level, place[3] = {cell >> 2 * level, cell >> level & (side - 1), cell & (side - 1)};
            tree->first[tree->count] = at;
            for (uint64_t i = 0; i < POINTS; i++) {
                if (level_of(i) != level || cell_of(all.position + 3 * i, level) != cell)
                    continue;
                memcpy(tree->points.position + 3 * at, all.position + 3 * i, 12);
                memcpy(tree->points.normal + 3 * at, all.normal + 3 * i, 12);
                memcpy(tree->points.color + 3 * at, all.color + 3 * i, 3);
                tree->classes[at] = (uint8_t)(i % 5);
                tree->scalars[at++] = all.position[3 * i];
            }
            page->count = at - tree->first[tree->count];
            if (!page->count)
                continue;
            page->gap = gap / side;
            page->parent = PATINA_NO_PAGE;
            for (uint32_t p = 0, parent = 0; level && p < 1; p++) {
                for (int k = 0; k < 3; k++)
                    parent = parent << (level - 1) | place[k] >> 1;
                page->parent = level == 1 ? 0 : of[1 + parent];
            }
            for (int k = 0; k < 3; k++) {
                page->box_min[k] = -half + 2.0 * half * place[k] / side;
                page->box_max[k] = page->box_min[k] + 2.0 * half / side;
            }
            of[level == 0 ? 0 : level == 1 ? 1 + cell : 9 + cell] = tree->count++;
        }
    if (at != POINTS)
        support_die("%u points in the tree", at);
    points_free(&all);
    return tree;
}

static void free_tree(struct tree *tree)
{
    points_free(&tree->points);
    free(tree);
}

static patina_cloud *begin(const struct tree *tree, uint64_t cap)
{
    patina_cloud *cloud = NULL;
    const patina_pages_desc desc = {.struct_size = sizeof desc,
                                    .pages = tree->pages,
                                    .page_count = tree->count,
                                    .color_type = PATINA_UINT8,
                                    .has_normals = 1,
                                    .has_scalars = 1,
                                    .has_classes = 1,
                                    .memory_cap = cap};
    CHECK(patina_cloud_pages_begin(&desc, &cloud), NULL);
    return cloud;
}

static patina_cloud_desc desc_of(struct tree *tree, uint32_t page)
{
    const uint64_t first = tree->first[page];
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = tree->pages[page].count,
                                    .position = {tree->points.position + 3 * first, PATINA_FLOAT32, 3, 0},
                                    .normal = {tree->points.normal + 3 * first, PATINA_FLOAT32, 3, 0},
                                    .color = {tree->points.color + 3 * first, PATINA_UINT8, 3, 0},
                                    .scalar = {tree->scalars + first, PATINA_FLOAT32, 1, 0},
                                    .classes = {tree->classes + first, PATINA_UINT8, 1, 0}};
    return desc;
}

static void give(patina_cloud *cloud, struct tree *tree, uint32_t page)
{
    const patina_cloud_desc desc = desc_of(tree, page);
    CHECK(patina_cloud_page_give(cloud, page, &desc), cloud);
}

static patina_scene *stage_of(patina_cloud *cloud, int near_by, uint32_t lights, const patina_settings *given)
{
    patina_scene *scene = NULL;
    const double far_eye[3] = {3.5, -4.5, 3.5}, near_eye[3] = {2.2, -0.9, 0.9},
                 target[3] = {near_by ? 2.0 : 0, 0, near_by ? 0.4 : 0};
    const patina_camera camera = camera_perspective(near_by ? near_eye : far_eye, target, 45, WIDTH, HEIGHT, 0.02, 100);
    patina_settings settings = given ? *given : settings_default(WIDTH, HEIGHT);
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.lighting = lights ? PATINA_LIGHTING_LIT : PATINA_LIGHTING_AUTO;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    const patina_light_desc light = {
        .struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 2, .direction = {-1, 0.5, -2}, .shadows = 1};
    if (lights)
        CHECK(patina_scene_add_light(scene, &light), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    return scene;
}

static struct picture draw(patina_device *device, patina_cloud *cloud, int near_by, uint32_t lights,
                           const patina_settings *settings)
{
    patina_scene *scene = stage_of(cloud, near_by, lights, settings);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    struct picture picture = picture_read(frame);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    return picture;
}

static patina_pages_info told(patina_cloud *cloud)
{
    patina_pages_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_pages(cloud, &info), cloud);
    return info;
}

// All pages forwards at one go; backwards with pictures between; and from the saved file.
static void same_bytes(patina_device *device, const char *name)
{
    struct tree *tree = make_tree();
    patina_cloud *forwards = begin(tree, 0), *backwards = begin(tree, 0), *opened = NULL;
    for (uint32_t p = 0; p < tree->count; p++)
        give(forwards, tree, p);
    char path[] = "/tmp/patina-pages-XXXXXX";
    assert_true(close(mkstemp(path)) == 0);
    const patina_array color = {tree->points.color, PATINA_UINT8, 3, 0};
    for (uint32_t p = tree->count; p-- > 0;) {
        struct picture some = {0};
        if (p % 9 == 0)
            some = draw(device, backwards, 0, p % 2, NULL);
        picture_free(&some);
        assert_int_equal(patina_cloud_save(backwards, path), PATINA_ERROR_UNSUPPORTED);
        assert_int_equal(patina_cloud_set_colors(backwards, &color), PATINA_ERROR_UNSUPPORTED);
        give(backwards, tree, p);
    }
    CHECK(patina_cloud_save(backwards, path), backwards);
    CHECK(patina_cloud_verify(path, NULL), NULL);
    CHECK(patina_cloud_open(path, &opened), NULL);
    for (int look = 0; look < 4; look++) {
        patina_settings settings = settings_default(WIDTH, HEIGHT);
        settings.surface = look == 3 ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_AUTO;
        struct picture one = draw(device, forwards, look % 2, look >= 2, &settings);
        struct picture two = draw(device, backwards, look % 2, look >= 2, &settings);
        struct picture three = draw(device, opened, look % 2, look >= 2, &settings);
        assert_true(picture_count(&one) > WIDTH * HEIGHT / 10);
        picture_assert_identical(&two, &one, 0, 0, name);
        picture_assert_identical(&three, &one, 0, 0, "opened");
        picture_free(&one);
        picture_free(&two);
        picture_free(&three);
    }
    patina_cloud_info info = {.struct_size = sizeof info}, again = {.struct_size = sizeof again};
    CHECK(patina_cloud_get_info(forwards, &info), forwards);
    CHECK(patina_cloud_get_info(opened, &again), opened);
    assert_true(info.count == POINTS && info.drawn == POINTS && info.class_bits[0] == 31 && again.drawn == POINTS);
    remove(path);
    patina_cloud_destroy(forwards);
    patina_cloud_destroy(backwards);
    patina_cloud_destroy(opened);
    free_tree(tree);
}

static void test_same_bytes(void **state)
{
    (void)state;
    support_each_device(same_bytes);
}

// The cloud that patina_cloud_create makes of the same points: the same spacing, and depth of measured pixels.
static void test_beside_flat(void **state)
{
    (void)state;
    struct tree *tree = make_tree();
    patina_device *device = support_device_first();
    patina_cloud *paged = begin(tree, 0), *flat = points_upload(&tree->points);
    for (uint32_t p = 0; p < tree->count; p++)
        give(paged, tree, p);
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.fill = PATINA_FILL_OFF;
    struct picture one = draw(device, paged, 0, 0, &settings), two = draw(device, flat, 0, 0, &settings);
    uint64_t differ = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) // where projections round otherwise a point changes its pixel
        differ += (one.keys[i] == KEY_EMPTY) != (two.keys[i] == KEY_EMPTY) ||
                  (one.keys[i] != KEY_EMPTY && key_id(one.keys[i]) != key_id(two.keys[i]));
    printf("  %llu of %d pixels show another point than of the flat cloud\n", (unsigned long long)differ, WIDTH * HEIGHT);
    assert_true(differ * 2000 < WIDTH * HEIGHT);
    patina_cloud_info a = {.struct_size = sizeof a}, b = {.struct_size = sizeof b};
    CHECK(patina_cloud_get_info(paged, &a), paged);
    CHECK(patina_cloud_get_info(flat, &b), flat);
    printf("  spacing %.5f (%.5f to %.5f), flat %.5f (%.5f to %.5f)\n", a.spacing, a.spacing_min, a.spacing_max, b.spacing,
           b.spacing_min, b.spacing_max);
    assert_true(fabs(a.spacing / b.spacing - 1.0) < 0.1 && a.spacing_max < 2.0 * b.spacing_max);
    picture_free(&one);
    picture_free(&two);
    patina_cloud_destroy(paged);
    patina_cloud_destroy(flat);
    patina_device_destroy(device);
    free_tree(tree);
}

// Pages of the root and one below alone: the picture of a cloud of these points, and nothing of the others.
static void partial(patina_device *device, const char *name)
{
    struct tree *tree = make_tree();
    patina_cloud *cloud = begin(tree, 0);
    struct picture empty = draw(device, cloud, 0, 1, NULL);
    assert_int_equal(picture_count(&empty), 0);
    picture_free(&empty);
    give(cloud, tree, 0);
    give(cloud, tree, 3);
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.fill = PATINA_FILL_OFF;
    struct picture some = draw(device, cloud, 0, 0, &settings);
    uint64_t shown = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        if (some.keys[i] != KEY_EMPTY) {
            const uint32_t id = key_id(some.keys[i]);
            assert_true(id < tree->pages[0].count || (id >= tree->first[3] && id < tree->first[4]));
            shown++;
        }
    assert_true(shown > 500);
    const patina_pages_info info = told(cloud);
    assert_true(info.points == POINTS && info.arrived == tree->pages[0].count + tree->pages[3].count &&
                info.pages_arrived == 2);
    printf("  %s: %llu pixels of %llu points\n", name, (unsigned long long)shown, (unsigned long long)info.arrived);
    picture_free(&some);
    patina_cloud_destroy(cloud);
    free_tree(tree);
}

static void test_partial(void **state)
{
    (void)state;
    support_each_device(partial);
}

// Near and coarse pages first, parents before their children; fewer where gaps are small; none that lies out of view; and a plan asks
// as a picture does. Fetched until nothing is wanted, the picture is that of all pages.
static void test_wanted(void **state)
{
    (void)state;
    struct tree *tree = make_tree();
    patina_device *device = support_device_first();
    patina_cloud *cloud = begin(tree, 0), *whole = begin(tree, 0);
    uint32_t wanted[PAGES], count, fetched = 0, place[PAGES];
    patina_scene *scene = stage_of(cloud, 1, 0, NULL);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    assert_true(patina_frame_plan_text(frame, scene, NULL, 0) > 0);
    CHECK(patina_cloud_wanted(cloud, 0.0, wanted, PAGES, &count), cloud);
    assert_true(count > 8 && count < tree->count && wanted[0] == 0);
    assert_true(told(cloud).pages_wanted == count && told(cloud).wanted < POINTS);
    memset(place, 0xFF, sizeof place);
    for (uint32_t i = 0; i < count; i++)
        place[wanted[i]] = i;
    for (uint32_t i = 0; i < count; i++)
        assert_true(tree->pages[wanted[i]].parent == PATINA_NO_PAGE || place[tree->pages[wanted[i]].parent] < i);
    uint32_t again = 0, coarse = 0, first = 0;
    CHECK(patina_cloud_wanted(cloud, 0.0, wanted, PAGES, &again), cloud); // taken
    assert_int_equal(again, 0);
    patina_frame_plan_text(frame, scene, NULL, 0);
    CHECK(patina_cloud_wanted(cloud, 12.0, wanted, PAGES, &coarse), cloud);
    assert_true(coarse > 0 && coarse < count);
    patina_frame_plan_text(frame, scene, NULL, 0);
    CHECK(patina_cloud_wanted(cloud, 0.0, wanted, 1, &first), cloud);
    assert_true(first == 1 && wanted[0] == 0 && told(cloud).pages_wanted == count);
    do {
        CHECK(patina_frame_render(frame, scene), frame);
        CHECK(patina_cloud_wanted(cloud, 0.0, wanted, 5, &count), cloud);
        for (uint32_t i = 0; i < count; i++)
            give(cloud, tree, wanted[i]);
        fetched += count;
    } while (count);
    assert_true(fetched < tree->count);
    struct picture part = picture_read(frame);
    for (uint32_t p = 0; p < tree->count; p++)
        give(whole, tree, p);
    struct picture all = draw(device, whole, 1, 0, NULL);
    uint64_t differ = 0; // pages out of view tell nothing but how dense those over them are
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        differ += part.keys[i] != all.keys[i];
    printf("  %u of %u pages in view, %llu pixels differ\n", fetched, tree->count, (unsigned long long)differ);
    assert_int_equal(differ, 0);
    picture_free(&part);
    picture_free(&all);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(whole);
    patina_device_destroy(device);
    free_tree(tree);
}

static void refuse(patina_cloud *cloud, uint32_t page, const patina_cloud_desc *desc, int code, const char *why)
{
    assert_int_equal(patina_cloud_page_give(cloud, page, desc), code);
    if (!strstr(support_message(cloud), why))
        support_die("'%s' in place of '%s'", support_message(cloud), why);
}

static void test_damaged(void **state)
{
    (void)state;
    struct tree *tree = make_tree();
    patina_cloud *cloud = begin(tree, 0);
    patina_cloud_desc desc = desc_of(tree, 2);
    refuse(cloud, tree->count, &desc, PATINA_ERROR_ARGUMENT, "no such page");
    desc.count--;
    refuse(cloud, 2, &desc, PATINA_ERROR_FORMAT, "points in place of");
    desc = desc_of(tree, 2);
    desc.color.data = NULL;
    refuse(cloud, 2, &desc, PATINA_ERROR_FORMAT, "other attributes");
    desc = desc_of(tree, 2);
    tree->points.position[3 * tree->first[2] + 7] = NAN;
    refuse(cloud, 2, &desc, PATINA_ERROR_FORMAT, "without a finite position");
    tree->points.position[3 * tree->first[2] + 7] = 100.0f;
    refuse(cloud, 2, &desc, PATINA_ERROR_FORMAT, "outside of its box");
    assert_int_equal(told(cloud).arrived, 0);
    desc = desc_of(tree, 1);
    CHECK(patina_cloud_page_give(cloud, 1, &desc), cloud);
    refuse(cloud, 1, &desc, PATINA_ERROR_EMPTY, "there already");
    patina_cloud_destroy(cloud);
    patina_page bad = tree->pages[1];
    bad.parent = 1;
    patina_pages_desc pages = {.struct_size = sizeof pages, .pages = &bad, .page_count = 1};
    assert_int_equal(patina_cloud_pages_begin(&pages, &cloud), PATINA_ERROR_ARGUMENT);
    bad.parent = PATINA_NO_PAGE;
    bad.count = 0xFFFFFFFF;
    assert_int_equal(patina_cloud_pages_begin(&pages, &cloud), PATINA_ERROR_TOO_MANY_POINTS);
    pages.page_count = 0;
    assert_int_equal(patina_cloud_pages_begin(&pages, &cloud), PATINA_ERROR_ARGUMENT);
    free_tree(tree);
}

// Under a cap pages that nobody looks at go, and come again.
static void test_cap(void **state)
{
    (void)state;
    struct tree *tree = make_tree();
    patina_device *device = support_device_first();
    const uint64_t cap = 16 * POINTS; // 28 bytes a point
    patina_cloud *cloud = begin(tree, cap);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    struct picture before = {0};
    for (int turn = 0; turn < 6; turn++) { // here, away, and here again
        patina_scene *scene = stage_of(cloud, turn % 4 < 2, 0, NULL);
        uint32_t wanted[PAGES], count;
        for (int round = 0; round < 40; round++) {
            patina_frame_plan_text(frame, scene, NULL, 0);
            CHECK(patina_cloud_wanted(cloud, turn % 4 < 2 ? 0.0 : 6.0, wanted, 4, &count), cloud);
            for (uint32_t i = 0; i < count; i++)
                give(cloud, tree, wanted[i]);
            if (!count)
                break;
        }
        assert_int_equal(count, 0);
        CHECK(patina_frame_render(frame, scene), frame);
        patina_scene_destroy(scene);
    }
    const patina_pages_info info = told(cloud);
    patina_cloud_info held = {.struct_size = sizeof held};
    CHECK(patina_cloud_get_info(cloud, &held), cloud);
    printf("  %u pages given back, %.2f MB held, cap %.2f MB\n", info.returned, 1e-6 * (double)held.bytes, 1e-6 * (double)cap);
    assert_true(info.returned > 0 && info.pages_arrived < tree->count);
    picture_free(&before);
    patina_frame_destroy(frame);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
    free_tree(tree);
}

// Bytes that the host handed to the device for the last render; 0: a device that borrows them.
static uint64_t uploaded(const patina_frame *frame)
{
    static const char name[] = "\"uploaded\":";
    char json[16384];
    assert_true(patina_frame_stats_json(frame, json, sizeof json) < sizeof json);
    const char *at = strstr(json, name);
    return at ? strtoull(at + strlen(name), NULL, 10) : 0;
}

// One frame goes on while pages arrive, leave and come again: it shows what a new frame shows, and uploads no page that it has.
static void one_frame(patina_device *device, const char *name)
{
    struct tree *tree = make_tree();
    patina_cloud *cloud = begin(tree, 16 * POINTS);
    patina_frame *frame = NULL;
    uint64_t first = 0, most = 0, compared = 0;
    CHECK(patina_frame_create(device, &frame), device);
    for (int turn = 0; turn < 4; turn++) // here, away, and here again
        for (int round = 0; round < 12; round++) {
            uint32_t wanted[PAGES], count;
            patina_scene *scene = stage_of(cloud, turn % 2, 0, NULL);
            CHECK(patina_frame_render(frame, scene), frame);
            CHECK(patina_cloud_wanted(cloud, 0.0, wanted, turn || round ? 2 : PAGES, &count), cloud);
            for (uint32_t i = 0; i < count; i++)
                give(cloud, tree, wanted[i]);
            CHECK(patina_frame_render(frame, scene), frame);
            const uint64_t bytes = uploaded(frame);
            first = first ? first : bytes;
            most = (turn || round) && bytes > most ? bytes : most;
            const uint32_t state = atomic_load(&cloud->alive->pages);
            struct picture one = picture_read(frame), two = draw(device, cloud, turn % 2, 0, NULL);
            if (state == atomic_load(&cloud->alive->pages)) { // else the second picture began with other pages or spacings
                picture_assert_identical(&one, &two, 0, 0, name);
                compared++;
            }
            picture_free(&one);
            picture_free(&two);
            patina_scene_destroy(scene);
        }
    printf("  %s: %.2f MB for the first pages, later %.2f at most; %u pages given back, %llu pictures compared\n", name,
           1e-6 * (double)first, 1e-6 * (double)most, told(cloud).returned, (unsigned long long)compared);
    assert_true(told(cloud).returned > 0 && compared > 8);
    if (support_is_gl(name))
        assert_true(most > 0 && most < first / 2);
    patina_frame_destroy(frame);
    patina_cloud_destroy(cloud);
    free_tree(tree);
}

static void test_one_frame(void **state)
{
    (void)state;
    support_each_device(one_frame);
}

// What arrived, and no picture has taken in yet, is there for other calls; a share of it is not.
static void test_colors_before_pictures(void **state)
{
    (void)state;
    enum { GREY = 200 };
    struct tree *tree = make_tree();
    patina_cloud *cloud = begin(tree, 0);
    uint8_t *grey = malloc(3 * POINTS);
    assert_non_null(grey);
    memset(grey, GREY, 3 * POINTS);
    const patina_array colors = {.data = grey, .type = PATINA_UINT8, .components = 3};
    for (uint32_t p = 0; p < tree->count; p++) {
        if (p == tree->count - 1)
            assert_int_equal(patina_cloud_set_colors(cloud, &colors), PATINA_ERROR_UNSUPPORTED);
        give(cloud, tree, p);
    }
    CHECK(patina_cloud_set_colors(cloud, &colors), cloud);
    for (uint64_t i = 0; i < 3 * cloud->slots; i++)
        assert_int_equal(((const uint8_t *)cloud->colors)[i], GREY);
    patina_cloud_destroy(cloud);
    free(grey);
    free_tree(tree);
}

// ---- clouds in parts ---------------------------------------------------------------------------------------------------

static patina_cloud *begin_in_parts(const struct tree *tree, uint64_t cap)
{
    support_set_variable("PATINA_PART_SLOTS", "20000");
    patina_cloud *cloud = begin(tree, cap);
    support_set_variable("PATINA_PART_SLOTS", NULL);
    assert_true(cloud->part_count > 4);
    return cloud;
}

// Whatever the order of the pages, before all are there and after, and under a cap that gives some back: what is wanted, and the bytes of the
// picture, are those of the cloud in one piece.
static void in_parts(patina_device *device, const char *name)
{
    static const struct {
        const char *name;
        int near_by;
        uint32_t lights, surface;
        float detail;
        uint64_t cap;
    } looks[] = {{"far", 0, 0, 0, 0.0f, 0},
                 {"near, as the viewport", 1, 0, 0, 8.0f, 0},
                 {"shadows", 0, 1, 0, 0.0f, 0},
                 {"discs in shadows", 1, 1, PATINA_SURFACE_SPLATS, 0.0f, 0},
                 {"under a cap", 1, 0, 0, 0.0f, 16 * POINTS}};
    struct tree *tree = make_tree();
    for (size_t l = 0; l < sizeof looks / sizeof *looks; l++) {
        patina_settings settings = settings_default(WIDTH, HEIGHT);
        settings.surface = looks[l].surface;
        settings.detail = looks[l].detail;
        patina_cloud *clouds[2] = {begin(tree, looks[l].cap), begin_in_parts(tree, looks[l].cap)};
        for (uint32_t turn = 0; turn < 5; turn++) {
            struct picture pictures[2];
            uint32_t wanted[2][PAGES], count[2];
            const int near_by = looks[l].near_by ^ (looks[l].cap && turn == 2);
            for (int k = 0; k < 2; k++) {
                pictures[k] = draw(device, clouds[k], near_by, looks[l].lights, &settings);
                CHECK(patina_cloud_wanted(clouds[k], 0.0, wanted[k], PAGES, &count[k]), clouds[k]);
            }
            assert_int_equal(count[0], count[1]);
            assert_memory_equal(wanted[0], wanted[1], count[0] * sizeof **wanted);
            picture_assert_identical(&pictures[1], &pictures[0], 0, 0, looks[l].name);
            assert_true(!turn || picture_count(&pictures[0]) > WIDTH * HEIGHT / 20);
            picture_free(&pictures[0]);
            picture_free(&pictures[1]);
            const patina_pages_info one = told(clouds[0]), parts = told(clouds[1]);
            assert_true(one.arrived == parts.arrived && one.returned == parts.returned && one.wanted == parts.wanted);
            for (int k = 0; k < 2; k++) // a third of them, then all, in the one's order and in the other's
                for (uint32_t i = 0, n = turn < 2 ? (count[k] + 2) / 3 : count[k]; i < n; i++)
                    give(clouds[k], tree, wanted[k][k ? n - 1 - i : i]);
        }
        const patina_pages_info info = told(clouds[1]);
        assert_true(looks[l].cap ? info.returned > 0 : looks[l].near_by || info.pages_arrived == tree->count);
        printf("  %s, %s: %u parts, %u of %u pages, %u given back\n", name, looks[l].name, clouds[1]->part_count,
               info.pages_arrived, info.pages, info.returned);
        patina_cloud_destroy(clouds[0]);
        patina_cloud_destroy(clouds[1]);
    }
    free_tree(tree);
}

static void test_in_parts(void **state)
{
    (void)state;
    support_each_device(in_parts);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bytes), cmocka_unit_test(test_beside_flat),
                                       cmocka_unit_test(test_partial),    cmocka_unit_test(test_wanted),
                                       cmocka_unit_test(test_damaged),    cmocka_unit_test(test_cap),
                                       cmocka_unit_test(test_one_frame),  cmocka_unit_test(test_colors_before_pictures),
                                       cmocka_unit_test(test_in_parts)};
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
