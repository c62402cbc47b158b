// SPDX-License-Identifier: GPL-3.0-or-later
// What somebody did with single points of a cloud: which are hidden and which selected (mask.c), other colours by scan (grade.c), and which are soft (field.c).
// All belong to instances, not to the cloud: several may show one cloud. Of a cloud in parts (parts.h) masks and grades have one for each, whose
// words, chunks and colours begin in theirs: pt_mask_part.
#ifndef PT_MASK_H
#define PT_MASK_H

#include "scene.h"
#include "shared/words.h"

enum pt_masked { PT_MASKED_NONE, PT_MASKED_SOME, PT_MASKED_ALL }; // of a chunk's points: hidden

struct patina_mask {
    struct pt_handle handle;
    struct pt_alive *alive; // its own, shared with the devices that hold its words
    struct pt_alive *of;    // the cloud's
    uint64_t word_count;    // of PT_SLOTS_A_WORD slots each
    uint32_t *words;        // in chunk order: bit i: slot i is hidden, bit 16 + i: it is selected. Padding as what it repeats
    uint8_t *chunks;        // pt_masked of each
    int hides;              // some point is hidden
    uint64_t hash;          // of what is hidden
    struct patina_mask *parts; // one for each of the cloud's, with a life of its own; NULL where it is not in parts
    uint32_t part_count;
};

struct patina_grade {
    struct pt_handle handle;
    struct pt_alive *alive, *of; // as a mask's
    size_t size;
    void *colors;               // in chunk order, in the cloud's own format
    struct patina_grade *parts; // as a mask's
    uint32_t part_count;
    int keeps_black; // uncolored points are black, whatever color their neighbors lent them
};

enum { PT_FIELD_BINS = 256 }; // of a histogram

struct patina_field {
    struct pt_handle handle;
    struct pt_alive *alive, *of; // as a mask's
    uint64_t slots;
    uint16_t *steps;       // in chunk order, of PT_FIELD_MOST; padding as what it repeats
    uint16_t (*chunks)[2]; // least and greatest of each
    uint64_t hash;         // of the steps
    double range[2];       // numbers that are 0 and 1
    float radii[2];        // the least and the greatest of the points' own above 0; 0 and 0: there are none
    _Atomic uint64_t histogram[PT_FIELD_BINS];
};

// t of points that are solid up to it, in steps of a field.
static inline uint32_t pt_field_steps(float value) { return (uint32_t)((double)value * (double)PT_FIELD_MOST + 0.5); }

// The instance's mask where it hides something, else NULL.
static inline const struct patina_mask *pt_mask_of(const struct pt_instance *instance)
{
    const struct patina_mask *mask = instance->style.mask;
    return mask && mask->hides ? mask : NULL;
}

// What part i of the cloud is drawn with; NULL of none.
static inline const struct patina_mask *pt_mask_part(const struct patina_mask *mask, uint32_t i)
{
    return mask && mask->parts ? &mask->parts[i] : mask;
}
static inline const struct patina_grade *pt_grade_part(const struct patina_grade *grade, uint32_t i)
{
    return grade && grade->parts ? &grade->parts[i] : grade;
}

// The cloud's, counted once more.
struct pt_alive *pt_alive_share(const struct patina_cloud *cloud);

#endif
