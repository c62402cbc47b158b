// SPDX-License-Identifier: GPL-3.0-or-later
// A built cloud as a file (DESIGN rule 5): its arrays as they lie in memory, each from a multiple of SECTION bytes on, so
// that opening it maps them and reads nothing but chunks and their order. A cache for this machine's kind: another byte order,
// version or struct is another file, and the caller builds it anew. Of a chunk in a file `first` is its slot in the whole modulo 2^32: what
// has more slots is a cloud in parts (parts.h), and says so nowhere.
#include "shape_word.h"
#include "cloud.h"
#include "fingerprint.h"
#include "clusters.h"
#include "page_sums.h"
#include "paged.h"
#include "parts.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "base/progress.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Files of version 13 have uncolored points that are black. Files of version 12 also have no trust. Files of version 11 are also neither
// packed nor without order, and files of version 10 also have no sums of pages.
enum {
    SECTION = 1 << 16,
    VERSION = 14,
    UNCOLORED = 13,
    UNTRUSTED = 12,
    UNPACKED = 11,
    WITHOUT_PAGES = 10,
    SECTIONS = PT_ARRAYS,
    PIECE = 1 << 22
};
enum { INFO_BYTES = offsetof(patina_cloud_info, packed) }; // of what a cloud tells; the header has the rest
static const char magic[8] = {'p', 'a', 't', 'i', 'n', 'a', '\n', '\x1a'};

struct header {
    char magic[8];
    uint32_t version, chunk_size, color_format, chunk_count;
    uint64_t slots, size; // of the file
    double spacing_base, built;
    uint64_t class_hash;
    uint64_t sight_count, sight_room, sight_bytes; // of stations, and what they saw
    uint64_t beside;                               // the cloud's
    uint64_t info[INFO_BYTES / 8];
    uint64_t sums[SECTIONS]; // of what each section holds, see sum_of
    uint64_t check;          // of all before it, the chunks, and the tail
    uint64_t page_sum;       // the tail: of the sums of pages, which lie behind the last section
    double packed_error;
    uint32_t packed, unordered;
    uint64_t trusts[16]; // points of each level
    uint64_t uncolored;  // points that their neighbors lent a color
};
_Static_assert(INFO_BYTES % 8 == 0 && sizeof(struct header) == offsetof(struct header, page_sum) + 24 + 136,
               "a header has no holes");

static size_t tail_size(const struct header *header)
{
    return header->version == WITHOUT_PAGES ? 0
           : header->version == UNPACKED    ? sizeof header->page_sum
           : header->version == UNTRUSTED   ? offsetof(struct header, trusts) - offsetof(struct header, page_sum)
           : header->version == UNCOLORED   ? offsetof(struct header, uncolored) - offsetof(struct header, page_sum)
                                            : sizeof *header - offsetof(struct header, page_sum);
}

// Behind what its first part sums up to.
static uint64_t add_tail(uint64_t hash, const struct header *header)
{
    const size_t size = tail_size(header);
    return size ? pt_fingerprint(hash, &header->page_sum, size) : hash;
}

static uint64_t check_of(const struct header *header, const struct pt_chunk *chunks)
{
    uint64_t hash = pt_fingerprint(header->version, header, offsetof(struct header, check));
    return add_tail(pt_fingerprint(hash, chunks, header->chunk_count * sizeof *chunks), header);
}

// Piece by piece, so that a file need not be in memory whole to be compared.
static uint64_t add_piece(uint64_t sum, const void *data, size_t size) { return pt_fingerprint(sum, data, size); }

static uint64_t round_section(uint64_t size) { return (size + SECTION - 1) / SECTION * SECTION; }

// Where the sums of pages lie: behind the header and all sections.
static uint64_t pages_at(const struct pt_section sections[SECTIONS])
{
    uint64_t size = SECTION;
    for (int i = 0; i < SECTIONS; i++)
        size += round_section(sections[i].size);
    return size;
}

static uint64_t file_size(const struct pt_section sections[SECTIONS], uint32_t version, uint32_t chunks)
{
    return pages_at(sections) + (version == WITHOUT_PAGES ? 0 : round_section(pt_page_sum_bytes(chunks)));
}

static int fail_with(const char *path, const char *what, int error)
{
    char buffer[128];
    return pt_fail(NULL, PATINA_ERROR_FILE, "%s: cannot be %s: %s", path, what, pt_error_text(error, buffer, sizeof buffer));
}

// ---- save --------------------------------------------------------------------------------------------------------------

// Sections side by side, each piece by piece.
struct pt_cloud_writer {
    struct pt_whole whole;
    const char *path;
    struct header header;
    uint64_t at[SECTIONS], left[SECTIONS]; // where the next piece goes; what is to come
    char *piece[SECTIONS];                 // that fills
    size_t held[SECTIONS];
    const struct patina_cloud *cloud;
    struct pt_page_summing pages;
    uint64_t pages_at;
    int good;
    int error; // of the system, as the thread saw it that found that it is not
};

static void set_bad(struct pt_cloud_writer *writer, int error)
{
    writer->error = writer->good ? error : writer->error;
    writer->good = 0;
}

static void write_piece(struct pt_cloud_writer *writer, int section, const void *data, size_t size)
{
    writer->header.sums[section] = add_piece(writer->header.sums[section], data, size);
    if (pt_stream_seek(writer->whole.stream, writer->at[section]) || fwrite(data, size, 1, writer->whole.stream) != 1)
        set_bad(writer, errno);
    writer->at[section] += size;
}

int pt_cloud_writer_begin(const char *path, const struct patina_cloud *cloud, struct pt_cloud_writer **out)
{
    struct patina_cloud copy = *cloud;
    struct pt_section sections[SECTIONS];
    struct pt_cloud_writer *writer = *out = calloc(1, sizeof *writer);
    if (!writer)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    pt_cloud_sections(&copy, sections);
    uint64_t at = SECTION;
    for (int i = 0; i < SECTIONS; i++) {
        writer->at[i] = at;
        writer->left[i] = sections[i].size;
        writer->header.sums[i] = VERSION;
        at += round_section(sections[i].size);
    }
    writer->good = 1;
    writer->path = path;
    writer->cloud = cloud;
    writer->pages_at = at;
    writer->header.size = file_size(sections, VERSION, cloud->chunk_count);
    int error = pt_page_summing_begin(&writer->pages, cloud->chunk_count) ? ENOMEM : pt_whole_begin(path, &writer->whole);
    if (!error)
        return PATINA_OK;
    pt_page_summing_end(&writer->pages);
    free(writer);
    *out = NULL;
    return fail_with(path, "written", error);
}

void pt_cloud_writer_add(struct pt_cloud_writer *writer, enum pt_array section, const void *data, uint64_t size)
{
    const char *from = data;
    size_t *held = &writer->held[section];
    if (size > writer->left[section])
        set_bad(writer, 0);
    if (writer->good)
        pt_page_summing_add(&writer->pages, writer->cloud, section, data, size);
    for (uint64_t done = 0; done < size && writer->good;) {
        const uint64_t some = size - done < PIECE - *held ? size - done : PIECE - *held;
        const int last = writer->left[section] == some;
        writer->left[section] -= some;
        if (!*held && (some == PIECE || last)) { // as it lies
            write_piece(writer, section, from + done, some);
        } else if (writer->piece[section] || (writer->piece[section] = malloc(PIECE))) {
            memcpy(writer->piece[section] + *held, from + done, some);
            *held += some;
            if (*held == PIECE || last) {
                write_piece(writer, section, writer->piece[section], *held);
                *held = 0;
            }
        } else {
            set_bad(writer, ENOMEM);
        }
        done += some;
    }
}

static void fill_header(struct header *header, const struct patina_cloud *cloud)
{
    memcpy(header->magic, magic, sizeof magic);
    header->version = VERSION;
    header->chunk_size = sizeof(struct pt_chunk);
    header->color_format = cloud->color_format;
    header->chunk_count = cloud->chunk_count;
    header->slots = cloud->slots;
    header->spacing_base = cloud->spacing_base;
    header->built = cloud->built;
    header->class_hash = cloud->class_hash;
    header->beside = cloud->beside != 0;
    header->sight_count = cloud->sights.count;
    header->sight_room = cloud->sights.room;
    header->sight_bytes = cloud->sights.bytes;
    struct patina_cloud copy = *cloud;
    struct pt_section sections[SECTIONS];
    copy.info.struct_size = INFO_BYTES;
    copy.info.bytes = 0; // of the arrays, wherever they lie just now
    pt_cloud_sections(&copy, sections);
    for (int i = 0; i < SECTIONS; i++)
        copy.info.bytes += sections[i].size;
    memcpy(header->info, &copy.info, sizeof header->info);
    header->packed_error = cloud->info.packed_error;
    header->packed = cloud->packed != 0;
    header->unordered = cloud->unordered != 0;
    memcpy(header->trusts, cloud->info.trusts, sizeof header->trusts);
    header->uncolored = cloud->info.uncolored;
    header->check = check_of(header, cloud->chunks);
}

static int write_pages(struct pt_cloud_writer *writer)
{
    const size_t size = pt_page_sum_bytes(writer->cloud->chunk_count);
    writer->header.page_sum = add_piece(VERSION, writer->pages.sums, size);
    return !size || (!pt_stream_seek(writer->whole.stream, writer->pages_at) &&
                     fwrite(writer->pages.sums, size, 1, writer->whole.stream) == 1);
}

int pt_cloud_writer_end(struct pt_cloud_writer *writer, const struct patina_cloud *cloud)
{
    int good = writer->good;
    for (int i = 0; i < SECTIONS; i++) {
        good &= !writer->left[i];
        free(writer->piece[i]);
    }
    good = good && write_pages(writer);
    fill_header(&writer->header, cloud);
    good = good && !pt_stream_seek(writer->whole.stream, 0) &&
           fwrite(&writer->header, sizeof writer->header, 1, writer->whole.stream) == 1 &&
           !pt_stream_resize(writer->whole.stream, writer->header.size);
    if (!writer->good)
        errno = writer->error;
    const int error = pt_whole_end(&writer->whole, good);
    const int code = error ? fail_with(writer->path, "written", error) : PATINA_OK;
    pt_page_summing_end(&writer->pages);
    free(writer);
    return code;
}

void pt_cloud_writer_drop(struct pt_cloud_writer *writer)
{
    for (int i = 0; i < SECTIONS; i++)
        free(writer->piece[i]);
    pt_whole_end(&writer->whole, 0);
    pt_page_summing_end(&writer->pages);
    free(writer);
}

enum { HELD = 1 << 26 }; // bytes of a mapped cloud that are read before their pages are given back

static void look(const struct patina_cloud *cloud, uint64_t *read, uint64_t bytes)
{
    *read += bytes;
    if (*read < HELD || !cloud->mapped)
        return;
    pt_cloud_return(cloud);
    *read = 0;
}

static void add_array(struct pt_cloud_writer *writer, const struct patina_cloud *cloud, enum pt_array array,
                      const struct pt_section *section, uint64_t *read)
{
    for (uint64_t at = 0; at < section->size; at += PIECE) {
        const uint64_t some = section->size - at < PIECE ? section->size - at : PIECE;
        pt_cloud_writer_add(writer, array, (const char *)*section->data + at, some);
        look(cloud, read, some);
    }
}

// Chunk by chunk; the boxes of those of `out` are rounded as their points are.
static void add_packed(struct pt_cloud_writer *writer, const struct patina_cloud *cloud, struct patina_cloud *out,
                       uint32_t *words, uint64_t *read)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        struct pt_chunk *chunk = &out->chunks[c];
        const float *positions = (const float *)cloud->positions + 3 * pt_chunk_slot(cloud, &cloud->chunks[c]);
        const double moved = pt_chunk_pack(chunk, positions, words);
        out->info.packed_error = moved > out->info.packed_error ? moved : out->info.packed_error;
        pt_cloud_writer_add(writer, PT_ARRAY_POSITIONS, words, (uint64_t)chunk->padded * 4 * PT_PACKED_WORDS);
        look(cloud, read, (uint64_t)chunk->padded * 4 * PT_POSITION_WORDS);
        for (int k = 0; k < 3; k++) {
            const double low = chunk->origin[k] + (double)chunk->box_min[k],
                         high = chunk->origin[k] + (double)chunk->box_max[k];
            out->info.box_min[k] = c && out->info.box_min[k] < low ? out->info.box_min[k] : low;
            out->info.box_max[k] = c && out->info.box_max[k] > high ? out->info.box_max[k] : high;
        }
    }
}

// out: what is written: the cloud, or of it what is said otherwise, with chunks of its own where it is packed now or in parts.
static int save(const patina_cloud *cloud, const char *path, struct patina_cloud *out)
{
    const int packs = out->packed && !cloud->packed;
    struct patina_cloud copy = *out;
    struct pt_section sections[SECTIONS];
    struct pt_cloud_writer *writer;
    uint32_t *words = packs ? malloc((size_t)pt_cloud_largest_chunk(cloud) * 4 * PT_PACKED_WORDS + 1) : NULL;
    uint64_t read = 0;
    if (packs && !words)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    pt_cloud_sections(&copy, sections);
    const int error = pt_cloud_writer_begin(path, out, &writer);
    for (int i = PT_ARRAY_POSITIONS; i < SECTIONS && !error; i++)
        if (packs && i == PT_ARRAY_POSITIONS)
            add_packed(writer, cloud, out, words, &read);
        else
            add_array(writer, cloud, (enum pt_array)i, &sections[i], &read);
    free(words);
    if (error)
        return error;
    if (!isfinite(out->info.packed_error)) {
        pt_cloud_writer_drop(writer);
        return pt_fail(&cloud->handle, PATINA_ERROR_ARGUMENT, "%s: points lie too far apart to be packed", path);
    }
    const int lost = pt_pages_fail_lost(cloud);
    if (lost) {
        pt_cloud_writer_drop(writer);
        return lost;
    }
    pt_cloud_writer_add(writer, PT_ARRAY_CHUNKS, out->chunks, sections[PT_ARRAY_CHUNKS].size);
    return pt_cloud_writer_end(writer, out);
}

static int save_chunks(const patina_cloud *cloud, const char *path, struct patina_cloud *out)
{
    const size_t size = cloud->chunk_count * sizeof *cloud->chunks;
    struct pt_chunk *chunks = malloc(size + 1);
    if (!chunks)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    if (size)
        memcpy(chunks, cloud->chunks, size);
    uint64_t slot = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; slot += chunks[c++].padded)
        chunks[c].first = (uint32_t)slot; // in the whole
    out->chunks = chunks;
    const int error = save(cloud, path, out);
    free(chunks);
    if (!error && out->packed && !cloud->packed)
        pt_log(PT_LOG_INFO, "%s: packing moved positions by %.3g at most", path, out->info.packed_error);
    return error;
}

static int save_as(const patina_cloud *cloud, const char *path, const patina_save_desc *desc)
{
    struct patina_cloud out = *cloud;
    if (desc->drop_order || (desc->pack && pt_is_as_it_lies(cloud)))
        out.unordered = 1;
    if (desc->drop_order)
        out.info.count = out.info.drawn;
    out.packed = desc->pack || cloud->packed;
    return out.packed != cloud->packed || cloud->part_count ? save_chunks(cloud, path, &out) : save(cloud, path, &out);
}

int patina_cloud_save_as(const patina_cloud *cloud, const char *path, const patina_save_desc *given)
{
    patina_save_desc desc;
    if (!cloud || !path)
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_save: bad arguments");
    int error = pt_take(NULL, "patina_cloud_save_as", given, &desc, sizeof desc);
    if (!error && (desc.pack > 1 || desc.drop_order > 1))
        error = pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_save_as: pack and drop_order are 0 or 1");
    if (!error)
        error = pt_paged_refuse(cloud, "patina_cloud_save");
    if (!error)
        error = pt_pages_refuse(cloud, pt_free_memory() / 3, NULL);
    if (error)
        return error;
    pt_paged_enter(cloud, 1);
    error = pt_paged_whole(cloud)
                ? save_as(cloud, path, &desc) // what was full gave pages back, or somebody draws what was there
                : pt_fail(&cloud->handle, PATINA_ERROR_UNSUPPORTED, "patina_cloud_save: points of the cloud are not all there");
    pt_paged_leave(cloud);
    return error;
}

int patina_cloud_save(const patina_cloud *cloud, const char *path) { return patina_cloud_save_as(cloud, path, NULL); }

// ---- open --------------------------------------------------------------------------------------------------------------

static int refuse(const char *path, const char *what) { return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: %s", path, what); }

// What is trusted: chunks within the slots. Points are not looked through: whoever reads them takes any (pt_number_of).
static int check_cloud(const char *path, const struct patina_cloud *cloud)
{
    uint64_t next = 0, drawn = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        double sum = (double)chunk->spacing + (double)chunk->reach + (double)chunk->footprint + (double)chunk->built +
                     (double)chunk->gap;
        for (int k = 0; k < 3; k++)
            sum += chunk->origin[k] + (double)chunk->box_min[k] + (double)chunk->box_max[k] + (double)chunk->cone_axis[k];
        if (chunk->first != (uint32_t)next || !chunk->count || chunk->count > chunk->padded || chunk->padded % PT_CHUNK_ALIGN ||
            chunk->padded > PT_CHUNK_POINTS || chunk->padded > cloud->slots - next || !isfinite(sum) ||
            !isfinite(chunk->cone_cosine))
            return refuse(path, "a chunk is damaged");
        next += chunk->padded;
        drawn += chunk->count;
    }
    if (next != cloud->slots || drawn != cloud->info.drawn)
        return refuse(path, "its chunks do not hold its points");
    return pt_sights_good(&cloud->sights) ? PATINA_OK : refuse(path, "what its stations saw is damaged");
}

static int check_version(const char *path, const struct header *header, const patina_cloud_info *info, uint64_t size)
{
    if (memcmp(header->magic, magic, sizeof magic))
        return refuse(path, "not a saved cloud");
    if ((header->version != VERSION && header->version != UNCOLORED && header->version != UNTRUSTED &&
         header->version != UNPACKED && header->version != WITHOUT_PAGES) ||
        header->chunk_size != sizeof(struct pt_chunk) || info->struct_size != INFO_BYTES)
        return refuse(path, "a saved cloud of another version");
    return header->size == size ? PATINA_OK : refuse(path, "a saved cloud that was cut short");
}

enum { COUNT_BITS = 48 }; // of points: sizes in bytes are far from 2^64 then

static int check_header(const char *path, const struct header *header, const patina_cloud_info *info)
{
    if (header->color_format > PT_COLOR_FLOAT || info->count >> COUNT_BITS || info->chunks != header->chunk_count ||
        header->slots > 2 * info->count + 16ull * header->chunk_count || header->chunk_count > info->count ||
        info->drawn > info->count || info->has_colors != (header->color_format != PT_COLOR_NONE) || info->has_opacities > 1 ||
        info->has_normals > 1 || info->has_radii > 1 || !isfinite(info->radius_most) ||
        header->sight_count > header->sight_room || header->sight_room > 1u << 16 ||
        header->sight_bytes > 2u * PT_SIGHT_BYTES || info->has_scalars > 1 || info->has_shapes > 1 || info->has_classes > 1 ||
        (info->count > UINT32_MAX && (!header->unordered || info->count != info->drawn)) || // an order has 32 bits
        !isfinite(header->spacing_base) || header->packed > 1 || header->unordered > 1 || !isfinite(header->packed_error))
        return refuse(path, "its header is damaged");
    return PATINA_OK;
}

static int map_sections(const struct pt_disk *disk, const struct pt_section sections[SECTIONS])
{
    uint64_t at = SECTION;
    for (int i = 0; i < SECTIONS; i++) {
        int error = sections[i].size ? pt_disk_map(disk, at, sections[i].size, PT_DISK_ANYWHERE, sections[i].data) : 0;
        if (error)
            return error;
        at += round_section(sections[i].size);
    }
    return 0;
}

// The header, and what it says of the sections; cloud: its fields that the header holds are set.
static int read_header(const char *path, const struct pt_disk *disk, struct patina_cloud *cloud, struct header *header,
                       struct pt_section sections[SECTIONS])
{
    size_t got;
    if (pt_disk_read(disk, 0, header, sizeof *header, &got) || got != sizeof *header)
        return refuse(path, "not a saved cloud");
    if (header->version == UNPACKED || header->version == WITHOUT_PAGES) { // it has none of these
        header->packed = header->unordered = 0;
        header->packed_error = 0.0;
    }
    memcpy(&cloud->info, header->info, sizeof header->info);
    int code = check_version(path, header, &cloud->info, disk->size);
    code = code ? code : check_header(path, header, &cloud->info);
    if (code)
        return code;
    cloud->info.struct_size = sizeof cloud->info;
    cloud->info.packed = header->packed;
    cloud->info.packed_error = header->packed_error;
    cloud->info.numbered = header->unordered;
    if (header->version == VERSION) {
        memcpy(cloud->info.trusts, header->trusts, sizeof header->trusts);
        cloud->info.uncolored = header->uncolored;
    }
    cloud->packed = header->packed != 0;
    cloud->unordered = header->unordered != 0;
    cloud->slots = header->slots;
    cloud->chunk_count = header->chunk_count;
    cloud->color_format = header->color_format;
    cloud->spacing_base = header->spacing_base;
    cloud->built = header->built;
    cloud->class_hash = header->class_hash;
    cloud->sights = (struct pt_sights){
        .count = (uint32_t)header->sight_count, .room = (uint32_t)header->sight_room, .bytes = header->sight_bytes};
    pt_cloud_sections(cloud, sections);
    return file_size(sections, header->version, header->chunk_count) == header->size ? PATINA_OK
                                                                                     : refuse(path, "its header is damaged");
}

// The sums of pages: what they say is believed if they are those that were written, as the header knows.
static int read_pages(const char *path, const struct pt_disk *disk, const struct header *header, uint64_t at,
                      struct patina_cloud *cloud)
{
    const size_t size = pt_page_sum_bytes(cloud->chunk_count);
    size_t got;
    if (!size)
        return PATINA_OK;
    uint32_t *sums = header->version == WITHOUT_PAGES ? NULL : malloc(size);
    if (!sums && header->version != WITHOUT_PAGES)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    if (sums && (pt_disk_read(disk, at, sums, size, &got) || got != size ||
                 add_piece(header->version, sums, size) != header->page_sum)) {
        free(sums);
        return refuse(path, "the check sums of its pages are damaged");
    }
    cloud->page_sums = pt_page_sums_create(cloud, sums, path);
    return cloud->page_sums ? PATINA_OK : pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
}

// Copies the table of stations out of the file, before it is checked: it says where words lie. 0 or PATINA_ERROR_MEMORY.
static int own_sights(struct pt_sights *sights)
{
    struct pt_sight *own = sights->room ? pt_pages_alloc(sights->room * sizeof *own) : NULL;
    if (!own)
        return sights->room ? PATINA_ERROR_MEMORY : PATINA_OK;
    memcpy(own, sights->each, sights->room * sizeof *own);
    pt_pages_free(sights->each, sights->room * sizeof *own);
    sights->each = own;
    return PATINA_OK;
}

// All of a cloud but its points, which lie relative to their chunks.
static void move_by(struct patina_cloud *cloud, const double offset[3])
{
    struct pt_sights *sights = &cloud->sights;
    for (int k = 0; k < 3; k++) {
        cloud->info.origin[k] += offset[k];
        cloud->info.box_min[k] += offset[k];
        cloud->info.box_max[k] += offset[k];
        for (uint32_t c = 0; c < cloud->chunk_count; c++)
            cloud->chunks[c].origin[k] += offset[k];
        for (uint32_t i = 0; i < sights->count; i++)
            sights->each[i].place[k] += offset[k];
    }
}

// Removes the analysis of an older version, which has no trust or leaves points without a color black. The caller analyzes the cloud again.
static void forget_analysis(const char *path, struct patina_cloud *cloud, const struct pt_section *shapes)
{
    pt_log(PT_LOG_WARNING, "%s: saved by an older version. The points are analyzed again, for their trust and colors.", path);
    pt_pages_free(cloud->shapes, shapes->size);
    cloud->shapes = NULL;
    cloud->mapped &= ~(1u << PT_ARRAY_SHAPES);
    cloud->info.has_shapes = 0;
    cloud->info.seen_through = 0;
    memset(cloud->info.kinds, 0, sizeof cloud->info.kinds);
    if (cloud->info.estimated_normals == cloud->info.drawn) // none of them was given
        cloud->info.has_normals = cloud->info.normals_oriented = 0;
    cloud->info.estimated_normals = 0;
}

static int open_disk(const char *path, const struct pt_disk *disk, const double *offset, struct patina_cloud *cloud)
{
    struct header header;
    struct pt_section sections[SECTIONS];
    int code = read_header(path, disk, cloud, &header, sections);
    if (code)
        return code;
    int error = map_sections(disk, sections);
    if (error) {
        pt_pages_free(cloud->chunks, sections[0].size);
        cloud->chunks = NULL;
        return fail_with(path, "mapped", error);
    }
    struct pt_chunk *chunks = malloc(sections[0].size + 1); // the one array that is not freed as pages
    if (cloud->chunks && chunks)
        memcpy(chunks, cloud->chunks, sections[0].size);
    pt_pages_free(cloud->chunks, sections[0].size);
    cloud->chunks = chunks;
    if (!chunks)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    if (check_of(&header, chunks) != header.check)
        return refuse(path, "its header or chunks are damaged");
    cloud->info.bytes = sections[0].size;
    for (int i = PT_ARRAY_POSITIONS; i < PT_ARRAY_SIGHTS; i++)
        cloud->mapped |= (uint32_t)(sections[i].size > 0) << i;
    cloud->beside = header.beside != 0;
    if (own_sights(&cloud->sights))
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    if (header.version != VERSION && cloud->info.has_shapes)
        forget_analysis(path, cloud, &sections[PT_ARRAY_SHAPES]);
    code = check_cloud(path, cloud);
    code = code ? code : read_pages(path, disk, &header, pages_at(sections), cloud);
    if (code)
        return code;
    if (offset)
        move_by(cloud, offset);
    pt_clusters_make(cloud);
    error = pt_parts_make(cloud, pt_part_slots());
    if (!error && cloud->unordered && !cloud->part_count)
        error = pt_cloud_count_places(cloud);
    return error ? pt_fail(NULL, error, "%s: out of memory", path) : PATINA_OK;
}

// ---- verify ------------------------------------------------------------------------------------------------------------

struct verified {
    const char *path;
    const struct pt_disk *disk;
    char *buffer; // of PIECE bytes
    patina_progress *progress;
};

// The sum of a section of the file, from byte `at` on: *pieces, of one piece after another, or *whole, of all at one go; NULL: not asked for.
static int sum_section(const struct verified *v, uint64_t at, uint64_t size, uint64_t *pieces, struct pt_sum *whole)
{
    for (uint64_t done = 0; done < size;) {
        const size_t piece = size - done < PIECE ? size - done : PIECE;
        size_t got;
        int error = pt_disk_read(v->disk, at + done, v->buffer, piece, &got);
        if (error)
            return fail_with(v->path, "read", error);
        if (got != piece)
            return refuse(v->path, "a saved cloud that was cut short");
        if (pt_progress_cancelled(v->progress))
            return pt_fail(NULL, PATINA_ERROR_CANCELLED, "%s: cancelled", v->path);
        if (pieces)
            *pieces = add_piece(*pieces, v->buffer, piece);
        if (whole)
            pt_sum_add(whole, v->buffer, piece);
        done += piece;
    }
    return PATINA_OK;
}

// What the header says of itself, chunks and the sums of pages; head: of the header and chunks.
static int verify_head(const struct verified *v, const struct header *header, const struct pt_sum *head, uint64_t at)
{
    if (add_tail(pt_sum_end(head), header) != header->check)
        return refuse(v->path, "its header or chunks are damaged");
    if (header->version == WITHOUT_PAGES || !header->chunk_count)
        return PATINA_OK;
    struct pt_sum pages;
    pt_sum_begin(&pages, header->version);
    const int code = sum_section(v, at, pt_page_sum_bytes(header->chunk_count), NULL, &pages);
    return code                                     ? code
           : pt_sum_end(&pages) != header->page_sum ? refuse(v->path, "the check sums of its pages are damaged")
                                                    : PATINA_OK;
}

// Whether all of the file still has the sums that it was written with.
static int verify_disk(const struct verified *v)
{
    struct header header;
    struct pt_section sections[SECTIONS];
    struct patina_cloud cloud = {0};
    struct pt_sum head;
    int code = read_header(v->path, v->disk, &cloud, &header, sections);
    uint64_t at = SECTION;
    if (!code)
        pt_sum_begin(&head, pt_fingerprint(header.version, &header, offsetof(struct header, check)));
    for (int i = 0; i < SECTIONS && !code; i++) {
        uint64_t sum = header.version;
        code = sum_section(v, at, sections[i].size, &sum, i == PT_ARRAY_CHUNKS ? &head : NULL);
        if (!code && sum != header.sums[i])
            code = refuse(v->path, "a saved cloud whose points are damaged");
        at += round_section(sections[i].size);
        pt_progress_set(v->progress, (double)at / (double)header.size);
    }
    return code ? code : verify_head(v, &header, &head, at);
}

int patina_cloud_verify(const char *path, patina_progress *progress)
{
    if (!path)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_verify: path is NULL");
    struct pt_disk disk;
    int error = pt_disk_open(path, &disk);
    if (error)
        return fail_with(path, "read", error);
    char *buffer = malloc(PIECE);
    const struct verified v = {path, &disk, buffer, progress};
    int code = buffer ? verify_disk(&v) : pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    free(buffer);
    pt_disk_close(&disk);
    return code;
}

// ---- open, all of it ---------------------------------------------------------------------------------------------------

static int open_cloud(const char *path, const double *offset, patina_cloud **out)
{
    *out = NULL;
    struct pt_disk disk;
    int error = pt_disk_open(path, &disk);
    if (error)
        return fail_with(path, "read", error);
    struct patina_cloud *cloud = pt_cloud_new();
    const int code = cloud ? open_disk(path, &disk, offset, cloud)
                           : pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    pt_disk_close(&disk);
    if (code)
        patina_cloud_destroy(cloud);
    else
        *out = cloud;
    return code;
}

int patina_cloud_open(const char *path, patina_cloud **out)
{
    if (!path || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_open: bad arguments");
    return open_cloud(path, NULL, out);
}

#define FARTHEST_OFFSET 1e30

int patina_cloud_open_at(const char *path, const double *offset, patina_cloud **out)
{
    if (!path || !out || !offset)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_open_at: bad arguments");
    int some = 0;
    for (int k = 0; k < 3; k++) {
        if (!(fabs(offset[k]) <= FARTHEST_OFFSET))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_open_at: the offset along %c is %g, and 1e30 is the most",
                           "xyz"[k], offset[k]);
        some |= offset[k] != 0.0;
    }
    return open_cloud(path, some ? offset : NULL, out);
}
