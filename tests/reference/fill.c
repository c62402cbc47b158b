// SPDX-License-Identifier: GPL-3.0-or-later
// [D 3.2, 3.3], SPEC 2.2: hole filling, one rule for background and for occluded pixels.
#include "reference.h"
#include "tolerances.h"
#include "shared/filling.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The ring, anticlockwise from the right.
static const int ring_x[8] = {1, 1, 0, -1, -1, -1, 0, 1};
static const int ring_y[8] = {0, 1, 1, 1, 0, -1, -1, -1};

struct phase {
    const struct fill_args *args;
    const float *normal, *deff, *span;
    int occluded;
    struct ref_range *threshold; // by pixel: as it was before its first fill
    unsigned char *filled;       // 0 no, 1 yes, 2 perhaps
};

struct ref_pixel ref_pixel(uint64_t key, uint32_t from)
{
    struct ref_pixel pixel = {ref_exactly(ref_key_z(key)), ref_key_id(key), from, 0};
    return pixel;
}

static int is_empty(const struct ref_pixel *pixel) { return isinf(pixel->z.lo) && isinf(pixel->z.hi); }

static struct ref_pixel at(const struct fill_args *args, const struct ref_pixel *pixels, int x, int y)
{
    if (x < 0 || y < 0 || x >= (int)args->view.width || y >= (int)args->view.height)
        return ref_pixel(REF_EMPTY_KEY, 0);
    return pixels[(size_t)y * args->view.width + (size_t)x];
}

static struct ref_range distance(const struct phase *phase, const struct ref_pixel *pixel)
{
    return ref_level_distance(&phase->args->view, phase->normal, phase->deff, pixel->from, pixel->z);
}

// What a neighbour must lie before to be dark: z - d_eff, for background +inf.
static struct ref_range threshold_of(const struct phase *phase, const struct ref_pixel *pixel)
{
    if (is_empty(pixel))
        return ref_exactly(INFINITY);
    return ref_difference(pixel->z, distance(phase, pixel));
}

// Whether a pixel within the rectangle stands alone in these: nothing is beside it, though its surface is dense at this level.
static enum ref_truth is_stray(const struct phase *phase, const struct ref_pixel *pixels, int x, int y)
{
    const struct fill_args *args = phase->args;
    const struct ref_pixel pixel = at(args, pixels, x, y);
    const uint32_t *rect = args->view.rect;
    if (!args->alone || phase->occluded || is_empty(&pixel) || x < (int)rect[0] || y < (int)rect[1] || x >= (int)rect[2] ||
        y >= (int)rect[3])
        return REF_NO;
    int unsure = pixel.unsure;
    for (int i = 0; i < 8; i++) {
        const struct ref_pixel beside = at(args, pixels, x + ring_x[i], y + ring_y[i]);
        if (!beside.unsure && !is_empty(&beside))
            return REF_NO;
        unsure |= beside.unsure;
    }
    if (unsure)
        return REF_UNSURE;
    const double limit = (double)PT_DENSE * ref_footprint(&args->view, pixel.z.lo) *
                         (double)phase->normal[4 * (size_t)pixel.from + 3];
    const double span = (double)phase->span[pixel.from];
    if (fabs(span - limit) <= (TOL_LEVEL + TOL_UNIT) * limit)
        return REF_UNSURE;
    return span < limit ? REF_YES : REF_NO;
}

// Are `run` consecutive ring neighbours all white? Strays of `alone` are.
static enum ref_truth has_white_run(const struct phase *phase, const struct ref_pixel *pixels, const struct ref_pixel *alone,
                                    int x, int y, struct ref_range threshold, int run)
{
    enum ref_truth white[8], found = REF_NO;
    for (int i = 0; i < 8; i++) {
        struct ref_pixel neighbour = at(phase->args, pixels, x + ring_x[i], y + ring_y[i]);
        enum ref_truth dark = neighbour.unsure ? REF_UNSURE : ref_less(neighbour.z, threshold);
        white[i] = dark == REF_UNSURE ? REF_UNSURE : dark == REF_YES ? REF_NO : REF_YES;
        if (white[i] == REF_NO)
            white[i] = is_stray(phase, alone, x + ring_x[i], y + ring_y[i]);
    }
    for (int first = 0; first < 8; first++) {
        enum ref_truth all = REF_YES;
        for (int i = first; i < first + run; i++) {
            if (white[i & 7] == REF_NO)
                all = REF_NO;
            else if (white[i & 7] == REF_UNSURE && all == REF_YES)
                all = REF_UNSURE;
        }
        if (all == REF_YES)
            return REF_YES;
        if (all == REF_UNSURE)
            found = REF_UNSURE;
    }
    return found;
}

// How far a neighbour's surface goes at most: known while the cell that it was measured in shows it.
static struct ref_range farthest_of(const struct phase *phase, const struct ref_pixel *pixels, const struct ref_pixel *source)
{
    const struct view_args *view = &phase->args->view;
    const struct ref_pixel *cell = &pixels[ref_cell_of(source->from, phase->args->from_width, view->level, view->width)];
    if (cell->unsure)
        return (struct ref_range){source->z.lo, INFINITY};
    if (cell->from != source->from)
        return source->z;
    return ref_farthest(cell->z, phase->span[source->from], phase->normal[4 * (size_t)source->from + 3]);
}

// The neighbour's surface as this pixel would see it.
static struct ref_range taken_depth(const struct phase *phase, const struct ref_pixel *pixels, const struct ref_pixel *source,
                                    int qx, int qy, int x, int y)
{
    const struct view_args *view = &phase->args->view;
    if (!phase->args->refined)
        return source->z;
    const struct ref_range limit = ref_level_distance(view, phase->normal, phase->span, source->from, source->z);
    const struct ref_range plane = ref_plane_depth(view, phase->normal + 4 * (size_t)source->from, ref_ray(view, qx, qy),
                                                   source->z, ref_ray(view, x, y), limit);
    struct ref_range beside[8];
    for (int i = 0; i < 8; i++)
        beside[i] = at(phase->args, pixels, x + ring_x[i], y + ring_y[i]).z;
    return ref_within(source->z, plane, farthest_of(phase, pixels, source), beside, 8);
}

// Whether the neighbour's surface reaches the pixel: its own pixel lies near enough.
static enum ref_truth reaches(const struct phase *phase, const struct ref_pixel *neighbour, int x, int y)
{
    const struct fill_args *args = phase->args;
    const struct view_args *view = &args->view;
    const double scale = (double)(1u << view->level), inverse = phase->normal[4 * (size_t)neighbour->from + 3];
    const double share = (double)(neighbour->id >= args->discs_first ? args->disc_reach : args->reach);
    const struct ref_ray ray = ref_ray(view, x, y);
    const double stretch = view->perspective ? fmax(fmax(fabs(ray.u), fabs(ray.v)), 1.0) : 1.0;
    const double d = (double)phase->span[neighbour->from] * share * stretch / ((double)view->footprint * inverse);
    const double slack = (double)PT_FILL_SLACK * scale, sx = neighbour->from % args->from_width,
                 sy = neighbour->from / args->from_width;
    const double way = hypot((x + 0.5) * scale - (sx + 0.5), (y + 0.5) * scale - (sy + 0.5));
    const double least = d / (view->perspective ? neighbour->z.hi : 1.0),
                 most = d / (view->perspective ? neighbour->z.lo : 1.0);
    if (way <= (least + slack) * (1.0 - TOL_LEVEL))
        return REF_YES;
    return way > (most + slack) * (1.0 + TOL_LEVEL) ? REF_NO : REF_UNSURE;
}

// Leaves of the ring what hides the pixel and reaches it. REF_UNSURE where that cannot be told of what might be taken.
static enum ref_truth leave_reaching(const struct phase *phase, const struct ref_pixel *pixel, int x, int y,
                                     struct ref_pixel ring[8])
{
    const struct ref_range threshold = threshold_of(phase, pixel);
    enum ref_truth some = REF_NO, taken[8];
    double bound = INFINITY; // what is certainly taken lies before it
    for (int i = 0; i < 8; i++) {
        if (ring[i].unsure)
            return REF_UNSURE;
        const enum ref_truth before = is_empty(&ring[i]) ? REF_NO : ref_less(ring[i].z, threshold);
        taken[i] = before == REF_NO ? REF_NO : reaches(phase, &ring[i], x, y);
        taken[i] = taken[i] == REF_YES ? before : taken[i];
        if (taken[i] == REF_YES)
            bound = fmin(bound, ring[i].z.hi);
    }
    for (int i = 0; i < 8; i++) {
        if (taken[i] == REF_UNSURE && ring[i].z.lo <= bound)
            return REF_UNSURE;
        if (taken[i] != REF_YES)
            ring[i] = ref_pixel(REF_EMPTY_KEY, 0);
        else
            some = REF_YES;
    }
    return some;
}

// Takes the least key among the neighbours. Neighbours that share it to the last bit show the same point, but as seen
// from different pixels: the first of the ring is taken, anticlockwise from the right.
static struct ref_pixel take_least(const struct phase *phase, const struct ref_pixel *pixels, const struct ref_pixel ring[8],
                                   int x, int y)
{
    struct ref_pixel least = ref_pixel(REF_EMPTY_KEY, 0);
    double bound = INFINITY;
    for (int i = 0; i < 8; i++) {
        least.unsure |= ring[i].unsure;
        bound = fmin(bound, ring[i].z.hi);
    }
    if (least.unsure)
        return least;
    int certain = 1, chosen = 0;
    for (int i = 0; i < 8; i++) {
        if (is_empty(&ring[i]) || ring[i].z.lo > bound)
            continue;
        if (ring[i].z.lo != bound || ring[i].z.hi != bound)
            certain = 0; // a range reaches below the least upper end
    }
    for (int i = 0; i < 8; i++) {
        if (is_empty(&ring[i]) || ring[i].z.lo > bound)
            continue;
        struct ref_range z = taken_depth(phase, pixels, &ring[i], x + ring_x[i], y + ring_y[i], x, y);
        if (!chosen || (certain && ring[i].id < least.id)) {
            least = ring[i];
            least.z = z;
            chosen = 1;
        } else if (!certain && ring[i].id == least.id) {
            least.z.lo = fmin(least.z.lo, z.lo);
            least.z.hi = fmax(least.z.hi, z.hi);
            least.unsure |= ring[i].from != least.from;
        } else if (!certain) {
            least.unsure = 1;
        }
    }
    return least;
}

// One pixel of one fill.
static struct ref_pixel fill_pixel(const struct phase *phase, const struct ref_pixel *pixels, int x, int y,
                                   enum ref_truth *changed)
{
    struct ref_pixel pixel = at(phase->args, pixels, x, y);
    *changed = REF_NO;
    if (pixel.unsure) {
        *changed = REF_UNSURE;
        return pixel;
    }
    if (is_empty(&pixel) == phase->occluded)
        return pixel;
    enum ref_truth border = has_white_run(phase, pixels, pixels, x, y, threshold_of(phase, &pixel), 5);
    if (border == REF_YES)
        return pixel;
    *changed = border == REF_NO ? REF_YES : REF_UNSURE;
    if (border == REF_UNSURE) {
        pixel.unsure = 1;
        return pixel;
    }
    struct ref_pixel ring[8];
    for (int i = 0; i < 8; i++)
        ring[i] = at(phase->args, pixels, x + ring_x[i], y + ring_y[i]);
    if (phase->args->reach > 0.0f) {
        const enum ref_truth some = leave_reaching(phase, &pixel, x, y, ring);
        *changed = some;
        pixel.unsure |= some == REF_UNSURE;
        if (some != REF_YES)
            return pixel;
    }
    return take_least(phase, pixels, ring, x, y);
}

static int fill_all(const struct phase *phase, const struct ref_pixel *before, struct ref_pixel *after)
{
    int changes = 0;
    for (int y = 0; y < (int)phase->args->view.height; y++) {
        for (int x = 0; x < (int)phase->args->view.width; x++) {
            size_t i = (size_t)y * phase->args->view.width + (size_t)x;
            enum ref_truth changed;
            after[i] = fill_pixel(phase, before, x, y, &changed);
            changes += changed != REF_NO;
            if (changed == REF_YES && phase->filled[i] == 0) {
                phase->filled[i] = 1;
                phase->threshold[i] = threshold_of(phase, &before[i]);
            } else if (changed == REF_UNSURE && phase->filled[i] == 0) {
                phase->filled[i] = 2;
            }
        }
    }
    return changes;
}

static int unfill_all(const struct phase *phase, const struct ref_pixel *original, const struct ref_pixel *before,
                      struct ref_pixel *after)
{
    int changes = 0;
    for (int y = 0; y < (int)phase->args->view.height; y++) {
        for (int x = 0; x < (int)phase->args->view.width; x++) {
            size_t i = (size_t)y * phase->args->view.width + (size_t)x;
            after[i] = before[i];
            if (phase->filled[i] != 1)
                continue;
            enum ref_truth shown = has_white_run(phase, before, original, x, y, phase->threshold[i], 4);
            if (shown == REF_UNSURE)
                after[i].unsure = 1;
            if (shown == REF_YES) {
                after[i] = original[i];
                phase->filled[i] = 0;
            }
            changes += shown != REF_NO;
        }
    }
    return changes;
}

// Fills, then un-fills, of one phase. phase: with `threshold` and `filled` for every pixel.
static void run_phase(struct phase *phase, struct ref_pixel *original, struct ref_pixel *after, struct ref_pixel *pixels)
{
    const struct fill_args *args = phase->args;
    size_t count = (size_t)args->view.width * args->view.height;
    memcpy(original, pixels, count * sizeof *pixels);
    memset(phase->filled, 0, count);
    for (uint32_t i = 0, more = 1; i < args->iterations && more; i++) {
        more = (uint32_t)fill_all(phase, pixels, after);
        memcpy(pixels, after, count * sizeof *pixels);
    }
    for (uint32_t i = 0, more = 1; i < args->unfills && more; i++) {
        more = (uint32_t)unfill_all(phase, original, pixels, after);
        memcpy(pixels, after, count * sizeof *pixels);
    }
}

int ref_fill(const struct fill_args *args, const float *normal, const float *deff, const float *span, struct ref_pixel *pixels)
{
    size_t count = (size_t)args->view.width * args->view.height;
    struct ref_pixel *original = malloc(count * sizeof *original), *after = malloc(count * sizeof *after);
    struct phase phase = {args, normal, deff, span, 0, malloc(count * sizeof(struct ref_range)), malloc(count)};
    int ok = original && after && phase.threshold && phase.filled;
    for (phase.occluded = 0; phase.occluded < 2 && ok; phase.occluded++)
        if (args->phases & (phase.occluded ? PT_FILL_OCCLUDED : PT_FILL_BACKGROUND))
            run_phase(&phase, original, after, pixels);
    free(original);
    free(after);
    free(phase.threshold);
    free(phase.filled);
    return ok;
}
