// SPDX-License-Identifier: GPL-3.0-or-later
// Which points a picture shows.
#include "reference.h"
#include "shared/shadows.h"

int ref_mark(const struct mark_args *args, const struct ref_planes *planes, uint32_t id)
{
    for (uint32_t y = args->view.rect[1]; y < args->view.rect[3]; y++)
        for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++) {
            uint64_t key = planes->keys[(size_t)y * args->view.width + x];
            if (key != REF_EMPTY_KEY && ref_key_id(key) == args->id_base + id)
                return 1;
        }
    return 0;
}
