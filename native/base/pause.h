// SPDX-License-Identifier: GPL-3.0-or-later
// A part of platform.h that programs alone need.
#ifndef PT_PAUSE_H
#define PT_PAUSE_H

#include <stdint.h>

void pt_pause(uint32_t milliseconds); // at least; the thread sleeps

#endif
