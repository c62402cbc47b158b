// SPDX-License-Identifier: GPL-3.0-or-later
#include "clip.h"
#include "scene/clouds/shape_word.h"
#include "mask.h"
#include "scans.h"

#include <math.h>
#include <string.h>

// ---- inverses ------------------------------------------------------------------------------------------------------------

// The last row of a plane's: unit, towards its z; 0 without x and y axes. A plane flat along its z has one all the same.
static int invert_plane(const double linear[9], uint32_t cut, double inverse[9])
{
    double cofactors[9], *n = inverse + 6;
    pt_cofactors(linear, cofactors);
    double sign = (pt_determinant(linear) < 0.0 ? -1.0 : 1.0) * (cut ? -1.0 : 1.0);
    memset(inverse, 0, 9 * sizeof *inverse);
    for (int k = 0; k < 3; k++) // the cross product of the x and y columns
        n[k] = cofactors[3 * k + 2];
    double length = sqrt(pt_dot(n, n));
    for (int k = 0; k < 3; k++)
        n[k] = length > 0.0 ? sign * n[k] / length : 0.0;
    return length > 0.0 && isfinite(length);
}

// 0: flat, there is nothing in it.
static int invert_box(const double linear[9], double inverse[9])
{
    double sizes = 1.0, determinant = pt_invert(linear, inverse);
    for (int c = 0; c < 3; c++)
        sizes *= sqrt(linear[c] * linear[c] + linear[3 + c] * linear[3 + c] + linear[6 + c] * linear[6 + c]);
    return fabs(determinant) > 1e-12 * sizes && isfinite(sizes);
}

static int invert_clip(const patina_clip *clip, struct pt_inverse_clip *out)
{
    double linear[9];
    out->clip = clip;
    out->shape = clip->shape == PATINA_CLIP_PLANE ? PT_CLIP_PLANE : clip->cut ? PT_CLIP_CUT : PT_CLIP_KEEP;
    pt_split_matrix(clip->world_from_clip, linear, out->center);
    return out->shape == PT_CLIP_PLANE ? invert_plane(linear, clip->cut, out->inverse) : invert_box(linear, out->inverse);
}

// ---- shapes --------------------------------------------------------------------------------------------------------------

// The least level that the style wants, whether the cloud has points of it or not. 0 of a cloud that was not analysed.
static uint32_t wanted_level(const struct pt_instance *instance)
{
    const patina_cloud_info *info = &instance->cloud->info;
    const double least = (double)instance->style.least_trust;
    if (!info->has_shapes)
        return 0;
    return least == 0.0 ? pt_default_level(info->trusts) : pt_lowest_level(least);
}

// The least level of trust that the instance draws; 0: all points, also where none has as much as the style wants.
static uint32_t trusted_from(const struct pt_instance *instance)
{
    const patina_cloud_info *info = &instance->cloud->info;
    const uint32_t level = wanted_level(instance);
    const uint64_t untrusted = pt_points_below(info, level);
    return untrusted && untrusted < pt_points_below(info, PT_TRUST_TOP + 1) ? level : 0;
}

uint64_t pt_none_trusted(const struct pt_instance *instance)
{
    const patina_cloud_info *info = &instance->cloud->info;
    const uint64_t untrusted = pt_points_below(info, wanted_level(instance));
    return untrusted == pt_points_below(info, PT_TRUST_TOP + 1) ? untrusted : 0;
}

uint64_t pt_untrusted(const struct pt_instance *instance)
{
    return pt_points_below(&instance->cloud->info, trusted_from(instance));
}

int pt_hidden_shapes(const struct pt_instance *instance, uint32_t hidden[8])
{
    const patina_cloud_style *style = &instance->style;
    uint32_t any = 0;
    memset(hidden, 0, 8 * sizeof *hidden);
    const uint32_t trusted = trusted_from(instance);
    const int asked = style->hidden_kinds || trusted || style->free_space == PATINA_FREE_SPACE_USE;
    if (!asked || !instance->cloud->info.has_shapes)
        return 0;
    for (uint32_t sight = 0; sight < 256; sight++) {
        const uint32_t word = sight << PT_SHAPE_SIGHT_SHIFT;
        const uint32_t out = (style->hidden_kinds >> PT_SHAPE_KIND(word) & 1u) |
                             ((word >> PT_SHAPE_TRUST_SHIFT & 15u) < trusted) |
                             (style->free_space == PATINA_FREE_SPACE_USE && (word & PT_SHAPE_SEEN_THROUGH));
        hidden[sight / 32] |= out << sight % 32;
        any |= out;
    }
    return any != 0;
}

int pt_is_marked(const struct pt_instance *instance)
{
    return instance->style.free_space == PATINA_FREE_SPACE_SHOW && instance->cloud->info.seen_through &&
           instance->style.color_source == PATINA_COLOR_OWN;
}

// ---- the sieve -----------------------------------------------------------------------------------------------------------

struct pt_sieve pt_sieve_make(const struct patina_scene *scene, const struct pt_instance *instance, enum pt_points points,
                              struct pt_inverse_clip *room)
{
    const patina_cloud_info *info = &instance->cloud->info;
    struct pt_sieve sieve = {.instance = instance, .clips = room};
    sieve.hiding_shapes = pt_hidden_shapes(instance, sieve.hidden_shapes);
    sieve.mask = pt_mask_of(instance);
    if (instance->style.soft == PATINA_SOFT_HIDDEN || (points != PT_EVERY_POINT && pt_has_field(&instance->style))) {
        sieve.field = instance->style.field;
        sieve.threshold = pt_field_steps(instance->style.soft_threshold);
        sieve.soft = points == PT_SOFT_POINTS;
    }
    if (points != PT_EVERY_POINT)
        sieve.hiding_scans = pt_hidden_scans(scene, instance, sieve.hidden_scans);
    for (int k = 0; k < 8; k++)
        sieve.hiding |= info->has_classes && (instance->style.hidden_classes[k] & info->class_bits[k]);
    for (int keeps = 1; keeps >= 0 && !instance->style.clip_off; keeps--) {
        for (uint32_t i = 0; i < scene->clip_count; i++) {
            struct pt_inverse_clip *clip = &room[sieve.count];
            int good = invert_clip(&scene->clips[i], clip);
            if ((clip->shape == PT_CLIP_KEEP) != keeps)
                continue;
            sieve.keeping |= keeps;
            sieve.count += (uint32_t)good;
        }
        sieve.keeps = keeps ? sieve.count : sieve.keeps;
    }
    return sieve;
}

// The frame of a chunk: row from its coordinates, translation of its origin.
static void chunk_frame(const struct pt_inverse_clip *clip, const double linear[9], const double origin[3], double row[9],
                        double translation[3])
{
    double from[3];
    for (int k = 0; k < 3; k++)
        from[k] = origin[k] - clip->center[k];
    pt_multiply(clip->inverse, linear, row);
    pt_apply(clip->inverse, from, translation);
}

// Where a box of points lies to the clip: 1 inside, 0 outside, -1 both or too close for float32 to tell. Inside of a plane
// is what it cuts.
static int inside(const struct pt_inverse_clip *clip, const double row[9], const double translation[3],
                  const struct pt_chunk *chunk)
{
    int whole = 1;
    for (int r = clip->shape == PT_CLIP_PLANE ? 2 : 0; r < 3; r++) {
        double middle = translation[r], reach = 0.0, error = fabs(translation[r]);
        for (int k = 0; k < 3; k++) {
            double low = (double)chunk->box_min[k], high = (double)chunk->box_max[k];
            middle += row[3 * r + k] * 0.5 * (low + high);
            reach += fabs(row[3 * r + k]) * 0.5 * (high - low);
            error += fabs(row[3 * r + k]) * fmax(fabs(low), fabs(high));
        }
        error *= 0x1p-20;
        double least = middle - reach - error, most = middle + reach + error;
        if (clip->shape == PT_CLIP_PLANE)
            return least > 0.0 ? 1 : most < 0.0 ? 0 : -1;
        if (least > 1.0 || most < -1.0)
            return 0;
        whole &= most < 1.0 && least > -1.0;
    }
    return whole ? 1 : -1;
}

// By class or shape: 1 hidden, 0 drawn, -1 some of each. has: of the chunk's points.
static int hides(const uint32_t hidden[8], const uint32_t has[8])
{
    uint32_t out = 0, in = 0;
    for (int k = 0; k < 8; k++) {
        out |= has[k] & hidden[k];
        in |= has[k] & ~hidden[k];
    }
    return !out ? 0 : in ? -1 : 1;
}

// Which points of a chunk the field leaves to the other side.
static enum pt_masked leaves(const struct pt_sieve *sieve, size_t chunk)
{
    if (!sieve->field)
        return PT_MASKED_NONE;
    const int some_soft = sieve->field->chunks[chunk][1] > sieve->threshold,
              all_soft = sieve->field->chunks[chunk][0] > sieve->threshold;
    if (sieve->soft)
        return all_soft ? PT_MASKED_NONE : some_soft ? PT_MASKED_SOME : PT_MASKED_ALL;
    return all_soft ? PT_MASKED_ALL : some_soft ? PT_MASKED_SOME : PT_MASKED_NONE;
}

// Which points of a chunk are of hidden scans; of one with many, SOME where it is not told.
static enum pt_masked hidden_of(const struct pt_sieve *sieve, size_t chunk)
{
    const uint16_t *range = sieve->instance->style.scans->chunks[chunk];
    int some = 0, all = 1;
    for (uint32_t scan = range[0]; scan <= range[1] && (all || !some); scan++) {
        const int hidden = scan < 32 * PT_SCAN_WORDS && sieve->hidden_scans[scan / 32] >> scan % 32 & 1u;
        some |= hidden;
        all &= hidden;
    }
    return all ? PT_MASKED_ALL : some ? PT_MASKED_SOME : PT_MASKED_NONE;
}

// Where the chunk lies to clip i; what is divided becomes an entry.
static int meet(const struct pt_sieve *sieve, uint32_t i, const struct pt_chunk *chunk, const double linear[9],
                const double origin[3], struct clip_view *entries, struct pt_division *division)
{
    double row[9], translation[3];
    chunk_frame(&sieve->clips[i], linear, origin, row, translation);
    int where = inside(&sieve->clips[i], row, translation, chunk);
    if (where == -1 && entries)
        pt_clip_in_frame(&sieve->clips[i], linear, origin, &entries[division->count]);
    division->count += where == -1;
    return where;
}

// How masks, fields and scans divide a chunk.
struct marked {
    enum pt_masked masked, left, unseen;
};

static enum pt_side side_of(const struct pt_sieve *sieve, const struct pt_chunk *chunk, const struct marked *by,
                            struct clip_view *entries, struct pt_division *division)
{
    struct pt_division found = {0};
    double linear[9], object[3], origin[3];
    int by_class = sieve->hiding ? hides(sieve->instance->style.hidden_classes, chunk->classes) : 0;
    int by_shape = sieve->hiding_shapes ? hides(sieve->hidden_shapes, chunk->shapes) : 0, kept = !sieve->keeping;
    if (by_class == 1 || by_shape == 1 || by->masked == PT_MASKED_ALL || by->left == PT_MASKED_ALL ||
        by->unseen == PT_MASKED_ALL)
        return PT_CUT_AWAY;
    found.by_class = by_class != 0;
    found.by_shape = by_shape != 0;
    found.by_mask = by->masked == PT_MASKED_SOME;
    found.by_field = by->left == PT_MASKED_SOME && !sieve->soft;
    found.by_scan = by->unseen == PT_MASKED_SOME;
    pt_split_matrix(sieve->instance->style.world_from_object, linear, object);
    pt_apply(linear, chunk->origin, origin);
    for (int k = 0; k < 3; k++)
        origin[k] += object[k];
    for (uint32_t i = 0; i < sieve->keeps && !kept; i++)
        kept = meet(sieve, i, chunk, linear, origin, entries, &found) == 1;
    found.keeps = found.count = kept ? 0 : found.count;
    if (!kept && !found.keeps)
        return PT_CUT_AWAY;
    for (uint32_t i = sieve->keeps; i < sieve->count; i++)
        if (meet(sieve, i, chunk, linear, origin, entries, &found) == 1)
            return PT_CUT_AWAY;
    if (division)
        *division = found;
    return found.count || found.by_class || found.by_shape || found.by_mask || found.by_field || found.by_scan ? PT_DIVIDED
                                                                                                               : PT_WHOLE;
}

enum pt_side pt_sieve_chunk(const struct pt_sieve *sieve, const struct pt_chunk *chunk, struct clip_view *entries,
                            struct pt_division *division)
{
    if (!pt_sieves(sieve))
        return PT_WHOLE; // of most scenes all are
    const size_t place = (size_t)(chunk - sieve->instance->cloud->chunks);
    const struct marked by = {sieve->mask ? sieve->mask->chunks[place] : PT_MASKED_NONE, leaves(sieve, place),
                              sieve->hiding_scans ? hidden_of(sieve, place) : PT_MASKED_NONE};
    return side_of(sieve, chunk, &by, entries, division);
}

enum pt_side pt_sieve_page(const struct pt_sieve *sieve, const struct pt_chunk *box)
{
    const struct marked none = {PT_MASKED_NONE, PT_MASKED_NONE, PT_MASKED_NONE};
    return pt_sieves(sieve) ? side_of(sieve, box, &none, NULL, NULL) : PT_WHOLE;
}

void pt_clip_in_frame(const struct pt_inverse_clip *clip, const double linear[9], const double origin[3], struct clip_view *out)
{
    double row[9], translation[3];
    chunk_frame(clip, linear, origin, row, translation);
    *out = (struct clip_view){.shape = clip->shape, .strength = clip->clip->tint_strength, .width = clip->clip->tint_width};
    for (int k = 0; k < 9; k++)
        out->row[k] = (float)row[k];
    for (int k = 0; k < 3; k++) {
        const double *m = clip->clip->world_from_clip;
        out->hi[k] = (float)translation[k];
        out->lo[k] = (float)(translation[k] - (double)out->hi[k]);
        out->half_size[k] = (float)sqrt(m[k] * m[k] + m[4 + k] * m[4 + k] + m[8 + k] * m[8 + k]);
        out->tint[k] = clip->clip->tint[k];
    }
}
