// SPDX-License-Identifier: GPL-3.0-or-later
// The scans that a cloud was made of, for range images: which one each point is of, and how it was taken.
#ifndef PT_SCANS_H
#define PT_SCANS_H

#include "scene.h"
#include "shared/words.h"

struct patina_scans {
    struct pt_handle handle;
    struct pt_alive *alive, *of; // as a mask's
    uint64_t slots;
    uint16_t *scan;        // in chunk order; padding as what it repeats
    uint16_t (*chunks)[2]; // least and greatest of each
    patina_scan *scans;    // directions unit, or 0
    uint32_t count;
    uint16_t greatest; // of those that points are of
    double interval;   // the greatest that is known of those with points; 0: none is
};

// Scans of an instance of range images whose direction is at too great an angle to that of the view, to the middle of its box, as
// sift_args has them. 0: none is, or all are drawn.
int pt_hidden_scans(const struct patina_scene *scene, const struct pt_instance *instance, uint32_t hidden[PT_SCAN_WORDS]);

// What a style says of range images. PATINA_OK, or an error with its message at the scene.
int pt_check_ranges(const struct patina_scene *scene, const patina_cloud_style *style, const struct patina_cloud *cloud);

#endif
