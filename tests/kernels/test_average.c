// SPDX-License-Identifier: GPL-3.0-or-later
// average: means over the points about each pixel's surface, over keys that scatter made and holes that were filled.
#include "points.h"
#include "shared/means.h"
#include "shared/measured.h"
#include "shared/points.h"

#include <math.h>
#include <string.h>

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 500, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0] };
enum { UNTOUCHED = -77 };

struct setup {
    struct scene scene;
    struct average_args args; // of the cloud that is averaged, the scene's first
    void *colors;
    size_t color_bytes;
};

static struct setup look_at(struct harness *h, struct rng *rng, uint32_t width, uint32_t height, int perspective, double focal,
                            const uint32_t *counts, uint32_t chunks, uint32_t format, int normals)
{
    struct setup s = {.scene = {.view = points_window(width, height, perspective, focal)}};
    const struct camera camera = points_look(rng, &s.scene.view, focal, 4.0);
    struct cloud *cloud = points_add_cloud(h, rng, &s.scene, &camera, counts, chunks, normals, 7000);
    struct instance_args *instance = &s.args.instance;
    s.args.view = s.scene.view;
    s.args.normals = (uint32_t)normals;
    *instance = (struct instance_args){.id_base = 7000,
                                       .id_count = cloud->slots,
                                       .slots = cloud->slots,
                                       .has_normals = 1,
                                       .color_format = format,
                                       .opacity = 1.0f,
                                       .color = {0.2f, 0.7f, 3.0f},
                                       .axis_scale = 1.0f,
                                       .d_min = 0.02f};
    for (int k = 0; k < 9; k++)
        instance->normal_matrix[k] = (float)camera.rotation[k];
    for (uint32_t k = 0; k < PT_SPACINGS; k++) // from below a pixel to above the widest
        instance->spacing[k] = (float)(0.3 * pow(2.0, k / 12.0) / focal * (perspective ? 4.0 : 1.0));
    points_scatter_about(rng, cloud, 1.0);
    s.color_bytes = (size_t)cloud->slots * (format == 2 ? 12 : 3) + 4;
    s.colors = harness_alloc(h, s.color_bytes);
    for (size_t i = 0; i < 3 * (size_t)cloud->slots; i++)
        if (format == 2)
            ((float *)s.colors)[i] = (float)(rng_below(rng, 50) ? rng_range(rng, -0.5, 1.5) : 60000.0);
        else
            ((uint8_t *)s.colors)[i] = (uint8_t)rng_next(rng);
    return s;
}

struct planes {
    uint64_t *keys;
    uint32_t *from;
    float *normal, *deff, *albedo, *before;
};

// Half of the empty pixels beside measured ones take over their surfaces.
static void invent(struct rng *rng, const struct view_args *view, struct planes *planes)
{
    const int width = (int)view->width, height = (int)view->height;
    uint64_t *keys = planes->keys;
    for (int i = 0; i < width * height; i++) {
        const int x = i % width + (int)rng_below(rng, 5) - 2, y = i / width + (int)rng_below(rng, 5) - 2, q = y * width + x;
        if (keys[i] != REF_EMPTY_KEY || rng_below(rng, 2) || x < 0 || y < 0 || x >= width || y >= height ||
            keys[q] == REF_EMPTY_KEY)
            continue;
        keys[i] = keys[q];
        planes->from[i] = planes->from[q];
    }
}

static struct ref_look look_of(const struct setup *s, uint32_t at)
{
    struct ref_look look = {.opacity = 1.0};
    for (uint32_t k = 0; k < 3; k++)
        look.color[k] = s->args.instance.color_format == 0   ? (double)s->args.instance.color[k]
                        : s->args.instance.color_format == 1 ? ref_srgb(((const uint8_t *)s->colors)[3 * at + k])
                                                             : (double)((const float *)s->colors)[3 * at + k];
    return look;
}

static void hold_against(struct harness *h, const struct setup *s, const struct planes *planes, double open)
{
    const struct cloud *cloud = &s->scene.clouds[0];
    const uint32_t width = s->scene.view.width;
    struct ref_tent *tents = harness_alloc(h, cloud->slots * sizeof *tents);
    struct ref_look *looks = harness_alloc(h, cloud->slots * sizeof *looks);
    uint32_t count = 0;
    size_t unsure = 0, shown = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++, count++) {
            tents[count] = ref_tent(&s->args, &cloud->chunks[c], cloud->positions, cloud->surfels, i);
            looks[count] = look_of(s, cloud->chunks[c].first + i);
        }
    for (size_t p = 0; p < (size_t)width * s->scene.view.height; p++) {
        const int x = (int)(p % width), y = (int)(p / width);
        const float *got = planes->albedo + 4 * p, *n = planes->normal + 4 * p, *before = planes->before + 4 * p;
        if (planes->keys[p] == REF_EMPTY_KEY || ref_key_id(planes->keys[p]) - 7000 >= cloud->slots) {
            if (got[0] != UNTOUCHED || memcmp(n, before, 16))
                harness_fail(h, "untouched", x, y, "was written");
            continue;
        }
        uint32_t nearest = 0;
        while (nearest < count && tents[nearest].id != ref_key_id(planes->keys[p]))
            nearest++;
        const struct ref_average expected = ref_average(&s->args, tents, looks, count, nearest,
                                                        (float)ref_key_z(planes->keys[p]), planes->deff[planes->from[p]],
                                                        before, planes->from[p] == p, x, y);
        shown++;
        unsure += expected.unsure != 0;
        if (got[3] != 1.0f || n[3] != before[3])
            harness_fail(h, "albedo", x, y, "opacity %.9g, 1 / cosine %.9g, which was %.9g", got[3], n[3], before[3]);
        if (!s->args.normals && memcmp(n, before, 16))
            harness_fail(h, "normal", x, y, "was written");
        if (expected.unsure)
            continue;
        for (int k = 0; k < 3; k++)
            if (!harness_near(got[k], expected.color[k], expected.color_error[k]))
                harness_fail(h, "albedo", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", k, got[k], expected.color[k],
                             expected.color_error[k]);
        const double n_of[3] = {expected.n.x, expected.n.y, expected.n.z};
        for (int k = 0; k < 3; k++)
            if (!harness_near(n[k], n_of[k], expected.normal_error))
                harness_fail(h, "normal", x, y, "axis %d: got %.9g, expected %.9g +- %.2g", k, n[k], n_of[k],
                             expected.normal_error);
    }
    harness_note(h, "%zu pixels, %zu open", shown, unsure);
    HARNESS_CHECK(h, shown > 0);
    harness_unsure(h, unsure, shown, open);
}

static struct planes run(struct harness *h, struct rng *rng, struct setup *s, double open)
{
    struct scene *scene = &s->scene;
    struct cloud *cloud = &scene->clouds[0];
    const size_t pixels = (size_t)scene->view.width * scene->view.height;
    struct planes planes;
    uint64_t *empty = harness_alloc(h, pixels * 8);
    float *unset = harness_alloc(h, pixels * 16);
    for (size_t i = 0; i < pixels; i++)
        empty[i] = REF_EMPTY_KEY;
    for (size_t i = 0; i < 4 * pixels; i++)
        unset[i] = UNTOUCHED;
    points_pad(cloud);
    struct pt_buffer *keys = harness_buffer(h, empty, pixels * 8), *albedo = harness_buffer(h, unset, pixels * 16);
    struct pt_buffer *normal = harness_buffer(h, harness_alloc(h, pixels * 16), pixels * 16);
    struct pt_buffer *deff = harness_buffer(h, harness_alloc(h, pixels * 4), pixels * 4);
    struct pt_buffer *from = harness_buffer(h, harness_alloc(h, pixels * 4), pixels * 4);
    struct pt_buffer *chunks = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
    struct pt_buffer *positions = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
    struct pt_buffer *surfels = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
    struct pt_buffer *colors = harness_buffer(h, s->colors, s->color_bytes);
    struct pt_buffer *drawn = harness_buffer(h, scene->drawn, 4 * (size_t)scene->words);
    const struct scatter_args scatter = {.view = scene->view, .instances = 1, .sifted = s->args.sifted};
    struct pt_buffer *const scattered[] = {keys, NULL, s->args.sifted ? drawn : NULL, chunks, positions, surfels};
    harness_run(h, PT_KERNEL_scatter, &scatter, sizeof scatter, scattered, 6);
    const struct resolve_args of_pixels = {.view = scene->view, .instance = s->args.instance};
    HARNESS_RUN(h, resolve, &of_pixels, keys, surfels, normal, deff, from, NULL, NULL);
    planes.keys = harness_read(h, keys);
    planes.from = harness_read(h, from);
    planes.deff = harness_read(h, deff);
    planes.before = harness_read(h, normal);
    invent(rng, &scene->view, &planes);
    keys = harness_buffer(h, planes.keys, pixels * 8);
    from = harness_buffer(h, planes.from, pixels * 4);
    struct pt_buffer *const buffers[] = {keys,   from,      deff,    normal, albedo,
                                         chunks, positions, surfels, colors, s->args.sifted ? drawn : NULL};
    harness_run(h, PT_KERNEL_average, &s->args, sizeof s->args, buffers, 10);
    planes.normal = harness_read(h, normal);
    planes.albedo = harness_read(h, albedo);
    harness_same(h, "albedo", planes.albedo, pixels * 4, 4, 4, scene->view.width);
    harness_same(h, "normal", planes.normal, pixels * 4, 4, 4, scene->view.width);
    // what the reference takes of the device: of measured pixels, elsewhere it is undefined
    float *before = harness_alloc(h, pixels * 16), *distance = harness_alloc(h, pixels * 4);
    for (size_t p = 0; p < pixels; p++)
        if (planes.keys[p] != REF_EMPTY_KEY && planes.from[p] == p) {
            memcpy(before + 4 * p, planes.before + 4 * p, 16);
            distance[p] = planes.deff[p];
        }
    harness_same(h, "keys", planes.keys, pixels, 8, 1, scene->view.width);
    harness_same(h, "deff", distance, pixels, 4, 1, scene->view.width);
    harness_same(h, "normal before", before, pixels * 4, 4, 4, scene->view.width);
    if (!s->args.sifted && !harness_settled(h))
        hold_against(h, s, &planes, open);
    return planes;
}

static void random_clouds(struct harness *h, int perspective)
{
    for (uint32_t format = 0; format < 3; format++)
        for (int normals = 0; normals < 2; normals++) {
            struct rng rng = {31 + format + 3 * (uint32_t)normals};
            struct setup s = look_at(h, &rng, 67, 45, perspective, perspective ? 60.0 : 20.0, sizes, SIZES, format, normals);
            run(h, &rng, &s, TOL_UNSURE_SHARE);
        }
}

static void perspective(struct harness *h) { random_clouds(h, 1); }
static void orthographic(struct harness *h) { random_clouds(h, 0); }

// A plane across the view, of one colour, many points a pixel: that colour and that normal, whatever it is cut into.
static void sheet(struct harness *h)
{
    static const uint32_t many[] = {4000, 4000, 4000};
    struct rng rng = {6};
    struct setup s = look_at(h, &rng, 67, 45, 0, 20.0, many, 3, 1, 1);
    struct cloud *cloud = &s.scene.clouds[0];
    for (uint32_t c = 0; c < 3; c++)
        for (int k = 0; k < 9; k++)
            cloud->chunks[c].row[k] = k % 4 ? 0.0f : k == 8 ? -1.0f : 20.0f;
    for (uint32_t c = 0; c < 3; c++)
        for (uint32_t i = 0; i < many[c]; i++)
            *points_coordinate(cloud, c, i, 2) = 0.0f;
    for (int k = 0; k < 9; k++)
        s.args.instance.normal_matrix[k] = k % 4 ? 0.0f : 1.0f;
    for (uint32_t i = 0; i < cloud->slots; i++)
        cloud->surfels[i] = 4095u | 4095u << 13;
    for (uint32_t c = 0; c < 3; c++)
        cloud->chunks[c].cull = 0;
    memset(s.colors, 128, s.color_bytes);
    const struct planes planes = run(h, &rng, &s, TOL_UNSURE_SHARE);
    for (size_t p = 0; p < (size_t)67 * 45; p++) {
        if (planes.keys[p] == REF_EMPTY_KEY || planes.from[p] != p)
            continue;
        if (!harness_near(planes.albedo[4 * p], ref_srgb(128), 3e-5))
            harness_fail(h, "albedo", (int)(p % 67), (int)(p / 67), "got %.9g", planes.albedo[4 * p]);
        HARNESS_CHECK(h, harness_near(planes.normal[4 * p + 2], 1.0, 1e-6));
    }
}

// So many bright points in a few pixels that sums pass 32 bits, and ends of them below 0.
static void overflow(struct harness *h)
{
    static const uint32_t many[] = {4096, 4096, 4096, 100};
    struct rng rng = {7};
    struct setup s = look_at(h, &rng, 9, 7, 1, 2.0, many, 4, 2, 0);
    struct cloud *cloud = &s.scene.clouds[0];
    s.args.instance.d_min = 10.0f;
    for (uint32_t i = 0; i < cloud->slots; i++) {
        float *rgb = (float *)s.colors + 3 * (size_t)i;
        rgb[0] = 4000.0f;
        rgb[1] = i % 2 ? -3000.0f : 1000.0f;
        rgb[2] = 1e-3f;
    }
    const struct planes planes = run(h, &rng, &s, TOL_UNSURE_HARD);
    size_t shown = 0;
    for (size_t p = 0; p < 63; p++) {
        if (planes.keys[p] == REF_EMPTY_KEY || planes.from[p] != p)
            continue;
        const float *got = planes.albedo + 4 * p;
        shown++;
        HARNESS_CHECK(h, harness_near(got[0], 4000.0, 0.1) && got[1] >= -3000.5f && got[1] <= 1000.5f &&
                             harness_near(got[2], 1e-3, 1e-5));
    }
    HARNESS_CHECK(h, shown > 0);
}

// What is sifted out adds nothing: every other slot, all of which are red.
static void sifted(struct harness *h)
{
    static const uint32_t many[] = {4000, 333};
    struct rng rng = {8};
    struct setup s = look_at(h, &rng, 67, 45, 1, 60.0, many, 2, 1, 1);
    struct cloud *cloud = &s.scene.clouds[0];
    s.args.sifted = 1;
    s.scene.words = cloud->slots / PT_SLOTS_A_WORD + 1;
    s.scene.drawn = harness_alloc(h, 4 * (size_t)s.scene.words);
    for (uint32_t i = 0; i < s.scene.words; i++)
        s.scene.drawn[i] = 0x5555u;
    for (uint32_t c = 0; c < 2; c++)
        cloud->chunks[c].sifted = 1 + cloud->chunks[c].first / PT_SLOTS_A_WORD;
    for (uint32_t i = 0; i < cloud->slots; i++) {
        uint8_t *rgb = (uint8_t *)s.colors + 3 * (size_t)i;
        rgb[0] = i % 2 ? 255 : 0;
        rgb[1] = i % 2 ? 0 : 255;
        rgb[2] = 0;
    }
    const struct planes planes = run(h, &rng, &s, 1.0);
    size_t shown = 0;
    for (size_t p = 0; p < (size_t)67 * 45; p++)
        if (planes.keys[p] != REF_EMPTY_KEY) {
            shown++;
            HARNESS_CHECK(h, planes.albedo[4 * p] == 0.0f && harness_near(planes.albedo[4 * p + 1], 1.0, 1e-5));
        }
    HARNESS_CHECK(h, shown > 100);
}

static void plane_sizes(struct harness *h)
{
    static const uint32_t shapes[][2] = {{1, 1}, {16384, 1}, {1, 333}};
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        struct rng rng = {8};
        struct setup s = look_at(h, &rng, shapes[i][0], shapes[i][1], 1, 60.0, sizes, SIZES, 1, 1);
        for (uint32_t c = 0; c < s.scene.clouds[0].chunk_count; c++) // all about the middle: some point falls into every plane
            for (uint32_t k = 0; k < s.scene.clouds[0].chunks[c].count; k++)
                for (int axis = 0; axis < 3; axis++)
                    *points_coordinate(&s.scene.clouds[0], c, k, axis) *= 0.05f;
        for (uint32_t c = 0; c < s.scene.clouds[0].chunk_count; c++)
            s.scene.clouds[0].chunks[c].cull = 0;
        run(h, &rng, &s, TOL_UNSURE_HARD);
    }
}

// Reference alone: two points in one pixel, at its middle and half a pixel off.
static void sanity(struct harness *h)
{
    const struct average_args args = {.view = {.width = 8, .height = 8, .ray_xs = 0.1f, .ray_ys = 0.1f, .footprint = 0.1f}};
    struct ref_tent tents[2] = {{.possible = 1, .definite = 1, .half = 1.0, .place = {1, {4.5, 4.5}, {4.5, 4.5}, {2.0, 2.0}}}};
    tents[1] = tents[0];
    tents[1].place.x = (struct ref_range){5.0, 5.0};
    const struct ref_look looks[2] = {{{1.0, 0.0, 0.0}, 1.0}, {{0.0, 1.0, 0.0}, 1.0}};
    const float n[3] = {0.0f, 0.0f, 1.0f};
    const struct ref_average both = ref_average(&args, tents, looks, 2, 0, 2.0f, 0.5f, n, 1, 4, 4);
    HARNESS_CHECK(h,
                  !both.unsure && harness_near(both.color[0], 2.0 / 3.0, 1e-9) && harness_near(both.color[1], 1.0 / 3.0, 1e-9));
    tents[1].place.z = (struct ref_range){2.6, 2.6};
    HARNESS_CHECK(h, ref_average(&args, tents, looks, 2, 0, 2.0f, 0.5f, n, 1, 4, 4).color[0] == 1.0);
}

static void packed(struct harness *h)
{
    points_packed(h, perspective);
    points_packed(h, orthographic);
    points_packed(h, sifted);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
        {"random points, perspective", perspective, 0},
        {"random points, orthographic", orthographic, 0},
        {"a sheet of one colour", sheet, 0},
        {"sums beyond 32 bits", overflow, 0},
        {"what is sifted out", sifted, 0},
        {"plane sizes", plane_sizes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
