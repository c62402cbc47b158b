// SPDX-License-Identifier: GPL-3.0-or-later
// paper: tint and grain over the picture.

#include "shared/picture.h"

PT_FUNCTION vi paper_mix(vi word, int shift) // word ^ word >> shift
{
    vi other = vi_shr(word, shift);
    return vi_sub(vi_or(word, other), vi_and(word, other));
}

// 0..1 of a place.
PT_FUNCTION vf paper_hash(vi x, vi y)
{
    vi word = vi_add(vi_mul(x, vi_set(0x9E3779B1u)), vi_mul(y, vi_set(0x85EBCA77u)));
    word = vi_mul(paper_mix(word, 15), vi_set(0x2C1B3C6Du));
    word = vi_mul(paper_mix(word, 12), vi_set(0x297A2D39u));
    return vi_convert(vi_shr(paper_mix(word, 15), 8)) * 5.9604644775390625e-8f; // 2^-24
}

// Hashes of a lattice 8 pixels wide, blended between its nodes.
PT_FUNCTION vf paper_noise(vi x, vi y)
{
    vi rest = vi_set(7u), one = vi_set(1u), cx = vi_shr(x, 3), cy = vi_shr(y, 3);
    precise vf u = (vi_convert(vi_and(x, rest)) + 0.5f) * 0.125f, v = (vi_convert(vi_and(y, rest)) + 0.5f) * 0.125f;
    vf a = paper_hash(cx, cy), b = paper_hash(vi_add(cx, one), cy);
    vf c = paper_hash(cx, vi_add(cy, one)), d = paper_hash(vi_add(cx, one), vi_add(cy, one));
    precise vf low = a + u * (b - a), high = c + u * (d - c);
    precise vf value = low + v * (high - low);
    return value;
}

PT_BODY(paper)
{
    vi x = vi_add(HERE.x, vi_set(ARGS.x)), y = vi_add(HERE.y, vi_set(ARGS.y));
    precise vf grain = 0.5f * paper_hash(x, y) + 0.5f * paper_noise(x, y);
    precise vf light = 1.0f - ARGS.grain * grain;
    for (int k = 0; k < 3; k++) {
        precise vf tinted = color[k] * (ARGS.color[k] * light);
        color[k] = tinted;
    }
}
