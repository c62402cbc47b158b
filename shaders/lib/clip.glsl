// SPDX-License-Identifier: GPL-3.0-or-later
// Where points lie to a clip of the block `clips`; twin of native/device_cpu/kernels/clip.h
#ifndef PT_CLIP_GLSL
#define PT_CLIP_GLSL

// Row k of (lo + R p) + hi.
float pt_clip_row(uint clip, uint k, vec3 p)
{
    precise float sum = ((clips[clip].lo[k] + clips[clip].row[3u * k] * p.x) + clips[clip].row[3u * k + 1u] * p.y) +
                        clips[clip].row[3u * k + 2u] * p.z;
    precise float total = sum + clips[clip].hi[k];
    return total;
}

#endif
