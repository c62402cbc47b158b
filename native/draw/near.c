// SPDX-License-Identifier: GPL-3.0-or-later
// The tree is the order of the places alone: the middle of each range divides it along x, the ranges below along y, and so on.
#include "near.h"

#include "patina/patina.h"

#include <stdlib.h>

enum { LEAF = 8 };

static const double *place_of(const struct pt_near *tree, uint32_t i)
{
    return (const double *)(const void *)(tree->data + (size_t)tree->order[i] * tree->stride);
}

static void swap(struct pt_near *tree, uint32_t i, uint32_t j)
{
    const uint32_t kept = tree->order[i];
    tree->order[i] = tree->order[j];
    tree->order[j] = kept;
}

// Hoare's selection: the middle of [first, end) along an axis goes to its place, lesser ones before it.
static void divide(struct pt_near *tree, uint32_t first, uint32_t end, int axis)
{
    const uint32_t middle = first + (end - first) / 2;
    int64_t low = first, high = (int64_t)end - 1;
    while (low < high) {
        const double pivot = place_of(tree, (uint32_t)((low + high) / 2))[axis];
        int64_t i = low, j = high;
        while (i <= j) {
            while (place_of(tree, (uint32_t)i)[axis] < pivot)
                i++;
            while (place_of(tree, (uint32_t)j)[axis] > pivot)
                j--;
            if (i <= j)
                swap(tree, (uint32_t)i++, (uint32_t)j--);
        }
        if (j < (int64_t)middle)
            low = i;
        if (i > (int64_t)middle)
            high = j;
    }
}

static void build(struct pt_near *tree, uint32_t first, uint32_t end, int axis)
{
    while (end - first > LEAF) {
        const uint32_t middle = first + (end - first) / 2;
        divide(tree, first, end, axis);
        axis = !axis;
        build(tree, first, middle, axis);
        first = middle + 1;
    }
}

int pt_near_create(struct pt_near *tree, const void *data, size_t stride, uint32_t count)
{
    *tree = (struct pt_near){.data = data, .stride = stride, .count = count, .order = malloc((count + 1) * sizeof(uint32_t))};
    if (!tree->order)
        return PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < count; i++)
        tree->order[i] = i;
    build(tree, 0, count, 0);
    return PATINA_OK;
}

void pt_near_destroy(struct pt_near *tree)
{
    free(tree->order);
    tree->order = NULL;
}

struct looking {
    const struct pt_near *tree;
    double place[2], radius;
    uint32_t *found, room, count;
};

static void look_at(struct looking *l, uint32_t i)
{
    const double *p = place_of(l->tree, i), x = p[0] - l->place[0], y = p[1] - l->place[1];
    if (x * x + y * y > l->radius * l->radius)
        return;
    if (l->count < l->room)
        l->found[l->count] = l->tree->order[i];
    l->count++;
}

static void look(struct looking *l, uint32_t first, uint32_t end, int axis)
{
    while (end - first > LEAF) {
        const uint32_t middle = first + (end - first) / 2;
        const double beyond = l->place[axis] - place_of(l->tree, middle)[axis];
        const int lesser = beyond <= l->radius, greater = beyond >= -l->radius;
        if (lesser && greater)
            look_at(l, middle);
        axis = !axis;
        if (lesser && greater)
            look(l, first, middle, axis);
        else if (lesser)
            end = middle;
        if (greater)
            first = middle + 1;
        else if (!lesser)
            return;
    }
    for (uint32_t i = first; i < end; i++)
        look_at(l, i);
}

uint32_t pt_near_find(const struct pt_near *tree, const double place[2], double radius, uint32_t *found, uint32_t room)
{
    struct looking l = {.tree = tree, .place = {place[0], place[1]}, .radius = radius, .found = found, .room = room};
    look(&l, 0, tree->count, 0);
    return l.count;
}
