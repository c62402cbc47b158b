// SPDX-License-Identifier: GPL-3.0-or-later
// The float64 reference: scalar, plain, written from SPEC.md and not from the kernels. One file a kernel.
//
// float32 decides some things otherwise than float64 would: a point on the border of two pixels, two depths d_eff apart.
// There the reference says "unsure", or gives a range of values; everywhere else there is one answer.
// Ranges hold every value that a correct float32 evaluation can have (tests/tolerances.h says why).
#ifndef PT_REFERENCE_H
#define PT_REFERENCE_H

#include "kernels.h"
#include "shared/view.h"

#include <stddef.h>
#include <stdint.h>

struct clip_view;
struct disc_args;
struct mesh_args;
struct station_args;

#define REF_EMPTY_KEY 0x7F800000FFFFFFFFull

struct ref_range {
    double lo, hi;
};

struct ref_vec {
    double x, y, z;
};

enum ref_truth { REF_NO, REF_YES, REF_UNSURE };

// ---- common.c: what SPEC 1 defines for all kernels ----------------------------------------------------------------

struct ref_vec ref_vec(double x, double y, double z);
struct ref_vec ref_vec_of(const float v[3]);
struct ref_vec ref_scale(struct ref_vec a, double s);
struct ref_vec ref_add(struct ref_vec a, struct ref_vec b);
double ref_dot(struct ref_vec a, struct ref_vec b);
double ref_length(struct ref_vec a);
struct ref_vec ref_unit(struct ref_vec a); // zero stays zero

double ref_key_z(uint64_t key); // +inf when empty
uint32_t ref_key_id(uint64_t key);
uint64_t ref_key(float z, uint32_t id);

struct ref_range ref_exactly(double value);
enum ref_truth ref_less(struct ref_range a, struct ref_range b);       // a < b
enum ref_truth ref_less_equal(struct ref_range a, struct ref_range b); // a <= b
struct ref_range ref_rounded(struct ref_range exact);                  // what float32 makes of an exact value
struct ref_range ref_difference(struct ref_range a, struct ref_range b);

// A pixel's ray at the view's level: (u, v, -1) in perspective, the position (u, v) in orthographic views.
struct ref_ray {
    double u, v;
    double error_u, error_v;
};
struct ref_ray ref_ray(const struct view_args *view, int x, int y);
struct ref_vec ref_viewer(const struct view_args *view, struct ref_ray ray); // unit vector from the surface to the eye

double ref_footprint(const struct view_args *view, double z); // width of a pixel of the view's level at z
double ref_ulp4(double z);                                    // 4 ulp of the float32 z
// max(d_min, K spacing, footprint, 4 ulp): d_eff without its division by the cosine.
double ref_layer_minimum(const struct view_args *view, double d_min, double spacing, double z);
// The same where sigma is known.
double ref_sure_minimum(const struct view_args *view, double d_min, double sigma, double spacing, double z);
// A pixel's own d_eff at the view's level, from the level-0 planes at its `from`.
struct ref_range ref_level_distance(const struct view_args *view, const float *normal, const float *deff, uint32_t from,
                                    struct ref_range z);
// Octahedral normal of a surfel, unit. 0 when it has none.
int ref_decode_normal(uint32_t word, struct ref_vec *normal);
double ref_srgb(uint8_t value); // sRGB to linear

// Depth at ray p of the plane with this normal through the point at ray q and depth z, kept in [z, z + limit].
struct ref_range ref_plane_depth(const struct view_args *view, const float normal[3], struct ref_ray q, struct ref_range z,
                                 struct ref_ray p, struct ref_range limit);
// That depth, `plane`, kept before `farthest`, or before what lies beside the pixel and no farther from it than z is: `beside`,
// `count` depths.
struct ref_range ref_within(struct ref_range z, struct ref_range plane, struct ref_range farthest,
                            const struct ref_range *beside, int count);
// How far z of a filled surface goes at most: beyond `measured`, its z in the cell that holds `from`, as far as its span reaches along it.
struct ref_range ref_farthest(struct ref_range measured, double span, double inverse);
// The cell of a level that holds a pixel of level 0.
size_t ref_cell_of(uint32_t pixel, uint32_t from_width, uint32_t level, uint32_t width);

// ---- scatter.c ------------------------------------------------------------------------------------------------------

// Where a point may fall, in pixels of the plane, both ends included.
struct ref_splat {
    uint32_t id;
    int possible; // 0: falls nowhere
    int definite; // falls in exactly the one pixel (x0, y0), whatever the rounding
    int x0, y0, x1, y1;
    struct ref_range z;
};
// positions, surface: of the instance. slot counts from the chunk's first; with that, it is the point's id.
struct ref_splat ref_scatter(const struct view_args *view, const struct chunk_view *chunk, const float *positions,
                             const uint32_t *surfels, uint32_t slot);

// Where a point is on screen, in pixels of the full picture.
struct ref_place {
    int known; // 0: behind the eye, or not finite
    struct ref_range x, y, z;
};
struct ref_place ref_place(const struct view_args *view, const struct chunk_view *chunk, const float *positions, uint32_t slot);

// What a measured point's offset to the middle of its pixel may be.
struct ref_center {
    double low, high;
};
struct ref_center ref_center(const struct view_args *view, const float normal[3], double deff, const struct ref_place *place,
                             int x, int y);

// Row k of (lo + R p) + hi of a clip, with a bound of what float32 adds.
double ref_clip_row(const struct clip_view *clip, int k, const double p[3], double *error);
// Is the point of this slot drawn? positions: of the instance; classes, shapes: by slot.
enum ref_truth ref_sift(const struct sift_args *args, const struct chunk_view *chunk, const float *positions,
                        const uint8_t *classes, const uint32_t *shapes, const uint32_t *mask, const uint32_t *field,
                        const uint16_t *scans, const struct clip_view *clips, uint32_t slot);

// ---- raster.c -------------------------------------------------------------------------------------------------------

// A triangle at the centre of the pixel (x, y).
struct ref_hit {
    int possible, definite; // definite: covers it, whatever the rounding
    struct ref_range z;
};
struct ref_hit ref_raster(const struct view_args *view, const struct mesh_args *mesh, const float *vertices,
                          const uint32_t *indices, uint32_t triangle, int x, int y);
// Does the point at p, chunk coordinates, face away and is left out?
enum ref_truth ref_culled(const struct chunk_view *chunk, const double p[3], uint32_t word);

// ---- splat.c, blend.c ---------------------------------------------------------------------------------------------------

// A point as a disc.
struct ref_disc {
    uint32_t id;
    int possible, definite; // may be drawn; is drawn
    struct ref_place place;
    struct ref_vec n;            // unit, towards the viewer; without a normal: of the picture
    int has_normal, has_normals; // of the point; of its cloud
    int edge_on;                 // so much that float32 may draw its pixel alone
    double normal_error, radius; // radius: of the major half axis
    struct ref_vec axes[2];      // of a shape: what an offset in the plane times them is in half axes, times the radius
    int shaped;
};
struct ref_disc ref_disc(const struct view_args *view, const struct disc_args *args, const struct chunk_view *chunk,
                         const float *positions, const uint32_t *surfels, const void *radii, uint32_t slot);
// Whether it covers a pixel of the plane, how deep, and at which squared share of its radius from its middle.
struct ref_met {
    enum ref_truth covered;
    struct ref_range z, square;
};
struct ref_met ref_disc_at(const struct view_args *view, const struct ref_disc *disc, int x, int y);
// Of which discs that may say anything but "not covered" for one of the pixels x0 to x1 - 1 of the row y: their places in the list,
// rising. Returns how many; around: room for all.
uint32_t ref_discs_around(const struct view_args *view, const struct ref_disc *discs, uint32_t count, int x0, int x1, int y,
                          uint32_t *around);

struct ref_look { // what blend reads of a point
    double color[3], opacity;
};
struct ref_blend {
    double color[4], color_error[4]; // albedo and opacity
    struct ref_vec n;
    double normal_error;
    double away;
    double offset, offset_error; // of the depths' mean behind z
    int unsure, unsure_offset;
};
// Whether a disc that covers a pixel so counts there. z: of the key; nearest: it is the key's.
enum ref_truth ref_blend_takes(const struct ref_disc *disc, const struct ref_met *cover, int nearest, double z, double deff);
// around: the discs that may be there, by their places in the list; nearest: the key's; z, deff: of the pixel; n: its normal before, w aside.
struct ref_blend ref_blend(const struct view_args *view, const struct ref_disc *discs, const struct ref_look *looks,
                           const uint32_t *around, uint32_t count, uint32_t nearest, float z, float deff, const float n[3],
                           int x, int y);

// ---- one pixel of a filter --------------------------------------------------------------------------------------------

// Planes of the view's size; a filter reads those that kernels.def lists.
struct ref_planes {
    const uint64_t *keys;
    const uint32_t *from;
    const float *normal, *deff, *span, *color, *shading;
    const uint32_t *surfels;  // by id - id_base
    const uint32_t *shapes;   // likewise
    const void *colors;       // by id - id_base
    const uint8_t *opacities; // by id - id_base
    const float *through;     // light that earlier layers let through
    const float *arrived, *away;
    const float *offset; // of measured pixels
    const float *obscured;
    const float *albedo;     // colours without light
    const float *slopes;     // NULL: none
    const uint32_t *shadows; // words, by light and id - id_base, or as marks say
    const uint32_t *marks;
    const struct light_view *lights;
    const float *ramps;
};

// Does the key belong to the instance?
int ref_is_of(const struct instance_args *instance, uint64_t key);

struct ref_normal {
    struct ref_vec n;       // zero: none
    double error;           // how far each component may lie off
    enum ref_truth decided; // REF_UNSURE: float32 may take other neighbours
    int either_side;        // seen edge-on: may be turned either way
};
struct ref_normal ref_normals(const struct normals_args *args, const struct ref_planes *planes, int x, int y);

// ---- average.c --------------------------------------------------------------------------------------------------------

// A point that adds to the pixels around it.
struct ref_tent {
    uint32_t id;
    int possible, definite; // may be drawn; is drawn
    struct ref_place place;
    double half, half_error; // pixels, from its middle to where it ends
    struct ref_vec n;        // unit, towards the viewer; 0: none
    double normal_error;
    int across; // the view, so that float32 may turn it either way
};
struct ref_tent ref_tent(const struct average_args *args, const struct chunk_view *chunk, const float *positions,
                         const uint32_t *surfels, uint32_t slot);
struct ref_average {
    double color[3], color_error[3];
    struct ref_vec n;
    double normal_error;
    int unsure;
};
// A pixel at z, deff that of its source, n its normal; nearest: the point of its key. looks: of the points, as they lie in tents.
struct ref_average ref_average(const struct average_args *args, const struct ref_tent *tents, const struct ref_look *looks,
                               uint32_t count, uint32_t nearest, float z, float deff, const float n[3], int measured, int x,
                               int y);

struct ref_resolve {
    struct ref_vec n;
    double normal_error;
    double inverse; // 1 / max(|n.v|, C)
    double inverse_error;
    double deff, deff_error;
    double span, span_error;
    uint32_t from;
};
struct ref_resolve ref_resolve(const struct resolve_args *args, const struct ref_planes *planes, int x, int y);

// What a pixel shows of a triangle.
struct ref_cover {
    struct ref_vec n, smooth; // view space, unit: of its plane, and between its corners
    double plane_error, smooth_error;
    double inverse, inverse_error, deff, deff_error;
    double albedo[3], albedo_error;
    int front; // the mesh is shown
};
struct ref_cover ref_cover(const struct cover_args *args, const float *vertices, const uint32_t *indices, uint64_t key,
                           uint64_t mesh_key, float limit, int x, int y);

// Where a pixel that shows a triangle lies, and its plane's normal (as ref_cover has it) in the steps of a surfel.
struct ref_locate {
    struct ref_vec p, n; // view space
    double error, normal_error;
    int ours;
};
struct ref_locate ref_locate(const struct locate_args *args, const float *vertices, const uint32_t *indices, uint64_t shown,
                             uint64_t mesh_key, int x, int y);

// What a pixel shows of an image; straight colour and opacity.
struct ref_paint {
    double color[4], error; // error: in premultiplied colour and in opacity
    int ours;
    int open; // float32 may take another number of probes, another texel, or the other side of a clipped border
};
struct ref_paint ref_paint(const struct paint_args *args, const float *vertices, const uint32_t *indices,
                           const uint32_t *texels, uint64_t shown, uint64_t mesh_key, int x, int y);

void ref_pull(const struct pull_args *args, const uint64_t *fine_keys, const uint32_t *fine_from, int x, int y, uint64_t *key,
              uint32_t *from);

// A pixel between measured and filled: its depth may be a range, its surface may be open.
struct ref_pixel {
    struct ref_range z; // +inf: empty
    uint32_t id, from;
    int unsure; // may be anything
};
struct ref_pixel ref_pixel(uint64_t key, uint32_t from);

struct ref_pixel ref_push(const struct push_args *args, const uint64_t *coarse_keys, const uint32_t *coarse_from,
                          const struct ref_planes *planes, int x, int y);
// A whole phase; pixels: width x height, read as the state before it, left as the state after it. 0: out of memory.
int ref_fill(const struct fill_args *args, const float *normal, const float *deff, const float *span, struct ref_pixel *pixels);

// The value of a pixel: exact but for one rounding; known: 0: it is NaN. written: 0: it stays as it was.
struct ref_value {
    double value;
    int known, written;
};
struct ref_value ref_value(const struct value_args *args, const struct ref_planes *planes, const float *scalars, int x, int y);
// What values grow by around a pixel; unsure: float32 may take other pixels.
struct ref_slope {
    double value, x, y;
    double value_error, x_error, y_error;
    int known, unsure;
};
struct ref_slope ref_slope(const struct slope_args *args, const struct ref_planes *planes, const float *values, int x, int y);

// Does the picture show the point `id` of the instance somewhere in its rectangle?
int ref_mark(const struct mark_args *args, const struct ref_planes *planes, uint32_t id);
// Marks: PT_MARK_SLOTS. Is the point of this slot shown, and where do its shadow words lie?
int ref_shown(const uint32_t *marks, uint32_t slot);
uint32_t ref_shown_place(const uint32_t *marks, uint32_t slot);

// Exact. planes: of the light's map, with the caster's opacities.
float ref_limit(const struct limit_args *args, const struct ref_planes *planes, int x, int y);

// Is the point of this slot in shadow? planes: of the light's map.
enum ref_truth ref_shadow_test(const struct shadow_test_args *args, const struct ref_planes *planes,
                               const struct chunk_view *chunk, const float *positions, uint32_t slot);
// What the map takes of 255 from that point, if it is in its shadow. 0: float32 may find the point at another texel.
int ref_shadow_test_loss(const struct shadow_test_args *args, const struct ref_planes *planes, const struct chunk_view *chunk,
                         const float *positions, uint32_t slot, uint32_t *loss);
// A shadow word after a sample whose map says so.
uint32_t ref_shadow_word(const struct shadow_test_args *args, uint32_t word, int shadowed);

struct ref_shade {
    struct ref_vec n; // the normal that lights the pixel
    double normal_error;
    double color[4], color_error[4]; // premultiplied
    double opacity;
    double shadow; // mean share of the casting lights that arrives
    int written;   // the pixel belongs to the instance
    int unsure;    // float32 may decide otherwise
    int singular;  // a light within rounding of the surface: only finite colours are asked for
};
struct ref_shade ref_shade(const struct shade_args *args, const struct ref_planes *planes, int x, int y);

struct ref_color {
    double color[4], error[4];
    int unsure;
    int mixed; // anti-aliasing marked the pixel
};
struct ref_color ref_tint(const struct tint_args *args, const struct ref_planes *planes, const struct clip_view *clips, int x,
                          int y);
struct ref_color ref_smooth(const struct smooth_args *args, const struct ref_planes *planes, int x, int y);
struct ref_color ref_antialias(const struct antialias_args *args, const struct ref_planes *planes, int x, int y);
struct ref_line {
    double share, error; // of the pixel that a line covers
    uint32_t nearest;    // index of the pixel whose surface the line belongs to; open where `shared`
    int shared;          // several pixels' lines are equally near
    int unsure;
};
// limit, through: behind the first layer only.
struct ref_line ref_lines(const struct lines_args *args, const struct ref_planes *planes, const float *limit, int x, int y);
struct ref_peel {
    uint64_t key;         // empty: was none, or was filled across a layer taken before
    float limit, through; // exact
    double over[4], error[4];
    int covered; // the layer shows something here
};
// limit, through, over: before; not read for the first layer.
struct ref_peel ref_peel(const struct peel_args *args, const struct ref_planes *planes, const float *limit,
                         const float *through, const float *over, int x, int y);
// x, y: in the crop.
struct ref_color ref_compose(const struct compose_args *args, const struct ref_planes *planes, int x, int y);

// Effects: of pixels that are not empty. errors of 0: to the bit.
double ref_obscured(const struct obscure_args *args, const struct ref_planes *planes, int x, int y, double *error,
                    int *unsure); // before the mean
// planes->obscured: of every pixel, before the mean.
struct ref_color ref_obscure(const struct obscure_args *args, const struct ref_planes *planes, int x, int y);
struct ref_color ref_edl(const struct edl_args *args, const struct ref_planes *planes, int x, int y);
struct ref_ink {
    double color[4], error[4], depth, mask;
};
// x, y: in the crop; color, depth: of that pixel before.
struct ref_ink ref_ink(const struct ink_args *args, const struct ref_planes *planes, const float *line, const uint32_t *nearest,
                       const float color[4], float depth, int x, int y);

#include "pointwise_references.h" // made of the list: of pointwise kernels that change a plane's colours
struct ref_color ref_focus(const struct focus_args *args, const struct ref_planes *planes, int x, int y); // in the crop
// x, y: in the crop, as combined.
struct ref_color ref_paper(const struct paper_args *args, const float *combined, int x, int y);

struct ref_extract {
    double depth; // +inf: nothing
    struct ref_vec normal;
    double normal_error;
    double source, shadow;
};
struct ref_extract ref_extract(const struct extract_args *args, const struct ref_planes *planes, int x, int y);

struct ref_assess {
    double trust, thickness;
    int written; // 0: the pixel stays as it is
};
// x, y: in the planes, within view.rect; shapes: by id - id_base.
struct ref_assess ref_assess(const struct assess_args *args, const struct ref_planes *planes, const uint32_t *shapes, int x,
                             int y);

// Whether some station looked through the place at z on the pixel's ray; and whether the pixel is the instance's and was closed.
enum ref_truth ref_seen_through(const struct reopen_args *args, const struct station_args *stations, const uint32_t *words,
                                int x, int y, double z);
int ref_closed(const struct reopen_args *args, const struct ref_planes *planes, int x, int y);

// ---- range images [K] ------------------------------------------------------------------------------------------------------

double ref_range_gamma(const struct view_args *cells, float gamma, float gamma_cells, double z);
double ref_range_step(const struct view_args *cells, float gamma, float gamma_cells, double z); // between cells that are joined
struct ref_range ref_coarsen(const struct coarsen_args *args, const float *limit, int x, int y); // beyond: any of these
struct ref_merged_point {
    struct ref_splat splat; // in cells
    struct ref_place place;
    struct ref_look look;
};
struct ref_merge {
    double place[4], place_error[4], color[4], color_error[4];
    int unsure;
};
// A cell whose key is at `nearest`, of the point with this id.
struct ref_merge ref_merge(const struct merge_args *args, const struct ref_merged_point *points, uint32_t count, float nearest,
                           uint32_t id, int x, int y);
struct ref_differ {
    double least, most, error; // PT_RANGE_MOST and its negative: no point of these scans
    int unsure;
};
// As ref_merge; scans: of the points; inclined: of the cell.
struct ref_differ ref_differ(const struct differ_args *args, const struct ref_merged_point *points, const uint16_t *scans,
                             uint32_t count, float nearest, uint32_t id, const float *inclined, int x, int y);
struct ref_reveal {
    double apart;
    int written; // 0: the pixel stays as it is
};
struct ref_reveal ref_reveal(const struct reveal_args *args, const struct ref_planes *planes, const float *apart, int x, int y);
struct ref_incline {
    struct ref_vec n;
    double error;
    int joined, written, unsure;
};
struct ref_incline ref_incline(const struct incline_args *args, const float *places, int x, int y);
struct ref_magnify {
    int shown, unsure;     // shown: something is, keys aside
    enum ref_truth marked; // of the first of two passes: not sharp
    uint32_t id;
    size_t cell; // of the corner that weighs most
    double z, z_error, color[4], color_error, normal_error, deff, deff_error, away, away_error;
    struct ref_vec n;
};
struct ref_magnify ref_magnify(const struct magnify_args *args, const uint64_t *cells, const float *places, const float *merged,
                               const float *inclined, int x, int y);

// ---- soft.c: balls along a ray [S] ------------------------------------------------------------------------------------------

struct ref_ball {
    double z, r;     // of the centre; world units
    double d, along; // from the ray, in radii; where along it that is, world units
    double square;   // Express: of the distance from the middle of its disc, in radii
    double color[3];
    double a, w;     // opacity at the centre; W of [S Eq. 22], 1: as it is
    uint32_t shells; // Concentric
    uint32_t record;
};

struct ref_soft_model {
    uint32_t model, mu; // PT_SOFT_*
};

struct ref_soft {
    double color[3], through; // premultiplied; light that comes through
    double density;           // points per square of the world's unit
    uint32_t fragments;       // balls or discs that count
};

// Of the unit ball at d from its centre: integral of 1 - distance from the centre; of lengths within shells, times mu.
double ref_soft_integral(double d, double from, double to);
double ref_soft_shells(uint32_t mu, uint32_t shells, double d, double from, double to);
double ref_soft_factor(const struct ref_ball *ball, const struct ref_soft_model *model); // m of [S Eq. 22]
double ref_soft_disc(double square, double a, double w);                                 // [S Eq. 19, 22]
// Base and Concentric between two places along the ray; Express, sorting the balls.
struct ref_soft ref_soft_ray(const struct ref_ball *balls, uint32_t count, const struct ref_soft_model *model, double from,
                             double to);
struct ref_soft ref_soft_discs(struct ref_ball *balls, uint32_t count, double from, double to);

struct ref_soft ref_soft_splats(struct ref_ball *balls, uint32_t count, int one_layer, double from, double to);

struct ref_ball ref_ball_at(const struct soft_args *args, const uint32_t *records, uint32_t index, int x, int y);
// A pixel: reached is that of its plane, z its key's.
struct ref_soft ref_soft(const struct soft_args *args, const uint32_t *records, int x, int y, double reached, double z);

// -ln of the light that comes through along the pixel's ray up to z, of the slabs' model.
double ref_soft_veil(const struct soft_args *args, const uint32_t *records, int x, int y, double z);

// ---- dim.c ------------------------------------------------------------------------------------------------------------------

// -ln of the light that comes to a place in the map; what of 255 a point loses, from least to most. REF_NO: nothing, for it lies
// outside; REF_UNSURE: float32 may find it there.
double ref_dim_at(const struct dim_args *args, const float *veil, double x, double y, double z);
enum ref_truth ref_dim(const struct dim_args *args, const float *veil, const struct chunk_view *chunk, const float *positions,
                       uint32_t slot, double loss[2]);

// ---- gather.c ---------------------------------------------------------------------------------------------------------------

struct ref_record {
    enum ref_truth drawn;
    double place[3], place_error[3], radius, radius_error;
    double color[3], color_error[3];
    double opacity, opacity_error, weight; // weight: W of [S Eq. 22]
    int unsure, singular;                  // as of ref_shade
};
// points: surface, colors, opacities, shadows by slot.
struct ref_record ref_gather(const struct gather_args *args, const struct chunk_view *chunk, const float *positions,
                             const uint32_t *field, const uint32_t *drawn, const struct ref_planes *points, uint32_t slot);

#endif
