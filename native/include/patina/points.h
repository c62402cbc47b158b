// SPDX-License-Identifier: GPL-3.0-or-later
// Single points of clouds, a part of patina.h, which includes it: hidden, selected, graded by scan, soft by a field, and picked on the picture. Its
// conventions and thread rules hold here too.
#ifndef PATINA_POINTS_H
#define PATINA_POINTS_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- single points: hidden, selected, graded by scan ---------------------------------------------------------------

// What somebody did with single points of a cloud: bits, of point i in the given order bit i % 8 of byte i / 8. hidden, selected:
// (count + 7) / 8 bytes each, `size` says so; NULL = none. Copied; 4 bytes for 16 points. The mask is of this cloud alone, is
// given to scenes by style.mask, and never changes: after an edit make another. Any number of masks of one cloud.
PATINA_API int patina_mask_create(const patina_cloud *cloud, const uint8_t *hidden, const uint8_t *selected, size_t size,
                                  patina_mask **out);
PATINA_API void patina_mask_destroy(patina_mask *mask);

// How the colours of a scan are changed, as light and in this order: times gain, warmer or colder, saturation around the luminance, to
// the power of 1 / gamma. { 1, 1, 1, 0 } changes nothing.
typedef struct patina_scan_grade {
    float gain;        // 0..65504
    float gamma;       // 0.01..100; above 1 what is dark becomes lighter
    float saturation;  // 0..100; 0 = grey
    float temperature; // -16..16: stops by which red gains on blue, at the luminance of white
} patina_scan_grade;

// A cloud's own colours, each point's changed by the grade of its scan. scans: of each point in the given order, info.count; NULL = all
// are of scan 0. Scans from `count` on (1..1024 grades) stay as they are. As much memory as the cloud's colours take; given to scenes by
// style.grade, where color_source is OWN. PATINA_ERROR_EMPTY for a cloud without colours. After patina_cloud_set_colors make another.
PATINA_API int patina_grade_create(const patina_cloud *cloud, const uint16_t *scans, const patina_scan_grade *grades, uint32_t count,
                                   patina_grade **out);
PATINA_API void patina_grade_destroy(patina_grade *grade);

// ---- fields: which points are soft ---------------------------------------------------------------------------------

// A number of 0 to 1 for each point of a cloud, in the given order, `count` of them as patina_cloud_info has it; kept in 65536 steps,
// what lies beyond as the nearer end, NaN as 0. Copied; 2 bytes a point, and 4 on a device. Given to scenes by style.field, which has
// the threshold: one field serves any. It never changes: after an edit make another. Any number of fields of one cloud.
PATINA_API int patina_field_create(const patina_cloud *cloud, const float *values, uint64_t count, patina_field **out);
PATINA_API void patina_field_destroy(patina_field *field);

// ---- picking: which points lie in an outline on the picture ---------------------------------------------------------

typedef struct patina_pick {
    size_t struct_size;
    uint32_t instance;      // of the scene
    const double *polygon;  // corners x 2: pixels of the full picture from its bottom left, closed by itself, even and odd: what an
                            // outline goes around twice is outside. NULL = everything
    uint32_t corners;       // 3..16384; 0 = no polygon
    uint32_t classes[8];    // bits as in patina_cloud_info.class_bits: only points of these; all zero = any
    uint32_t threads;       // 0 = one per core
} patina_pick;

// Sets the bits (as a mask's; size: (count + 7) / 8 bytes) of an instance's points that the scene draws: hidden by no class, kind, mask
// or clip, and with a polygon, whose projection by the scene's camera is in the picture, inside of the polygon and between the clip
// distances; the other bits are cleared. frame: the scene was rendered in it last, and only points are picked that its first
// layer shows: those that lie at most two spacings, or four pixels' width, behind what it has at their pixel, or one that is within a
// hundredth of a pixel. NULL = whatever stands before them. Float64;
// blocks; progress may be NULL, and stops it from any thread. About 13 ns a point of one core, in chunks that the outline may hold.
PATINA_API int patina_scene_pick(const patina_scene *scene, const patina_frame *frame, const patina_pick *pick,
                                 patina_progress *progress, uint8_t *bits, size_t size);
// Mixes a colour into the pixels of a COMBINED pass whose nearest point is selected by its instance's mask, filled ones too: for
// viewports. scene: rendered last in the frame. strength: 0..1, the colour's share. pixels: width * height * 4.
PATINA_API int patina_frame_highlight(const patina_frame *frame, const patina_scene *scene, const float color[3], float strength,
                                      float *pixels, size_t size);

#ifdef __cplusplus
}
#endif
#endif
