// SPDX-License-Identifier: GPL-3.0-or-later
// Eigenvalues and eigenvectors of symmetric 3 x 3 matrices, by Jacobi's rotations in float64.
#ifndef PT_SYMMETRIC_H
#define PT_SYMMETRIC_H

// Writes the eigenvalues, least first and at least 0, and the unit eigenvectors as the rows of v. Changes a.
void pt_solve_symmetric(double a[3][3], double value[3], double v[3][3]);

#endif
