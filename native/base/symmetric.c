// SPDX-License-Identifier: GPL-3.0-or-later
#include "symmetric.h"

#include <math.h>

static void rotate(double a[3][3], double v[3][3], int p, int q)
{
    if (a[p][q] == 0.0)
        return;
    const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    const double t = fabs(theta) > 1e150 ? 0.5 / theta : (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
    const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
    const int r = 3 - p - q;
    const double rp = a[r][p], rq = a[r][q], pq = a[p][q];
    a[p][p] -= t * pq;
    a[q][q] += t * pq;
    a[p][q] = a[q][p] = 0.0;
    a[r][p] = a[p][r] = c * rp - s * rq;
    a[r][q] = a[q][r] = s * rp + c * rq;
    for (int k = 0; k < 3; k++) {
        const double vp = v[p][k], vq = v[q][k];
        v[p][k] = c * vp - s * vq;
        v[q][k] = s * vp + c * vq;
    }
}

void pt_solve_symmetric(double a[3][3], double value[3], double v[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            v[i][k] = i == k;
    const double size = fabs(a[0][0]) + fabs(a[1][1]) + fabs(a[2][2]);
    for (int sweep = 0; sweep < 12 && fabs(a[0][1]) + fabs(a[0][2]) + fabs(a[1][2]) > 1e-13 * size; sweep++) {
        rotate(a, v, 0, 1);
        rotate(a, v, 0, 2);
        rotate(a, v, 1, 2);
    }
    for (int i = 0; i < 3; i++)
        value[i] = a[i][i] > 0.0 ? a[i][i] : 0.0;
    for (int i = 0; i < 2; i++) // least first
        for (int j = 0; j < 2 - i; j++)
            if (value[j] > value[j + 1]) {
                const double kept = value[j];
                value[j] = value[j + 1];
                value[j + 1] = kept;
                for (int k = 0; k < 3; k++) {
                    const double axis = v[j][k];
                    v[j][k] = v[j + 1][k];
                    v[j + 1][k] = axis;
                }
            }
}
