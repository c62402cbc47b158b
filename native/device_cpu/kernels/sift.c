// SPDX-License-Identifier: GPL-3.0-or-later
// sift: which points of divided chunks are drawn: those that clips, hidden classes, hidden shapes, masks and fields leave; twin of
// shaders/kernels/sift.comp
//
// Distances to a clip are sums of products in one written order, as scatter's: what is cut is cut on every device.
#include "clip.h"
#include "device_cpu/cpu.h"
#include "device_cpu/points.h"
#include "shared/points.h"

struct sift {
    const struct pt_cpu_call *call;
    uint32_t hides[256], hides_shape[256]; // by class, by the shape's byte
    uint32_t hides_scan[32 * PT_SCAN_WORDS];
};

// Of a plane: cut.
static inline vm inside(const struct clip_view *clip, const vf p[3])
{
    const vf one = vf_set(1.0f);
    if (clip->shape == PT_CLIP_PLANE)
        return vf_lt(vf_zero(), pt_clip_row(clip, 2, p));
    vm in = vf_le(vf_abs(pt_clip_row(clip, 0, p)), one);
    in = vm_and(in, vf_le(vf_abs(pt_clip_row(clip, 1, p)), one));
    return vm_and(in, vf_le(vf_abs(pt_clip_row(clip, 2, p)), one));
}

// Which of PT_LANES points from slot i of the chunk on.
static uint32_t drawn(const struct sift *sift, const struct chunk_view *chunk, const uint32_t *points, uint32_t i)
{
    const struct sift_args *args = sift->call->arguments;
    vm keep = vm_of_bits(chunk->clip_keeps ? 0u : ~0u), cut = vm_of_bits(0);
    if (chunk->clip_count) { // else positions need not come from memory, and there may be no clips
        const struct clip_view *clips = (const struct clip_view *)PT_DATA(sift->call, sift, clips) + chunk->clip_first;
        vf p[3];
        pt_load_points(chunk, points, i, p);
        for (uint32_t k = 0; k < chunk->clip_keeps; k++)
            keep = vm_or(keep, inside(&clips[k], p));
        for (uint32_t k = chunk->clip_keeps; k < chunk->clip_count; k++)
            cut = vm_or(cut, inside(&clips[k], p));
    }
    if (args->by_class) {
        const vm all = vm_first(PT_LANES);
        vi slot = vi_add(vi_set(chunk->first + i), vi_lanes());
        vi class = vi_and(vi_gather_bytes(PT_DATA(sift->call, sift, classes), slot, all), vi_set(255));
        cut = vm_or(cut, vi_lt_unsigned(vi_set(0), vi_gather(sift->hides, class, all)));
    }
    if (args->by_shape) {
        const uint32_t *shapes = (const uint32_t *)PT_DATA(sift->call, sift, shapes) + chunk->first + i;
        vi sight = vi_and(vi_shr(vi_load(shapes), PT_SHAPE_SIGHT_SHIFT), vi_set(255));
        cut = vm_or(cut, vi_lt_unsigned(vi_set(0), vi_gather(sift->hides_shape, sight, vm_first(PT_LANES))));
    }
    if (args->by_field) {
        const uint32_t *field = (const uint32_t *)PT_DATA(sift->call, sift, field) + chunk->first + i;
        cut = vm_or(cut, vi_lt_unsigned(vi_set(args->threshold), vi_shr(vi_load(field), PT_FIELD_SHIFT)));
    }
    if (args->by_scan) {
        const vm all = vm_first(PT_LANES);
        const vi slot = vi_add(vi_set(chunk->first + i), vi_lanes()), most = vi_set(32 * PT_SCAN_WORDS);
        const vi scan = vi_and(vi_gather_bytes(PT_DATA(sift->call, sift, scans), vi_add(slot, slot), all), vi_set(0xFFFFu));
        const vm known = vi_lt_unsigned(scan, most);
        const vi hides = vi_gather(sift->hides_scan, vi_select(known, scan, vi_set(0)), all);
        cut = vm_or(cut, vm_and(known, vi_lt_unsigned(vi_set(0), hides)));
    }
    return vm_bits(vm_and(keep, vm_not(cut))) & PT_ALL;
}

static void sift_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct sift *sift = context;
    const struct chunk_view *chunks = PT_DATA(sift->call, sift, chunks);
    const struct sift_args *args = sift->call->arguments;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(sift->call); c++) {
        const struct chunk_view *chunk = &chunks[c];
        const uint32_t *points = pt_chunk_points(PT_DATA(sift->call, sift, positions), chunk);
        uint32_t *words = (uint32_t *)PT_DATA(sift->call, sift, drawn) + chunk->sifted - 1;
        const uint32_t *mask = args->by_mask
                                   ? (const uint32_t *)PT_DATA(sift->call, sift, mask) + chunk->first / PT_SLOTS_A_WORD
                                   : NULL;
        for (uint32_t first = 0; first < chunk->count && chunk->sifted; first += PT_SLOTS_A_WORD) {
            uint32_t word = 0;
            for (uint32_t i = 0; i < PT_SLOTS_A_WORD; i += PT_LANES)
                word |= drawn(sift, chunk, points, first + i) << i;
            words[first / PT_SLOTS_A_WORD] = mask ? word & ~mask[first / PT_SLOTS_A_WORD] : word;
        }
    }
}

int PT_KERNEL_ENTRY(sift)(const struct pt_cpu_call *call)
{
    const struct sift_args *args = call->arguments;
    struct sift sift = {.call = call};
    for (uint32_t i = 0; i < 256; i++) {
        sift.hides[i] = args->hidden[i / 32] >> i % 32 & 1u;
        sift.hides_shape[i] = args->hidden_shapes[i / 32] >> i % 32 & 1u;
    }
    for (uint32_t i = 0; i < 32 * PT_SCAN_WORDS; i++)
        sift.hides_scan[i] = args->hidden_scans[i / 32] >> i % 32 & 1u;
    pt_parallel(call->pool, (uint32_t)(call->buffers[PT_BUF_sift_chunks]->size / sizeof(struct chunk_view)), 4, sift_chunks,
                &sift);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
