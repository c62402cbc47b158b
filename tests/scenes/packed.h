// SPDX-License-Identifier: GPL-3.0-or-later
// A cloud whose positions are packed, and one with floats where these lie: the same in all else.
#ifndef TEST_PACKED_H
#define TEST_PACKED_H

// Of the saved cloud `from`. Fails the test on error.
void packed_write(const char *from, const char *packed, const char *floats);

#endif
