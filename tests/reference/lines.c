// SPDX-License-Identifier: GPL-3.0-or-later
// [X 3], SPEC 7: the least distance of a pixel to the discs that show there, every disc looked at.
#include "reference.h"
#include "tolerances.h"
#include "shared/lines.h"

#include <math.h>

struct scene {
    const struct lines_args *args;
    const struct ref_planes *planes;
    const float *limit;
};

static int inside(const struct view_args *view, int x, int y)
{
    return x >= (int)view->rect[0] && y >= (int)view->rect[1] && x < (int)view->rect[2] && y < (int)view->rect[3];
}

static size_t index_of(const struct scene *scene, int x, int y) { return (size_t)y * scene->args->view.width + (size_t)x; }

// Does the pixel show this layer's surface?
static int is_surface(const struct scene *scene, int x, int y)
{
    if (!inside(&scene->args->view, x, y) || scene->planes->keys[index_of(scene, x, y)] == REF_EMPTY_KEY)
        return 0;
    double z = ref_key_z(scene->planes->keys[index_of(scene, x, y)]);
    return !scene->args->behind || z > (double)scene->limit[index_of(scene, x, y)];
}

// May a line lie on the pixel? Where no surface is, in layers behind, only over what lets light through.
static int is_ground(const struct scene *scene, int x, int y)
{
    if (!inside(&scene->args->view, x, y))
        return 0;
    if (!scene->args->behind || is_surface(scene, x, y))
        return 1;
    double through = scene->planes->through[index_of(scene, x, y)];
    return through < 1.0 && through >= 1.0 / 512.0;
}

static uint32_t source_of(const struct scene *scene, int x, int y)
{
    return scene->planes->from[index_of(scene, x, y)] & ~PT_FROM_MIXED;
}

// Depth of a pixel's disc. Exact: the sum, and the product, of two float32 are exact in float64, and are rounded once.
static double disc_depth(const struct scene *scene, int x, int y)
{
    uint32_t source = source_of(scene, x, y);
    double offset = scene->planes->deff[source];
    if (scene->args->offset > 0.0f)
        offset = (float)((double)scene->args->offset * (double)scene->planes->normal[4 * (size_t)source + 3]);
    return (float)(ref_key_z(scene->planes->keys[index_of(scene, x, y)]) + offset);
}

static struct ref_range radius(const struct scene *scene, int x, int y)
{
    const struct lines_args *args = scene->args;
    if (!args->world)
        return ref_exactly(args->most);
    double r = args->width / ref_footprint(&args->view, ref_key_z(scene->planes->keys[index_of(scene, x, y)]));
    struct ref_range out = {fmin(r * (1.0 - 8.0 * TOL_UNIT), args->most), fmin(r * (1.0 + 8.0 * TOL_UNIT), args->most)};
    return out;
}

// Does the disc of a surface pixel (dx, dy) pixels from the pixel (x, y) lie before that pixel and its tangent plane?
static enum ref_truth shows(const struct scene *scene, int x, int y, int dx, int dy)
{
    const struct view_args *view = &scene->args->view;
    if (!is_ground(scene, x, y))
        return REF_NO;
    double v = disc_depth(scene, x + dx, y + dy), own = ref_key_z(scene->planes->keys[index_of(scene, x + dx, y + dy)]);
    if (scene->args->behind && !((float)(2.0 * own - v) > scene->limit[index_of(scene, x, y)]))
        return REF_NO;
    if (!is_surface(scene, x, y))
        return REF_YES;
    double z = ref_key_z(scene->planes->keys[index_of(scene, x, y)]);
    if (!(v < z))
        return REF_NO;
    const float *n = scene->planes->normal + 4 * (size_t)source_of(scene, x, y);
    struct ref_ray ray = ref_ray(view, x, y);
    double slope = n[0] * (double)view->ray_xs * dx + n[1] * (double)view->ray_ys * dy;
    double steep = fabs(n[0] * (double)view->ray_xs * dx) + fabs(n[1] * (double)view->ray_ys * dy);
    if (n[0] == 0.0f && n[1] == 0.0f && fabsf(n[2]) == 1.0f) // nothing is rounded
        return REF_YES;
    double facing = n[2], terms = fabs((double)n[2]), wrong = 0.0; // wrong: of facing, which is exact in orthographic views
    if (view->perspective) {
        facing -= n[0] * ray.u + n[1] * ray.v;
        terms += fabs(n[0] * ray.u) + fabs(n[1] * ray.v);
        wrong = fabs((double)n[0]) * ray.error_u + fabs((double)n[1]) * ray.error_v + TOL_FRONT * terms;
    }
    double doubt = (v + z) * (TOL_FRONT * fabs(facing) + wrong) + (view->perspective ? v : 1.0) * TOL_FRONT * steep;
    // how far the disc lies before the plane, times |n.r|; the normal is taken to face the viewer
    double before = view->perspective ? z * facing - v * (facing - slope) : z * facing + slope - v * facing;
    if (fabs(facing) < wrong)
        return REF_UNSURE;
    before = facing < 0.0 ? -before : before;
    return before > doubt ? REF_YES : before < -doubt ? REF_NO : REF_UNSURE;
}

// Of the 8 pixels around, how many lie beyond the depth v? What is not known does not.
static int beyond(const struct scene *scene, int x, int y, double v)
{
    int count = 0;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++)
            if ((dx || dy) && is_ground(scene, x + dx, y + dy))
                count += !is_surface(scene, x + dx, y + dy) ||
                         ref_key_z(scene->planes->keys[index_of(scene, x + dx, y + dy)]) > v;
    return count;
}

// At how many cross neighbours of the pixel its own disc shows; *open: how many more it may be.
static int edges(const struct scene *scene, int x, int y, int *open)
{
    static const int cross_x[4] = {1, 0, -1, 0}, cross_y[4] = {0, 1, 0, -1};
    const double v = disc_depth(scene, x, y);
    int count = 0;
    *open = 0;
    for (int i = 0; i < 4; i++) {
        if (beyond(scene, x + cross_x[i], y + cross_y[i], v) < PT_LINE_SUPPORT)
            continue; // a stray point behind
        enum ref_truth seen = shows(scene, x + cross_x[i], y + cross_y[i], -cross_x[i], -cross_y[i]);
        count += seen == REF_YES;
        *open += seen == REF_UNSURE;
    }
    return count;
}

static enum ref_truth has_step(const struct scene *scene, int x, int y)
{
    if (!is_surface(scene, x, y))
        return REF_NO;
    int open, count = edges(scene, x, y, &open);
    return count ? REF_YES : open ? REF_UNSURE : REF_NO;
}

// A step with company.
static enum ref_truth has_disc(const struct scene *scene, int x, int y)
{
    enum ref_truth own = has_step(scene, x, y);
    int sure = 0, open = 0;
    for (int dy = -1; dy <= 1 && own != REF_NO; dy++)
        for (int dx = -1; dx <= 1; dx++)
            if (dx || dy) {
                enum ref_truth one = has_step(scene, x + dx, y + dy);
                sure += one == REF_YES;
                open += one == REF_UNSURE;
            }
    if (own == REF_NO || sure + open < PT_LINE_SUPPORT)
        return REF_NO;
    return sure < PT_LINE_SUPPORT ? REF_UNSURE : own;
}

struct best {
    struct ref_range beyond, radius;
    int square, dx, dy;
};

// Of equally near discs in pixels the lower one is taken, then the left one.
static int comes_first(const struct best *a, const struct best *b)
{
    if (a->square != b->square)
        return a->square < b->square;
    return a->dy != b->dy ? a->dy < b->dy : a->dx < b->dx;
}

static struct best search(const struct scene *scene, int x, int y, struct ref_line *out)
{
    const struct lines_args *args = scene->args;
    const int reach = (int)args->reach;
    struct best best = {.beyond = {0.0, 0.0}};
    double open = 0.0; // greatest of those that may show or not
    for (int dy = -reach; dy <= reach; dy++)
        for (int dx = -reach; dx <= reach; dx++) {
            struct best one = {.square = dx * dx + dy * dy, .dx = dx, .dy = dy};
            double apart = sqrt((double)one.square);
            if (!one.square || !(apart < (double)args->most + 0.5) || !is_surface(scene, x + dx, y + dy))
                continue;
            one.radius = radius(scene, x + dx, y + dy);
            one.beyond = (struct ref_range){one.radius.lo + 0.5 - apart, one.radius.hi + 0.5 - apart};
            double doubt = args->world ? TOL_SHARE * (2.0 * (double)args->most + 1.0) : 0.0;
            if (!(one.beyond.hi > 0.0) || one.beyond.hi < best.beyond.hi - doubt)
                continue;
            enum ref_truth seen = shows(scene, x, y, dx, dy);
            enum ref_truth there = seen == REF_NO ? REF_NO : has_disc(scene, x + dx, y + dy);
            seen = there == REF_YES ? seen : there;
            if (seen == REF_NO)
                continue;
            if (seen == REF_UNSURE) {
                open = fmax(open, one.beyond.hi);
                continue;
            }
            if (one.beyond.hi > best.beyond.hi + doubt || (one.beyond.hi == best.beyond.hi && comes_first(&one, &best))) {
                out->shared = 0;
                best = one;
            } else if (args->world && one.beyond.hi > best.beyond.hi - doubt) {
                out->shared = 1;
                if (one.beyond.hi > best.beyond.hi)
                    best = one;
            }
        }
    out->unsure |= open > 0.0 && open >= best.beyond.lo;
    return best;
}

// What [D 3.5] leaves of a pixel with k edges, at most the line's width.
static double own_share(const struct scene *scene, int x, int y, struct ref_line *out)
{
    enum ref_truth there = scene->args->antialias ? has_disc(scene, x, y) : REF_NO;
    int open, count = there == REF_NO ? 0 : edges(scene, x, y, &open);
    out->unsure |= there == REF_UNSURE || (there == REF_YES && open > 0);
    return count ? fmin(1.0 - fmax(5.0 / 6.0 - count / 3.0, 1.0 / 6.0), radius(scene, x, y).hi) : 0.0;
}

struct ref_line ref_lines(const struct lines_args *args, const struct ref_planes *planes, const float *limit, int x, int y)
{
    const struct scene scene = {args, planes, limit};
    struct ref_line out = {0};
    struct best best = search(&scene, x, y, &out);
    double beyond = best.beyond.hi, fade = fmax(1.0, (double)args->soft * (best.radius.hi + 0.5));
    out.error = TOL_SHARE * (2.0 * (double)args->most + 1.0) / fade;
    if (!args->antialias && beyond > 0.0) { // whole pixels
        out.unsure |= fabs(beyond - (double)PT_LINE_WITHIN) <= out.error;
        beyond = beyond >= (double)PT_LINE_WITHIN ? beyond + 1.0 - (double)PT_LINE_WITHIN : 0.0;
    }
    out.share = fmin(beyond / fade, 1.0);
    out.nearest = (uint32_t)(index_of(&scene, x, y)) + (uint32_t)best.dx + (uint32_t)best.dy * args->view.width;
    double own = own_share(&scene, x, y, &out);
    out.shared |= own > 0.0 && fabs(own - out.share) <= out.error;
    if (own > out.share) {
        out.shared &= own <= out.share + out.error;
        out.share = own;
        out.nearest = (uint32_t)index_of(&scene, x, y);
    }
    return out;
}
