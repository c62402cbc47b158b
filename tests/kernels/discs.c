// SPDX-License-Identifier: GPL-3.0-or-later
#include "discs.h"
#include "shared/points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void discs_describe(struct harness *h, struct rng *rng, struct disc_scene *scene, uint32_t instance,
                    const struct camera *camera, float radius, double largest, int has_normals)
{
    const struct cloud *cloud = &scene->points.clouds[instance];
    struct disc_args *discs = &scene->discs[instance];
    *discs = (struct disc_args){.instance = {.id_base = cloud->chunks[0].id_base,
                                             .id_count = cloud->slots,
                                             .slots = cloud->slots,
                                             .has_normals = has_normals != 0,
                                             .opacity = 1.0f},
                                .has_radii = radius == 0.0f,
                                .radius = radius,
                                .radius_scale = 1.0f,
                                .surface_scale = 1.0f};
    for (int k = 0; k < 9; k++)
        discs->instance.normal_matrix[k] = (float)camera->rotation[k];
    for (int k = 0; k < PT_SPACINGS; k++)
        discs->instance.spacing[k] = (float)(largest * k / PT_SPACINGS);
    discs->instance.axis_scale = 1.0f;
    float *radii = harness_alloc(h, 4 * (size_t)cloud->slots);
    scene->radii[instance] = radii;
    for (uint32_t i = 0; i < cloud->slots; i++)
        radii[i] = rng_below(rng, 8) ? (float)rng_range(rng, 0.0, largest) : 0.0f;
}

void discs_shape(struct harness *h, struct rng *rng, struct disc_scene *scene, uint32_t instance, const struct camera *camera,
                 const double stretch[3])
{
    static const double as_it_is[3] = {1.0, 1.0, 1.0};
    struct disc_args *discs = &scene->discs[instance];
    const struct cloud *cloud = &scene->points.clouds[instance];
    const double *by = stretch ? stretch : as_it_is;
    double most = 0.0, largest = 0.0; // stretch, of the inverse transposed
    for (int k = 0; k < 3; k++)
        most = by[k] > most ? by[k] : most;
    double inverse[9];
    for (int k = 0; k < 9; k++) {
        inverse[k] = camera->rotation[k] / by[k % 3];
        largest = inverse[k] > largest ? inverse[k] : -inverse[k] > largest ? -inverse[k] : largest;
    }
    for (int k = 0; k < 9; k++)
        discs->instance.normal_matrix[k] = (float)(inverse[k] / largest);
    discs->instance.axis_scale = (float)(largest * most);
    discs->has_radii = PT_RADII_SHAPES;
    discs->radius = 0.0f;
    uint32_t *words = harness_alloc(h, 4 * (size_t)cloud->slots);
    scene->radii[instance] = words;
    for (uint32_t i = 0; i < cloud->slots; i++) // ratios up to 4 are the most
        words[i] = ((uint32_t)rng_next(rng) & ~(15u << PT_SHAPE_RATIO_SHIFT)) | rng_below(rng, i % 4 ? 9 : 16)
                                                                                    << PT_SHAPE_RATIO_SHIFT;
}

struct view_args discs_window(uint32_t width, uint32_t height, int perspective, double focal)
{
    struct view_args view = points_window(width, height, perspective, focal);
    view.ray_x0 = (float)(-(view.origin_x + 0.5 * width) / focal);
    view.ray_y0 = (float)(-(view.origin_y + 0.5 * height) / focal);
    return view;
}

struct disc_scene discs_in_window(struct harness *h, struct rng *rng, uint32_t width, uint32_t height, double largest)
{
    static const uint32_t few[] = {16, 40, 1};
    const double focal = width;
    struct disc_scene scene = {.points = {.view = discs_window(width, height, 1, focal)}};
    struct camera camera = points_look(rng, &scene.points.view, focal, 3.0), turned = camera;
    for (int k = 0; k < 6; k++) // squeezed into the window's shape
        camera.rotation[k] *= k < 3 ? 1.0 : (double)height / width;
    camera.shift[0] = camera.shift[1] = 0.0;
    points_scatter_about(rng, points_add_cloud(h, rng, &scene.points, &camera, few, 3, 0, 0), 1.5);
    discs_describe(h, rng, &scene, 0, &turned, 0.0f, largest, 1);
    return scene;
}

static uint32_t surfel(struct ref_vec n)
{
    const double size = fabs(n.x) + fabs(n.y) + fabs(n.z);
    double x = n.x / size, y = n.y / size;
    if (n.z < 0.0) {
        const double folded = (1.0 - fabs(y)) * (x < 0.0 ? -1.0 : 1.0);
        y = (1.0 - fabs(x)) * (y < 0.0 ? -1.0 : 1.0);
        x = folded;
    }
    return (uint32_t)(4095.5 + 4095.0 * x) | (uint32_t)(4095.5 + 4095.0 * y) << 13;
}

void discs_beside(struct harness *h, struct rng *rng, struct disc_scene *scene, double focal, float radius)
{
    static const uint32_t many[] = {400};
    struct view_args *view = &scene->points.view;
    struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .focal = focal};
    const uint32_t instance = scene->points.count;
    view->z_near = 0.01f;
    camera.center_x = view->origin_x + 0.5 * view->width;
    camera.center_y = view->origin_y + 0.5 * view->height;
    struct cloud *cloud = points_add_cloud(h, rng, &scene->points, &camera, many, 1, 0, instance * 5000);
    for (uint32_t i = 0; i < many[0]; i++) {
        const double turn = rng_range(rng, 0.0, 6.2831853), far = rng_range(rng, 5.0, 30.0), z = rng_range(rng, 0.1, 0.6);
        const struct ref_vec at = {far * cos(turn), far * sin(turn), -z}, towards = ref_unit(at);
        float direction[3];
        rng_direction(rng, direction);
        struct ref_vec n = ref_vec_of(direction);
        n = ref_unit(ref_add(n, ref_scale(towards, -ref_dot(n, towards) + rng_range(rng, -1e-3, 1e-3))));
        *points_coordinate(cloud, 0, i, 0) = (float)at.x;
        *points_coordinate(cloud, 0, i, 1) = (float)at.y;
        *points_coordinate(cloud, 0, i, 2) = (float)at.z;
        cloud->surfels[i] = surfel(n);
    }
    discs_describe(h, rng, scene, instance, &camera, radius, 0.25, 1);
}

struct pt_buffer *discs_splat(struct harness *h, struct disc_scene *scene)
{
    struct pt_buffer *buffers[4 + 4 * MOST_INSTANCES];
    const struct scene *points = &scene->points;
    const size_t pixels = (size_t)points->view.width * points->view.height, head = sizeof(struct splat_args);
    char args[sizeof(struct splat_args) + sizeof scene->discs];
    uint64_t *empty = harness_alloc(h, pixels * 8);
    for (size_t i = 0; i < pixels; i++)
        empty[i] = REF_EMPTY_KEY;
    uint32_t n = 0;
    buffers[n++] = harness_buffer(h, empty, pixels * 8);
    buffers[n++] = points->limit ? harness_buffer(h, points->limit, pixels * 4) : NULL;
    scene->bins = harness_buffer(h, NULL, 16); // too small on the processor, which says so
    buffers[n++] = scene->bins;
    buffers[n++] = NULL; // drawn
    for (uint32_t i = 0; i < points->count; i++) {
        struct cloud *cloud = &scene->points.clouds[i];
        points_pad(cloud);
        buffers[n++] = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
        buffers[n++] = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
        buffers[n++] = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
        buffers[n++] = harness_buffer(h, scene->radii[i], 4 * (size_t)cloud->slots);
    }
    const struct splat_args splat = {.view = points->view, .instances = points->count, .behind = points->limit != NULL};
    memcpy(args, &splat, head);
    memcpy(args + head, scene->discs, points->count * sizeof *scene->discs);
    harness_run(h, PT_KERNEL_splat, args, head + points->count * sizeof *scene->discs, buffers, n);
    return buffers[0];
}

static int by_id(const void *a, const void *b)
{
    const struct ref_disc *x = a, *y = b;
    return x->id < y->id ? -1 : x->id > y->id;
}

struct ref_disc *discs_reference(struct harness *h, const struct disc_scene *scene, uint32_t *count)
{
    uint32_t total = 0, n = 0;
    for (uint32_t i = 0; i < scene->points.count; i++)
        total += scene->points.clouds[i].slots;
    struct ref_disc *discs = harness_alloc(h, (total + 1) * sizeof *discs);
    for (uint32_t i = 0; i < scene->points.count; i++) {
        const struct cloud *cloud = &scene->points.clouds[i];
        for (uint32_t c = 0; c < cloud->chunk_count; c++)
            for (uint32_t s = 0; s < cloud->chunks[c].count; s++)
                discs[n++] = ref_disc(&scene->points.view, &scene->discs[i], &cloud->chunks[c], cloud->positions,
                                      cloud->surfels, scene->radii[i], s);
    }
    qsort(discs, n, sizeof *discs, by_id);
    *count = n;
    return discs;
}

void discs_around(struct harness *h, struct around *around, const struct view_args *view, const struct ref_disc *discs,
                  uint32_t count, int x, int y)
{
    enum { WIDE = 16 };
    if (around->strip == x / WIDE && around->y == y)
        return;
    if (!around->places)
        around->places = harness_alloc(h, (count + 1) * sizeof *around->places);
    around->strip = x / WIDE;
    around->y = y;
    around->count = ref_discs_around(view, discs, count, around->strip * WIDE, around->strip * WIDE + WIDE, y, around->places);
}

const struct ref_disc *discs_find(const struct ref_disc *discs, uint32_t count, uint32_t id)
{
    const struct ref_disc wanted = {.id = id};
    return bsearch(&wanted, discs, count, sizeof *discs, by_id);
}
