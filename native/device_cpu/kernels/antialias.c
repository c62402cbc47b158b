// SPDX-License-Identifier: GPL-3.0-or-later
// antialias: Laplace on depth as steps. [D 3.5]; twin of shaders/kernels/antialias.comp
//
// Edges are few: their new colours are listed by bands of rows and applied when every pixel has been looked at.
#include "antialias.h"
#include "device_cpu/rows.h"
#include "shared/colors.h"

enum { BAND_ROWS = 16 };

struct edge {
    float color[4];
    uint32_t pixel;
};

struct antialias {
    const struct pt_cpu_call *call;
    const struct antialias_args *args;
    struct edge *edges;
    uint32_t *counts; // per band
    size_t band_edges;
};

// The new colour of the pixel, or 0 when it is no edge: vectors look past the plane's sides, this does not.
static int edge_color(const struct antialias *job, uint32_t x, uint32_t y, struct edge *edge)
{
    const struct view_args *view = &job->args->view;
    const uint64_t *keys = PT_DATA(job->call, antialias, keys);
    const uint32_t *from = PT_DATA(job->call, antialias, from);
    const float *deff = PT_DATA(job->call, antialias, deff), *colors = PT_DATA(job->call, antialias, color);
    const float *through = job->args->behind ? PT_DATA(job->call, antialias, through) : NULL;
    const float empty = pt_float(PT_KEY_EMPTY_Z);
    uint32_t at = y * view->width + x;
    float sum[4] = {0.0f, 0.0f, 0.0f, 0.0f}, count = 0.0f, limit = empty;
    if (job->args->layers)
        limit = pt_float((uint32_t)(keys[at] >> 32)) + deff[from[at] & ~PT_FROM_MIXED];
    for (int i = 0; i < 4; i++) {
        uint32_t qx = x + (uint32_t)pt_cross[i][0], qy = y + (uint32_t)pt_cross[i][1];
        if (qx >= view->width || qy >= view->height)
            continue; // unknown: no edge
        size_t q = (size_t)qy * view->width + qx;
        float z = pt_float((uint32_t)(keys[q] >> 32));
        if (!(z > limit || z == empty) || (through && z == empty && through[q] < PT_SPENT))
            continue;
        count += 1.0f;
        for (size_t k = 0; k < 4 && z < empty; k++)
            sum[k] = sum[k] + colors[4 * q + k];
    }
    if (!(count > 0.0f))
        return 0;
    edge->pixel = at;
    memcpy(edge->color, colors + 4 * (size_t)at, sizeof edge->color);
    pt_mix_edge(edge->color, sum, count, (uint32_t)keys[at] - job->args->mesh_base < job->args->mesh_count);
    return 1;
}

// Which of PT_LANES pixels may be edges.
static uint32_t look(const struct antialias *job, uint32_t x, uint32_t y, uint32_t lanes)
{
    const struct view_args *view = &job->args->view;
    size_t at = (size_t)y * view->width + x;
    const uint64_t *keys = (const uint64_t *)PT_DATA(job->call, antialias, keys) + at;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), z = vi_float(vi_load_z(keys));
    vm some = vm_and(vm_first(lanes), vf_lt(z, empty));
    if (job->args->inked)
        some = vm_and(some, vm_not(vf_lt(vf_zero(), vf_load((const float *)PT_DATA(job->call, antialias, line) + at))));
    if (!vm_bits(some))
        return 0;
    vf limit = empty;
    if (job->args->layers) {
        vi from = vi_and(vi_load((const uint32_t *)PT_DATA(job->call, antialias, from) + at), vi_set(~PT_FROM_MIXED));
        limit = z + vf_gather(PT_DATA(job->call, antialias, deff), from, some);
    }
    vf far = z; // the farthest of the four
    for (int i = 0; i < 4; i++) {
        int64_t offset = pt_cross[i][1] * (int64_t)view->width + pt_cross[i][0];
        if (y + (uint32_t)pt_cross[i][1] >= view->height)
            continue;
        if (!at && offset < 0)
            return vm_bits(some); // nothing may be read before the plane
        far = vf_max(far, vi_float(vi_load_z(keys + offset)));
    }
    vm edge = vm_or(vf_lt(limit, far), vf_le(empty, far));
    return vm_bits(vm_and(some, edge));
}

static void look_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct antialias *job = context;
    const uint32_t *rect = job->args->view.rect;
    (void)thread;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(job->call); band++) {
        struct edge *list = job->edges + band * job->band_edges;
        uint32_t count = 0, first = rect[1] + band * BAND_ROWS;
        for (uint32_t y = first; y < first + BAND_ROWS && y < rect[3]; y++)
            for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
                uint32_t bits = look(job, x, y, pt_lanes_left(x, rect[2]));
                for (; bits; bits &= bits - 1)
                    count += (uint32_t)edge_color(job, x + (uint32_t)__builtin_ctz(bits), y, &list[count]);
            }
        job->counts[band] = count;
    }
}

static void apply_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct antialias *job = context;
    uint32_t *from = PT_DATA(job->call, antialias, from);
    float *colors = PT_DATA(job->call, antialias, color);
    (void)thread;
    for (uint32_t band = begin; band < end; band++)
        for (uint32_t i = 0; i < job->counts[band]; i++) {
            const struct edge *edge = &job->edges[band * job->band_edges + i];
            memcpy(colors + 4 * (size_t)edge->pixel, edge->color, sizeof edge->color);
            from[edge->pixel] |= PT_FROM_MIXED;
        }
}

int PT_KERNEL_ENTRY(antialias)(const struct pt_cpu_call *call)
{
    const struct antialias_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct antialias job = {.call = call, .args = args};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    uint32_t bands = (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS;
    job.band_edges = (size_t)(rect[2] - rect[0]) * BAND_ROWS;
    job.edges = pt_cpu_scratch(call, 1, bands * job.band_edges * sizeof *job.edges);
    job.counts = pt_cpu_scratch(call, 0, bands * sizeof *job.counts);
    if (!job.edges || !job.counts)
        return PATINA_ERROR_MEMORY;
    memset(job.counts, 0, bands * sizeof *job.counts);
    pt_parallel(call->pool, bands, 1, look_bands, &job);
    if (pt_cpu_cancelled(call))
        return PATINA_ERROR_CANCELLED;
    pt_parallel(call->pool, bands, 4, apply_bands, &job);
    return PATINA_OK;
}
