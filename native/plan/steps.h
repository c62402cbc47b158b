// SPDX-License-Identifier: GPL-3.0-or-later
// In which order a plan runs: what is cleared, which passes follow, what is repeated and until when. Each step has its reason. A
// step's own steps stand behind it; what they do not know before the frame (how many samples a light has, whether a layer is empty) the
// executor asks by one of the ends below, and by nothing else.
#ifndef PT_PLAN_STEPS_H
#define PT_PLAN_STEPS_H

#include "device.h"

// What a pass binds: a plane at a level, a buffer of an instance or a mesh.
enum pt_ref_of {
    PT_OF_FRAME,   // a plane of the plan's own pixels
    PT_OF_LEFT,    // the same as an earlier plan left it, whatever its size: bound and not read
    PT_OF_PICTURE, // of a light's map: a plane of the picture that it serves
    PT_OF_INSTANCE,
    PT_OF_RECEIVER, // of a light's map: what is tested against it
    PT_OF_MESH,
    PT_OF_FLAG,    // one word: pt_flag
    PT_OF_PLAN,    // what all its passes share: pt_plan_buffer
    PT_OF_NOTHING, // the kernel does not look at it
};

enum pt_flag { PT_FLAG_DIFFERS, PT_FLAG_SOME, PT_FLAG_MARKED, PT_FLAGS }; // see shadow_test, limit, rank

struct pt_ref {
    enum pt_ref_of of;
    uint32_t which; // pt_plane, pt_instance_buffer, pt_mesh_buffer, pt_flag or pt_plan_buffer
    uint32_t index; // level, layer from 0 on, instance, receiver or mesh
};

enum pt_step_of {
    PT_STEP_CLEAR, // a plane holds one word everywhere
    PT_STEP_PASSES,
    PT_STEP_MARK,    // passes, where some shadow texture is not at hand
    PT_STEP_LAYERS,  // a loop whose rounds are listed one by one, for their planes differ
    PT_STEP_LAYER,   // a round of it
    PT_STEP_COVERED, // the tiles that a layer left are read: what lies behind is chosen by them
    PT_STEP_LIGHT,   // a loop over the samples of a light's texture, as far as it is not at hand
    PT_STEP_FACES,   // a loop over the maps of a sample: one, or six where the light sees its casters all around
    PT_STEP_FAINT,   // a loop over layers of casters whose points have opacities of their own
    PT_STEP_MAP,     // a sub-plan: pt_plan_map makes it for the rounds at hand of the loops around it
    PT_STEP_CLOSE,   // a sub-plan, pt_plan_close: what a sample's maps took together goes into the sum
};

// When a loop ends before its last round. Bits.
enum pt_end {
    PT_END_LAYER_EMPTY = 1, // the round before showed nothing, or nothing can lie behind it
    PT_END_SPENT = 2,       // no light is left that could come through
    PT_END_UNCHANGED = 4,   // every point's samples agree
    PT_END_ERROR_MET = 8,   // settings.shadow_error
};

struct pt_step {
    enum pt_step_of of;
    uint32_t inside;       // so many steps behind this one are its own
    uint32_t layer;        // that it belongs to; 0: the whole picture
    uint32_t first, count; // of the plan's passes: PASSES, MARK
    struct pt_ref plane;   // CLEAR
    uint64_t word;         // likewise, of `bytes` bytes
    uint32_t bytes;
    uint32_t light, group; // LIGHT and what is inside
    uint32_t most, ends;   // of loops
    uint32_t when;         // pt_plan_share_planes: its place in time
    uint64_t idle;         // LIGHT, likewise: bits of slabs that its maps may use
    char reason[112];
};

// How deep below the plan a step stands is told by counting; the step behind it and all its own:
static inline const struct pt_step *pt_step_after(const struct pt_step *step) { return step + 1 + step->inside; }

#endif
