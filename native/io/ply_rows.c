// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of a PLY file, of text or of bytes, and what is wrong with a body as a whole.
#include "number.h"
#include "ply.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int ply_read_rows(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                  struct ply_lists *lists)
{
    return at->header->format == PLY_ASCII ? ply_read_ascii(at, element, targets, lists)
                                           : ply_read_binary(at, element, targets, lists);
}

// A count that is too small leaves points out: that deserves a line in the log.
void ply_warn_of_rest(struct ply_cursor at)
{
    const uint8_t *p = at.input->data + at.offset, *end = at.input->data + at.input->size;
    if (at.header->format != PLY_ASCII) {
        if (p != end)
            pt_log(PT_LOG_WARNING, "%s: %llu bytes follow behind byte %llu, where the header's rows end, and were not read",
                   at.input->name, (unsigned long long)(end - p), (unsigned long long)at.offset);
        return;
    }
    for (; p != end && (pt_is_blank(*p) || pt_is_line_end(*p)); p++)
        at.line += *p == '\n' || (*p == '\r' && (p + 1 == end || p[1] != '\n'));
    if (p != end)
        pt_log(PT_LOG_WARNING, "%s: line %llu and what follows is more than the header declares, and was not read",
               at.input->name, (unsigned long long)at.line);
}

// ---- a body that was copied as text --------------------------------------------------------------------------------

// How many line feeds the body holds; 0 when one of them has no carriage return before it.
static uint64_t count_line_ends(const struct pt_input *input, uint64_t body)
{
    const uint8_t *p = input->data + body, *end = input->data + input->size;
    uint64_t count = 0;
    for (; p < end && (p = memchr(p, '\n', (size_t)(end - p))); p++, count++)
        if (p == input->data + body || p[-1] != '\r')
            return 0;
    return count;
}

// An honest body of n bytes has n / 256 line feeds, of which one in 256 follows a carriage return: that all do, and that
// the rows do not end where the file does, is no accident.
int ply_check_line_ends(const struct pt_input *input, const struct ply_header *header)
{
    uint64_t count = header->crlf && header->format != PLY_ASCII ? count_line_ends(input, header->body) : 0;
    struct ply_cursor at = {.input = input, .header = header, .offset = header->body, .tone = PLY_QUIET};
    int code = PATINA_OK;
    if (!count)
        return PATINA_OK;
    for (uint32_t e = 0; e < header->element_count && !code; e++)
        code = ply_read_binary(&at, &header->elements[e], NULL, NULL);
    bool lists = false; // behind one that is read wrongly, anything may follow
    for (uint32_t k = 0; k < header->property_count; k++)
        lists |= header->properties[k].count_type != PATINA_NONE;
    uint64_t left = input->size - at.offset;
    if (code == PATINA_ERROR_CANCELLED || (!code && (left == 0 || (!lists && left > count))))
        return code;
    return pt_fail(NULL, PATINA_ERROR_FORMAT,
                   "%s: damaged by being copied as text: each of the %llu bytes 0A in its binary rows has a 0D before it, so "
                   "that they no longer lie where the header says; copy it anew as binary",
                   input->name, (unsigned long long)count);
}
