// SPDX-License-Identifier: GPL-3.0-or-later
// paper: tint and grain over the picture; twin of shaders/kernels/paper.comp
#include "device_cpu/rows.h"

static vi mix(vi word, int shift) // word ^ word >> shift
{
    vi other = vi_shr(word, shift);
    return vi_sub(vi_or(word, other), vi_and(word, other));
}

// 0..1 of a place.
static vf hash(vi x, vi y)
{
    vi word = vi_add(vi_mul(x, vi_set(0x9E3779B1u)), vi_mul(y, vi_set(0x85EBCA77u)));
    word = vi_mul(mix(word, 15), vi_set(0x2C1B3C6Du));
    word = vi_mul(mix(word, 12), vi_set(0x297A2D39u));
    return vi_convert(vi_shr(mix(word, 15), 8)) * vf_set(0x1p-24f);
}

// Hashes of a lattice 8 pixels wide, blended between its nodes.
static vf noise(vi x, vi y)
{
    const vi rest = vi_set(7), one = vi_set(1);
    const vf half = vf_set(0.5f), scale = vf_set(0.125f);
    vi cx = vi_shr(x, 3), cy = vi_shr(y, 3);
    vf u = (vi_convert(vi_and(x, rest)) + half) * scale, v = (vi_convert(vi_and(y, rest)) + half) * scale;
    vf a = hash(cx, cy), b = hash(vi_add(cx, one), cy);
    vf c = hash(cx, vi_add(cy, one)), d = hash(vi_add(cx, one), vi_add(cy, one));
    vf low = a + u * (b - a), high = c + u * (d - c);
    return low + v * (high - low);
}

static void paper_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct paper_args *args = call->arguments;
    float *out = (float *)pt_cpu_data(call, 0) + 4 * (size_t)y * args->crop_width;
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        vi px = vi_add(vi_set(args->x + x), vi_lanes()), py = vi_set(args->y + y);
        vf grain = vf_set(0.5f) * hash(px, py) + vf_set(0.5f) * noise(px, py), color[4];
        vf light = vf_set(1.0f) - vf_set(args->grain) * grain;
        vf_load4(out + 4 * (size_t)x, color);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * (vf_set(args->color[k]) * light);
        vf_store4(out + 4 * (size_t)x, color, vm_bits(vm_first(pt_lanes_left(x, args->crop_width))));
    }
}

int PT_KERNEL_ENTRY(paper)(const struct pt_cpu_call *call)
{
    const struct paper_args *args = call->arguments;
    return pt_crop_rows(call, &args->view, args->crop_width, args->crop_height, paper_row);
}
