// SPDX-License-Identifier: GPL-3.0-or-later
// sift: which points of divided chunks are drawn: those that clips, hidden classes, hidden shapes, masks and fields leave; twin of
// native/device_cpu/kernels/sift.c
//
// A workgroup takes a chunk, an invocation PT_SLOTS_A_WORD of its points at a time.
#version 430 core
#include "shared/points.h"
#include "lib/math.glsl"
#include "lib/positions.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { sift_args args; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_classes) readonly buffer classes_block { uint classes[]; }; // four bytes a word
layout(std430, binding = BIND_clips) readonly buffer clips_block { clip_view clips[]; };
layout(std430, binding = BIND_drawn) writeonly buffer drawn_block { uint drawn[]; };
layout(std430, binding = BIND_shapes) readonly buffer shapes_block { uint shapes[]; };
layout(std430, binding = BIND_mask) readonly buffer mask_block { uint mask[]; };
layout(std430, binding = BIND_field) readonly buffer field_block { uint field[]; };

layout(std430, binding = BIND_scans) readonly buffer scans_block { uint scans[]; }; // two a word

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of what points have begins

#include "lib/clip.glsl"

// Of a plane: cut.
bool inside(uint clip, vec3 p)
{
    if (clips[clip].shape == PT_CLIP_PLANE)
        return 0.0 < pt_clip_row(clip, 2u, p);
    return pt_abs(pt_clip_row(clip, 0u, p)) <= 1.0 && pt_abs(pt_clip_row(clip, 1u, p)) <= 1.0 &&
           pt_abs(pt_clip_row(clip, 2u, p)) <= 1.0;
}

bool hidden_class(uint slot)
{
    uint class_of = (classes[slot >> 2] >> (8u * (slot & 3u))) & 255u;
    return (args.hidden[class_of >> 5] >> (class_of & 31u) & 1u) != 0u;
}

bool hidden_shape(uint slot)
{
    uint sight = shapes[slot] >> PT_SHAPE_SIGHT_SHIFT & 255u;
    return (args.hidden_shapes[sight >> 5] >> (sight & 31u) & 1u) != 0u;
}

bool hidden_scan(uint slot)
{
    uint scan = scans[slot >> 1] >> (16u * (slot & 1u)) & 0xFFFFu;
    return scan < 32u * PT_SCAN_WORDS && (args.hidden_scans[scan >> 5] >> (scan & 31u) & 1u) != 0u;
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    uint base = chunk.first - first_slot;
    uint end = chunk.sifted != 0u ? (chunk.count + PT_SLOTS_A_WORD - 1u) / PT_SLOTS_A_WORD : 0u;
    uint keeps = chunk.clip_first + chunk.clip_keeps, cuts = chunk.clip_first + chunk.clip_count;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint w = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; w < end; w += stride) {
        uint bits = 0u;
        for (uint i = 0u; i < PT_SLOTS_A_WORD; i++) {
            uint slot = PT_SLOTS_A_WORD * w + i;
            vec3 p = pt_position(base, chunk.padded, chunk.step, slot);
            bool keep = chunk.clip_keeps == 0u, cut = args.by_class != 0u && hidden_class(base + slot);
            cut = cut || (args.by_shape != 0u && hidden_shape(base + slot));
            cut = cut || (args.by_field != 0u && args.threshold < field[base + slot] >> PT_FIELD_SHIFT);
            cut = cut || (args.by_scan != 0u && hidden_scan(base + slot));
            for (uint k = chunk.clip_first; k < keeps; k++)
                keep = keep || inside(k, p);
            for (uint k = keeps; k < cuts; k++)
                cut = cut || inside(k, p);
            bits |= keep && !cut ? 1u << i : 0u;
        }
        if (args.by_mask != 0u)
            bits &= ~mask[chunk.first / PT_SLOTS_A_WORD + w];
        drawn[chunk.sifted - 1u + w] = bits;
    }
}
