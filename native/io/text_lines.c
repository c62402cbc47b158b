// SPDX-License-Identifier: GPL-3.0-or-later
#include "text.h"
#include "number.h"

bool pt_text_find_line(struct pt_text *t)
{
    t->line += t->breaks;
    t->breaks = 0;
    for (;;) {
        while (t->at < t->end && (pt_cells_skips(t->cells.parting, *t->at) || pt_is_line_end(*t->at))) {
            t->line += *t->at == '\n' || (*t->at == '\r' && (t->at + 1 == t->end || t->at[1] != '\n'));
            t->at++;
        }
        if (t->at == t->end || !pt_is_comment(t->at, t->end))
            return t->at < t->end;
        while (t->at < t->end && !pt_is_line_end(*t->at))
            t->at++;
    }
}

struct pt_line pt_text_read_line(struct pt_text *t, double values[MOST_COLUMNS])
{
    struct pt_line line;
    t->at = pt_cells_read(&t->cells, t->at, t->end, values, MOST_COLUMNS, &line);
    t->breaks = line.breaks;
    return line;
}

void pt_text_rewind(struct pt_text *t, const uint8_t *body, uint64_t line)
{
    t->at = body;
    t->line = line;
    t->breaks = 0;
}
