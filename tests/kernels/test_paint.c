// SPDX-License-Identifier: GPL-3.0-or-later
// paint: images on triangles, against float64: every wrap, format and filter, from larger than the picture to a texel of its last
// level; and places that are no numbers.
#include "harness.h"
#include "shared/meshes.h"

#include <math.h>
#include <string.h>

enum { TRIANGLES = 12, WIDTH = 61, HEIGHT = 43 };

struct scene {
    struct paint_args args;
    float *vertices;
    uint32_t *indices, *texels;
    size_t texel_words;
    uint64_t *shown, *mesh_keys;
    size_t count;
};

static void make_image(struct harness *h, struct rng *rng, struct texture_args *image, uint32_t width, uint32_t height,
                       struct scene *s)
{
    uint32_t count = 0;
    for (image->levels = 0;; width = width > 1 ? width / 2 : 1, height = height > 1 ? height / 2 : 1) {
        uint32_t *size = image->sizes + 3 * image->levels++;
        size[0] = width;
        size[1] = height;
        size[2] = count;
        count += width * height;
        if (width == 1 && height == 1)
            break;
    }
    const uint32_t words = image->format == PT_TEXELS_FLOAT ? 4 : 1;
    s->texel_words = (size_t)count * words;
    s->texels = harness_alloc(h, s->texel_words * 4);
    for (size_t i = 0; i < s->texel_words; i++) {
        float value = (float)rng_unit(rng);
        if (words == 4)
            memcpy(&s->texels[i], &value, 4);
        else
            s->texels[i] = (uint32_t)rng_next(rng);
    }
}

// uv: how many images a triangle spans.
static struct scene make(struct harness *h, struct rng *rng, int perspective, struct texture_args image, uint32_t width,
                         uint32_t height, double uv)
{
    struct scene s = {.args = {.view = picture_view(WIDTH, HEIGHT, perspective)}};
    struct mesh_args *mesh = &s.args.mesh;
    mesh->texture = image;
    make_image(h, rng, &mesh->texture, width, height, &s);
    mesh->stride = 5;
    mesh->texture.uv = 3;
    mesh->id_base = 5000000;
    mesh->id_count = TRIANGLES;
    s.count = (size_t)s.args.view.width * s.args.view.height;
    for (int k = 0; k < 3; k++)
        mesh->row[4 * k] = 1.0f;
    s.vertices = harness_alloc(h, (size_t)TRIANGLES * 15 * sizeof(float));
    s.indices = harness_alloc(h, (size_t)TRIANGLES * 3 * sizeof(uint32_t));
    for (uint32_t i = 0; i < TRIANGLES * 3; i++) {
        s.indices[i] = i;
        float *v = s.vertices + 5 * i;
        double z = rng_range(rng, 1.0, 6.0), turn = 6.283 * (i % 3 + rng_range(rng, -0.15, 0.15)) / 3.0,
               far = rng_range(rng, 60.0, 400.0);
        double x = s.args.view.origin_x + 30 + far * cos(turn), y = s.args.view.origin_y + 20 + far * sin(turn);
        v[0] = (float)(x * (perspective ? z : 1.0));
        v[1] = (float)(y * (perspective ? z : 1.0));
        v[2] = (float)z;
        for (int k = 0; k < 2; k++)
            v[3 + k] = (float)rng_range(rng, -uv, uv);
    }
    s.shown = harness_alloc(h, s.count * 8);
    s.mesh_keys = harness_alloc(h, s.count * 8);
    for (size_t i = 0; i < s.count; i++) {
        float z = (float)rng_range(rng, 0.5, 8.0);
        s.mesh_keys[i] = rng_below(rng, 8) ? ref_key(z, mesh->id_base + rng_below(rng, TRIANGLES + 1)) : REF_EMPTY_KEY;
        s.shown[i] = s.mesh_keys[i] != REF_EMPTY_KEY && rng_below(rng, 8) ? ref_key(z, (uint32_t)i) : REF_EMPTY_KEY;
    }
    return s;
}

static const float *paint(struct harness *h, struct scene *s)
{
    float *marks = harness_alloc(h, s->count * 16);
    for (size_t i = 0; i < s->count * 4; i++)
        marks[i] = -77.0f;
    struct pt_buffer *albedo = harness_buffer(h, marks, s->count * 16);
    HARNESS_RUN(h, paint, &s->args, harness_buffer(h, s->shown, s->count * 8), harness_buffer(h, s->mesh_keys, s->count * 8),
                harness_buffer(h, s->vertices, TRIANGLES * 60), harness_buffer(h, s->indices, TRIANGLES * 12),
                harness_buffer(h, s->texels, s->texel_words * 4), albedo);
    const float *got = harness_read(h, albedo);
    harness_same(h, "albedo", got, s->count * 4, 4, 4, s->args.view.width);
    return got;
}

// How many pixels were compared; *open: could not be.
static size_t check(struct harness *h, struct scene *s, size_t *open)
{
    const float *got = paint(h, s);
    size_t compared = 0;
    for (size_t i = 0; i < s->count; i++) {
        int x = (int)(i % s->args.view.width), y = (int)(i / s->args.view.width);
        const float *c = got + 4 * i;
        struct ref_paint e = ref_paint(&s->args, s->vertices, s->indices, s->texels, s->shown[i], s->mesh_keys[i], x, y);
        if (!e.ours && (c[0] != -77.0f || c[3] != -77.0f))
            harness_fail(h, "untouched", x, y, "was written");
        if (!e.ours)
            continue;
        for (int k = 0; k < 4; k++)
            if (!(c[k] >= 0.0f && c[k] <= 1.0001f))
                harness_fail(h, "range", x, y, "channel %d is %g", k, c[k]);
        if (e.open || e.error > 0.02) {
            ++*open;
            continue;
        }
        compared++;
        for (int k = 0; k < 4; k++) {
            double weight = k < 3 && s->args.mesh.texture.blend ? e.color[3] : 1.0; // what shows
            if (!harness_near(c[k] * weight, e.color[k] * weight, e.error))
                harness_fail(h, "colour", x, y, "channel %d: got %g, expected %g +- %.2g", k, c[k], e.color[k],
                             e.error / weight);
        }
    }
    return compared;
}

static void kinds(struct harness *h)
{
    static const double spans[] = {0.02, 0.3, 2.0, 30.0};
    size_t compared = 0, open = 0;
    for (int perspective = 0; perspective < 2; perspective++)
        for (uint32_t format = PT_TEXELS_SRGB; format <= PT_TEXELS_FLOAT; format++)
            for (uint32_t wrap = PT_WRAP_REPEAT; wrap <= PT_WRAP_CLIP; wrap++)
                for (uint32_t span = 0; span < 4; span++) {
                    struct rng rng = {span + 8u * wrap + 32u * format + 128u * (uint32_t)perspective};
                    struct texture_args image = {.format = format, .wrap = wrap, .nearest = span & 1u, .blend = 1};
                    struct scene s = make(h, &rng, perspective, image, 37, 22, spans[span]);
                    compared += check(h, &s, &open);
                }
    harness_note(h, "%zu pixels compared, %zu open", compared, open);
    HARNESS_CHECK(h, compared > 20000 && open < compared);
}

// A pixel wide and high, a texel wide and a row of many; opacity that is not shown.
static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {1, 200}, {333, 1}, {64, 64}};
    size_t compared = 0, open = 0;
    for (size_t i = 0; i < 4; i++) {
        struct rng rng = {70 + i};
        struct texture_args image = {.format = PT_TEXELS_LINEAR};
        struct scene s = make(h, &rng, 1, image, sizes[i][0], sizes[i][1], 3.0);
        compared += check(h, &s, &open);
    }
    harness_note(h, "%zu pixels compared, %zu open", compared, open);
    HARNESS_CHECK(h, compared > 1500);
}

// Places on the image that are huge, or no numbers; triangles seen edge on: some colour within the image's, and no crash.
static void hard(struct harness *h)
{
    static const float places[] = {1e30f, -1e30f, (float)INFINITY, (float)NAN, 3e38f, 1e-38f, 0.0f, 16777217.0f};
    for (uint32_t wrap = 0; wrap < 3; wrap++) {
        struct rng rng = {90 + wrap};
        struct texture_args image = {.format = PT_TEXELS_SRGB, .wrap = wrap, .nearest = wrap & 1u};
        struct scene s = make(h, &rng, 1, image, 16, 9, 1.0);
        for (uint32_t t = 0; t < TRIANGLES; t++) {
            float *v = s.vertices + 15 * t;
            if (t < 8)
                v[5 * rng_below(&rng, 3) + 3 + rng_below(&rng, 2)] = places[t];
            else if (t < 10)
                memcpy(v + 5, v, 12); // edge on
            else
                for (int k = 0; k < 3; k++)
                    v[5 * k + 2] = t == 10 ? 1e-30f : (float)(k - 1); // at the eye, and around it
        }
        const float *got = paint(h, &s);
        for (size_t i = 0; i < s.count; i++) {
            uint32_t triangle = ref_key_id(s.mesh_keys[i]) - s.args.mesh.id_base;
            if (triangle >= TRIANGLES || s.shown[i] == REF_EMPTY_KEY)
                continue;
            for (int k = 0; k < 4; k++)
                if (!(got[4 * i + (size_t)k] >= 0.0f && got[4 * i + (size_t)k] <= 1.0001f))
                    harness_fail(h, "range", (int)(i % WIDTH), (int)(i / WIDTH), "triangle %u, channel %d is %g", triangle, k,
                                 got[4 * i + (size_t)k]);
        }
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"wraps, formats, filters", kinds, 0}, {"shapes of images", shapes, 0}, {"hard cases", hard, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
