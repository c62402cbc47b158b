// SPDX-License-Identifier: GPL-3.0-or-later
// Kinds and footprints: from the plane through a point's neighbours to what a picture may close with it.
#include "neighbourhood.h"
#include "base/elementary.h"
#include "base/vector.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

// ---- the rule of footprints: what is tuned, in one place -------------------------------------------------------------------

#define COVER 1.2         // half axes in spacings: of random points exp(-pi r^2) stay uncovered, 1 %, which filling closes
#define COVER_BORDER 0.35 // across a border
#define COVER_LINE 0.6    // of a line's points, in spacings along it
#define COVER_ROUGH 0.2   // of what is hardly a volume (creases, ornaments), in spacings, so that no cracks show there
#define ROUGH 0.35        // thickness over width, squared: between FLATTEST and this the one turns into the other
#define UNEVEN 2.5        // spacings along and across differ less than this by chance: of random points two in three
#define UNEVEN_DOUBT 4.0  // 16 neighbours on rows 1 : 5 hold too few of the rows beside: they overrate them
#define UNEVEN_MOST 13.0  // what a shape word holds

#define FLATTEST 0.1          // thickness over width, squared: what still is a surface
#define FLATTEST_AFAR 0.2     // from afar: noise of two spacings has 0.1
#define FACING 0.35           // from afar: a volume's dots lie on its plane
#define THICKEST 3.0          // spacings: what is thicker is a volume, however flat from afar
#define SLIMMEST 0.03         // narrowness squared of a line
#define BORDER_GAP -0.8660254 // cosine of 150 degrees without a neighbour: 16 random ones leave them by chance at 0.5 %
#define BORDER_OFFSET 0.2     // of their mean from the point, in distances of the farthest, where gaps are looked for
#define HALF_OFFSET (4.0 / (3.0 * PI)) // of half a disc
#define STRAY_OFFSET 0.5               // of the mean, likewise, to be a stray: what it is far from lies on one side
#define STRAY_DISTANCE 3.5             // to the second nearest neighbour, in distances of neighbours among each other
#define ON_PLANE 0.25                  // spacings: how near to a plane its points lie

// Parts. A neighbour farther than GAP from all others belongs to another part of the scene: the next bar, another leaf. On three tuning
// scenes without their wrong samples (railing, facade, trees; cameras 1, 3, 6) parts bring false surface from 14.8 to 9.9 %, drawn sky
// from 9.6 to 6.3 % and the width of thin parts from 2.10 to 1.75 times their own; lost surface rises from 2.3 to 2.9 %.
// Of random points on a torus, GAP 2.1 divides 2 %. With GAP 2.4 and no FEWEST a random torus drawn as discs had a color error of 0.0060
// instead of 0.0055, which it has again with these, at the same false and lost surface on railing, facade and columns.
#define GAP 2.6          // in the third quartile of neighbours' distances from each other
#define FEWEST 4         // neighbours of a part within what looks like a surface: fewer are apart by chance
#define SLIM 0.1         // narrowness squared of a part that is thin
#define SMALL 2.0        // a part of fewer than one neighbour in so many is small
#define ROW 0.12         // spread across a line, in spacings along it: a row of a scan on a surface shows less, a bar more
#define COVER_ALONG 1.1  // of a line on a plane: half axes in spacings along it,
#define COVER_LEAST 0.45 // at least so many across it,
#define COVER_ACROSS 1.5 // or in RMS distances of its samples across it: evenly spread samples reach to 1.73
#define COVER_PART 0.7   // of a part that is neither line nor surface, in neighbours' distances from each other

// Half axes at most, in neighbours' distances from each other; where a surface is even only those beyond FAR_MUTUAL are cut down.
#define MOST_MUTUAL 1.6
#define AFAR_MUTUAL 1.0 // of what is flat from afar alone, as foliage is. At 3.6 the lattice has 33.9 % false surface, not 32.4
#define FAR_MUTUAL 3.6  // even random points show 2.6, one in a hundred of them more than this

// A lattice is a line near by and a surface farther off. So a point's half axes also have a bound by its nearest neighbors alone. On two
// tuning scenes (railing, facade; cameras 1, 3) it brings false surface from 9.0 to 8.7 % at 19.6 instead of 19.5 dB; COVER_NEAREST 0.75 and
// LEAST_NEAREST 0.6 bring it to 8.2, but open 0.3 % of a view of 170 degrees from within a random sphere (0.1 now), and a slit.
#define NEAREST 4
#define COVER_NEAREST 1.1 // of the spacing that they tell,
#define LEAST_NEAREST 0.8 // but at least so much of the spacing that all neighbors tell

// Half axes from the spacings along the two directions of the plane.
static void cover(double along, double across, struct pt_neighbourhood *out)
{
    out->major = COVER * along;
    out->minor = COVER * across;
}

// ------------------------------------------------------------------------------------------------------------------------------

static double distance_squared(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return pt_dot(d, d);
}

static double nearest_of(const struct pt_sample *sample, uint32_t *distinct)
{
    double nearest = 0.0;
    *distinct = 0;
    for (uint32_t i = 0; i < sample->count; i++) {
        if (!(sample->square[i] > 0.0))
            continue;
        nearest = nearest > 0.0 ? nearest : sqrt(sample->square[i]);
        ++*distinct;
    }
    return nearest;
}

// Median of the neighbours' distances to their nearest among each other; at most 24 of them. upper: their third quartile, or NULL.
static double mutual_distance(const struct pt_sample *sample, double *upper)
{
    double nearest[24], least[24];
    const uint32_t count = sample->count < 24 ? sample->count : 24;
    for (uint32_t i = 0; i < count; i++)
        least[i] = INFINITY;
    for (uint32_t i = 0; i < count; i++) {
        double own = least[i];
        for (uint32_t j = i + 1; j < count; j++) {
            const double square = distance_squared(sample->offset[i], sample->offset[j]);
            own = square < own ? square : own;
            least[j] = square < least[j] ? square : least[j];
        }
        uint32_t at = i;
        for (; at > 0 && nearest[at - 1] > own; at--)
            nearest[at] = nearest[at - 1];
        nearest[at] = own;
    }
    if (upper)
        *upper = count ? sqrt(nearest[3 * count / 4]) : 0.0;
    return count ? sqrt(nearest[count / 2]) : 0.0;
}

static void be_dot(uint32_t kind, double radius, double spacing, double certainty, struct pt_neighbourhood *out)
{
    out->kind = kind;
    out->has_normal = 0;
    out->major = out->minor = radius;
    out->spacing = spacing;
    out->certainty = certainty;
}

// Is it much farther from its neighbours than they are from each other? Looked at only where the third is far already.
static int is_stray(const struct pt_sample *sample, struct pt_neighbourhood *out)
{
    const uint32_t count = sample->count;
    if (count < 6 || sample->square[2] < 0.36 * sample->square[count - 1])
        return 0;
    double mean[3] = {0.0, 0.0, 0.0};
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            mean[k] += sample->offset[i][k] / count;
    if (pt_dot(mean, mean) < STRAY_OFFSET * STRAY_OFFSET * sample->square[count - 1])
        return 0;
    const double mutual = mutual_distance(sample, NULL), second = sqrt(sample->square[1]);
    if (!(second > STRAY_DISTANCE * mutual) || !(mutual > 0.0))
        return 0;
    be_dot(PT_KIND_STRAY, PT_COVER_DOT * mutual, mutual, 1.0 - STRAY_DISTANCE * mutual / second, out);
    return 1;
}

void pt_ellipse_of(const double a[3], const double b[3], double axis[3], double *major, double *minor)
{
    const double aa = pt_dot(a, a), bb = pt_dot(b, b), ab = pt_dot(a, b), half = 0.5 * (aa - bb),
                 root = sqrt(half * half + ab * ab);
    const double turn = 0.5 * pt_atan2(ab, half), c = pt_cos(turn), s = pt_sin(turn);
    for (int k = 0; k < 3; k++)
        axis[k] = c * a[k] + s * b[k];
    *major = sqrt(0.5 * (aa + bb) + root);
    *minor = sqrt(fmax(0.5 * (aa + bb) - root, 0.0));
    const double length = sqrt(pt_dot(axis, axis));
    for (int k = 0; k < 3; k++)
        axis[k] = length > 0.0 ? axis[k] / length : a[k];
}

// ---- on the plane ------------------------------------------------------------------------------------------------------------

struct flat {
    uint32_t count;                                      // neighbours on the plane, and apart from the point
    double u[PT_NEIGHBOURS_MOST], v[PT_NEIGHBOURS_MOST]; // along axis[2] and axis[1] of the plane
    double farthest, mean[2];
};

static void flatten(const struct pt_sample *sample, const struct pt_plane *plane, struct flat *flat)
{
    double most = 0.0, sum[2] = {0.0, 0.0};
    flat->count = 0;
    for (uint32_t i = 0; i < sample->count; i++) {
        const double u = pt_dot(plane->axis[2], sample->offset[i]), v = pt_dot(plane->axis[1], sample->offset[i]);
        if (!(plane->inside >> i & 1u) || !(u * u + v * v > 0.0))
            continue;
        flat->u[flat->count] = u;
        flat->v[flat->count++] = v;
        most = fmax(most, u * u + v * v);
        sum[0] += u;
        sum[1] += v;
    }
    flat->farthest = sqrt(most);
    for (int k = 0; k < 2; k++)
        flat->mean[k] = flat->count ? sum[k] / flat->count : 0.0;
}

static double offset_of(const struct flat *flat) // of the mean, in distances of the farthest
{
    return flat->farthest > 0.0 ? sqrt(flat->mean[0] * flat->mean[0] + flat->mean[1] * flat->mean[1]) / flat->farthest : 0.0;
}

// About 1 / sqrt(points per area): as many lie on a disc as far out as the farthest, or on as much of it as they fill.
static double spacing_on(const struct flat *flat)
{
    const double beyond = (offset_of(flat) - BORDER_OFFSET) / (HALF_OFFSET - BORDER_OFFSET);
    const double filled = 1.0 - 0.5 * fmin(fmax(beyond, 0.0), 1.5);
    return flat->count ? flat->farthest * sqrt(PI * filled / flat->count) : 0.0;
}

// The spacing that the nearest few neighbors on the plane tell, as if each had an equal share of the disc to the farthest of them. Infinite
// if there are fewer.
static double spacing_of_nearest(const struct pt_sample *sample, const struct pt_plane *plane)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < sample->count; i++) {
        found += (plane->inside >> i & 1u) && sample->square[i] > 0.0;
        if (found == NEAREST)
            return sqrt(PI * sample->square[i] / NEAREST);
    }
    return INFINITY;
}

// How much farther neighbours are in one direction than across it, and that direction: from the sum of d d' / |d|^4. On rows
// a apart along and b across, its axes are 3.3 / a^2 and pi / (a b). (The window's own shape is a disc, whatever the rows.)
static double unevenness(const struct flat *flat, double spacing, double direction[2])
{
    double a = 0.0, b = 0.0, c = 0.0;
    for (uint32_t i = 0; i < flat->count; i++) {
        const double u = flat->u[i], v = flat->v[i], square = u * u + v * v;
        const double weight = 1.0 / (square * (square / (spacing * spacing) + 0.1));
        a += weight * u * u;
        b += weight * u * v;
        c += weight * v * v;
    }
    const double half = 0.5 * (a - c), root = sqrt(half * half + b * b), most = 0.5 * (a + c) + root;
    const double least = fmax(0.5 * (a + c) - root, 1e-6 * most);
    const double length = sqrt(b * b + (half + root) * (half + root)); // of the vector along the denser direction
    direction[0] = length > 0.0 ? -b / length : 1.0;
    direction[1] = length > 0.0 ? (half + root) / length : 0.0;
    return most > 0.0 ? most / least : 1.0;
}

// Turns with the angle of (x, y), from 0 to 4.
static double turn_of(double x, double y)
{
    const double part = y / (fabs(x) + fabs(y));
    return x >= 0.0 ? (y >= 0.0 ? part : 4.0 + part) : 2.0 - part;
}

// The cosine of the widest angle without a neighbour, less 2 beyond half a turn, and its middle.
static double widest_gap(const struct flat *flat, double direction[2])
{
    double turn[PT_NEIGHBOURS_MOST], widest = 1.0;
    uint32_t order[PT_NEIGHBOURS_MOST];
    for (uint32_t i = 0; i < flat->count; i++) {
        const double t = turn_of(flat->u[i], flat->v[i]);
        uint32_t at = i;
        for (; at > 0 && turn[at - 1] > t; at--) {
            turn[at] = turn[at - 1];
            order[at] = order[at - 1];
        }
        turn[at] = t;
        order[at] = i;
    }
    for (uint32_t i = 0; i < flat->count; i++) {
        const uint32_t here = order[i], next = order[(i + 1) % flat->count];
        const double step = i + 1 < flat->count ? turn[i + 1] - turn[i] : turn[0] + 4.0 - turn[i];
        if (step < 1.0) // quarters, nearly
            continue;
        const double x = flat->u[here], y = flat->v[here], z = flat->u[next], w = flat->v[next];
        const double one = 1.0 / sqrt(x * x + y * y), two = 1.0 / sqrt(z * z + w * w);
        const double turned = x * w - y * z; // above 0: less than half a turn
        const double cosine = (x * z + y * w) * one * two, gap = turned > 0.0 ? cosine : -2.0 - cosine;
        if (gap >= widest)
            continue;
        widest = gap;
        const double m[2] = {x * one + z * two, y * one + w * two}, length = sqrt(m[0] * m[0] + m[1] * m[1]);
        const double side = turned > 0.0 ? 1.0 : -1.0;
        direction[0] = length > 1e-6 ? side * m[0] / length : -y * one; // opposite: a quarter on
        direction[1] = length > 1e-6 ? side * m[1] / length : x * one;
    }
    return widest;
}

static void set_axis(const struct pt_plane *plane, const double direction[2], struct pt_neighbourhood *out)
{
    for (int k = 0; k < 3; k++)
        out->axis[k] = direction[0] * plane->axis[2][k] + direction[1] * plane->axis[1][k];
}

// The footprint ends at the border: across it the ellipse shrinks.
static void end_at_border(const struct pt_plane *plane, const double major[2], const double gap[2],
                          struct pt_neighbourhood *out)
{
    const double c = gap[0] * major[0] + gap[1] * major[1], s = gap[1] * major[0] - gap[0] * major[1];
    const double across = COVER_BORDER / COVER / sqrt(c * c / (out->major * out->major) + s * s / (out->minor * out->minor));
    const double along = 1.0 / sqrt(s * s / (out->major * out->major) + c * c / (out->minor * out->minor));
    const double side[2] = {-gap[1], gap[0]};
    out->kind = PT_KIND_BORDER;
    out->major = fmax(along, across);
    out->minor = fmin(along, across);
    set_axis(plane, along >= across ? side : gap, out);
}

static void be_surface(const struct pt_sample *sample, const struct pt_plane *plane, struct pt_neighbourhood *out)
{
    struct flat flat;
    double major[2] = {1.0, 0.0}, gap[2] = {1.0, 0.0};
    flatten(sample, plane, &flat);
    out->kind = PT_KIND_SURFACE;
    out->has_normal = 1;
    for (int k = 0; k < 3; k++)
        out->normal[k] = plane->axis[0][k];
    out->spacing = spacing_on(&flat);
    out->uneven = unevenness(&flat, out->spacing, major);
    const double told = fmax(fmin(fmin(1.0 + 2.0 * (out->uneven - UNEVEN), out->uneven), UNEVEN_MOST), 1.0), ratio = sqrt(told);
    const int rows = out->uneven >= PT_UNEVEN_ROWS; // whose nearest are all of one row
    const double nearest = fmax(COVER_NEAREST * spacing_of_nearest(sample, plane), LEAST_NEAREST * out->spacing);
    const double covered = rows ? out->spacing : fmin(out->spacing, nearest);
    cover(covered * ratio, covered / ratio, out);
    set_axis(plane, major, out);
    if (offset_of(&flat) > BORDER_OFFSET && widest_gap(&flat, gap) < BORDER_GAP)
        end_at_border(plane, major, gap, out);
    out->sigma = pt_plane_sigma(sample, plane, &out->beside);
    const double thick = 2.0 * sqrt(plane->value[0] / plane->value[1]), share = (plane->count - 1.0) / sample->count;
    out->certainty = fmax(1.0 - thick, 0.0) * share * (out->kind == PT_KIND_BORDER ? 0.9 : 1.0);
}

static void be_line(const struct pt_sample *sample, const struct pt_plane *plane, struct pt_neighbourhood *out)
{
    const double spacing = 2.0 * sqrt(sample->square[sample->count - 1]) / sample->count;
    const double width = 1.5 * sqrt(plane->value[1]);
    be_dot(PT_KIND_LINE, fmax(COVER_LINE * spacing, width), spacing, 1.0 - sqrt(plane->value[1] / (SLIMMEST * plane->value[2])),
           out);
    out->sigma = sqrt(plane->value[0]);
    for (int k = 0; k < 3; k++)
        out->axis[k] = plane->axis[2][k];
}

static void be_volume(const struct pt_sample *sample, const struct pt_plane *plane, double nearest,
                      struct pt_neighbourhood *out)
{
    const double farthest = sqrt(sample->square[sample->count - 1]);
    const double spacing = farthest * pt_cbrt(4.0 * PI / (3.0 * sample->count));
    const double thick = sqrt(plane->value[0] / plane->value[1]);
    const double rough = fmax((ROUGH - plane->value[0] / plane->value[1]) / (ROUGH - FLATTEST), 0.0);
    const double radius = PT_COVER_DOT * nearest + rough * fmax(COVER_ROUGH * spacing - PT_COVER_DOT * nearest, 0.0);
    be_dot(PT_KIND_VOLUME, radius, fmin(spacing, 2.0 * nearest), fmin(thick, 1.0), out);
    out->sigma = sqrt(plane->value[0]);
}

int pt_neighbourhood_from_afar(const struct pt_sample *sample, const struct pt_plane *plane, double thinning,
                               struct pt_neighbourhood *out)
{
    struct pt_neighbourhood surface = {.kind = 0};
    if (plane->value[0] >= FACING * plane->value[1] || plane->value[1] <= SLIMMEST * plane->value[2])
        return 0;
    out->has_normal = out->certainty * out->certainty > ROUGH; // not at creases, whose two sides it would lie between
    for (int k = 0; k < 3; k++) {
        out->normal[k] = plane->axis[0][k];
        out->axis[k] = plane->axis[2][k];
    }
    if (plane->value[0] >= FLATTEST_AFAR * plane->value[1])
        return 0;
    be_surface(sample, plane, &surface);
    const double scale = 1.0 / sqrt(thinning);
    surface.spacing *= scale;
    surface.major *= scale;
    surface.minor *= scale;
    if (surface.sigma > THICKEST * surface.spacing)
        return 0;
    *out = surface;
    out->afar = 1;
    return 1;
}

int pt_neighbourhood_is_doubtful(const struct pt_neighbourhood *hood)
{
    return hood->kind == PT_KIND_BORDER || (hood->has_normal && hood->uneven > UNEVEN_DOUBT);
}

void pt_neighbourhood_of(const struct pt_sample *sample, const struct pt_plane *plane, struct pt_neighbourhood *out)
{
    uint32_t distinct;
    const double nearest = nearest_of(sample, &distinct);
    *out = (struct pt_neighbourhood){.kind = 0};
    if (!distinct) // alone, or all at one place
        return;
    if (distinct < 3) {
        be_dot(PT_KIND_STRAY, PT_COVER_DOT * nearest, nearest, 0.0, out);
        return;
    }
    if (is_stray(sample, out))
        return;
    if (plane->value[1] <= SLIMMEST * plane->value[2]) {
        be_line(sample, plane, out);
        return;
    }
    struct pt_plane other;
    const int doubtful = pt_plane_is_doubtful(plane);
    const double width = sqrt(PI * sample->square[sample->count - 1] / sample->count); // about a spacing
    if (doubtful && pt_plane_through_most(sample, plane, ON_PLANE * width, &other) &&
        other.value[1] > SLIMMEST * other.value[2])
        be_surface(sample, &other, out);
    else if (plane->value[0] < FLATTEST * plane->value[1])
        be_surface(sample, plane, out);
    else
        be_volume(sample, plane, nearest, out);
}

// ---- parts -------------------------------------------------------------------------------------------------------------------

// Copies to `own` the neighbours that steps of at most `step` reach from the point. Returns 1 if it leaves any out.
static int keep_own_part(const struct pt_sample *sample, double step, struct pt_sample *own)
{
    const uint32_t count = sample->count;
    const double most = step * step;
    uint64_t outside = 0, inside, next;
    for (uint32_t i = 0; i < count; i++)
        outside |= (uint64_t)(sample->square[i] > most) << i;
    inside = next = (count < 64 ? (1ull << count) - 1ull : ~0ull) & ~outside;
    while (next && outside) {
        const uint32_t from = (uint32_t)(63 - __builtin_clzll(next)); // the farthest: most of the rest lies near it
        next &= ~(1ull << from);
        for (uint64_t left = outside; left; left &= left - 1) {
            const uint32_t to = (uint32_t)__builtin_ctzll(left);
            const uint64_t reached = (uint64_t)(distance_squared(sample->offset[from], sample->offset[to]) <= most) << to;
            outside &= ~reached;
            inside |= reached;
            next |= reached;
        }
    }
    if (!outside)
        return 0;
    own->count = 0;
    for (uint32_t i = 0; i < count; i++)
        if (inside >> i & 1u) {
            own->square[own->count] = sample->square[i];
            memcpy(own->offset[own->count++], sample->offset[i], sizeof sample->offset[i]);
        }
    return 1;
}

// Returns 1 if the part is one row of a scan on a surface. Noise alone spreads its samples across. The samples of a bar spread as wide
// as the bar.
static int is_row(const struct pt_sample *own, const struct pt_plane *plane)
{
    if (own->count < 3 || plane->value[1] > SLIMMEST * plane->value[2])
        return 0;
    const double spacing = 2.0 * sqrt(own->square[own->count - 1]) / own->count;
    return plane->value[1] < ROW * ROW * spacing * spacing;
}

// Describes the point by its own part. A part without a normal takes that of the whole neighbourhood. A line on that plane gets an
// ellipse along it.
static void be_part(const struct pt_sample *own, const struct pt_plane *plane, double mutual, struct pt_neighbourhood *hood)
{
    const struct pt_neighbourhood whole = *hood;
    pt_neighbourhood_of(own, plane, hood);
    if (hood->has_normal)
        return;
    if (!own->count)
        hood->kind = PT_KIND_STRAY;
    if (hood->kind != PT_KIND_LINE && hood->major < COVER_PART * mutual)
        hood->major = hood->minor = COVER_PART * mutual;
    if (!(hood->spacing > 0.0))
        hood->spacing = mutual;
    if (!whole.has_normal)
        return;
    memcpy(hood->normal, whole.normal, sizeof hood->normal);
    hood->has_normal = 1;
    hood->sided = whole.sided;
    hood->sigma = hood->sigma > 0.0 ? fmin(hood->sigma, whole.sigma) : whole.sigma;
    const double up = pt_dot(hood->axis, hood->normal), length = sqrt(fmax(1.0 - up * up, 0.0));
    if (hood->kind != PT_KIND_LINE || !(length > 0.1))
        return;
    for (int k = 0; k < 3; k++)
        hood->axis[k] = (hood->axis[k] - up * hood->normal[k]) / length;
    hood->major = COVER_ALONG * hood->spacing;
    hood->minor = fmin(fmax(COVER_LEAST * hood->spacing, COVER_ACROSS * sqrt(plane->value[1])), hood->major);
}

void pt_neighbourhood_bound(const struct pt_sample *sample, struct pt_neighbourhood *hood)
{
    struct pt_sample own;
    double upper;
    const double mutual = mutual_distance(sample, &upper), gap = GAP * upper;
    const double most = (hood->afar ? AFAR_MUTUAL : MOST_MUTUAL) * mutual;
    if (!(mutual > 0.0))
        return;
    if (sample->square[sample->count - 1] > gap * gap && keep_own_part(sample, gap, &own)) {
        struct pt_plane plane;
        pt_plane_fit(&own, own.count >= 64 ? ~0ull : (1ull << own.count) - 1ull, &plane);
        const int slim = plane.value[1] <= SLIM * plane.value[2], small = SMALL * own.count < sample->count;
        const int chance = hood->kind == PT_KIND_SURFACE && (own.count < FEWEST || is_row(&own, &plane));
        if ((slim || small) && !chance)
            be_part(&own, &plane, mutual, hood);
    }
    if (hood->kind == PT_KIND_VOLUME ||
        hood->kind == PT_KIND_STRAY) // filling closes no gap beside a dot that the dot does not reach
        hood->spacing = fmin(hood->spacing, hood->major);
    const int even = hood->kind == PT_KIND_SURFACE && hood->uneven < PT_UNEVEN_ROWS && !hood->afar;
    if (!(hood->major > (even ? FAR_MUTUAL * mutual : most)))
        return;
    hood->spacing = fmin(hood->spacing, most / COVER);
    hood->major = most;
    hood->minor = fmin(hood->minor, most);
}
