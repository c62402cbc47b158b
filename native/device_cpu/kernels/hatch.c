// SPDX-License-Identifier: GPL-3.0-or-later
// hatch: strokes where planes cut the surface; twin of shaders/kernels/hatch.comp
#include "device_cpu/rows.h"

struct pixel {
    vf n[3], ray[3], place[3]; // the normal shown; (u, v, -1), in orthographic views (0, 0, -1); the point, view space
    vf width[2];               // of the pixel at the point
    vf back;                   // (n . r) / (n . r)^2
};

static void place(const struct hatch_args *args, const float *shading, uint32_t x, uint32_t y, vf z, vm some,
                  struct pixel *p)
{
    const struct view_args *view = &args->view;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    vf ray[2], shown[4];
    z = vf_select(some, z, one);
    vf_ray(view, x, y, ray);
    vf_load4(shading, shown);
    memcpy(p->n, shown, sizeof p->n);
    p->ray[0] = p->ray[1] = zero;
    p->ray[2] = zero - one;
    p->place[0] = ray[0];
    p->place[1] = ray[1];
    p->place[2] = zero - (z + vf_set(args->eye_z));
    p->width[0] = vf_set(view->ray_xs);
    p->width[1] = vf_set(view->ray_ys);
    if (view->perspective) {
        memcpy(p->ray, ray, sizeof ray);
        p->place[0] = z * ray[0];
        p->place[1] = z * ray[1];
        p->place[2] = zero - z;
        p->width[0] = z * p->width[0];
        p->width[1] = z * p->width[1];
    }
    vf facing = (p->n[0] * p->ray[0] + p->n[1] * p->ray[1]) + p->n[2] * p->ray[2];
    p->back = facing * vf_rcp(vf_max(facing * facing, vf_set(PT_HATCH_GRAZING)));
}

// What a stroke of this level covers of the pixel; wide: its width in pixels.
static vf stroke(const struct hatch_args *args, uint32_t level, const struct pixel *p, vf wide)
{
    const float *a = args->axes + 3 * level;
    const vf zero = vf_zero(), half = vf_set(0.5f), one = vf_set(1.0f),
             axis[3] = {vf_set(a[0]), vf_set(a[1]), vf_set(a[2])};
    vf along = (axis[0] * p->place[0] + axis[1] * p->place[1]) + axis[2] * p->place[2];
    along = along + vf_set(args->offsets[level]);
    // how much it grows a pixel on: the surface goes on in its tangent plane
    vf turn = ((axis[0] * p->ray[0] + axis[1] * p->ray[1]) + axis[2] * p->ray[2]) * p->back;
    vf gx = p->width[0] * (axis[0] - turn * p->n[0]), gy = p->width[1] * (axis[1] - turn * p->n[1]);
    vf square = vf_max(gx * gx + gy * gy, vf_set(1e-30f)), root = vf_rsqrt(square), rate = square * root;
    vf wanted = rate * vf_set(args->spacing);
    vi exponent = vi_and(vf_bits(wanted), vi_set(0x7F800000u)); // the next power of two below
    vf period = vi_float(exponent), inverse = vi_float(vi_sub(vi_set(254u << 23), exponent));
    vf fade = wanted * inverse - one;
    vf at = along * inverse, line = vf_floor(at + half);
    vf off = vf_abs(at - line) * (period * root);         // pixels
    vf odd = line - vf_set(2.0f) * vf_floor(line * half); // 0 or 1
    vf reach = (half * wide) * (one - odd * fade);
    vf edge = vf_min(vf_max((reach - off) + half, zero), one);
    return edge * vf_min(vf_set(2.0f) * reach, one);
}

static void hatch_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct hatch_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const size_t row = (size_t)y * args->view.width;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + row;
    const float *shading = (const float *)pt_cpu_data(call, 1) + 4 * row;
    float *colors = (float *)pt_cpu_data(call, 2) + 4 * row;
    const vf zero = vf_zero(), one = vf_set(1.0f);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + x)), color[4], bare = one;
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])), vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
        struct pixel p;
        if (!vm_bits(some))
            continue;
        place(args, shading + 4 * (size_t)x, x, y, z, some, &p);
        vf_load4(colors + 4 * (size_t)x, color);
        vf light = (vf_set(0.2126f) * color[0] + vf_set(0.7152f) * color[1]) + vf_set(0.0722f) * color[2];
        light = light * vf_rcp(vf_max(color[3], vf_set(1e-6f)));
        vf tone = light * vf_rsqrt(vf_max(light, vf_set(1e-6f))); // as the eye has it
        for (uint32_t level = 0; level < args->levels; level++) {
            vf dark = vf_min(vf_max(one - tone * vf_set(args->tones[level]), zero), one);
            vf covered = stroke(args, level, &p, vf_set(args->width) * dark);
            bare = bare * (one - covered);
        }
        vf ink = vf_set(args->opacity) * (one - bare), ground = vf_set(args->ground);
        for (int k = 0; k < 3; k++) {
            vf under = color[k] * (one - ground) + color[3] * ground;
            color[k] = under * (one - ink) + (vf_set(args->color[k]) * color[3]) * ink;
        }
        vf_store4(colors + 4 * (size_t)x, color, vm_bits(some));
    }
}

int PT_KERNEL_ENTRY(hatch)(const struct pt_cpu_call *call)
{
    const struct hatch_args *args = call->arguments;
    return pt_rows(call, &args->view, hatch_row);
}
