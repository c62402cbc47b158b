// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 2.2, pull-push with depth intervals: an empty or occluded pixel takes its coarse parent's surface when the parent
// and two of the three coarse cells next to the pixel lie before it.
#include "reference.h"
#include "tolerances.h"
#include "shared/filling.h"

#include <math.h>

// A coarse cell's depth; outside the plane: nothing there.
static struct ref_range coarse_depth(const struct push_args *args, const uint64_t *keys, int x, int y)
{
    if (x < 0 || y < 0 || x >= (int)args->coarse_width || y >= (int)args->coarse_height)
        return ref_exactly(INFINITY);
    return ref_exactly(ref_key_z(keys[(size_t)y * args->coarse_width + (size_t)x]));
}

// "At least two of three", when some of the three are open.
static enum ref_truth two_of(const enum ref_truth truth[3])
{
    int yes = 0, maybe = 0;
    for (int i = 0; i < 3; i++) {
        yes += truth[i] == REF_YES;
        maybe += truth[i] != REF_NO;
    }
    return yes >= 2 ? REF_YES : maybe >= 2 ? REF_UNSURE : REF_NO;
}

// Whether points of the surface lie closer than 1.2 pixels of this level: the span without its cosine is K spacing, or more.
static enum ref_truth is_dense(const struct view_args *view, const struct ref_planes *planes, struct ref_pixel taken)
{
    double width = (double)view->footprint * (double)(1u << view->level);
    double z = view->perspective ? taken.z.lo : 1.0; // a key's: exact
    double limit = (double)PT_DENSE * width * z * (double)planes->normal[4 * (size_t)taken.from + 3];
    double span = (double)planes->span[taken.from];
    if (fabs(span - limit) <= (TOL_LEVEL + TOL_UNIT) * limit) // one product more than a level distance
        return REF_UNSURE;
    return span < limit ? REF_YES : REF_NO;
}

struct ref_pixel ref_push(const struct push_args *args, const uint64_t *coarse_keys, const uint32_t *coarse_from,
                          const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t index = (size_t)y * view->width + (size_t)x;
    struct ref_pixel pixel = ref_pixel(planes->keys[index], planes->from[index]);
    struct ref_range threshold = ref_exactly(INFINITY);
    if (pixel.id != PT_KEY_EMPTY_ID || !isinf(pixel.z.lo)) {
        if (args->background)
            return pixel;
        threshold = ref_difference(pixel.z, ref_level_distance(view, planes->normal, planes->deff, pixel.from, pixel.z));
    }
    int px = x >> 1, py = y >> 1, sx = x & 1 ? 1 : -1, sy = y & 1 ? 1 : -1;
    if (px >= (int)args->coarse_width || py >= (int)args->coarse_height)
        return pixel;
    struct ref_range parent = coarse_depth(args, coarse_keys, px, py);
    enum ref_truth parent_before = ref_less(parent, threshold);
    const struct ref_range beside[3] = {coarse_depth(args, coarse_keys, px + sx, py),
                                        coarse_depth(args, coarse_keys, px, py + sy),
                                        coarse_depth(args, coarse_keys, px + sx, py + sy)};
    enum ref_truth before[3];
    for (int i = 0; i < 3; i++)
        before[i] = ref_less(beside[i], threshold);
    enum ref_truth around = two_of(before);
    if (parent_before == REF_NO || around == REF_NO)
        return pixel;
    if (parent_before == REF_UNSURE || around == REF_UNSURE) {
        pixel.unsure = 1;
        return pixel;
    }
    size_t coarse = (size_t)py * args->coarse_width + (size_t)px;
    struct ref_pixel taken = ref_pixel(coarse_keys[coarse], coarse_from[coarse]);
    enum ref_truth dense = is_dense(view, planes, taken);
    if (dense != REF_NO) {
        pixel.unsure |= dense == REF_UNSURE;
        return pixel;
    }
    if (args->refined) {
        struct view_args above = *view;
        above.level++;
        struct ref_range limit = ref_level_distance(&above, planes->normal, planes->span, taken.from, taken.z);
        const size_t cell = ref_cell_of(taken.from, args->from_width, above.level, args->coarse_width);
        const struct ref_range measured = ref_exactly(ref_key_z(coarse_keys[cell]));
        const struct ref_range farthest = coarse_from[cell] != taken.from
                                              ? taken.z
                                              : ref_farthest(measured, planes->span[taken.from],
                                                             planes->normal[4 * (size_t)taken.from + 3]);
        const struct ref_range plane = ref_plane_depth(view, planes->normal + 4 * (size_t)taken.from, ref_ray(&above, px, py),
                                                       taken.z, ref_ray(view, x, y), limit);
        taken.z = ref_within(taken.z, plane, farthest, beside, 3);
    }
    return taken;
}
