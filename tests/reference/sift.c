// SPDX-License-Identifier: GPL-3.0-or-later
// Clips, hidden classes, hidden shapes, masks, fields and scans, as patina.h says: kept is what lies in one of the boxes that keep, if there are
// any, in no box that cuts, and on the right side of every plane.
#include "reference.h"
#include "tolerances.h"
#include "shared/points.h"

#include <math.h>

static enum ref_truth within(const struct clip_view *clip, const double p[3])
{
    enum ref_truth in = REF_YES;
    for (int k = 0; k < 3; k++) {
        double error, q = fabs(ref_clip_row(clip, k, p, &error));
        enum ref_truth axis = q + error <= 1.0 ? REF_YES : q - error > 1.0 ? REF_NO : REF_UNSURE;
        in = in == REF_NO || axis == REF_NO ? REF_NO : in == REF_UNSURE ? REF_UNSURE : axis;
    }
    return in;
}

static enum ref_truth beyond(const struct clip_view *plane, const double p[3])
{
    double error, q = ref_clip_row(plane, 2, p, &error);
    return q - error > 0.0 ? REF_YES : q + error <= 0.0 ? REF_NO : REF_UNSURE;
}

enum ref_truth ref_sift(const struct sift_args *args, const struct chunk_view *chunk, const float *positions,
                        const uint8_t *classes, const uint32_t *shapes, const uint32_t *mask, const uint32_t *field,
                        const uint16_t *scans, const struct clip_view *clips, uint32_t slot)
{
    const float *base = positions + 3 * (size_t)chunk->first;
    const double p[3] = {base[slot], base[chunk->padded + slot], base[2 * (size_t)chunk->padded + slot]};
    enum ref_truth kept = chunk->clip_keeps ? REF_NO : REF_YES, cut = REF_NO;
    for (uint32_t i = 0; i < chunk->clip_count; i++) {
        const struct clip_view *clip = &clips[chunk->clip_first + i];
        enum ref_truth is = clip->shape == PT_CLIP_PLANE ? beyond(clip, p) : within(clip, p);
        enum ref_truth *sum = clip->shape == PT_CLIP_KEEP ? &kept : &cut;
        *sum = *sum == REF_YES || is == REF_YES ? REF_YES : *sum == REF_UNSURE ? REF_UNSURE : is;
    }
    if (args->by_class) {
        uint8_t class = classes[chunk->first + slot];
        if (args->hidden[class / 32] >> class % 32 & 1u)
            return REF_NO;
    }
    if (args->by_shape) {
        const uint32_t shape = shapes[chunk->first + slot];
        const uint32_t kind = shape >> PT_SHAPE_KIND_SHIFT & 7u, trust = shape >> PT_SHAPE_TRUST_SHIFT & 15u;
        const uint32_t sight = kind + 8 * trust + (shape & PT_SHAPE_SEEN_THROUGH ? 128 : 0);
        if (args->hidden_shapes[sight / 32] >> sight % 32 & 1u)
            return REF_NO;
    }
    if (args->by_mask && mask[(chunk->first + slot) / 16] >> (chunk->first + slot) % 16 & 1u)
        return REF_NO;
    if (args->by_field && field[chunk->first + slot] / 65536 > args->threshold)
        return REF_NO;
    if (args->by_scan && scans[chunk->first + slot] < 1024) {
        const uint16_t scan = scans[chunk->first + slot];
        if (args->hidden_scans[scan / 32] >> scan % 32 & 1u)
            return REF_NO;
    }
    if (kept == REF_NO || cut == REF_YES)
        return REF_NO;
    return kept == REF_YES && cut == REF_NO ? REF_YES : REF_UNSURE;
}
