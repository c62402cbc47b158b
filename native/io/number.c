// SPDX-License-Identifier: GPL-3.0-or-later
#include "number.h"
#include "base/platform.h"
#include "base/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

__extension__ typedef unsigned __int128 uint128;

enum {
    MOST_DIGITS = 19,   // always fit 64 bits
    LONGEST_TOKEN = 400 // no writer prints longer ones
};

static const double power_of_ten[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                        1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

struct decimal { // mantissa * 10^exponent
    uint64_t mantissa;
    int64_t exponent;
    int digits;   // significant ones kept
    bool any;     // a digit was seen
    bool dropped; // digits beyond MOST_DIGITS were there
    bool negative;
};

static bool is_digit(uint8_t c) { return c >= '0' && c <= '9'; }

static bool is_token_end(const uint8_t *p, const uint8_t *end) { return p == end || pt_is_blank(*p) || pt_is_line_end(*p); }

// step: what a kept digit adds to the exponent (0 before the point, -1 behind it).
static const uint8_t *take_digits(const uint8_t *p, const uint8_t *end, int step, struct decimal *d)
{
    for (; p != end && is_digit(*p); p++) {
        d->any = true;
        if (d->digits == MOST_DIGITS) {
            d->dropped = true;
            d->exponent += step + 1;
            continue;
        }
        d->mantissa = d->mantissa * 10 + (uint64_t)(*p - '0');
        d->digits += d->mantissa != 0;
        d->exponent += step;
    }
    return p;
}

// The e of 1e-3, if there is one; NULL when no digit follows it.
static const uint8_t *take_exponent(const uint8_t *p, const uint8_t *end, struct decimal *d)
{
    if (p == end || (*p != 'e' && *p != 'E'))
        return p;
    p++;
    bool negative = p != end && *p == '-';
    if (p != end && (*p == '-' || *p == '+'))
        p++;
    if (p == end || !is_digit(*p))
        return NULL;
    int64_t exponent = 0;
    for (; p != end && is_digit(*p); p++)
        exponent = exponent < 100000 ? exponent * 10 + (*p - '0') : exponent;
    d->exponent += negative ? -exponent : exponent;
    return p;
}

// mantissa / 10^digits for mantissas that float64 does not hold (17 digits and more, as "%.17g" prints): one 128-bit
// division; the remainder's sticky bit makes the one rounding right.
static double divide(uint64_t mantissa, int digits)
{
    int shift = __builtin_clzll(mantissa);
    uint64_t divisor = 1;
    for (int i = 0; i < digits; i++)
        divisor *= 10;
    uint128 wide = (uint128)(mantissa << shift) << 64;
    uint128 quotient = wide / divisor; // at least 64 bits
    quotient |= quotient * divisor != wide;
    return ldexp((double)quotient, -64 - shift);
}

// Not a number, infinite, or no number at all.
static bool parse_special(const char *token, double *value)
{
    double sign = *token == '-' ? -1.0 : 1.0;
    token += *token == '-' || *token == '+';
    if (pt_same_word(token, "inf") || pt_same_word(token, "infinity") || pt_same_start(token, "1.#INF", 6)) {
        *value = sign * (double)INFINITY;
        return true;
    }
    if (pt_same_word(token, "nan") || pt_same_start(token, "nan(", 4) || !strncmp(token, "1.#", 3)) {
        *value = (double)NAN;
        return true;
    }
    return false;
}

// Cuts the token out and leaves it to the C library, in the C locale.
static const uint8_t *parse_hard(const uint8_t *start, const uint8_t *end, bool number, double *value)
{
    char token[LONGEST_TOKEN + 1];
    size_t length = 0;
    while (!is_token_end(start + length, end)) {
        if (length == LONGEST_TOKEN)
            return NULL;
        token[length] = (char)start[length];
        length++;
    }
    token[length] = 0;
    if (!number)
        return parse_special(token, value) ? start + length : NULL;
    *value = pt_decimal(token);
    return start + length;
}

const uint8_t *pt_parse_number(const uint8_t *start, const uint8_t *end, double *value)
{
    struct decimal d = {0};
    const uint8_t *p = start;
    if (p != end && (*p == '-' || *p == '+'))
        d.negative = *p++ == '-';
    p = take_digits(p, end, 0, &d);
    if (p != end && *p == '.')
        p = take_digits(p + 1, end, -1, &d);
    p = d.any ? take_exponent(p, end, &d) : NULL;
    if (!p || !is_token_end(p, end))
        return parse_hard(start, end, false, value);

    double magnitude;
    if (d.mantissa == 0) {
        magnitude = 0;
    } else if (!d.dropped && d.mantissa <= 1ull << 53 && d.exponent >= -22 && d.exponent <= 22) {
        // Both factors are exact, so the one operation rounds once.
        magnitude = d.exponent < 0 ? (double)d.mantissa / power_of_ten[-d.exponent]
                                   : (double)d.mantissa * power_of_ten[d.exponent];
    } else if (!d.dropped && d.exponent <= 0 && d.exponent >= -MOST_DIGITS) {
        magnitude = divide(d.mantissa, (int)-d.exponent);
    } else {
        return parse_hard(start, end, true, value);
    }
    *value = d.negative ? -magnitude : magnitude;
    return p;
}
