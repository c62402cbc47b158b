// SPDX-License-Identifier: GPL-3.0-or-later
// cover: pixels in which a mesh lies in front show it; its normal, layer distance and colour there; twin of
// shaders/kernels/cover.comp
#include "device_cpu/rows.h"

struct triangle {
    vi corner[3];        // first float of each vertex
    vf position[3][3];   // object units
    vf share[3];         // of each vertex at the pixel
};

static vf between(const struct triangle *t, const float *vertices, uint32_t offset, vm lanes)
{
    vf v[3];
    for (int i = 0; i < 3; i++)
        v[i] = vf_gather(vertices, vi_add(t->corner[i], vi_set(offset)), lanes);
    return (t->share[0] * v[0] + t->share[1] * v[1]) + t->share[2] * v[2];
}

// 1. the triangle, and where on it the centres of PT_LANES pixels from (x, y) on lie: areas of the triangles that the centre
// makes with two corners each, as seen from the eye.
static void find_triangle(const struct pt_cpu_call *call, vi index, uint32_t x, uint32_t y, vm lanes, struct triangle *t)
{
    const struct cover_args *args = call->arguments;
    const struct view_args *view = &args->view;
    const struct mesh_args *mesh = &args->mesh;
    const float *vertices = pt_cpu_data(call, 5);
    const vf px = vi_convert(vi_add(vi_set((uint32_t)view->origin_x + x), vi_lanes())) + vf_set(0.5f);
    const vf py = vf_set((float)(view->origin_y + (int32_t)y) + 0.5f);
    vf u[3], v[3], f[3];
    for (uint32_t i = 0; i < 3; i++) {
        vi vertex = vi_gather(pt_cpu_data(call, 6), vi_add(vi_mul(index, vi_set(3)), vi_set(i)), lanes);
        t->corner[i] = vi_mul(vertex, vi_set(mesh->stride));
        vf *p = t->position[i], at[3];
        for (uint32_t k = 0; k < 3; k++)
            p[k] = vf_gather(vertices, vi_add(t->corner[i], vi_set(k)), lanes);
        for (int row = 0; row < 3; row++) {
            const float *r = mesh->row + 3 * row;
            at[row] = (((vf_set(mesh->lo[row]) + vf_set(r[0]) * p[0]) + vf_set(r[1]) * p[1]) + vf_set(r[2]) * p[2]) +
                      vf_set(mesh->hi[row]);
        }
        vf w = view->perspective ? at[2] : vf_set(1.0f);
        u[i] = at[0] - px * w;
        v[i] = at[1] - py * w;
    }
    for (int i = 0; i < 3; i++)
        f[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    vf sum = (f[0] + f[1]) + f[2];
    vm turned = vf_lt(sum, vf_zero());
    for (int i = 0; i < 3; i++)
        f[i] = vf_max(vf_select(turned, vf_zero() - f[i], f[i]), vf_zero());
    sum = (f[0] + f[1]) + f[2];
    vm good = vm_and(vf_le(vf_set(1e-30f), sum), vf_le(sum, vf_set(1e30f)));
    vf scale = vf_rcp(vf_select(good, sum, vf_set(1.0f)));
    for (int i = 0; i < 3; i++)
        t->share[i] = vf_select(good, f[i] * scale, i ? vf_zero() : vf_set(1.0f));
}

// In view space and unit; where it is nothing, as n.
static void turn_normal(const struct mesh_args *mesh, const vf object[3], vf n[3])
{
    const float *m = mesh->normal_matrix;
    vf turned[3];
    for (int k = 0; k < 3; k++)
        turned[k] = (vf_set(m[3 * k]) * object[0] + vf_set(m[3 * k + 1]) * object[1]) + vf_set(m[3 * k + 2]) * object[2];
    vf square = (turned[0] * turned[0] + turned[1] * turned[1]) + turned[2] * turned[2];
    vm good = vm_and(vf_le(vf_set(1e-30f), square), vf_le(square, vf_set(1e30f)));
    vf scale = vf_rsqrt(vf_select(good, square, vf_set(1.0f)));
    for (int k = 0; k < 3; k++)
        n[k] = vf_select(good, turned[k] * scale, n[k]);
}

// 2. the plane's normal; of a triangle without one, towards the eye.
static void plane_normal(const struct cover_args *args, const struct triangle *t, const vf ray[2], vf n[3])
{
    vf a[3], b[3], across[3];
    for (int k = 0; k < 3; k++) {
        a[k] = t->position[1][k] - t->position[0][k];
        b[k] = t->position[2][k] - t->position[0][k];
    }
    for (int k = 0; k < 3; k++)
        across[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    n[0] = n[1] = vf_zero();
    n[2] = vf_set(1.0f);
    if (args->view.perspective) {
        vf r = vf_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + vf_set(1.0f));
        n[0] = (vf_zero() - ray[0]) * r;
        n[1] = (vf_zero() - ray[1]) * r;
        n[2] = r;
    }
    turn_normal(&args->mesh, across, n);
}

static void write_shown(const struct pt_cpu_call *call, const struct triangle *t, size_t at, vi z, const vf n[4], vm front)
{
    const struct cover_args *args = call->arguments;
    const struct mesh_args *mesh = &args->mesh;
    const float *vertices = pt_cpu_data(call, 5);
    uint64_t *shown = pt_cpu_data(call, 7);
    float *normals = pt_cpu_data(call, 8), *albedo = pt_cpu_data(call, 9), color[3][PT_LANES];
    vf smooth[4] = { n[0], n[1], n[2], n[3] };
    uint32_t zs[PT_LANES];
    if (mesh->has_normals) {
        const vf object[3] = { between(t, vertices, 3, front), between(t, vertices, 4, front), between(t, vertices, 5, front) };
        turn_normal(mesh, object, smooth);
    }
    for (uint32_t k = 0; k < 3; k++)
        vf_store(color[k],
                 mesh->has_colors ? between(t, vertices, 3 + 3 * mesh->has_normals + k, front) : vf_set(mesh->color[k]));
    vi_store(zs, z);
    vf_store4(normals + 4 * at, smooth, vm_bits(front));
    for (uint32_t left = vm_bits(front); left; left &= left - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(left);
        shown[at + i] = (uint64_t)zs[i] << 32 | (uint32_t)(at + i);
        for (int k = 0; k < 3; k++)
            albedo[3 * (at + i) + (size_t)k] = color[k][i];
    }
}

static void cover_pixels(const struct pt_cpu_call *call, uint32_t x, uint32_t y, vi index, vi z, vm front)
{
    const struct cover_args *args = call->arguments;
    const struct view_args *view = &args->view;
    uint64_t *keys = pt_cpu_data(call, 0);
    const uint64_t *mesh_keys = pt_cpu_data(call, 4);
    uint32_t *from = pt_cpu_data(call, 1);
    float *normals = pt_cpu_data(call, 2), *deff = pt_cpu_data(call, 3);
    size_t at = (size_t)y * view->width + x;
    struct triangle t;
    vf ray[2], n[4];
    find_triangle(call, index, x, y, front, &t);
    vf_ray(view, x, y, ray);
    plane_normal(args, &t, ray, n);
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
    const uint64_t *keys = pt_cpu_data(call, 0), *mesh_keys = pt_cpu_data(call, 4);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * args->view.width + x;
        vi z = vi_load_z(mesh_keys + at), other = vi_load_z(keys + at);
        vi index = vi_sub(vi_load_id(mesh_keys + at), vi_set(args->mesh.id_base));
        vm front = vm_or(vi_lt_unsigned(z, other), vm_and(vi_eq(z, other), vi_lt_unsigned(vi_load_id(mesh_keys + at),
                                                                                          vi_load_id(keys + at))));
        if (args->behind) // a pixel that was filled across a layer taken before
            front = vm_or(front, vf_le(vi_float(other), vf_load((const float *)pt_cpu_data(call, 10) + at)));
        front = vm_and(front, vm_and(vi_lt_unsigned(index, vi_set(args->mesh.id_count)),
                                     vm_not(vi_eq(z, vi_set(PT_KEY_EMPTY_Z)))));
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
