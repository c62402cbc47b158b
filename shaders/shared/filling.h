// SPDX-License-Identifier: GPL-3.0-or-later
// Stage filling: what is open is closed, and what was looked through is opened again.
#ifndef PT_SHARED_FILLING_H
#define PT_SHARED_FILLING_H

#include "shared/view.h"
#include "shared/words.h"

#define PT_FILL_BACKGROUND 1 // phases of filling; without u, which strict preprocessors refuse in #if
#define PT_FILL_OCCLUDED 2

// pull: 2 x 2 -> 1, the least key (what a scatter at half the resolution gives).
struct pull_args {
    struct view_args view; // of the coarse level
    uint32_t fine_width, fine_height;
};

// push: pixels that are empty or occluded take the key of their coarse parent, unless the parent's surface is dense at this
// level: its spacing is below 1.2 pixels, so that what shows beside it is a groove or an edge and not a hole between points.
struct push_args {
    struct view_args view; // of the fine level
    uint32_t coarse_width, coarse_height;
    uint32_t refined;
    float least; // no layer distance in view is below this
    float least_share; // nor below this share of a pixel's footprint
    uint32_t background; // 1: empty pixels alone
    uint32_t from_width; // of the planes at level 0
};

#define PT_FILL_SLACK 0.75f // pixels of the level: a neighbour is reached whatever its spacing

// fill: hole filling. [D 3.2, 3.3], SPEC 2.2. With `reach`, a pixel takes the least key among those neighbours whose surfaces
// reach it, in the occluded phase of those that hide it; where none does it stays as it is. A surface reaches as far as
// reach d_eff max(|n.v|, C) / footprint pixels of level 0, off the middle of a perspective view max(|ray.x|, |ray.y|, 1) times as
// far, and PT_FILL_SLACK pixels of this level from where it was measured.
// With `alone`, a covered pixel with nothing in its ring, of a surface that is dense at this level (as in push), is a stray: in the
// background phase it is as white as an empty one. Fills go by what their step finds, so that holes around a lone point close;
// un-fills by the state before the phase.
struct fill_args {
    struct view_args view;
    uint32_t phases;     // PT_FILL_*, in their order
    uint32_t iterations; // fills
    uint32_t unfills;    // at most so many un-fills; 0 = as in the paper
    uint32_t refined;    // 1: depth of the source's tangent plane
    float least;         // no layer distance in view is below this
    float least_share;   // nor below this share of a pixel's footprint
    float reach, disc_reach; // of points, and of discs beyond themselves; reach 0: as far as may be
    uint32_t discs_first;    // ids from here on are discs'
    uint32_t from_width;     // of the planes at level 0
    uint32_t alone;          // 1: strays close nothing
};

// Pixels from its measured point, beyond which a pixel counts as closed. Four virtual scans, two cameras each: at 1.5 a third more of
// false surface goes, and twice as much of the true one.
#define PT_REOPEN_AWAY 4.0f
#define PT_REOPEN_FIND 0u  // phases of reopen
#define PT_REOPEN_KEEP 1u
#define PT_REOPEN_TAKE 2u
#define PT_REOPEN_SHOW 3u

// reopen: pixels that were closed, and not measured, where a station of the instance looked through the place that they show. SPEC 11
//   1. Closed: a disc whose point fell farther off than PT_REOPEN_AWAY, or filled from a pixel that lies, and whose own disc's point
//      fell, so far off together.
//   2. The place, seen from a station in its object: q = eye + z ((m.x u + m.y v) - m.z), rows m; orthographic: the first product
//      by itself, and m.z (z + near). On the face of the axis where |q| is greatest, x before y before z, the other two over it, in
//      the order of the axes from there on, are bent (PT_SIGHT_BEND); the cell there says how far the station looked.
//   3. Looked through: q^2 grow < range^2.
//   FIND: limit = z + deff[from] there, -1 elsewhere (`first`: written for all); with `last` all keys become empty: what lies
//         behind is drawn next.
//   KEEP: kept = keys, before filling.
//   TAKE: they become what was kept, empty where that is looked through as well, or was no other.
//   SHOW: their colours become magenta.
struct reopen_args {
    struct view_args view;
    uint32_t id_base, id_first, id_count; // pixels of this instance: as in instance_args
    uint32_t phase;             // PT_REOPEN_*
    uint32_t first, last;
    uint32_t discs;             // 1: the away plane holds
    uint32_t stations;          // so many struct station_args stand behind these
    float rows[9];              // view space -> object, without translation
    float eye_z;                // orthographic: near
};

struct station_args {
    float eye[3];    // of the camera, from the station, in the instance's object
    float grow;      // (1 + share of the range by which what was seen lies farther)^2
    uint32_t first;  // of its cells: in the lower half of words[first / 2] where it is even
    uint32_t across; // cells along an edge of a face; 6 x across x across of them: +x, -x, +y, -y, +z, -z
    uint32_t base;   // cell << PT_SIGHT_SHIFT, and this added: bits of a range; a cell of 0: nothing is known
};

#endif
