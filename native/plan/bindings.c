// SPDX-License-Identifier: GPL-3.0-or-later
// What a pass binds, held against what its kernel lists (kernels.def): how many, which formats, of whom, at which level.
#include "passes.h"

#include <stdio.h>

const struct pt_plane_row pt_plane_rows[PT_PLANE_COUNT] = {
#define PT_X(name, format, size, slots, carried) {#name, PT_FORMAT_##format, PT_SIZE_##size, PT_SLOTS_##slots, carried},
    PT_PLANES(PT_X)
#undef PT_X
};

static const uint8_t instance_formats[] = {
    [PT_CHUNKS] = PT_FORMAT_chunk,      [PT_POSITIONS] = PT_FORMAT_position, [PT_SURFELS] = PT_FORMAT_word,
    [PT_COLORS] = PT_FORMAT_color,      [PT_OPACITIES] = PT_FORMAT_opacity,  [PT_RADII] = PT_FORMAT_radius,
    [PT_SCALARS] = PT_FORMAT_scalar,    [PT_CLASSES] = PT_FORMAT_class,      [PT_SHAPES] = PT_FORMAT_shape,
    [PT_SIGHTS] = PT_FORMAT_sight,      [PT_MARKS] = PT_FORMAT_mark,         [PT_SHADOWS] = PT_FORMAT_shadow,
    [PT_CLIPS] = PT_FORMAT_clip,        [PT_DRAWN] = PT_FORMAT_bits,         [PT_MASK] = PT_FORMAT_bits,
    [PT_FIELD] = PT_FORMAT_field,       [PT_FIELD_ONE] = PT_FORMAT_field,    [PT_SCANS] = PT_FORMAT_scan,
    [PT_FINE_CHUNKS] = PT_FORMAT_chunk, [PT_FINER_CHUNKS] = PT_FORMAT_chunk, [PT_FINEST_CHUNKS] = PT_FORMAT_chunk,
};
static const uint8_t plan_formats[] = {[PT_PLAN_LIGHTS] = PT_FORMAT_light, [PT_PLAN_RAMPS] = PT_FORMAT_ramp};
static const uint8_t mesh_formats[] = {
    [PT_MESH_VERTICES] = PT_FORMAT_vertex, [PT_MESH_INDICES] = PT_FORMAT_index, [PT_MESH_TEXELS] = PT_FORMAT_texel};

// Where a plane lies, seen from a pass at `level`; 0: it has no such level or layer.
static uint32_t places_of(const struct pt_ref *ref, uint32_t level)
{
    const struct pt_plane_row *plane = &pt_plane_rows[ref->which];
    const uint32_t slots = plane->slots == PT_SLOTS_LEVELS   ? (uint32_t)PT_LEVELS
                           : plane->slots == PT_SLOTS_LAYERS ? (uint32_t)PATINA_MAX_LAYERS
                                                             : 1;
    if (plane->size == PT_SIZE_TILES)
        return ref->index == PT_TILE_LEVEL ? PT_AT_tiles : 0;
    if (ref->index >= slots)
        return 0;
    if (plane->size == PT_SIZE_CROP)
        return PT_AT_crop;
    return (ref->index == 0 ? PT_AT_window : 0) | (ref->index == level ? PT_AT_own : 0) |
           (ref->index + 1 == level ? PT_AT_finer : 0) | (ref->index == level + 1 ? PT_AT_coarser : 0);
}

static int is_plane(const struct pt_ref *ref)
{
    return ref->of == PT_OF_FRAME || ref->of == PT_OF_LEFT || ref->of == PT_OF_PICTURE;
}

// *format: of what it binds. Returns its places.
static uint32_t look_up(const struct pt_ref *ref, uint32_t level, enum pt_format *format)
{
    if (is_plane(ref)) {
        *format = pt_plane_rows[ref->which].format;
        return places_of(ref, level);
    }
    *format = ref->of == PT_OF_MESH   ? mesh_formats[ref->which]
              : ref->of == PT_OF_PLAN ? plan_formats[ref->which]
              : ref->of == PT_OF_FLAG ? PT_FORMAT_flag
                                      : instance_formats[ref->which];
    return ref->of == PT_OF_MESH ? PT_AT_mesh : ref->of == PT_OF_PLAN ? PT_AT_plan : PT_AT_cloud;
}

static int same(const struct pt_ref *a, const struct pt_ref *b)
{
    return is_plane(a) && a->of == b->of && a->which == b->which && a->index == b->index;
}

static const char *const wrong_place = "it lies elsewhere, or has no such level";

// NULL: as listed.
static const char *wrong_ref(const struct pt_buffer_row *row, const struct pt_ref *refs, uint32_t count, uint32_t i,
                             uint32_t level)
{
    enum pt_format format;
    if (refs[i].of == PT_OF_NOTHING)
        return row->optional ? NULL : "it is missing";
    const uint32_t places = look_up(&refs[i], level, &format);
    if (!(row->formats & 1u << format))
        return pt_format_names[format];
    for (uint32_t k = 0; k < count && row->written; k++)
        if (k != i && same(&refs[k], &refs[i]))
            return "it is written, and bound twice";
    return places & row->places ? NULL : wrong_place;
}

int pt_check_bindings(enum pt_kernel kernel, const void *arguments, const struct pt_ref *refs, uint32_t count)
{
    const struct pt_kernel_row *row = &pt_kernels[kernel];
    if (count < row->fixed || (row->each ? (count - row->fixed) % row->each != 0 : count != row->fixed))
        return pt_fail(NULL, PATINA_ERROR_INTERNAL, "the plan binds %u buffers to %s, which lists %u and %u an instance", count,
                       row->name, row->fixed, row->each);
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_buffer_row *buffer = &row->buffers[i < row->fixed ? i : row->fixed + (i - row->fixed) % row->each];
        const int levels = buffer->places &
                           (PT_AT_own | PT_AT_finer | PT_AT_coarser); // such kernels' arguments begin with a view
        const char *wrong = wrong_ref(buffer, refs, count, i, levels ? ((const struct view_args *)arguments)->level : 0);
        if (wrong)
            return pt_fail(NULL, PATINA_ERROR_INTERNAL, "the plan binds what %s does not list as %s: %s", row->name,
                           buffer->name, wrong);
    }
    return PATINA_OK;
}
