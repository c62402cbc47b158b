// SPDX-License-Identifier: GPL-3.0-or-later
// Saved clouds of more points than memory holds, and smaller ones: a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_BUILDER_H
#define PATINA_BUILDER_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// Builds a file that patina_cloud_open maps, from points that come piece by piece: they are sorted on the disk. The file has the chunks that
// patina_cloud_create would make, to some digits the same picture; from a million points on it is made in levels, coarse ones first. Where
// all fits in memory and there is one level, its bytes are those that patina_cloud_save would write. Not analysed: patina_cloud_analyse_file does it.
typedef struct patina_builder patina_builder;

typedef struct patina_builder_desc {
    size_t struct_size;
    uint64_t
        memory; // bytes that it takes at most, 16 MiB at least; 0 = a third of what is free. A chunk of work less than 4096
                // points does not go below what these need
    uint64_t
        count; // of all points, as far as known: the disk is asked for room for so many before anything is written; 0 = not known
    double box_min[3],
        box_max[3];   // of all points, object units, as far as known; equal = not known. Wrong ones cost time alone
    uint32_t threads; // 0 = one per core
    uint32_t
        narrow_colors; // 1 = UINT16 colours that 8 bits hold (all up to 255; or all low bytes zero; or all as their high bytes) become bytes,
    // and normals, colours, scalars and classes that are zero at all points are left out, as if no piece had them; 2 = bytes alone: zeros stay
} patina_builder_desc;

// The file gets its name at the end, whole or not at all. Beside it lies, without a name, what is sorted: about 40 bytes a point and once
// more what the file takes. A killed process leaves at most a part of a file beside it, that the next build of it removes. Several
// processes may build one file at a time: the last to end has it. desc may be NULL. PATINA_ERROR_FILE where the disk lacks room.
PATINA_API int patina_builder_begin(const char *path, const patina_builder_desc *desc, patina_builder **out);
// The next points: numbered in the order that they come in. Arrays are copied; which there are, their types and the origin are those of
// the first piece with any points. threads is ignored. At most 2147483647 points a piece, of any number in all: of more than 4294967295
// the file has no order, and numbers them as they lie (patina_save_desc.drop_order).
PATINA_API int patina_builder_add(patina_builder *builder, const patina_cloud_desc *piece);
// The same of a file's points, or of one of its windows: what patina_file_cloud makes of them, and the attribute `scalar`, in its order;
// NULL: none.
PATINA_API int patina_builder_add_file(patina_builder *builder, const patina_file *file, const char *scalar);
// Writes the file; once, and nothing may be added then. progress: may be NULL; stops it too. After an error there is no file but the
// one that was there before.
PATINA_API int patina_builder_end(patina_builder *builder, patina_progress *progress);
PATINA_API void patina_builder_destroy(patina_builder *builder); // without an end: nothing was built. NULL is fine

// Writes to `to`, which may be `from`, the saved cloud in `from` with what patina_cloud_analyse finds (desc may be NULL): the bytes that
// opening, analysing and saving it would write. memory: bytes that it takes at most, 16 MiB at least; 0 = a third of what is free. What
// does not fit (36 bytes a point; with a grid 16 more and 4 a cell) lies on the disk beside `to`, without a name. Beside what memory
// says: chunks, 0.1 bytes a point, the descriptor's arrays, and with free space up to 100 MB of what stations saw. PATINA_ERROR_FILE
// where the disk lacks room. After an error, a cancel or a kill there is no file but the one that was there before.
// PATINA_ERROR_TOO_MANY_POINTS: of more than 2147483647 slots (points and padding), which makes a cloud of parts.
PATINA_API int patina_cloud_analyse_file(const char *from, const patina_analysis_desc *desc, uint64_t memory, const char *to,
                                         patina_progress *progress);

// patina_cloud_save, smaller where that is asked for; desc may be NULL. What is packed or numbered anew stays so when it is saved again.
typedef struct patina_save_desc {
    size_t struct_size;
    // 1 = 8 bytes a position in place of 12: a chunk's lie on a grid of 2^21 places across, whose spacing is a power of two, and move to its
    // nearest place, along an axis by 2^-21 of half the chunk's box or twice that; info.packed_error says how far at most. Pictures are exactly
    // those of points that lie there. An order that numbers points as they lie is left out
    uint32_t pack;
    // 1 = 4 bytes a point less: numbered anew, as they lie in the file, from 0 to info.drawn - 1; what has no place is none of them. Arrays
    // that belong to the numbers of before fit no longer
    uint32_t drop_order;
} patina_save_desc;
PATINA_API int patina_cloud_save_as(const patina_cloud *cloud, const char *path, const patina_save_desc *desc);

#ifdef __cplusplus
}
#endif

#endif
