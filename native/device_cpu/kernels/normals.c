// SPDX-License-Identifier: GPL-3.0-or-later
// normals: image-space normals of points that have none; twin of shaders/kernels/normals.comp
//
// A plane is linear in the picture as 1/z (perspective) or z (orthographic). Least squares over the window's pixels that
// can belong to the same surface give w = w_p + a dx + b dy + c, hence the plane n . (u, v, -1) = w, hence n.
#include "device_cpu/rows.h"

struct sums {
    float n, x, y, xx, xy, yy, w, xw, yw;
};

static float linear_depth(const struct view_args *view, float z)
{
    return view->perspective ? pt_rcp(z) : z;
}

// 1. Sums over the window. Pixel counts and offsets are small integers: exact in float32.
static struct sums gather(const struct normals_args *args, const uint64_t *keys, int32_t x, int32_t y, float z, float w,
                          float tolerance)
{
    const struct view_args *view = &args->view;
    int32_t r = (int32_t)args->radius;
    struct sums s = { 0 };
    for (int32_t dy = -r; dy <= r; dy++)
        for (int32_t dx = -r; dx <= r; dx++) {
            int32_t qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= (int32_t)view->width || qy >= (int32_t)view->height)
                continue;
            float zq = pt_float((uint32_t)(keys[(size_t)qy * view->width + (size_t)qx] >> 32));
            float reach = (float)(abs(dx) > abs(dy) ? abs(dx) : abs(dy));
            if (!(pt_abs(zq - z) <= tolerance * reach))
                continue; // another surface, or nothing
            float fx = (float)dx, fy = (float)dy, dw = linear_depth(view, zq) - w;
            s.n += 1.0f;
            s.x += fx;
            s.y += fy;
            s.xx += fx * fx;
            s.xy += fx * fy;
            s.yy += fy * fy;
            s.w += dw;
            s.xw = s.xw + fx * dw;
            s.yw = s.yw + fy * dw;
        }
    return s;
}

static void normal_pixel(const struct normals_args *args, const uint64_t *keys, const uint32_t *surface, uint32_t x,
                         uint32_t y, float *normal)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    uint64_t key = keys[(size_t)y * view->width + x];
    uint32_t id = (uint32_t)key - instance->id_base, z_bits = (uint32_t)(key >> 32);
    if (z_bits == PT_KEY_EMPTY_Z || id >= instance->id_count)
        return;
    float z = pt_float(z_bits), spacing = instance->spacing[surface[id] >> PT_SPACING_SHIFT], w = linear_depth(view, z);
    struct sums s = gather(args, keys, (int32_t)x, (int32_t)y, z, w,
                           4.0f * pt_layer_distance(view, instance->d_min, spacing, z, 1.0f));
    normal[0] = normal[1] = normal[2] = normal[3] = 0.0f;
    // 2. Normal equations about the mean, all times n.
    float xx = s.n * s.xx - s.x * s.x, xy = s.n * s.xy - s.x * s.y, yy = s.n * s.yy - s.y * s.y;
    float xw = s.n * s.xw - s.x * s.w, yw = s.n * s.yw - s.y * s.w;
    float det = xx * yy - xy * xy;
    if (!(det > 0.5f)) // an exact integer: 0 when the pixels lie on a line
        return;
    float inverse = pt_rcp(det);
    float a = (yy * xw - xy * yw) * inverse, b = (xx * yw - xy * xw) * inverse;
    // 3. w at the pixel, and the plane's normal from dw/dx = a, dw/dy = b a pixel
    float n[3];
    if (view->perspective) {
        float ray[2], c = w + (s.w - (a * s.x + b * s.y)) * pt_rcp(s.n);
        pt_ray(view, (int32_t)x, (int32_t)y, ray);
        n[0] = a * view->ray_ys;
        n[1] = b * view->ray_xs;
        n[2] = (n[0] * ray[0] + n[1] * ray[1]) - c * (view->ray_xs * view->ray_ys);
    } else {
        n[0] = a * view->ray_ys;
        n[1] = b * view->ray_xs;
        n[2] = view->ray_xs * view->ray_ys;
    }
    // 4. unit, towards the viewer: n . (u, v, -1) < 0
    float largest = pt_max(pt_max(pt_abs(n[0]), pt_abs(n[1])), pt_abs(n[2]));
    if (!(largest > 1e-30f && largest < 1e30f))
        return;
    float scale = pt_rcp(largest);
    for (int k = 0; k < 3; k++)
        n[k] = n[k] * scale;
    scale = pt_rsqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
    float ray[2] = { 0.0f, 0.0f };
    if (view->perspective)
        pt_ray(view, (int32_t)x, (int32_t)y, ray);
    if ((n[0] * ray[0] + n[1] * ray[1]) - n[2] > 0.0f)
        scale = -scale;
    for (int k = 0; k < 3; k++)
        normal[k] = n[k] * scale;
}

static void normals_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct normals_args *args = call->arguments;
    float *normals = pt_cpu_data(call, 2);
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++)
        normal_pixel(args, pt_cpu_data(call, 0), pt_cpu_data(call, 1), x, y,
                     normals + 4 * ((size_t)y * args->view.width + x));
}

int PT_KERNEL_ENTRY(normals)(const struct pt_cpu_call *call)
{
    const struct normals_args *args = call->arguments;
    return pt_rows(call, &args->view, normals_row);
}
