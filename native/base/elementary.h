// SPDX-License-Identifier: GPL-3.0-or-later
// The elementary functions of <math.h>, of our own: C libraries differ in their last bits, and pictures shall not. Additions,
// multiplications, divisions and roots alone, each rounded as IEEE 754 says, so the same bits come on every machine. Within 0.51 of
// the last place; where the result is a float64 (2^3, log10 of 1000, sin of 0) it is that. NaN, infinities and ends of domains as C has
// them, without errno. What <math.h> has that is exact by its nature (sqrt, floor, ldexp, remainder, nextafterf) is used from there.
#ifndef PT_ELEMENTARY_H
#define PT_ELEMENTARY_H

double pt_exp(double x);
double pt_exp2(double x);
double pt_ln(double x);
double pt_log2(double x);
double pt_log10(double x);
double pt_pow(double x, double y); // x < 0: for whole y
double pt_cbrt(double x);

double pt_sin(double x); // radians; beyond 1e6 of x less whole turns of 2 pi as float64 has it
double pt_cos(double x);
double pt_tan(double x);
double pt_asin(double x);
double pt_acos(double x);
double pt_atan2(double y, double x);

#endif
