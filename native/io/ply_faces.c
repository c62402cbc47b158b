// SPDX-License-Identifier: GPL-3.0-or-later
// What lists of points mean: faces, which give normals to a PLY file that has no others, and the cells of a scanner's grid.
#include "ply.h"
#include "base/elementary.h"
#include "base/vector.h"

#include <math.h>
#include <string.h>

int64_t ply_find_corners(const struct ply_header *header, const struct ply_element *element)
{
    static const char *const names[] = {"vertex_indices", "vertex_index", "vertex_indexes"};
    for (size_t n = 0; n < sizeof names / sizeof *names; n++)
        for (uint32_t k = 0; k < element->properties; k++) {
            const struct ply_property *property = &header->properties[element->first + k];
            if (property->count_type != PATINA_NONE && !strcmp(property->name, names[n]))
                return k;
        }
    return -1;
}

static void subtract(double d[3], const float *a, const float *b)
{
    for (int k = 0; k < 3; k++)
        d[k] = (double)a[k] - (double)b[k];
}

static void cross(double c[3], const double a[3], const double b[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

// Divides by the length. False for what has none.
static bool make_unit(double v[3])
{
    double length = sqrt(pt_dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
    return length > 0 && isfinite(length);
}

static const float *corner(const struct ply_faces *faces, const double *corners, size_t i)
{
    return faces->position + 3 * (size_t)corners[i];
}

// The corners are points that there are. flip: 1 or -1.
static void add_polygon(struct ply_faces *faces, const double *corners, size_t count, double flip)
{
    double normal[3] = {0}, a[3], b[3], c[3];
    for (size_t i = 1; i + 1 < count; i++) { // the sum over a fan is the area's vector of any polygon
        subtract(a, corner(faces, corners, i), corner(faces, corners, 0));
        subtract(b, corner(faces, corners, i + 1), corner(faces, corners, 0));
        cross(c, a, b);
        for (int k = 0; k < 3; k++)
            normal[k] += c[k];
    }
    if (!make_unit(normal))
        return;
    faces->used++;
    for (size_t i = 0; i < count; i++) {
        subtract(a, corner(faces, corners, i ? i - 1 : count - 1), corner(faces, corners, i));
        subtract(b, corner(faces, corners, i + 1 < count ? i + 1 : 0), corner(faces, corners, i));
        cross(c, a, b);
        double angle = flip * pt_atan2(sqrt(pt_dot(c, c)), pt_dot(a, b));
        float *sum = faces->normal + 3 * (size_t)corners[i];
        for (int k = 0; k < 3; k++)
            sum[k] += (float)(angle * normal[k]);
    }
}

static bool check(struct ply_faces *faces, uint64_t row, const double *corners, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (corners[i] >= 0 && corners[i] < (double)faces->points && corners[i] == floor(corners[i]))
            continue;
        if (!faces->bad++) {
            faces->bad_row = row;
            faces->bad_point = corners[i];
        }
        return false;
    }
    return true;
}

static void add_strip(struct ply_faces *faces, uint64_t row, const double *corners, size_t count)
{
    size_t start = 0;
    for (size_t i = 0; i < count; i++) {
        if (corners[i] == -1)
            start = i + 1;
        else if (i >= start + 2 && check(faces, row, corners + i - 2, 3))
            add_polygon(faces, corners + i - 2, 3, (i - start) % 2 ? -1 : 1);
    }
}

void ply_take_face(void *context, uint64_t row, const double *corners, size_t count)
{
    struct ply_faces *faces = context;
    if (faces->strips)
        add_strip(faces, row, corners, count);
    else if (count >= 3 && check(faces, row, corners, count))
        add_polygon(faces, corners, count, 1);
}

void ply_finish_faces(struct ply_faces *faces)
{
    for (uint64_t i = 0; i < faces->points; i++) {
        float *n = faces->normal + 3 * i;
        double unit[3] = {(double)n[0], (double)n[1], (double)n[2]};
        bool good = make_unit(unit);
        for (int k = 0; k < 3; k++)
            n[k] = good ? (float)unit[k] : 0;
    }
}

void ply_take_cell(void *context, uint64_t cell, const double *points, size_t count)
{
    struct ply_grid *grid = context;
    if (count == 0)
        return;
    if (!(points[0] >= 0 && points[0] < (double)grid->points)) {
        grid->bad++;
        return;
    }
    if (grid->row[(size_t)points[0]] != PLY_NO_CELL) { // it stays where it was first
        grid->twice++;
        return;
    }
    grid->row[(size_t)points[0]] = (uint16_t)(cell / grid->columns);
    grid->column[(size_t)points[0]] = (uint16_t)(cell % grid->columns);
}
