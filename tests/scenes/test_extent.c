// SPDX-License-Identifier: GPL-3.0-or-later
// Points have an extent: near and far planes, frames, regions and lists of wanted pages count the radius of a disc or soft ball.
// Soft balls are checked against 1 - product(1 - opacity) through their centers.
#include "soft.h"

#include "scene/clouds/cloud.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIZE = 400, MOST = 8 };

struct layout {
    const char *name;
    uint32_t count;
    double radius, place[MOST][3];
};

static struct layout layout_at(int which)
{
    struct layout layout = {.name = which == 0   ? "one ball"
                                    : which == 1 ? "two at one place"
                                                 : "one in each corner",
                            .count = which == 0   ? 1
                                     : which == 1 ? 2
                                                  : 8,
                            .radius = which == 2 ? 0.25 : 1.5};
    for (uint32_t i = 0; i < layout.count; i++)
        for (int k = 0; k < 3; k++)
            layout.place[i][k] = which == 2 ? (i >> k & 1 ? 1.0 : -1.0) : 0.25 * k;
    return layout;
}

static patina_cloud *upload(const struct layout *layout, int own_radii)
{
    float radius[MOST];
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = layout->count};
    desc.position = (patina_array){.data = layout->place, .type = PATINA_FLOAT64, .components = 3};
    for (uint32_t i = 0; i < layout->count; i++)
        radius[i] = (float)layout->radius;
    if (own_radii)
        desc.radius = (patina_array){.data = radius, .type = PATINA_FLOAT32, .components = 1};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

// Near and far that hold a box, exactly.
static void fit_clip(patina_camera *camera, const double low[3], const double high[3])
{
    const double *m = camera->world_from_camera;
    camera->near_clip = INFINITY;
    camera->far_clip = -INFINITY;
    for (int corner = 0; corner < 8; corner++) {
        double z = 0.0;
        for (int k = 0; k < 3; k++)
            z -= ((corner >> k & 1 ? high : low)[k] - m[4 * k + 3]) * m[4 * k + 2];
        camera->near_clip = fmin(camera->near_clip, z);
        camera->far_clip = fmax(camera->far_clip, z);
    }
}

// The camera that frames the scene; parallel: turned into an orthographic one, with near and far as the extent has them.
static patina_camera camera_for(const patina_scene *scene, int parallel)
{
    patina_camera camera = {.struct_size = sizeof camera};
    double low[3], high[3];
    CHECK(patina_scene_frame_camera(scene, 30.0, 40.0, 0.0, &camera), scene);
    if (!parallel)
        return camera;
    CHECK(patina_scene_extent(scene, low, high), scene);
    camera.orthographic = 1;
    camera.left = camera.bottom = -3.0;
    camera.right = camera.top = 3.0;
    fit_clip(&camera, low, high);
    return camera;
}

static patina_settings settings_of(void)
{
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.film_transparent = 1;
    return settings;
}

// What the balls leave through at ball i's center, of those whose centers lie behind one another there; others must lie beside.
static double through_at(const struct layout *layout, const patina_camera *camera, uint32_t i, double opacity, double pixel[2])
{
    double through = 1.0, z;
    camera_project(camera, SIZE, SIZE, layout->place[i], &pixel[0], &pixel[1], &z);
    for (uint32_t k = 0; k < layout->count; k++) {
        double x, y, deep, origin[3], ray[3], apart = 0.0;
        camera_project(camera, SIZE, SIZE, layout->place[k], &x, &y, &deep);
        camera_ray(camera, SIZE, SIZE, pixel[0], pixel[1], origin, ray);
        for (int c = 0; c < 3; c++)
            apart += pow(origin[c] + deep * ray[c] - layout->place[k][c], 2.0);
        if (sqrt(apart) < 1e-6)
            through *= 1.0 - opacity;
        else
            assert_true(sqrt(apart) > 1.2 * layout->radius);
    }
    return through;
}

static void hold(patina_device *device, const char *name, int which, int parallel, uint32_t model, double opacity,
                 int own_radii)
{
    const struct layout layout = layout_at(which);
    patina_cloud *cloud = upload(&layout, own_radii);
    patina_cloud_style style = soft_style(model);
    style.soft_opacity = (float)opacity;
    style.soft_radius = own_radii ? 0.0f : (float)layout.radius;
    patina_scene *scene = scene_of(cloud, &style);
    const patina_settings settings = settings_of();
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    const patina_camera camera = camera_for(scene, parallel);
    struct picture picture = picture_render(device, scene, &camera, &settings);
    double worst = 0.0;
    for (uint32_t i = 0; i < layout.count; i++) {
        double at[2];
        const double expected = 1.0 - through_at(&layout, &camera, i, opacity, at);
        assert_true(at[0] >= 0.0 && at[1] >= 0.0 && at[0] < SIZE && at[1] < SIZE);
        const float *pixel = picture.combined + 4 * ((uint32_t)at[1] * SIZE + (uint32_t)at[0]);
        worst = fmax(worst, fabs((double)pixel[3] - expected));
    }
    printf("  %s, %s, %s, model %u, opacity %g: off by %.2g\n", name, layout.name, parallel ? "parallel" : "perspective", model,
           opacity, worst);
    if (!(worst <= 0.005))
        support_die("the balls' opacity is off by %.3f", worst);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void hold_all(patina_device *device, const char *name)
{
    static const uint32_t models[] = {PATINA_SOFT_BASE, PATINA_SOFT_CONCENTRIC, PATINA_SOFT_EXPRESS};
    for (int which = 0; which < 3; which++)
        for (int k = 0; k < 3; k++)
            for (int parallel = 0; parallel < 2; parallel++) {
                hold(device, name, which, parallel, models[k], 0.3, 1);
                hold(device, name, which, parallel, models[k], 0.95, parallel);
            }
}

static void test_opacity(void **state)
{
    (void)state;
    support_each_device(hold_all);
}

// ---- boxes -------------------------------------------------------------------------------------------------------------

static void expect_extent(const patina_scene *scene, double half, const char *what)
{
    double low[3], high[3];
    CHECK(patina_scene_extent(scene, low, high), scene);
    for (int k = 0; k < 3; k++)
        if (!(low[k] <= -half && low[k] >= -1.01 * half - 1e-9 && high[k] >= half && high[k] <= 1.01 * half + 1e-9))
            support_die("%s: the extent is %g to %g, where %g is wanted", what, low[k], high[k], half);
}

static void test_extent(void **state)
{
    (void)state;
    const struct layout layout = {.count = 1, .radius = 0.5};
    patina_cloud *cloud = upload(&layout, 1), *plain = upload(&layout, 0);
    patina_cloud_style soft = soft_style(PATINA_SOFT_BASE), style = PATINA_CLOUD_STYLE_INIT;
    patina_settings settings = settings_of();
    patina_scene *scene = scene_of(cloud, &soft);
    expect_extent(scene, 0.5, "a ball with a radius of its own");
    CHECK(patina_scene_clear(scene), scene);
    soft.soft_radius = 2.0f;
    CHECK(patina_scene_add_cloud(scene, plain, &soft), scene);
    expect_extent(scene, 2.0, "a ball with the style's radius");
    CHECK(patina_scene_clear(scene), scene);
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    expect_extent(scene, 0.0, "a point");
    settings.surface = PATINA_SURFACE_SPLATS;
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    expect_extent(scene, 0.5, "a disc with a radius of its own");
    CHECK(patina_scene_clear(scene), scene);
    style.world_from_object[0] = style.world_from_object[5] = style.world_from_object[10] = 3.0;
    style.world_from_object[15] = 1.0;
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    expect_extent(scene, 1.5, "a disc of an enlarged object");
    style.largest_gap = 0.5f;
    CHECK(patina_scene_clear(scene), scene);
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    expect_extent(scene, 0.25, "a disc below the largest gap");
    CHECK(patina_scene_clear(scene), scene);
    double low[3], high[3];
    CHECK(patina_scene_extent(scene, low, high), scene);
    assert_true(low[0] > high[0]);
    assert_int_equal(patina_scene_extent(scene, low, NULL), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_scene_extent(NULL, low, high), PATINA_ERROR_ARGUMENT);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(plain);
}

// Points of a page that is on its way will be as wide as the style says.
static void test_extent_of_pages(void **state)
{
    (void)state;
    const patina_page page = {
        .box_min = {-0.5, -0.5, -0.5}, .box_max = {0.5, 0.5, 0.5}, .gap = 0.2, .count = 16, .parent = PATINA_NO_PAGE};
    const patina_pages_desc desc = {.struct_size = sizeof desc, .pages = &page, .page_count = 1};
    patina_cloud_style soft = soft_style(PATINA_SOFT_BASE), solid = PATINA_CLOUD_STYLE_INIT;
    patina_settings settings = settings_of();
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_pages_begin(&desc, &cloud), NULL);
    soft.soft_radius = 2.0f;
    solid.radius = 1.0f;
    patina_scene *scene = scene_of(cloud, &soft);
    expect_extent(scene, 2.5, "balls of a page");
    CHECK(patina_scene_clear(scene), scene);
    CHECK(patina_scene_add_cloud(scene, cloud, &solid), scene);
    expect_extent(scene, 0.5, "points of a page");
    settings.surface = PATINA_SURFACE_SPLATS;
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    expect_extent(scene, 1.5, "discs of a page");
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// ---- frames ------------------------------------------------------------------------------------------------------------

// Whole balls of so much around the layout's places lie within the picture and its depths, and nearly fill it.
static void expect_in_frame(const patina_scene *scene, const struct layout *layout, double radius, const char *what)
{
    enum { AROUND = 64, ALONG = 32 };
    const double pi = 3.14159265358979323846;
    patina_camera camera = {.struct_size = sizeof camera};
    CHECK(patina_scene_frame_camera(scene, 30.0, 40.0, 0.0, &camera), scene);
    double most = 0.0;
    for (uint32_t i = 0; i < layout->count * AROUND * ALONG; i++) {
        const double *center = layout->place[i / (AROUND * ALONG)], turn = 2.0 * pi * (i % AROUND) / AROUND,
                     rise = pi * ((i / AROUND % ALONG) / (ALONG - 1.0) - 0.5);
        const double place[3] = {center[0] + radius * cos(rise) * cos(turn), center[1] + radius * cos(rise) * sin(turn),
                                 center[2] + radius * sin(rise)};
        double x, y, z;
        camera_project(&camera, SIZE, SIZE, place, &x, &y, &z);
        if (!(z > camera.near_clip && z < camera.far_clip))
            support_die("%s: %g lies beyond the depths %g to %g", what, z, camera.near_clip, camera.far_clip);
        most = fmax(most, fmax(fabs(2.0 * x / SIZE - 1.0), fabs(2.0 * y / SIZE - 1.0)));
    }
    printf("  %s: up to %.3f of the picture\n", what, most);
    if (!(most > 0.85 && most <= 1.0))
        support_die("%s: up to %.3f of the picture", what, most);
}

static void test_frames(void **state)
{
    (void)state;
    for (int which = 0; which < 3; which++) {
        const struct layout layout = layout_at(which);
        patina_cloud *own = upload(&layout, 1), *bare = upload(&layout, 0);
        patina_cloud_style soft = soft_style(PATINA_SOFT_BASE), solid = PATINA_CLOUD_STYLE_INIT;
        patina_settings settings = settings_of();
        char what[64];
        snprintf(what, sizeof what, "%s with radii", layout.name);
        patina_scene *scene = scene_of(own, &soft);
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        expect_in_frame(scene, &layout, layout.radius, what);
        CHECK(patina_scene_clear(scene), scene);
        soft.soft_radius = solid.radius = 0.4f;
        CHECK(patina_scene_add_cloud(scene, bare, &soft), scene);
        snprintf(what, sizeof what, "%s with the style's radius", layout.name);
        expect_in_frame(scene, &layout, 0.4, what);
        CHECK(patina_scene_clear(scene), scene);
        settings.surface = PATINA_SURFACE_SPLATS;
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        CHECK(patina_scene_add_cloud(scene, bare, &solid), scene);
        snprintf(what, sizeof what, "%s as discs", layout.name);
        expect_in_frame(scene, &layout, 0.4, what);
        patina_scene_destroy(scene);
        patina_cloud_destroy(own);
        patina_cloud_destroy(bare);
    }
}

// ---- borders -----------------------------------------------------------------------------------------------------------

// A ball whose center lies beyond the picture's border, before the near plane or behind the eye shows the part that is within; regions
// show the same pixels as the whole.
static void borders(patina_device *device, const char *name)
{
    static const double places[][3] = {{0.0, 0.0, 0.0}, {-2.1, 0.0, 0.0}, {0.0, 0.0, -2.2}, {0.0, -3.3, 0.0}, {0.3, -4.2, 0.2}};
    static const double eye[3] = {0.0, -4.0, 0.0}, target[3] = {0.0, 0.0, 0.0};
    for (int parallel = 0; parallel < 2; parallel++)
        for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
            struct layout layout = {.count = 1, .radius = 1.0};
            memcpy(layout.place[0], places[i], sizeof places[i]);
            patina_cloud *cloud = upload(&layout, 1);
            patina_cloud_style style = soft_style(PATINA_SOFT_BASE);
            patina_scene *scene = scene_of(cloud, &style);
            patina_settings settings = settings_of();
            const patina_camera camera = parallel ? camera_orthographic(eye, target, 3.0, SIZE, SIZE, 1.0, 8.0)
                                                  : camera_perspective(eye, target, 45.0, SIZE, SIZE, 1.0, 8.0);
            struct picture whole = picture_render(device, scene, &camera, &settings);
            float most = 0.0f;
            for (uint32_t p = 0; p < SIZE * SIZE; p++)
                most = fmaxf(most, whole.combined[4 * p + 3]);
            printf("  %s, %s, ball %zu: up to %.3f\n", name, parallel ? "parallel" : "perspective", i, (double)most);
            assert_true(most > 0.01f || i == 4); // the last ends before the near plane, in the middle of the view
            static const uint32_t regions[][4] = {{0, 150, 40, 260}, {190, 0, 260, 50}, {120, 180, 230, 190}};
            for (int r = 0; r < 3; r++) {
                memcpy(settings.region, regions[r], sizeof regions[r]);
                struct picture part = picture_render(device, scene, &camera, &settings);
                picture_assert_identical(&part, &whole, regions[r][0], regions[r][1], "a region");
                picture_free(&part);
            }
            picture_free(&whole);
            patina_scene_destroy(scene);
            patina_cloud_destroy(cloud);
        }
}

static void test_borders(void **state)
{
    (void)state;
    support_each_device(borders);
}

// ---- pages -------------------------------------------------------------------------------------------------------------

// Points of a page right beside the view are balls that reach into it: the page is wanted.
static void test_pages(void **state)
{
    (void)state;
    static const double eye[3] = {0.0, -4.0, 0.0}, target[3] = {0.0, 0.0, 0.0};
    const patina_page page = {
        .box_min = {1.1, -0.2, -0.2}, .box_max = {1.5, 0.2, 0.2}, .gap = 0.2, .count = 16, .parent = PATINA_NO_PAGE};
    const patina_pages_desc desc = {.struct_size = sizeof desc, .pages = &page, .page_count = 1};
    patina_device *device = support_device_first();
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_pages_begin(&desc, &cloud), NULL);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    for (int kind = 0; kind < 3; kind++) {
        patina_cloud_style soft = soft_style(PATINA_SOFT_BASE), solid = PATINA_CLOUD_STYLE_INIT;
        patina_scene *scene = scene_of(cloud, kind == 1 ? &soft : &solid);
        patina_settings settings = settings_of();
        settings.width = settings.height = 4000; // the page lies beyond the guard of points
        settings.region[2] = settings.region[3] = 4000;
        settings.surface = kind == 2 ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_AUTO;
        const patina_camera camera = camera_orthographic(eye, target, 2.0, 4000, 4000, 1.0, 8.0);
        CHECK(patina_scene_set_camera(scene, &camera), scene);
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        patina_frame_plan_text(frame, scene, NULL, 0);
        uint32_t wanted[2], count = 9;
        CHECK(patina_cloud_wanted(cloud, 0.0, wanted, 2, &count), cloud);
        if (count != (kind ? 1u : 0u))
            support_die("%u pages are wanted for %s", count, kind == 0 ? "points" : kind == 1 ? "balls" : "discs");
        patina_scene_destroy(scene);
    }
    patina_frame_destroy(frame);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_opacity), cmocka_unit_test(test_extent),  cmocka_unit_test(test_extent_of_pages),
        cmocka_unit_test(test_frames),  cmocka_unit_test(test_borders), cmocka_unit_test(test_pages),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
