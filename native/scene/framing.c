// SPDX-License-Identifier: GPL-3.0-or-later
// A camera that frames the scene: what is dense of its clouds fills the picture, strays are only kept within the clip range.
#include "clip.h"
#include "base/descriptor.h"
#include "dense.h"
#include "reach.h"
#include "base/elementary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct framing {
    double (*corners)[4]; // of what is framed, and how far beyond each something may show
    size_t count, room;
    int error;
    double around; // of the corners that are handed in: how far beyond them something may show
    double lower[3], upper[3], center[3];
    double half_x, half_y, distance, radius;
};

static void keep_corner(void *context, const double corner[3])
{
    struct framing *f = context;
    if (f->count == f->room) {
        const size_t room = f->room ? 2 * f->room : 1024;
        double(*corners)[4] = realloc(f->corners, room * sizeof *corners);
        if (!corners) {
            f->error = PATINA_ERROR_MEMORY;
            return;
        }
        f->corners = corners;
        f->room = room;
    }
    for (int k = 0; k < 3; k++) {
        f->lower[k] = f->count ? fmin(f->lower[k], corner[k]) : corner[k];
        f->upper[k] = f->count ? fmax(f->upper[k], corner[k]) : corner[k];
        f->corners[f->count][k] = corner[k];
    }
    f->corners[f->count++][3] = f->around;
}

static void count(void *context, const double corner[3])
{
    (void)corner;
    ++*(size_t *)context;
}

// Of a cloud in pages its own box, where something of it is left: what is on its way might be no stray, and levels are no sparse points.
static void keep_pages(const struct pt_instance *instance, const struct pt_sieve *sieve, struct framing *f)
{
    const patina_cloud_info *info = &instance->cloud->info;
    size_t corners = 0;
    pt_cloud_corners(instance->cloud, sieve, instance->style.world_from_object, count, &corners);
    if (corners)
        pt_box_corners(info->box_min, info->box_max, instance->style.world_from_object, keep_corner, f);
}

static int keep_instance(const patina_scene *scene, const struct pt_instance *instance, struct framing *f)
{
    const patina_cloud *cloud = instance->cloud;
    struct pt_inverse_clip *room = malloc((scene->clip_count + 1) * sizeof *room);
    struct pt_dense *boxes = cloud->paged ? NULL : malloc((cloud->chunk_count + 1) * sizeof *boxes);
    f->error = !room || (!boxes && !cloud->paged) ? PATINA_ERROR_MEMORY
               : cloud->paged                     ? PATINA_OK
                                                  : pt_dense_chunks(cloud, boxes);
    if (!f->error) {
        const struct pt_sieve sieve = pt_sieve_make(scene, instance, PT_EVERY_POINT, room);
        const double scale = pt_stretch(instance->style.world_from_object);
        f->around = cloud->paged ? pt_instance_reach(scene, instance) : 0.0;
        if (cloud->paged)
            keep_pages(instance, &sieve, f);
        for (uint32_t c = 0; boxes && c < cloud->chunk_count; c++)
            if (boxes[c].lower[0] <= boxes[c].upper[0] &&
                pt_sieve_chunk(&sieve, &cloud->chunks[c], NULL, NULL) != PT_CUT_AWAY) {
                f->around = pt_chunk_reach(scene, instance, &cloud->chunks[c], scale, 0);
                pt_box_corners(boxes[c].lower, boxes[c].upper, instance->style.world_from_object, keep_corner, f);
            }
        f->around = 0.0;
    }
    free(boxes);
    free(room);
    return f->error;
}

// As pt_each_corner, with f->around as far beyond each instance's corners as something of it may show.
static int each_corner(const patina_scene *scene, pt_corner_work *work, struct framing *f)
{
    struct pt_inverse_clip *room = malloc((scene->clip_count + 1) * sizeof *room);
    if (!room)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const struct pt_instance *instance = &scene->instances[i];
        const struct pt_sieve sieve = pt_sieve_make(scene, instance, PT_EVERY_POINT, room);
        f->around = pt_instance_reach(scene, instance);
        pt_cloud_corners(instance->cloud, &sieve, instance->style.world_from_object, work, f);
    }
    f->around = 0.0;
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        pt_mesh_corners(pt_mesh_at(scene, i), work, f);
    free(room);
    return PATINA_OK;
}

static int keep_scene(const patina_scene *scene, struct framing *f)
{
    for (uint32_t i = 0; i < scene->cloud_count && !f->error; i++)
        keep_instance(scene, &scene->instances[i], f);
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        pt_mesh_corners(pt_mesh_at(scene, i), keep_corner, f);
    if (!f->error && !f->count) // clips left the strays alone
        f->error = each_corner(scene, keep_corner, f);
    return f->error;
}

// The nearest place from which a ball around the corner is in view, with 4% of air.
static void step_back(struct framing *f, const double corner[4], const double x[3], const double y[3], const double z[3])
{
    double p[3];
    for (int k = 0; k < 3; k++)
        p[k] = corner[k] - f->center[k];
    const double half[2] = {f->half_x, f->half_y}, aside[2] = {fabs(pt_dot(p, x)), fabs(pt_dot(p, y))};
    for (int k = 0; k < 2; k++) // the border's plane is as far from the corner as the ball's radius
        f->distance = fmax(f->distance, pt_dot(p, z) + 1.04 * (aside[k] + corner[3] * sqrt(1.0 + half[k] * half[k])) / half[k]);
}

static void reach(void *context, const double corner[3])
{
    struct framing *f = context;
    double p[3];
    for (int k = 0; k < 3; k++)
        p[k] = corner[k] - f->center[k];
    f->radius = fmax(f->radius, sqrt(pt_dot(p, p)) + f->around);
}

int patina_scene_frame_camera(const patina_scene *scene, double azimuth, double elevation, double fov_degrees,
                              patina_camera *camera)
{
    if (!scene || !camera || !isfinite(azimuth + elevation + fov_degrees))
        return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_scene_frame_camera: bad arguments");
    const double degree = 3.14159265358979323846 / 180.0;
    const double ca = pt_cos(azimuth * degree), sa = pt_sin(azimuth * degree);
    const double ce = pt_cos(elevation * degree), se = pt_sin(elevation * degree);
    const double x[3] = {ca, sa, 0.0}, y[3] = {-sa * se, ca * se, ce}, z[3] = {sa * ce, -ca * ce, se};
    const double fov = fov_degrees > 0.0 && fov_degrees < 179.0 ? fov_degrees : 45.8;
    struct framing framing = {.half_y = pt_tan(0.5 * fov * degree)};
    framing.half_x = framing.half_y * scene->settings.width / scene->settings.height;
    int error = keep_scene(scene, &framing);
    for (int k = 0; k < 3; k++)
        framing.center[k] = 0.5 * (framing.lower[k] + framing.upper[k]);
    for (size_t i = 0; i < framing.count; i++)
        step_back(&framing, framing.corners[i], x, y, z);
    free(framing.corners);
    if (!error)
        error = each_corner(scene, reach, &framing);
    if (error)
        return pt_fail(&scene->handle, error, "framing the scene: out of memory");
    const double distance = framing.distance > 0.0 ? framing.distance : 1.0; // a single point, or nothing
    const double radius = framing.radius > 0.0 ? 1.01 * framing.radius : distance;
    patina_camera found = {.left = -framing.half_x,
                           .right = framing.half_x,
                           .bottom = -framing.half_y,
                           .top = framing.half_y,
                           .near_clip = fmax(distance - radius, 1e-3 * distance),
                           .far_clip = distance + radius};
    for (int k = 0; k < 3; k++) {
        found.world_from_camera[4 * k] = x[k];
        found.world_from_camera[4 * k + 1] = y[k];
        found.world_from_camera[4 * k + 2] = z[k];
        found.world_from_camera[4 * k + 3] = framing.center[k] + distance * z[k];
    }
    found.world_from_camera[15] = 1.0;
    return pt_give(&scene->handle, "patina_scene_frame_camera", &found, sizeof found, camera);
}

static void widen(void *context, const double corner[3])
{
    struct framing *f = context;
    for (int k = 0; k < 3; k++) {
        f->lower[k] = fmin(f->lower[k], corner[k] - f->around);
        f->upper[k] = fmax(f->upper[k], corner[k] + f->around);
    }
}

int patina_scene_extent(const patina_scene *scene, double box_min[3], double box_max[3])
{
    if (!scene || !box_min || !box_max)
        return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_scene_extent: bad arguments");
    struct framing framing = {.lower = {INFINITY, INFINITY, INFINITY}, .upper = {-INFINITY, -INFINITY, -INFINITY}};
    if (each_corner(scene, widen, &framing))
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "the scene's extent: out of memory");
    memcpy(box_min, framing.lower, sizeof framing.lower);
    memcpy(box_max, framing.upper, sizeof framing.upper);
    return PATINA_OK;
}

int patina_cloud_dense_box(const patina_cloud *cloud, double box_min[3], double box_max[3])
{
    if (!cloud || !box_min || !box_max)
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_dense_box: bad arguments");
    if (cloud->paged) {
        memcpy(box_min, cloud->info.box_min, sizeof cloud->info.box_min);
        memcpy(box_max, cloud->info.box_max, sizeof cloud->info.box_max);
        return PATINA_OK;
    }
    struct pt_dense *boxes = malloc((cloud->chunk_count + 1) * sizeof *boxes);
    if (!boxes || pt_dense_chunks(cloud, boxes)) {
        free(boxes);
        return pt_fail(&cloud->handle, PATINA_ERROR_MEMORY, "the dense box: out of memory");
    }
    for (int k = 0; k < 3; k++) {
        box_min[k] = INFINITY;
        box_max[k] = -INFINITY;
        for (uint32_t c = 0; c < cloud->chunk_count; c++) {
            box_min[k] = fmin(box_min[k], boxes[c].lower[k]);
            box_max[k] = fmax(box_max[k], boxes[c].upper[k]);
        }
    }
    free(boxes);
    return PATINA_OK;
}
