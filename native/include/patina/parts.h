// SPDX-License-Identifier: GPL-3.0-or-later
// One picture by several machines, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_PARTS_H
#define PATINA_PARTS_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- parts of one picture's points: SPEC 12 --------------------------------------------------------------------------

// Each machine describes the same scene with the same clouds, in the same order; of saved clouds (patina_cloud_open) it reads
// chunks and their order, and of the points its share alone. It writes the least keys of that share, of the picture and of every
// light's map, to a file. Another, or one of them, takes the minimum of all files and goes on as any render does: the picture has
// the same bytes as patina_frame_render's. Layers behind the first take a round each: what the merge of the rounds before left,
// `next`, tells the parts what lies behind.

// A part's share, from 1 on, of `of`.
typedef struct patina_part {
    size_t struct_size;
    uint32_t part, of;  // 1 <= part <= of <= 65536
    const char *behind; // NULL = the first round; else the file that patina_frame_merge wrote for the round to come
    const char *note;   // text of the caller's, at most 1 MiB, that stays in the file; NULL = none
} patina_part;

// Scatters the part's share of the scene's points, and of every casting light's maps, and writes the file of keys, whole or not at
// all. Blocks; patina_frame_cancel stops it. The frame's last picture stays. PATINA_ERROR_UNSUPPORTED names what of the scene is
// not divided among machines: range images, soft points, samples of pixels, free space, shadows of points that have opacities of
// their own.
PATINA_API int patina_frame_scatter(patina_frame *frame, const patina_scene *scene, const patina_part *part, const char *path);

// Renders the picture of `count` files of keys, in any order: all parts of the first round, and of each round that there was since.
// *round: 0 = the picture is done, to be read as any; else the number of the round that is wanted: `next` was written, and the
// picture is the last one still. next: NULL = fail then with PATINA_ERROR_EMPTY. PATINA_ERROR_FORMAT names a file that is damaged,
// cut short, of another version, picture or round, or a part that is there twice or not at all. Blocks.
PATINA_API int patina_frame_merge(patina_frame *frame, const patina_scene *scene, const char *const *paths, uint32_t count,
                                  const char *next, uint32_t *round);

enum patina_keys_kind { PATINA_KEYS_PART = 1, PATINA_KEYS_NEXT = 2 };

typedef struct patina_keys_info {
    size_t struct_size;
    uint32_t kind;      // patina_keys_kind
    uint32_t part, of;  // of a PART
    uint32_t round;     // from 1 on; of NEXT: that it is for
    char engine[32];    // patina_version() of who wrote it
    uint64_t picture;   // equal numbers: of the same picture
    uint64_t note_size; // bytes of the note, without the zero behind it
} patina_keys_info;

// What a file of keys says of itself. No handle: the message is at the thread.
PATINA_API int patina_keys_get_info(const char *path, patina_keys_info *info);
// Its note, with a zero behind it; size must be note_size + 1.
PATINA_API int patina_keys_read_note(const char *path, char *note, size_t size);

#ifdef __cplusplus
}
#endif

#endif
