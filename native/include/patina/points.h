// SPDX-License-Identifier: GPL-3.0-or-later
// Single points of clouds, a part of patina.h, which includes it: hidden, selected, graded by scan, soft by a field, numbered and picked on the picture. Its
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
// given to scenes by style.mask, and never changes: after an edit make another. Any number of masks of one cloud. Like grades, scans and
// fields PATINA_ERROR_UNSUPPORTED while points of the cloud are on their way (pages.h), and PATINA_ERROR_TOO_MANY_POINTS of one in pages of more
// than 2^31 - 1 points.
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
// are of scan 0. Scans from `count` on (1..65535 grades) stay as they are. As much memory as the cloud's colours take; given to scenes by
// style.grade, where color_source is OWN. PATINA_ERROR_EMPTY for a cloud without colours. After patina_cloud_set_colors make another.
PATINA_API int patina_grade_create(const patina_cloud *cloud, const uint16_t *scans, const patina_scan_grade *grades,
                                   uint32_t count, patina_grade **out);
// The same; before its grade, the light of each scan is multiplied by three numbers, red, green and blue, 0..65504 each. NULL = none.
// keep_colors: 1 = points that were measured without a color are black, whatever color an analysis lent them, and SOURCE is 1 there; else 0.
PATINA_API int patina_grade_create_balanced(const patina_cloud *cloud, const uint16_t *scans, const patina_scan_grade *grades,
                                            const float *balance, uint32_t count, uint32_t keep_colors, patina_grade **out);
PATINA_API void patina_grade_destroy(patina_grade *grade);
// Finds by how much the light of scans differs where they overlap, as with other exposures and white balances (SPEC 11), and writes what to
// multiply it by: red, green and blue of each of `count` scans (1..65535), for patina_grade_create_balanced. The gains of scans that
// overlap have the mean 1; each is 0.25..4. 1 for a scan that overlaps no other one, and where no color tells. scans: of each point in the
// given order, info.count; points of scans from `count` on do not count. Untrusted points of analysed clouds neither. Takes about a second
// at most, whatever the cloud; 20 bytes a point of 2 million meanwhile, of more than 64 million a 32nd of the points. progress may be NULL.
// Any number of threads gives the same bits. PATINA_ERROR_EMPTY for a cloud without colors.
PATINA_API int patina_cloud_balance(const patina_cloud *cloud, const uint16_t *scans, uint32_t count, patina_progress *progress,
                                    float *gains);

// ---- scans: which range image each point is of -----------------------------------------------------------------------

// One of the scans that a cloud was made of, in object units.
typedef struct patina_scan {
    double direction[3]; // in which the scanner looked, any length; 0 = not known, or all around: never culled by it
    double interval;     // between neighbouring samples; 0 = not known: the cloud's spacings stand for it
} patina_scan;

// scan: of each point in the given order, info.count, as the attribute "scan" of files counts them from 0; NULL = all are of scan 0.
// Points of scans from `count` on (1..65535) have neither direction nor interval. 2 bytes a point. Given to scenes by style.scans, for
// PATINA_SURFACE_RANGES. It never changes. Any number of them of one cloud.
PATINA_API int patina_scans_create(const patina_cloud *cloud, const uint16_t *scan, const patina_scan *scans, uint32_t count,
                                   patina_scans **out);
PATINA_API void patina_scans_destroy(patina_scans *scans);

// ---- fields: which points are soft ---------------------------------------------------------------------------------

enum patina_field_source {        // of a point's number
    PATINA_FIELD_VALUES = 0,      // desc.values
    PATINA_FIELD_SCALAR = 1,      // the cloud's scalar
    PATINA_FIELD_LUMINANCE = 2,   // of its colour, 0..1 as a screen shows it
    PATINA_FIELD_CLASSES = 3,     // 1 of classes that desc.classes names, else 0
    PATINA_FIELD_DISTANCE = 4,    // from desc.shape, world units
    PATINA_FIELD_UNCERTAINTY = 5, // [S Eq. 21] of its 16 nearest, 0..1; takes as long as an analysis
    PATINA_FIELD_DENSITY = 6,     // points per area of the object, where the point lies
};
enum patina_field_shape {        // of world_from_shape
    PATINA_FIELD_FROM_POINT = 0, // its origin
    PATINA_FIELD_FROM_PLANE = 1, // x and y through its origin; below it negative
    PATINA_FIELD_FROM_AXIS = 2,  // z through its origin
};

typedef struct patina_field_desc {
    size_t struct_size;
    uint32_t source;     // patina_field_source
    uint32_t shape;      // patina_field_shape, for DISTANCE
    uint64_t count;      // of values: patina_cloud_info.count
    const float *values; // in the given order
    double range[2]; // numbers that become 0 and 1, straight between; the first may be the greater. Equal: 0 and 1 where all
                     // lie within, else what one point of a hundred lies below, and above
    uint32_t classes[8];                                // bits as in patina_cloud_info.class_bits
    uint32_t invert;                                    // 1 = 1 becomes 0, and the reverse; NaN stays 0
    uint32_t unused;                                    // says nothing
    double world_from_object[16], world_from_shape[16]; // row-major; all zero = identity
} patina_field_desc;

// A number of 0 to 1 for each point of a cloud, in 65536 steps; what lies beyond the range is its nearer end, NaN 0. 2 bytes a point,
// and 4 on a device. Given to scenes by style.field, which has the threshold: one field serves any. It never changes: after an edit
// make another. Any number of fields of one cloud. PATINA_ERROR_EMPTY where the cloud has no such numbers. progress: may be NULL, ends
// UNCERTAINTY early.
PATINA_API int patina_field_create(const patina_cloud *cloud, const patina_field_desc *desc, patina_progress *progress,
                                   patina_field **out);
PATINA_API void patina_field_destroy(patina_field *field);

typedef struct patina_field_info {
    size_t struct_size;
    double range[2];         // numbers that became 0 and 1: the given ones, or those that were found
    uint64_t histogram[256]; // b: drawn points whose number is from b / 256 on and below (b + 1) / 256; the last: 1 too
} patina_field_info;

// Any thread.
PATINA_API int patina_field_get_info(const patina_field *field, patina_field_info *info);

// ---- numbers of points in a picture ---------------------------------------------------------------------------------

// What each pixel of the first layer shows, width * height uint64: the number of a point, counted over all instances of clouds in the
// order in which they were added, or behind those of a triangle, over all meshes; UINT64_MAX: nothing. As the ids of
// patina_frame_read_keys, and gone when these are, in scenes of any size: keys hold 32 bits.
PATINA_API int patina_frame_read_numbers(const patina_frame *frame, uint64_t *numbers, size_t size);

// ---- picking: which points lie in an outline on the picture ---------------------------------------------------------

typedef struct patina_pick {
    size_t struct_size;
    uint32_t instance; // of the scene
    const double
        *polygon;     // corners x 2: pixels of the full picture from its bottom left, closed by itself, even and odd: what an
                      // outline goes around twice is outside. NULL = everything
    uint32_t corners; // 3..16384; 0 = no polygon
    uint32_t classes[8]; // bits as in patina_cloud_info.class_bits: only points of these; all zero = any
    uint32_t threads;    // 0 = one per core
} patina_pick;

// Sets the bits (as a mask's; size: (count + 7) / 8 bytes) of an instance's points that the scene draws: hidden by no class, kind, mask
// or clip, and with a polygon, whose projection by the scene's camera is in the picture, inside of the polygon and between the clip
// distances; the other bits are cleared. frame: the scene was rendered in it last, and only points are picked that its first
// layer shows: those that lie at most two spacings, or four pixels' width, behind what it has at their pixel, or one that is within a
// hundredth of a pixel. NULL = whatever stands before them. Float64;
// blocks; progress may be NULL, and stops it from any thread. About 13 ns a point of one core, in chunks that the outline may hold.
PATINA_API int patina_scene_pick(const patina_scene *scene, const patina_frame *frame, const patina_pick *pick,
                                 patina_progress *progress, uint8_t *bits, size_t size);

typedef struct patina_picked {
    size_t struct_size;
    uint32_t found;     // 1; 0: there is no such point, and all else is 0
    uint64_t number;    // of the point, in the given order
    double position[3]; // object space
    double distance;    // from the place, in pixels
} patina_picked;

// Of the points that patina_scene_pick would pick, the one that is projected nearest to a place in the image: x, y in pixels of the full
// picture from its bottom left. pick: has a polygon. Equally near: the one with the smallest number. Cost and threads: as patina_scene_pick.
PATINA_API int patina_scene_pick_nearest(const patina_scene *scene, const patina_frame *frame, const patina_pick *pick,
                                         const double place[2], patina_progress *progress, patina_picked *picked);
// Mixes a colour into the pixels of a COMBINED pass whose nearest point is selected by its instance's mask, filled ones too: for
// viewports. scene: rendered last in the frame. strength: 0..1, the colour's share. pixels: width * height * 4.
PATINA_API int patina_frame_highlight(const patina_frame *frame, const patina_scene *scene, const float color[3],
                                      float strength, float *pixels, size_t size);

#ifdef __cplusplus
}
#endif
#endif
