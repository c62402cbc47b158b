// SPDX-License-Identifier: GPL-3.0-or-later
// Words of files and options: letters of ASCII alike in both cases, whatever the process's locale is.
#ifndef PT_WORDS_H
#define PT_WORDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static inline unsigned char pt_small_letter(char c) { return (unsigned char)(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c); }

// Whether the first `length` letters are the same; a text that ends before has other letters.
static inline bool pt_same_start(const char *a, const char *b, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        if (pt_small_letter(a[i]) != pt_small_letter(b[i]))
            return false;
        if (!a[i])
            break;
    }
    return true;
}

static inline bool pt_same_word(const char *a, const char *b) { return pt_same_start(a, b, (size_t)-1); }

// Whether the path is longer than the ending and ends with it.
static inline bool pt_ends_in(const char *path, const char *ending)
{
    const size_t length = strlen(path), size = strlen(ending);
    return length > size && !strcmp(path + length - size, ending);
}

// The caller frees it; NULL without memory.
static inline char *pt_copy_text(const char *text, size_t length)
{
    char *copy = (char *)malloc(length + 1);
    if (copy) {
        memcpy(copy, text, length);
        copy[length] = 0;
    }
    return copy;
}

#endif
