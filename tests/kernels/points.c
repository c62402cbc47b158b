// SPDX-License-Identifier: GPL-3.0-or-later
#include "points.h"
#include "shared/packed.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

static void random_rotation(struct rng *rng, double m[9])
{
    float a[3], b[3];
    rng_direction(rng, a);
    rng_direction(rng, b);
    struct ref_vec x = ref_unit(ref_vec_of(a)), y = ref_vec_of(b);
    y = ref_unit(ref_add(y, ref_scale(x, -ref_dot(x, y))));
    struct ref_vec z = {x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x};
    double rows[9] = {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
    memcpy(m, rows, sizeof rows);
}

static void set_chunk(struct chunk_view *chunk, const struct view_args *view, const struct camera *camera)
{
    const double *r = camera->rotation, *t = camera->shift;
    double shift[3];
    for (int i = 0; i < 3; i++) {
        double z = -r[6 + i];
        chunk->row[i] = (float)(camera->focal * r[i] + (view->perspective ? camera->center_x * z : 0.0));
        chunk->row[3 + i] = (float)(camera->focal * r[3 + i] + (view->perspective ? camera->center_y * z : 0.0));
        chunk->row[6 + i] = (float)z;
    }
    shift[0] = camera->focal * t[0] + (view->perspective ? camera->center_x * -t[2] : camera->center_x);
    shift[1] = camera->focal * t[1] + (view->perspective ? camera->center_y * -t[2] : camera->center_y);
    shift[2] = -t[2] - (view->perspective ? 0.0 : camera->near_clip);
    for (int i = 0; i < 3; i++) {
        chunk->hi[i] = (float)shift[i];
        chunk->lo[i] = (float)(shift[i] - chunk->hi[i]);
        double eye = 0.0; // rotation^T (eye_view - shift)
        for (int k = 0; k < 3; k++)
            eye += r[3 * k + i] * (view->perspective ? -t[k] : k == 2 ? 1.0 : 0.0);
        chunk->eye[i] = (float)eye;
    }
    chunk->eye[3] = view->perspective ? 1.0f : 0.0f;
}

struct cloud *points_add_cloud(struct harness *h, struct rng *rng, struct scene *scene, const struct camera *camera,
                               const uint32_t *sizes, uint32_t count, int cull, uint32_t id_base)
{
    struct cloud *cloud = &scene->clouds[scene->count++];
    cloud->chunk_count = count;
    cloud->chunks = harness_alloc(h, count * sizeof *cloud->chunks);
    for (uint32_t c = 0; c < count; c++) {
        struct chunk_view *chunk = &cloud->chunks[c];
        set_chunk(chunk, &scene->view, camera);
        chunk->first = cloud->slots;
        chunk->count = sizes[c];
        chunk->padded = (sizes[c] + POINTS_LANES - 1) / POINTS_LANES * POINTS_LANES;
        chunk->cull = cull ? 1 : 0;
        chunk->id_base = id_base;
        cloud->slots += chunk->padded;
    }
    cloud->positions = harness_alloc(h, 12 * (size_t)cloud->slots);
    cloud->surfels = harness_alloc(h, 4 * (size_t)cloud->slots);
    for (uint32_t i = 0; i < cloud->slots; i++)
        cloud->surfels[i] = rng_below(rng, 8) ? (uint32_t)rng_next(rng) : PT_NORMAL_NONE;
    return cloud;
}

float *points_coordinate(struct cloud *cloud, uint32_t chunk, uint32_t slot, int axis)
{
    const struct chunk_view *view = &cloud->chunks[chunk];
    return cloud->positions + 3 * (size_t)view->first + (size_t)axis * view->padded + slot;
}

void points_scatter_about(struct rng *rng, struct cloud *cloud, double size)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++)
            for (int axis = 0; axis < 3; axis++)
                *points_coordinate(cloud, c, i, axis) = (float)rng_range(rng, -size, size);
}

void points_pad(struct cloud *cloud)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct chunk_view *chunk = &cloud->chunks[c];
        for (uint32_t i = chunk->count; i < chunk->padded; i++) {
            for (int axis = 0; axis < 3; axis++)
                *points_coordinate(cloud, c, i, axis) = *points_coordinate(cloud, c, chunk->count - 1, axis);
            cloud->surfels[chunk->first + i] = cloud->surfels[chunk->first + chunk->count - 1];
        }
    }
    points_settle(cloud->chunks, cloud->chunk_count, cloud->positions);
}

static int packing;

void points_packed(struct harness *h, void (*run)(struct harness *h))
{
    packing = 1;
    run(h);
    packing = 0;
}

void points_settle(struct chunk_view *chunks, uint32_t count, float *positions)
{
    for (uint32_t c = 0; c < count && packing; c++) {
        float *own = positions + 3 * (size_t)chunks[c].first, most = 0.0f;
        const uint32_t all = 3 * chunks[c].padded;
        for (uint32_t i = 0; i < all; i++)
            most = fmaxf(most, fabsf(own[i]));
        if (!(chunks[c].step > 0.0f)) // else they are rounded
            chunks[c].step = exp2f(ceilf(log2f(most / (float)(PT_PACKED_MIDDLE - 1) + 1e-30f)));
        for (uint32_t i = 0; i < all; i++)
            own[i] = ((float)pt_packed_part(own[i], chunks[c].step) - (float)PT_PACKED_MIDDLE) * chunks[c].step;
    }
}

struct pt_buffer *points_positions(struct harness *h, const struct chunk_view *chunks, uint32_t count, const float *positions,
                                   uint32_t slots)
{
    if (!count || !(chunks[0].step > 0.0f))
        return harness_buffer(h, positions, 4 * PT_POSITION_WORDS * (size_t)slots);
    uint32_t *words = harness_alloc(h, 4 * PT_PACKED_WORDS * (size_t)slots);
    for (uint32_t c = 0; c < count; c++)
        for (uint32_t i = 0, padded = chunks[c].padded; i < padded; i++) {
            const float *own = positions + 3 * (size_t)chunks[c].first + i;
            const float p[3] = {own[0], own[padded], own[2 * (size_t)padded]};
            uint32_t pair[2], *to = words + 2 * (size_t)chunks[c].first + i;
            float again[3];
            pt_packed_words(p, chunks[c].step, pair);
            pt_packed_point(pair[0], pair[1], chunks[c].step, again);
            HARNESS_CHECK(h, !memcmp(p, again, sizeof p) || (p[0] == again[0] && p[1] == again[1] && p[2] == again[2]));
            to[0] = pair[0];
            to[padded] = pair[1];
        }
    struct pt_buffer *buffer = harness_buffer(h, words, 4 * PT_PACKED_WORDS * (size_t)slots);
    buffer->each = 4 * PT_PACKED_WORDS;
    return buffer;
}

struct view_args points_window(uint32_t width, uint32_t height, int perspective, double focal)
{
    struct view_args view = picture_view(width, height, perspective);
    view.origin_x = 16;
    view.origin_y = 8;
    view.ray_xs = view.ray_ys = view.footprint = (float)(1.0 / focal);
    return view;
}

struct camera points_look(struct rng *rng, const struct view_args *view, double focal, double distance)
{
    struct camera camera = {.focal = focal, .near_clip = view->perspective ? 0.0 : -100.0};
    random_rotation(rng, camera.rotation);
    camera.shift[0] = rng_range(rng, -0.1, 0.1);
    camera.shift[1] = rng_range(rng, -0.1, 0.1);
    camera.shift[2] = -distance;
    camera.center_x = view->origin_x + view->width * 0.5;
    camera.center_y = view->origin_y + view->height * 0.5;
    return camera;
}
