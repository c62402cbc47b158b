// SPDX-License-Identifier: GPL-3.0-or-later
// raster: triangles of all sizes against float64; edges between triangles drawn once; cut triangles.
#include "harness.h"
#include "shared/meshes.h"

#include <math.h>
#include <string.h>

struct soup {
    struct raster_args args;
    float *vertices;
    uint32_t *indices;
};

// An object placed 5 before the eye; perspective: rows give pixels times z.
static struct soup soup(struct harness *h, struct view_args view, uint32_t triangles)
{
    struct soup s = {.args = {.view = view}};
    struct mesh_args *mesh = &s.args.mesh;
    double sx = 1.0 / (double)view.ray_xs, sy = 1.0 / (double)view.ray_ys;
    double ox = -(double)view.ray_x0 * sx, oy = -(double)view.ray_y0 * sy, z = 5.0;
    mesh->row[0] = (float)sx;
    mesh->row[4] = (float)sy;
    mesh->row[8] = -1.0f;
    if (view.perspective) {
        mesh->row[2] = (float)-ox;
        mesh->row[5] = (float)-oy;
    }
    mesh->hi[0] = (float)(view.perspective ? ox * z : ox);
    mesh->hi[1] = (float)(view.perspective ? oy * z : oy);
    mesh->hi[2] = (float)z;
    mesh->stride = 3;
    mesh->id_base = 1000;
    mesh->id_count = triangles;
    s.vertices = harness_alloc(h, (size_t)triangles * 9 * sizeof(float));
    s.indices = harness_alloc(h, (size_t)triangles * 3 * sizeof(uint32_t));
    for (uint32_t i = 0; i < 3 * triangles; i++)
        s.indices[i] = i;
    return s;
}

static void run_over(struct harness *h, const struct soup *s, const float *limit, struct pt_buffer *keys)
{
    size_t pixels = (size_t)s->args.view.width * s->args.view.height, corners = 3 * (size_t)s->args.mesh.id_count;
    struct pt_buffer *vertices = harness_buffer(h, s->vertices, corners * 12);
    struct pt_buffer *indices = harness_buffer(h, s->indices, corners * 4);
    HARNESS_RUN(h, raster, &s->args, keys, vertices, indices, NULL, limit ? harness_buffer(h, limit, pixels * 4) : NULL);
}

static struct pt_buffer *empty_keys(struct harness *h, const struct view_args *view)
{
    size_t pixels = (size_t)view->width * view->height;
    uint64_t *empty = harness_alloc(h, pixels * 8);
    for (size_t i = 0; i < pixels; i++)
        empty[i] = REF_EMPTY_KEY;
    return harness_buffer(h, empty, pixels * 8);
}

static uint64_t *run(struct harness *h, const struct soup *s, const float *limit)
{
    struct pt_buffer *keys = empty_keys(h, &s->args.view);
    run_over(h, s, limit, keys);
    return harness_read(h, keys);
}

// A key must be a triangle that may be there, at such a depth, and none that must be there may be nearer.
static void check(struct harness *h, const struct soup *s, const float *limit, double most_open)
{
    uint64_t *got = run(h, s, limit);
    uint32_t width = s->args.view.width, height = s->args.view.height;
    size_t open = 0;
    harness_same(h, "keys", got, (size_t)width * height, 8, 1, width);
    if (harness_settled(h))
        return;
    for (uint32_t at = 0; at < width * height; at++) {
        int x = (int)(at % width), y = (int)(at / width), explained = got[at] == REF_EMPTY_KEY, unsure = 0;
        for (uint32_t t = 0; t < s->args.mesh.id_count; t++) {
            struct ref_hit hit = ref_raster(&s->args.view, &s->args.mesh, s->vertices, s->indices, t, x, y);
            if (!hit.possible || (limit && !(hit.z.hi > (double)limit[at])))
                continue;
            unsure |= !hit.definite;
            double z = ref_key_z(got[at]);
            if (got[at] != REF_EMPTY_KEY && ref_key_id(got[at]) == s->args.mesh.id_base + t) {
                explained = 1;
                if (!(z >= hit.z.lo && z <= hit.z.hi))
                    harness_fail(h, "depth", x, y, "triangle %u at %.9g, expected %.9g to %.9g", t, z, hit.z.lo, hit.z.hi);
                if (limit && !(z > (double)limit[at]))
                    harness_fail(h, "limit", x, y, "triangle %u at %.9g, limit %.9g", t, z, (double)limit[at]);
            } else if (hit.definite && !(limit && hit.z.lo <= (double)limit[at]) && hit.z.hi < z) {
                harness_fail(h, "key", x, y, "got %.9g, triangle %u lies at %.9g to %.9g", z, t, hit.z.lo, hit.z.hi);
            }
        }
        open += (size_t)unsure;
        if (!explained)
            harness_fail(h, "key", x, y, "got triangle %u, which cannot be there", ref_key_id(got[at]) - s->args.mesh.id_base);
    }
    harness_note(h, "%zu of %u pixels open", open, width * height);
    harness_unsure(h, open, (size_t)width * height, most_open);
}

// Triangles with corners in a ball of this size around random places.
static void scatter_triangles(struct rng *rng, struct soup *s, double size, double spread)
{
    for (uint32_t t = 0; t < s->args.mesh.id_count; t++)
        for (int k = 0; k < 9; k++) {
            if (k < 3)
                s->vertices[9 * t + (uint32_t)k] = (float)rng_range(rng, -spread, spread);
            else
                s->vertices[9 * t + (uint32_t)k] = s->vertices[9 * t + (uint32_t)k % 3] + (float)rng_range(rng, -size, size);
        }
}

static void sizes(struct harness *h)
{
    static const double of[] = {0.003, 0.03, 0.4, 3.0};
    for (int perspective = 0; perspective < 2; perspective++)
        for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
            struct rng rng = {i + 10u * (uint32_t)perspective};
            struct soup s = soup(h, picture_view(61, 43, perspective), i < 2 ? 400 : 60);
            scatter_triangles(&rng, &s, of[i], 2.0);
            check(h, &s, NULL, TOL_UNSURE_SHARE);
        }
}

// Corners on all sides of the eye. With some of them a million units away float32 leaves most of it open; it must not hang.
static void cut(struct harness *h)
{
    for (int perspective = 0; perspective < 2; perspective++)
        for (uint32_t far = 0; far < 2; far++) {
            struct rng rng = {far};
            struct soup s = soup(h, picture_view(61, 43, perspective), 12);
            scatter_triangles(&rng, &s, far ? 1e6 : 20.0, 6.0);
            check(h, &s, NULL, far ? 1.0 : TOL_UNSURE_HARD);
        }
}

static void behind(struct harness *h)
{
    struct rng rng = {3};
    struct soup s = soup(h, picture_view(61, 43, 1), 60);
    float limit[61 * 43];
    scatter_triangles(&rng, &s, 1.0, 2.0);
    s.args.behind = 1;
    for (size_t i = 0; i < 61 * 43; i++)
        limit[i] = rng_below(&rng, 4) ? (float)rng_range(&rng, 3.0, 7.0) : (float)INFINITY;
    check(h, &s, limit, TOL_UNSURE_SHARE);
}

// Two meshes, in both orders: the nearer triangle shows, whichever number it has.
static void one_after_another(struct harness *h)
{
    struct rng rng = {5};
    struct soup soups[2] = {soup(h, picture_view(61, 43, 1), 40), soup(h, picture_view(61, 43, 1), 40)};
    uint64_t *alone[2];
    soups[1].args.mesh.id_base += soups[0].args.mesh.id_count;
    for (int i = 0; i < 2; i++) {
        scatter_triangles(&rng, &soups[i], 1.0, 2.0);
        alone[i] = run(h, &soups[i], NULL);
    }
    for (int first = 0; first < 2; first++) {
        struct pt_buffer *keys = empty_keys(h, &soups[0].args.view);
        run_over(h, &soups[first], NULL, keys);
        run_over(h, &soups[1 - first], NULL, keys);
        const uint64_t *got = harness_read(h, keys);
        uint32_t nearer[2] = {0, 0};
        for (int at = 0; at < 61 * 43; at++) {
            const int which = alone[1][at] < alone[0][at];
            nearer[which] += alone[0][at] != REF_EMPTY_KEY && alone[1][at] != REF_EMPTY_KEY;
            if (got[at] != alone[which][at])
                harness_fail(h, "key", at % 61, at / 61, "got %.9g of triangle %u, expected %.9g of %u", ref_key_z(got[at]),
                             ref_key_id(got[at]), ref_key_z(alone[which][at]), ref_key_id(alone[which][at]));
        }
        if (nearer[0] < 100 || nearer[1] < 100)
            harness_fail(h, "key", 0, 0, "%u and %u pixels in which each is before the other", nearer[0], nearer[1]);
    }
}

// Nothing that is not a number, empty or beside the picture may draw or hang.
static void degenerate(struct harness *h)
{
    struct rng rng = {5};
    struct soup s = soup(h, picture_view(61, 43, 1), 64);
    scatter_triangles(&rng, &s, 1.0, 2.0);
    for (uint32_t t = 0; t < 64; t++) {
        float *v = s.vertices + 9 * t;
        switch (t % 8) {
        case 0: v[rng_below(&rng, 9)] = (float)NAN; break;
        case 1: v[rng_below(&rng, 9)] = (float)INFINITY; break;
        case 2: memcpy(v + 3, v, 12); break; // two corners in one
        case 3:
            memcpy(v + 3, v, 12);
            memcpy(v + 6, v, 12);
            break;
        case 4: v[rng_below(&rng, 9)] = 1e30f; break;
        case 5:
            for (int k = 0; k < 3; k++)
                v[6 + k] = 0.5f * (v[k] + v[3 + k]);
            break; // on one line
        case 6:
            for (int k = 0; k < 3; k++)
                v[3 * k + 2] = 50.0f;
            break; // behind the eye
        default:
            for (int k = 0; k < 3; k++)
                v[3 * k + 1] += 1e4f;
            break; // beside the picture
        }
    }
    check(h, &s, NULL, TOL_UNSURE_HARD);
}

// A flat net of triangles covers each centre once: corners on centres, on edges between them, and anywhere.
static void shared_edges(struct harness *h)
{
    enum { CELLS = 5, COUNT = 2 * CELLS * CELLS };
    for (int kind = 0; kind < 3; kind++) {
        struct rng rng = {(uint64_t)kind};
        struct view_args view = picture_view(40, 40, 0);
        struct soup s = soup(h, view, 1);
        double corner[CELLS + 1][CELLS + 1][2];
        uint32_t *times = harness_alloc(h, 1600 * sizeof *times);
        for (int j = 0; j <= CELLS; j++)
            for (int i = 0; i <= CELLS; i++) {
                int inner = i > 0 && j > 0 && i < CELLS && j < CELLS;
                double jitter = kind == 2 && inner ? 2.5 : 0.0;
                corner[j][i][0] = 4.0 + 6.0 * i + (kind == 0 ? 0.5 : 0.25) + rng_range(&rng, -jitter, jitter);
                corner[j][i][1] = 4.0 + 6.0 * j + (kind == 0 ? 0.5 : 0.25) + rng_range(&rng, -jitter, jitter);
            }
        // identity on the screen
        memset(s.args.mesh.row, 0, sizeof s.args.mesh.row);
        s.args.mesh.row[0] = s.args.mesh.row[4] = s.args.mesh.row[8] = 1.0f;
        s.args.mesh.hi[0] = (float)view.origin_x;
        s.args.mesh.hi[1] = (float)view.origin_y;
        for (int t = 0; t < COUNT; t++) {
            int i = t / 2 % CELLS, j = t / 2 / CELLS, flip = (i + j) % 2;
            const double *q[4] = {corner[j][i], corner[j][i + 1], corner[j + 1][i + 1], corner[j + 1][i]};
            int k[3] = {flip, flip + (t % 2 ? 2 : 1), (flip + (t % 2 ? 3 : 2)) % 4};
            for (int v = 0; v < 3; v++) {
                s.vertices[3 * v] = (float)q[k[v] % 4][0];
                s.vertices[3 * v + 1] = (float)q[k[v] % 4][1];
                s.vertices[3 * v + 2] = 0.0f;
            }
            uint64_t *got = run(h, &s, NULL);
            for (int p = 0; p < 1600; p++)
                times[p] += got[p] != REF_EMPTY_KEY;
        }
        for (int p = 0; p < 1600; p++) {
            double x = p % 40 + 0.5, y = p / 40 + 0.5, low = corner[0][0][0], high = corner[CELLS][CELLS][0];
            int on = x == low || y == low || x == high || y == high; // an outer edge: drawn or not
            uint32_t expected = x > low && x < high && y > low && y < high;
            if (on ? times[p] > 1 : times[p] != expected)
                harness_fail(h, "times", p % 40, p / 40, "drawn %u times, expected %u", times[p], expected);
        }
    }
}

// The corner of two triangles lies on the edge of a third: no centre is left out, none drawn on both sides.
static void t_junction(struct harness *h)
{
    struct view_args view = picture_view(40, 40, 0);
    struct soup s = soup(h, view, 1);
    static const float corners[3][3][2] = {{{2.5f, 3.5f}, {34.5f, 19.5f}, {4.5f, 35.5f}},
                                           {{2.5f, 3.5f}, {30.5f, 4.5f}, {18.5f, 11.5f}},
                                           {{18.5f, 11.5f}, {30.5f, 4.5f}, {34.5f, 19.5f}}};
    uint32_t times[1600] = {0};
    memset(s.args.mesh.row, 0, sizeof s.args.mesh.row);
    s.args.mesh.row[0] = s.args.mesh.row[4] = s.args.mesh.row[8] = 1.0f;
    s.args.mesh.hi[0] = (float)view.origin_x;
    s.args.mesh.hi[1] = (float)view.origin_y;
    for (int t = 0; t < 3; t++) {
        for (int v = 0; v < 3; v++) {
            s.vertices[3 * v] = corners[t][v][0];
            s.vertices[3 * v + 1] = corners[t][v][1];
            s.vertices[3 * v + 2] = 1.0f;
        }
        uint64_t *got = run(h, &s, NULL);
        for (int p = 0; p < 1600; p++)
            times[p] += got[p] != REF_EMPTY_KEY;
    }
    for (int p = 0; p < 1600; p++)
        if (times[p] > 1)
            harness_fail(h, "times", p % 40, p / 40, "drawn %u times", times[p]);
    for (int x = 4; x < 34; x++) // along the edge from (2.5, 3.5) to (34.5, 19.5), which has a centre every second column
        HARNESS_CHECK(h, times[(3 + (x - 2) / 2) * 40 + x] == 1);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"triangles of all sizes", sizes, 0},   {"cut by the near plane and far outside", cut, 0},
        {"behind a layer", behind, 0},          {"one mesh after another", one_after_another, 0},
        {"nothing to see", degenerate, 0},      {"shared edges are drawn once", shared_edges, 0},
        {"a corner on an edge", t_junction, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
