// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles among the points, and images on them, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_MESHES_H
#define PATINA_MESHES_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- mesh: triangles that stand among the points ----------------------------------------------------------------

typedef struct patina_mesh_desc {
    size_t struct_size;
    uint64_t vertex_count;
    patina_array position; // 3 x FLOAT32 or FLOAT64, object units. A triangle with a NaN/Inf corner is not drawn
    patina_array normal;   // 3 x FLOAT32/FLOAT64, any length, of every vertex, shared out over the triangle. Optional: without
                           // it, and where it comes to zero, triangles are lit flat
    patina_array color;    // 3 or 4 x FLOAT32, linear, of every vertex, shared out likewise. Optional; else the style's
    uint64_t triangle_count;
    const uint32_t *indices; // three a triangle, below vertex_count; NULL: vertices 0 1 2, 3 4 5, ...
    patina_array uv; // 2 x FLOAT32 or FLOAT64, of every vertex: where on an image it lies, 0..1 from its lower left corner;
                     // what is not finite is 0. Optional; for the style's texture
} patina_mesh_desc;

typedef struct patina_mesh_info {
    size_t struct_size;
    uint64_t vertex_count, triangle_count;
    uint64_t bytes;                // of memory held
    double box_min[3], box_max[3]; // over the vertices that are finite; none: min > max
} patina_mesh_info;

// A mesh of at most 2^27 vertices and 2^29 triangles. Immutable; used in scenes as a cloud is. Vertices are kept as float32
// around the middle of their box.
PATINA_API int patina_mesh_create(const patina_mesh_desc *desc, patina_mesh **out);
PATINA_API void patina_mesh_destroy(patina_mesh *mesh);
PATINA_API int patina_mesh_get_info(const patina_mesh *mesh, patina_mesh_info *info);

// ---- texture: an image on a mesh ----------------------------------------------------------------------------------

enum patina_wrap { // beyond the image
    PATINA_WRAP_REPEAT = 0,
    PATINA_WRAP_EXTEND = 1, // its border texels
    PATINA_WRAP_CLIP = 2,   // nothing: black, opacity 0, from half a texel on
};

typedef struct patina_texture_desc {
    size_t struct_size;
    uint32_t width, height; // texels, 1..16384
    patina_array pixels; // width * height elements of 3 or 4 x UINT8, UINT16 (0..max) or FLOAT32 (linear, within +-65504), row
        // by row from the bottom left. Colour, not multiplied by the 4th component, its opacity (0..1; none: 1).
        // Not finite: 0, of opacity 1. UINT8 takes 5.4 bytes a texel, the others 21.4
    uint32_t raw;     // 1 = integers are linear; 0 = sRGB. Opacity is linear
    uint32_t nearest; // 1 = each texel is a square where it is larger than a pixel; 0 = shared out between four
    uint32_t wrap;    // patina_wrap
} patina_texture_desc;

// An image of any size, not only powers of two, with box means of it for where it is small on screen: up to eight probes of two of
// them a pixel, along its longer side, so that oblique faces neither shimmer nor blur. Copied; immutable, so that it may be used
// by many scenes and threads at once. Any thread may make one.
PATINA_API int patina_texture_create(const patina_texture_desc *desc, patina_texture **out);
PATINA_API void patina_texture_destroy(patina_texture *texture); // NULL is fine

// ---- in scenes --------------------------------------------------------------------------------------------------------

enum patina_alpha {
    PATINA_ALPHA_NONE = 0,  // nothing: all is opaque, its colours times the opacity
    PATINA_ALPHA_CLIP = 1,  // cuts holes, for light too
    PATINA_ALPHA_BLEND = 2, // lets through what lies behind: layers are peeled, settings.layers at most. Light is stopped where
                            // opacity is at least 0.5
};

typedef struct patina_mesh_style {
    size_t struct_size;
    double world_from_object[16];  // row-major; all zero = identity
    float color[3];                // linear, of meshes without colours; all zero = 0.8 grey, unless exact
    uint32_t shadow_off;           // bits of patina_shadow_off: NO_CAST, NO_RECEIVE
    uint32_t unlit;                // 1 = the colour as it is, as if it shone by itself; lights and shadows change nothing
    const patina_texture *texture; // in place of color and the mesh's colours; the mesh has uv. Outlives the scene or the next
                                   // patina_scene_clear. NULL = none
    uint32_t alpha;                // patina_alpha: what the texture's opacity does
    float alpha_least;             // CLIP: what is less opaque is not there, 0..1; 0 = 0.5
    uint32_t exact;                // 1 = black is black
} patina_mesh_style;
#define PATINA_MESH_STYLE_INIT                                                                                                 \
    {                                                                                                                          \
        .struct_size = sizeof(patina_mesh_style), .color = {0.8f, 0.8f, 0.8f}, .alpha_least = 0.5f, .exact = 1                 \
    }

// A mesh is opaque but for its texture, seen from both sides, lit by all lights (ambient and diffuse), takes part in every pass,
// and hides and shadows points and meshes, as points hide and shadow it. Shadows on it are tested for each pixel, anew for every
// picture; with shadow_error it takes 1 / shadow_error samples, 256 at most. It is drawn exactly: neither filled nor grown. In keys, ids of triangles follow
// those of all clouds' points, meshes in order of adding. The mesh must outlive the scene or the next patina_scene_clear.
PATINA_API int patina_scene_add_mesh(patina_scene *scene, const patina_mesh *mesh, const patina_mesh_style *style);

#ifdef __cplusplus
}
#endif
#endif
