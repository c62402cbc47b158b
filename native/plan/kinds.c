// SPDX-License-Identifier: GPL-3.0-or-later
#include "plan.h"

const struct pt_kind_row pt_kinds[PT_AS_COUNT] = {
#define PT_X(kind, source, sees, shows, in_planes, see, show, join, cover, front, ...)                                         \
    {PT_SOURCE_##source, PT_KERNEL_##sees, PT_KERNEL_##shows, in_planes, sizeof((int[]){__VA_ARGS__}) / sizeof(int),           \
     {__VA_ARGS__}},
    PT_KINDS(PT_X)
#undef PT_X
};
