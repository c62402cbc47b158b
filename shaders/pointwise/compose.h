// SPDX-License-Identifier: GPL-3.0-or-later
// compose: premultiplied colour over the background.

#include "shared/colors.h"

PT_BODY(compose)
{
    vm some = vm_or(HERE.some, vm_if(ARGS.everywhere != 0u));
    precise vf through = 1.0f - color[3];
    for (int k = 0; k < 4; k++) {
        precise vf over = color[k] + through * ARGS.background[k];
        color[k] = vf_select(some, over, vf_set(ARGS.background[k]));
    }
}
