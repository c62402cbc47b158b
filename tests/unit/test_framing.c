// SPDX-License-Identifier: GPL-3.0-or-later
// A camera that frames a scene: what is dense fills the picture, strays do not count, sparse parts of a cloud do.
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct points with_room(const struct points *points, uint64_t more)
{
    struct points out = points_create(points->count + more, POINTS_PLAIN);
    memcpy(out.position, points->position, points->count * 12);
    return out;
}

// `count` more points on a sphere around the origin, at random up to `far` away or all just there.
static struct points strewn(const struct points *points, uint64_t count, double far, int just_there)
{
    struct points out = with_room(points, count);
    struct pcg random = pcg_seed(count);
    for (uint64_t i = points->count; i < out.count; i++) {
        double p[3], length = 0.0;
        do {
            length = 0.0;
            for (int k = 0; k < 3; k++) {
                p[k] = pcg_between(&random, -1.0, 1.0);
                length += p[k] * p[k];
            }
        } while (length > 1.0 || length < 1e-3);
        for (int k = 0; k < 3; k++)
            out.position[3 * i + (uint64_t)k] = (float)(p[k] * far / (just_there ? sqrt(length) : 1.0));
    }
    return out;
}

static void box_of(const struct points *points, double lower[3], double upper[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = INFINITY;
        upper[k] = -INFINITY;
        for (uint64_t i = 0; i < points->count; i++) {
            lower[k] = fmin(lower[k], (double)points->position[3 * i + (uint64_t)k]);
            upper[k] = fmax(upper[k], (double)points->position[3 * i + (uint64_t)k]);
        }
    }
}

// The dense box of `points` against the box of `wanted`, in parts of its diagonal; frees the first.
static void check_box(struct points points, const struct points *wanted, double tolerance, const char *what)
{
    double lower[3], upper[3], low[3], high[3], diagonal = 0.0, off = 0.0;
    patina_cloud *cloud = points_upload(&points);
    CHECK(patina_cloud_dense_box(cloud, low, high), cloud);
    box_of(wanted, lower, upper);
    for (int k = 0; k < 3; k++) {
        diagonal += (upper[k] - lower[k]) * (upper[k] - lower[k]);
        off = fmax(off, fmax(fabs(low[k] - lower[k]), fabs(high[k] - upper[k])));
    }
    if (!(off <= tolerance * sqrt(diagonal) + 1e-12))
        support_die("%s: the dense box is off by %.3g of the diagonal", what, off / sqrt(diagonal));
    patina_cloud_destroy(cloud);
    points_free(&points);
}

static struct points copy(const struct points *points) { return with_room(points, 0); }

static void test_without_strays(void **state)
{
    (void)state;
    for (uint64_t count = 10; count <= 1000000; count *= 10) {
        struct points sphere = points_sphere(count, 1.0, POINTS_PLAIN, count),
                      torus = points_torus(count, 1.0, 0.4, POINTS_PLAIN, 3);
        check_box(copy(&sphere), &sphere, 0.01, "sphere");
        check_box(copy(&torus), &torus, 0.01, "torus");
        points_free(&sphere);
        points_free(&torus);
    }
    struct points wire = points_create(5000, POINTS_PLAIN), ground = points_create(200000, POINTS_PLAIN);
    for (uint64_t i = 0; i < wire.count; i++)
        wire.position[3 * i] = 0.01f * (float)i;
    check_box(copy(&wire), &wire, 0.01, "wire");
    struct pcg random = pcg_seed(7); // what a scanner sees of flat ground, from 1 to 30 away: the rim is sparse
    for (uint64_t i = 0; i < ground.count; i++) {
        const double angle = pcg_between(&random, 0.0, 6.2831853), far = 1.0 / pcg_between(&random, 0.033, 1.0);
        ground.position[3 * i] = (float)(far * cos(angle));
        ground.position[3 * i + 1] = (float)(far * sin(angle));
    }
    check_box(copy(&ground), &ground, 0.1, "ground");
    points_free(&wire);
    points_free(&ground);
}

// A small part far off is no stray.
static void test_small_part(void **state)
{
    (void)state;
    struct points large = points_sphere(100000, 1.0, POINTS_PLAIN, 1), small = points_sphere(300, 0.1, POINTS_PLAIN, 2);
    struct points both = with_room(&large, small.count);
    for (uint64_t i = 0; i < 3 * small.count; i++)
        both.position[3 * large.count + i] = small.position[i] + (i % 3 == 0 ? 30.0f : 0.0f);
    check_box(copy(&both), &both, 0.001, "two spheres");
    points_free(&large);
    points_free(&small);
    points_free(&both);
}

static void test_strays(void **state)
{
    (void)state;
    static const uint64_t counts[] = {300, 500, 2000, 20000, 300000};
    for (int c = 0; c < 5; c++) {
        struct points sphere = points_sphere(counts[c], 1.0, POINTS_PLAIN, 5);
        check_box(strewn(&sphere, 1, 100.0, 1), &sphere, 0.01, "one stray");
        check_box(strewn(&sphere, counts[c] / 1000 + 3, 100.0, 1), &sphere, 0.01, "strays at 100 radii");
        check_box(strewn(&sphere, counts[c] / 100, 100.0, 0), &sphere, 0.02, "one of a hundred within 100 radii");
        check_box(strewn(&sphere, 1, 1e6, 1), &sphere, 0.01, "a stray at a million radii");
        points_free(&sphere);
    }
    struct points sphere = points_sphere(1000000, 1.0, POINTS_PLAIN, 5);
    // those that are as near as their chunk is wide count
    check_box(strewn(&sphere, 1000, 3.0, 0), &sphere, 0.12, "one of a thousand within three radii");
    points_free(&sphere);
}

// The share of the picture that the cloud's points span at most, and whether all that shall be are in view.
static double span(const struct points *shown, const struct points *points)
{
    patina_cloud *cloud = points_upload(points);
    patina_scene *scene = scene_of(cloud, NULL);
    patina_settings settings = settings_default(320, 240);
    patina_camera camera = {.struct_size = sizeof camera};
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_scene_frame_camera(scene, 30.0, 20.0, 0.0, &camera), scene);
    double most = 0.0;
    for (uint64_t i = 0; i < shown->count; i++) {
        const double p[3] = {(double)shown->position[3 * i], (double)shown->position[3 * i + 1],
                             (double)shown->position[3 * i + 2]};
        double x, y, z;
        camera_project(&camera, 320, 240, p, &x, &y, &z);
        most = fmax(most, fmax(fabs(x / 160.0 - 1.0), fabs(y / 120.0 - 1.0)));
        assert_true(z > camera.near_clip && z < camera.far_clip);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return most;
}

static void test_picture(void **state)
{
    (void)state;
    struct points torus = points_torus(2000, 1.0, 0.4, POINTS_PLAIN, 3), strays = strewn(&torus, 3, 100.0, 1);
    const double clean = span(&torus, &torus), strewn_over = span(&torus, &strays);
    if (!(clean > 0.6 && clean < 0.97 && fabs(strewn_over - clean) < 0.01))
        support_die("the torus spans %.3f of the picture, with strays %.3f", clean, strewn_over);
    points_free(&torus);
    points_free(&strays);
}

// A clip that leaves nothing but strays: they are framed then.
static void test_strays_alone(void **state)
{
    (void)state;
    struct points sphere = points_sphere(2000, 1.0, POINTS_PLAIN, 5), strays = strewn(&sphere, 1, 100.0, 1);
    patina_cloud *cloud = points_upload(&strays);
    patina_scene *scene = scene_of(cloud, NULL);
    patina_clip cut = {.struct_size = sizeof cut,
                       .shape = PATINA_CLIP_BOX,
                       .cut = 1,
                       .world_from_clip = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1}};
    patina_camera camera = {.struct_size = sizeof camera};
    CHECK(patina_scene_add_clip(scene, &cut), scene);
    CHECK(patina_scene_frame_camera(scene, 30.0, 20.0, 0.0, &camera), scene);
    assert_true(isfinite(camera.world_from_camera[3]) && camera.far_clip > camera.near_clip);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&sphere);
    points_free(&strays);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_strays), cmocka_unit_test(test_small_part),   cmocka_unit_test(test_strays),
        cmocka_unit_test(test_picture),        cmocka_unit_test(test_strays_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
