// SPDX-License-Identifier: GPL-3.0-or-later
// Stage meshes: triangles, and the images on them.
#ifndef PT_SHARED_MESHES_H
#define PT_SHARED_MESHES_H

#include "shared/view.h"

// Meshes: screen positions are rounded to 1 / 2^PT_MESH_BITS of a pixel, so that edges are decided in integers, exactly.
// Triangles are cut off PT_MESH_REACH pixels from the picture's corner: positions then fit 32 bits.
#define PT_MESH_BITS 8
#define PT_MESH_UNIT 256.0f
#define PT_MESH_REACH 1048576.0f
#define PT_MESH_FARTHEST 1e18f // triangles with a greater coordinate, or none that is a number, are left out
#define PT_MESH_CORNERS 8 // of a triangle that five planes cut
#define PT_TEXTURE_LEVELS 15 // 16384 texels a side
#define PT_PROBES 8u
#define PT_TEXELS_SRGB 1u   // a word: red in the lowest byte, green, blue, opacity
#define PT_TEXELS_LINEAR 2u // the same without sRGB's curve
#define PT_TEXELS_FLOAT 3u  // four floats
#define PT_WRAP_REPEAT 0u
#define PT_WRAP_EXTEND 1u
#define PT_WRAP_CLIP 2u

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

// locate: of pixels that show the mesh, in view space: places: x of a row's pixels, then y, z, row after row; words: surfels
// without spacing, of the triangle's plane. Others stay.
struct locate_args {
    struct view_args view;
    struct mesh_args mesh;
    float eye_z; // as in shade_args
};

#endif
