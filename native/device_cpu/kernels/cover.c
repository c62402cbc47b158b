// SPDX-License-Identifier: GPL-3.0-or-later
// cover: pixels in which a mesh lies in front show it; its normal, layer distance and colour there; twin of
// shaders/kernels/cover.comp
#include "triangle.h"
#include "shared/meshes.h"

static void write_shown(const struct pt_cpu_call *call, const struct pt_triangle *t, size_t at, vi z, const vf n[4], vm front)
{
    const struct cover_args *args = call->arguments;
    const struct mesh_args *mesh = &args->mesh;
    const float *vertices = PT_DATA(call, cover, vertices);
    uint64_t *shown = PT_DATA(call, cover, shown);
    float *normals = PT_DATA(call, cover, shown_normal), *albedo = PT_DATA(call, cover, albedo);
    vf color[4];
    vf smooth[4] = {n[0], n[1], n[2], n[3]};
    uint32_t zs[PT_LANES];
    if (mesh->has_normals) {
        const vf object[3] = {pt_between(t, vertices, 3, front), pt_between(t, vertices, 4, front),
                              pt_between(t, vertices, 5, front)};
        pt_turn_normal(mesh, object, smooth);
    }
    for (uint32_t k = 0; k < 3; k++)
        color[k] = mesh->has_colors ? pt_between(t, vertices, 3 + 3 * mesh->has_normals + k, front) : vf_set(mesh->color[k]);
    color[3] = vf_set(1.0f);
    vi_store(zs, z);
    vf_store4(normals + 4 * at, smooth, vm_bits(front));
    vf_store4(albedo + 4 * at, color, vm_bits(front));
    for (uint32_t left = vm_bits(front); left; left &= left - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(left);
        shown[at + i] = (uint64_t)zs[i] << 32 | (uint32_t)(args->first + at + i);
    }
}

static void cover_pixels(const struct pt_cpu_call *call, uint32_t x, uint32_t y, vi index, vi z, vm front)
{
    const struct cover_args *args = call->arguments;
    const struct view_args *view = &args->view;
    uint64_t *keys = PT_DATA(call, cover, keys);
    const uint64_t *mesh_keys = PT_DATA(call, cover, mesh_keys);
    uint32_t *from = PT_DATA(call, cover, from);
    float *normals = PT_DATA(call, cover, normal), *deff = PT_DATA(call, cover, deff);
    size_t at = (size_t)y * view->width + x;
    struct pt_triangle t;
    vf ray[2], n[4];
    pt_find_triangle(view, &args->mesh, PT_DATA(call, cover, vertices), PT_DATA(call, cover, indices), index, x, y, front,
                     &t); // 1.
    vf_ray(view, x, y, ray);
    pt_plane_normal(view, &args->mesh, &t, ray, n); // 2.
    // 3. layer distance of what is as dense as the pixels
    n[3] = vf_rcp(vf_max(vf_cosine(view, n, ray), vf_set(PT_COSINE_FLOOR)));
    vf_store_where(deff + at, vf_layer_distance(view, 0.0f, vf_footprint(view, vi_float(z)), vi_float(z), n[3]), front);
    // 4. a point's normal stays: pixels around may show it
    vi own = vi_add(vi_set((uint32_t)at), vi_lanes());
    vm measured = vm_and(vi_eq(vi_and(vi_load(from + at), vi_set(~PT_FROM_MIXED)), own),
                         vm_not(vi_eq(vi_load_z(keys + at), vi_set(PT_KEY_EMPTY_Z))));
    vf_store4(normals + 4 * at, n, vm_bits(vm_and(front, vm_not(measured))));
    vi_store_where(from + at, own, front);
    for (uint32_t left = vm_bits(front); left; left &= left - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(left);
        keys[at + i] = mesh_keys[at + i];
    }
    // 5. what shading asks for
    if (args->shown)
        write_shown(call, &t, at, z, n, front);
}

static void cover_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct cover_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const uint64_t *keys = PT_DATA(call, cover, keys), *mesh_keys = PT_DATA(call, cover, mesh_keys);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * args->view.width + x;
        vi z = vi_load_z(mesh_keys + at), other = vi_load_z(keys + at);
        vi index = vi_sub(vi_load_id(mesh_keys + at), vi_set(args->mesh.id_base));
        vm front = vm_or(vi_lt_unsigned(z, other),
                         vm_and(vi_eq(z, other), vi_lt_unsigned(vi_load_id(mesh_keys + at), vi_load_id(keys + at))));
        if (args->behind) // a pixel that was filled across a layer taken before
            front = vm_or(front, vf_le(vi_float(other), vf_load((const float *)PT_DATA(call, cover, limit) + at)));
        front = vm_and(front,
                       vm_and(vi_lt_unsigned(index, vi_set(args->mesh.id_count)), vm_not(vi_eq(z, vi_set(PT_KEY_EMPTY_Z)))));
        front = vm_and(front, vm_first(pt_lanes_left(x, rect[2])));
        if (vm_bits(front))
            cover_pixels(call, x, y, index, z, front);
    }
}

int PT_KERNEL_ENTRY(cover)(const struct pt_cpu_call *call)
{
    const struct cover_args *args = call->arguments;
    return pt_rows(call, &args->view, cover_row);
}
