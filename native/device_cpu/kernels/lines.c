// SPDX-License-Identifier: GPL-3.0-or-later
// lines: what enlarged discs leave uncovered. [X 3], SPEC 7: see struct lines_args; twin of shaders/kernels/lines.comp
//
// Few pixels have discs, and fewer lie within reach of one that is nearer: the least disc around is looked up first, rows and
// columns apart.
#include "antialias.h"
#include "device_cpu/rows.h"
#include "shared/lines.h"

enum { BAND_ROWS = 64, PAD = 32 }; // rows that a thread takes at once; floats on each side of a row

// A row of the rectangle, by columns from its left side on.
struct line_row {
    float *z;       // +inf: empty, 0: may take no line
    float *step;    // v of pixels with a step in depth beside them; +inf: none
    float *disc;    // of them those with company
    float *least;   // disc within reach along the row
    float *own;     // of pixels with discs: the share that is the line's
    float *radius;  // of discs, in world units only
    uint64_t *bits; // a bit a disc, from 64 columns before the row on
    int steps, any; // there are steps, discs
};
enum { ROW_FLOATS = 7 };

struct lines {
    const struct lines_args *args;
    const uint64_t *keys;
    const uint32_t *from;
    const float *normals, *deff, *limit, *through;
    float *line;
    uint32_t *nearest;
    const struct pt_cpu_call *call;
    uint32_t width; // of the rectangle
    size_t stride;
    float *memory; // per thread: a band's rows and one of scratch
    size_t thread_floats;
    float distances[PT_LINE_TAPS + PT_LANES]; // of the taps, pixels
};

// The tangent plane of a pixel's surface: how much it faces the ray, and how it falls away from pixel to pixel.
struct tangent {
    vf facing, slope_x, slope_y;
    vf floor; // behind a layer: surfaces that are nearer touch it
};

// ---- rows --------------------------------------------------------------------------------------------------------------

static int in_rows(const struct lines *lines, int32_t y)
{
    return y >= (int32_t)lines->args->view.rect[1] && y < (int32_t)lines->args->view.rect[3];
}

static size_t index_of(const struct lines *lines, uint32_t x, int32_t y)
{
    return (size_t)y * lines->args->view.width + lines->args->view.rect[0] + x;
}

static void load_row(const struct lines *lines, int32_t y, const struct line_row *row)
{
    const struct lines_args *args = lines->args;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (uint32_t x = 0; x < lines->width; x += PT_LANES) {
        vf z = vf_zero();
        if (in_rows(lines, y)) {
            size_t at = index_of(lines, x, y);
            z = vi_float(vi_load_z(lines->keys + at));
            if (args->behind) {
                vf through = vf_load(lines->through + at);
                vm some = vm_and(vf_lt(z, empty), vf_lt(vf_load(lines->limit + at), z));
                vm open = vm_and(vf_lt(through, vf_set(1.0f)), vf_le(vf_set(PT_SPENT), through));
                z = vf_select(some, z, vf_select(open, empty, vf_zero()));
            }
        }
        vf_store(row->z + x, z);
    }
    for (uint32_t i = 0; i < 2; i++) // nothing is known there
        row->z[-1 - (int32_t)i] = row->z[lines->width + i] = 0.0f;
}

// The least of each window of 2 reach + 1, from windows of 1, 2, 4 ...
static void least_along(const struct lines *lines, const float *disc, float *windows, float *least)
{
    const int32_t reach = (int32_t)lines->args->reach, width = (int32_t)lines->width;
    int32_t size = 1;
    for (int32_t x = -PAD; x < width + PAD; x += PT_LANES)
        vf_store(windows + x, vf_load(disc + x));
    for (; 2 * size <= 2 * reach + 1; size *= 2)
        for (int32_t x = -PAD; x < width + PAD - size; x += PT_LANES)
            vf_store(windows + x, vf_min(vf_load(windows + x), vf_load(windows + x + size)));
    for (int32_t x = 0; x < width; x += PT_LANES)
        vf_store(least + x, vf_min(vf_load(windows + x - reach), vf_load(windows + x + reach + 1 - size)));
}

// ---- discs ----------------------------------------------------------------------------------------------------------------

// Of pixels at z, of which `wanted` are asked for.
static struct tangent tangent_at(const struct lines *lines, vi x, vi y, vf z, vm wanted)
{
    const struct view_args *view = &lines->args->view;
    const vf zero = vf_zero();
    struct tangent out = {vf_set(1.0f), zero, zero, zero}; // behind an empty pixel is nothing
    vi at = vi_add(vi_mul(y, vi_set(view->width)), x);
    vm some = vm_and(wanted, vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    if (lines->args->behind)
        out.floor = vf_gather(lines->limit, at, wanted);
    if (!vm_bits(some))
        return out;
    vi source = pt_source_gather(lines->from, at, some);
    vf n[3], ray[2];
    for (int k = 0; k < 3; k++)
        n[k] = vf_gather(lines->normals + k, vi_mul(source, vi_set(4)), some);
    vf_ray_of(view, x, y, ray);
    vf facing = n[2];
    if (view->perspective)
        facing = n[2] - (n[0] * ray[0] + n[1] * ray[1]);
    vm away = vf_lt(facing, zero);
    vf slope_x = n[0] * vf_set(view->ray_xs), slope_y = n[1] * vf_set(view->ray_ys);
    out.facing = vf_select(some, vf_select(away, zero - facing, facing), out.facing);
    out.slope_x = vf_select(some, vf_select(away, zero - slope_x, slope_x), zero);
    out.slope_y = vf_select(some, vf_select(away, zero - slope_y, slope_y), zero);
    return out;
}

// Whether discs at v of pixels at own_z, (dx, dy) pixels away, show before pixels at z.
static vm shows(const struct lines *lines, const struct tangent *tangent, vf z, vf v, vf own_z, int dx, int dy)
{
    vf slope = tangent->slope_x * vf_set((float)dx) + tangent->slope_y * vf_set((float)dy);
    vm before = vf_lt(v, z);
    if (lines->args->behind)
        before = vm_and(before, vf_lt(tangent->floor, (own_z + own_z) - v));
    if (lines->args->view.perspective)
        return vm_and(before, vf_lt(v * (tangent->facing - slope), z * tangent->facing));
    return vm_and(before, vf_lt(v * tangent->facing, z * tangent->facing + slope));
}

static vf offset_of(const struct lines *lines, size_t at, vf z, vm some)
{
    const struct lines_args *args = lines->args;
    if (!(args->offset > 0.0f))
        return pt_own_distance(&args->view, lines->deff, lines->normals, lines->from, at, z, some);
    vi source = pt_source_of(lines->from, at);
    return vf_set(args->offset) * vf_gather(lines->normals + 3, vi_mul(source, vi_set(4)), some);
}

// How many of the 8 pixels around x lie beyond v.
static vf count_beyond(const struct line_row *rows, int32_t x, vf v)
{
    vf count = vf_zero();
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++)
            if (dx || dy)
                count = vf_add_where(vf_lt(v, vf_load(rows[dy].z + x + dx)), count, vf_set(1.0f));
    return count;
}

// At how many of their cross neighbours discs at v show.
static vf count_edges(const struct lines *lines, const struct line_row *rows, uint32_t x, int32_t y, vf own_z, vf v, vm some)
{
    const uint32_t *rect = lines->args->view.rect;
    vf count = vf_zero();
    for (int i = 0; i < 4; i++) {
        const int dx = pt_cross[i][0], dy = pt_cross[i][1];
        vf z = vf_load(rows[dy].z + (int32_t)x + dx);
        vm far = vm_and(some, vf_lt(v, z));
        if (vm_bits(far))
            far = vm_and(far, vf_le(vf_set(PT_LINE_SUPPORT), count_beyond(rows + dy, (int32_t)x + dx, v)));
        if (!vm_bits(far))
            continue;
        vi qx = vi_add(vi_set(rect[0] + x + (uint32_t)dx), vi_lanes()), qy = vi_set((uint32_t)(y + dy));
        struct tangent tangent = tangent_at(lines, qx, qy, z, far);
        count = vf_add_where(vm_and(far, shows(lines, &tangent, z, v, own_z, -dx, -dy)), count, vf_set(1.0f));
    }
    return count;
}

static vf radius_of(const struct lines_args *args, vf z, vm some)
{
    if (!args->world)
        return vf_set(args->most);
    vf footprint = vf_footprint(&args->view, vf_select(some, z, vf_set(1.0f)));
    return vf_min(vf_set(args->width) * vf_rcp(footprint), vf_set(args->most));
}

// rows[-2..2]: z is loaded. Returns whether there are steps among these pixels.
static int put_steps(const struct lines *lines, const struct line_row *rows, uint32_t x, int32_t y)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f), zero = vf_zero();
    vf z = vf_load(rows->z + x), step = empty;
    vm some = vm_and(vm_first(pt_lanes_left(x, lines->width)), vm_and(vf_lt(zero, z), vf_lt(z, empty)));
    if (vm_bits(some)) {
        vf v = z + offset_of(lines, index_of(lines, x, y), z, some);
        vf far = vf_max(vf_load(rows[-1].z + x), vf_load(rows[1].z + x));
        far = vf_max(far, vf_max(vf_load(rows->z + (int32_t)x - 1), vf_load(rows->z + x + 1)));
        some = vm_and(some, vf_lt(v, far));
        vf count = vm_bits(some) ? count_edges(lines, rows, x, y, z, v, some) : zero;
        some = vf_lt(zero, count);
        if (vm_bits(some)) {
            vf coverage = vf_max(vf_set(PT_COVERAGE_NONE) - count * vf_set(PT_COVERAGE_STEP), vf_set(PT_COVERAGE_LEAST));
            vf radius = radius_of(lines->args, z, some);
            step = vf_select(some, v, empty);
            vf_store(rows->own + x, vf_min(one - coverage, radius));
            if (lines->args->world)
                vf_store(rows->radius + x, radius);
        }
    }
    vf_store(rows->step + x, step);
    return vm_bits(vf_lt(step, empty)) != 0;
}

static void step_row(const struct lines *lines, struct line_row *rows, int32_t y)
{
    rows->steps = 0;
    for (uint32_t x = 0; x < lines->width && in_rows(lines, y); x += PT_LANES)
        rows->steps |= put_steps(lines, rows, x, y);
    rows->step[-1] = rows->step[lines->width] = pt_float(PT_KEY_EMPTY_Z);
}

// rows[-1..1]: steps are known.
static void disc_row(const struct lines *lines, struct line_row *rows, float *windows)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), one = vf_set(1.0f);
    rows->any = 0;
    memset(rows->bits, 0, (lines->width / 64 + 4) * sizeof *rows->bits);
    for (uint32_t x = 0; x < lines->width && rows->steps; x += PT_LANES) {
        vf step = vf_load(rows->step + x), count = vf_zero();
        for (int dy = -1; dy <= 1 && vm_bits(vf_lt(step, empty)); dy++)
            for (int dx = -1; dx <= 1 && rows[dy].steps; dx++)
                count = vf_add_where(vf_lt(vf_load(rows[dy].step + (int32_t)x + dx), empty), count, one); // itself, too
        vf disc = vf_select(vf_lt(vf_set(PT_LINE_SUPPORT), count), step, empty);
        uint32_t found = vm_bits(vf_lt(disc, empty));
        vf_store(rows->disc + x, disc);
        rows->bits[1 + x / 64] |= (uint64_t)found << x % 64;
        rows->any |= found != 0;
    }
    if (!rows->any)
        return;
    for (int32_t i = 0; i < PAD; i++)
        rows->disc[(int32_t)lines->width + i] = rows->disc[-1 - i] = pt_float(PT_KEY_EMPTY_Z);
    least_along(lines, rows->disc, windows, rows->least);
}

// ---- lines -----------------------------------------------------------------------------------------------------------------

struct found {
    vf beyond; // r + 1/2 - d of the disc taken; 0: none
    vf radius;
    vi nearest;
};

// The discs of 64 columns from x - 32 on.
static uint64_t discs_around(const struct line_row *row, uint32_t x)
{
    const uint64_t *at = row->bits + (x + 32) / 64;
    uint32_t shift = (x + 32) % 64;
    return shift ? at[0] >> shift | at[1] << (64 - shift) : at[0];
}

static struct found search(const struct lines *lines, const struct line_row *rows, uint32_t x, uint32_t y, vf z, vm some)
{
    const struct lines_args *args = lines->args;
    const uint32_t *rect = args->view.rect;
    const vf half = vf_set(0.5f);
    const vi column = vi_add(vi_set(rect[0] + x), vi_lanes());
    const struct tangent tangent = tangent_at(lines, column, vi_set(y), z, some);
    struct found found = {vf_zero(), vf_set(args->most), column};
    const uint64_t asked = vm_bits(some);
    uint64_t discs[2 * PT_LINE_MOST + 1]; // that may show, by rows
    for (int k = -(int)args->reach; k <= (int)args->reach; k++) {
        int nearer = rows[k].any && vm_bits(vm_and(some, vf_lt(vf_load(rows[k].least + x), z)));
        discs[PT_LINE_MOST + k] = nearer ? discs_around(rows + k, x) : 0;
    }
    for (uint32_t i = 0; i < args->tap_count; i++) {
        const uint32_t tap = args->taps[i];
        const int dx = (int)(tap & 255u) - 128, dy = (int)(tap >> 8 & 255u) - 128;
        const struct line_row *row = rows + dy;
        if (!(discs[PT_LINE_MOST + dy] >> (32 + dx) & asked)) // as of most pixels: few have discs
            continue;
        vf disc = vf_load(row->disc + (int32_t)x + dx);
        vm hit = vm_and(some, vf_lt(disc, z));
        const vf distance = vf_set(lines->distances[i]);
        vm open = vm_and(some, vf_lt(found.beyond, (vf_set(args->most) + half) - distance));
        if (!vm_bits(open))
            break;
        hit = vm_and(vm_and(open, hit), shows(lines, &tangent, z, disc, vf_load(row->z + (int32_t)x + dx), dx, dy));
        if (!vm_bits(hit))
            continue;
        vf radius = args->world ? vf_load(row->radius + (int32_t)x + dx) : vf_set(args->most);
        vf beyond = (radius + half) - distance;
        hit = vm_and(hit, vf_lt(found.beyond, beyond));
        vi index = vi_add(vi_set((y + (uint32_t)dy) * args->view.width + (uint32_t)dx), column);
        found.beyond = vf_select(hit, beyond, found.beyond);
        found.radius = vf_select(hit, radius, found.radius);
        found.nearest = vi_select(hit, index, found.nearest);
    }
    return found;
}

// The share of a line at pixels that such discs cover.
static vf share_of(const struct lines_args *args, const struct found *found)
{
    const vf one = vf_set(1.0f), half = vf_set(0.5f);
    vf beyond = found->beyond, fade = vf_set(args->soft) * (found->radius + half);
    if (!args->antialias)
        beyond = vf_select(vf_le(vf_set(PT_LINE_WITHIN), beyond), beyond + vf_set(1.0f - PT_LINE_WITHIN), vf_zero());
    return vf_min(beyond * vf_rcp(vf_max(one, fade)), one);
}

// ---- the walk --------------------------------------------------------------------------------------------------------------

// Those of PT_LANES pixels that a disc may cover.
static vm covered(const struct lines *lines, const struct line_row *rows, uint32_t x, vf z, vm lanes)
{
    const int32_t reach = (int32_t)lines->args->reach;
    vf least = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (int32_t k = -reach; k <= reach; k++)
        if (rows[k].any)
            least = vf_min(least, vf_load(rows[k].least + x));
    return vm_and(lanes, vf_lt(least, z));
}

static void line_row(const struct lines *lines, const struct line_row *rows, uint32_t y)
{
    for (uint32_t x = 0; x < lines->width; x += PT_LANES) {
        size_t at = index_of(lines, x, (int32_t)y);
        vf z = vf_load(rows->z + x), share = vf_zero();
        vm lanes = vm_first(pt_lanes_left(x, lines->width)), some = covered(lines, rows, x, z, lanes);
        if (vm_bits(some)) {
            struct found found = search(lines, rows, x, y, z, some);
            share = share_of(lines->args, &found);
            vi_store_where(lines->nearest + at, found.nearest, vm_and(some, vf_lt(vf_zero(), share)));
        }
        if (lines->args->antialias && rows->any) {
            some = vm_and(lanes, vf_lt(vf_load(rows->disc + x), vf_set(pt_float(PT_KEY_EMPTY_Z))));
            vf own = vf_load(rows->own + x);
            some = vm_and(some, vf_lt(share, own));
            share = vf_select(some, own, share);
            vi_store_where(lines->nearest + at, vi_add(vi_set((uint32_t)at), vi_lanes()), some);
        }
        vf_store_where(lines->line + at, share, lanes);
    }
}

static void line_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct lines *lines = context;
    const uint32_t *rect = lines->args->view.rect, margin = lines->args->reach + 3;
    struct line_row rows[BAND_ROWS + 2 * (PT_LINE_MOST + 3)];
    float *at = lines->memory + thread * lines->thread_floats + PAD, *windows = at;
    const size_t s = lines->stride;
    for (uint32_t i = 0; i < BAND_ROWS + 2 * margin; i++, at += ROW_FLOATS * s)
        rows[i] = (struct line_row){
            at + s, at + 2 * s, at + 3 * s, at + 4 * s, at + 5 * s, at + 6 * s, (uint64_t *)(void *)(at + 7 * s), 0, 0};
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(lines->call); band++) {
        uint32_t first = rect[1] + band * BAND_ROWS, last = first + BAND_ROWS < rect[3] ? first + BAND_ROWS : rect[3];
        uint32_t count = last - first + 2 * margin;
        for (uint32_t i = 0; i < count; i++)
            load_row(lines, (int32_t)(first + i) - (int32_t)margin, &rows[i]);
        for (uint32_t i = 2; i + 2 < count; i++)
            step_row(lines, &rows[i], (int32_t)(first + i) - (int32_t)margin);
        for (uint32_t i = 3; i + 3 < count; i++)
            disc_row(lines, &rows[i], windows);
        for (uint32_t y = first; y < last; y++)
            line_row(lines, &rows[y - first + margin], y);
    }
}

int PT_KERNEL_ENTRY(lines)(const struct pt_cpu_call *call)
{
    const struct lines_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    struct lines lines = {.args = args,
                          .call = call,
                          .keys = PT_DATA(call, lines, keys),
                          .from = PT_DATA(call, lines, from),
                          .normals = PT_DATA(call, lines, normal),
                          .deff = PT_DATA(call, lines, deff),
                          .line = PT_DATA(call, lines, line),
                          .nearest = PT_DATA(call, lines, nearest),
                          .limit = args->behind ? PT_DATA(call, lines, limit) : NULL,
                          .through = args->behind ? PT_DATA(call, lines, through) : NULL,
                          .width = rect[2] - rect[0]};
    lines.stride = ((size_t)lines.width + 15) / 16 * 16 + 3 * PAD; // vectors begin up to PAD behind the row's end
    lines.thread_floats = (1 + ROW_FLOATS * (BAND_ROWS + 2 * ((size_t)args->reach + 3))) * lines.stride;
    lines.memory = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * lines.thread_floats * sizeof(float));
    if (!lines.memory)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < args->tap_count; i += PT_LANES) {
        vf square = vi_convert(vi_shr(vi_load(args->taps + i), 16));
        vf_store(lines.distances + i, square * vf_rsqrt(square));
    }
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, line_bands, &lines);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
