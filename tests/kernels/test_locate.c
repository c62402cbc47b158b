// SPDX-License-Identifier: GPL-3.0-or-later
// locate: pixels of meshes as points, against float64.
#include "harness.h"
#include "shared/meshes.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

enum { TRIANGLES = 40, WIDTH = 45, HEIGHT = 31 };

struct scene {
    struct locate_args args;
    float *vertices;
    uint32_t *indices;
    uint64_t *shown, *mesh_keys;
    size_t count;
};

static void make(struct harness *h, struct rng *rng, struct scene *s, int perspective)
{
    *s = (struct scene){.args = {.view = picture_view(WIDTH, HEIGHT, perspective)}};
    struct mesh_args *mesh = &s->args.mesh;
    s->count = (size_t)s->args.view.width * s->args.view.height;
    s->args.eye_z = perspective ? 0.0f : -3.5f;
    mesh->stride = 3;
    mesh->id_base = 5000000;
    mesh->id_count = TRIANGLES;
    for (int k = 0; k < 9; k++) {
        mesh->row[k] = (float)rng_range(rng, -1.0, 1.0) * (k < 6 ? 40.0f : 1.0f);
        mesh->normal_matrix[k] = (float)rng_range(rng, -1.0, 1.0);
    }
    for (int k = 0; k < 3; k++)
        mesh->hi[k] = k < 2 ? 60.0f : 3.0f;
    s->vertices = harness_alloc(h, (size_t)TRIANGLES * 9 * sizeof(float));
    s->indices = harness_alloc(h, (size_t)TRIANGLES * 3 * sizeof(uint32_t));
    for (uint32_t i = 0; i < TRIANGLES * 9; i++)
        s->vertices[i] = (float)rng_range(rng, -1.0, 1.0);
    for (uint32_t i = 0; i < TRIANGLES * 3; i++)
        s->indices[i] = i < 3 ? 0 : (i * 7) % (TRIANGLES * 3); // the first triangle is a point: it has no plane
    s->shown = harness_alloc(h, s->count * 8);
    s->mesh_keys = harness_alloc(h, s->count * 8);
    for (size_t i = 0; i < s->count; i++) {
        float z = (float)rng_range(rng, 0.5, 8.0);
        s->mesh_keys[i] = rng_below(rng, 4) ? ref_key(z, mesh->id_base + rng_below(rng, TRIANGLES + 3)) : REF_EMPTY_KEY;
        s->shown[i] = s->mesh_keys[i] != REF_EMPTY_KEY && rng_below(rng, 4) ? ref_key(z, (uint32_t)i) : REF_EMPTY_KEY;
    }
}

// A word's normal, unit.
static struct ref_vec decode(uint32_t word)
{
    double x = ((double)(word & 0x1FFFu) - 4095.0) / 4095.0, y = ((double)(word >> 13 & 0x1FFFu) - 4095.0) / 4095.0;
    double z = 1.0 - fabs(x) - fabs(y), fold = fmax(-z, 0.0);
    return ref_unit(ref_vec(x + (x >= 0.0 ? -fold : fold), y + (y >= 0.0 ? -fold : fold), z));
}

static int near3(const float *places, size_t width, struct ref_vec p, double error)
{
    return harness_near(places[0], p.x, error) && harness_near(places[width], p.y, error) &&
           harness_near(places[2 * width], p.z, error);
}

static void check(struct harness *h, struct scene *s)
{
    const uint32_t width = s->args.view.width;
    float *marks = harness_alloc(h, s->count * 12);
    uint32_t *codes = harness_alloc(h, s->count * 4);
    for (size_t i = 0; i < s->count * 3; i++)
        marks[i] = -77.0f;
    for (size_t i = 0; i < s->count; i++)
        codes[i] = 77;
    struct pt_buffer *places = harness_buffer(h, marks, s->count * 12), *words = harness_buffer(h, codes, s->count * 4);
    HARNESS_RUN(h, locate, &s->args, harness_buffer(h, s->shown, s->count * 8), harness_buffer(h, s->mesh_keys, s->count * 8),
                harness_buffer(h, s->vertices, TRIANGLES * 36), harness_buffer(h, s->indices, TRIANGLES * 12), places, words);
    const float *got = harness_read(h, places);
    const uint32_t *got_words = harness_read(h, words);
    harness_same(h, "places", got, s->count * 3, 4, 3, width);
    harness_same(h, "words", got_words, s->count, 4, 1, width);
    size_t ours = 0, rough = 0;
    for (size_t i = 0; i < s->count; i++) {
        int x = (int)(i % width), y = (int)(i / width);
        const float *at = got + 3 * (size_t)y * width + (size_t)x;
        struct ref_locate e = ref_locate(&s->args, s->vertices, s->indices, s->shown[i], s->mesh_keys[i], x, y);
        if (!e.ours) {
            if (at[0] != -77.0f || at[width] != -77.0f || at[2 * width] != -77.0f || got_words[i] != 77)
                harness_fail(h, "untouched", x, y, "was written");
            continue;
        }
        ours++;
        if (!near3(at, width, e.p, e.error))
            harness_fail(h, "place", x, y, "got (%g %g %g), expected (%g %g %g) +- %.2g", at[0], at[width], at[2 * width],
                         e.p.x, e.p.y, e.p.z, e.error);
        if (got_words[i] >> 26 || (got_words[i] & PT_NORMAL_BITS) == PT_NORMAL_NONE)
            harness_fail(h, "word", x, y, "got %08x", got_words[i]);
        if (e.normal_error > 0.05) {
            rough++;
            continue;
        }
        struct ref_vec n = decode(got_words[i]);
        double off = ref_length(ref_add(n, ref_scale(e.n, -1.0)));
        if (!(off <= 2.0 * e.normal_error))
            harness_fail(h, "normal", x, y, "got (%g %g %g), expected (%g %g %g) +- %.2g", n.x, n.y, n.z, e.n.x, e.n.y, e.n.z,
                         2.0 * e.normal_error);
    }
    harness_note(h, "%zu pixels of the mesh, %zu of them too thin to compare normals", ours, rough);
    HARNESS_CHECK(h, ours > s->count / 3 && rough < ours / 4);
}

static void kinds(struct harness *h)
{
    for (int perspective = 0; perspective < 2; perspective++)
        for (uint64_t seed = 0; seed < 4; seed++) {
            struct rng rng = {seed + 10u * (uint32_t)perspective};
            struct scene s;
            make(h, &rng, &s, perspective);
            check(h, &s);
        }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"pixels of meshes", kinds, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
