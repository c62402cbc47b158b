// SPDX-License-Identifier: GPL-3.0-or-later
// How many workgroups walk lists, from how long these have become: the processor need not wait to know (native/device_gl/lists.c).
// A workgroup a list; its head is what glDispatchComputeIndirect takes, and the list's length behind it.
#version 430 core
layout(local_size_x = 1) in;

#define GROUPS_IN_ROW 16384u // as in native/device_gl/bind.c: within every driver's limits

layout(std430, binding = BIND_list) buffer list_block { uint list[]; };

layout(location = 0) uniform uint stride; // words from list to list
layout(location = 1) uniform uint entries; // a workgroup
layout(location = 2) uniform uint parts;   // workgroups that share these

void main()
{
    uint head = gl_WorkGroupID.x * stride, count = list[head + 3u];
    uint groups = (count + entries - 1u) / entries * parts, columns = min(groups, GROUPS_IN_ROW);
    list[head] = columns;
    list[head + 1u] = columns != 0u ? (groups + columns - 1u) / columns : 0u;
    list[head + 2u] = 1u;
}
