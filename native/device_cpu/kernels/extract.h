// SPDX-License-Identifier: GPL-3.0-or-later
// The passes beside the colour, PT_LANES pixels at a time.
#ifndef PT_EXTRACT_H
#define PT_EXTRACT_H

#include "device_cpu/rows.h"
#include "shared/colors.h"

// Row and column of pixels of a plane: a float quotient is at most one row off, also where the index has more than 24 bits.
static inline void pt_place_of(vi index, uint32_t width, vi *x, vi *y)
{
    const vf inverse = vf_set(1.0f / (float)width);
    vi row = vf_int(vi_convert(index) * inverse), column = vi_sub(index, vi_mul(row, vi_set(width)));
    vm under = vi_lt_unsigned(vi_set(0x7FFFFFFFu), column); // negative
    row = vi_select(under, vi_sub(row, vi_set(1)), row);
    column = vi_select(under, vi_add(column, vi_set(width)), column);
    vm over = vm_not(vi_lt_unsigned(column, vi_set(width)));
    *y = vi_select(over, vi_add(row, vi_set(1)), row);
    *x = vi_select(over, vi_sub(column, vi_set(width)), column);
}

// 1 measured, 1 + distance filled, negative where anti-aliasing mixed the colour, 0 empty. source: of the pixels from (x, y)
// of the plane on.
static inline vf pt_source_value(uint32_t width, vi source, vm mixed, vm some, uint32_t x, uint32_t y)
{
    const vf one = vf_set(1.0f);
    vm filled = pt_filled(source, (size_t)y * width + x, some);
    vf value = one;
    if (vm_bits(filled)) {
        vi sx, sy;
        pt_place_of(source, width, &sx, &sy);
        vf dx = vi_convert(vi_sub(sx, vi_add(vi_set(x), vi_lanes()))), dy = vi_convert(vi_sub(sy, vi_set(y)));
        vf square = vf_select(filled, dx * dx + dy * dy, one);
        value = vf_select(filled, one + square * vf_rsqrt(square), one);
    }
    value = vf_select(mixed, vf_zero() - value, value);
    return vf_select(some, value, vf_zero());
}

// The same where some are discs; away: of the pixels, how far off a disc's point fell.
static inline vf pt_source_among_discs(const struct extract_args *args, const uint64_t *keys, const float *away, vi source,
                                       vm mixed, vm some, uint32_t x, uint32_t y)
{
    vf value = pt_source_value(args->view.width, source, mixed, some, x, y);
    const vm filled = pt_filled(source, (size_t)y * args->view.width + x, some);
    const vi number = vi_sub(vi_load_id(keys), vi_set(args->discs_first));
    const vm disc = vm_and(vm_and(some, vm_not(filled)), vi_lt_unsigned(number, vi_set(args->discs_count)));
    const vf far = vf_set(1.0f) + vf_load(away);
    return vf_select(disc, vf_select(mixed, vf_zero() - far, far), value);
}

// z of pixels, those of ids that have one with the offset of where their surface was measured.
static inline vf pt_centered_depth(const struct extract_args *args, const uint64_t *keys, const float *offsets, vi source,
                                   vm some)
{
    const vf z = vi_float(vi_load_z(keys));
    some = vm_and(some,
                  vm_and(vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))), vi_lt_unsigned(vi_load_id(keys), vi_set(args->centered))));
    return vm_bits(some) ? vf_add_where(some, z, vf_gather(offsets, source, some)) : z;
}

// View-space normals in world space, 0 where nothing is.
static inline void pt_world_normal(const float m[9], const vf n[3], vm some, vf world[3])
{
    for (int k = 0; k < 3; k++) {
        vf sum = (vf_set(m[3 * k]) * n[0] + vf_set(m[3 * k + 1]) * n[1]) + vf_set(m[3 * k + 2]) * n[2];
        world[k] = vf_select(some, sum, vf_zero());
    }
}

#endif
