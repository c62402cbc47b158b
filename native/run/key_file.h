// SPDX-License-Identifier: GPL-3.0-or-later
// Keys of a part in a file, and what the merge of a round leaves for the next (SPEC 12). Little-endian:
//   struct pt_keys_head, the note, then records: struct pt_keys_record, and for each of its rows u32 first, u32 count and so many
//   pixels of 8 bytes (keys) or 4 (limits).
#ifndef PT_KEY_FILE_H
#define PT_KEY_FILE_H

#include "base/error.h"

enum { PT_KEYS_VERSION = 2, PT_KEYS_MOST_NOTE = 1 << 20 };

struct pt_keys_head {
    char magic[8];
    uint32_t version, kind; // patina_keys_kind
    char engine[32];
    uint32_t part, of, round, records;
    uint64_t picture; // pt_parts_digest
    uint64_t before;  // of the rounds before: pt_key_files_chain; 0 in the first
    uint64_t note_size, size;
    uint64_t sums;  // of the note and of all records
    uint64_t check; // of all above
};

// Whose keys: a layer of the picture from 1 on, or 0 and a light's map.
struct pt_keys_name {
    uint32_t layer, light, sample, group, face;
};

struct pt_keys_record {
    struct pt_keys_name name;
    uint32_t width, first, rows; // of the plane; the rows from `first` on
    uint64_t size, sum;          // of what follows
};

// ---- writing ---------------------------------------------------------------------------------------------------------

struct pt_key_writer {
    const struct pt_handle *handle; // messages are there
    const char *path;
    struct pt_whole whole;
    struct pt_keys_head head;
    int failed;
};

// head: its kind, part, of, round, picture and before; note: NULL for none.
int pt_key_writer_begin(struct pt_key_writer *writer, const struct pt_handle *handle, const char *path,
                        const struct pt_keys_head *head, const char *note);
// The rows of a plane of u64 keys; what is empty takes no room.
int pt_key_writer_keys(struct pt_key_writer *writer, const struct pt_keys_name *name, const uint64_t *plane, uint32_t width,
                       uint32_t first, uint32_t rows);
// Likewise of floats, all of them.
int pt_key_writer_limits(struct pt_key_writer *writer, const struct pt_keys_name *name, const float *plane, uint32_t width,
                         uint32_t first, uint32_t rows);
// good: the file takes its place. Returns what kept it from doing so, or `error`.
int pt_key_writer_end(struct pt_key_writer *writer, int error);

// ---- reading ---------------------------------------------------------------------------------------------------------

struct pt_key_file {
    const char *path;
    struct pt_disk disk;
    struct pt_keys_head head;
    struct pt_keys_record *records;
    uint64_t *offsets; // of what follows each
    char *note;
};

// Opens it and checks all but its pixels. The path must stay.
int pt_key_file_open(struct pt_key_file *file, const struct pt_handle *handle, const char *path);
void pt_key_file_close(struct pt_key_file *file);
// Puts the least of its keys and the plane's into the plane, whose rows lie from `first` on. A part that has no such record but
// should is an error, and so is a key whose id is not below `ids`.
int pt_key_file_take(const struct pt_key_file *file, const struct pt_handle *handle, const struct pt_keys_name *name,
                     uint64_t ids, uint64_t *plane, uint32_t width, uint32_t first, uint32_t rows);
// Of PATINA_KEYS_NEXT.
int pt_key_file_limits(const struct pt_key_file *file, const struct pt_handle *handle, const struct pt_keys_name *name,
                       float *plane, uint32_t width, uint32_t first, uint32_t rows);

#endif
