// SPDX-License-Identifier: GPL-3.0-or-later
// [K II.D, Fig. 7, 8], SPEC 6: every triangle between the cells around a pixel, one by one.
#include "reference.h"
#include "tolerances.h"
#include "shared/ranges.h"

#include <math.h>

struct corner {
    int there;
    double x, y, z, error; // from the pixel's centre, in cells; error of x and y
    size_t cell;
};

struct around {
    const struct magnify_args *args;
    struct corner corners[9]; // row by row
};

struct face {
    enum ref_truth covers;
    int k[3];
    double weight[3], z, z_error;
};

// What is settled so far: the nearest, and whether something undecided may be before it.
struct best {
    struct face face;
    int some;
    double open_z; // of the nearest undecided one
};

static struct around look(const struct magnify_args *args, const float *places, int x, int y)
{
    const struct view_args *view = &args->view, *cells = &args->cells;
    const double px = (view->origin_x + x + 0.5) * (double)args->inverse,
                 py = (view->origin_y + y + 0.5) * (double)args->inverse;
    struct around out = {.args = args};
    for (int k = 0; k < 9; k++) {
        const int cx = (int)floor(px) + k % 3 - 1, cy = (int)floor(py) + k / 3 - 1; // of the whole picture
        const int ix = cx - cells->origin_x, iy = cy - cells->origin_y;
        struct corner *c = &out.corners[k];
        c->there = ix >= (int)cells->rect[0] && ix < (int)cells->rect[2] && iy >= (int)cells->rect[1] &&
                   iy < (int)cells->rect[3];
        if (!c->there)
            continue;
        c->cell = (size_t)iy * cells->width + (size_t)ix;
        const float *place = places + 4 * c->cell;
        c->there = place[3] > 0.0f;
        c->x = cx + (double)place[0] - px;
        c->y = cy + (double)place[1] - py;
        c->z = (double)place[2];
        c->error = 4.0 * TOL_UNIT * (fabs(px) + fabs(py) + 4.0);
    }
    return out;
}

static double step_from(const struct magnify_args *args, double z)
{
    return ref_range_step(&args->cells, args->gamma, args->gamma_cells, z);
}

// Of `count` corners.
static enum ref_truth joined(const struct around *a, const int *k, int count)
{
    double nearest = INFINITY, farthest = 0.0;
    for (int i = 0; i < count; i++) {
        if (!a->corners[k[i]].there)
            return REF_NO;
        nearest = fmin(nearest, a->corners[k[i]].z);
        farthest = fmax(farthest, a->corners[k[i]].z);
    }
    const double step = step_from(a->args, nearest), deep = farthest - nearest, slack = 8.0 * TOL_UNIT * (step + farthest);
    return fabs(deep - step) <= slack ? REF_UNSURE : deep <= step ? REF_YES : REF_NO;
}

static enum ref_truth both(enum ref_truth a, enum ref_truth b)
{
    return a == REF_NO || b == REF_NO ? REF_NO : a == REF_YES && b == REF_YES ? REF_YES : REF_UNSURE;
}

static enum ref_truth negated(enum ref_truth a) { return a == REF_UNSURE ? a : a == REF_YES ? REF_NO : REF_YES; }

// A triangle over the pixel's centre, where it is used.
static struct face face_of(const struct around *a, const int k[3], enum ref_truth used, int apart)
{
    struct face face = {.covers = used, .k = {k[0], k[1], k[2]}};
    double sum = 0.0, farthest = 0.0, smallest = INFINITY, error = 0.0, edges[3];
    int low = 0, high = 0;
    for (int i = 0; i < 3; i++) {
        const struct corner *p = &a->corners[k[(i + 1) % 3]], *q = &a->corners[k[(i + 2) % 3]];
        const double off = 2.0 * (p->error * (fabs(q->x) + fabs(q->y)) + q->error * (fabs(p->x) + fabs(p->y))) +
                           4.0 * TOL_UNIT * (fabs(p->x * q->y) + fabs(p->y * q->x));
        edges[i] = p->x * q->y - p->y * q->x;
        low += edges[i] < -off;
        high += edges[i] > off;
        smallest = fmin(smallest, fabs(edges[i]));
        error = fmax(error, off);
        farthest = fmax(farthest, a->corners[k[i]].z);
    }
    if (low && high)
        face.covers = REF_NO;
    else if (low + high < 3)
        face.covers = both(face.covers, REF_UNSURE);
    for (int i = 0; i < 3; i++) {
        const struct corner *c = &a->corners[k[i]];
        const double step = step_from(a->args, c->z), deep = farthest - c->z;
        face.weight[i] = fabs(edges[i]) * (a->args->view.perspective ? 1.0 / c->z : 1.0);
        if (apart && deep > step)
            face.weight[i] = 0.0;
        if (apart && fabs(deep - step) <= 8.0 * TOL_UNIT * (step + farthest))
            face.covers = both(face.covers, REF_UNSURE);
        sum += face.weight[i];
    }
    double spread = 0.0;
    for (int i = 0; i < 3; i++) {
        face.weight[i] /= sum;
        face.z += face.weight[i] * a->corners[k[i]].z;
        spread = fmax(spread, farthest - a->corners[k[i]].z);
    }
    const double size = fabs(edges[0]) + fabs(edges[1]) + fabs(edges[2]);
    face.z_error = spread * 4.0 * error / fmax(size, 1e-30) + 16.0 * TOL_UNIT * face.z;
    if (!(sum > 1e-20))
        face.covers = both(face.covers, REF_UNSURE);
    return face;
}

static void offer(struct best *best, const struct face *face)
{
    if (face->covers == REF_NO)
        return;
    if (face->covers == REF_UNSURE) {
        best->open_z = fmin(best->open_z, isfinite(face->z) ? face->z - face->z_error : 0.0);
        return;
    }
    if (best->some && fabs(face->z - best->face.z) <= face->z_error + best->face.z_error)
        best->open_z = fmin(best->open_z, face->z);
    if (!best->some || face->z < best->face.z)
        best->face = *face;
    best->some = 1;
}

static void offer_faces(const struct around *a, int apart, struct best *best)
{
    for (int block = 0; block < 4; block++) {
        const int p = block % 2 + 3 * (block / 2), q = p + 1, r = p + 3, s = p + 4;
        const int triples[4][3] = {{p, q, r}, {q, s, r}, {p, q, s}, {p, s, r}}, all[4] = {p, q, r, s};
        const enum ref_truth whole = joined(a, all, 4);
        const struct corner *c = a->corners;
        const double falls = fabs(c[q].z - c[r].z), rises = fabs(c[p].z - c[s].z);
        enum ref_truth falling = falls <= rises ? REF_YES : REF_NO;
        if (whole != REF_NO && fabs(falls - rises) <= 4.0 * TOL_UNIT * (c[p].z + c[s].z) && falls != rises)
            falling = REF_UNSURE;
        for (int t = 0; t < 4; t++) {
            enum ref_truth fits = joined(a, triples[t], 3);
            if (apart && (!c[triples[t][0]].there || !c[triples[t][1]].there || !c[triples[t][2]].there))
                continue;
            fits = apart ? negated(fits) : fits;
            enum ref_truth divided = t < 2 ? falling : negated(falling);
            const enum ref_truth used = whole == REF_YES  ? both(fits, divided)
                                        : whole == REF_NO ? fits
                                                          : both(fits, divided == REF_YES ? REF_YES : REF_UNSURE);
            if (used == REF_NO)
                continue;
            const struct face face = face_of(a, triples[t], used, apart);
            offer(best, &face);
        }
    }
}

static enum ref_truth in_pixel(const struct around *a, int k)
{
    const double pixel = (double)a->args->pixel, x = a->corners[k].x * pixel, y = a->corners[k].y * pixel;
    const double slack = a->corners[k].error * pixel + 4.0 * TOL_UNIT;
    if (fmin(fabs(fabs(x) - 0.5), fabs(fabs(y) - 0.5)) <= slack && fabs(x) < 0.5 + slack && fabs(y) < 0.5 + slack)
        return REF_UNSURE;
    return fabs(x) < 0.5 && fabs(y) < 0.5 ? REF_YES : REF_NO;
}

static void offer_places(const struct around *a, struct best *best)
{
    for (int k = 0; k < 9; k++)
        if (a->corners[k].there) {
            const struct face face = {.covers = in_pixel(a, k), .k = {k, k, k}, .weight = {1.0}, .z = a->corners[k].z};
            offer(best, &face);
        }
}

// What of the first of two passes is not sharp, for a face's heaviest corner.
static enum ref_truth unsharp(const struct around *a, const float *place, const float *inclined, struct ref_ray ray)
{
    const struct view_args *view = &a->args->view;
    const double cosine = fabs(ref_dot(ref_vec_of(inclined), ref_viewer(view, ray))), least = (double)a->args->cosine;
    if (inclined[3] < 8.0f || place[3] > a->args->most)
        return REF_YES;
    return fabs(cosine - least) < 32.0 * TOL_UNIT ? REF_UNSURE : cosine < least ? REF_YES : REF_NO;
}

static void set_shown(const struct around *a, const struct face *face, const uint64_t *cells, const float *places,
                      const float *merged, const float *inclined, int x, int y, struct ref_magnify *out)
{
    const struct view_args *view = &a->args->view;
    struct ref_vec n = ref_vec(0.0, 0.0, 0.0);
    int most = 0;
    double size = 0.0;
    for (int i = 0; i < 3; i++) {
        const size_t at = 4 * a->corners[face->k[i]].cell;
        n = ref_add(n, ref_scale(ref_vec_of(inclined + at), face->weight[i]));
        for (int k = 0; k < 4; k++) {
            out->color[k] += face->weight[i] * (double)merged[at + (size_t)k];
            size = fmax(size, fabs((double)merged[at + (size_t)k]));
        }
        if (face->weight[i] > face->weight[most])
            most = i;
    }
    for (int i = 0; i < 3; i++) // two weigh as much
        out->unsure |= i != most && face->k[i] != face->k[most] && face->weight[most] - face->weight[i] < 1e-4;
    const struct corner *c = &a->corners[face->k[most]];
    const double error = fmin(64.0 * face->z_error / fmax(face->z, 1e-30), 1.0) + 2e-5, length = ref_length(n);
    const struct ref_ray ray = ref_ray(view, x, y);
    out->cell = c->cell;
    out->id = ref_key_id(cells[c->cell]);
    if (a->args->pass & PT_RANGE_COARSE && out->marked != REF_YES)
        out->marked = unsharp(a, places + 4 * c->cell, inclined + 4 * c->cell, ray);
    out->z = face->z;
    out->z_error = face->z_error;
    out->color[3] = fmin(out->color[3], 1.0);
    out->color_error = 64.0 * error * (size + 1.0);
    out->unsure |= length < 0.02;
    out->n = ref_unit(n);
    out->normal_error = 64.0 * error / fmax(length, 1e-3);
    const double cosine = fmax(fabs(ref_dot(out->n, ref_viewer(view, ray))), (double)PT_COSINE_FLOOR);
    const double thick = fmax(ref_range_gamma(&a->args->cells, a->args->gamma, a->args->gamma_cells, face->z),
                              2.0 * ref_footprint(&a->args->cells, face->z));
    out->deff = fmax(fmax(fmax((double)a->args->d_min, thick), ref_footprint(view, face->z)), ref_ulp4(face->z)) / cosine;
    out->deff_error = out->deff * (2.0 * out->normal_error / cosine + 64.0 * TOL_UNIT);
    const double pixel = (double)a->args->pixel;
    out->away = in_pixel(a, face->k[most]) == REF_YES ? 0.0 : pixel * hypot(c->x, c->y);
    out->unsure |= in_pixel(a, face->k[most]) == REF_UNSURE;
    out->away_error = pixel * 4.0 * c->error + 16.0 * TOL_UNIT * out->away;
}

struct ref_magnify ref_magnify(const struct magnify_args *args, const uint64_t *cells, const float *places, const float *merged,
                               const float *inclined, int x, int y)
{
    const struct around a = look(args, places, x, y);
    struct best best = {.open_z = INFINITY};
    struct ref_magnify out = {0};
    const double px = (args->view.origin_x + x + 0.5) * (double)args->inverse,
                 py = (args->view.origin_y + y + 0.5) * (double)args->inverse;
    const double slack = 4.0 * TOL_UNIT * (fabs(px) + fabs(py));
    out.unsure = fabs(px - round(px)) <= slack || fabs(py - round(py)) <= slack; // of two cells
    offer_faces(&a, 0, &best);
    const double open_face = best.open_z;
    out.marked = args->pass & PT_RANGE_COARSE && !best.some ? REF_YES : REF_NO;
    if (!best.some && !(args->pass & PT_RANGE_FINE))
        offer_places(&a, &best);
    if (!best.some)
        offer_faces(&a, 1, &best);
    out.unsure |= args->pass & PT_RANGE_COARSE && isfinite(open_face) && out.marked == REF_YES; // a face or none
    out.shown = best.some;
    out.unsure |= best.some ? best.open_z <= best.face.z + best.face.z_error : isfinite(best.open_z);
    if (best.some)
        set_shown(&a, &best.face, cells, places, merged, inclined, x, y, &out);
    return out;
}
