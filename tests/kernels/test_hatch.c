// SPDX-License-Identifier: GPL-3.0-or-later
// hatch: levels, spacings, perspective and orthographic views, normals edge-on and missing, all tones.
#include "effect.h"
#include "shared/effects.h"

#include <math.h>
#include <string.h>

static struct ref_color reference(const void *args, const struct ref_planes *planes, int x, int y)
{
    return ref_hatch(args, planes, x, y);
}

static const struct effect hatch = {PT_KERNEL_hatch, reference, "knc"};

static struct hatch_args args_of(const struct view_args *view, uint32_t levels, float spacing)
{
    struct hatch_args args = {.view = *view,
                              .levels = levels,
                              .spacing = spacing,
                              .width = 0.55f * spacing,
                              .opacity = 0.9f,
                              .ground = 0.25f,
                              .eye_z = view->perspective ? 0.0f : 0.5f,
                              .color = {0.02f, 0.01f, 0.1f},
                              .tones = {1.1f, 1.7f, 3.0f},
                              .offsets = {0.3f, -7.0f, 2.0f},
                              .axes = {0.1f, 0.95f, 0.29580399f, 0.8f, -0.6f, 0.0f, 0.6f, 0.0f, 0.8f}};
    return args;
}

// Left open: what lies in the middle between strokes, and where the axis stands across the surface.
static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            if (kind == PICTURE_RANGE)
                continue; // strokes at depths of 1e4 are finer than their places
            struct picture picture = effect_picture(h, (uint64_t)kind, 67, 45, p, (enum picture_kind)kind, kind % 2);
            struct hatch_args args = args_of(&picture.view, 1 + (uint32_t)kind % 3, 3.0f + 3.0f * (float)kind);
            effect_check(h, &hatch, &args, sizeof args, &picture, NULL);
        }
}

static void hard(struct harness *h)
{
    static const uint32_t sizes[][2] = {{67, 45}, {1, 1}, {16384, 1}, {1, 70}};
    for (size_t s = 0; s < 4; s++) {
        struct picture picture = effect_picture(h, s, sizes[s][0], sizes[s][1], 1, PICTURE_SURFACES, 1);
        struct hatch_args args = args_of(&picture.view, 3, 6.0f);
        effect_check(h, &hatch, &args, sizeof args, &picture, NULL);
        for (size_t i = 0; i < picture.count; i++) // without normals surfaces face the viewer
            memset(picture.normal + 4 * i, 0, 12);
        effect_check(h, &hatch, &args, sizeof args, &picture, NULL);
    }
    // seven decades of depth: places may be too coarse for a stroke, colours stay between ink and ground
    struct picture picture = effect_picture(h, 5, 67, 45, 1, PICTURE_RANGE, 0);
    struct hatch_args args = args_of(&picture.view, 3, 6.0f);
    struct pt_buffer *color = harness_buffer(h, picture.color, picture.count * 16);
    HARNESS_RUN(h, hatch, &args, harness_buffer(h, picture.keys, picture.count * 8),
                harness_buffer(h, picture.normal, picture.count * 16), color);
    const float *got = harness_read(h, color);
    for (size_t i = 0; i < picture.count; i++)
        for (size_t c = 0; c < 3 && picture.keys[i] != REF_EMPTY_KEY; c++)
            if (!(got[4 * i + c] >= 0.0f && got[4 * i + c] <= 2.0f))
                harness_fail(h, "color", (int)(i % 67), (int)(i / 67), "got %.9g", (double)got[4 * i + c]);
}

// Reference alone, a plane that faces the viewer: white has no stroke, black is covered by the strokes' width, and strokes are
// as far apart as asked for.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(640, 1, 0), PICTURE_FLAT, 1.0);
    struct ref_planes planes = picture_planes(&picture);
    struct hatch_args args = args_of(&picture.view, 1, 8.0f);
    args.ground = 0.0f;
    args.opacity = 1.0f;
    args.axes[0] = 1.0f;
    args.axes[1] = args.axes[2] = 0.0f;
    args.color[0] = 1.0f;
    planes.shading = picture.normal;
    double ink = 0.0;
    for (size_t i = 0; i < picture.count; i++)
        for (size_t c = 0; c < 3; c++)
            picture.color[4 * i + c] = 0.0f;
    for (int x = 0; x < 640; x++)
        ink += ref_hatch(&args, &planes, x, 0).color[0] / 640.0;
    HARNESS_CHECK(h, ink > 0.4 && ink < 0.75);
    for (size_t i = 0; i < picture.count; i++)
        for (size_t c = 0; c < 3; c++)
            picture.color[4 * i + c] = 1.0f;
    for (int x = 0; x < 640; x++)
        HARNESS_CHECK(h, ref_hatch(&args, &planes, x, 0).color[1] == 1.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"pictures of all kinds", kinds, 0}, {"hard", hard, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
