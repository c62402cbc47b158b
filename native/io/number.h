// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in text files: correctly rounded float64, whatever the process's locale is.
#ifndef PT_NUMBER_H
#define PT_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

// What parts tokens within a line, and what ends a line.
static inline bool pt_is_blank(uint8_t c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

static inline bool pt_is_line_end(uint8_t c) { return c == '\n' || c == '\r'; }
static inline const uint8_t *pt_line_end(const uint8_t *at, const uint8_t *end)
{
    while (at < end && !pt_is_line_end(*at))
        at++;
    return at;
}

// Parses the token that starts at p: decimal numbers, nan, inf, infinity, and their older spellings nan(ind), 1.#QNAN,
// 1.#INF. The whole token must be the number. Returns the byte behind it, NULL when it is none.
const uint8_t *pt_parse_number(const uint8_t *p, const uint8_t *end, double *value);

#endif
