// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured.h"

#include <math.h>
#include <stdlib.h>

static double outside(double value, double low) { return fmax(fmax(low - value, value - (low + 1.0)), 0.0); }

struct measured measured_compare(const struct picture *picture, const double *world, uint64_t count,
                                 const patina_camera *camera, double margin)
{
    struct measured result = {0};
    size_t pixels = (size_t)picture->width * picture->height;
    double *nearest = malloc(pixels * sizeof *nearest);
    if (!nearest)
        support_die("out of memory");
    for (size_t i = 0; i < pixels; i++)
        nearest[i] = HUGE_VAL;
    double near_z = camera->orthographic ? 0.0 : camera->near_clip;
    double far_z = camera->orthographic ? camera->far_clip - camera->near_clip : camera->far_clip;
    for (uint64_t i = 0; i < count; i++) {
        double x, y, z;
        camera_project(camera, picture->width, picture->height, world + 3 * i, &x, &y, &z);
        if (!(z > near_z + margin * fabs(z)) || !(z < far_z - margin * fabs(z)))
            continue;
        double px = floor(x), py = floor(y);
        if (!(px >= 0.0 && py >= 0.0 && px < picture->width && py < picture->height) || x - px < margin ||
            px + 1.0 - x < margin || y - py < margin || py + 1.0 - y < margin)
            continue;
        double *slot = &nearest[(size_t)py * picture->width + (size_t)px];
        *slot = fmin(*slot, z);
    }
    for (size_t i = 0; i < pixels; i++) {
        uint64_t key = picture->keys[i];
        if (key == KEY_EMPTY) {
            result.missed += nearest[i] < HUGE_VAL;
            continue;
        }
        result.pixels++;
        if (key_id(key) >= count || !(key_z(key) >= 0.0f) || !isfinite(key_z(key))) {
            result.impossible++;
            continue;
        }
        double x, y, z, shown = key_z(key);
        camera_project(camera, picture->width, picture->height, world + 3 * (uint64_t)key_id(key), &x, &y, &z);
        result.z_error = fmax(result.z_error, fabs(shown - z));
        result.z_share = fmax(result.z_share, fabs(shown - z) / z);
        double dx = outside(x, (double)(i % picture->width)), dy = outside(y, (double)(i / picture->width));
        result.stray = fmax(result.stray, fmax(dx, dy));
        result.z_late = fmax(result.z_late, z - nearest[i]);
    }
    free(nearest);
    return result;
}

void measured_assert_sane(const struct picture *picture, const char *what)
{
    for (uint64_t i = 0; i < (uint64_t)picture->width * picture->height; i++) {
        const float *rgba = picture->combined + 4 * i, *normal = picture->normal + 3 * i;
        float depth = picture->depth[i], source = picture->source[i];
        int empty = picture->keys[i] == KEY_EMPTY;
        for (int k = 0; k < 4; k++)
            if (!isfinite(rgba[k]) || rgba[k] < 0.0f)
                support_die("%s: channel %d of pixel %llu is %g", what, k, (unsigned long long)i, (double)rgba[k]);
        if (rgba[3] > 1.00001f)
            support_die("%s: alpha of pixel %llu is %g", what, (unsigned long long)i, (double)rgba[3]);
        if (empty ? depth != HUGE_VALF : !(depth >= 0.0f && isfinite(depth)))
            support_die("%s: depth of pixel %llu is %g, key %016llx", what, (unsigned long long)i, (double)depth,
                        (unsigned long long)picture->keys[i]);
        double length = sqrt((double)normal[0] * normal[0] + (double)normal[1] * normal[1] + (double)normal[2] * normal[2]);
        if (!(length < 1e-6 || fabs(length - 1.0) < 1e-5))
            support_die("%s: normal of pixel %llu has length %g", what, (unsigned long long)i, length);
        if (!isfinite(source) || (empty && source > 0.0f) || (!empty && source == 0.0f))
            support_die("%s: source of pixel %llu is %g, key %016llx", what, (unsigned long long)i, (double)source,
                        (unsigned long long)picture->keys[i]);
    }
}
