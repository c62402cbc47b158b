// SPDX-License-Identifier: GPL-3.0-or-later
// Which points are marked, and where their shadow words lie: slot by slot.
#include "reference.h"
#include "shared/words.h"

int ref_shown(const uint32_t *marks, uint32_t slot)
{
    return marks[2 * (size_t)(slot / PT_MARK_SLOTS)] >> slot % PT_MARK_SLOTS & 1u;
}

uint32_t ref_shown_place(const uint32_t *marks, uint32_t slot)
{
    if (!ref_shown(marks, slot))
        return 0;
    uint32_t place = marks[2 * (size_t)(slot / PT_MARK_SLOTS) + 1];
    for (uint32_t before = slot / PT_MARK_SLOTS * PT_MARK_SLOTS; before < slot; before++)
        place += (uint32_t)ref_shown(marks, before);
    return place;
}
