// SPDX-License-Identifier: GPL-3.0-or-later
// cover: meshes over points, against float64.
#include "harness.h"
#include "shared/meshes.h"

#include <math.h>
#include <string.h>

struct scene {
    struct cover_args args;
    struct picture picture;
    float *vertices;
    uint32_t *indices;
    uint64_t *mesh_keys;
    float *limit;
};

static void make(struct harness *h, struct rng *rng, struct scene *s, int perspective, uint32_t attributes, int behind)
{
    enum { TRIANGLES = 40 };
    *s = (struct scene){.picture = picture_random(h, rng, picture_view(45, 31, perspective), PICTURE_SURFACES, 0.5)};
    picture_invent(&s->picture, rng, 0.5, 2);
    struct mesh_args *mesh = &s->args.mesh;
    s->args.view = s->picture.view;
    s->args.shown = 1;
    s->args.behind = (uint32_t)behind;
    mesh->has_normals = attributes & 1u;
    mesh->has_colors = attributes >> 1;
    mesh->stride = 3 + 3 * mesh->has_normals + 3 * mesh->has_colors;
    mesh->id_base = 5000000;
    mesh->id_count = TRIANGLES;
    for (int k = 0; k < 9; k++) {
        mesh->row[k] = (float)rng_range(rng, -1.0, 1.0) * (k < 6 ? 40.0f : 1.0f);
        mesh->normal_matrix[k] = (float)rng_range(rng, -1.0, 1.0);
    }
    for (int k = 0; k < 3; k++) {
        mesh->hi[k] = k < 2 ? 60.0f : 3.0f;
        mesh->color[k] = 0.25f * (float)(k + 1);
    }
    s->vertices = harness_alloc(h, (size_t)TRIANGLES * 3 * mesh->stride * sizeof(float));
    s->indices = harness_alloc(h, (size_t)TRIANGLES * 3 * sizeof(uint32_t));
    for (uint32_t i = 0; i < TRIANGLES * 3 * mesh->stride; i++)
        s->vertices[i] = (float)rng_range(rng, -1.0, 1.0);
    for (uint32_t i = 0; i < TRIANGLES * 3; i++)
        s->indices[i] = (i * 7) % (TRIANGLES * 3);
    s->mesh_keys = harness_alloc(h, s->picture.count * 8);
    s->limit = harness_alloc(h, s->picture.count * 4);
    for (size_t i = 0; i < s->picture.count; i++) {
        float z = rng_below(rng, 8) ? (float)rng_range(rng, 0.5, 8.0) : (float)ref_key_z(s->picture.keys[i]);
        s->mesh_keys[i] = rng_below(rng, 4) && isfinite(z) ? ref_key(z, mesh->id_base + rng_below(rng, TRIANGLES + 3))
                                                           : REF_EMPTY_KEY;
        s->limit[i] = (float)rng_range(rng, 0.5, 8.0);
    }
}

static void near3(struct harness *h, const char *label, int x, int y, const float *got, struct ref_vec expected, double error)
{
    if (!harness_near(got[0], expected.x, error) || !harness_near(got[1], expected.y, error) ||
        !harness_near(got[2], expected.z, error))
        harness_fail(h, label, x, y, "got (%g %g %g), expected (%g %g %g) +- %.2g", got[0], got[1], got[2], expected.x,
                     expected.y, expected.z, error);
}

static void check(struct harness *h, struct scene *s)
{
    size_t count = s->picture.count, rough = 0, front = 0;
    uint32_t width = s->args.view.width;
    uint64_t *empty = harness_alloc(h, count * 8);
    for (size_t i = 0; i < count; i++)
        empty[i] = REF_EMPTY_KEY;
    struct pt_buffer *keys = harness_buffer(h, s->picture.keys, count * 8),
                     *from = harness_buffer(h, s->picture.from, count * 4);
    struct pt_buffer *normal = harness_buffer(h, s->picture.normal, count * 16),
                     *deff = harness_buffer(h, s->picture.deff, count * 4);
    struct pt_buffer *shown = harness_buffer(h, empty, count * 8), *smooth = harness_buffer(h, s->picture.normal, count * 16);
    struct pt_buffer *albedo = harness_buffer(h, harness_alloc(h, count * 16), count * 16);
    HARNESS_RUN(h, cover, &s->args, keys, from, normal, deff, harness_buffer(h, s->mesh_keys, count * 8),
                harness_buffer(h, s->vertices, (size_t)s->args.mesh.id_count * 3 * s->args.mesh.stride * 4),
                harness_buffer(h, s->indices, (size_t)s->args.mesh.id_count * 12), shown, smooth, albedo,
                harness_buffer(h, s->limit, count * 4));
    const uint64_t *got_keys = harness_read(h, keys), *got_shown = harness_read(h, shown);
    const uint32_t *got_from = harness_read(h, from);
    const float *got_normal = harness_read(h, normal), *got_deff = harness_read(h, deff), *got_smooth = harness_read(h, smooth);
    const float *got_albedo = harness_read(h, albedo);
    harness_same(h, "keys", got_keys, count, 8, 1, width);
    harness_same(h, "from", got_from, count, 4, 1, width);
    harness_same(h, "normal", got_normal, count * 4, 4, 4, width);
    harness_same(h, "deff", got_deff, count, 4, 1, width);
    harness_same(h, "shown", got_shown, count, 8, 1, width);
    harness_same(h, "smooth", got_smooth, count * 4, 4, 4, width);
    harness_same(h, "albedo", got_albedo, count * 4, 4, 4, width);
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % width), y = (int)(i / width);
        struct ref_cover e = ref_cover(&s->args, s->vertices, s->indices, s->picture.keys[i], s->mesh_keys[i], s->limit[i], x,
                                       y);
        if (!e.front) {
            if (got_keys[i] != s->picture.keys[i] || got_from[i] != s->picture.from[i] || got_shown[i] != REF_EMPTY_KEY ||
                memcmp(got_normal + 4 * i, s->picture.normal + 4 * i, 16) || memcmp(&got_deff[i], &s->picture.deff[i], 4))
                harness_fail(h, "untouched", x, y, "was written");
            continue;
        }
        front++;
        if (got_keys[i] != s->mesh_keys[i] || got_from[i] != i || got_shown[i] != ((s->mesh_keys[i] & ~0xFFFFFFFFull) | i))
            harness_fail(h, "key", x, y, "got %016llx from %u", (unsigned long long)got_keys[i], got_from[i]);
        int measured = s->picture.keys[i] != REF_EMPTY_KEY && s->picture.from[i] == i;
        if (measured && memcmp(got_normal + 4 * i, s->picture.normal + 4 * i, 16))
            harness_fail(h, "normal", x, y, "of a measured point was lost");
        if (e.plane_error > 0.01 || e.smooth_error > 0.05) {
            rough++;
            continue;
        }
        if (!measured)
            near3(h, "normal", x, y, got_normal + 4 * i, e.n, e.plane_error);
        near3(h, "smooth", x, y, got_smooth + 4 * i, e.smooth, e.smooth_error);
        if (!harness_near(got_smooth[4 * i + 3], e.inverse, e.inverse_error) ||
            !harness_near(got_deff[i], e.deff, e.deff_error))
            harness_fail(h, "deff", x, y, "got %.9g, expected %.9g +- %.2g", got_deff[i], e.deff, e.deff_error);
        near3(h, "albedo", x, y, got_albedo + 4 * i, ref_vec(e.albedo[0], e.albedo[1], e.albedo[2]), e.albedo_error);
    }
    harness_note(h, "%zu pixels in front, %zu of them too thin to compare", front, rough);
    HARNESS_CHECK(h, front > count / 20 && rough < front / 4);
}

static void kinds(struct harness *h)
{
    for (int perspective = 0; perspective < 2; perspective++)
        for (uint32_t attributes = 0; attributes < 4; attributes++)
            for (int behind = 0; behind < 2; behind++) {
                struct rng rng = {attributes + 4u * (uint32_t)behind + 8u * (uint32_t)perspective};
                struct scene s;
                make(h, &rng, &s, perspective, attributes, behind);
                check(h, &s);
            }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"over pictures of points", kinds, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
