// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 1, effective layer distance: d_eff = max(d_min, K spacing, footprint, 4 ulp) / max(|n.v|, C), and what sigma makes of it.
#include "reference.h"
#include "tolerances.h"
#include "shared/measured.h"

#include <math.h>

// The view-space normal of the point, not yet unit, and the absolute sums that bound its rounding.
static struct ref_vec transform(const float m[9], struct ref_vec n, double *terms)
{
    struct ref_vec out = ref_vec(m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                                 m[6] * n.x + m[7] * n.y + m[8] * n.z);
    *terms = 0.0;
    for (int i = 0; i < 9; i++)
        *terms += fabs((double)m[i]); // |n| <= 1: what cancels in n is off by a share of 1
    return out;
}

struct ref_resolve ref_resolve(const struct resolve_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    uint64_t key = planes->keys[pixel];
    uint32_t word = planes->surfels[ref_key_id(key) - instance->id_base];
    double z = ref_key_z(key);
    struct ref_vec viewer = ref_viewer(view, ref_ray(view, x, y)), n = {0.0, 0.0, 0.0};
    struct ref_resolve out = {.from = (uint32_t)pixel, .normal_error = TOL_NORMAL};
    int has = 0;
    if (!instance->has_normals) {
        n = ref_unit(ref_vec_of(planes->normal + 4 * pixel));
        has = ref_length(n) > 0.0;
    } else if (ref_decode_normal(word, &n)) {
        double terms;
        n = transform(instance->normal_matrix, n, &terms);
        has = ref_length(n) > 0.0;
        if (has)
            out.normal_error *= terms / ref_length(n);
        n = ref_unit(n);
    }
    double cosine = 1.0, cosine_error = 0.0;
    if (has) {
        cosine = fabs(ref_dot(n, viewer));
        cosine_error = out.normal_error * (fabs(viewer.x) + fabs(viewer.y) + fabs(viewer.z));
    } else {
        n = viewer;
    }
    out.n = n;
    double floored = fmax(cosine, (double)PT_COSINE_FLOOR);
    double share = TOL_LAYER + (cosine + cosine_error > (double)PT_COSINE_FLOOR ? cosine_error / floored : 0.0);
    out.inverse = 1.0 / floored;
    out.inverse_error = out.inverse * share;
    const double spacing = instance->spacing[word >> PT_SPACING_SHIFT];
    out.span = ref_layer_minimum(view, instance->d_min, spacing, z) * out.inverse;
    out.deff = out.span;
    if (args->sigma_scale > 0.0f) {
        const uint32_t class = planes->shapes[ref_key_id(key) - instance->id_base] / 65536 % 64;
        const double sigma = (double)instance->spacing[class] * (double)args->sigma_scale;
        if (class)
            out.deff = ref_sure_minimum(view, instance->d_min, sigma, spacing, z) * out.inverse;
    }
    out.span_error = out.span * share;
    out.deff_error = out.deff * share;
    return out;
}
