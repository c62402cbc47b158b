// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures all around an eye, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_PANORAMA_H
#define PATINA_PANORAMA_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- panoramas: equirectangular pictures around an eye, as Blender's -------------------------------------------------------

// Columns are longitudes, rows latitudes. The picture is joined from six perspective views, which the caller renders with any
// scene and settings:
//
//     for (face = 0; face < 6; face++) {
//         patina_panorama_camera(&panorama, face, &camera, &size); // settings.width = settings.height = size
//         ... render, and read the passes into faces[face] ...
//     }
//     patina_panorama_join(&panorama, PATINA_PASS_COMBINED, faces, pixels, size_in_bytes);
typedef struct patina_panorama {
    size_t struct_size;
    uint32_t width, height;       // of the whole picture, 1..65536
    uint32_t region[4];           // x0, y0, x1, y1 in pixels (from bottom left): join only this crop; all zero = whole
    double world_from_camera[16]; // -z is the middle of the whole picture, +y its upper border
    double longitude[2]; // radians at the left and the right border, within -pi..pi, growing to the right; zero = -pi, pi
    double latitude[2];  // at the lower and the upper border, within -pi/2..pi/2; both zero = -pi/2, pi/2
    double near_clip, far_clip; // distances from the eye; in the middle of a face the near one is 1.8 times nearer
} patina_panorama;

// The camera of a face, 0..5, and the pixels of its side: as fine as the picture in the middle of a face, finer elsewhere.
// Faces overlap by a guard band. Any thread.
PATINA_API int patina_panorama_camera(const patina_panorama *panorama, uint32_t face, patina_camera *camera, uint32_t *size);
// Joins a pass of the six faces (size * size * channels float32 each) into the caller's picture; size in bytes must fit the
// region exactly. COMBINED is the mean of four points a pixel, and goes over from face to face within the guard bands; other
// passes take the nearest pixel of one face. DEPTH becomes the distance from the eye. Blocks; threads of its own; any thread.
PATINA_API int patina_panorama_join(const patina_panorama *panorama, uint32_t pass, const float *const faces[6], float *pixels,
                                    size_t size);
// The same for keys (patina_frame_read_keys); their z stays that of the face.
PATINA_API int patina_panorama_join_keys(const patina_panorama *panorama, const uint64_t *const faces[6], uint64_t *keys,
                                         size_t size);

#ifdef __cplusplus
}
#endif
#endif
