// SPDX-License-Identifier: GPL-3.0-or-later
// Which places on a plane are near a place: a balanced tree of two dimensions.
#ifndef PT_DRAW_NEAR_H
#define PT_DRAW_NEAR_H

#include <stddef.h>
#include <stdint.h>

struct pt_near {
    const char *data; // two doubles at data + i * stride; not copied
    size_t stride;
    uint32_t *order; // of the tree
    uint32_t count;
};

// 0 or PATINA_ERROR_MEMORY.
int pt_near_create(struct pt_near *tree, const void *data, size_t stride, uint32_t count);
void pt_near_destroy(struct pt_near *tree);
// Writes the numbers of at most `room` places within the radius, in the tree's order. Returns how many there are; any thread.
uint32_t pt_near_find(const struct pt_near *tree, const double place[2], double radius, uint32_t *found, uint32_t room);

#endif
