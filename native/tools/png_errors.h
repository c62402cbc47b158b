// SPDX-License-Identifier: GPL-3.0-or-later
// Where libpng says what is wrong, of whoever reads and writes PNGs.
#ifndef TOOL_PNG_ERRORS_H
#define TOOL_PNG_ERRORS_H

#include <png.h>

enum { TOOL_PNG_WHY = 256 };

// For png_create_*_struct, whose error pointer is a char[TOOL_PNG_WHY]: the sentence goes there, and png_jmpbuf's place is next.
void tool_png_error(png_structp state, png_const_charp text);
void tool_png_warning(png_structp state, png_const_charp text); // nobody hears it

#endif
