// SPDX-License-Identifier: GPL-3.0-or-later
// locate: where pixels that show a mesh lie, and which way they face, as points of a cloud; twin of
// shaders/kernels/locate.comp
#include "triangle.h"
#include "shared/meshes.h"

// 2. to the nearest of 8191 steps a side; what is not a number is no normal.
static vi encode_normal(const vf n[3])
{
    const vf one = vf_set(1.0f), zero = vf_zero(), most = vf_set(8190.0f);
    vf sum = (vf_abs(n[0]) + vf_abs(n[1])) + vf_abs(n[2]);
    vm good = vf_le(vf_set(1e-30f), sum);
    vf scale = vf_rcp(vf_select(good, sum, one));
    vf x = n[0] * scale, y = n[1] * scale;
    vf across = one - vf_abs(y), up = one - vf_abs(x); // the lower half is folded over the corners
    vm below = vf_lt(n[2], zero);
    vf fx = vf_select(vf_le(zero, x), across, zero - across), fy = vf_select(vf_le(zero, y), up, zero - up);
    x = vf_select(below, fx, x);
    y = vf_select(below, fy, y);
    vf column = vf_min(vf_max(vf_floor((x * vf_set(4095.0f) + vf_set(4095.0f)) + vf_set(0.5f)), zero), most);
    vf row = vf_min(vf_max(vf_floor((y * vf_set(4095.0f) + vf_set(4095.0f)) + vf_set(0.5f)), zero), most);
    vi word = vi_add(vf_int(column), vi_mul(vf_int(row), vi_set(1u << 13)));
    return vi_select(good, word, vi_set(PT_NORMAL_NONE));
}

static void locate_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct locate_args *args = call->arguments;
    const struct view_args *view = &args->view;
    const uint64_t *shown = PT_DATA(call, locate, shown), *mesh_keys = PT_DATA(call, locate, mesh_keys);
    float *places = (float *)PT_DATA(call, locate, places) + 3 * (size_t)y * view->width;
    uint32_t *words = (uint32_t *)PT_DATA(call, locate, words) + (size_t)y * view->width;
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        const size_t at = (size_t)y * view->width + x;
        vi index;
        const vm ours = pt_pixels_of_mesh(&args->mesh, shown, mesh_keys, at, pt_lanes_left(x, view->rect[2]), &index);
        if (!vm_bits(ours))
            continue;
        struct pt_triangle t;
        vf ray[2], n[3], z = vi_float(vi_load_z(shown + at)), p[3];
        pt_find_triangle(view, &args->mesh, PT_DATA(call, locate, vertices), PT_DATA(call, locate, indices), index, x, y, ours,
                         &t);
        vf_ray(view, x, y, ray);
        pt_plane_normal(view, &args->mesh, &t, ray, n);
        // 1. in view space
        const vf far = view->perspective ? z : vf_set(1.0f);
        p[0] = ray[0] * far;
        p[1] = ray[1] * far;
        p[2] = vf_zero() - (z + vf_set(args->eye_z));
        for (uint32_t k = 0; k < 3; k++)
            vf_store_where(places + (size_t)k * view->width + x, p[k], ours);
        vi_store_where(words + x, encode_normal(n), ours);
    }
}

int PT_KERNEL_ENTRY(locate)(const struct pt_cpu_call *call)
{
    const struct locate_args *args = call->arguments;
    return pt_rows(call, &args->view, locate_row);
}
