// SPDX-License-Identifier: GPL-3.0-or-later
// Argument structs of the kernels, read by C and by GLSL (std430: every member is 4 bytes wide, so both layouts agree).
// Constants that decide pixels live here too, once.
#ifndef PT_KERNEL_ARGS_H
#define PT_KERNEL_ARGS_H

#ifdef GL_core_profile
#define uint32_t uint
#define int32_t int
#else
#include <stdint.h>
#endif

// Effective layer distance (SPEC 1): d_eff = max(d_min, K spacing, footprint, 4 ulp(z)) / max(|n.v|, C).
#define PT_SPACING_FACTOR 2.0f // K: a hole's rim lies up to two spacings from a neighbour that is on the same layer
#define PT_DENSE 2.4f // K times 1.2 pixels: see push
// Where sigma is known, max(PT_SIGMAS sigma, PT_SPACING_SURE spacing) stands in place of K spacing, as far as it is less, and
// PT_FOOTPRINT_SURE footprint for the footprint. Spheres 1.5 spacings apart show through in 1.4% of pixels at 1 to 1.5 points a
// pixel, with whole footprints in 5 to 7.5%.
#define PT_SIGMAS 4.0f
#define PT_SPACING_SURE 0.7f
#define PT_FOOTPRINT_SURE 0.7f
#define PT_COSINE_FLOOR 0.05f  // C: 87 degrees; beyond it a surface is narrower than a pixel's jitter

// The surface word of a point: octahedral normal 2 x 13 bits (at most 0.03 degrees off), spacing class 6 bits.
#define PT_NORMAL_NONE 0x03FFFFFFu // these 26 bits all ones: the point has no normal
#define PT_NORMAL_BITS 0x03FFFFFFu
#define PT_SPACING_SHIFT 26
// The shape word of a point, where its cloud was analysed: the footprint, an ellipse on the tangent plane, and what kind of
// point it is. Bits 0-5: class of the major half axis, as of spacings; 0: none, the point is a pixel. 6-9: k, the minor half axis
// is 2^(-k / 4) of it. 10-15: a, the major axis is cos(a pi / 64) t1 + sin(a pi / 64) t2 in the frame of the point's normal n in
// its object: s = n.z >= PT_SHAPE_UP ? 1 : -1, q = -1 / (s + n.z), b = n.x n.y q, t1 = (1 + s n.x^2 q, s b, -s n.x),
// t2 = (b, s + n.y^2 q, -n.y) (Duff et al. 2017); below 0, n.z is -1 / 4095 at most. 16-21: class of the thickness sigma, in
// sixteenths of the spacings' unit; 0: not known. 22-24: kind. 25-28: certainty, of 15.
#define PT_SHAPE_CLASS_BITS 63u // of each class
#define PT_SHAPE_RATIO_SHIFT 6
#define PT_SHAPE_ANGLE_SHIFT 10
#define PT_SHAPE_SIGMA_SHIFT 16
#define PT_SHAPE_KIND_SHIFT 22
#define PT_SHAPE_CERTAINTY_SHIFT 25 // of 15
#define PT_SHAPE_SIGHT_SHIFT 22     // kind, certainty and seen through are a byte: what hides points is a set of such
#define PT_SHAPE_SEEN_THROUGH (1u << 29) // a scanner looked through where it lies
#define PT_SHAPE_UP -1e-4f // n.z of which s is 1
#define PT_KIND_UNKNOWN 0u
#define PT_KIND_SURFACE 1u
#define PT_KIND_BORDER 2u
#define PT_KIND_LINE 3u
#define PT_KIND_VOLUME 4u // foliage
#define PT_KIND_STRAY 5u
#define PT_RADII_NONE 0u   // what disc_args.has_radii says of the radii buffer: it is not read
#define PT_RADII_FLOATS 1u // radii, object units
#define PT_RADII_SHAPES 2u // shape words
// cos(a pi / 64), sin(a pi / 64) for a < 64; 2^(k / 4) for k < 16, as many again that fill a vector.
#define PT_SHAPE_COSINES \
    1.0f, 0.99879545f, 0.99518472f, 0.989176512f, 0.980785251f, 0.970031261f, 0.956940353f, 0.941544056f, \
    0.923879504f, 0.903989315f, 0.881921291f, 0.857728601f, 0.831469595f, 0.803207517f, 0.773010433f, 0.740951121f, \
    0.707106769f, 0.671558976f, 0.634393275f, 0.59569931f, 0.555570245f, 0.514102757f, 0.471396744f, 0.427555084f, \
    0.382683426f, 0.336889863f, 0.290284663f, 0.242980182f, 0.195090324f, 0.146730468f, 0.0980171412f, 0.0490676761f, \
    0.0f, -0.0490676761f, -0.0980171412f, -0.146730468f, -0.195090324f, -0.242980182f, -0.290284663f, -0.336889863f, \
    -0.382683426f, -0.427555084f, -0.471396744f, -0.514102757f, -0.555570245f, -0.59569931f, -0.634393275f, -0.671558976f, \
    -0.707106769f, -0.740951121f, -0.773010433f, -0.803207517f, -0.831469595f, -0.857728601f, -0.881921291f, -0.903989315f, \
    -0.923879504f, -0.941544056f, -0.956940353f, -0.970031261f, -0.980785251f, -0.989176512f, -0.99518472f, -0.99879545f
#define PT_SHAPE_SINES \
    0.0f, 0.0490676761f, 0.0980171412f, 0.146730468f, 0.195090324f, 0.242980182f, 0.290284663f, 0.336889863f, \
    0.382683426f, 0.427555084f, 0.471396744f, 0.514102757f, 0.555570245f, 0.59569931f, 0.634393275f, 0.671558976f, \
    0.707106769f, 0.740951121f, 0.773010433f, 0.803207517f, 0.831469595f, 0.857728601f, 0.881921291f, 0.903989315f, \
    0.923879504f, 0.941544056f, 0.956940353f, 0.970031261f, 0.980785251f, 0.989176512f, 0.99518472f, 0.99879545f, \
    1.0f, 0.99879545f, 0.99518472f, 0.989176512f, 0.980785251f, 0.970031261f, 0.956940353f, 0.941544056f, \
    0.923879504f, 0.903989315f, 0.881921291f, 0.857728601f, 0.831469595f, 0.803207517f, 0.773010433f, 0.740951121f, \
    0.707106769f, 0.671558976f, 0.634393275f, 0.59569931f, 0.555570245f, 0.514102757f, 0.471396744f, 0.427555084f, \
    0.382683426f, 0.336889863f, 0.290284663f, 0.242980182f, 0.195090324f, 0.146730468f, 0.0980171412f, 0.0490676761f
#define PT_SHAPE_RATIOS \
    1.0f, 1.18920708f, 1.41421354f, 1.68179286f, 2.0f, 2.37841415f, 2.82842708f, 3.36358571f, \
    4.0f, 4.75682831f, 5.65685415f, 6.72717142f, 8.0f, 9.51365662f, 11.3137083f, 13.4543428f, \
    1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, \
    1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f

#define PT_KEY_EMPTY_Z 0x7F800000u // float bits of +inf
#define PT_KEY_EMPTY_ID 0xFFFFFFFFu
// A filled neighbour repeats a surface that was measured elsewhere: 0.33 degrees mean error at weight 1 on a sphere of 1
// point a pixel, 0.25 at 1/8.
#define PT_BLEND_FILLED 0.125f
// Pixels, radius of the window that a normal is estimated from where no less is asked for: at 3, steep planes lose 0.3% of
// their measured pixels.
#define PT_ESTIMATE_LEAST 4.0f
#define PT_FILL_BACKGROUND 1u // phases of filling
#define PT_FILL_OCCLUDED 2u
#define PT_FROM_MIXED 0x80000000u // top bit of the from plane: anti-aliasing mixed this pixel's colour

// Peeling: a pixel is finished when less light than this comes through it (half a step of 8 bits).
#define PT_SPENT 0.001953125f // 1 / 512
// The limit plane's least values are kept for tiles of 2^PT_TILE_LEVEL pixels: a chunk that lies before them is not scattered
// again. Chunks of 4096 points are 30 to 70 pixels wide at a point a pixel.
#define PT_TILE_LEVEL 4

// Meshes: screen positions are rounded to 1 / 2^PT_MESH_BITS of a pixel, so that edges are decided in integers, exactly.
// Triangles are cut off PT_MESH_REACH pixels from the picture's corner: positions then fit 32 bits.
#define PT_MESH_BITS 8
#define PT_MESH_UNIT 256.0f
#define PT_MESH_REACH 1048576.0f
#define PT_MESH_FARTHEST 1e18f // triangles with a greater coordinate, or none that is a number, are left out
#define PT_MESH_COVERAGE 0.75f // of a pixel at a mesh's edge: 1/2 to 1 along the axes (mean 3/4) and across (mean 5/6)
#define PT_MESH_CORNERS 8 // of a triangle that five planes cut
#define PT_TEXTURE_LEVELS 15 // 16384 texels a side
#define PT_PROBES 8u
#define PT_TEXELS_SRGB 1u   // a word: red in the lowest byte, green, blue, opacity
#define PT_TEXELS_LINEAR 2u // the same without sRGB's curve
#define PT_TEXELS_FLOAT 3u  // four floats
#define PT_WRAP_REPEAT 0u
#define PT_WRAP_EXTEND 1u
#define PT_WRAP_CLIP 2u
// Discs: a point without a radius of its own gets so many spacings. Of random points exp(-pi r^2) stay uncovered: 0.09% at 1.5,
// where colours are off by 0.0091 to 0.0136 at half a pixel to three apart, 0.007% at 1.75: 0.0071 to 0.0113.
#define PT_DISC_SPACINGS 1.75f
#define PT_DISC_LEAST 1e-30f  // a radius below is none: the point stays its pixel
#define PT_DISC_MOST 1e30f
#define PT_DISC_FINE 1e12f    // so is a radius this many times smaller than the depth
#define PT_DISC_TILT 1e-6f    // |n . ray| below: seen edge-on, the point stays its pixel
#define PT_DISC_GENTLE 0.015625f // slopes up to 2^-6: 1 / (1 + s) = (1 - s) (1 + s^2), within 2^-24 of it
#define PT_DISC_FAR 4194304.0f // pixels: centres beyond are not drawn, boxes end there
#define PT_SUM_SCALE 262144.0f // 2^18: weights, and what they weigh, are summed as integers
#define PT_DISC_DEPTHS 2.0f // layer distances behind the nearest disc: whose depths are averaged. Four spacings hold noise of one
#define PT_SUM_BRIGHTEST 4096.0f // colours above blend as this, so that a term fits 31 bits
// What blend makes of the discs that count.
#define PT_BLEND_COLORS 0 // #if reads them
#define PT_BLEND_MARKS 1
#define PT_BLEND_LIGHT 2
#define PT_BLEND_LIGHTS 7 // of PT_BLEND_LIGHT, at once
#define PT_COLOR_OF_SCALAR 4u // color_format: a float a point, for a ramp
#define PT_COLOR_OF_PLANE 3u  // color_format: the colours buffer is a plane, four floats a pixel, opacity last
#define PT_COLOR_OF_PIXEL 5u  // the same, of the pixel itself, not of the one that its surface was measured at

// Shapes of clip_view.
#define PT_CLIP_KEEP 0u  // a box: only what lies in it, or in another such box, is drawn
#define PT_CLIP_CUT 1u   // a box: what lies in it is not
#define PT_CLIP_PLANE 2u // what has q.z > 0 is not

#define PT_SCAN_WORDS 32 // of 32 scans each: those that may be hidden
#define PT_SLOTS_A_WORD 16u // of the drawn words: chunks begin at multiples of it
#define PT_RAMP_MOST 256    // PATINA_MAX_RAMP
#define PT_RAMP_SCALAR 1u   // sources of a ramp
#define PT_RAMP_PLACE 2u
#define PT_RAMP_DISTANCE 3u
#define PT_MID_GREY 0.18f   // contrast turns around it
#define PT_BRIGHTEST 65504.0f // half floats end there

// Lines are at most so many pixels wide; pixels nearer than that and a half.
#define PT_LINE_MOST 16
#define PT_LINE_TAPS 864
#define PT_LINE_SUPPORT 2
#define PT_LINE_WITHIN 0.484375f // without anti-aliasing: a pixel whose middle lies within r + 1/64 takes a line

#define PT_SPACINGS 64
#define PT_MAX_LIGHTS 32
#define PT_AREA_POINTS 16 // of an area light, where shading gathers its light

// The shadow word of a point and light: what the samples so far take away, in 1/255 a sample, and above it what the maps
// of the current sample take, 0..255.
#define PT_SHADOW_SUM 0x000FFFFFu
#define PT_SHADOW_SHIFT 24
// lit: a texel is this much wider than it is, so that a plane that crosses it from corner to corner stays within d_eff.
#define PT_TEXEL_SLACK 1.5f
// lit: so many of the 8 texels around must shadow the point as well: one or two texels by themselves are a stray point, whose
// shadow is a speck. A line of texels has them.
#define PT_SHADOW_SUPPORT 2
#define PT_SHADOW_STEEP 20.0f // 1 / C
#define PT_STEEP 0.5f // normals
// normals: pixels on each side that are asked what depth changes by. With one, a sparse plate before a floor takes the floor
// between its points for its own slope: 3% of its umbra under a sun was lit, 0 with three.
#define PT_STEP_REACH 3
// lit: a texel this many times its d_eff behind the one beside it shows another surface, under lights that look in perspective.
#define PT_SHADOW_APART 4.0f

// A window of pixels of the full picture, at a level of the pyramid (a pixel of level l is 2^l wide).
// Ray of the pixel (x, y): u = ray_x0 + ray_xs * X with X = (((origin_x >> level) + x) + 0.5) * 2^level, v likewise.
// Perspective: view-space point = z * (u, v, -1). Orthographic: (u, v, -z - near).
struct view_args {
    uint32_t width, height;     // of the planes at this level
    int32_t origin_x, origin_y; // pixel (0,0) of level 0 in the full picture; multiples of 2^levels
    uint32_t perspective;
    uint32_t level;
    float z_near, z_far; // least and greatest z drawn; z_near > 0 in perspective, 0 in orthographic views
    float ray_x0, ray_xs, ray_y0, ray_ys;
    float footprint; // width of a level-0 pixel: at z = 1 (perspective) or anywhere (orthographic), view units
    uint32_t rect[4]; // x0, y0, x1, y1: the kernel need not look outside; in pixels of this level
};

// A chunk as this view sees it: (X, Y, z) = (lo + R p) + hi in this order, R and hi + lo from float64.
// Perspective: screen = (X, Y) * rcp(z), orthographic: screen = (X, Y), both in pixels of the full picture.
struct chunk_view {
    float row[9];   // x row, y row, z row
    float hi[3], lo[3];
    float eye[4];   // back-face test: n . (eye.xyz - eye.w p) <= 0 is culled; object units, relative to the chunk's origin
    uint32_t first; // first slot, and number of its point; positions at 3 first: x[padded], y[padded], z[padded]
    uint32_t count, padded;
    uint32_t cull;  // 1: test each point's normal
    uint32_t id_base;
    uint32_t sifted; // 1 + its first drawn word; 0: all points are drawn
    uint32_t clip_first, clip_count, clip_keeps; // sift: its clips, and how many of them, the first, are PT_CLIP_KEEP
    uint32_t row_first, row_end; // of pixels that its points may fall into; both 0: not known
    uint32_t record;             // gather: where those of its points begin
};

// A clip in a chunk's coordinates, or (tint) in view space: q = (lo + R p) + hi in this order. In a box every |q| <= 1.
// Planes: q.z is in world units, the rest is 0.
struct clip_view {
    float row[9];
    float hi[3], lo[3];
    uint32_t shape;
    float half_size[3]; // tint: of a box, world units
    float tint[3], strength, width;
};

// sift: which points are drawn. A hidden class takes them all, a hidden shape and the mask too; of clips: in one that keeps, if there are
// any, in none that cuts. Bit-equal everywhere, as scatter is.
struct sift_args {
    uint32_t by_class;  // 1: classes are there, and some are hidden
    uint32_t hidden[8]; // bit c % 32 of word c / 32: class c
    uint32_t by_shape;  // 1: shapes are there, and some are hidden
    uint32_t hidden_shapes[8]; // likewise, of the byte from PT_SHAPE_SIGHT_SHIFT on
    uint32_t by_mask;   // 1: the mask is there: a word of each PT_SLOTS_A_WORD slots of the cloud, bit i: slot i is hidden
    uint32_t by_field;  // 1: the field is there, and points above ...
    uint32_t threshold; // ... are soft: in steps, as in gather_args
    uint32_t by_scan;   // 1: the scans are there, and some are hidden
    uint32_t hidden_scans[PT_SCAN_WORDS]; // bit s % 32 of word s / 32: scan s; those beyond are drawn
};

// scatter: points -> least key a pixel. [D 3.1]; behind a layer only points with z > limit at their pixel count. [D 5]
struct scatter_args {
    struct view_args view;
    uint32_t instances;
    uint32_t behind; // 1: the limit plane holds
    uint32_t sifted; // 1: the drawn words hold; they follow the limit plane, if there is one
};

// An image on a mesh: colours without light, and opacity, straight. Texels of a level row by row from the bottom, levels one
// behind the other, each the box mean of the one before.
//   1. (u, v) of a pixel: that of its centre; its sides: how far those of the next pixels right and above lie from it, in texels
//      of level 0; beyond the plane's horizon infinitely far.
//   2. With major and minor the squares of the longer and the shorter side, n = 1 + how many k < PT_PROBES have major > k^2 max(minor, 1):
//      so many probes evenly along the longer. Level: log2(max(minor, major / PT_PROBES^2)) / 2, between the two that it lies
//      between, within those that there are.
//   3. A probe is the mean of the four texels around it at both levels, colours weighted by opacity too. Not minified (the greater
//      of 2. at most 1), `nearest` takes the texel that it lies in.
// Beyond the image it repeats, ends in its border texels, or (clip, by the probe) is nothing.
struct texture_args {
    uint32_t levels;  // 0: there is none
    uint32_t uv;      // floats of a vertex before its (u, v)
    uint32_t format;  // PT_TEXELS_*
    uint32_t nearest;
    uint32_t wrap;    // PT_WRAP_*
    uint32_t blend;   // 1: the image's opacity is the surface's
    float cut;        // raster: less opacity is nothing; 0: all is drawn
    uint32_t sizes[3 * PT_TEXTURE_LEVELS]; // width, height, first texel of each level
};

// A mesh as this view sees it. Its vertices are projected as a chunk's points are.
struct mesh_args {
    float row[9], hi[3], lo[3]; // as in chunk_view
    uint32_t id_base, id_count; // ids of its triangles: [id_base, id_base + id_count)
    uint32_t stride;            // floats a vertex: position 3, normal 3 (with has_normals), colour 3 (with has_colors)
    uint32_t has_normals, has_colors;
    float color[3];             // without colours
    float normal_matrix[9];     // object normal -> view space, not yet unit
    struct texture_args texture;
};

// raster: triangles -> least key a pixel, of pixels whose centre they cover. A centre on an edge belongs to the triangle on one
// side of it: the one whose edge goes down, or left where it is level. Depth: the triangle's plane, within its corners' depths.
// With texture.cut, pixels whose image there is less opaque are nothing.
struct raster_args {
    struct view_args view;
    struct mesh_args mesh;
    uint32_t behind; // 1: only what lies beyond the limit plane counts
};

// cover: pixels where the mesh lies before what the keys show, or where that is not beyond the limit, show the mesh. d_eff is
// that of a surface whose points are a pixel apart. The normal plane keeps the normal of a point that was measured there: pixels may have been
// filled from it.
struct cover_args {
    struct view_args view;
    struct mesh_args mesh;
    uint32_t behind; // 1: the limit plane holds
    uint32_t shown;  // 1: the last three planes are written
    uint32_t first;  // added to the pixel's index in shown: those that light changes and those that it does not have ids apart
};

// paint: pixels that show the mesh take its image's colour, and with `blend` its opacity.
struct paint_args {
    struct view_args view;
    struct mesh_args mesh;
};

// locate: of pixels that show the mesh, in view space: places: x of a row's pixels, then y, z, row after row; words: surface words
// without spacing, of the triangle's plane. Others stay.
struct locate_args {
    struct view_args view;
    struct mesh_args mesh;
    float eye_z; // as in shade_args
};

// What the per-instance kernels (normals, surface, shade) know of an instance of a cloud.
struct instance_args {
    uint32_t id_base, id_count; // ids of this instance: [id_base, id_base + id_count)
    uint32_t has_normals;
    uint32_t color_format;      // 0 style colour, 1 sRGB 8 bit x 3, 2 float x 3, 3 a plane; shade: 4 scalars, 5 a plane
    uint32_t lit;
    uint32_t shininess;
    float ambient, diffuse, specular;
    float color[3];
    float opacity;              // of the instance; times that of the point
    uint32_t has_opacities;     // 1: points have their own, a byte each
    float normal_matrix[9];     // object normal -> view space, not yet unit
    float axis_scale;           // times the matrix: a unit tangent -> view space, a length along it as a share of the stretch
    float d_min;                // world units
    float spacing[PT_SPACINGS]; // local spacing by class, world units
};

// A cloud's discs, one of these an instance behind the arguments of splat and blend.
struct disc_args {
    struct instance_args instance;
    uint32_t has_radii; // PT_RADII_*: what the radii buffer holds
    float radius;       // world units, of every point; 0: its own, or its shape's, else PT_DISC_SPACINGS times its spacing
    float radius_scale; // object units -> world, times what strata leave out
    float radius_most;  // world units: no half axis is longer; 0: as long as it is
    float surface_scale; // of half axes of shapes whose kind is PT_KIND_SURFACE, before that
    uint32_t shadowed;   // blend: 1: the instance receives shadows
};

// splat: points -> least key of every pixel that their discs cover. SPEC 5, solid; the visibility pass. A disc is flat, has the
// point's normal (without one: faces the picture) and covers the pixels whose centre's ray meets it; and the pixel that the
// point falls into, if with that ray beside the disc then at the point's own depth.
struct splat_args {
    struct view_args view;
    uint32_t instances;
    uint32_t behind; // 1: the limit plane holds
    uint32_t sifted; // as in scatter_args
};

// blend: what the discs within d_eff behind the nearest surface of a pixel show there, weighted by how near their centres lie:
// w = exp(-2 s^2), s = distance over radius; in its own pixel a disc counts as at least a pixel wide. The sums are integers,
// PT_SUM_SCALE a unit, so that no order shows.
//   normal.xyz: unit mean; of instances without normals as it was. away: how many pixels off the point of the key fell.
//   albedo: mean colour, each disc weighted by its opacity too, and the mean opacity.
//   offset: with `depths`, how far behind the nearest surface the discs within PT_DISC_DEPTHS d_eff lie in the mean, by the same weights.
// Other parts of it, of the same discs:
//   MARKS: a byte of 1 for every point whose disc counts anywhere, in place of colours, and for what others a device likes. No plane is
//   written.
//   LIGHT: shadow words in place of colours; albedo: a plane a casting light of the share that does not arrive, in the mean, by the
//   weights that colours have, in 1 / PT_SHADOW_SUM. Instances that receive no shadows lose nothing.
struct blend_args {
    struct view_args view;
    uint32_t instances;
    uint32_t sifted; // as in scatter_args
    uint32_t depths; // 1: the offset plane is written
    uint32_t part;   // PT_BLEND_*
    uint32_t first, lights;        // LIGHT: of so many casting lights from this one on
    float scales[PT_BLEND_LIGHTS]; // of a word's sum, 1 / (255 samples)
};

// Range images. A cell of the image buffer is `pixel` pixels of the picture wide: that of a place (X, Y) is (floor(X / pixel),
// floor(Y / pixel)), in whose view's pixels a chunk's points are projected. Its footprint is that of its view.
// What lies no farther than gamma behind another is one surface with it: max(gamma, gamma_cells footprint(z)), z of the nearer.
// Neighbouring cells are joined where z differs by at most max(that, PT_RANGE_STEEP footprint(z)): slopes to 76 degrees.
#define PT_RANGE_STEEP 4.0f
#define PT_RANGE_DEEPEST 1024.0f // cells behind the nearest point from which on depths of merged points count as that
#define PT_RANGE_ALONE 0u  // passes of magnify: the only one
#define PT_RANGE_COARSE 1u // the first of two
#define PT_RANGE_FINE 2u   // the second, of finer cells
#define PT_DIFFER_SCANS 4u  // at a time
#define PT_DIFFER_MOST 1024u // scans beyond share these numbers
#define PT_RANGE_LEAST 1e-30f // of gamma, and the most
#define PT_RANGE_MOST 1e30f

// coarsen: empties the cells. beyond: the least limit that is finite of those pixels that the cell has a part of; none: +inf.
struct coarsen_args {
    struct view_args view; // of the cells
    uint32_t width, height; // of the picture's planes ...
    int32_t origin_x, origin_y; // ... as in view_args
    float pixel;
    uint32_t behind; // 1: the limit plane holds
};

// merge: the mean of the points up to gamma behind the nearest of their cell, each weighted by w = 1 - (z - z_near) / gamma.
// [K Eq. 2] has the complement of it, by which the nearest counts nothing. Colours are weighted by opacity too. The sums are integers,
// PT_SUM_SCALE a unit; of z the share (z - z_near) / min(gamma, PT_RANGE_DEEPEST footprint).
struct merge_args {
    struct view_args view; // of the cells
    struct instance_args instance;
    float gamma, gamma_cells;
    uint32_t sifted; // as in scatter_args
};

// differ: how far scans lie apart: of each cell the means, scan by scan, of how far those points lie off its plane that merge takes. The
// plane goes through the middle of the cell where its nearest point is in depth, and has the cell's normal, so that a slope within a cell
// is no difference. PT_DIFFER_SCANS scans a pass; least and most hold what those before found, PT_RANGE_MOST and its negative: nothing.
// Sums are integers, of the share off / min(gamma, PT_RANGE_DEEPEST footprint), from -1 to 1, PT_SUM_SCALE a unit.
struct differ_args {
    struct view_args view; // of the cells
    float gamma, gamma_cells;
    uint32_t sifted; // as in scatter_args
    uint32_t first;  // scan % PT_DIFFER_MOST of those that this pass counts: from here on
    uint32_t start;  // 1: least and most hold nothing yet
};

// incline: a cell's normal: the sum of those of the 24 triangles [K Fig. 4] of which it is a corner and two of the cells around are the
// others, each as long as twice its area, so that slivers, which noise turns, say little. Without one: towards the viewer.
struct incline_args {
    struct view_args view; // of the cells
    float gamma, gamma_cells;
};

// magnify: faces between 2 x 2 cells, the corners at their places [K Fig. 7, 8]: of four within the greatest step two triangles, divided
// where z changes less; else each three that are. A pixel takes the nearest that its centre lies in; where there is none, the nearest
// cell whose place lies in the pixel; else, so that an outline borders on what lies behind it, the nearest triangle of three cells with a
// greater step, as far as its farthest corners: nearer ones weigh nothing. normal, albedo: between the corners, in perspective. z likewise. id: of the corner that weighs most.
// d_eff: of a surface whose points are as thick as max(gamma, 2 cells). away: pixels from that corner; 0 where it lies in the pixel.
// Of two [K II.E] the first marks what is not sharp, by away = -1 - away: where that corner has more points than `most`, is seen at less
// than `cosine`, lies at an outline, which is where not all cells around are joined to it, or where no face was. The second takes marks
// away, and puts its faces where nothing of the instance is, where they are a step nearer, and where they are not a step behind a mark.
struct magnify_args {
    struct view_args view; // of the picture
    struct view_args cells;
    float gamma, gamma_cells;
    float pixel, inverse; // 1 / pixel
    float d_min; // as in instance_args
    uint32_t behind; // 1: the limit plane holds
    uint32_t with_span; // as in surface_args
    uint32_t pass;      // PT_RANGE_*
    uint32_t id_base, id_count; // of the instance
    float most;         // of two: cells of more points are not sharp
    float cosine;       // nor are those that are seen at less of it
    uint32_t with_apart; // 1: the apart plane takes max(most - least, 0) of the corner that weighs most: differ
};

// normals: least-squares plane of 1/z (orthographic: z) over a window, for points without normals. Its radius is d /
// footprint(z), two spacings there in pixels, rounded up, from PT_ESTIMATE_LEAST to `radius`. Taken are pixels with
// |z_q - (z + step)| <= max(d, 4 footprint(z) max(|dx|, |dy|)), d = d_eff facing the viewer; 4: 76 degrees. step = 0, or with
// `steep` s_x dx + s_y dy, and what is taken may be off by PT_STEEP (|s_x dx| + |s_y dy|) too. s is what z changes by a pixel
// to the next of the row or column that shows something, at most PT_STEP_REACH off and `radius`: of the changes on both sides the
// lesser where they go the same way, else 0; where one side shows nothing, that on the other.
struct normals_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t radius; // of the window at most, 1..16
    uint32_t steep;  // 1: of a light's map, where a low sun sees the ground at a few degrees
};

// surface: key -> view-space normal, 1 / max(|n.v|, C), d_eff; from = the pixel itself. span: d_eff as if no sigma were known.
struct surface_args {
    struct view_args view;
    struct instance_args instance;
    float sigma_scale;  // times instance.spacing of its class: sigma, as in assess_args; 0: shapes are not read
    uint32_t with_span; // 1: span is written
};

// pull: 2 x 2 -> 1, the least key (what a scatter at half the resolution gives).
struct pull_args {
    struct view_args view; // of the coarse level
    uint32_t fine_width, fine_height;
};

// push: pixels that are empty or occluded take the key of their coarse parent, unless the parent's surface is dense at this
// level: its spacing is below 1.2 pixels, so that what shows beside it is a groove or an edge and not a hole between points.
struct push_args {
    struct view_args view; // of the fine level
    uint32_t coarse_width, coarse_height;
    uint32_t refined;
    float least; // no layer distance in view is below this
    float least_share; // nor below this share of a pixel's footprint
    uint32_t background; // 1: empty pixels alone
    uint32_t from_width; // of the planes at level 0
};

#define PT_FILL_SLACK 0.75f // pixels of the level: a neighbour is reached whatever its spacing

// fill: hole filling. [D 3.2, 3.3], SPEC 2.2. With `reach`, a pixel takes the least key among those neighbours whose surfaces
// reach it, in the occluded phase of those that hide it; where none does it stays as it is. A surface reaches as far as
// reach d_eff max(|n.v|, C) / footprint pixels of level 0, off the middle of a perspective view max(|ray.x|, |ray.y|, 1) times as
// far, and PT_FILL_SLACK pixels of this level from where it was measured.
// With `alone`, a covered pixel with nothing in its ring, of a surface that is dense at this level (as in push), is a stray: in the
// background phase it is as white as an empty one. Fills go by what their step finds, so that holes around a lone point close;
// un-fills by the state before the phase.
struct fill_args {
    struct view_args view;
    uint32_t phases;     // PT_FILL_*, in their order
    uint32_t iterations; // fills
    uint32_t unfills;    // at most so many un-fills; 0 = as in the paper
    uint32_t refined;    // 1: depth of the source's tangent plane
    float least;         // no layer distance in view is below this
    float least_share;   // nor below this share of a pixel's footprint
    float reach, disc_reach; // of points, and of discs beyond themselves; reach 0: as far as may be
    uint32_t discs_first;    // ids from here on are discs'
    uint32_t from_width;     // of the planes at level 0
    uint32_t alone;          // 1: strays close nothing
};

// Lights in view space.
struct light_args {
    uint32_t type;     // patina_light_type
    float color[3];    // sun: irradiance; point, spot: radiant intensity (W/sr); area: the same of one of its points, head-on
    float vector[3];   // sun: unit, towards the light; others: position
    float axis[3];     // spot, area: unit, the way the light travels
    float cone[2];     // spot: cosine of the half angle; 1 / how far above it the cosine is when the edge has faded
    uint32_t shadow;   // 1 + its place among the instance's shadow words; 0: casts none, or the instance receives none
    float shadow_scale; // of a word's sum: 1 / (255 samples)
    float points[3 * PT_AREA_POINTS]; // area: positions
};

// shade: a ramp's colour in place of the point's, then exposure and contrast.
//   scalar: t = (scalar - zero) along.x; where it is NaN, the style colour
//   place: t = ((along.x x + along.y y) + along.z z) + zero, in view space
//   distance: t = (distance - zero) along.x, to the eye or (orthographic) to its plane
//   colour: entries evenly over t = 0..1, straight between
//   graded: c = grey (gain c / grey)^contrast, at most PT_BRIGHTEST
struct recolor_args {
    uint32_t source; // PT_RAMP_*; 0: no ramp
    uint32_t graded;
    float along[3], zero;
    float gain, contrast;
    uint32_t entries; // 2..PT_RAMP_MOST
    float ramp[3 * PT_RAMP_MOST];
};

// shade: id -> colour, normal, Phong. [D 3.1], deferred. A filled pixel's normal (SPEC 2.2, refined) is the blend, over the
// (2 r + 1)^2 window, of the surfaces of the same layer that its pixels show: normal[from], |z_q - z| <= deff[from of this
// pixel], weight 1 / (1 + distance^2), an eighth of it where q is filled itself; with blend = 0 (paper), and where the blend is
// nothing, its own source's. r = deff / (K footprint(z)), one spacing there in pixels, rounded, from 1 to blend.
struct shade_args {
    struct view_args view;
    struct instance_args instance;
    float world[3];     // ambient radiance; with `directed` for nothing
    uint32_t directed;  // 1: ambient radiance is max(sum of ambient[c][k] b_k(n), 0), n in view space, turned to the eye
    float ambient[27];  // c = 0..2, k = 0..8: 1, x, y, z, xy, yz, zx, x^2 - y^2, 3 z^2 - 1
    float eye_z;        // orthographic: near, so that view z = -(z + near); perspective: 0
    uint32_t blend;     // the window's radius at most, 0..8
    uint32_t arrived;   // 1: written
    uint32_t of_pixels; // 1: shadow words are those that discs blended to, of the pixel where the surface was measured
    uint32_t light_count;
    struct light_args lights[PT_MAX_LIGHTS];
    struct recolor_args recolor;
};

// tint: the colour of pixels whose surface lies near a cut. d: how far inside that box which keeps it most, how far outside a
// box that cuts or before a plane; weight = strength clamp((width - d) / footprint + 1/2), of the clip where it is greatest.
struct tint_args {
    struct view_args view;
    uint32_t id_base, id_count; // pixels of this instance
    uint32_t clip_first, clip_count;
    float eye_z; // as in shade_args
};

// mark: a byte of 1 for every point that the picture shows, measured or as the source of filled pixels.
struct mark_args {
    struct view_args view;
    uint32_t id_base, id_count;
};

// lit: points against the filled map of a light [D 6], SPEC 4. A point is in shadow if z > z_map + d_eff, d_eff of the point in
// this view with a texel PT_TEXEL_SLACK wider. Without a normal, d_eff is at least that of the surface that the map shows there,
// and z_map the greatest of the 3 x 3 texels around, in perspective of those within PT_SHADOW_APART times that surface's d_eff
// behind it: no slope gives acne, and shadows of suns, which see the ground at 2 degrees, end a texel early. Where one of these
// shows nothing, the surface ends within them, and no neighbour tells how far away its last points are: d_eff is then at least
// PT_SHADOW_STEEP times the point's own, that of the steepest slope. z > z_map + d_eff must hold at PT_SHADOW_SUPPORT of the 8
// texels around, too.
// Points outside the window or before z_near are lit. With `faint` the caster's points have opacities of their own: the loss is
// also in proportion to that of the point that the map shows.
struct lit_args {
    struct view_args view;         // of the map
    struct instance_args instance; // of the receiver: d_min, spacing, normals towards the light
    float window[4];  // x0, y0, x1, y1: pixels of the full picture that count
    uint32_t base;    // first of the light's words
    uint32_t loss;    // 1..255: what the casters of this map take from 255
    uint32_t alone;   // 1: the sample's only map
    uint32_t close;   // 1: the sample's last map: its loss goes into the sum. 0 when alone
    uint32_t samples; // with this one
    uint32_t compare; // 1: differs[0] becomes 1 unless every point's samples lost the same
    uint32_t marked;  // 1: only points with a mark
    uint32_t faint, caster; // caster: first id of the only cloud that casts
};

// average: what the points of an instance within d_eff of the surface that a pixel shows have there, filled or not, weighted by
// the tent w = (1 - |dx| / h) (1 - |dy| / h) about its centre. h: PT_AVERAGE_TENT times the point's spacing in pixels, 1 to
// PT_AVERAGE_WIDEST: points nearer together than 1.4 pixels add to four pixels each. The sums are integers, PT_SUM_SCALE a unit, so
// that no order shows.
//   albedo: mean colour, and 1; where no point reaches, that of the pixel's own point.
//   normal.xyz, of pixels that were measured and with `normals`: unit mean, on the side that it was on.
// PT_AVERAGE_TENT: on a sphere of 1 point a pixel 1.04 levels off, on one of 0.2 1.57; of 1, 1.01 and 1.61, in 1.4 times the time.
#define PT_AVERAGE_WIDEST 4.0f
#define PT_AVERAGE_TENT 0.7f
struct average_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t normals; // 1: means of normals too; the instance has them
    uint32_t sifted;  // as in scatter_args
};

// center: the tangent plane n . (p - q) = 0 of a measured point q, d pixels before the middle of its pixel, met by the ray r there:
// z_middle - z = -z (n.x xs d.x + n.y ys d.y) / (n . r) (orthographic: without z), within -min(d_eff, z / 2) to d_eff; 0 where the
// plane lies along the ray.
struct center_args {
    struct view_args view;
};

// limit: what a map's next layer sees lies beyond z + deff[from]; +inf (nothing does) where the map is empty, or the point that it
// shows takes all light: opacity and loss are 255.
struct limit_args {
    struct view_args view;
    uint32_t caster; // first id of the only cloud that casts
    uint32_t loss;   // as in lit_args
};

// smooth: 3 x 3 low-pass over non-background neighbours of the same layer. [D 3.4]
struct smooth_args {
    struct view_args view;
    float center, edge, corner; // weights, renormalised over the neighbours taken
    uint32_t translucent;       // 0: alpha is 1 wherever there is something
};

// lines: what enlarged discs would leave uncovered. [X 3], SPEC 7: dilated depth + offset < own depth.
//   1. A pixel's disc has the radius r = width (world: min(width / footprint(z), most)) and lies the offset behind its pixel,
//      along the ray: at v = z + (offset / max(|n.v|, C), or d_eff where offset is 0).
//   2. It shows at the pixel p, d pixels from its middle, where v < z_p and v lies before the tangent plane of p's surface.
//      Only pixels whose discs show at k > 0 of their own four cross neighbours have one: a step in depth, and not a slope that
//      a wide disc crosses. So a smooth surface shows no lines, however oblique or bent. Strays do not count: of the 8 pixels
//      around the far neighbour PT_LINE_SUPPORT lie beyond v as well, and of those around the pixel as many have steps, too.
//   3. A pixel takes the disc whose edge is farthest beyond it, r + 1/2 - d at the greatest; of equal ones the first in `taps`.
//      Its share: r + 1/2 - d over max(1, soft (r + 1/2)), at most 1. Without anti-aliasing, before that, r + 1/2 - d
//      >= PT_LINE_WITHIN gives as much as makes that 1, and others nothing.
//   4. With anti-aliasing, a pixel with a disc is covered by its own surface as far as antialias says of k; the rest of it, at most
//      r, is the line's, unless 3. gives more.
// Behind a layer, what lies before its limit is nothing, and empty pixels take lines only where the layers before cover them
// and let light through: else the first layer's line is there already, or nobody sees it. And lines belong to surfaces farther than
// the offset behind the limit of the pixel, z - (v - z) > limit: nearer ones end there because they touch the layer before.
struct lines_args {
    struct view_args view; // rect: the points', wider by the line's reach. Beyond it nothing is known: no discs, no edges
    float width;           // pixels, or world units
    uint32_t world;        // 1: width is in world units
    float most;            // radius of the widest disc, pixels
    float offset;          // world units; 0: d_eff
    float soft;            // share of the width over which a line fades, 0..1
    uint32_t antialias;
    uint32_t behind;       // 1: the limit and through planes hold
    uint32_t reach;        // of the taps, whole pixels
    uint32_t tap_count;
    uint32_t taps[PT_LINE_TAPS]; // pixels with d < most + 1/2, by d, then y, then x: x + 128 | y + 128 << 8 | d^2 << 16
};

// ink: lines get their colour, over a picture or behind what a sum of layers holds; where a line covers half a pixel or more, z
// becomes that of its surface.
struct ink_args {
    struct view_args view; // rect: of the line plane
    struct instance_args instance; // whose points' lines; with a colour of the points' own, its colours
    uint32_t crop_x, crop_y, crop_width, crop_height; // of the pictures in the planes
    uint32_t source;       // patina_line_source
    float color[3];        // POINT: times the point's own
    float far_color[3];    // DEPTH: at start + 1 / scale and beyond
    float start, scale;    // DEPTH
    float opacity;
    uint32_t behind;       // 1: colours go behind what the target holds
    uint32_t blank;        // 1: surfaces are not shown: the background takes their place first
    uint32_t color_target, depth, mask; // which of the three are written
    float background[4];   // premultiplied
};

// antialias: Laplace on depth as steps. [D 3.5]. Behind a layer, a neighbour through which no light comes any more is no edge:
// what this surface borders on there lies before it, and took its share of the pixel already.
struct antialias_args {
    struct view_args view;
    uint32_t layers; // 1: edges between layers too, 0: background edges only
    uint32_t behind; // 1: the through plane holds
    uint32_t mesh_base, mesh_count; // ids of triangles: an edge pixel's centre lies on them, so they cover more of it
    uint32_t inked;  // 1: the line plane holds; pixels with a line stay as they are, ink mixes them
};

// peel: a finished layer is blended behind those before it, and says what may show behind it. [D 4, 5], SPEC 3
//   1. A pixel whose depth is not beyond its limit was filled across a layer already taken: it is emptied, its limit stays.
//   2. color behind what was blended before: over + (1 - over.a) color.
//   3. through = through (1 - opacity) of the pixel's own point, limit = z + deff[from]; +inf (finished) where the layer is
//      empty or, with `stop`, through < PT_SPENT.
//   4. tiles: of each 2^PT_TILE_LEVEL x 2^PT_TILE_LEVEL pixels, as far as they lie in the rectangle, the least limit (+inf:
//      all finished) and how many the layer covers.
struct peel_args {
    struct view_args view;
    uint32_t first; // 1: the first layer: through is 1, nothing is limited, nothing was blended
    uint32_t stop;  // 0: what lies behind an opaque pixel is wanted too (passes of the layers)
    uint32_t inked; // 1: the over plane holds this layer's lines already, on the first layer too
};

// compose: over the background, into the crop.
struct compose_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height; // in the planes
    float background[4]; // premultiplied
    uint32_t everywhere; // 1: the colour holds where the key is empty, too
};

// ---- effects: on the colour of a layer, premultiplied, where it has something --------------------------------------------

#define PT_EDL_NEIGHBOURS 8
#define PT_EDL_MOST 16    // largest radius, pixels
// A neighbour's step counts up to this: beyond, an edge is an edge. So much darkens to 1/20 where half of the neighbours have
// it, at strength 1.
#define PT_EDL_STEP 6.0f
#define PT_EDL_EMPTY -3e38f // what empty neighbours have for a depth: nearer than all
#define PT_EDL_BEYOND 3e38f // beyond the plane: farther, so that it says nothing

// edl: eye-dome lighting. A pixel is darker the farther it lies behind its neighbours: with f(z) = log2 z in perspective, z in
// orthographic views, colour times 2^(-gain sum min(max(scale (f(z) - f(z_q)), 0), PT_EDL_STEP)). Empty neighbours count
// as nearer: a silhouette darkens within.
struct edl_args {
    struct view_args view;
    int32_t offsets[2 * PT_EDL_NEIGHBOURS]; // x, y in pixels
    uint32_t reach;                         // the largest of them
    float scale, gain;
};

#define PT_OBSCURE_TAPS 6
#define PT_OBSCURE_TURNS 16  // of the taps, by column and row modulo 4
#define PT_OBSCURE_MOST 32.0f // pixels that the radius may span; where it would span more, it is shortened
#define PT_OBSCURE_BIAS 0.1f // of the cosine: so low above a surface all is its own roughness
#define PT_OBSCURE_GAIN 5.0f  // deep folds are black then
#define PT_OBSCURE_BLUR 2     // pixels: 5 x 5 with half weights at the rim hold every turn equally

// obscure: ambient obscurance. How much of what a surface sees within the radius r is near, by taps on a spiral that is
// turned by the pixel's place in the full picture: mean over the taps of GAIN max(cos - BIAS, 0) (1 - |v|^2 / r^2), v from
// the pixel's point to the tap's, cos between v and the normal shown. Then the mean over 5 x 5 pixels of the same layer
// (|z_q - z| <= 2 d_eff), weights 1 and at the rim 1/2; colour times 1 - strength of that, at least 0.
struct obscure_args {
    struct view_args view;
    float radius, strength;
    float spiral[2 * PT_OBSCURE_TAPS]; // x, y in radii
    float turns[2 * PT_OBSCURE_TURNS]; // cosine, sine
};

#define PT_TOON_DARK 1e-6f // less albedo or light than this is none

// toon: bands of light over colours as they are. light = luminance of the colour / that of the albedo; its root times `bands`
// (their number less 1/2, so that full light is in the middle of the last) goes in steps of 1, each a smooth step 1 / steepness
// wide; the first band is the darkest there is. Colour times band / light.
struct toon_args {
    struct view_args view;
    float bands, inverse; // inverse: 1 / bands
    float steepness;
};

#define PT_HATCH_LEVELS 3
#define PT_HATCH_GRAZING 0.01f // least (n . r)^2: 84 degrees; flatter, strokes run together

// hatch: strokes where planes across an axis cut the surface: they follow its form, and lie still in the scene. A level's
// planes are 2^k world units apart, k so that strokes on screen are 1/2 to 1 of the spacing apart; every other one thins out
// before the next k. Wider where the colour's tone (root of its luminance) is darker: width max(1 - tones tone, 0).
struct hatch_args {
    struct view_args view;
    uint32_t levels;
    float eye_z;   // orthographic: near, as in shade
    float spacing; // pixels
    float width;   // of a stroke on black, pixels
    float opacity, ground; // of the ink; share by which colours give way to white beneath
    float color[3];
    float tones[PT_HATCH_LEVELS];
    float offsets[PT_HATCH_LEVELS];  // of the camera along the axis
    float axes[3 * PT_HATCH_LEVELS]; // unit, view space
};

#define PT_CONTOUR_KINDS 2       // all lines; of every few of them one, bold
#define PT_CONTOUR_GRAZING 1e-3f // least (n . r)^2: 88 degrees
#define PT_CONTOUR_FLAT 1.6e-5f  // sin^2 of 0.23 degrees: a flatter surface is level. Else a floor whose height is that of a line would be
                                 // one blot
#define PT_CONTOUR_RISE 3472.2222f // 1 / (sin^2 of a degree - FLAT): from there on lines are wholly seen

// contour: lines where the height h = axis . p + offset is a multiple of an interval, as wide on screen at any slope: the surface goes on
// in its tangent plane, so that from pixel to pixel h grows by |g|, g = w (a - (a . r) n / (n . r)) along x and y, w a pixel's width at p.
// With d = |h / interval - round| interval / |g|, pixels, a line covers clamp(width / 2 - d + 1/2, 0, 1) min(width, 1). Where lines are
// less than 2 `even` pixels apart (even = 2 max(width, 1)) that goes over into an even tone, width / apart, which at `even` and less is
// width / even. What kinds of lines cover most counts; times opacity, less on what is nearly level.
struct contour_args {
    struct view_args view;
    float eye_z;   // orthographic: near, as in shade
    float axis[3]; // unit, view space
    float offset;  // of the camera along the axis, less whole bold intervals
    float opacity;
    float color[3];
    uint32_t kinds; // 1, 2
    float interval[PT_CONTOUR_KINDS], inverse[PT_CONTOUR_KINDS]; // 1 / interval
    float width[PT_CONTOUR_KINDS];                               // pixels
    float even[PT_CONTOUR_KINDS], per_even[PT_CONTOUR_KINDS];    // 1 / even
};

// fog: colour (1 - s) + fog alpha s with s = density clamp((d - start) inverse, 0, 1), d the distance from the eye; in orthographic
// views z.
struct fog_args {
    struct view_args view;
    float start, inverse, density;
    float color[3];
};

#define PT_FOCUS_MOST 32            // largest circle of confusion, radius in pixels
#define PT_FOCUS_SHARP 0.56418958f  // a circle of a pixel's area
#define PT_FOCUS_DENSITY 0.31830989f // 1 / pi: light of a circle of radius 1, a pixel

// focus: depth of field of a thin lens, over the background, into the crop. A pixel's circle of confusion has the radius
// c = min(scale |1 - distance / z|, most), in orthographic views min(scale |z - distance|, most); empty pixels lie
// infinitely far. Of a pixel p, every q within reach at r pixels gives its colour with the weight clamp(c - r + 1/2, 0, 1) /
// max(pi c^2, 1). Those before p (z_q < z_p) cover it by their weights' sum N, at most wholly; the others, p too, with
// min(c_q, c_p) for c, are what is seen between: their mean times 1 - min(N, 1).
struct focus_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height; // in the planes
    float background[4]; // premultiplied
    float distance, scale, most;
    uint32_t reach; // pixels, at most PT_FOCUS_MOST
};

// paper: the picture times color (1 - grain noise), the noise of the pixel's place in the full picture.
struct paper_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height;
    uint32_t x, y; // of the crop in the full picture
    float color[3];
    float grain;
};

// extract: depth, world-space normal, source, shadow. Any may be left out.
struct extract_args {
    struct view_args view;
    uint32_t crop_x, crop_y, crop_width, crop_height;
    uint32_t depth, normal, source, shadow;
    uint32_t discs_first, discs_count; // of ids: how far a measured pixel lies from such a point is in the away plane
    uint32_t centered; // ids below it: their depth has the offset of the measured pixel that it comes from added
    float world_from_view[9];
};

// assess: what is known of the point whose surface a pixel shows: its certainty, 0..1, and its thickness, world units. 0 where
// nothing is known, or nothing is. Visits view.rect, which lies within the crop.
struct assess_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t crop_x, crop_y, crop_width;
    uint32_t first;                // 1: pixels that the instance does not show become 0; else they stay
    uint32_t certainty, thickness; // either may be left out
    float sigma_scale;             // times instance.spacing of its class: a thickness
};

// reveal: what the apart plane says of the instance's pixels, or of the pixel whose surface they show; 0 elsewhere.
struct reveal_args {
    struct view_args view;
    struct instance_args instance;
    uint32_t crop_x, crop_y, crop_width;
    uint32_t first; // as in assess_args
};

#define PT_SIGHT_BEND 1.25f // a tangent u lies at (1.25 - 0.25 u^2) u on its face: cells are 0.75 to 1 of a face's mean angle wide
#define PT_SIGHT_SHIFT 12   // 11 bits of mantissa and 5 of exponent are kept of a range: 0.05 %
#define PT_SIGHT_LEAST 1e-18f // a place nearer to a station than this, or farther than PT_SIGHT_FARTHEST, was not looked through
#define PT_SIGHT_FARTHEST 1e18f
// Pixels from its measured point, beyond which a pixel counts as closed. Four virtual scans, two cameras each: at 1.5 a third more of
// false surface goes, and twice as much of the true one.
#define PT_REOPEN_AWAY 4.0f
#define PT_REOPEN_FIND 0u  // phases of reopen
#define PT_REOPEN_KEEP 1u
#define PT_REOPEN_TAKE 2u
#define PT_REOPEN_SHOW 3u

// reopen: pixels that were closed, and not measured, where a station of the instance looked through the place that they show. SPEC 11
//   1. Closed: a disc whose point fell farther off than PT_REOPEN_AWAY, or filled from a pixel that lies, and whose own disc's point
//      fell, so far off together.
//   2. The place, seen from a station in its object: q = eye + z ((m.x u + m.y v) - m.z), rows m; orthographic: the first product
//      by itself, and m.z (z + near). On the face of the axis where |q| is greatest, x before y before z, the other two over it, in
//      the order of the axes from there on, are bent (PT_SIGHT_BEND); the cell there says how far the station looked.
//   3. Looked through: q^2 grow < range^2.
//   FIND: limit = z + deff[from] there, -1 elsewhere (`first`: written for all); with `last` all keys become empty: what lies
//         behind is drawn next.
//   KEEP: kept = keys, before filling.
//   TAKE: they become what was kept, empty where that is looked through as well, or was no other.
//   SHOW: their colours become magenta.
struct reopen_args {
    struct view_args view;
    uint32_t id_base, id_count; // pixels of this instance
    uint32_t phase;             // PT_REOPEN_*
    uint32_t first, last;
    uint32_t discs;             // 1: the away plane holds
    uint32_t stations;          // so many struct station_args stand behind these
    float rows[9];              // view space -> object, without translation
    float eye_z;                // orthographic: near
};

struct station_args {
    float eye[3];    // of the camera, from the station, in the instance's object
    float grow;      // (1 + share of the range by which what was seen lies farther)^2
    uint32_t first;  // of its cells: in the lower half of words[first / 2] where it is even
    uint32_t across; // cells along an edge of a face; 6 x across x across of them: +x, -x, +y, -y, +z, -z
    uint32_t base;   // cell << PT_SIGHT_SHIFT, and this added: bits of a range; a cell of 0: nothing is known
};

#define PT_CERTAINTY_STEP 0.0666666701f // 1 / 15

// ---- soft points: SPEC 5 [S] ------------------------------------------------------------------------------------------------

// The field word of a point: F in steps of 1/65535 in the upper half, the radius of its ball, object units, in the lower: bits
// 15 to 30 of a float.
#define PT_FIELD_SHIFT 16
#define PT_FIELD_RADIUS 0xFFFFu
#define PT_FIELD_MOST 65535.0f
// A record of 8 words: X, Y, z of the centre, not divided by z, as in chunk_view; radius; colour, lit; and opacity at the centre
// in steps of 2^-24 << PT_SOFT_SHIFT | W of [S Eq. 22] in steps of 1/255. z = +inf: there is none.
#define PT_SOFT_WORDS 8u
#define PT_SOFT_SHIFT 8
#define PT_SOFT_STEPS 16777215.0f
// Balls are at least so many pixels in radius, and as much fainter: narrower ones would fall between pixels.
#define PT_SOFT_LEAST 1.0f
#define PT_SOFT_FULLEST 0.9999847f // 1 - 2^-16: more opacity than this has no density
#define PT_SOFT_SPENT 0.000244140625f // 2^-12: what lies behind is not looked at; a quarter of a step of 10 bits
#define PT_SOFT_TILE 16u
#define PT_SOFT_PART 16384u // OpenGL: steps through a list from one dispatch to the next
#define PT_SOFT_FARTHEST 1e30f // a place beyond is none
#define PT_SOFT_WIDEST 1e18f   // no radius is more
#define PT_SOFT_BEFORE 1e-30f  // z of what is before the eye; what is not is lit as if it lay on the view's axis
#define PT_SOFT_EXPRESS 0u // models
#define PT_SOFT_CONCENTRIC 1u
#define PT_SOFT_BASE 2u
#define PT_SOFT_EVEN 0u // weights of shells: r / N, which come to the Base model's density
#define PT_SOFT_EQ13 1u
#define PT_SOFT_EQ15 2u
#define PT_SOFT_RING 4.0f    // Concentric: a shell every so many pixels of the radius,
#define PT_SOFT_SHELLS 64.0f // at most
// (cos(pi sqrt(q)) + 1) / 2 - 1 over q, for q in 0..1, within 2e-7
#define PT_SOFT_COSINE_0 -2.46740103f
#define PT_SOFT_COSINE_1 2.02935433f
#define PT_SOFT_COSINE_2 -0.667612433f
#define PT_SOFT_COSINE_3 0.117583841f
#define PT_SOFT_COSINE_4 -0.0127442228f
#define PT_SOFT_COSINE_5 0.000819474808f
#define PT_SOFT_DISC 1.0704707f      // 1 / the integral of (cos(pi r) + 1) / 2 over the unit disc, pi / 2 - 2 / pi
#define PT_SOFT_BALL 0.95492965855f  // 3 / pi: 1 / the integral of 1 - r over the unit ball

// soft: the balls of soft points along each pixel's ray, front to back, as far as the nearest solid surface. n = 1 + u^2 + v^2
// with (u, v, -1) the pixel's ray; orthographic n = 1, and X, Y are not times z. e: from the ray at the centre's z to the centre.
//   d^2 = |e|^2 - (e . (u, v))^2 / n     how far the centre lies from the ray
//   s = (z n + e . (u, v)) / sqrt(n)     where along the ray it lies nearest; along is sqrt(n) z
// Base [S 3.1]: between two places along the ray where balls begin or end, colour is the mean of those that are open with the
//   weights (1 - d/r) a, light lost 1 - exp(-sum m lambda I), I the integral of 1 - distance / r over the part within each ball, in
//   radii, lambda = -ln(1 - a), a opacity at the centre.
//   m: with F between the threshold and l_m [S Eq. 22] the opacity P of the whole ball becomes a (1 - d/r)(1 - W) + P W: m of its
//   density. Else 1.
// Concentric [S 3.2]: I is a sum over N shells of radii r (1 - i/N), of the length within each times its mu, in radii; lambda the
//   same divided by the sum of mu 2 r_i / r at the centre.
// Express [S 3.3]: one piece a ball, at its centre's z: an ellipse on screen, that of a disc across the ray to the centre: with
//   n, u, v of that ray q = ((dx^2 + dy^2) - (dx u + dy v)^2 / n) (z/r)^2, dx, dy in units of u, v; opacity a (cos(pi sqrt(q)) + 1) / 2.
// Equal z go by record. A pixel whose light falls below PT_SOFT_SPENT takes no more.
// density: points per square of the world's unit across the ray, each shared out over its ball (Express: over its disc).
struct soft_args {
    struct view_args view;  // rect: the pixels that are written
    uint32_t records;       // how many there may be, drawn or not
    uint32_t model, mu;     // PT_SOFT_*
    uint32_t shells;        // of every ball; 0: as PT_SOFT_RING says
    float z_from, z_to;     // only what lies beyond z_from, and not beyond z_to
    uint32_t layered;       // 1: only what lies beyond the reached plane, too; and it goes behind what target holds, of the plane's
                            // size. 2: the same, whatever the keys' z. 0: it goes before what target holds, of the crop's size
    uint32_t last;          // layered: the keys' z becomes the reached one, where it lies beyond that
    uint32_t crop_x, crop_y, crop_width; // of density, and of target unless layered
    uint32_t density;       // 0: none; 1: written; 2: added to
};

// gather: the soft points of an instance become records, lit as shade lights them.
struct gather_args {
    struct shade_args shade; // view: of the planes
    uint32_t threshold;      // of F, in its steps: points above are soft
    float weight;            // 1 / (l_m - t), in steps; 0: every W is 1
    float radius_scale;      // object units -> world, times what strata leave out
    float opacity;           // at the centre, times the instance's and the point's
    uint32_t within;         // 1: balls whose centre is nearer than z_near, or beyond z_far, may show
    uint32_t sifted;         // as in scatter_args
};

#endif
