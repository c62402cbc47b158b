// SPDX-License-Identifier: GPL-3.0-or-later
// What Patina's own PLYs say of the scans that their points are of, a line of the header each, in the order of their numbers:
// "obj_info patina_scan COLUMNS ROWS INTERVAL DX DY DZ at|nowhere X Y Z POSE... NAME": patina_file_scan's, the pose twelve numbers, the
// name the line's rest. The attribute "scan" says which points they are; without it there is one.
#include "number.h"
#include "ply.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 21, PLACE = 6, MOST = UINT16_MAX }; // beside "at" or "nowhere", which stands before the number PLACE

static const char key[] = "obj_info patina_scan ";

// The word at *at, which comes to stand behind it and one blank.
static bool take_number(const uint8_t **at, const uint8_t *end, double *value)
{
    const uint8_t *begin = *at, *stop = begin;
    while (stop < end && !pt_is_blank(*stop))
        stop++;
    *at = stop + (stop < end);
    return stop > begin && pt_parse_number(begin, stop, value) == stop;
}

static bool take_word(const uint8_t **at, const uint8_t *end, const char *word)
{
    const size_t length = strlen(word);
    if ((size_t)(end - *at) < length + 1 || memcmp(*at, word, length) || (*at)[length] != ' ')
        return false;
    *at += length + 1;
    return true;
}

static bool is_size(double value) { return value >= 0 && value < (double)UINT32_MAX && value == floor(value); }

// A line behind its key.
static bool read_line(const uint8_t *at, const uint8_t *end, struct pt_scan *scan)
{
    double values[NUMBERS];
    bool there = false;
    for (int i = 0; i < NUMBERS; i++) {
        if (i == PLACE && !(there = take_word(&at, end, "at")) && !take_word(&at, end, "nowhere"))
            return false;
        if (!take_number(&at, end, &values[i]) || !isfinite(values[i]))
            return false;
    }
    double square = 0;
    for (int k = 0; k < 3; k++)
        square += values[3 + k] * values[3 + k];
    if (!is_size(values[0]) || !is_size(values[1]) || !(values[2] >= 0) || !(square == 0 || fabs(square - 1) < 1e-3) ||
        !pt_turns(values + 9, 4))
        return false;
    *scan = (struct pt_scan){
        .columns = (uint32_t)values[0], .rows = (uint32_t)values[1], .interval = values[2], .nowhere = !there, .told = true};
    memcpy(scan->direction, values + 3, sizeof scan->direction);
    memcpy(scan->station, values + PLACE, sizeof scan->station);
    memcpy(scan->pose, values + 9, sizeof scan->pose);
    char name[200];
    const size_t length = (size_t)(end - at) < sizeof name - 1 ? (size_t)(end - at) : sizeof name - 1;
    memcpy(name, at, length);
    name[length] = 0;
    pt_clip_name(scan->name, sizeof scan->name, name);
    return true;
}

// The next line of the header that tells of a scan, from *at on, which comes behind it; NULL: there is none.
static const uint8_t *next_line(const uint8_t **at, const uint8_t *end, const uint8_t **stop)
{
    const size_t length = sizeof key - 1;
    while (*at < end) {
        const uint8_t *begin = *at, *line = begin;
        while (line < end && !pt_is_line_end(*line))
            line++;
        *at = line + (line < end);
        *stop = line;
        if ((size_t)(line - begin) > length && !memcmp(begin, key, length))
            return begin + length;
    }
    return NULL;
}

// Which points the scans have: those of each follow each other.
static bool share_points(struct patina_file *file)
{
    const struct pt_column *column = pt_file_find_attribute(file, "scan");
    if (!column) {
        file->scans[0].count = file->count;
        return file->scan_count == 1;
    }
    uint32_t last = UINT32_MAX;
    for (uint64_t i = 0; i < file->count; i++) {
        const double value = pt_file_value(column, i);
        const uint32_t scan = value >= 0 && value < file->scan_count && value == floor(value) ? (uint32_t)value : UINT32_MAX;
        if (scan == UINT32_MAX) {
            last = scan;
            continue;
        }
        if (scan != last && file->scans[scan].count)
            return false;
        if (scan != last)
            file->scans[scan].first = i;
        file->scans[scan].count++;
        last = scan;
    }
    return true;
}

bool ply_tells_of_scans(const struct pt_input *input, uint64_t header)
{
    const uint8_t *at = input->data, *stop;
    return next_line(&at, input->data + header, &stop) != NULL;
}

int ply_read_scans(struct patina_file *file, const struct pt_input *input, uint64_t header)
{
    const uint8_t *const end = input->data + header, *at = input->data, *line, *stop;
    uint32_t count = 0;
    while (next_line(&at, end, &stop))
        count++;
    if (!count || file->scan_count)
        return PATINA_OK;
    if (count > MOST || !(file->scans = calloc(count, sizeof *file->scans)))
        return count > MOST ? PATINA_OK : PATINA_ERROR_MEMORY;
    const char *wrong = NULL;
    for (at = input->data; !wrong && (line = next_line(&at, end, &stop));)
        wrong = read_line(line, stop, &file->scans[file->scan_count++]) ? NULL : "is none";
    const uint32_t bad = file->scan_count - 1;
    if (!wrong && !share_points(file))
        wrong = "and others do not lie one behind the other among the points";
    if (!wrong)
        return PATINA_OK;
    pt_log(PT_LOG_WARNING, "%s: what the header says of scans is left out: scan %u %s", input->name, bad, wrong);
    free(file->scans);
    file->scans = NULL;
    file->scan_count = 0;
    return PATINA_OK;
}
