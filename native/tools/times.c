// SPDX-License-Identifier: GPL-3.0-or-later
// Times of frames and passes, medians, and the JSON object that `--stats json` prints.
#include "tool.h"
#include "base/compare.h"
#include "base/words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PASSES = 64, MAX_NAME = 64 };

struct tool_times {
    int frames, capacity; // frames so far
    double *ms;           // a frame
    int pass_count;
    char pass_names[MAX_PASSES][MAX_NAME];
    double *pass_ms[MAX_PASSES]; // a frame; 0 where the pass did not run
    char *skipped, *planes;      // of the last frame, as JSON
    char *gl, *cpu;              // what the last frame asked of the device; NULL: of the other kind
    char *work;                  // the same by pass
};

struct tool_times *tool_times_create(int frames)
{
    struct tool_times *times = calloc(1, sizeof *times);
    if (!times)
        return NULL;
    times->capacity = frames;
    times->ms = calloc((size_t)frames, sizeof *times->ms);
    if (times->ms)
        return times;
    free(times);
    return NULL;
}

void tool_times_destroy(struct tool_times *times)
{
    if (!times)
        return;
    for (int i = 0; i < times->pass_count; i++)
        free(times->pass_ms[i]);
    free(times->skipped);
    free(times->planes);
    free(times->gl);
    free(times->cpu);
    free(times->work);
    free(times->ms);
    free(times);
}

static int pass_index(struct tool_times *times, const char *name, size_t length)
{
    if (length >= MAX_NAME)
        length = MAX_NAME - 1;
    for (int i = 0; i < times->pass_count; i++)
        if (strlen(times->pass_names[i]) == length && !memcmp(times->pass_names[i], name, length))
            return i;
    if (times->pass_count == MAX_PASSES)
        return -1;
    double *column = calloc((size_t)times->capacity, sizeof *column);
    if (!column)
        return -1;
    const int index = times->pass_count++;
    memcpy(times->pass_names[index], name, length);
    times->pass_ms[index] = column;
    return index;
}

// The object behind `"key":` in the library's JSON: start at its {, length with both braces. NULL when there is none.
static const char *find_object(const char *json, const char *key, size_t *length)
{
    const char *at = strstr(json, key);
    if (!at || !(at = strchr(at, '{')))
        return NULL;
    int quoted = 0, depth = 0;
    for (const char *end = at; *end; end++) {
        if (quoted && *end == '\\' && end[1])
            end++;
        else if (*end == '"')
            quoted = !quoted;
        else if (!quoted && *end == '{')
            depth++;
        else if (!quoted && *end == '}' && --depth == 0) {
            *length = (size_t)(end - at) + 1;
            return at;
        }
    }
    return NULL;
}

// {"name": number, ...}
static void add_passes(struct tool_times *times, const char *object, size_t length)
{
    const char *end = object + length;
    for (const char *at = object; (at = memchr(at, '"', (size_t)(end - at))) != NULL;) {
        const char *name = ++at;
        const char *close = memchr(at, '"', (size_t)(end - at));
        const char *colon = close ? memchr(close, ':', (size_t)(end - close)) : NULL;
        if (!colon)
            return;
        const int index = pass_index(times, name, (size_t)(close - name));
        if (index >= 0)
            times->pass_ms[index][times->frames] += strtod(colon + 1, NULL);
        at = colon;
    }
}

// Copies an object of the library's JSON to *kept, in place of what was there, if the JSON has it.
static void keep_object(const char *json, const char *key, char **kept)
{
    size_t length;
    const char *object = find_object(json, key, &length);
    if (!object)
        return;
    free(*kept);
    *kept = pt_copy_text(object, length);
}

int tool_times_add(struct tool_times *times, double ms, const patina_frame *frame)
{
    const size_t size = patina_frame_stats_json(frame, NULL, 0) + 1;
    char *json = calloc(size, 1);
    if (!json || times->frames == times->capacity) {
        free(json);
        return -1;
    }
    patina_frame_stats_json(frame, json, size);
    size_t length;
    const char *object = find_object(json, "\"passes\":", &length);
    if (object)
        add_passes(times, object, length);
    keep_object(json, "\"skipped\":", &times->skipped);
    keep_object(json, "\"planes\":", &times->planes);
    keep_object(json, "\"gl\":", &times->gl);
    keep_object(json, "\"cpu\":", &times->cpu);
    keep_object(json, "\"work\":", &times->work);
    free(json);
    times->ms[times->frames++] = ms;
    return 0;
}

static double median(const double *values, int count)
{
    double *sorted = count ? malloc((size_t)count * sizeof *sorted) : NULL;
    if (!sorted)
        return 0;
    memcpy(sorted, values, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, pt_compare_doubles);
    const double result = (sorted[(count - 1) / 2] + sorted[count / 2]) / 2;
    free(sorted);
    return result;
}

double tool_times_median(const struct tool_times *times) { return median(times->ms, times->frames); }

static void print_string(const char *text)
{
    putchar('"');
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            putchar('\\');
        if ((unsigned char)*text < 0x20)
            printf("\\u%04x", (unsigned char)*text);
        else
            putchar(*text);
    }
    putchar('"');
}

void tool_times_print(struct tool_times *times, const char *device, const patina_frame_stats *stats, double analysis_ms)
{
    double least = times->frames ? times->ms[0] : 0, most = least;
    for (int i = 1; i < times->frames; i++) {
        if (times->ms[i] < least)
            least = times->ms[i];
        if (times->ms[i] > most)
            most = times->ms[i];
    }
    printf("{\"device\": ");
    print_string(device);
    printf(", \"untrusted\": %llu, \"none_trusted\": %llu", (unsigned long long)stats->untrusted,
           (unsigned long long)stats->none_trusted);
    printf(", \"points\": %llu, \"width\": %u, \"height\": %u", (unsigned long long)stats->points, stats->width, stats->height);
    printf(", \"ms_median\": %.4f, \"ms_min\": %.4f, \"ms_max\": %.4f", tool_times_median(times), least, most);
    printf(", \"passes\": {");
    for (int i = 0; i < times->pass_count; i++) {
        if (i)
            printf(", ");
        print_string(times->pass_names[i]);
        printf(": %.4f", median(times->pass_ms[i], times->frames));
    }
    printf("}, \"layers\": %u, \"skipped\": %s, \"planes\": %s, \"peak_mb\": %.1f", stats->layers,
           times->skipped ? times->skipped : "{}", times->planes ? times->planes : "{}", (double)pt_peak_memory() / (1 << 20));
    if (times->gl)
        printf(", \"gl\": %s", times->gl);
    if (times->cpu)
        printf(", \"cpu\": %s", times->cpu);
    if (times->work)
        printf(", \"work\": %s", times->work);
    printf(", \"mapped\": {\"bytes\": %llu, \"cap\": %llu, \"held\": %llu, \"read\": %llu, \"rounds\": %u, \"returned\": %u}",
           (unsigned long long)stats->mapped_bytes, (unsigned long long)stats->mapped_cap,
           (unsigned long long)stats->mapped_held, (unsigned long long)stats->mapped_read, stats->mapped_rounds,
           stats->mapped_returned);
    const patina_expected_error *expected = &stats->expected;
    printf(", \"spacing_px\": %.4f, \"expected_error\": ", (double)stats->spacing_px);
    if (isfinite(expected->color))
        printf("{\"color\": %.6f, \"coverage\": %.6f, \"depth\": %.4f, \"normal\": %.4f, \"doubt\": %.1f}",
               (double)expected->color, (double)expected->coverage, (double)expected->depth, (double)expected->normal,
               (double)expected->doubt);
    else
        printf("null"); // not known
    printf(", \"analysis_ms\": %.1f", analysis_ms);
    printf(", \"shadow_samples\": %u, \"shadow_error\": %.6f", stats->shadow_samples, (double)stats->shadow_error);
    printf(", \"pixel_samples\": %u, \"pixel_error\": %.6f}\n", stats->pixel_samples, (double)stats->pixel_error);
}
