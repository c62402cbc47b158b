// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene.h"

#include <math.h>
#include <string.h>

void pt_cofactors(const double m[9], double out[9])
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            out[3 * r + c] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
        }
}

double pt_determinant(const double m[9])
{
    double cofactors[9];
    pt_cofactors(m, cofactors);
    return pt_dot(m, cofactors);
}

double pt_invert(const double m[9], double out[9])
{
    double cofactors[9];
    pt_cofactors(m, cofactors);
    const double determinant = pt_dot(m, cofactors);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            out[3 * r + c] = cofactors[3 * c + r] / determinant;
    return determinant;
}

void pt_multiply(const double a[9], const double b[9], double out[9])
{
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            out[3 * r + c] = a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c];
}

int pt_take_matrix(double matrix[16])
{
    static const double zero[16], identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    if (!memcmp(matrix, zero, sizeof zero))
        memcpy(matrix, identity, sizeof identity);
    for (int k = 0; k < 16; k++)
        if (!isfinite(matrix[k]))
            return 0;
    return 1;
}

void pt_split_matrix(const double matrix[16], double linear[9], double translation[3])
{
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++)
            linear[3 * r + c] = matrix[4 * r + c];
        translation[r] = matrix[4 * r + 3];
    }
}

// Columns of a camera are orthogonal but for rounding; a sheared one (a parent with uneven scale) takes the inverse.
static int invert_columns(double axes[9])
{
    double skew = fabs(pt_dot(axes, axes + 3)) + fabs(pt_dot(axes, axes + 6)) + fabs(pt_dot(axes + 3, axes + 6));
    double cofactors[9], determinant;
    if (skew < 1e-5) // float32 matrices: the transposed is as good
        return PATINA_OK;
    pt_cofactors(axes, cofactors); // of the transposed: rows of axes are columns of the matrix
    determinant = pt_dot(axes, cofactors);
    if (!(fabs(determinant) > 1e-9))
        return PATINA_ERROR_ARGUMENT;
    for (int i = 0; i < 9; i++)
        axes[i] = cofactors[i] / determinant;
    return PATINA_OK;
}

int pt_camera_axes(const patina_camera *camera, double axes[9], double position[3])
{
    double linear[9];
    pt_split_matrix(camera->world_from_camera, linear, position);
    for (int axis = 0; axis < 3; axis++) {
        double column[3] = {linear[axis], linear[3 + axis], linear[6 + axis]};
        double length = sqrt(pt_dot(column, column));
        if (!(length > 0.0) || !isfinite(length) || !isfinite(position[axis]))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "camera: world_from_camera is singular or not finite");
        for (int i = 0; i < 3; i++)
            axes[3 * axis + i] = column[i] / length;
    }
    return invert_columns(axes) ? pt_fail(NULL, PATINA_ERROR_ARGUMENT, "camera: world_from_camera is singular") : PATINA_OK;
}
