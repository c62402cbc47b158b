// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud: chunks of Morton neighbours (DESIGN rule 5). Everything lies in chunk order, so that what a picture needs at a
// time lies together; a point's number is its slot. The caller's own order is known at the doors alone (numbering.h).
#ifndef PT_CLOUD_H
#define PT_CLOUD_H

#include "base/error.h"
#include "base/pool.h"
#include "shared/packed.h"
#include "sights.h"

#include <stdatomic.h>
#include <string.h>

// 4096 points: small enough that a chunk's normal cone and box cull well (a torus of 1M points loses 45% of its chunks
// to the back-face cone), large enough that 96 bytes of chunk_view a frame vanish beside 48 KiB of positions.
enum { PT_CHUNK_POINTS = 4096, PT_CHUNK_ALIGN = 16, PT_STRATA = 6 };

struct pt_chunk {
    double origin[3];                // object units
    float box_min[3], box_max[3];    // relative to origin
    float cone_axis[3], cone_cosine; // every normal n: n . axis >= cosine; cosine -2: a point has no normal
    float spacing;                   // about 1 / sqrt(points per area), object units; 0 unknown
    uint32_t first;         // slot of the first point; of a cloud in parts (parts.h) that of the part's, see pt_chunk_slot
    uint32_t count, padded; // padded slots repeat the last point
    uint32_t classes[8];    // of its points: bits as in patina_cloud_info.class_bits
    uint32_t shapes[8];     // of its points, drawn or not: bit c % 32 of word c / 32: the byte c from PT_SHAPE_SIGHT_SHIFT on
    float reach, footprint; // greatest half axis of its points' footprints, and their 90th percentile; 0: not analysed
    float built;            // the spacing as the cloud was built with it, whatever an analysis found: range images go by it
    // Of a cloud in levels: about how far apart the points of this chunk and of all coarser ones that reach over its box lie, taken
    // together. The next finer chunks halve it: a level holds four times the points of the one before it. 0: the cloud has one level.
    // `spacing` and `built` are those of the whole cloud there, whatever the level.
    float gap;
};

// Whether a cloud still lives, shared with the devices that hold its buffers.
struct pt_alive {
    atomic_int references, alive;
    atomic_uint colors;           // counts how often they and the scalars were set
    atomic_uint pages;            // counts how often pages arrived: all arrays are others then
    atomic_uint shapes;           // counts how often surfels and shapes were
    _Atomic uint64_t fingerprint; // 0: nobody has asked for it yet
    uint64_t serial;              // no other handle of this process has or had it; not 0
};

enum pt_color_format { PT_COLOR_NONE = 0, PT_COLOR_SRGB8 = 1, PT_COLOR_FLOAT = 2 };

static inline size_t pt_color_size(enum pt_color_format format) // bytes a point
{
    return format == PT_COLOR_SRGB8 ? 3 : format == PT_COLOR_FLOAT ? 12 : 0;
}

// Arrays of a built cloud, in the order in which a file has them (cloud_store.c).
enum pt_array {
    PT_ARRAY_CHUNKS,
    PT_ARRAY_POSITIONS,
    PT_ARRAY_ORDER,
    PT_ARRAY_SURFELS,
    PT_ARRAY_COLORS,
    PT_ARRAY_OPACITIES,
    PT_ARRAY_RADII,
    PT_ARRAY_SCALARS,
    PT_ARRAY_CLASSES,
    PT_ARRAY_SHAPES,
    PT_ARRAY_SIGHTS,
    PT_ARRAY_SIGHT_WORDS,
    PT_ARRAYS
};

struct patina_cloud {
    struct pt_handle handle;
    patina_cloud_info info;
    struct pt_alive *alive;
    uint64_t slots; // padded points
    uint32_t chunk_count;
    uint32_t mapped;  // bits 1 << pt_array: of points, pages of a file that nobody ever wrote to
    int packed;       // positions are, all of them (packed.h)
    int unordered;    // points are numbered as they lie: there is no order, but ...
    uint32_t *begins; // ... the number of each chunk's first point, and behind them of all
    struct pt_chunk *chunks;
    struct pt_cluster *clusters;    // of chunks (clusters.h), of a file; NULL: there are none
    struct pt_page_sums *page_sums; // what its arrays in the file sum up to (page_sums.h); NULL: nobody wrote it
    struct pt_paged *paged;         // of a cloud whose points arrive page by page (paged.h), else NULL
    void *positions; // words, by chunk (struct chunk_view): 3 * slots floats, relative to the chunk's origin; packed: 2 * slots
    uint32_t *order; // slots: index in the caller's arrays; NULL: see begins
    uint32_t *surfels;  // slots: octahedral normal and spacing class (shared/words.h)
    int beside;         // pt_shapes_beside; files keep it
    int keeps_colors;   // points without a color stay black: patina_analysis_desc.keep_colors
    uint32_t *shapes;   // slots: footprint, thickness, kind (shared/words.h), or NULL where the cloud was not analysed
    void *colors;       // slots x 3 uint8 (sRGB) or float (linear), or NULL
    uint8_t *opacities; // slots, or NULL where every point is opaque
    float *radii;       // slots, object units, or NULL
    float *scalars;     // slots, or NULL
    uint8_t *classes;   // slots, or NULL
    uint64_t class_hash;
    enum pt_color_format color_format;
    uint32_t threads;           // at most, as the caller said; 0: not said
    struct pt_sights sights;    // what its stations saw; empty where nobody asked for free space
    double built;               // the median of the chunks' `built`
    double spacing_base;        // class 0: no spacing; class c: base * 2^((c - 1) / 4)
    struct patina_cloud *parts; // of one that is made of them (parts.h), else NULL and 0
    uint32_t part_count;
    uint32_t first_chunk; // of a part: what of the whole lies before it
    uint64_t first_slot;
    uint64_t first_number; // ..., points
};

// ---- where points are (positions.c) ----------------------------------------------------------------------------------------

// The slot of a chunk's first point, of a cloud in parts too; the chunk is one of the cloud's own table.
uint64_t pt_chunk_slot(const struct patina_cloud *cloud, const struct pt_chunk *chunk);
// Of packed positions: the least power of two whose steps reach over the chunk's box. It is that of the box of what was packed by it,
// too: rounding moves no coordinate from above half the reach to below it.
float pt_chunk_step(const struct pt_chunk *chunk);
static inline uint32_t pt_position_words(const struct patina_cloud *cloud) // of a slot
{
    return cloud->packed ? PT_PACKED_WORDS : PT_POSITION_WORDS;
}
// x, y, z [padded] of a chunk, relative to its origin: where they lie, or in `scratch`, which has room for 3 * padded.
const float *pt_chunk_positions(const struct patina_cloud *cloud, const struct pt_chunk *chunk, float *scratch);
// Point i of a chunk, relative to its origin, and in object units.
void pt_point_offset(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t i, float p[3]);
void pt_point_place(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t i, double p[3]);
// Packs the chunk's points, x, y, z [padded], into 2 * padded words, and rounds its box likewise. Returns how far one is moved at most.
double pt_chunk_pack(struct pt_chunk *chunk, const float *positions, uint32_t *words);

// How many points lie before that in a slot, where the cloud is unordered, of a part's those of the whole; padding is what it repeats.
uint64_t pt_place_of(const struct patina_cloud *cloud, uint64_t slot);
int pt_cloud_count_places(struct patina_cloud *cloud);  // makes `begins`. 0 or PATINA_ERROR_MEMORY
int pt_is_as_it_lies(const struct patina_cloud *cloud); // whether its order says nothing else

// The caller's number of the point in a slot, of a part's too: info.count is the whole's there. That of a damaged file, whose points nobody
// looked through, leads beyond no array.
static inline uint64_t pt_number_of(const struct patina_cloud *cloud, uint64_t slot)
{
    const uint64_t before = cloud->info.count > UINT32_MAX ? cloud->first_number : 0; // of pages, whose order tells no more
    const uint64_t number = cloud->order ? before + cloud->order[slot] : pt_place_of(cloud, slot), last = cloud->info.count - 1;
    return number < last ? number : last;
}

// A cloud without points, whose fields are zero but for what any has; NULL without memory.
struct patina_cloud *pt_cloud_new(void);
enum pt_color_format pt_color_format_of(uint32_t type); // patina_type of a caller's colours

// Points of a chunk that the first `strata` of PT_STRATA strata hold: every 2^(PT_STRATA - strata)-th in Morton order.
uint32_t pt_chunk_prefix(const struct pt_chunk *chunk, uint32_t strata);

// The spacing of a class, as a fraction of spacing_base.
double pt_spacing_of_class(uint32_t index);
uint32_t pt_class_of_spacing(double spacing, double base);
// Sums the chunks' spacings up: the cloud's, and the base of its classes. 0 or PATINA_ERROR_MEMORY.
int pt_cloud_settle_spacing(struct patina_cloud *cloud);
int pt_cloud_settle_built(struct patina_cloud *cloud); // the same, of a cloud that is being built

// The cone of the normals in these surfels.
void pt_chunk_cone(struct pt_chunk *chunk, const uint32_t *surfels);

// Octahedral encoding of any non-zero finite vector: 26 bits, nearest of the four roundings.
uint32_t pt_encode_normal(const double n[3]);
void pt_decode_normal(uint32_t word, double n[3]);

// Local spacing by sampled nearest neighbours among the `count` points x, y, z.
float pt_spacing_estimate(const float *x, const float *y, const float *z, uint32_t count);

size_t pt_color_bytes(const struct patina_cloud *cloud); // of its array
// Replaces the colours, as patina_cloud_set_colors does, but leaves points without one black.
int pt_cloud_set_colors(patina_cloud *cloud, const patina_array *color);

// Scalars and classes: cloud_values.c. Room for them once chunks stand; those of one, whose order stands, beside others; what all come to.
int pt_check_values(patina_array *scalar, patina_array *classes);
int pt_cloud_values_begin(struct patina_cloud *cloud, const patina_cloud_desc *desc);
void pt_cloud_values_of(struct patina_cloud *cloud, const patina_cloud_desc *desc, uint32_t c);
void pt_cloud_values_end(struct patina_cloud *cloud);
size_t pt_scalar_bytes(const struct patina_cloud *cloud);

// cloud_pages.c: what of a cloud lies in a mapped file.
struct pt_section {
    void **data;
    uint64_t size; // bytes
};
void pt_cloud_sections(struct patina_cloud *cloud, struct pt_section sections[PT_ARRAYS]);
uint64_t pt_cloud_mapped_bytes(const struct patina_cloud *cloud);
uint64_t pt_cloud_copied_bytes(const struct patina_cloud *cloud);  // of what its points have, wherever it lies
uint32_t pt_cloud_largest_chunk(const struct patina_cloud *cloud); // slots
uint32_t pt_cloud_array_bytes(const struct patina_cloud *cloud, enum pt_array array); // of a point, where the cloud has it
uint32_t pt_cloud_point_bytes(const struct patina_cloud *cloud, enum pt_array array); // of a point in the file; 0: not mapped
// Size in bytes of an array that the cloud has, as info.bytes counts it: 0 of a mapped file.
static inline uint64_t pt_cloud_own_bytes(const struct patina_cloud *cloud, enum pt_array array, uint64_t size)
{
    return cloud->mapped >> array & 1u ? 0 : size;
}
// No page of the file is held any longer than until it is read again; any thread, whoever reads.
void pt_cloud_return(const struct patina_cloud *cloud);
// Points of these slots are read soon: of arrays, bits 1 << pt_array.
void pt_cloud_expect(const struct patina_cloud *cloud, uint32_t arrays, uint64_t first, uint64_t end);

// cloud_store.c: a file of a cloud that need not be in memory at once. begin: of `cloud` the numbers that sizes follow from count, not its
// arrays; it and `path` last. Then each array in its order, in any pieces, side by side, once the chunks that these points are of stand in
// `cloud`; what fails is told at the end. end: the same cloud. The file takes its place if all went well.
struct pt_cloud_writer;
int pt_cloud_writer_begin(const char *path, const struct patina_cloud *cloud, struct pt_cloud_writer **out);
void pt_cloud_writer_add(struct pt_cloud_writer *writer, enum pt_array array, const void *data, uint64_t size);
int pt_cloud_writer_end(struct pt_cloud_writer *writer, const struct patina_cloud *cloud);
void pt_cloud_writer_drop(struct pt_cloud_writer *writer); // no file

// Of positions, normals, spacings and opacities, whatever order they came in; never 0. Made at the first call, which reads
// them all: only shadows ask. Any thread.
uint64_t pt_cloud_fingerprint(const struct patina_cloud *cloud);
// Which cloud of this process, and in what state: another one where points, normals or spacings may be others since. Reads nothing of them;
// never 0.
uint64_t pt_cloud_stamp(const struct patina_cloud *cloud);

struct pt_alive *pt_alive_create(void); // a handle's own, counted once; NULL without memory
void pt_alive_release(struct pt_alive *alive);
void pt_alive_end(struct pt_alive *alive); // by its handle: devices drop their copies at their next picture. NULL is fine

// Caller's arrays. Checks type (types: bits) and components, and makes the stride explicit; no data is fine.
int pt_check_array(patina_array *array, const char *what, uint32_t types, uint32_t least_components, uint32_t most_components);
// Three components of FLOAT32 or FLOAT64, whose stride is explicit.
static inline void pt_read_vector(const patina_array *array, uint64_t index, double v[3])
{
    const char *at = (const char *)array->data + index * array->stride;
    float f[3];
    if (array->type == PATINA_FLOAT64) {
        memcpy(v, at, 3 * sizeof *v);
        return;
    }
    memcpy(f, at, sizeof f);
    for (int i = 0; i < 3; i++)
        v[i] = (double)f[i];
}

// Building a cloud out of a checked descriptor. FREELY: as many chunks as the points' places ask for. EVENLY: as their number says, so
// that it is known before. part: of a larger cloud, else NULL. Its spacings are settled when all parts are there, so that surfels lack their
// classes, chunks `built`, and opacities stay where all are opaque; nor is it said what values it has. The error is not told yet:
// pt_cloud_tell does it.
enum pt_build_kind { PT_BUILD_FREELY, PT_BUILD_EVENLY };
struct pt_build_part {             // all points are drawn
    double box_min[3], box_max[3]; // of their places, exactly
    patina_array numbers;          // uint32_t, in the whole cloud, which take the place of those in the part
    uint64_t *words, *scratch;     // room for a word of each point
};
int pt_cloud_check_desc(patina_cloud_desc *desc);
void pt_cloud_begin_info(struct patina_cloud *cloud, const patina_cloud_desc *desc);
int pt_cloud_build(const patina_cloud_desc *desc, enum pt_build_kind kind, const struct pt_build_part *part,
                   struct pt_pool *pool, struct patina_progress *progress, struct patina_cloud **out);
int pt_cloud_tell(int error, uint64_t points);
static inline void pt_cloud_position(const patina_cloud_desc *desc, uint64_t index, double p[3]) // object units
{
    pt_read_vector(&desc->position, index, p);
    for (int i = 0; i < 3; i++)
        p[i] += desc->origin[i];
}
int pt_cloud_draws(const patina_cloud_desc *desc, uint64_t index, const double p[3]);

// Sorts (code << 32 | id) words by their upper 30 bits; scratch has room for as many. The result is in words.
int pt_morton_sort(struct pt_pool *pool, uint64_t *words, uint64_t *scratch, uint32_t count);
static inline uint32_t pt_morton_spread(uint32_t v)
{
    v = (v | v << 16) & 0x030000FFu;
    v = (v | v << 8) & 0x0300F00Fu;
    v = (v | v << 4) & 0x030C30C3u;
    return (v | v << 2) & 0x09249249u;
}
// 30-bit Morton code of integer coordinates 0..1023.
static inline uint32_t pt_morton_code(uint32_t x, uint32_t y, uint32_t z)
{
    return pt_morton_spread(x) | pt_morton_spread(y) << 1 | pt_morton_spread(z) << 2;
}

#endif
