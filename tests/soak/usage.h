// SPDX-License-Identifier: GPL-3.0-or-later
// What a long-running process holds, and whether it grows. Linux with glibc only.
#ifndef PT_SOAK_USAGE_H
#define PT_SOAK_USAGE_H

#include "patina/patina.h"

#include <stdint.h>

struct usage {
    uint64_t heap;     // bytes that malloc has given out
    uint64_t resident; // bytes of the process's own in memory, none of files, after free memory went back
    uint32_t handles, threads;
    uint32_t files;   // in the folder for temporary files
    uint32_t objects; // buffers, textures, programs, queries of OpenGL devices that usage_watch was told of
};

// Gives the process an empty folder for temporary files of its own.
void usage_begin(void);
void usage_end(void);
struct usage usage_now(void);
// Prints both. Fails the test if the first five are more than 1 % greater in the second; resident memory: if it is more than 1 % and 1 MB.
// Under a sanitizer, which keeps memory of its own, neither kind of memory is held.
void usage_compare(const char *what, const struct usage *first, const struct usage *last);
// Counts the objects of an OpenGL device from here on. Others: nothing.
void usage_watch(patina_device *device);
// The device loses its context after so many further calls of OpenGL that are checked. For OpenGL devices.
void usage_lose_after(patina_device *device, uint32_t checks);

// How often to repeat: the environment variable PATINA_SOAK is the share of the whole in percent; without it 1.
uint32_t soak_count(uint32_t whole);

#endif
