// SPDX-License-Identifier: GPL-3.0-or-later
// Sums of two float64 carry what one rounds off (T. J. Dekker, A floating-point technique for extending the available precision, 1971):
// the leading terms of a series are such sums, the rest, a hundredth of them or less, is plain. Arguments are brought near 0 first.
#include "elementary.h"

#include <math.h>

struct pair { // high + low, low at most half a last place of high
    double high, low;
};

static struct pair ordered(double large, double small)
{
    const double sum = large + small;
    return (struct pair){sum, small - (sum - large)};
}

static struct pair sum_of(double a, double b)
{
    const double sum = a + b, other = sum - a;
    return (struct pair){sum, (a - (sum - other)) + (b - other)};
}

static struct pair split(double x) // 26 bits each
{
    const double scaled = 134217729.0 * x, high = scaled - (scaled - x);
    return (struct pair){high, x - high};
}

static struct pair product_of(double a, double b) // exact
{
    const struct pair p = split(a), q = split(b);
    const double product = a * b;
    return (struct pair){product, ((p.high * q.high - product) + p.high * q.low + p.low * q.high) + p.low * q.low};
}

static struct pair add(struct pair a, struct pair b)
{
    const struct pair sum = sum_of(a.high, b.high);
    return ordered(sum.high, sum.low + (a.low + b.low));
}

static struct pair times(struct pair a, struct pair b)
{
    const struct pair p = product_of(a.high, b.high);
    return ordered(p.high, p.low + (a.high * b.low + a.low * b.high));
}

static struct pair over(struct pair a, struct pair b)
{
    const double quotient = a.high / b.high;
    const struct pair p = product_of(quotient, b.high);
    return ordered(quotient, (((a.high - p.high) - p.low) + a.low - quotient * b.low) / b.high);
}

static struct pair negative(struct pair a) { return (struct pair){-a.high, -a.low}; }

static double value(struct pair a) { return a.high + a.low; }

// first[0] + x (first[1] + ...)
static double series(const double *term, int count, double x)
{
    double sum = term[count - 1];
    for (int i = count - 2; i >= 0; i--)
        sum = term[i] + x * sum;
    return sum;
}

#define LENGTH(array) ((int)(sizeof(array) / sizeof *(array)))

static const struct pair third = {0x1.5555555555555p-2, 0x1.5555555555555p-56};
static const struct pair sixth = {0x1.5555555555555p-3, 0x1.5555555555555p-57};

// ---- exponentials and logarithms ---------------------------------------------------------------------------------------

static const double ln2_short = 0x1.62e42fee00000p-1; // 32 bits: its products with exponents are exact
static const struct pair ln2_rest = {0x1.a39ef35793c76p-33, 0x1.cc01f97b57a08p-87};
static const struct pair ln2 = {0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};
static const struct pair per_ln2 = {0x1.71547652b82fep+0, 0x1.777d0ffda0d24p-56};
static const struct pair per_ln10 = {0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};

enum { FAR = 1100 }; // beyond 2^FAR and 2^-FAR there is nothing

// e^r 2^power, |r| < 0.35.
static double exp_of(struct pair r, int power)
{
    static const double term[] = {1.0 / 6,          1.0 / 24,          1.0 / 120,          1.0 / 720,      1.0 / 5040,
                                  1.0 / 40320,      1.0 / 362880,      1.0 / 3628800,      1.0 / 39916800, 1.0 / 479001600,
                                  1.0 / 6227020800, 1.0 / 87178291200, 1.0 / 1307674368000};
    const double rest = r.high * r.high * r.high * series(term, LENGTH(term), r.high);
    const struct pair square = product_of(r.high, r.high), begin = ordered(1.0, r.high);
    const struct pair sum = sum_of(begin.high, 0.5 * square.high);
    return ldexp(sum.high + (sum.low + (begin.low + (r.low + (0.5 * square.low + (r.high * r.low + rest))))), power);
}

static double exp_of_pair(struct pair x)
{
    if (!(fabs(x.high) < FAR))
        return isnan(x.high) ? x.high : x.high > 0.0 ? (double)INFINITY : 0.0;
    const double power = floor(x.high * per_ln2.high + 0.5);
    const struct pair rest = product_of(-power, ln2_rest.high), near = sum_of(x.high - power * ln2_short, x.low);
    return exp_of(add(near, rest), (int)power);
}

// Of x > 0, finite: within 2^-65 of the logarithm.
static struct pair log_of(double x)
{
    static const double term[] = {2.0 / 5,  2.0 / 7,  2.0 / 9,  2.0 / 11, 2.0 / 13, 2.0 / 15, 2.0 / 17,
                                  2.0 / 19, 2.0 / 21, 2.0 / 23, 2.0 / 25, 2.0 / 27, 2.0 / 29};
    int power;
    double m = frexp(x, &power);
    if (m < 0x1.6a09e667f3bcdp-1) { // 1 / sqrt 2
        m *= 2.0;
        power--;
    }
    // log m = 2 artanh s
    const struct pair s = over((struct pair){m - 1.0, 0.0}, sum_of(2.0, m - 1.0));
    const double z = s.high * s.high, rest = s.high * z * z * series(term, LENGTH(term), z);
    const struct pair cube = times(times(times(s, s), s), third);
    struct pair sum = add((struct pair){2.0 * s.high, 2.0 * s.low}, (struct pair){2.0 * cube.high, 2.0 * cube.low});
    sum = ordered(sum.high, sum.low + rest);
    if (!power)
        return sum;
    const struct pair rest_of_power = product_of(power, ln2_rest.high);
    return add(add((struct pair){power * ln2_short, 0.0}, rest_of_power), sum);
}

// What logarithms of no finite number above 0 are.
static int log_is_plain(double x, double *plain)
{
    *plain = isnan(x) || x < 0.0 ? (double)NAN : x == 0.0 ? -(double)INFINITY : x;
    return !(x > 0.0) || isinf(x);
}

double pt_exp(double x) { return exp_of_pair((struct pair){x, 0.0}); }

double pt_exp2(double x)
{
    if (!(fabs(x) < FAR))
        return isnan(x) ? x : x > 0.0 ? (double)INFINITY : 0.0;
    const double power = floor(x + 0.5);
    return exp_of(times((struct pair){x - power, 0.0}, ln2), (int)power);
}

double pt_ln(double x)
{
    double plain;
    return log_is_plain(x, &plain) ? plain : value(log_of(x));
}

double pt_log2(double x)
{
    double plain;
    int power;
    if (log_is_plain(x, &plain))
        return plain;
    const double m = frexp(x, &power);
    if (m >= 0x1.6a09e667f3bcdp-1)
        return value(add((struct pair){power, 0.0}, times(log_of(m), per_ln2)));
    return value(add((struct pair){power - 1, 0.0}, times(log_of(2.0 * m), per_ln2)));
}

double pt_log10(double x)
{
    double plain;
    return log_is_plain(x, &plain) ? plain : value(times(log_of(x), per_ln10));
}

double pt_pow(double x, double y)
{
    if (y == 0.0 || x == 1.0)
        return 1.0;
    if (isnan(x) || isnan(y))
        return (double)NAN;
    const int whole = floor(y) == y, odd = whole && fabs(y) < 0x1p53 && fmod(y, 2.0) != 0.0;
    const double sign = signbit(x) && odd ? -1.0 : 1.0, size = fabs(x);
    if (size == 0.0 || isinf(size) || isinf(y)) {
        if (size == 1.0)
            return 1.0;
        return sign * ((size > 1.0) == (y > 0.0) ? (double)INFINITY : 0.0);
    }
    if (x < 0.0 && !whole)
        return (double)NAN;
    if (y == 1.0)
        return x;
    if (y == 2.0)
        return x * x;
    const struct pair log = log_of(size);
    if (!(fabs(y) * fabs(log.high) < FAR))
        return sign * ((size > 1.0) == (y > 0.0) ? (double)INFINITY : 0.0);
    return sign * exp_of_pair(times(log, (struct pair){y, 0.0}));
}

double pt_cbrt(double x)
{
    if (x == 0.0 || isnan(x) || isinf(x))
        return x;
    int power;
    const double m = frexp(fabs(x), &power);
    const int up = ((power % 3) + 3) % 3; // x = m 2^up 2^(power - up)
    const double near = ldexp(m, up);
    double root = exp_of_pair(times(log_of(near), third));
    const struct pair cube = times(product_of(root, root), (struct pair){root, 0.0}); // one step of Newton's
    root -= ((cube.high - near) + cube.low) / (3.0 * root * root);
    return copysign(ldexp(root, (power - up) / 3), x);
}

// ---- angles ------------------------------------------------------------------------------------------------------------

static const struct pair right = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54}; // a right angle

// The angle to the nearest multiple of a right angle, and which one that is, modulo 4. x is finite.
static struct pair reduce(double x, int *quarter)
{
    // a right angle by parts of 33 bits, whose products with whole numbers to 2^20 are exact
    static const double first = 0x1.921fb54400000p+0, second = 0x1.0b4611a600000p-34, third_part = 0x1.3198a2e037073p-69;
    if (fabs(x) > 1e6)
        x = remainder(x, 4.0 * right.high);
    const double count = floor(x * (1.0 / right.high) + 0.5);
    const struct pair near = sum_of(x - count * first, -count * second), rest = product_of(-count, third_part);
    *quarter = (int)(count - 4.0 * floor(0.25 * count));
    return add(near, rest);
}

static struct pair sine_near(struct pair r) // |r| <= pi / 4
{
    static const double term[] = {1.0 / 120,
                                  -1.0 / 5040,
                                  1.0 / 362880,
                                  -1.0 / 39916800,
                                  1.0 / 6227020800.0,
                                  -1.0 / 1307674368000.0,
                                  1.0 / 355687428096000.0};
    const struct pair cube = times(times(times(r, r), r), sixth);
    const double z = r.high * r.high, rest = r.high * z * z * series(term, LENGTH(term), z);
    const struct pair sum = add(r, negative(cube));
    return ordered(sum.high, sum.low + rest);
}

static struct pair cosine_near(struct pair r)
{
    static const double term[] = {1.0 / 24,
                                  -1.0 / 720,
                                  1.0 / 40320,
                                  -1.0 / 3628800,
                                  1.0 / 479001600.0,
                                  -1.0 / 87178291200.0,
                                  1.0 / 20922789888000.0,
                                  -1.0 / 6402373705728000.0};
    const struct pair square = times(r, r);
    const double z = square.high, rest = z * z * series(term, LENGTH(term), z);
    const struct pair sum = add((struct pair){1.0, 0.0}, (struct pair){-0.5 * square.high, -0.5 * square.low});
    return ordered(sum.high, sum.low + rest);
}

// Of a finite x, as sines and cosines of quarter turns follow one another.
static struct pair turned(double x, int quarters)
{
    int quarter;
    const struct pair r = reduce(x, &quarter);
    quarter = (quarter + quarters) % 4;
    const struct pair out = quarter % 2 ? cosine_near(r) : sine_near(r);
    return quarter / 2 ? negative(out) : out;
}

double pt_sin(double x) { return !isfinite(x) ? (double)NAN : x == 0.0 ? x : value(turned(x, 0)); }

double pt_cos(double x) { return !isfinite(x) ? (double)NAN : value(turned(x, 1)); }

double pt_tan(double x) { return !isfinite(x) ? (double)NAN : x == 0.0 ? x : value(over(turned(x, 0), turned(x, 1))); }

// Of y / x for 0 <= y <= x, x > 0.
static struct pair arctangent(struct pair y, struct pair x)
{
    static const struct pair eighths[] = {
        // arctangents of 0, 1/8, ..., 1
        {0.0, 0.0},
        {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
        {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
        {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
        {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
        {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
        {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
        {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
        {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
    };
    static const double term[] = {-1.0 / 3, 1.0 / 5, -1.0 / 7, 1.0 / 9, -1.0 / 11, 1.0 / 13, -1.0 / 15};
    const int eighth = (int)(8.0 * (y.high / x.high) + 0.5);
    const struct pair c = {eighth / 8.0, 0.0};
    const struct pair u = over(add(y, negative(times(c, x))), add(x, times(c, y)));
    const double z = u.high * u.high;
    const struct pair sum = add(eighths[eighth], u);
    return ordered(sum.high, sum.low + u.high * z * series(term, LENGTH(term), z));
}

// Angle of a direction; neither NaN, nor infinite, nor both 0.
static double angle_of(struct pair y, struct pair x)
{
    const struct pair up = y.high < 0.0 ? negative(y) : y, aside = x.high < 0.0 ? negative(x) : x;
    struct pair angle = up.high > aside.high ? add(right, negative(arctangent(aside, up))) : arctangent(up, aside);
    if (x.high < 0.0)
        angle = add((struct pair){2.0 * right.high, 2.0 * right.low}, negative(angle));
    return value(angle);
}

double pt_atan2(double y, double x)
{
    if (isnan(x) || isnan(y))
        return (double)NAN;
    if (isinf(x) || isinf(y)) // as of the corners that they stand for
        return pt_atan2(isinf(y) ? copysign(1.0, y) : copysign(0.0, y), isinf(x) ? copysign(1.0, x) : copysign(0.0, x));
    if (y == 0.0)
        return signbit(x) ? copysign(2.0 * right.high, y) : y;
    int power;
    frexp(fmax(fabs(x), fabs(y)), &power); // products neither overflow nor vanish
    if (power > 400 || power < -400) {
        x = ldexp(x, -power);
        y = ldexp(y, -power);
    }
    return copysign(angle_of((struct pair){y, 0.0}, (struct pair){x, 0.0}), y);
}

// sqrt(1 - x^2), |x| <= 1.
static struct pair beside(double x)
{
    const struct pair square = times(sum_of(1.0, -x), sum_of(1.0, x));
    if (!(square.high > 0.0))
        return (struct pair){0.0, 0.0};
    const double root = sqrt(square.high);
    const struct pair back = product_of(root, root);
    return ordered(root, (((square.high - back.high) - back.low) + square.low) / (2.0 * root));
}

double pt_asin(double x)
{
    if (!(fabs(x) <= 1.0))
        return (double)NAN;
    return x == 0.0 ? x : copysign(angle_of((struct pair){fabs(x), 0.0}, beside(x)), x);
}

double pt_acos(double x)
{
    if (!(fabs(x) <= 1.0))
        return (double)NAN;
    return x == 1.0 ? 0.0 : angle_of(beside(x), (struct pair){x, 0.0});
}
