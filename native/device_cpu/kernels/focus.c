// SPDX-License-Identifier: GPL-3.0-or-later
// focus: depth of field, and over the background, into the crop; twin of shaders/kernels/focus.comp
//
// Rows lie in a ring as separate vectors. Blocks of 16 x 16 pixels look no farther than the largest circle that may reach them:
// taps beyond would add nothing.
#include "device_cpu/picture_rows.h"
#include "shared/picture.h"

enum { BLOCK = 16, CHANNELS = 7, REACH_MOST = PT_FOCUS_MOST };

struct focus {
    const struct pt_cpu_call *call;
    const struct focus_args *args;
    float *rows; // per thread: a ring, then the largest circles of its rows' blocks
    size_t stride, blocks, thread_floats;
    uint32_t ring;
    float away[REACH_MOST + 1][REACH_MOST + 1]; // distances
};

struct row {
    float *z, *circle, *density, *color[4]; // beyond the plane z is NaN: neither before nor behind
    float *largest;                         // by block
};

struct sums {
    vf near[5], far[5]; // of colours, and of weights
};

static struct row ring_row(const struct focus *focus, uint32_t thread, int32_t y)
{
    float *base = focus->rows + thread * focus->thread_floats;
    const uint32_t slot = (uint32_t)(y + (int32_t)focus->ring) % focus->ring;
    const size_t s = focus->stride;
    float *at = base + slot * CHANNELS * s + PT_ROW_PAD, *largest = base + focus->ring * CHANNELS * s + slot * focus->blocks;
    return (struct row){at, at + s, at + 2 * s, {at + 3 * s, at + 4 * s, at + 5 * s, at + 6 * s}, largest};
}

// Radius of the circle of confusion, pixels.
static vf circle_of(const struct focus_args *args, vf z, vm some)
{
    const vf most = vf_set(args->most);
    if (!args->view.perspective) {
        vf off = vf_abs(vf_select(some, z, vf_zero()) - vf_set(args->distance)) * vf_set(args->scale);
        return vf_select(some, vf_min(off, most), most);
    }
    vf inverse = vf_select(some, vf_rcp(vf_select(some, z, vf_set(1.0f))), vf_zero());
    return vf_min(vf_abs(vf_set(1.0f) - vf_set(args->distance) * inverse) * vf_set(args->scale), most);
}

static void load_row(const struct focus *focus, int32_t y, const struct row *row)
{
    const struct view_args *view = &focus->args->view;
    const uint32_t inside = y < 0 || y >= (int32_t)view->height ? 0 : view->width;
    const size_t base = (size_t)(inside ? y : 0) * view->width;
    const uint64_t *keys = (const uint64_t *)PT_DATA(focus->call, focus, keys) + base;
    const float *colors = (const float *)PT_DATA(focus->call, focus, color) + 4 * base;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), zero = vf_zero();
    for (uint32_t b = 0; b < focus->blocks; b++)
        row->largest[b] = 0.0f;
    for (uint32_t x = 0; x < inside; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + x)), color[4];
        vm some = vf_lt(z, empty);
        vf circle = circle_of(focus->args, z, some), wide = vf_max(circle, vf_set(PT_FOCUS_SHARP));
        vf_store(row->z + x, z);
        vf_store(row->circle + x, circle);
        vf_store(row->density + x, vf_rcp(wide * wide) * vf_set(PT_FOCUS_DENSITY));
        vf_load4(colors + 4 * (size_t)x, color);
        for (int k = 0; k < 4; k++)
            vf_store(row->color[k] + x, vf_select(some, color[k], zero));
    }
    for (uint32_t x = 0; x < inside; x++) // empty pixels spread nothing
        if (row->z[x] < pt_float(PT_KEY_EMPTY_Z))
            row->largest[x / BLOCK] = pt_max(row->largest[x / BLOCK], row->circle[x]);
    for (int32_t x = -PT_ROW_PAD; x < (int32_t)view->width + PT_ROW_PAD; x++)
        if (x < 0 || x >= (int32_t)inside)
            row->z[x] = pt_float(0x7FC00000u);
}

static void add(const struct row *row, int32_t x, vf away, vf z, vf circle, vf density, struct sums *sums)
{
    const vf zero = vf_zero(), one = vf_set(1.0f), at = vf_load(row->z + x);
    vm before = vf_lt(at, z), behind = vf_le(z, at);
    vf wide = vf_load(row->circle + x), dense = vf_load(row->density + x);
    // what lies behind does not spread over what is sharper
    wide = vf_select(before, wide, vf_min(wide, circle));
    dense = vf_select(before, dense, vf_max(dense, density));
    vf weight = vf_min(vf_max((wide - away) + vf_set(0.5f), zero), one) * dense;
    for (int k = 0; k < 4; k++) {
        vf color = vf_load(row->color[k] + x) * weight;
        sums->near[k] = vf_add_where(before, sums->near[k], color);
        sums->far[k] = vf_add_where(behind, sums->far[k], color);
    }
    sums->near[4] = vf_add_where(before, sums->near[4], weight);
    sums->far[4] = vf_add_where(behind, sums->far[4], weight);
}

static void put(const struct focus_args *args, const struct sums *sums, float *out, uint32_t count)
{
    const vf one = vf_set(1.0f);
    vf hidden = vf_min(sums->near[4], one), near = vf_rcp(vf_max(sums->near[4], one)), color[4];
    vf far = (one - hidden) * vf_rcp(sums->far[4]);
    for (int k = 0; k < 4; k++)
        color[k] = sums->near[k] * near + sums->far[k] * far;
    color[3] = vf_min(color[3], one);
    vf through = one - color[3];
    for (int k = 0; k < 4; k++)
        color[k] = color[k] + through * vf_set(args->background[k]);
    vf_put4(out, color, count);
}

// sqrt(dx^2 + dy^2), as the shader has it.
static float distance_to(int dx, int dy)
{
    float square[PT_LANES], root[PT_LANES];
    for (int i = 0; i < PT_LANES; i++)
        square[i] = (float)(dx * dx + dy * dy);
    vf s = vf_load(square);
    vf_store(root, s * vf_rsqrt(vf_max(s, vf_set(1.0f))));
    return root[0];
}

// How far the block of pixels from (x, y) on, `rows` high, has to look.
static float look(const struct focus *focus, uint32_t thread, uint32_t x, int32_t y, int32_t rows)
{
    const int32_t reach = (int32_t)focus->args->reach, last = (int32_t)focus->args->view.width - 1;
    int32_t first = (int32_t)x - reach, end = (int32_t)x + BLOCK - 1 + reach;
    float largest = 0.0f;
    first = first < 0 ? 0 : first / BLOCK;
    end = (end > last ? last : end) / BLOCK;
    for (int32_t at = y - reach; at < y + rows + reach; at++) {
        const struct row row = ring_row(focus, thread, at);
        for (int32_t b = first; b <= end; b++)
            largest = pt_max(largest, row.largest[b]);
    }
    return largest + 0.5f;
}

// PT_LANES pixels from (x, y) on. most: from this distance on taps add nothing.
static void focus_pixels(const struct focus *focus, uint32_t thread, uint32_t x, int32_t y, float most, struct sums *sums)
{
    const int32_t reach = most < (float)focus->args->reach ? (int32_t)most : (int32_t)focus->args->reach;
    const struct row own = ring_row(focus, thread, y);
    const vf z = vf_load(own.z + x), circle = vf_load(own.circle + x), density = vf_load(own.density + x);
    for (int k = 0; k < 5; k++)
        sums->near[k] = sums->far[k] = vf_zero();
    for (int32_t dy = -reach; dy <= reach; dy++) {
        const struct row row = ring_row(focus, thread, y + dy);
        for (int32_t dx = -reach; dx <= reach; dx++) {
            const float away = focus->away[abs(dy)][abs(dx)];
            if (away < most)
                add(&row, (int32_t)x + dx, vf_set(away), z, circle, density, sums);
        }
    }
}

// BLOCK rows of the crop from y on, and those around them.
static void focus_unit(const struct focus *focus, uint32_t thread, uint32_t y)
{
    const struct focus_args *args = focus->args;
    const uint32_t rows = args->crop_height - y < BLOCK ? args->crop_height - y : BLOCK;
    const int32_t first = (int32_t)(args->crop_y + y);
    float *out = PT_DATA(focus->call, focus, combined);
    for (int32_t at = first - (int32_t)args->reach; at < first + (int32_t)(rows + args->reach); at++) {
        struct row row = ring_row(focus, thread, at);
        load_row(focus, at, &row);
    }
    for (uint32_t block = 0; block < args->crop_width; block += BLOCK) {
        const float most = look(focus, thread, args->crop_x + block, first, (int32_t)rows);
        const uint32_t end = args->crop_width - block < BLOCK ? args->crop_width : block + BLOCK;
        for (uint32_t row = 0; row < rows; row++)
            for (uint32_t x = block; x < end; x += PT_LANES) {
                struct sums sums;
                focus_pixels(focus, thread, args->crop_x + x, first + (int32_t)row, most, &sums);
                put(args, &sums, out + 4 * ((size_t)(y + row) * args->crop_width + x), pt_lanes_left(x, end));
            }
    }
}

static void focus_units(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct focus *focus = context;
    for (uint32_t unit = begin; unit < end && !pt_cpu_cancelled(focus->call); unit++)
        focus_unit(focus, thread, unit * BLOCK);
}

int PT_KERNEL_ENTRY(focus)(const struct pt_cpu_call *call)
{
    const struct focus_args *args = call->arguments;
    struct focus focus = {.call = call,
                          .args = args,
                          .stride = pt_row_stride(args->view.width),
                          .blocks = (args->view.width + BLOCK - 1) / BLOCK,
                          .ring = 2 * args->reach + BLOCK};
    focus.thread_floats = focus.ring * (CHANNELS * focus.stride + focus.blocks);
    focus.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * focus.thread_floats * sizeof(float));
    if (!focus.rows)
        return PATINA_ERROR_MEMORY;
    for (int i = 0; i <= REACH_MOST; i++)
        for (int k = 0; k <= REACH_MOST; k++)
            focus.away[i][k] = distance_to(i, k);
    pt_parallel(call->pool, (args->crop_height + BLOCK - 1) / BLOCK, 1, focus_units, &focus);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
