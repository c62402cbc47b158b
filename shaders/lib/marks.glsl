// SPDX-License-Identifier: GPL-3.0-or-later
// Marks of points that a picture shows, and where their shadow words lie: PT_MARK_SLOTS. Include it behind the block of marks; twin of
// native/shown.h
#ifndef PT_MARKS_GLSL
#define PT_MARKS_GLSL

// And has a place: of chunks that the picture does not draw, for they are damaged, none has.
bool pt_is_shown(uint slot)
{
    uint at = 2u * (slot / PT_MARK_SLOTS);
    return (marks[at] >> slot % PT_MARK_SLOTS & 1u) != 0u && marks[at + 1u] != 0u;
}

// Which of the shown points it is; 0, which is nobody's place: none of them.
uint pt_shown_place(uint slot)
{
    uint at = 2u * (slot / PT_MARK_SLOTS), before = (1u << slot % PT_MARK_SLOTS) - 1u;
    return pt_is_shown(slot) ? marks[at + 1u] + uint(bitCount(marks[at] & before)) : 0u;
}

#endif
