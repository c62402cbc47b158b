// SPDX-License-Identifier: GPL-3.0-or-later
// The start-up test of 64-bit atomics (native/device_gl/selftest.c): 4096 values, the least one of each of 64 cells.
#version 430 core
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require

layout(local_size_x = 64) in;

layout(std430, binding = BIND_values) readonly buffer values_block { uint64_t values[]; };
layout(std430, binding = BIND_cells) buffer cells_block { uint64_t cells[]; };

void main()
{
    uint i = gl_GlobalInvocationID.x;
    atomicMin(cells[i % 64u], values[i]);
}
