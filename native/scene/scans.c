// SPDX-License-Identifier: GPL-3.0-or-later
#include "scans.h"

#include "base/platform.h"
#include "mask.h"
#include "scene/clouds/paged.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SCANS = 65535 };

int pt_check_ranges(const struct patina_scene *scene, const patina_cloud_style *style, const struct patina_cloud *cloud)
{
    const char *wrong = NULL;
    if (style->surface && style->surface != PATINA_SURFACE_RANGES)
        wrong = "surface is 0, as the settings say, or RANGES";
    else if (style->scans && style->scans->of != cloud->alive)
        wrong = "the scans are of another cloud";
    else if (!(style->range_gamma >= 0.0f))
        wrong = "range_gamma must be 0 or more";
    else if (style->range_pixel != 0.0f && !(style->range_pixel >= 1.0f && style->range_pixel <= 64.0f))
        wrong = "range_pixel is 0 or 1 to 64 pixels";
    else if (style->range_sharpness != 0.0f && !(style->range_sharpness >= 0.5f && style->range_sharpness <= 0.95f))
        wrong = "range_sharpness is 0 or 0.5 to 0.95";
    else if (!(style->range_cull >= 0.0f && style->range_cull <= 3.1415928f))
        wrong = "range_cull must be within 0 and pi";
    return wrong ? pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "cloud style: %s", wrong) : PATINA_OK;
}

// World: unit, from the eye to the middle of the instance; of parallel views, and in that middle, along the view.
static int look_at(const struct patina_scene *scene, const struct pt_instance *instance, double view[3])
{
    const patina_cloud_info *info = &instance->cloud->info;
    double linear[9], moved[3], axes[9], eye[3], middle[3], world[3];
    if (pt_camera_axes(&scene->camera, axes, eye))
        return 0;
    pt_split_matrix(instance->style.world_from_object, linear, moved);
    for (int k = 0; k < 3; k++) {
        middle[k] = 0.5 * (info->box_min[k] + info->box_max[k]);
        view[k] = -axes[6 + k];
    }
    pt_apply(linear, middle, world);
    for (int k = 0; k < 3; k++)
        world[k] += moved[k] - eye[k];
    const double length = sqrt(pt_dot(world, world));
    for (int k = 0; k < 3 && length > 0.0 && !scene->camera.orthographic; k++)
        view[k] = world[k] / length;
    return 1;
}

int pt_hidden_scans(const struct patina_scene *scene, const struct pt_instance *instance, uint32_t hidden[PT_SCAN_WORDS])
{
    const patina_cloud_style *style = &instance->style;
    const struct patina_scans *scans = style->scans;
    double view[3], linear[9], moved[3], way[3];
    int any = 0;
    memset(hidden, 0, PT_SCAN_WORDS * sizeof *hidden);
    if (!scans || !(style->range_cull > 0.0f) ||
        (style->surface != PATINA_SURFACE_RANGES && scene->settings.surface != PATINA_SURFACE_RANGES) ||
        !look_at(scene, instance, view))
        return 0;
    pt_split_matrix(style->world_from_object, linear, moved);
    for (uint32_t i = 0; i < scans->count && i < 32 * PT_SCAN_WORDS; i++) {
        pt_apply(linear, scans->scans[i].direction, way);
        const double length = sqrt(pt_dot(way, way));
        if (length > 0.0 && pt_dot(way, view) < length * (cos((double)style->range_cull) - 1e-6)) {
            hidden[i / 32] |= 1u << i % 32;
            any = 1;
        }
    }
    return any;
}

static int check(const patina_cloud *cloud, const patina_scan *scans, uint32_t count)
{
    if (!cloud || cloud->handle.magic != PT_MAGIC || !scans || !count || count > MOST_SCANS)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_scans_create: a cloud that was destroyed, or not 1 to %d scans",
                       MOST_SCANS);
    for (uint32_t i = 0; i < count; i++) {
        const double *d = scans[i].direction;
        if (!isfinite(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) || !(scans[i].interval >= 0.0) || !isfinite(scans[i].interval))
            return pt_fail(&cloud->handle, PATINA_ERROR_ARGUMENT,
                           "patina_scans_create: scan %u: its direction is not finite, or its interval not 0 or more", i);
    }
    return PATINA_OK;
}

static void take_scans(struct patina_scans *out, const patina_scan *scans)
{
    for (uint32_t i = 0; i < out->count; i++) {
        const double *d = scans[i].direction, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        out->scans[i] = scans[i];
        for (int k = 0; k < 3; k++)
            out->scans[i].direction[k] = length > 0.0 ? d[k] / length : 0.0;
    }
}

static void take_points(struct patina_scans *out, const struct patina_cloud *cloud, const uint16_t *scan)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        uint16_t least = UINT16_MAX, most = 0;
        for (size_t slot = chunk->first; slot < (size_t)chunk->first + chunk->padded; slot++) {
            const uint16_t of = scan ? scan[pt_number_of(cloud, slot)] : 0;
            out->scan[slot] = of;
            least = of < least ? of : least;
            most = of > most ? of : most;
            if (of < out->count && out->scans[of].interval > out->interval)
                out->interval = out->scans[of].interval;
        }
        out->chunks[c][0] = least;
        out->chunks[c][1] = most;
        out->greatest = most > out->greatest ? most : out->greatest;
    }
}

static int make_scans(const struct patina_cloud *cloud, const uint16_t *scan, const patina_scan *scans, uint32_t count,
                      patina_scans **out)
{
    struct patina_scans *made = calloc(1, sizeof *made);
    if (made) {
        pt_handle_init(&made->handle);
        made->of = pt_alive_share(cloud);
        made->alive = pt_alive_create();
        made->slots = cloud->slots;
        made->count = count;
        made->scan = pt_pages_alloc((cloud->slots + 2) * sizeof *made->scan); // kernels read words
        made->chunks = calloc(cloud->chunk_count + 1, sizeof *made->chunks);
        made->scans = calloc(count, sizeof *made->scans);
    }
    if (!made || !made->alive || !made->scan || !made->chunks || !made->scans) {
        patina_scans_destroy(made);
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "scans of %llu points: out of memory", (unsigned long long)cloud->info.count);
    }
    take_scans(made, scans);
    take_points(made, cloud, scan);
    *out = made;
    return PATINA_OK;
}

int patina_scans_create(const patina_cloud *cloud, const uint16_t *scan, const patina_scan *scans, uint32_t count,
                        patina_scans **out)
{
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_scans_create: out is NULL");
    *out = NULL;
    int error = check(cloud, scans, count);
    if (error || (error = pt_undivided_enter(cloud, "patina_scans_create")))
        return error;
    error = make_scans(cloud, scan, scans, count, out);
    pt_paged_leave(cloud);
    return error;
}

void patina_scans_destroy(patina_scans *scans)
{
    if (!scans)
        return;
    pt_pages_free(scans->scan, (scans->slots + 2) * sizeof *scans->scan);
    free(scans->chunks);
    free(scans->scans);
    pt_alive_end(scans->alive);
    pt_alive_release(scans->of);
    pt_handle_destroy(&scans->handle);
    free(scans);
}
