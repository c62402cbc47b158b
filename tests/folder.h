// SPDX-License-Identifier: GPL-3.0-or-later
// What tests look at on the disk. Behind cmocka.h.
#ifndef PT_TEST_FOLDER_H
#define PT_TEST_FOLDER_H

#include "base/platform.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static inline int is_there(const char *path)
{
    struct stat status;
    return !stat(path, &status);
}

// All of a file; the caller frees it.
static inline void *bytes_of(const char *path, size_t *size)
{
    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    fseek(stream, 0, SEEK_END);
    *size = (size_t)ftell(stream);
    rewind(stream);
    void *data = malloc(*size + 1);
    assert_int_equal(fread(data, 1, *size, stream), *size);
    fclose(stream);
    return data;
}

static inline void assert_same_file(const char *path, const char *other)
{
    size_t size, wanted_size;
    char *data = bytes_of(path, &size), *wanted = bytes_of(other, &wanted_size);
    assert_int_equal(size, wanted_size);
    for (size_t i = 0; i < size; i++)
        if (data[i] != wanted[i])
            fail_msg("byte %zu of %zu differs", i, size);
    free(data);
    free(wanted);
}

#ifndef _WIN32
static inline uint32_t files_in(const char *folder)
{
    char command[300], text[32] = "";
    snprintf(command, sizeof command, "ls -A %s | wc -l", folder);
    FILE *list = popen(command, "r");
    assert_non_null(list);
    assert_non_null(fgets(text, sizeof text, list));
    pclose(list);
    return (uint32_t)atoi(text);
}
#endif

// A folder of this run alone; the name ends in XXXXXX, which becomes something else.
static inline int make_folder_of(char *name) { return !mkdtemp(name); }

// Whether the system takes at once what is given back of a mapped file. Windows does where pages are unlocked that nobody locked; wine
// only unlocks.
static inline int returned_goes_at_once(void)
{
#if defined __APPLE__
    return 0;
#elif defined _WIN32
    void *library = pt_library_open("ntdll.dll");
    const int wine = library && pt_library_find(library, "wine_get_version");
    pt_library_close(library);
    if (wine)
        printf("  not asked of wine: whether what is given back of a file goes at once\n");
    return !wine;
#else
    return 1;
#endif
}

#endif
