// SPDX-License-Identifier: GPL-3.0-or-later
// pull: 2 x 2 -> 1, the least key: what a scatter at half the resolution gives. SPEC 2.2; twin of shaders/kernels/pull.comp
#include "device_cpu/rows.h"
#include "shared/filling.h"

struct cells { // of PT_LANES children
    vi z, id, from;
};

static uint32_t pull_cell(const struct pull_args *args, const uint64_t *fine_keys, uint32_t x, uint32_t y)
{
    uint32_t best = 2 * y * args->fine_width + 2 * x;
    for (uint32_t child = 1; child < 4; child++) {
        uint32_t fx = 2 * x + (child & 1), fy = 2 * y + (child >> 1), at = fy * args->fine_width + fx;
        if (fx < args->fine_width && fy < args->fine_height && fine_keys[at] < fine_keys[best])
            best = at;
    }
    return best;
}

#if PT_LANES > 1
static struct cells least(struct cells a, struct cells b)
{
    vm less = pt_less(b.z, b.id, a.z, a.id);
    return (struct cells){vi_select(less, b.z, a.z), vi_select(less, b.id, a.id), vi_select(less, b.from, a.from)};
}

// The lesser of each pair of 2 PT_LANES fine pixels from `at` on; those of level 0 are measured ones, or empty.
static struct cells least_of_row(const uint64_t *keys, const uint32_t *from, size_t at, int measured)
{
    vi z[2], id[2], f[2];
    for (uint32_t k = 0; k < 2; k++) {
        z[k] = vi_load_z(keys + at + k * PT_LANES);
        id[k] = vi_load_id(keys + at + k * PT_LANES);
        f[k] = measured ? vi_add(vi_set((uint32_t)at + k * PT_LANES), vi_lanes()) : vi_load(from + at + k * PT_LANES);
    }
    return least((struct cells){vi_evens(z[0], z[1]), vi_evens(id[0], id[1]), vi_evens(f[0], f[1])},
                 (struct cells){vi_odds(z[0], z[1]), vi_odds(id[0], id[1]), vi_odds(f[0], f[1])});
}

// Whole vectors of cells with four children each; returns where they end.
static uint32_t pull_vectors(const struct pull_args *args, const uint64_t *fine_keys, const uint32_t *fine_from, uint64_t *keys,
                             uint32_t *from, uint32_t y)
{
    uint32_t x = args->view.rect[0],
             end = args->view.rect[2] < args->fine_width / 2 ? args->view.rect[2] : args->fine_width / 2;
    const int measured = args->view.level == 1;
    if (2 * y + 1 >= args->fine_height)
        return x;
    for (; x + PT_LANES <= end; x += PT_LANES) {
        size_t at = (size_t)(2 * y) * args->fine_width + 2 * x, out = (size_t)y * args->view.width + x;
        struct cells cells = least(least_of_row(fine_keys, fine_from, at, measured),
                                   least_of_row(fine_keys, fine_from, at + args->fine_width, measured));
        vi_store_keys(keys + out, cells.z, cells.id, PT_ALL);
        vi_store(from + out, cells.from);
    }
    return x;
}
#else
static uint32_t pull_vectors(const struct pull_args *args, const uint64_t *fine_keys, const uint32_t *fine_from, uint64_t *keys,
                             uint32_t *from, uint32_t y)
{
    (void)fine_keys, (void)fine_from, (void)keys, (void)from, (void)y;
    return args->view.rect[0];
}
#endif

static void pull_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct pull_args *args = call->arguments;
    const uint64_t *fine_keys = PT_DATA(call, pull, fine_keys);
    const uint32_t *fine_from = PT_DATA(call, pull, fine_from);
    uint64_t *keys = PT_DATA(call, pull, keys);
    uint32_t *from = PT_DATA(call, pull, from);
    for (uint32_t x = pull_vectors(args, fine_keys, fine_from, keys, from, y); x < args->view.rect[2]; x++) {
        uint32_t best = pull_cell(args, fine_keys, x, y);
        keys[(size_t)y * args->view.width + x] = fine_keys[best];
        from[(size_t)y * args->view.width + x] = args->view.level == 1 ? best : fine_from[best];
    }
}

int PT_KERNEL_ENTRY(pull)(const struct pt_cpu_call *call)
{
    const struct pull_args *args = call->arguments;
    return pt_rows(call, &args->view, pull_row);
}
