// SPDX-License-Identifier: GPL-3.0-or-later
// The process-wide ring of log lines, polled by patina_log_next; the only mutable global beside the thread's message.
#include "error.h"

#include <stdio.h>
#include <string.h>

enum { LINES = 256, LINE_SIZE = 512 };

static struct {
    struct pt_once made; // the lock
    struct pt_mutex lock;
    unsigned first, count;
    struct {
        enum pt_level level;
        char text[LINE_SIZE];
    } lines[LINES];
} ring;

static void make_lock(void) { pt_mutex_init(&ring.lock); }

static void lock_ring(void)
{
    pt_once(&ring.made, make_lock);
    pt_mutex_lock(&ring.lock);
}

void pt_log_write(enum pt_level level, const char *text)
{
    lock_ring();
    if (ring.count == LINES) { // the oldest line makes room
        ring.first = (ring.first + 1) % LINES;
        ring.count--;
    }
    unsigned at = (ring.first + ring.count++) % LINES;
    ring.lines[at].level = level;
    snprintf(ring.lines[at].text, LINE_SIZE, "%s", text);
    pt_mutex_unlock(&ring.lock);
}

void pt_log(enum pt_level level, const char *format, ...)
{
    char text[LINE_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    pt_log_write(level, text);
}

size_t patina_log_next(char *buffer, size_t size, int *level)
{
    size_t length = 0;
    lock_ring();
    if (ring.count) {
        if (level)
            *level = (int)ring.lines[ring.first].level;
        length = strlen(ring.lines[ring.first].text);
        if (buffer && size)
            snprintf(buffer, size, "%s", ring.lines[ring.first].text);
        ring.first = (ring.first + 1) % LINES;
        ring.count--;
    }
    pt_mutex_unlock(&ring.lock);
    return length;
}
