// SPDX-License-Identifier: GPL-3.0-or-later
// A pattern of 16 bytes, as often as it fits, for pt_gl_clear (native/device_gl/memory.c): on a GPU, whose driver clears ten times slower.
#version 430 core
layout(local_size_x = 256) in;

#define EACH 4u // pairs of words that an invocation writes, as in native/device_gl/memory.c

layout(std430, binding = BIND_arguments) writeonly buffer cleared_block { uvec2 cleared[]; };

layout(location = 0) uniform uvec4 words;
layout(location = 1) uniform uvec2 range; // where it begins, and how many pairs

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint i = group * EACH * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    for (uint k = 0u; k < EACH && i < range.y; k++, i += gl_WorkGroupSize.x)
        cleared[range.x + i] = (i & 1u) == 0u ? words.xy : words.zw;
}
