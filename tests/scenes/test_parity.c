// SPDX-License-Identifier: GPL-3.0-or-later
// The same scene on every device: keys, depth, source and normals bit-equal, colours within the table (SPEC 1).
#include "staging.h"
#include "tolerances.h"

#include <math.h>
#include <stdio.h>

#define LAYER_DIFFERS "%s, %s: %s of layer %u at pixel %llu is %.9g, the first device has %.9g"

// Colours: TOL_COLOR is a share of the terms' absolute sum. The scenes' brightest term is a point light near the
// surface, a few units; premultiplied alpha is 1 at most.
static double color_scale(const struct picture *picture)
{
    double scale = 1.0;
    for (uint64_t i = 0; i < 4 * (uint64_t)picture->width * picture->height; i++)
        scale = fmax(scale, fabs((double)picture->combined[i]));
    return scale;
}

static double farthest(const float *a, const float *b, uint64_t count, uint64_t *where)
{
    double worst = 0.0;
    for (uint64_t i = 0; i < count; i++) {
        double distance = fabs((double)a[i] - (double)b[i]);
        if (a[i] == b[i] || distance <= worst) // equal infinities: their difference is NaN
            continue;
        if (!(distance <= worst)) {
            worst = isnan(distance) ? HUGE_VAL : distance;
            *where = i;
        }
    }
    return worst;
}

static void compare(const struct picture *picture, const struct picture *truth, const char *name, const char *scene)
{
    uint64_t pixels = (uint64_t)truth->width * truth->height, where = 0;
    assert_int_equal(picture->width, truth->width);
    assert_int_equal(picture->height, truth->height);
    for (uint64_t i = 0; i < pixels; i++)
        if (picture->keys[i] != truth->keys[i])
            support_die("%s, %s: key at (%u, %u) is %016llx (source %g), the first device has %016llx (source %g)", name, scene,
                        (unsigned)(i % truth->width), (unsigned)(i / truth->width), (unsigned long long)picture->keys[i],
                        (double)picture->source[i], (unsigned long long)truth->keys[i], (double)truth->source[i]);
    if (farthest(picture->depth, truth->depth, pixels, &where) > 0.0)
        support_die("%s, %s: depth at pixel %llu is %.9g, the first device has %.9g", name, scene, (unsigned long long)where,
                    (double)picture->depth[where], (double)truth->depth[where]);
    if (farthest(picture->normal, truth->normal, 3 * pixels, &where) > 0.0)
        support_die("%s, %s: normal at pixel %llu is %.9g, the first device has %.9g", name, scene,
                    (unsigned long long)where / 3, (double)picture->normal[where], (double)truth->normal[where]);
    if (farthest(picture->trust, truth->trust, pixels, &where) > 0.0)
        support_die("%s, %s: trust at pixel %llu is %.9g, the first device has %.9g", name, scene, (unsigned long long)where,
                    (double)picture->trust[where], (double)truth->trust[where]);
    if (farthest(picture->thickness, truth->thickness, pixels, &where) > 0.0)
        support_die("%s, %s: thickness at pixel %llu is %.9g, the first device has %.9g", name, scene,
                    (unsigned long long)where, (double)picture->thickness[where], (double)truth->thickness[where]);
    // A distance of filled pixels may differ as drivers' sqrt() does.
    for (uint64_t i = 0; i < pixels; i++)
        if (fabs((double)picture->source[i] - (double)truth->source[i]) > TOL_DISTANCE * fabs((double)truth->source[i]))
            support_die("%s, %s: source at pixel %llu is %.9g, the first device has %.9g", name, scene, (unsigned long long)i,
                        (double)picture->source[i], (double)truth->source[i]);
    for (uint32_t k = 0; k < truth->layers; k++) {
        const float *a = picture->layer_depth + k * pixels, *b = truth->layer_depth + k * pixels;
        if (farthest(a, b, pixels, &where) > 0.0)
            support_die(LAYER_DIFFERS, name, scene, "depth", k + 1, (unsigned long long)where, (double)a[where],
                        (double)b[where]);
        a = picture->layer_normal + 3 * k * pixels;
        b = truth->layer_normal + 3 * k * pixels;
        if (farthest(a, b, 3 * pixels, &where) > 0.0)
            support_die(LAYER_DIFFERS, name, scene, "normal", k + 1, (unsigned long long)where, (double)a[where],
                        (double)b[where]);
        a = picture->layer_combined + 4 * k * pixels;
        b = truth->layer_combined + 4 * k * pixels;
        if (farthest(a, b, 4 * pixels, &where) > TOL_COLOR * color_scale(truth))
            support_die(LAYER_DIFFERS, name, scene, "colour", k + 1, (unsigned long long)where, (double)a[where],
                        (double)b[where]);
    }
    double colors = farthest(picture->combined, truth->combined, 4 * pixels, &where), scale = color_scale(truth);
    if (colors > TOL_COLOR * scale)
        support_die("%s, %s: colour at pixel %llu is off by %g (allowed %g)", name, scene, (unsigned long long)where / 4,
                    colors, TOL_COLOR * scale);
    printf("  %-40s %-12s keys equal, colours within %.1e of %.1e\n", scene, name, colors, TOL_COLOR * scale);
}

static void test_devices_agree(void **state)
{
    (void)state;
    patina_device *devices[16];
    const char *names[16];
    uint32_t count = 0;
    for (uint32_t i = 0; i < support_device_count() && count < 16; i++) {
        patina_device *device = support_device_open(support_device_name(i), 0, 0);
        if (!device)
            continue;
        names[count] = support_device_name(i);
        devices[count++] = device;
    }
    if (count < 2)
        print_message("one device only: nothing to compare with\n");
    for (uint32_t i = 0; i < staging_count; i++) {
        struct stage stage = stage_build(&stagings[i]);
        struct picture truth = {0};
        for (uint32_t k = 0; k < count; k++) {
            struct picture picture = picture_render(devices[k], stage.scene, &stage.camera, &stage.settings);
            if (k == 0) {
                truth = picture;
                if (stagings[i].width > 1)
                    assert_true(picture_count(&truth) > 0);
                continue;
            }
            if (!support_is_gl(names[0]) && !support_is_gl(names[k])) // the CPU promises the same pixels, colours too
                picture_assert_identical(&picture, &truth, 0, 0, names[k]);
            compare(&picture, &truth, names[k], stagings[i].name);
            picture_free(&picture);
        }
        picture_free(&truth);
        stage_free(&stage);
    }
    for (uint32_t k = 0; k < count; k++)
        patina_device_destroy(devices[k]);
}

// A frame that is used again for another scene and another size gives what a fresh one gives, on every device.
static void test_reused_frames(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < support_device_count(); i++) {
        patina_device *device = support_device_open(support_device_name(i), 0, 0);
        if (!device)
            continue;
        patina_frame *frame = NULL;
        CHECK(patina_frame_create(device, &frame), device);
        const uint32_t order[] = {11, 1, 7, 20, 4, 21, 9, 25, 1, 22, 7, 33, 17, 30, 27, 12, 0, 11, 19};
        for (uint32_t k = 0; k < sizeof order / sizeof order[0]; k++) {
            struct stage stage = stage_build(&stagings[order[k]]);
            struct picture fresh = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            CHECK(patina_frame_render(frame, stage.scene), frame);
            struct picture again = picture_read(frame);
            picture_read_layers(&again, frame, &stage.settings);
            picture_assert_identical(&again, &fresh, 0, 0, stagings[order[k]].name);
            picture_free(&again);
            picture_free(&fresh);
            stage_free(&stage);
        }
        patina_frame_destroy(frame);
        patina_device_destroy(device);
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_devices_agree),
        cmocka_unit_test(test_reused_frames),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
