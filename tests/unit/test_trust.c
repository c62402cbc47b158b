// SPDX-License-Identifier: GPL-3.0-or-later
// Trust: defined for degenerate clouds; planted strays lose it and vanish from pictures, and the surface beneath them is as if they were
// not there; where no point is trusted all are drawn; the same for any threads.
#include "scene/analysis/analysis.h"
#include "scene/analysis/trust.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 160, PLANE = SIDE * SIDE, STRAYS = 12 };

static double *places(uint64_t count) { return calloc(3 * count + 1, sizeof(double)); }

static patina_cloud *cloud_of(const double *position, uint64_t count)
{
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = {.struct_size = sizeof desc, .count = count, .position = {position, PATINA_FLOAT64, 3, 0}};
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    return cloud;
}

// A rough square in z = 0, a centimeter between points, and STRAYS points 0.1 to 0.25 above it, far from each other.
static double *plane_and_strays(void)
{
    double *p = places(PLANE + STRAYS);
    struct pcg random = pcg_seed(5);
    for (int i = 0; i < PLANE; i++) {
        p[3 * i] = 0.01 * (i % SIDE + pcg_between(&random, -0.3, 0.3));
        p[3 * i + 1] = 0.01 * (i / SIDE + pcg_between(&random, -0.3, 0.3)); // NOLINT: rows
        p[3 * i + 2] = pcg_between(&random, -0.001, 0.001);
    }
    for (int i = 0; i < STRAYS; i++) {
        double *at = p + 3 * (PLANE + i);
        at[0] = 0.2 + 0.4 * (i % 4);
        at[1] = 0.2 + 0.5 * (i / 4); // NOLINT: rows
        at[2] = pcg_between(&random, 0.1, 0.25);
    }
    return p;
}

static float *trusts_of(patina_cloud *cloud, const patina_analysis_desc *desc)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_analyse(cloud, desc, NULL), cloud);
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    float *trust = calloc(info.count + 1, sizeof *trust);
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .trust = trust};
    CHECK(patina_cloud_neighbourhoods(cloud, &wanted, NULL), cloud);
    uint64_t counted = 0, levels[16] = {0};
    for (int level = 0; level < 16; level++)
        counted += info.trusts[level];
    assert_int_equal(counted, info.drawn);
    for (uint64_t i = 0; i < info.count; i++) {
        assert_true(trust[i] >= 0.0f && trust[i] <= 1.0f);
        levels[pt_level_of_trust((double)trust[i])]++;
    }
    assert_memory_equal(levels, info.trusts, sizeof levels);
    return trust;
}

static void test_levels(void **state)
{
    (void)state;
    for (uint32_t level = 0; level < 16; level++) {
        assert_int_equal(pt_level_of_trust(pt_trust_of_level(level)), level);
        assert_int_equal(pt_lowest_level((double)(float)pt_trust_of_level(level)), level);
        assert_true(!level || pt_trust_of_level(level) > pt_trust_of_level(level - 1));
    }
    assert_int_equal(pt_level_of_trust(-1.0), 0);
    assert_int_equal(pt_level_of_trust(2.0), 15);
}

// Pixels that show something from straight above. left_out: NULL, or the points that are left out for their trust, and those of a cloud
// of which none is trusted.
static uint64_t shown_of(patina_device *device, const patina_cloud *cloud, float least, float depths[64 * 64],
                         uint64_t left_out[2])
{
    static float rgba[64][64][4];
    patina_scene *scene = NULL;
    patina_frame *frame = NULL;
    patina_camera camera = {.struct_size = sizeof camera};
    const patina_cloud_style style = {.struct_size = sizeof style, .least_trust = least};
    const patina_settings settings = {
        .struct_size = sizeof settings, .width = 64, .height = 64, .film_transparent = 1, .passes = 1u << PATINA_PASS_DEPTH};
    uint64_t shown = 0;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(patina_scene_add_cloud(scene, cloud, &style), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_scene_frame_camera(scene, 0, 89, 0, &camera), scene);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, &rgba[0][0][0], sizeof rgba), frame);
    if (depths)
        CHECK(patina_frame_read(frame, PATINA_PASS_DEPTH, depths, 64 * 64 * sizeof *depths), frame);
    for (int i = 0; i < 64 * 64; i++) {
        const float *pixel = rgba[i / 64][i % 64];
        assert_true(isfinite(pixel[0]) && isfinite(pixel[1]) && isfinite(pixel[2]) && isfinite(pixel[3]));
        shown += pixel[3] > 0.0f;
    }
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    if (left_out) {
        left_out[0] = stats.untrusted;
        left_out[1] = stats.none_trusted;
    }
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    return shown;
}

// Something is drawn by default. Above the most trusted point all points are drawn, and the statistics report it.
static void check_defined(const char *name, const double *position, uint64_t count)
{
    patina_device *device = support_device_open("cpu", 0, 0);
    patina_cloud *cloud = cloud_of(position, count);
    const patina_analysis_desc desc = {.struct_size = sizeof desc};
    float *trust = trusts_of(cloud, &desc), most = 0.0f;
    uint64_t left_out[2], trusted = 0;
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    for (uint64_t i = 0; i < count; i++) {
        most = fmaxf(most, trust[i]);
        trusted += (double)trust[i] >= info.trust_default - 1e-4;
    }
    if (!shown_of(device, cloud, 0.0f, NULL, left_out))
        fail_msg("%s: nothing is drawn", name);
    print_message("  %s: %llu of %llu points are trusted by default, the most trusted has %.3f\n", name,
                  (unsigned long long)trusted, (unsigned long long)count, (double)most);
    assert_int_equal(left_out[0], trusted ? info.drawn - trusted : 0);
    assert_int_equal(left_out[1], trusted ? 0 : info.drawn);
    const uint32_t level = pt_level_of_trust((double)most);
    if (level < PT_TRUST_LEVELS - 1) {
        const uint64_t all = shown_of(device, cloud, -1.0f, NULL, NULL);
        assert_int_equal(shown_of(device, cloud, (float)pt_trust_of_level(level + 1), NULL, left_out), all);
        assert_int_equal(left_out[1], info.drawn);
    }
    free(trust);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
}

static void test_degenerate(void **state)
{
    (void)state;
    enum { TWINS = 1000000, FEW = 200 };
    struct pcg random = pcg_seed(1);
    double *p = places(TWINS);
    check_defined("one point", p, 1);
    check_defined("points at one place", p, 40);
    check_defined("a million points at one place", p, TWINS);
    for (int i = 0; i < FEW; i++)
        p[3 * i] = i;
    check_defined("a line", p, FEW);
    for (int i = 0; i < FEW; i++)
        for (int k = 0; k < 3; k++)
            p[3 * i + k] = exp(pcg_between(&random, 0.0, 9.0)) * pcg_between(&random, -1.0, 1.0);
    check_defined("strays alone", p, FEW);
    for (int i = 0; i < 3 * 4096; i++) // rows whose spacings are 1, 30 and 1000
        for (int k = 0; k < 3; k++) {
            static const double spacings[3] = {1.0, 30.0, 1000.0};
            const int at = i % 4096, part = i / 4096;
            p[3 * i + k] = k == 2 ? 1e5 * part : spacings[part] * (k ? at / 64 : at % 64);
        }
    check_defined("spacings of 1 to 1000", p, 3 * 4096);
    free(p);
}

// Trust is 1 of most points here. Level 6 is PATINA_TRUST_DEFAULT, 9 is PATINA_TRUST_MOST.
static void test_default_level(void **state)
{
    (void)state;
    uint64_t counts[PT_TRUST_LEVELS] = {[15] = 100000};
    assert_int_equal(pt_level_of_trust((double)PATINA_TRUST_DEFAULT), 6);
    assert_int_equal(pt_level_of_trust((double)PATINA_TRUST_MOST), 9);
    assert_int_equal(pt_default_level(counts), 6); // a clean cloud keeps its points
    counts[8] = 900;
    counts[5] = 50; // 0.0495 % of all are below 6
    assert_int_equal(pt_default_level(counts), 6);
    counts[5] = 51; // 0.0505 %
    assert_int_equal(pt_default_level(counts), 9);
    counts[8] = 0;
    counts[7] = 1300; // 0.72 of these are right: 0.9 % of all that are
    assert_int_equal(pt_default_level(counts), 9);
    counts[7] = 1500; // 1.1 %
    assert_int_equal(pt_default_level(counts), 7);
    counts[6] = 1600; // 0.64 of these, 1.0 %
    assert_int_equal(pt_default_level(counts), 6);
    counts[2] = 50000; // below the least threshold in any case
    assert_int_equal(pt_default_level(counts), 6);
    memset(counts, 0, sizeof counts);
    assert_int_equal(pt_default_level(counts), 6);
}

static void test_strays_vanish(void **state)
{
    (void)state;
    double *p = plane_and_strays();
    patina_cloud *with = cloud_of(p, PLANE + STRAYS), *without = cloud_of(p, PLANE);
    const patina_analysis_desc desc = {.struct_size = sizeof desc};
    float *trust = trusts_of(with, &desc), *clean = trusts_of(without, &desc), above[64 * 64], beneath[64 * 64];
    uint64_t lost = 0, found = 0, wrong = 0, untrusted[2];
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(with, &info), with);
    assert_true(info.trust_default > (double)PATINA_TRUST_DEFAULT - 1e-6);
    for (int i = 0; i < PLANE; i++)
        lost += (double)trust[i] < info.trust_default - 1e-4;
    for (int i = PLANE; i < PLANE + STRAYS; i++)
        found += (double)trust[i] < info.trust_default - 1e-4;
    if (10 * found < 9 * STRAYS || 1000 * lost > PLANE)
        fail_msg("%llu of %d strays are found, and %llu of %d others", (unsigned long long)found, STRAYS,
                 (unsigned long long)lost, PLANE);
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        shown_of(device, with, -1.0f, above, untrusted);
        assert_int_equal(untrusted[0], 0);
        float nearest = INFINITY, farthest = 0.0f;
        for (int i = 0; i < 64 * 64; i++) {
            nearest = fminf(nearest, above[i]);
            farthest = isfinite(above[i]) ? fmaxf(farthest, above[i]) : farthest;
        }
        assert_true(farthest - nearest > 0.08f); // strays show
        assert_true(shown_of(device, with, 0.0f, beneath, untrusted) > 1000);
        assert_int_equal(untrusted[0], found + lost);
        assert_int_equal(untrusted[1], 0);
        for (int i = 0; i < 64 * 64; i++)
            wrong += isfinite(beneath[i]) && farthest - beneath[i] > 0.08f;
        assert_true(wrong <= 64 * 64 * (STRAYS - found) / 100);
        patina_device_destroy(device);
    }
    // what the surface's points are taken for is what it is without the strays, but where these are trusted
    float *axes[2] = {calloc(2 * (PLANE + STRAYS), 4), calloc(2 * PLANE, 4)};
    for (int i = 0; i < 2; i++) {
        const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .half_axes = axes[i]};
        CHECK(patina_cloud_neighbourhoods(i ? without : with, &wanted, NULL), NULL);
    }
    uint64_t wider = 0;
    for (int i = 0; i < PLANE; i++)
        wider += axes[0][2 * i] > 1.2f * axes[1][2 * i];
    assert_true(1000 * wider <= PLANE);
    for (int i = 0; i < 2; i++)
        free(axes[i]);
    free(trust);
    free(clean);
    free(p);
    patina_cloud_destroy(with);
    patina_cloud_destroy(without);
}

// Points at random: a threshold above all of them draws all, and the statistics say so.
static void test_none_trusted(void **state)
{
    (void)state;
    enum { FEW = 200 };
    struct pcg random = pcg_seed(3);
    double *p = places(FEW);
    for (int i = 0; i < 3 * FEW; i++)
        p[i] = pcg_between(&random, -1.0, 1.0);
    patina_device *device = support_device_open("cpu", 0, 0);
    patina_cloud *cloud = cloud_of(p, FEW);
    const patina_analysis_desc desc = {.struct_size = sizeof desc};
    float *trust = trusts_of(cloud, &desc), most = 0.0f;
    for (int i = 0; i < FEW; i++)
        most = fmaxf(most, trust[i]);
    const uint32_t level = pt_level_of_trust((double)most);
    assert_true(level < PT_TRUST_LEVELS - 1);
    uint64_t all[2], some[2], none[2];
    const uint64_t shown = shown_of(device, cloud, -1.0f, NULL, all);
    assert_true(shown_of(device, cloud, (float)pt_trust_of_level(level), NULL, some) > 0);
    assert_int_equal(shown_of(device, cloud, (float)pt_trust_of_level(level + 1), NULL, none), shown);
    assert_true(all[0] == 0 && all[1] == 0 && some[0] < FEW && some[1] == 0 && none[0] == 0 && none[1] == FEW);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
    free(trust);
    free(p);
}

static void test_threads(void **state)
{
    (void)state;
    double *p = plane_and_strays();
    float *features[2], *trust[2];
    for (uint32_t i = 0; i < 2; i++) {
        features[i] = calloc((PLANE + STRAYS) * PATINA_TRUST_FEATURES, sizeof(float));
        patina_cloud *cloud = cloud_of(p, PLANE + STRAYS);
        const patina_analysis_desc desc = {.struct_size = sizeof desc, .threads = 1 + 4 * i, .trust_features = features[i]};
        trust[i] = trusts_of(cloud, &desc);
        patina_cloud_destroy(cloud);
    }
    assert_memory_equal(features[0], features[1], (PLANE + STRAYS) * PATINA_TRUST_FEATURES * sizeof(float));
    assert_memory_equal(trust[0], trust[1], (PLANE + STRAYS) * sizeof(float));
    for (uint64_t i = 0; i < (PLANE + STRAYS) * PATINA_TRUST_FEATURES; i++)
        assert_true(isfinite(features[0][i]));
    for (int i = 0; i < 2; i++) {
        free(features[i]);
        free(trust[i]);
    }
    free(p);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_levels),        cmocka_unit_test(test_degenerate),   cmocka_unit_test(test_default_level),
        cmocka_unit_test(test_strays_vanish), cmocka_unit_test(test_none_trusted), cmocka_unit_test(test_threads),
    };
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
