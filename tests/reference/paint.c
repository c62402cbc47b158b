// SPDX-License-Identifier: GPL-3.0-or-later
// An image on a triangle: where the pixel's centre and its neighbours' lie on it, and what is there.
#include "reference.h"
#include "tolerances.h"
#include "shared/meshes.h"

#include <math.h>

struct spot {
    double at[2], side[2][2]; // widths and heights of the image
    double error;             // of `at`
    double side_error;        // share of a side
};

static double area(const double a[2], const double b[2]) { return a[0] * b[1] - b[0] * a[1]; }

// Where the centre (cx, cy) lies; 0 beyond the plane's horizon. *least: the sum of areas over the largest of them.
static int place(const double corner[3][3], const double uv[3][2], const struct view_args *view, double cx, double cy,
                 double out[2], double *least)
{
    double away[3][2], f[3], sum = 0.0, most = 0.0;
    for (int i = 0; i < 3; i++) {
        double w = view->perspective ? corner[i][2] : 1.0;
        away[i][0] = corner[i][0] - cx * w;
        away[i][1] = corner[i][1] - cy * w;
    }
    for (int i = 0; i < 3; i++) {
        f[i] = area(away[(i + 1) % 3], away[(i + 2) % 3]);
        sum += f[i];
        most = fmax(most, fabs(f[i]));
    }
    for (int k = 0; k < 2; k++)
        out[k] = (f[0] * uv[0][k] + f[1] * uv[1][k] + f[2] * uv[2][k]) / sum;
    *least = fabs(sum) / most;
    return sum < 0.0 ? -1 : 1;
}

static void texel(const struct texture_args *image, const uint32_t *texels, uint32_t level, long x, long y, double c[4])
{
    const uint32_t *size = image->sizes + 3 * level;
    long at[2] = {x, y};
    for (int k = 0; k < 2; k++) {
        long n = size[k];
        if (image->wrap == PT_WRAP_CLIP)
            continue;
        at[k] = image->wrap == PT_WRAP_REPEAT ? (at[k] % n + n) % n : at[k] < 0 ? 0 : at[k] >= n ? n - 1 : at[k];
    }
    size_t index = size[2] + (size_t)at[1] * size[0] + (size_t)at[0];
    for (int k = 0; k < 4; k++) {
        if (image->format == PT_TEXELS_FLOAT) {
            float value;
            __builtin_memcpy(&value, texels + 4 * index + k, 4);
            c[k] = (double)value;
            continue;
        }
        double byte = texels[index] >> 8 * k & 255u, s = byte / 255.0;
        c[k] = k < 3 && image->format == PT_TEXELS_SRGB ? (s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4)) : s;
    }
}

static void add(const double c[4], double weight, double sum[4])
{
    for (int k = 0; k < 3; k++)
        sum[k] += c[k] * c[3] * weight;
    sum[3] += c[3] * weight;
}

static void add_level(const struct texture_args *image, const uint32_t *texels, uint32_t level, const double at[2],
                      double weight, double sum[4])
{
    double x = at[0] * image->sizes[3 * level] - 0.5, y = at[1] * image->sizes[3 * level + 1] - 0.5;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++) {
            double c[4], u = x - floor(x), v = y - floor(y);
            int64_t column = (int64_t)floor(x) + i, row = (int64_t)floor(y) + j;
            if (image->wrap == PT_WRAP_CLIP &&
                (column < 0 || row < 0 || column >= image->sizes[3 * level] || row >= image->sizes[3 * level + 1]))
                continue;
            texel(image, texels, level, column, row, c);
            add(c, weight * (i ? u : 1.0 - u) * (j ? v : 1.0 - v), sum);
        }
}

// Into 0..1, a clipped image's places stay; 0 where it does not reach. *open: it nearly does, or nearly not.
static int wrap(const struct texture_args *image, double at[2], double error, int *open)
{
    int reached = 1;
    for (int k = 0; k < 2; k++) {
        if (image->wrap == PT_WRAP_CLIP) {
            reached = reached && at[k] >= 0.0 && at[k] <= 1.0;
            *open |= fabs(at[k]) < error || fabs(at[k] - 1.0) < error;
        }
        if (image->wrap == PT_WRAP_CLIP)
            continue;
        at[k] = image->wrap == PT_WRAP_REPEAT ? at[k] - floor(at[k]) : fmin(fmax(at[k], 0.0), 1.0);
    }
    return reached;
}

static void probe(const struct texture_args *image, const uint32_t *texels, const struct spot *spot, struct ref_paint *out)
{
    double square[2], sum[4] = {0, 0, 0, 0}, most = (double)image->levels - 1.0, size = fmax(image->sizes[0], image->sizes[1]);
    for (int n = 0; n < 2; n++)
        square[n] = pow(spot->side[n][0] * image->sizes[0], 2.0) + pow(spot->side[n][1] * image->sizes[1], 2.0);
    double major = fmax(square[0], square[1]), minor = fmin(square[0], square[1]);
    const double *along = square[0] < square[1] ? spot->side[1] : spot->side[0];
    int count = 1, probes = (int)PT_PROBES;
    for (int k = 1; k < probes; k++) {
        count += major > k * k * fmax(minor, 1.0);
        out->open |= fabs(major - k * k * fmax(minor, 1.0)) <= 4.0 * spot->side_error * major;
    }
    out->open |= count > 1 && fabs(square[0] - square[1]) <= 4.0 * spot->side_error * major;
    double level = fmin(fmax(0.5 * log2(fmax(minor, major / (probes * probes))), 0.0), most), beyond = level - floor(level);
    int sharp = image->nearest && major <= 1.0;
    out->open |= image->nearest && fabs(major - 1.0) <= 4.0 * spot->side_error;
    for (int i = 0; i < (sharp ? 1 : count); i++) {
        double at[2];
        for (int k = 0; k < 2; k++)
            at[k] = spot->at[k] + (sharp ? 0.0 : ((i + 0.5) / count - 0.5) * along[k]);
        int near = 0, on = wrap(image, at, spot->error + 2.0 * spot->side_error * sqrt(major), &near);
        out->open |= sharp && near;
        if (sharp && !on)
            continue;
        if (sharp) {
            double c[4], u = at[0] * image->sizes[0], v = at[1] * image->sizes[1];
            out->open |= fabs(u - round(u)) <= spot->error * size || fabs(v - round(v)) <= spot->error * size;
            texel(image, texels, 0, (long)fmin(floor(u), image->sizes[0] - 1.0), (long)fmin(floor(v), image->sizes[1] - 1.0),
                  c);
            add(c, 1.0, sum);
            continue;
        }
        add_level(image, texels, (uint32_t)level, at, (1.0 - beyond) / count, sum);
        if (beyond > 0.0)
            add_level(image, texels, (uint32_t)fmin(level + 1.0, most), at, beyond / count, sum);
    }
    for (int k = 0; k < 3; k++)
        out->color[k] = !image->blend && !(image->cut > 0.0f) ? sum[k] : sum[3] >= 1e-6 ? sum[k] / sum[3] : 0.0;
    out->color[3] = fmin(sum[3], 1.0);
    // texels differ by at most 1: a place off by a texel of its level, and a level off by one, change no more than that
    double finest = exp2(floor(level)), moved = 2.0 * (size * spot->error + 0.5 * spot->side_error * sqrt(major)) / finest;
    out->error = moved + (level > 0.0 || major > 0.9 ? 2.0 * spot->side_error : 0.0) + 2.0 * TOL_COLOR;
}

struct ref_paint ref_paint(const struct paint_args *args, const float *vertices, const uint32_t *indices,
                           const uint32_t *texels, uint64_t shown, uint64_t mesh_key, int x, int y)
{
    const struct view_args *view = &args->view;
    const struct mesh_args *mesh = &args->mesh;
    struct ref_paint out = {0};
    uint32_t triangle = ref_key_id(mesh_key) - mesh->id_base;
    out.ours = triangle < mesh->id_count && isfinite(ref_key_z(shown));
    if (!out.ours)
        return out;
    double corner[3][3], uv[3][2], widest = 0.0, moved = 0.0, cx = view->origin_x + x + 0.5, cy = view->origin_y + y + 0.5;
    for (int i = 0; i < 3; i++) {
        const float *v = vertices + (size_t)mesh->stride * indices[3 * (size_t)triangle + (size_t)i];
        double terms = 0.0;
        for (int k = 0; k < 3; k++) {
            corner[i][k] = (double)mesh->lo[k] + (double)mesh->hi[k];
            for (int c = 0; c < 3; c++)
                corner[i][k] += (double)mesh->row[3 * k + c] * (double)v[c];
            terms += fabs(corner[i][k]) + fabs((double)mesh->hi[k]);
        }
        for (int k = 0; k < 2; k++) {
            uv[i][k] = (double)v[mesh->texture.uv + (uint32_t)k];
            widest = fmax(widest, fabs(uv[i][k]));
        }
        moved = fmax(moved, 4.0 * TOL_UNIT * (terms + (cx + cy) * fabs(corner[i][2])));
    }
    struct spot spot = {{0, 0}, {{0, 0}, {0, 0}}, 0, 0};
    double least, all[3];
    int side = place(corner, uv, view, cx, cy, spot.at, &least), inside = 1;
    double reach = 0.0;
    for (int i = 0; i < 3; i++) {
        double w = view->perspective ? corner[i][2] : 1.0;
        reach = fmax(reach, hypot(corner[i][0] - cx * w, corner[i][1] - cy * w));
    }
    // the sum of areas in float32; a key may name a triangle that the centre misses: shares are cut off then
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        const double *a = corner[(i + 1) % 3], *b = corner[(i + 2) % 3];
        double wa = view->perspective ? a[2] : 1.0, wb = view->perspective ? b[2] : 1.0;
        double p[2] = {a[0] - cx * wa, a[1] - cy * wa}, q[2] = {b[0] - cx * wb, b[1] - cy * wb};
        all[i] = area(p, q) * side;
        sum += all[i];
    }
    for (int i = 0; i < 3; i++)
        inside = inside && all[i] >= 0.01 * sum;
    for (int i = 0; i < 3; i++)
        inside = inside && (!view->perspective || corner[i][2] > 0.0);
    if (!inside) {
        out.open = 1;
        return out;
    }
    double share = 6.0 * moved * (reach + moved) / sum + 12.0 * TOL_UNIT;
    spot.error = share * widest * 2.0;
    for (int next = 0; next < 2; next++) {
        double there[2];
        if (place(corner, uv, view, cx + !next, cy + next, there, &least) != side || least < 0.05)
            out.open = 1; // near the horizon
        for (int k = 0; k < 2; k++)
            spot.side[next][k] = there[k] - spot.at[k];
        double length = hypot(spot.side[next][0], spot.side[next][1]);
        spot.side_error = fmax(spot.side_error, length > 0.0 ? 2.0 * spot.error / length : 1.0);
    }
    if (!out.open)
        probe(&mesh->texture, texels, &spot, &out);
    if (!mesh->texture.blend)
        out.color[3] = 1.0;
    return out;
}
