// SPDX-License-Identifier: GPL-3.0-or-later
// Random pictures for the filters' tests.
#include "harness.h"
#include "shared/filling.h"

#include <math.h>
#include <string.h>

const char *const picture_kind_names[PICTURE_KINDS] = {"surfaces", "noise", "flat", "tight", "grazing", "range"};

uint64_t rng_next(struct rng *rng) // splitmix64
{
    uint64_t z = rng->state += 0x9E3779B97F4A7C15ull;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ z >> 27) * 0x94D049BB133111EBull;
    return z ^ z >> 31;
}

double rng_unit(struct rng *rng) { return (double)(rng_next(rng) >> 11) * 0x1p-53; }

double rng_range(struct rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_unit(rng); }

uint32_t rng_below(struct rng *rng, uint32_t n) { return (uint32_t)(rng_unit(rng) * n); }

void rng_direction(struct rng *rng, float out[3])
{
    double z = rng_range(rng, -1.0, 1.0), angle = rng_range(rng, 0.0, 6.283185307179586), r = sqrt(1.0 - z * z);
    out[0] = (float)(r * cos(angle));
    out[1] = (float)(r * sin(angle));
    out[2] = (float)z;
}

float float_step(float value, int ulps)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    bits += (uint32_t)ulps;
    memcpy(&value, &bits, 4);
    return value;
}

struct view_args picture_view(uint32_t width, uint32_t height, int perspective)
{
    struct view_args view = {.width = width, .height = height, .origin_x = 16, .origin_y = 8};
    double full_width = width + 40.0, full_height = height + 24.0; // the window lies in a larger picture
    if (!perspective) {                                            // a guard band left of and below the picture
        view.origin_x = -16;
        view.origin_y = -8;
    }
    double step = (perspective ? 0.9 : 6.0) / fmax(full_width, full_height);
    view.perspective = perspective ? 1 : 0;
    view.z_near = perspective ? 0.1f : 0.0f;
    view.z_far = 1000.0f;
    view.ray_xs = view.ray_ys = view.footprint = (float)step;
    view.ray_x0 = (float)(-0.5 * full_width * step);
    view.ray_y0 = (float)(-0.5 * full_height * step);
    view.rect[2] = width;
    view.rect[3] = height;
    return view;
}

struct point {
    double z;
    float n[3];
    double loose; // d_eff is this many times its least
};

// The wall at depth 6, tilted; before it a ball.
static struct point surfaces(struct rng *rng, const struct view_args *view, struct ref_ray ray)
{
    struct ref_vec wall = ref_unit(ref_vec(0.4, -0.3, 1.0)), n = wall;
    double z, radius = 0.9, at = 4.0;
    if (view->perspective) {
        z = ref_dot(wall, ref_vec(0.0, 0.0, -6.0)) / ref_dot(wall, ref_vec(ray.u, ray.v, -1.0));
        double a = ray.u * ray.u + ray.v * ray.v + 1.0, b = at / a, c = (at * at - radius * radius) / a;
        if (b * b - c > 0.0 && rng_unit(rng) < 0.7) {
            z = b - sqrt(b * b - c);
            n = ref_unit(ref_vec(ray.u * z, ray.v * z, at - z));
        }
    } else {
        z = 6.0 + (wall.x * ray.u + wall.y * ray.v) / wall.z;
        double square = radius * radius - ray.u * ray.u - ray.v * ray.v;
        if (square > 0.0 && rng_unit(rng) < 0.7) {
            z = at - sqrt(square);
            n = ref_unit(ref_vec(ray.u, ray.v, sqrt(square)));
        }
    }
    struct point point = {z + rng_range(rng, -1e-3, 1e-3), {(float)n.x, (float)n.y, (float)n.z}, 1.5};
    return point;
}

static struct point make(struct rng *rng, const struct view_args *view, enum picture_kind kind, struct ref_ray ray)
{
    struct point point = {5.0, {0.0f, 0.0f, 1.0f}, 1.0};
    double lean;
    switch (kind) {
    case PICTURE_SURFACES: return surfaces(rng, view, ray);
    case PICTURE_NOISE:
        point.z = 2.0 + rng_below(rng, 3) * 0.5 + rng_range(rng, 0.0, 0.05);
        point.loose = exp(rng_range(rng, 0.0, 4.0));
        rng_direction(rng, point.n);
        break;
    case PICTURE_GRAZING:
        point.z = rng_range(rng, 4.0, 4.2);
        lean = rng_range(rng, -1.0, 1.0) * pow(10.0, -8.0 * rng_unit(rng));
        point.n[0] = (float)(1.0 / sqrt(1.0 + lean * lean));
        point.n[2] = (float)(lean / sqrt(1.0 + lean * lean));
        break;
    case PICTURE_RANGE:
        point.z = view->z_near * pow(10.0, rng_range(rng, 0.0, 7.0));
        rng_direction(rng, point.n);
        break;
    default: break;
    }
    return point;
}

struct picture picture_random(struct harness *h, struct rng *rng, struct view_args view, enum picture_kind kind, double density)
{
    size_t count = (size_t)view.width * view.height;
    struct picture out = {.view = view, .kind = kind, .count = count, .id_base = (uint32_t)(0xFFFFFFFEu - count)};
    if (kind == PICTURE_RANGE) {
        out.view.z_near = 1e-3f;
        out.view.z_far = 1e4f;
    }
    out.keys = harness_alloc(h, count * 8);
    out.from = harness_alloc(h, count * 4);
    out.normal = harness_alloc(h, count * 16);
    out.deff = harness_alloc(h, count * 4);
    out.span = harness_alloc(h, count * 4);
    out.color = harness_alloc(h, count * 16);
    uint32_t *ids = harness_alloc(h, count * 4); // each id once, in disorder
    for (size_t i = 0; i < count; i++) {
        size_t j = rng_below(rng, (uint32_t)i + 1);
        ids[i] = ids[j];
        ids[j] = (uint32_t)i;
    }
    for (size_t i = 0; i < count; i++) {
        out.keys[i] = REF_EMPTY_KEY;
        out.from[i] = 0xFFFFFFF0u; // undefined there: nobody may follow it
        if (rng_unit(rng) >= density)
            continue;
        struct ref_ray ray = ref_ray(&out.view, (int)(i % view.width), (int)(i / view.width));
        struct point point = make(rng, &out.view, kind, ray);
        double cosine = fabs(ref_dot(ref_vec_of(point.n), ref_viewer(&out.view, ray)));
        float inverse = (float)(1.0 / fmax(cosine, (double)PT_COSINE_FLOOR)), z = (float)point.z;
        out.deff[i] = (float)(ref_layer_minimum(&out.view, 0.0, 0.0, z) * point.loose * inverse);
        if (kind == PICTURE_TIGHT) {
            out.deff[i] = 0.25f;
            z = rng_below(rng, 2) ? 5.0f : float_step(5.25f, (int)rng_below(rng, 17) - 8);
        }
        out.span[i] = out.deff[i] * (1.0f + 0.5f * (float)(i % 3));
        out.keys[i] = ref_key(z, out.id_base + ids[i]);
        out.from[i] = (uint32_t)i;
        memcpy(out.normal + 4 * i, point.n, 12);
        out.normal[4 * i + 3] = inverse;
        for (size_t c = 0; c < 3; c++)
            out.color[4 * i + c] = (float)rng_range(rng, 0.0, 2.0);
        out.color[4 * i + 3] = 1.0f;
    }
    return out;
}

void picture_slots(struct instance_args *instance, size_t slots)
{
    instance->slots = (uint32_t)slots;
    instance->id_first = (uint32_t)slots / 16;
    instance->id_count = instance->slots - instance->id_first;
}

void picture_invent(struct picture *picture, struct rng *rng, double share, int reach)
{
    int width = (int)picture->view.width, height = (int)picture->view.height;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            size_t pixel = (size_t)(y * width + x);
            int dx = (int)rng_below(rng, (uint32_t)(2 * reach + 1)) - reach;
            int dy = (int)rng_below(rng, (uint32_t)(2 * reach + 1)) - reach;
            double coin = rng_unit(rng), step = rng_range(rng, 0.0, 0.5);
            if (picture->keys[pixel] != REF_EMPTY_KEY || coin >= share || x + dx < 0 || x + dx >= width || y + dy < 0 ||
                y + dy >= height)
                continue;
            size_t source = (size_t)((y + dy) * width + x + dx);
            if (picture->keys[source] == REF_EMPTY_KEY || picture->from[source] != source)
                continue;
            float z = (float)(ref_key_z(picture->keys[source]) + step * picture->deff[source]);
            picture->keys[pixel] = ref_key(z, ref_key_id(picture->keys[source]));
            picture->from[pixel] = (uint32_t)source;
            for (size_t c = 0; c < 3; c++)
                picture->color[4 * pixel + c] = (float)rng_range(rng, 0.0, 2.0);
            picture->color[4 * pixel + 3] = 1.0f;
        }
    }
}

void picture_pull(struct harness *h, struct view_args *view, uint64_t **keys, uint32_t **from)
{
    struct pull_args args = {.view = *view, .fine_width = view->width, .fine_height = view->height};
    args.view.width = (view->width + 1) / 2;
    args.view.height = (view->height + 1) / 2;
    args.view.level++;
    args.view.rect[0] = args.view.rect[1] = 0;
    args.view.rect[2] = args.view.width;
    args.view.rect[3] = args.view.height;
    size_t count = (size_t)args.view.width * args.view.height;
    uint64_t *coarse_keys = harness_alloc(h, count * 8);
    uint32_t *coarse_from = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++)
        ref_pull(&args, *keys, *from, (int)(i % args.view.width), (int)(i / args.view.width), &coarse_keys[i], &coarse_from[i]);
    *keys = coarse_keys;
    *from = coarse_from;
    *view = args.view;
}

struct ref_planes picture_planes(const struct picture *picture)
{
    struct ref_planes planes = {
        .keys = picture->keys,
        .from = picture->from,
        .normal = picture->normal,
        .deff = picture->deff,
        .span = picture->span,
        .color = picture->color,
    };
    return planes;
}
