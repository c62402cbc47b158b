// SPDX-License-Identifier: GPL-3.0-or-later
// What clips, hidden classes, hidden shapes, masks, fields and hidden scans leave of an instance: chunks that are whole or gone are told from divided ones, in float64.
#ifndef PT_CLIP_H
#define PT_CLIP_H

#include "scene.h"
#include "shared/clips.h"
#include "shared/words.h"

// A clip with its inverse: q = inverse (world - center). Of planes only the last row counts, in world units.
struct pt_inverse_clip {
    const patina_clip *clip;
    uint32_t shape; // PT_CLIP_*
    double inverse[9], center[3];
};

struct pt_sieve {
    const struct pt_instance *instance;
    struct pt_inverse_clip *clips; // those that keep come first
    uint32_t count, keeps;
    int keeping;               // some box keeps, if only a flat one
    int hiding;                // some class that the cloud has is hidden
    uint32_t hidden_shapes[8]; // what pt_hidden_shapes says
    int hiding_shapes;
    const struct patina_mask *mask;   // that hides some of its points, or NULL
    const struct patina_field *field; // that leaves points to the other of both, or NULL
    uint32_t threshold;
    int soft;                             // what is above it stays
    uint32_t hidden_scans[PT_SCAN_WORDS]; // what pt_hidden_scans says
    int hiding_scans;
};

// Which points of an instance: all, or by their fields those that are drawn as points and discs, or those that are soft.
enum pt_points { PT_EVERY_POINT, PT_SOLID_POINTS, PT_SOFT_POINTS };

enum pt_side { PT_CUT_AWAY, PT_DIVIDED, PT_WHOLE };

// How a divided chunk is divided: by which of the sieve's clips, and whether by class, shape, mask, field or scan.
struct pt_division {
    uint32_t count, keeps;
    int by_class, by_shape, by_mask, by_field, by_scan;
};

uint64_t pt_untrusted(const struct pt_instance *instance); // points that it leaves out for their trust
// All points of a cloud in which none has as much trust as the style wants, so that all are drawn; else 0.
uint64_t pt_none_trusted(const struct pt_instance *instance);
// Which of the bytes from PT_SHAPE_SIGHT_SHIFT on of a shape the style hides, as sift_args has them. 0: none, or the cloud
// has no shapes.
int pt_hidden_shapes(const struct pt_instance *instance, uint32_t hidden[8]);
// Whether what stations saw through is to be shown in it.
int pt_is_marked(const struct pt_instance *instance);

// The sieve of an instance. room: for the scene's clips, kept by the sieve. Which of the soft points of a chunk are, kernel gather
// sees for itself: chunks are not divided by that.
struct pt_sieve pt_sieve_make(const struct patina_scene *scene, const struct pt_instance *instance, enum pt_points points,
                              struct pt_inverse_clip *room);
// Whether it takes or divides any chunk at all.
static inline int pt_sieves(const struct pt_sieve *sieve)
{
    return sieve->count || sieve->keeping || sieve->hiding || sieve->hiding_shapes || sieve->mask || sieve->field ||
           sieve->hiding_scans;
}
// Of a page that is on its way, which it leaves or takes.
enum pt_side pt_sieve_page(const struct pt_sieve *sieve, const struct pt_chunk *box);
// Calls back with the corners of what the sieve leaves of a cloud (NULL: of all): of its chunks' boxes, and of pages that are on their way.
void pt_cloud_corners(const struct patina_cloud *cloud, const struct pt_sieve *sieve, const double matrix[16],
                      pt_corner_work *work, void *context);
// chunk: one of the cloud's. entries: room for the sieve's clips; may be NULL, as may division. Written where the chunk is divided.
enum pt_side pt_sieve_chunk(const struct pt_sieve *sieve, const struct pt_chunk *chunk, struct clip_view *entries,
                            struct pt_division *division);

// The clip in a frame: world = linear p + origin.
void pt_clip_in_frame(const struct pt_inverse_clip *clip, const double linear[9], const double origin[3],
                      struct clip_view *out);

#endif
