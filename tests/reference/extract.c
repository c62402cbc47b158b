// SPDX-License-Identifier: GPL-3.0-or-later
// Passes for the artist: linear depth, world-space normal, and where each pixel's surface was measured.
#include "reference.h"
#include "tolerances.h"
#include "shared/colors.h"

#include <math.h>

struct ref_extract ref_extract(const struct extract_args *args, const struct ref_planes *planes, int x, int y)
{
    uint32_t width = args->view.width, px = (uint32_t)x + args->crop_x, py = (uint32_t)y + args->crop_y;
    size_t pixel = (size_t)py * width + px;
    struct ref_extract out = {.depth = INFINITY, .shadow = 1.0};
    if (planes->keys[pixel] == REF_EMPTY_KEY)
        return out;
    out.depth = ref_key_z(planes->keys[pixel]);
    if (ref_key_id(planes->keys[pixel]) < args->centered) // one sum of two float32
        out.depth = (float)(out.depth + (double)planes->offset[planes->from[pixel] & ~PT_FROM_MIXED]);
    struct ref_vec n = ref_vec_of(planes->shading + 4 * pixel);
    const float *m = args->world_from_view;
    out.normal = ref_vec(m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                         m[6] * n.x + m[7] * n.y + m[8] * n.z);
    for (int i = 0; i < 9; i++)
        out.normal_error += TOL_ROTATE * fabs((double)m[i]); // |n| <= 1
    out.shadow = planes->arrived[pixel];
    uint32_t from = planes->from[pixel] & ~PT_FROM_MIXED;
    double dx = (double)(from % width) - px, dy = (double)(from / width) - py;
    out.source = 1.0 + sqrt(dx * dx + dy * dy);
    if (from == pixel && ref_key_id(planes->keys[pixel]) - args->discs_first < args->discs_count)
        out.source = 1.0 + (double)planes->away[pixel];
    if (planes->from[pixel] & PT_FROM_MIXED)
        out.source = -out.source;
    return out;
}
